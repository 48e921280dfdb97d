//! `atlasfit bench surfaces`: our surface beside CGAL's alpha wrap, advancing front and Poisson of the same
//! denoised, oriented points.
//!
//! True surfaces are sampled with noise here; `tests/peers/surfaces.cpp` makes the peers' surfaces.

use super::shared::{cancelled, median};
use crate::console::{Console, RunArgs};
use crate::files;
use anyhow::{Context as _, Result, bail};
use atlasfit::geometry::{PointCloud, TriMesh};
use atlasfit::measure::{self, DistanceOptions, sample};
use atlasfit::numeric::Rng;
use atlasfit::pipeline::{DenoiseOptions, Denoised, Outliers};
use atlasfit::{Stage, Vec3, denoise};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Options of `bench surfaces`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// True surfaces: meshes
    #[arg(required = true)]
    truths: Vec<PathBuf>,
    /// Standard deviations of the noise, in shares of the longest side
    #[arg(long, value_delimiter = ',', default_value = "0.002,0.005,0.01")]
    sigmas: Vec<f64>,
    /// Points of each scan
    #[arg(long, default_value_t = 16_000)]
    count: usize,
    /// The peers' program: tests/peers/surfaces.cpp, compiled as its head says
    #[arg(long, value_name = "PROGRAM")]
    peers: PathBuf,
    /// Which of them
    #[arg(long, value_delimiter = ',', default_value = "alpha-wrap,advancing-front,poisson")]
    methods: Vec<String>,
    #[command(flatten)]
    run: RunArgs,
}

/// A surface of a scan, measured. Lengths are in thousandths of the truth's longest side.
struct Row {
    method: String,
    accuracy: f64,
    completeness: f64,
    parts: usize,
    boundary: usize,
    non_manifold: usize,
    faces: usize,
    seconds: f64,
}

impl Row {
    fn json(&self) -> Value {
        json!({
            "method": self.method, "accuracy": self.accuracy, "completeness": self.completeness,
            "parts": self.parts, "boundary_edges": self.boundary, "non_manifold": self.non_manifold,
            "faces": self.faces, "seconds": self.seconds,
        })
    }
}

/// Measures each truth at each noise, then tells the medians.
pub fn run(args: &Args, folder: &Path, console: &Console) -> Result<()> {
    let mut text =
        String::from("| scan | surface | acc | com | parts | boundary | not manifold | faces | s |\n");
    text += "|---|---|---|---|---|---|---|---|---|\n";
    let mut all: Vec<Row> = Vec::new();
    let mut cells = Vec::new();
    for path in &args.truths {
        let truth = files::load(path, &args.run, console)?.into_mesh();
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        for &sigma in &args.sigmas {
            let rows = cell(&truth, sigma, args, folder, console)
                .with_context(|| format!("{name}, noise {sigma}"))?;
            for r in &rows {
                let _ = writeln!(text, "| {name} {sigma} {}", line(r));
            }
            cells.push(json!({
                "truth": files::text(path), "sigma": sigma,
                "rows": rows.iter().map(Row::json).collect::<Vec<_>>(),
            }));
            all.extend(rows);
        }
    }
    let mut methods: Vec<&str> = Vec::new();
    all.iter().for_each(|r| {
        if !methods.contains(&r.method.as_str()) {
            methods.push(&r.method)
        }
    });
    for method in methods {
        let of = |value: fn(&Row) -> f64| {
            median(&mut all.iter().filter(|r| r.method == method).map(value).collect::<Vec<_>>())
        };
        let middle = Row {
            method: method.to_owned(),
            accuracy: of(|r| r.accuracy),
            completeness: of(|r| r.completeness),
            parts: of(|r| r.parts as f64) as usize,
            boundary: of(|r| r.boundary as f64) as usize,
            non_manifold: of(|r| r.non_manifold as f64) as usize,
            faces: of(|r| r.faces as f64) as usize,
            seconds: of(|r| r.seconds),
        };
        let _ = writeln!(text, "| **median** {}", line(&middle));
    }
    console.report(&text, &json!({ "cells": cells }));
    Ok(())
}

fn line(r: &Row) -> String {
    format!(
        "| {} | {:.3} | {:.3} | {} | {} | {} | {} | {:.2} |",
        r.method, r.accuracy, r.completeness, r.parts, r.boundary, r.non_manifold, r.faces, r.seconds
    )
}

/// The longest side of a mesh's box.
fn extent(mesh: &TriMesh) -> f64 {
    let side = |k: usize| {
        let of = mesh.positions.iter().map(|p| p[k]);
        of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min)
    };
    (0..3).map(side).fold(0.0, f64::max)
}

/// All surfaces of one scan.
fn cell(truth: &TriMesh, sigma: f64, args: &Args, folder: &Path, console: &Console) -> Result<Vec<Row>> {
    console.check(&args.run, "measuring")?;
    let unit = extent(truth);
    let samples =
        console.start_silent(&args.run).execute(|ctx| sample::uniform(truth, args.count, ctx.seed, ctx))?;
    let mut rng = Rng::new(1);
    let noisy = |p: Vec3| (p + Vec3::from_fn(|_| rng.normal()) * (sigma * unit)).0;
    let scan = PointCloud::from_positions(samples.iter().map(|s| s.point).map(noisy).collect());
    let options = DenoiseOptions::default().with_uv(false).with_outliers(Outliers::Drop);
    let made = denoise(&scan, &options, &mut console.start_silent(&args.run))?;
    let spent = made.report.seconds.iter().find(|(stage, _)| *stage == Stage::Surface);
    let seconds = spent.map_or(0.0, |(_, s)| *s);
    let mut rows = vec![measured("atlasfit", &made.surface, truth, seconds, args, console)?];
    let (points, off) = (folder.join("points.xyz"), folder.join("surface.off"));
    files::write(&points, oriented(&made))?;
    for method in &args.methods {
        match peer(method, &made, &points, &off, args) {
            Ok(seconds) => {
                let mesh = files::load(&off, &args.run, console)?.into_mesh();
                rows.push(measured(method, &mesh, truth, seconds, args, console)?);
            }
            Err(e) if !cancelled(&e) => console.note(format_args!("{method}: {e:#}")),
            Err(e) => return Err(e),
        }
    }
    rows.iter_mut().for_each(|r| {
        r.accuracy *= 1e3 / unit;
        r.completeness *= 1e3 / unit;
    });
    Ok(rows)
}

/// The denoised points with their normals, a line each.
fn oriented(made: &Denoised) -> String {
    let normals = made.points.normals.as_deref().unwrap_or_default();
    let mut text = String::new();
    for (p, n) in made.points.positions.iter().zip(normals) {
        let _ = writeln!(text, "{} {} {} {} {} {}", p[0], p[1], p[2], n[0], n[1], n[2]);
    }
    text
}

/// Has a peer make its surface; returns the seconds that it took.
fn peer(method: &str, made: &Denoised, points: &Path, off: &Path, args: &Args) -> Result<f64> {
    let out = Command::new(&args.peers)
        .arg(method)
        .args([points, off])
        .args([made.report.spacing, made.report.noise].map(|x| x.to_string()))
        .output()
        .with_context(|| format!("cannot start {}", args.peers.display()))?;
    if !out.status.success() {
        bail!("{}", String::from_utf8_lossy(&out.stderr).trim());
    }
    let said = String::from_utf8_lossy(&out.stdout);
    said.trim().parse().with_context(|| format!("it said {said}: seconds were expected"))
}

fn measured(
    method: &str,
    mesh: &TriMesh,
    truth: &TriMesh,
    seconds: f64,
    args: &Args,
    console: &Console,
) -> Result<Row> {
    let options = DistanceOptions::default();
    let d = console.start_silent(&args.run).execute(|ctx| measure::surface(mesh, truth, &options, ctx))?;
    let t = &d.topology;
    Ok(Row {
        method: method.to_owned(),
        accuracy: d.accuracy.rms,
        completeness: d.completeness.rms,
        parts: t.parts,
        boundary: t.boundary_edges,
        non_manifold: t.non_manifold_edges + t.non_manifold_vertices,
        faces: t.faces,
        seconds,
    })
}
