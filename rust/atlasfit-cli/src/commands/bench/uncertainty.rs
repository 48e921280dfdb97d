//! `atlasfit bench uncertainty`: how often intervals of 90% hold the true distance, and what they cost.
//!
//! The scans are those of `bench denoise`. Points and vertices are measured against the true surface; points
//! that were found to be outliers and vertices that are marked as extrapolated are counted apart.

use super::cells::{self, Cell, CellArgs};
use super::shared::median;
use crate::console::Console;
use crate::files;
use anyhow::{Result, bail};
use atlasfit::geometry::{Attribute, PointCloud, TriMesh};
use atlasfit::measure::Locator;
use atlasfit::numeric::vec3;
use atlasfit::pipeline::{EXTRAPOLATED, UNCERTAINTY};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

/// Options of `bench uncertainty`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    cells: CellArgs,
    /// Fits per cell with uncertainty and without, in turn; the median times count
    #[arg(long, default_value_t = 1, value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=100))]
    repeat: u32,
}

/// The noise, where none is named.
const SIGMAS: [f64; 3] = [0.002, 0.005, 0.01];
/// Standard deviations that hold 90% of a Gaussian.
const NINETY: f64 = 1.6449;
/// What coverage should be.
const GOOD: std::ops::RangeInclusive<f64> = 0.85..=0.95;

/// One cell's figures.
struct Row {
    cell: String,
    points: f64,
    vertices: f64,
    /// Vertices marked as extrapolated.
    extrapolated: usize,
    /// By how much the residuals widen; not a number where they could not tell.
    factor: f64,
    /// Root mean squares: of the true distances, of the standard deviations.
    error: f64,
    sd: f64,
    /// Time with uncertainty over time without.
    cost: f64,
}

/// Fits and measures cell after cell.
pub fn run(args: &Args, folder: &Path, console: &Console) -> Result<()> {
    let (rows, failed) = cells::rows(&args.cells, &SIGMAS, console, line, |spec, which| {
        measure(args, &Cell::make(spec, which, folder, console)?, console)
    })?;
    report(&rows, &failed, console);
    cells::ended(rows.len(), failed.len())
}

fn column<'a>(attributes: &'a [Attribute], name: &str) -> &'a [f64] {
    Attribute::named(attributes, name).map_or(&[], |a| &a.values)
}

fn measure(args: &Args, cell: &Cell, console: &Console) -> Result<Row> {
    let run = &args.cells.run;
    let scan = files::load(&cell.scan, run, console)?.cloud;
    let (mut with, mut without, mut last) = (Vec::new(), Vec::new(), None);
    for _ in 0..args.repeat {
        for (uncertainty, times) in [(false, &mut without), (true, &mut with)] {
            let options = args.cells.options().with_uv(false).with_uncertainty(uncertainty);
            let start = Instant::now();
            last = Some(atlasfit::denoise(&scan, &options, &mut console.start_silent(run))?);
            times.push(start.elapsed().as_secs_f64());
        }
    }
    let Some(done) = last else { bail!("no fit was run") };
    let far = |at: &[[f64; 3]]| distances(at, &cell.truth, args, console);
    let on = |i: usize| done.point_chart[i] != u32::MAX;
    let (sd, distance) = (column(&done.points.attributes, UNCERTAINTY), far(&done.points.positions)?);
    let points: Vec<[f64; 2]> = (0..sd.len()).filter(|&i| on(i)).map(|i| [distance[i], sd[i]]).collect();
    let (sd, distance) = (column(&done.surface.attributes, UNCERTAINTY), far(&done.surface.positions)?);
    let invented = column(&done.surface.attributes, EXTRAPOLATED);
    let vertices: Vec<[f64; 2]> =
        (0..sd.len()).filter(|&i| invented[i] == 0.0).map(|i| [distance[i], sd[i]]).collect();
    let rms = |k: usize| (points.iter().map(|p| p[k] * p[k]).sum::<f64>() / points.len() as f64).sqrt();
    Ok(Row {
        cell: cell.spec.to_string(),
        points: covered(&points),
        vertices: covered(&vertices),
        extrapolated: invented.iter().filter(|e| **e > 0.0).count(),
        factor: done.report.uncertainty_factor.unwrap_or(f64::NAN),
        error: rms(0),
        sd: rms(1),
        cost: median(&mut with) / median(&mut without),
    })
}

/// Distances of places to the true surface.
fn distances(at: &[[f64; 3]], truth: &TriMesh, args: &Args, console: &Console) -> Result<Vec<f64>> {
    let cloud = PointCloud::from_positions(at.to_vec());
    let feet = console
        .start_silent(&args.cells.run)
        .execute(|ctx| Locator::new(truth, ctx)?.nearest_all(vec3::of(&cloud.positions), ctx))?;
    Ok(feet.iter().map(|f| f.as_ref().map_or(f64::INFINITY, |f| f.distance2.sqrt())).collect())
}

/// The share of distances within their intervals.
fn covered(all: &[[f64; 2]]) -> f64 {
    all.iter().filter(|[d, sd]| *d <= NINETY * sd).count() as f64 / all.len() as f64
}

fn line(r: &Row) -> String {
    let factor = if r.factor.is_nan() { "-".into() } else { format!("{:.2}", r.factor) };
    format!(
        "| {} | {:.3} | {:.3} | {} | {factor} | {:.3} | {:.3} | {:.3} |",
        r.cell,
        r.points,
        r.vertices,
        r.extrapolated,
        1e3 * r.error,
        1e3 * r.sd,
        r.cost
    )
}

fn report(rows: &[Row], failed: &[String], console: &Console) {
    let mut text = String::from(
        "Coverage of 90% intervals; lengths in thousandths of the shape.\n\n\
         | scan | points | vertices | extrapolated | widened | rms error | rms sd | time |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    rows.iter().for_each(|r| {
        let _ = writeln!(text, "{}", line(r));
    });
    let good = |value: fn(&Row) -> f64| rows.iter().filter(|r| GOOD.contains(&value(r))).count();
    let mut cost: Vec<f64> = rows.iter().map(|r| r.cost).collect();
    let cost = median(&mut cost);
    let (points, vertices) = (good(|r| r.points), good(|r| r.vertices));
    let _ = writeln!(
        text,
        "\n85 to 95% of points in {points} of {n} scans, of vertices in {vertices}; {cost:.3} times the time \
         of denoising (median)",
        n = rows.len()
    );
    failed.iter().for_each(|f| {
        let _ = writeln!(text, "failed: {f}");
    });
    let cells: Vec<Value> = rows
        .iter()
        .map(|r| {
            json!({
                "cell": r.cell, "points": r.points, "vertices": r.vertices,
                "extrapolated": r.extrapolated, "factor": crate::number::json(r.factor),
                "rms_error": r.error, "rms_sd": r.sd, "cost": r.cost,
            })
        })
        .collect();
    console.answer(
        &text,
        &json!({ "cells": cells, "points_good": points, "vertices_good": vertices, "cost": cost,
            "failed": failed }),
    );
}
