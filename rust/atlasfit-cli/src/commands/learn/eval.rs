//! `atlasfit learn eval`.

use super::args::Eval;
use super::job::{execute, plain};
use crate::console::Console;
use crate::files;
use crate::number::json as number;
use anyhow::Result;
use atlasfit_learn::checkpoint;
use atlasfit_learn::correspond::{Errors, errors};
use atlasfit_learn::data::{Dataset, Split};
use atlasfit_learn::eval::{Answers, Input, Row, constant, table};
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Measures.
pub fn run(args: &Eval, console: &Console) -> Result<()> {
    let data = Dataset::open(&args.data).map_err(plain)?;
    let device = atlasfit_learn::device(&args.device.device).map_err(plain)?;
    let all = Answers::read(&data, Split::Test).map_err(plain)?;
    let samples = args.samples as usize;
    let flat = execute(&args.run, false, console, |ctx| constant(&data, Split::Test, samples, ctx))?;
    let mut text = format!("constant answer: Chamfer {:.2}e-3\n", 1e3 * flat);
    let mut models = Vec::new();
    for path in &args.models {
        let loaded = checkpoint::load(path, &device).map_err(plain)?;
        let model = &loaded.model;
        let mut inputs = serde_json::Map::new();
        for input in [Input::Points, Input::Image] {
            if !input.is_taken_by(model) {
                continue;
            }
            let side = (samples as f64 / model.recipe.charts as f64).sqrt().round() as usize;
            let made = data.manifest.source == "generator" && args.pairs > 0;
            let (rows, pairs) = execute(&args.run, false, console, |ctx| {
                let rows = table(model, &all, input, samples, ctx)?;
                let pairs = match made {
                    true => errors(model, &data, input, args.pairs as usize, side, ctx)?,
                    false => Vec::new(),
                };
                Ok((rows, pairs))
            })?;
            let _ = writeln!(
                text,
                "\n{}: {:?} from {}, {} parameters, stretch weight {}",
                path.display(),
                model.recipe.decoder,
                input.name(),
                model.params.count(),
                loaded.recipe.train.stretch
            );
            text += &written(&rows, &pairs);
            inputs.insert(input.name().into(), told(&rows, &pairs));
        }
        models.push(json!({
            "model": files::text(path), "parameters": model.params.count(),
            "stretch_weight": loaded.recipe.train.stretch, "inputs": inputs,
        }));
    }
    console.answer(&text, &json!({ "constant": number(flat), "models": models }));
    Ok(())
}

/// The mean over all shapes, as one more row.
fn mean(rows: &[Row], of: impl Fn(&Row) -> f64) -> f64 {
    let shapes: usize = rows.iter().map(|r| r.shapes).sum();
    rows.iter().map(|r| of(r) * r.shapes as f64).sum::<f64>() / shapes.max(1) as f64
}

/// The table as text.
fn written(rows: &[Row], pairs: &[Errors]) -> String {
    let mut text = format!(
        "{:<12}{:>7}{:>14}{:>10}{:>10}{:>10}{:>12}{:>12}{:>12}\n",
        "family",
        "shapes",
        "Chamfer x1e3",
        "overlap",
        "stretch",
        "conformal",
        "corr. eucl.",
        "corr. geod.",
        "nearest"
    );
    for row in rows {
        let _ = write!(
            text,
            "{:<12}{:>7}{:>14.2}{:>9.1}%{:>10.2}{:>10.2}",
            row.family,
            row.shapes,
            1e3 * row.chamfer,
            100.0 * row.overlap,
            row.stretch,
            row.conformal
        );
        if let Some(p) = pairs.iter().find(|p| p.family == row.family) {
            let _ = write!(text, "{:>12.3}{:>12.3}{:>12.3}", p.euclidean, p.geodesic, p.nearest);
        }
        text.push('\n');
    }
    let shapes: usize = rows.iter().map(|r| r.shapes).sum();
    let _ = write!(
        text,
        "{:<12}{shapes:>7}{:>14.2}{:>9.1}%{:>10.2}{:>10.2}",
        "mean",
        1e3 * mean(rows, |r| r.chamfer),
        100.0 * mean(rows, |r| r.overlap),
        mean(rows, |r| r.stretch),
        mean(rows, |r| r.conformal)
    );
    if !pairs.is_empty() {
        let of = |f: fn(&Errors) -> f64| pairs.iter().map(f).sum::<f64>() / pairs.len() as f64;
        let _ = write!(
            text,
            "{:>12.3}{:>12.3}{:>12.3}",
            of(|p| p.euclidean),
            of(|p| p.geodesic),
            of(|p| p.nearest)
        );
    }
    text + "\n"
}

/// The table as JSON.
fn told(rows: &[Row], pairs: &[Errors]) -> Value {
    let rows: Vec<Value> = rows
        .iter()
        .map(|r| {
            let pair = pairs.iter().find(|p| p.family == r.family);
            json!({
                "family": r.family, "shapes": r.shapes, "chamfer": number(r.chamfer),
                "overlap": number(r.overlap), "stretch": number(r.stretch), "conformal": number(r.conformal),
                "correspondence": pair.map(|p| number(p.euclidean)),
                "correspondence_geodesic": pair.map(|p| number(p.geodesic)),
                "correspondence_nearest": pair.map(|p| number(p.nearest)),
            })
        })
        .collect();
    rows.into()
}
