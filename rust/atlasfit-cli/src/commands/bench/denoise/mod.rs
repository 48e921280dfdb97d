//! `atlasfit bench denoise`: our figures beside the peers'.
//!
//! Shapes and noisy samples come from `tests/peers/shapes.py`, the peers' surfaces from
//! `tests/peers/meshlab.py`; all are measured here, by the same code. The oracle is the best of the peers'
//! settings in each cell: who picks it must know the truth.

mod row;
mod table;

use super::against::Against;
use super::peers::{MeshlabJob, Scripts};
use super::shared::{cancelled, median};
use crate::console::{Console, RunArgs};
use crate::files;
use anyhow::{Result, bail};
use atlasfit::DenoiseOptions;
use atlasfit::geometry::TriMesh;
use atlasfit::measure::{DistanceOptions, SurfaceDistance, points, surface, uv};
use atlasfit::pipeline::Denoised;
use row::{Cache, POINT_FIGURES, Row, UV_FIGURES};
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Options of `bench denoise`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Shapes: ring, spiral, mobius, or names of PLY meshes in the data folder
    #[arg(long, value_delimiter = ',', default_value = "bunny,dragon,car,cup,mobius,chair,spiral,ring")]
    shapes: Vec<String>,
    /// Standard deviations of the noise, for a shape of size 1
    #[arg(long, value_delimiter = ',', default_value = "0.002,0.005,0.01,0.02")]
    sigmas: Vec<f64>,
    /// Points per scan
    #[arg(long, default_value_t = 16_000, value_name = "N")]
    count: usize,
    /// Fits per cell, ours and the peers'; the median time counts
    #[arg(
        long,
        default_value_t = 1,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=100)
    )]
    repeat: u32,
    /// Poisson settings DEPTH,NEIGHBOURS,WEIGHT, the default one first
    #[arg(long, value_delimiter = '/', default_value = "7,20,4/7,30,2/7,40,1/8,20,4")]
    settings: Vec<String>,
    /// Leave the peers out
    #[arg(long)]
    no_peers: bool,
    /// Run the peers only
    #[arg(long, conflicts_with = "no_peers")]
    only_peers: bool,
    /// Keep the peers' results in this file (JSON lines) and take them from it. Times from it are marked with
    /// *
    #[arg(long, value_name = "FILE")]
    peer_cache: Option<PathBuf>,
    /// Time this build and another one (a program) in turn instead: `denoise` of each cell with default
    /// options, --repeat runs of each; nothing else is measured
    #[arg(long, value_name = "PROGRAM", conflicts_with_all = ["only_peers", "markdown", "csv", "peer_cache"])]
    against: Option<PathBuf>,
    /// Write the table as Markdown
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Write all figures as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// The Python that has numpy, and pymeshlab for the peers
    #[arg(long, default_value = "python3", value_name = "PROGRAM")]
    python: PathBuf,
    /// The folder of shapes.py and meshlab.py
    #[arg(long, default_value = "tests/peers", value_name = "DIR")]
    scripts: PathBuf,
    /// Keep scans and surfaces in this folder
    #[arg(long, value_name = "DIR")]
    pub keep: Option<PathBuf>,
    #[command(flatten)]
    run: RunArgs,
}

/// A shape with a noise: one scan, and the surfaces that are made of it.
struct Cell<'a> {
    shape: &'a str,
    sigma: f64,
    scan: PathBuf,
    truth: TriMesh,
}

/// The benchmark at work.
struct Bench<'a> {
    args: &'a Args,
    folder: &'a Path,
    console: &'a Console,
    cache: Cache<'a>,
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
        cache: Cache::read(args.peer_cache.as_deref(), args.count)?,
        with_peers: !args.no_peers,
        rows: Vec::new(),
        failed: Vec::new(),
    };
    if let Some(other) = &args.against {
        return bench.in_turn(other);
    }
    for &sigma in &args.sigmas {
        for shape in &args.shapes {
            console.check(&args.run, "measuring")?;
            let cell = bench.cell(shape, sigma)?;
            if !args.only_peers {
                bench.fit(&cell)?;
            }
            if bench.with_peers {
                bench.ask_peers(&cell)?;
            }
        }
    }
    bench.report()
}

impl<'a> Bench<'a> {
    fn scripts(&self) -> Scripts<'a> {
        Scripts { python: &self.args.python, folder: &self.args.scripts }
    }

    /// Makes the scan of a cell.
    fn cell<'s>(&self, shape: &'s str, sigma: f64) -> Result<Cell<'s>> {
        let truth = self.folder.join(format!("{shape}.ply"));
        let scan = self.folder.join(format!("{shape}-{sigma}.ply"));
        let (spread, count) = (sigma.to_string(), self.args.count.to_string());
        self.scripts().run("shapes.py", &[&shape, &spread, &truth, &scan, &"--count", &count])?;
        let truth = files::load(&truth, &self.args.run, self.console)?.into_mesh();
        Ok(Cell { shape, sigma, scan, truth })
    }

    /// Times each cell with this build and another one.
    fn in_turn(&self, other: &Path) -> Result<()> {
        let mut times = Against::new(other, self.args.repeat);
        let (out, threads) = (self.folder.join("in-turn.ply"), self.args.run.threads.to_string());
        for &sigma in &self.args.sigmas {
            for shape in &self.args.shapes {
                self.console.check(&self.args.run, "measuring")?;
                let cell = self.cell(shape, sigma)?;
                let arguments: [&dyn AsRef<OsStr>; 6] =
                    [&"denoise", &cell.scan, &"-o", &out, &"--threads", &threads];
                times.time(&format!("{shape} {sigma}"), &arguments.map(AsRef::as_ref), self.console)?;
            }
        }
        times.report(self.console);
        Ok(())
    }

    /// Adds our own row of a cell. One that fails must not cost the others.
    fn fit(&mut self, cell: &Cell<'_>) -> Result<()> {
        match self.ours(cell) {
            Ok(row) => {
                self.console.note(row.summary());
                self.rows.push(row);
            }
            Err(e) if !cancelled(&e) => {
                self.failed.push(format!("{} {}: {e:#}", cell.shape, cell.sigma));
                self.console.note(format_args!("failed: {} {}: {e:#}", cell.shape, cell.sigma));
            }
            Err(e) => return Err(e),
        }
        Ok(())
    }

    /// Our own fit of one cell.
    fn ours(&self, cell: &Cell<'_>) -> Result<Row> {
        let (args, console) = (self.args, self.console);
        let cloud = files::load(&cell.scan, &args.run, console)?.cloud;
        let mut times = Vec::new();
        let mut last = None;
        for _ in 0..args.repeat {
            let start = Instant::now();
            let options = DenoiseOptions::default();
            last = Some(atlasfit::denoise(&cloud, &options, &mut console.start_silent(&args.run))?);
            times.push(start.elapsed().as_secs_f64());
        }
        let Some(outcome) = last else { bail!("no fit was run") };
        let figures = self.our_figures(&outcome, &cell.truth)?;
        if args.keep.is_some() {
            let path = self.folder.join(format!("{}-{}-ours.ply", cell.shape, cell.sigma));
            atlasfit_io::save_mesh(&path, &outcome.surface, &atlasfit_io::SaveMesh::default())?;
        }
        Ok(Row {
            shape: cell.shape.into(),
            sigma: cell.sigma,
            method: "ours".into(),
            seconds: median(&mut times),
            cached: false,
            figures,
        })
    }

    /// Figures of our surface, its UVs and our points.
    fn our_figures(&self, outcome: &Denoised, truth: &TriMesh) -> Result<Value> {
        let mut figures = self.measured(&outcome.surface, truth)?;
        let silent = || self.console.start_silent(&self.args.run);
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
    fn ask_peers(&mut self, cell: &Cell<'_>) -> Result<()> {
        let args = self.args;
        let missing: Vec<&str> = (args.settings.iter().map(String::as_str))
            .filter(|s| !self.cache.cell(cell.shape, cell.sigma).any(|r| r.method == **s))
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
        let known = self.cache.cell(cell.shape, cell.sigma);
        for row in known.filter(|r| args.settings.contains(&r.method)) {
            self.console.note(row.summary());
            self.rows.push(row.clone());
        }
        Ok(())
    }

    /// The peers' surfaces of one cell.
    fn peers(&self, cell: &Cell<'_>, settings: &[&str]) -> Result<Vec<Row>> {
        let load = |file: &Path| Ok(files::load(file, &self.args.run, self.console)?.into_mesh());
        let job = MeshlabJob { scan: &cell.scan, folder: self.folder, repeat: self.args.repeat, settings };
        let mut rows = Vec::new();
        for made in self.scripts().meshlab(&job, &load)? {
            rows.push(Row {
                shape: cell.shape.into(),
                sigma: cell.sigma,
                figures: self.measured(&made.mesh, &cell.truth)?,
                method: made.setting,
                seconds: made.seconds,
                cached: false,
            });
        }
        Ok(rows)
    }

    /// Figures of a surface.
    fn measured(&self, mesh: &TriMesh, truth: &TriMesh) -> Result<Value> {
        // The shapes have size 1, so that the share is the length.
        let d: SurfaceDistance = self
            .console
            .start_silent(&self.args.run)
            .execute(|ctx| surface(mesh, truth, &DistanceOptions::default(), ctx))?;
        let t = &d.topology;
        Ok(json!({
            "acc": d.accuracy.rms, "acc_med": d.accuracy.median, "acc_p99": d.accuracy.p99,
            "com": d.completeness.rms, "com_med": d.completeness.median, "com_p99": d.completeness.p99,
            "cd": d.chamfer, "floor": d.chamfer_floor, "f1": d.f_score,
            "normal": d.normal_consistency, "orientation": d.normal_orientation,
            "faces": t.faces, "parts": t.parts, "boundary": t.boundary_edges, "loops": t.boundary_loops,
            "nonmanifold": t.non_manifold_edges,
        }))
    }

    /// Writes the table, and fails where one of our fits failed.
    fn report(&self) -> Result<()> {
        let args = self.args;
        let mut table =
            table::table(&args.shapes, &args.sigmas, args.settings.first().map(String::as_str), &self.rows);
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
        self.console.report(&table, &json!({ "rows": json, "failed": self.failed }));
        if self.failed.is_empty() { Ok(()) } else { bail!("{} of our fits failed", self.failed.len()) }
    }
}
