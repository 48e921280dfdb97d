//! `atlasfit bench paper`: the tables and pictures of *Deep Manifold Prior*: the paper's figures beside those
//! of its networks here and of the default prior.
//!
//! Every cell is one fit. Its figures go to results.jsonl in the output folder as soon as they are known; a
//! later run takes them from there. Shapes come from `tests/peers/shapes.py`, RIMLS and screened Poisson from
//! `tests/peers/meshlab.py`; `--quick` makes its own shapes and leaves these two out.

mod args;
mod cells;
mod dots;
mod figures;
mod fits;
mod pictures;
mod published;
mod report;
mod shapes;
mod speed;

use crate::console::Console;
use anyhow::{Context as _, Result, bail};
pub use args::Args;
use cells::Bench;
use report::report;
use serde_json::json;
use shapes::shape;

/// Runs the experiments and writes report.md, report.csv and the pictures.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    const EXPERIMENTS: [&str; 7] = ["starts", "table1", "table2", "conv", "interpolation", "lambda", "dots"];
    if let Some(unknown) = args.only.iter().find(|o| !EXPERIMENTS.contains(&o.as_str())) {
        return Err(crate::console::Usage(format!(
            "no experiment {unknown}. Give any of {}",
            EXPERIMENTS.join(", ")
        ))
        .into());
    }
    std::fs::create_dir_all(&args.output)
        .with_context(|| format!("cannot make {}", args.output.display()))?;
    let mut bench = Bench::new(args, console);
    if let Some(reference) = &args.speed {
        return bench.speed(reference);
    }
    bench.read()?;
    let has = |what: &str| args.only.iter().any(|o| o == what);
    let shapes: Vec<String> =
        if args.quick { vec!["sphere".into(), "ring".into()] } else { args.shapes.clone() };
    if has("table1") {
        for name in &shapes {
            let shape = shape(name, args, console)?;
            for variant in ["S8R", "C8R"] {
                bench.explicit(name, &shape, variant)?;
            }
            bench.default_prior(name, &shape)?;
            if !bench.args.quick {
                bench.peers(name, &shape)?;
            }
        }
    }
    if has("starts") {
        bench.starts(&shapes)?;
    }
    if has("lambda") {
        bench.lambda()?;
    }
    if has("dots") {
        bench.dots()?;
    }
    if has("interpolation") {
        for name in shapes.iter().take(2) {
            bench.interpolation(name)?;
        }
    }
    if has("table2") {
        for name in &shapes {
            let shape = shape(name, args, console)?;
            for (variant, _) in published::TABLE2 {
                bench.explicit(name, &shape, variant)?;
            }
        }
    }
    // The slowest last: a run that is stopped has the rest.
    for name in &shapes {
        let shape = shape(name, args, console)?;
        if has("table1") {
            bench.implicit(name, &shape)?;
        }
        if has("conv") {
            bench.explicit(name, &shape, "conv")?;
        }
    }
    let report = report(&bench, &shapes);
    std::fs::write(args.output.join("report.md"), &report)?;
    std::fs::write(args.output.join("report.csv"), bench.csv())?;
    console.answer(&report, &json!({ "results": bench.done, "failed": bench.failed }));
    if bench.failed.is_empty() { Ok(()) } else { bail!("{} fits failed", bench.failed.len()) }
}
