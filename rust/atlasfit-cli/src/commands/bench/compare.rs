//! `atlasfit bench compare`: how much noise alone is taken for change, and how much of a dent is found.
//!
//! Each scan of `bench denoise` is compared with two others of the same shape with noise of other seeds, of
//! which the second has a dent: about the scan's middle point, a tenth of the shape wide, as deep as three of
//! the distances' standard deviations.

use super::cells::{self, Cell, CellArgs, Spec};
use super::shared::median;
use crate::console::Console;
use crate::files;
use anyhow::Result;
use atlasfit::geometry::{PointCloud, TriMesh};
use atlasfit::measure::{CompareOptions, Comparison, Locator, compare};
use atlasfit::numeric::vec3;
use atlasfit::{Denoised, Vec3};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// Options of `bench compare`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    cells: CellArgs,
}

/// The noise, where none is named.
const SIGMAS: [f64; 3] = [0.002, 0.005, 0.01];
/// How deep the dent is, in standard deviations of the distances.
const DEPTH: f64 = 3.0;
/// Its radius, for a shape of size 1; its inner three quarters are as deep as it gets.
const RADIUS: f64 = 0.1;

/// One cell's figures.
struct Row {
    cell: String,
    /// Share of the points with a counterpart.
    compared: f64,
    /// Share of those that are flagged though nothing changed.
    unchanged: f64,
    /// Share that is flagged where the dent is as deep as it gets.
    dent: f64,
    /// Mean distance there, in standard deviations of the distances.
    depth: f64,
    /// Share that is flagged outside of the dent.
    elsewhere: f64,
}

/// Compares cell after cell.
pub fn run(args: &Args, folder: &Path, console: &Console) -> Result<()> {
    let (rows, failed) = cells::rows(&args.cells, &SIGMAS, console, line, |spec, which| {
        measure(spec, which, folder, console)
    })?;
    report(&rows, &failed, console);
    cells::ended(rows.len(), failed.len())
}

fn measure(spec: Spec, which: &CellArgs, folder: &Path, console: &Console) -> Result<Row> {
    let run = &which.run;
    let load = |seed: u64| -> Result<(PointCloud, TriMesh)> {
        let cell = Cell::make(Spec { seed, ..spec.clone() }, which, folder, console)?;
        Ok((files::load(&cell.scan, run, console)?.cloud, cell.truth))
    };
    let fit = |cloud: &PointCloud, surface: bool| -> Result<Denoised> {
        let options = which.options().with_uv(false).with_uncertainty(true).with_surface(surface);
        Ok(atlasfit::denoise(cloud, &options, &mut console.start_silent(run))?)
    };
    let options = CompareOptions::default();
    let change = |before: &Denoised, after: &Denoised| -> Result<Comparison> {
        let mut silent = console.start_silent(run);
        Ok(silent.execute(|ctx| compare(&before.surface, &after.points, &options, ctx))?)
    };
    let before = fit(&load(0)?.0, true)?;
    let same = change(&before, &fit(&load(1)?.0, false)?)?;
    let mut sds: Vec<f64> = same.uncertainty.iter().copied().filter(|s| s.is_finite()).collect();
    let sd = median(&mut sds);
    let (mut dented, truth) = load(2)?;
    let inside = console.start_silent(run).execute(|ctx| dent(&mut dented, &truth, DEPTH * sd, ctx))?;
    let found = change(&before, &fit(&dented, false)?)?;
    let flagged = |counts: &dyn Fn(f64) -> bool| -> f64 {
        let known = |i: &usize| counts(inside[*i]) && found.distance[*i].is_finite();
        let which: Vec<usize> = (0..inside.len()).filter(known).collect();
        which.iter().filter(|i| found.significant[**i]).count() as f64 / which.len() as f64
    };
    let deep = found.distance.iter().zip(&inside).filter(|(d, t)| **t == 1.0 && d.is_finite());
    let (sum, count) = deep.fold((0.0, 0.0), |(sum, n), (d, _)| (sum + d, n + 1.0));
    Ok(Row {
        cell: spec.to_string(),
        compared: same.compared as f64 / same.distance.len() as f64,
        unchanged: same.changed as f64 / same.compared as f64,
        dent: flagged(&|t| t == 1.0),
        depth: sum / count / sd,
        elsewhere: flagged(&|t| t == 0.0),
    })
}

/// Pushes the points about the middle one against the true surface's normals. For each point its share of the
/// depth.
fn dent(
    scan: &mut PointCloud,
    truth: &TriMesh,
    depth: f64,
    ctx: &atlasfit::Context<'_>,
) -> atlasfit::Result<Vec<f64>> {
    let feet = Locator::new(truth, ctx)?.nearest_all(vec3::of(&scan.positions), ctx)?;
    let middle = scan.positions.get(scan.len() / 2).map_or(Vec3::ZERO, |p| Vec3(*p));
    let mut shares = vec![0.0; scan.len()];
    for ((p, foot), share) in scan.positions.iter_mut().zip(&feet).zip(&mut shares) {
        let Some(foot) = foot else { continue };
        *share = (4.0 * (1.0 - (Vec3(*p) - middle).norm() / RADIUS)).clamp(0.0, 1.0);
        let [a, b, c] = truth.triangles[foot.triangle as usize].map(|v| Vec3(truth.positions[v as usize]));
        *p = (Vec3(*p) - (b - a).cross(c - a).normalized() * (depth * *share)).0;
    }
    Ok(shares)
}

fn line(r: &Row) -> String {
    let [compared, unchanged, dent, elsewhere] =
        [r.compared, r.unchanged, r.dent, r.elsewhere].map(|x| 100.0 * x);
    let Row { cell, depth, .. } = r;
    format!("| {cell} | {compared:.1} | {unchanged:.2} | {dent:.0} | {depth:.1} | {elsewhere:.2} |")
}

fn report(rows: &[Row], failed: &[String], console: &Console) {
    let mut text = String::from(
        "Shares in %; the dent's depth in standard deviations of the distances, -3 is right.\n\n\
         | scan | compared | flagged, no change | flagged in the dent | its depth | flagged elsewhere |\n\
         |---|---|---|---|---|---|\n",
    );
    rows.iter().for_each(|r| {
        let _ = writeln!(text, "{}", line(r));
    });
    failed.iter().for_each(|f| {
        let _ = writeln!(text, "failed: {f}");
    });
    let cell = |r: &Row| -> Value {
        json!({
            "cell": r.cell, "compared": r.compared, "unchanged": r.unchanged,
            "dent": crate::number::json(r.dent), "depth": crate::number::json(r.depth),
            "elsewhere": crate::number::json(r.elsewhere),
        })
    };
    let cells: Vec<Value> = rows.iter().map(cell).collect();
    console.answer(&text, &json!({ "cells": cells, "failed": failed }));
}
