//! `atlasfit gp report`: the processes in numbers.

use super::args::{Report, TABLES};
use super::laws::{CURVES, INPUTS, NETWORKS, PARAMETER, WIDTH, WIDTHS};
use super::patches::{ASPECT, FUNCTIONS, elliptic, made, of_scan};
use crate::console::Console;
use crate::files;
use anyhow::Result;
use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3;
use atlasfit_gp::bridge::{Belief, Patch, Search, alignment, compare};
use atlasfit_gp::convolution::limit;
use atlasfit_gp::curvature::{Plane, arc_length_deviation, arc_length_draws, normal, plane_draws};
use atlasfit_gp::disk::{Expansion, Resolution};
use atlasfit_gp::kernel::{Activation, Kernel, Pair};
use atlasfit_gp::network::{convergence, monte_carlo};
use atlasfit_gp::quadrature::second_moment;
use atlasfit_gp::sample::{interval, roughness};
use atlasfit_gp::statistic::{kolmogorov, power, tail_index};
use atlasfit_gp::{batch_norm, kernel};
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Tests are failed below this p value.
const LEVEL: f64 = 0.01;
/// Draws of Monte Carlo in a layer: kernels within about 0.2 %.
const DRAWS: usize = 500_000;
/// Eigenvalues that slopes are fitted to.
const EIGENVALUES: std::ops::Range<usize> = 30..250;

/// A table.
struct Table {
    title: &'static str,
    columns: Vec<&'static str>,
    rows: Vec<Vec<String>>,
}

/// Prints the tables.
pub fn run(args: &Report, console: &Console) -> Result<()> {
    let patches = patches(args, console)?;
    let seed = args.run.seed;
    let makers: [Box<dyn FnOnce() -> Table + Send>; TABLES.len()] = [
        Box::new(move || kernels(seed)),
        Box::new(depth),
        Box::new(move || width(seed)),
        Box::new(move || curvature(seed)),
        Box::new(move || normed(seed)),
        Box::new(convolution),
        Box::new(spectra),
        Box::new(move || bridge(&patches)),
    ];
    let (mut text, mut all) = (String::new(), serde_json::Map::new());
    let wanted = |name: &str| args.only.is_empty() || args.only.iter().any(|o| o == name);
    for (name, make) in TABLES.into_iter().zip(makers).filter(|t| wanted(t.0)) {
        let table = console.apart(&args.run, "computing the tables", make)?;
        table.print(&mut text);
        all.insert(name.into(), table.json());
    }
    console.answer(&text, &Value::Object(all));
    Ok(())
}

impl Table {
    fn print(&self, out: &mut String) {
        let _ = writeln!(out, "## {}\n\n| {} |", self.title, self.columns.join(" | "));
        let _ = writeln!(out, "|{}", "---|".repeat(self.columns.len()));
        for row in &self.rows {
            let _ = writeln!(out, "| {} |", row.join(" | "));
        }
        out.push('\n');
    }

    fn json(&self) -> Value {
        let row = |row: &Vec<String>| -> Value {
            let cells = self.columns.iter().zip(row).map(|(c, x)| {
                let value = x.parse::<f64>().map_or_else(|_| json!(x), |x| json!(x));
                ((*c).to_owned(), value)
            });
            Value::Object(cells.collect())
        };
        json!({ "title": self.title, "rows": self.rows.iter().map(row).collect::<Vec<_>>() })
    }
}

fn short(x: f64) -> String {
    if x != 0.0 && x.abs() < 1e-3 { format!("{x:.1e}") } else { format!("{x:.3}") }
}

/// Two kinds of patches: round ones, and longer ones.
struct Patches {
    of: &'static str,
    round: Vec<Patch>,
    long: Vec<Patch>,
}

fn patches(args: &Report, console: &Console) -> Result<Patches> {
    let count = args.patches as usize;
    let Some(scan) = &args.scan else {
        let mut rng = Rng::stream(args.run.seed, 7);
        let mut make = || (0..count).map(|_| made(&mut rng)).collect::<Vec<_>>();
        let round = make();
        let long = make().into_iter().map(|p| squeezed(&p)).collect();
        return Ok(Patches { of: "made-up patches", round, long });
    };
    let cloud = files::load(scan, &args.run, console)?.cloud;
    let points: Vec<_> =
        vec3::of(&cloud.positions).iter().copied().filter(|p| p.iter().all(|x| x.is_finite())).collect();
    let of =
        |aspect| console.start_silent(&args.run).execute(|ctx| Ok(of_scan(&points, count, aspect, ctx)))?;
    let (round, long) = (of(1.0)?, of(ASPECT)?);
    if round.is_empty() {
        anyhow::bail!("{}: too few points for a patch of {}", scan.display(), super::patches::POINTS);
    }
    Ok(Patches { of: "patches of the scan", round, long })
}

/// A made-up patch, shorter across.
fn squeezed(patch: &Patch) -> Patch {
    Patch { at: patch.at.iter().map(|p| [p[0], p[1] / ASPECT]).collect(), heights: patch.heights.clone() }
}

fn kernels(seed: u64) -> Table {
    let mut rng = Rng::stream(seed, 8);
    let inputs = INPUTS.each_ref().map(|x| &x[..]);
    let rows = [("erf", Activation::Erf), ("ReLU", Activation::Relu), ("leaky ReLU", Activation::LeakyRelu)]
        .map(|(name, activation)| {
            let off = (0..200)
                .map(|_| {
                    let [aa, bb] = [0; 2].map(|_| 0.01 + 4.0 * rng.uniform());
                    let of = Pair { aa, ab: (2.0 * rng.uniform() - 1.0) * f64::sqrt(aa * bb), bb };
                    (activation.second_moment(of) - second_moment(activation, of)).abs()
                })
                .fold(0.0, f64::max);
            let mut row = vec![name.to_owned(), format!("{off:.1e}")];
            for depth in [1, 2, 3] {
                let weight = if activation == Activation::Erf { 1.0 } else { 2.0 };
                let kernel = Kernel { activation, depth, weight, bias: 1.0 };
                let off =
                    monte_carlo(kernel, inputs, DRAWS, &mut rng) / kernel.at(inputs[0], inputs[1]) - 1.0;
                row.push(format!("{:.2} %", 100.0 * off.abs()));
            }
            row
        })
        .into();
    Table {
        title: "Kernels: largest difference from quadrature (200 pairs), and from Monte Carlo layer by layer",
        columns: vec!["activation", "quadrature", "Monte Carlo, depth 1", "depth 2", "depth 3"],
        rows,
    }
}

fn depth() -> Table {
    let line = interval(101);
    let rows = [1, 2, 4, 8, 16]
        .map(|depth| {
            let paper = Kernel::relu(depth).with_bias(1e-4);
            let ours = Kernel::relu(depth).with_bias(0.1);
            let mut row = vec![depth.to_string()];
            row.extend([0.1, 0.5, 1.0].map(|t| format!("{:.3}", paper.correlation(&[0.0], &[t]))));
            row.push(format!("{:.3}", ours.correlation(&[0.0], &[1.0])));
            row.push(format!("{:.2}", roughness(&ours, &line)));
            row.push(format!("{:.2}", roughness(&Kernel::erf(depth), &line)));
            row
        })
        .into();
    Table {
        title: "Depth: correlation of f(0) and f(t) on an interval (ReLU); roughness: mean squared slope \
                over variance about each draw's mean, on [-1, 1]",
        columns: vec![
            "hidden layers",
            "t = 0.1, biases 0.01",
            "t = 0.5",
            "t = 1",
            "t = 1, biases 0.32",
            "roughness, biases 0.32",
            "roughness, erf",
        ],
        rows,
    }
}

fn width(seed: u64) -> Table {
    let mut rng = Rng::stream(seed, 9);
    let inputs = INPUTS.each_ref().map(|x| &x[..]);
    let rows = [1, 2, 4]
        .map(|depth| {
            let found = convergence(Kernel::relu(depth), inputs, &WIDTHS, NETWORKS, &mut rng);
            let slope = power(found.iter().map(|c| (c.width as f64, c.spread)));
            let mut row = vec![depth.to_string()];
            row.extend(found.iter().map(|c| format!("{:.3}", c.spread)));
            row.push(format!("{slope:.2}"));
            row
        })
        .into();
    Table {
        title: "Width: relative error of one ReLU network's covariance (rms), hidden layers given",
        columns: vec!["hidden layers", "width 8", "16", "32", "64", "128", "256", "slope (limit -0.5)"],
        rows,
    }
}

fn curvature(seed: u64) -> Table {
    let mut rng = Rng::stream(seed, 10);
    let mut rows = Vec::new();
    let mut add = |what: &str, of: &str, p: f64, index: f64| {
        let verdict = if p >= LEVEL { "not refused" } else { "refused" };
        rows.push(vec![what.into(), of.into(), format!("{p:.3}"), verdict.into(), format!("{index:.2}")]);
    };
    let size = |draws: &[f64]| draws.iter().map(|k| k.abs()).collect::<Vec<_>>();
    for (name, kernel) in [("arc length, ReLU", Kernel::relu(2)), ("arc length, erf", Kernel::erf(2))] {
        let deviation = arc_length_deviation(&kernel, PARAMETER);
        let draws = arc_length_draws(kernel, PARAMETER, WIDTH, CURVES, &mut rng);
        let test = kolmogorov(&draws, |k| normal(deviation, k));
        add(name, "networks", test.p, tail_index(&size(&draws), CURVES / 50));
    }
    let kernel = Kernel::erf(2);
    if let Some(plane) = Plane::new(&kernel, PARAMETER) {
        let of_process = plane.draws(20_000, &mut rng);
        let of_networks = plane_draws(kernel, PARAMETER, WIDTH, CURVES, &mut rng);
        for (of, draws) in [("process", of_process), ("networks", of_networks)] {
            let test = kolmogorov(&draws, |k| plane.below(k));
            add("coordinates, erf", of, test.p, tail_index(&size(&draws), draws.len() / 50));
        }
    }
    Table {
        title: "Curvature beside its limit: Kolmogorov-Smirnov at the level 0.01; the tail (1: no mean)",
        columns: vec!["curve", "draws of", "p", "limit", "index of the tail"],
        rows,
    }
}

fn normed(seed: u64) -> Table {
    let mut rng = Rng::stream(seed, 11);
    let count = 41;
    let rows = [("even", 1), ("cubes", 3)]
        .map(|(name, power)| {
            let batch: Vec<Vec<f64>> = (0..count)
                .map(|i| vec![2.0 * (f64::from(i) / f64::from(count - 1)).powi(power) - 1.0])
                .collect();
            let mut row = vec![name.to_owned()];
            for depth in [1, 3] {
                let kernel = Kernel::relu(depth).with_bias(0.1);
                let k = batch_norm::covariance(&kernel, &batch, 2000, &mut rng);
                let last = count as usize - 1;
                row.push(short(k[(0, last)] / (k[(0, 0)] * k[(last, last)]).sqrt()));
            }
            row
        })
        .into();
    Table {
        title: "Batch norm: correlation of f(-1) and f(1) of ReLU networks, by the samples between",
        columns: vec!["samples", "depth 1", "depth 3"],
        rows,
    }
}

fn convolution() -> Table {
    let rows = [1, 2, 3]
        .map(|blocks| {
            let picture = limit(4, blocks);
            let m = picture.side / 2;
            let mut row = vec![blocks.to_string(), picture.side.to_string()];
            row.extend([1, 2].map(|k| short(picture.correlation([m, m], [m, m + k]))));
            row.push(short(picture.unevenness(1, picture.side / 4)));
            row
        })
        .into();
    Table {
        title: "Convolutions: correlation of pixels of the limit; unevenness: how much that of neighbours \
                differs from place to place inside",
        columns: vec!["blocks", "side", "neighbours", "two apart", "unevenness"],
        rows,
    }
}

fn spectra() -> Table {
    let slope = |kernel: &(dyn Fn(kernel::Pair<f64>) -> f64 + Sync)| {
        let values = Expansion::new(kernel, Resolution::default()).values();
        format!("{:.2}", power(EIGENVALUES.map(|n| (n as f64, values[n - 1]))))
    };
    let rows = [1, 2, 3]
        .map(|depth| {
            let k = Kernel::relu(depth);
            vec![depth.to_string(), slope(&|p| k.covariance(p).ab), slope(&|p| k.tangent(p))]
        })
        .into();
    Table {
        title: "Spectra on the disk: power with which eigenvalues 30 to 250 fall (in the end -2.5, -1.5)",
        columns: vec!["hidden layers", "untrained", "tangent kernel"],
        rows,
    }
}

fn bridge(patches: &Patches) -> Table {
    let mut rows = Vec::new();
    let mut add = |what: String, value: String| rows.push(vec![what, value]);
    for depth in [1, 2, 3] {
        let kernel = Kernel::relu(depth);
        let exact = Expansion::new(|p| kernel.covariance(p).ab, Resolution::default());
        let found = alignment(&exact, FUNCTIONS);
        let held = found.held.iter().sum::<f64>() / FUNCTIONS as f64;
        let angle = |k: usize| format!("{:.1}", found.angles[k]);
        add(
            format!("first {FUNCTIONS} eigenfunctions, depth {depth}: share held by the default prior's 50"),
            format!("{held:.4}"),
        );
        add(
            format!("the same, depth {depth}: principal angles to its first {FUNCTIONS}, degrees"),
            format!("median {}, largest {}", angle(FUNCTIONS / 2), angle(FUNCTIONS - 1)),
        );
    }
    let exact = |depth| Belief::Exact(Kernel::relu(depth));
    let same: Vec<[Patch; 2]> = patches.round.iter().map(|p| [p.clone(), p.clone()]).collect();
    for depth in [1, 3] {
        let found = compare([(Belief::Default, Search::COARSE), (exact(depth), Search::FINE)], &same);
        add(
            format!(
                "{}: default prior and exact process of depth {depth}, in posterior deviations",
                patches.of
            ),
            format!("{:.2}, of {} patches", found.apart, found.patches),
        );
        add("their errors at points left out, over the noise".into(), errors(found.errors));
    }
    let found = compare([(Belief::Default, Search::COARSE), (Belief::Default, Search::FINE)], &same);
    add("smoothness in factors of 8, beside a fine search: deviations".into(), format!("{:.2}", found.apart));
    add("their errors at points left out".into(), errors(found.errors));
    let both: Vec<[Patch; 2]> = patches.long.iter().map(|p| [elliptic(p, ASPECT), p.clone()]).collect();
    let found = compare([(exact(1), Search::FINE), (exact(1), Search::FINE)], &both);
    add(
        "patches twice as long as wide: error with an elliptic domain, and a round one".into(),
        errors(found.errors),
    );
    Table { title: "The bridge to the default prior", columns: vec!["what", "value"], rows }
}

fn errors([a, b]: [f64; 2]) -> String {
    format!("{a:.3}, {b:.3}")
}
