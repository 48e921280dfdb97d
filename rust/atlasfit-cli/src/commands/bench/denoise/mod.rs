//! `atlasfit bench denoise`: our figures beside the peers'.
//!
//! Shapes and noisy samples come from `tests/peers/shapes.py`, with --scanner simulated scans from
//! `tests/peers/scanner.py`, the peers' surfaces from `tests/peers/meshlab.py`; all are measured here, by the
//! same code. What a simulated scan has not seen need not be found: completeness is that of the seen part.
//! The oracle is the best of the peers' settings in each cell: who picks it must know the truth.

mod args;
mod row;
mod table;

pub use args::Args;

use super::against::Against;
use super::cells::{self, Cell, Spec};
use super::peers::MeshlabJob;
use super::shared::{cancelled, median};
use crate::console::Console;
use crate::files;
use anyhow::{Result, bail};
use atlasfit::geometry::TriMesh;
use atlasfit::measure::{DistanceOptions, SurfaceDistance, points, surface, uv};
use atlasfit::pipeline::{Denoised, Outliers};
use row::{Cache, POINT_FIGURES, Row, UV_FIGURES};
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

/// The benchmark at work.
struct Bench<'a> {
    args: &'a Args,
    folder: &'a Path,
    console: &'a Console,
    cache: Cache<'a>,
    specs: Vec<Spec>,
    /// Whether the peers are still asked: not after they failed once.
    with_peers: bool,
    rows: Vec<Row>,
    failed: Vec<String>,
}

/// Fits and measures cell after cell, then writes the table.
pub fn run(args: &Args, folder: &Path, console: &Console) -> Result<()> {
    let mut bench = Bench {
        args,
        folder,
        console,
        cache: Cache::read(args.peer_cache.as_deref(), args.cells.count)?,
        specs: cells::specs(&args.cells)?,
        with_peers: !args.no_peers,
        rows: Vec::new(),
        failed: Vec::new(),
    };
    if let Some(other) = &args.against {
        return bench.in_turn(other);
    }
    for spec in bench.specs.clone() {
        console.check(&args.cells.run, "measuring")?;
        let cell = Cell::make(spec, &args.cells, folder, console)?;
        if !args.only_peers {
            bench.fit(&cell)?;
        }
        if bench.with_peers {
            bench.ask_peers(&cell)?;
        }
    }
    bench.report()
}

impl Bench<'_> {
    /// Times each cell with this build and another one.
    fn in_turn(&self, other: &Path) -> Result<()> {
        let mut times = Against::new(other, self.args.repeat);
        let (out, threads) = (self.folder.join("in-turn.ply"), self.args.cells.run.threads.to_string());
        for spec in &self.specs {
            self.console.check(&self.args.cells.run, "measuring")?;
            let cell = Cell::make(spec.clone(), &self.args.cells, self.folder, self.console)?;
            let arguments: [&dyn AsRef<OsStr>; 6] =
                [&"denoise", &cell.scan, &"-o", &out, &"--threads", &threads];
            times.time(&spec.to_string(), &arguments.map(AsRef::as_ref), self.console)?;
        }
        times.report(self.console);
        Ok(())
    }

    /// Adds our own row of a cell. One that fails must not cost the others.
    fn fit(&mut self, cell: &Cell) -> Result<()> {
        match self.ours(cell) {
            Ok(row) => {
                self.console.note(row.summary());
                self.rows.push(row);
            }
            Err(e) if !cancelled(&e) => {
                self.failed.push(format!("{}: {e:#}", cell.spec));
                self.console.note(format_args!("failed: {}: {e:#}", cell.spec));
            }
            Err(e) => return Err(e),
        }
        Ok(())
    }

    /// Our own fit of one cell.
    fn ours(&self, cell: &Cell) -> Result<Row> {
        let (args, console) = (self.args, self.console);
        let cloud = files::load(&cell.scan, &args.cells.run, console)?.cloud;
        let mut times = Vec::new();
        let mut last = None;
        for _ in 0..args.repeat {
            let start = Instant::now();
            // Points of a scan with strays are measured without those that were found to be strays.
            let outliers = if cell.seen.is_some() { Outliers::Drop } else { Outliers::Keep };
            let options = args.cells.options().with_outliers(outliers);
            last = Some(atlasfit::denoise(&cloud, &options, &mut console.start_silent(&args.cells.run))?);
            times.push(start.elapsed().as_secs_f64());
        }
        let Some(outcome) = last else { bail!("no fit was run") };
        let figures = self.our_figures(&outcome, cell)?;
        if args.keep.is_some() {
            let path = self.folder.join(format!("{}-{}-ours.ply", cell.spec.stem(), cell.spec.sigma));
            atlasfit_io::save_mesh(&path, &outcome.surface, &atlasfit_io::SaveMesh::default())?;
        }
        Ok(Row {
            spec: cell.spec.clone(),
            method: "ours".into(),
            seconds: median(&mut times),
            cached: false,
            figures,
        })
    }

    /// Figures of our surface, its UVs and our points.
    fn our_figures(&self, outcome: &Denoised, cell: &Cell) -> Result<Value> {
        let truth = &cell.truth;
        let mut figures = self.measured(&outcome.surface, cell)?;
        let silent = || self.console.start_silent(&self.args.cells.run);
        let p = silent().execute(|ctx| points(&outcome.points, truth, &DistanceOptions::default(), ctx))?;
        if outcome.surface.corner_uv.is_some() {
            let q = silent().execute(|ctx| uv(&outcome.surface, ctx))?;
            for (key, value) in UV_FIGURES.iter().zip([
                q.charts as f64,
                q.stretch_p95,
                q.flips as f64,
                q.overlapping_faces as f64,
                q.coverage,
            ]) {
                figures[*key] = json!(value);
            }
        }
        for (key, value) in POINT_FIGURES.iter().zip([p.accuracy.rms, p.accuracy.median, p.accuracy.p99]) {
            figures[*key] = json!(value);
        }
        Ok(figures)
    }

    /// Adds the peers' rows of a cell, from the cache as far as they are there.
    fn ask_peers(&mut self, cell: &Cell) -> Result<()> {
        let args = self.args;
        let missing: Vec<&str> = (args.settings.iter().map(String::as_str))
            .filter(|s| !self.cache.cell(&cell.spec).any(|r| r.method == **s))
            .collect();
        if !missing.is_empty() {
            match self.peers(cell, &missing) {
                Ok(fresh) => self.cache.add(fresh)?,
                Err(e) if args.only_peers || cancelled(&e) => return Err(e),
                Err(e) => {
                    self.console.note(format_args!("the peers are left out: {e:#}"));
                    self.with_peers = false;
                }
            }
        }
        let known = self.cache.cell(&cell.spec);
        for row in known.filter(|r| args.settings.contains(&r.method)) {
            self.console.note(row.summary());
            self.rows.push(row.clone());
        }
        Ok(())
    }

    /// The peers' surfaces of one cell.
    fn peers(&self, cell: &Cell, settings: &[&str]) -> Result<Vec<Row>> {
        let load = |file: &Path| Ok(files::load(file, &self.args.cells.run, self.console)?.into_mesh());
        let job = MeshlabJob { scan: &cell.scan, folder: self.folder, repeat: self.args.repeat, settings };
        let mut rows = Vec::new();
        for made in self.args.cells.scripts().meshlab(&job, &load)? {
            rows.push(Row {
                spec: cell.spec.clone(),
                figures: self.measured(&made.mesh, cell)?,
                method: made.setting,
                seconds: made.seconds,
                cached: false,
            });
        }
        Ok(rows)
    }

    /// Figures of a surface. Of a simulated scan the completeness is that of the seen part; the Chamfer
    /// distance and the F-score, which ask both ways of one surface, are left out.
    fn measured(&self, mesh: &TriMesh, cell: &Cell) -> Result<Value> {
        // The shapes have size 1, so that the share is the length.
        let distance = |truth: &TriMesh| -> Result<SurfaceDistance> {
            let options = DistanceOptions::default();
            let mut run = self.console.start_silent(&self.args.cells.run);
            Ok(run.execute(|ctx| surface(mesh, truth, &options, ctx))?)
        };
        let d = distance(&cell.truth)?;
        let (normal, orientation, t) = (d.normal_consistency, d.normal_orientation, &d.topology);
        let mut figures = json!({
            "acc": d.accuracy.rms, "acc_med": d.accuracy.median, "acc_p99": d.accuracy.p99,
            "normal": normal, "orientation": orientation,
            // Cosines with their sign and without it differ by twice those that are negative.
            "flipped": 0.5 * (1.0 - orientation / normal),
            "faces": t.faces, "parts": t.parts, "boundary": t.boundary_edges, "loops": t.boundary_loops,
            "nonmanifold": t.non_manifold_edges,
        });
        let com = match &cell.seen {
            Some(seen) => {
                figures["seen"] = json!(seen.share);
                distance(&seen.part)?.completeness
            }
            None => {
                for (key, value) in [("cd", d.chamfer), ("floor", d.chamfer_floor), ("f1", d.f_score)] {
                    figures[key] = json!(value);
                }
                d.completeness
            }
        };
        for (key, value) in [("com", com.rms), ("com_med", com.median), ("com_p99", com.p99)] {
            figures[key] = json!(value);
        }
        Ok(figures)
    }

    /// Writes the table, and fails where one of our fits failed.
    fn report(&self) -> Result<()> {
        let args = self.args;
        let mut table = table::table(&self.specs, args.settings.first().map(String::as_str), &self.rows);
        for cell in &self.failed {
            let _ = writeln!(table, "\nFailed: {cell}");
        }
        if let Some(path) = &args.markdown {
            files::write(path, &table)?;
        }
        if let Some(path) = &args.csv {
            files::write(path, row::csv(&self.rows))?;
        }
        let json: Vec<Value> = self.rows.iter().map(Row::json).collect();
        self.console.answer(&table, &json!({ "rows": json, "failed": self.failed }));
        if self.failed.is_empty() { Ok(()) } else { bail!("{} of our fits failed", self.failed.len()) }
    }
}
