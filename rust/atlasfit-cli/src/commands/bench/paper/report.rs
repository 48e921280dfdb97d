//! The report of `bench paper`, as Markdown: our figures, the paper's in brackets.

use super::args::{Beginning, Training};
use super::cells::{Bench, Trial};
use super::fits::LAMBDAS;
use super::published::{CONV, TABLE1, TABLE2};
use std::fmt::Write as _;

/// A column of a table: its title, the kind of cell, and which of the cell's figures is shown.
struct Column {
    title: &'static str,
    cell: &'static str,
    figure: &'static str,
}

/// A kind of fit in table 1, and which of the cell's figures is the seconds of the fit.
struct Method {
    title: &'static str,
    cell: &'static str,
    seconds: &'static str,
}

/// The columns of our table 1. The first are the paper's, in its order.
const METHODS: [Method; 7] = [
    Method { title: "Surface", cell: "S8R", seconds: "seconds" },
    Method { title: "Contour", cell: "C8R", seconds: "seconds" },
    Method { title: "Implicit", cell: "implicit", seconds: "seconds" },
    Method { title: "RIMLS", cell: "rimls", seconds: "fit_seconds" },
    Method { title: "SPSR", cell: "spsr", seconds: "fit_seconds" },
    Method { title: "Conv", cell: "conv", seconds: "seconds" },
    Method { title: "default prior", cell: "default", seconds: "fit_seconds" },
];

/// A Chamfer distance; a dash where it is not known.
fn number(x: Option<f64>) -> String {
    x.map_or("-".to_owned(), |x| format!("{x:.2e}"))
}

/// Our figure and, where there is one, the paper's in brackets.
fn both(ours: Option<f64>, paper: Option<f64>) -> String {
    match paper {
        Some(p) => format!("{} ({p:.2e})", number(ours)),
        None => number(ours),
    }
}

/// The whole report.
pub fn report(bench: &Bench<'_>, shapes: &[String]) -> String {
    let mut out = heading(bench);
    starts(&mut out, bench, shapes);
    table_1(&mut out, bench, shapes);
    table_2(&mut out, bench, shapes);
    conclusions(&mut out, bench, shapes);
    other_experiments(&mut out, bench, shapes);
    for failed in &bench.failed {
        let _ = writeln!(out, "\nFailed: {failed}");
    }
    out
}

fn heading(bench: &Bench<'_>) -> String {
    let recipe = match bench.args.recipe {
        _ if bench.args.quick => "3 steps, to see that everything runs".to_owned(),
        Training::Fast => "fast (coarse to fine)".to_owned(),
        Training::Paper => format!("paper, at most {} steps", bench.args.steps),
    };
    format!(
        "# Deep Manifold Prior, reproduced\n\n\
         Chamfer distance as in the paper (16,000 samples, mean squared distance, both directions added). \
         Recipe: {recipe}; weight of the stretch term {}. In brackets the paper's figure.\n\n",
        bench.args.stretch
    )
}

/// A table with a line per shape and one of means. `paper` gives the paper's figure of a shape, or of "mean",
/// by the number of the column.
fn table(
    out: &mut String,
    bench: &Bench<'_>,
    shapes: &[String],
    columns: &[Column],
    paper: &dyn Fn(&str, usize) -> Option<f64>,
) {
    let _ = write!(out, "| shape |");
    for column in columns {
        let _ = write!(out, " {} |", column.title);
    }
    let _ = writeln!(out, "\n|{}", "---|".repeat(columns.len() + 1));
    for name in shapes {
        let _ = write!(out, "| {name} |");
        for (i, column) in columns.iter().enumerate() {
            let ours = bench.figure(&format!("{} {name}", column.cell), column.figure);
            let _ = write!(out, " {} |", both(ours, paper(name, i)));
        }
        out.push('\n');
    }
    out.push_str("| mean |");
    for (i, column) in columns.iter().enumerate() {
        let ours = bench.mean(column.cell, column.figure, shapes.iter());
        let _ = write!(out, " {} |", both(ours, paper("mean", i)));
    }
    out.push('\n');
}

/// Table 1, the same where surfaces are trimmed, and the seconds.
fn table_1(out: &mut String, bench: &Bench<'_>, shapes: &[String]) {
    out.push_str("## Table 1\n\n");
    let columns = METHODS.map(|m| Column { title: m.title, cell: m.cell, figure: "cd" });
    table(out, bench, shapes, &columns, &|name, column| match (name, column) {
        ("mean", 5) => Some(CONV),
        (_, 5..) => None,
        ("mean", _) => Some(TABLE1.iter().map(|t| t.1[column]).sum::<f64>() / TABLE1.len() as f64),
        _ => TABLE1.iter().find(|t| t.0 == name).map(|t| t.1[column]),
    });
    out.push_str("\n## Trimmed to what the scan supports\n\n");
    let columns = [
        Column { title: "Surface", cell: "S8R", figure: "trimmed" },
        Column { title: "Implicit", cell: "implicit", figure: "trimmed" },
        Column { title: "Conv", cell: "conv", figure: "trimmed" },
        Column { title: "default prior", cell: "default", figure: "cd" },
    ];
    table(out, bench, shapes, &columns, &|_, _| None);
    out.push_str("\n## Seconds\n\n");
    let columns = METHODS.map(|m| Column { title: m.title, cell: m.cell, figure: m.seconds });
    table(out, bench, shapes, &columns, &|_, _| None);
}

/// S8R from each start: mean over the seeds and, in brackets, least and largest.
fn starts(out: &mut String, bench: &Bench<'_>, shapes: &[String]) {
    const FIGURES: [(&str, &str); 3] =
        [("by area", "cd"), ("trimmed", "trimmed"), ("by parameter", "by_parameter")];
    for start in [Beginning::Patches, Beginning::Torch] {
        let trials: Vec<Trial> = bench.trials().into_iter().filter(|t| t.start == start).collect();
        let of = |name: &str, figure: &str| -> Option<Vec<f64>> {
            trials.iter().map(|t| bench.figure_of(&format!("S8R {name}"), figure, *t)).collect()
        };
        let _ = writeln!(
            out,
            "## S8R, charts that start {}, {} seeds\n\n| shape | by area | trimmed | by parameter | paper | \
             all seeds at or below the paper's |\n|---|---|---|---|---|---|",
            if start == Beginning::Patches { "as small patches" } else { "as torch starts" },
            bench.args.seeds
        );
        let mut sums = FIGURES.map(|_| Some(vec![0.0; trials.len()]));
        let mut below = 0;
        for name in shapes {
            let _ = write!(out, "| {name} |");
            for ((_, figure), sum) in FIGURES.iter().zip(&mut sums) {
                let values = of(name, figure);
                let _ = write!(out, " {} |", spread(values.as_deref()));
                *sum = sum.take().zip(values).map(|(s, v)| s.iter().zip(v).map(|(s, v)| s + v).collect());
            }
            let paper = TABLE1.iter().find(|t| t.0 == name).map(|t| t.1[0]);
            let within = |figure| Some(of(name, figure)?.iter().all(|x| Some(*x) <= paper));
            let both = within("cd").zip(within("trimmed")).filter(|_| paper.is_some());
            below += usize::from(both == Some((true, true)));
            let said = match both {
                Some((true, true)) => "yes",
                Some((false, true)) => "trimmed",
                Some(_) => "no",
                None => "-",
            };
            let _ = writeln!(out, " {} | {said} |", number(paper));
        }
        let _ = write!(out, "| mean |");
        for sum in sums {
            let means: Option<Vec<f64>> = sum.map(|s| s.iter().map(|x| x / shapes.len() as f64).collect());
            let _ = write!(out, " {} |", spread(means.as_deref()));
        }
        let paper = TABLE1.iter().map(|t| t.1[0]).sum::<f64>() / TABLE1.len() as f64;
        let _ = writeln!(out, " {} | {below} of {} |\n", number(Some(paper)), shapes.len());
    }
}

/// Mean of some figures, and in brackets the least and the largest.
fn spread(values: Option<&[f64]>) -> String {
    let Some(values) = values.filter(|v| !v.is_empty()) else { return "-".into() };
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    format!("{mean:.2e} ({least:.2e} to {largest:.2e})")
}

fn table_2(out: &mut String, bench: &Bench<'_>, shapes: &[String]) {
    out.push_str("\n## Table 2\n\n| variant | mean over the shapes | steps | seconds |\n|---|---|---|---|\n");
    for (variant, paper) in TABLE2 {
        let mean = |figure: &str| bench.mean(variant, figure, shapes.iter());
        let short = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.0}"));
        let _ = writeln!(
            out,
            "| {variant} | {} | {} | {} |",
            both(mean("cd"), Some(paper)),
            short(mean("steps")),
            short(mean("seconds"))
        );
    }
}

/// What the paper concludes from its tables, and whether our figures say so.
fn conclusions(out: &mut String, bench: &Bench<'_>, shapes: &[String]) {
    let (thin, wide): (Vec<&String>, Vec<&String>) =
        shapes.iter().partition(|s| ["ring", "spiral"].contains(&s.as_str()));
    let all: Vec<&String> = shapes.iter().collect();
    out.push_str(
        "\n## Conclusions of the paper\n\n| claim | better | worse | ours agree |\n|---|---|---|---|\n",
    );
    for (claim, better, worse, some) in [
        ("stretch helps 8 surfaces: S8R < S8", "S8R", "S8", &all),
        ("8 surfaces are better than 1: S8R < S1R", "S8R", "S1R", &all),
        ("8 curves are better than 1: C8R < C1R", "C8R", "C1R", &all),
        ("surfaces for surfaces: S8R < C8R", "S8R", "C8R", &wide),
        ("curves for ring and spiral: C8R < S8R", "C8R", "S8R", &thin),
    ] {
        let of = |variant: &str| bench.mean(variant, "cd", some.iter().copied());
        if let (Some(better), Some(worse)) = (of(better), of(worse)) {
            let agree = if better < worse { "yes" } else { "no" };
            let _ = writeln!(out, "| {claim} | {better:.2e} | {worse:.2e} | {agree} |");
        }
    }
}

/// Interpolation, the stretch's weight, the dotted drawing.
fn other_experiments(out: &mut String, bench: &Bench<'_>, shapes: &[String]) {
    out.push_str("\n## Interpolation from 1,000 points, one chart\n\n| shape | S1R | S1 |\n|---|---|---|\n");
    for name in shapes.iter().take(2) {
        let of = |v: &str| number(bench.figure(&format!("interpolation {v} {name}"), "cd"));
        let _ = writeln!(out, "| {name} | {} | {} |", of("S1R"), of("S1"));
    }
    out.push_str(
        "\n## Stretch: a sphere with 8 charts\n\n\
         Overlap: share of samples nearer to another chart's than to their own chart's. \
         Distortion: mean ratio of the longer to the shorter diagonal direction of a grid cell's map.\n\n\
         | lambda | overlap | distortion | Chamfer |\n|---|---|---|---|\n",
    );
    for lambda in LAMBDAS {
        let of = |f: &str| bench.figure(&format!("lambda {lambda}"), f);
        let three = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.3}"));
        let _ = writeln!(
            out,
            "| {lambda} | {} | {} | {} |",
            three(of("overlap")),
            three(of("distortion")),
            number(of("cd"))
        );
    }
    let _ = writeln!(
        out,
        "\n## A dotted drawing\n\n\
         Mean distance of the drawing's true line to what was made of its dots: the dots themselves {}, \
         a curve prior {}, a convolutional network fitted to the picture {}.",
        number(bench.figure("dots", "dots")),
        number(bench.figure("dots", "curve")),
        number(bench.figure("dots", "image"))
    );
}
