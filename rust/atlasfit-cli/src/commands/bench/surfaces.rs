//! `atlasfit bench surfaces`: our surface beside CGAL's alpha wrap, advancing front and Poisson of the same
//! denoised, oriented points; and our points beside the same scans smoothed by CGAL.
//!
//! True surfaces are sampled with noise here; `tests/peers/surfaces.cpp` makes the peers' surfaces and
//! points.

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
    /// Which surfaces of them
    #[arg(long, value_delimiter = ',', default_value = "alpha-wrap,advancing-front,poisson")]
    methods: Vec<String>,
    /// Which smoothed scans of them
    #[arg(long, value_delimiter = ',', default_value = "wlop,jet,bilateral")]
    smoothing: Vec<String>,
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

    fn line(&self) -> String {
        format!(
            "{} | {:.3} | {:.3} | {} | {} | {} | {} | {:.2} |",
            self.method,
            self.accuracy,
            self.completeness,
            self.parts,
            self.boundary,
            self.non_manifold,
            self.faces,
            self.seconds
        )
    }

    /// The medians of several.
    fn median(of: &[&Self]) -> Self {
        let of = |value: fn(&Self) -> f64| median(&mut of.iter().map(|r| value(r)).collect::<Vec<_>>());
        Self {
            method: String::new(),
            accuracy: of(|r| r.accuracy),
            completeness: of(|r| r.completeness),
            parts: of(|r| r.parts as f64) as usize,
            boundary: of(|r| r.boundary as f64) as usize,
            non_manifold: of(|r| r.non_manifold as f64) as usize,
            faces: of(|r| r.faces as f64) as usize,
            seconds: of(|r| r.seconds),
        }
    }
}

/// The points of a scan, smoothed and measured, in the same unit.
struct Smoothed {
    method: String,
    accuracy: f64,
    points: usize,
    seconds: f64,
}

impl Smoothed {
    fn json(&self) -> Value {
        json!({
            "method": self.method, "accuracy": self.accuracy, "points": self.points,
            "seconds": self.seconds,
        })
    }

    fn line(&self) -> String {
        format!("{} | {:.3} | {} | {:.2} |", self.method, self.accuracy, self.points, self.seconds)
    }

    /// The medians of several.
    fn median(of: &[&Self]) -> Self {
        let of = |value: fn(&Self) -> f64| median(&mut of.iter().map(|r| value(r)).collect::<Vec<_>>());
        Self {
            method: String::new(),
            accuracy: of(|r| r.accuracy),
            points: of(|r| r.points as f64) as usize,
            seconds: of(|r| r.seconds),
        }
    }
}

/// What was made of one scan.
struct Cell {
    surfaces: Vec<Row>,
    points: Vec<Smoothed>,
}

/// Measures each truth at each noise, then tells the medians.
pub fn run(args: &Args, folder: &Path, console: &Console) -> Result<()> {
    let mut surfaces =
        String::from("| scan | surface | acc | com | parts | boundary | not manifold | faces | s |\n");
    surfaces += "|---|---|---|---|---|---|---|---|---|\n";
    let mut points = String::from("| scan | points | acc | count | s |\n|---|---|---|---|---|\n");
    let (mut cells, mut said) = (Vec::new(), Vec::new());
    for path in &args.truths {
        let truth = files::load(path, &args.run, console)?.into_mesh();
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        for &sigma in &args.sigmas {
            let cell = cell(&truth, sigma, args, folder, console)
                .with_context(|| format!("{name}, noise {sigma}"))?;
            for r in &cell.surfaces {
                let _ = writeln!(surfaces, "| {name} {sigma} | {}", r.line());
            }
            for r in &cell.points {
                let _ = writeln!(points, "| {name} {sigma} | {}", r.line());
            }
            said.push(json!({
                "truth": files::text(path), "sigma": sigma,
                "rows": cell.surfaces.iter().map(Row::json).collect::<Vec<_>>(),
                "points": cell.points.iter().map(Smoothed::json).collect::<Vec<_>>(),
            }));
            cells.push(cell);
        }
    }
    let rows: Vec<&Row> = cells.iter().flat_map(|c| &c.surfaces).collect();
    for of in by_method(&rows, |r| &r.method) {
        let middle = Row { method: of[0].method.clone(), ..Row::median(&of) };
        let _ = writeln!(surfaces, "| **median** | {}", middle.line());
    }
    let rows: Vec<&Smoothed> = cells.iter().flat_map(|c| &c.points).collect();
    for of in by_method(&rows, |r| &r.method) {
        let middle = Smoothed { method: of[0].method.clone(), ..Smoothed::median(&of) };
        let _ = writeln!(points, "| **median** | {}", middle.line());
    }
    console.answer(&format!("{surfaces}\n{points}"), &json!({ "cells": said }));
    Ok(())
}

/// The rows of each method, in the order in which methods come first.
fn by_method<'a, T>(rows: &[&'a T], method: fn(&T) -> &str) -> Vec<Vec<&'a T>> {
    let mut all: Vec<Vec<&T>> = Vec::new();
    for &row in rows {
        match all.iter_mut().find(|of| method(of[0]) == method(row)) {
            Some(of) => of.push(row),
            None => all.push(vec![row]),
        }
    }
    all
}

/// The longest side of a mesh's box.
fn extent(mesh: &TriMesh) -> f64 {
    let side = |k: usize| {
        let of = mesh.positions.iter().map(|p| p[k]);
        of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min)
    };
    (0..3).map(side).fold(0.0, f64::max)
}

/// All surfaces and points of one scan.
fn cell(truth: &TriMesh, sigma: f64, args: &Args, folder: &Path, console: &Console) -> Result<Cell> {
    console.check(&args.run, "measuring")?;
    let unit = extent(truth);
    let samples =
        console.start_silent(&args.run).execute(|ctx| sample::uniform(truth, args.count, ctx.seed, ctx))?;
    let mut rng = Rng::new(1);
    let noisy = |p: Vec3| (p + Vec3::from_fn(|_| rng.normal()) * (sigma * unit)).0;
    let scan = PointCloud::from_positions(samples.iter().map(|s| s.point).map(noisy).collect());
    let options = DenoiseOptions::default().with_uv(false).with_outliers(Outliers::Drop);
    let made = denoise(&scan, &options, &mut console.start_silent(&args.run))?;
    let (points, off) = (folder.join("points.xyz"), folder.join("surface.off"));
    let ask = |method: &str| -> Result<Option<(TriMesh, f64)>> {
        match peer(method, &made, &points, &off, args) {
            Ok(seconds) => Ok(Some((files::load(&off, &args.run, console)?.into_mesh(), seconds))),
            Err(e) if cancelled(&e) => Err(e),
            Err(e) => {
                console.note(format_args!("{method}: {e:#}"));
                Ok(None)
            }
        }
    };
    let spent = |last: Stage| {
        let upto = made.report.seconds.iter().position(|(stage, _)| *stage == last).map_or(0, |k| k + 1);
        made.report.seconds[..upto].iter().map(|(_, s)| *s).sum::<f64>()
    };
    let surface_alone = made.report.seconds.iter().find(|(stage, _)| *stage == Stage::Surface);
    let seconds = surface_alone.map_or(0.0, |(_, s)| *s);
    let mut surfaces = vec![measured("atlasfit", &made.surface, truth, seconds, args, console)?];
    files::write(&points, lines(&made.points))?;
    for method in &args.methods {
        if let Some((mesh, seconds)) = ask(method)? {
            surfaces.push(measured(method, &mesh, truth, seconds, args, console)?);
        }
    }
    let before = spent(Stage::Surface) - seconds;
    let mut smoothed = vec![
        measured_points("the scan", &scan, truth, 0.0, args, console)?,
        measured_points("atlasfit", &made.points, truth, before, args, console)?,
    ];
    files::write(&points, lines(&scan))?;
    for method in &args.smoothing {
        if let Some((mesh, seconds)) = ask(method)? {
            let cloud = PointCloud::from_positions(mesh.positions);
            smoothed.push(measured_points(method, &cloud, truth, seconds, args, console)?);
        }
    }
    let scale = 1e3 / unit;
    surfaces
        .iter_mut()
        .for_each(|r| (r.accuracy, r.completeness) = (r.accuracy * scale, r.completeness * scale));
    smoothed.iter_mut().for_each(|r| r.accuracy *= scale);
    Ok(Cell { surfaces, points: smoothed })
}

/// Points with their normals, or with none, a line each.
fn lines(cloud: &PointCloud) -> String {
    let normals = cloud.normals.as_deref().unwrap_or_default();
    let mut text = String::new();
    for (i, p) in cloud.positions.iter().enumerate() {
        let n = normals.get(i).copied().unwrap_or_default();
        let _ = writeln!(text, "{} {} {} {} {} {}", p[0], p[1], p[2], n[0], n[1], n[2]);
    }
    text
}

/// Has a peer make its surface or its points; returns the seconds that it took.
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

fn measured_points(
    method: &str,
    cloud: &PointCloud,
    truth: &TriMesh,
    seconds: f64,
    args: &Args,
    console: &Console,
) -> Result<Smoothed> {
    let options = DistanceOptions::default();
    let d = console.start_silent(&args.run).execute(|ctx| measure::points(cloud, truth, &options, ctx))?;
    Ok(Smoothed { method: method.to_owned(), accuracy: d.accuracy.rms, points: cloud.len(), seconds })
}
