//! `atlasfit tiles` and `denoise --tiles`: scans of any size in bounded memory.
//!
//! `plan` reads the scan once and writes a work folder with its points in tiles and a plan of tasks; `run`
//! runs what is left of them, or one; `merge` what comes after the tiles; `status` tells how it stands. Each
//! may be killed and goes on. docs/scale.md says how it works.

use crate::console::{Console, RunArgs, Usage};
use crate::files;
use crate::number::{count, json as number};
use anyhow::Result;
use atlasfit::DenoiseOptions;
use atlasfit_tiles::{Plan, Request, Status};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Subcommands of `tiles`.
#[derive(Debug, clap::Subcommand)]
pub enum Tiles {
    /// Read the scan once, put its points into tiles on disk, and write the plan of tasks
    Plan(Box<PlanArgs>),
    /// Run all tasks that are left, or one
    Run(TaskArgs),
    /// Run what comes after the tiles: denoised points, surface, tileset
    Merge(WorkArgs),
    /// Tell what is done, what failed, what is missing, and how long the rest takes
    Status(WorkArgs),
}

/// Options of `tiles plan`.
#[derive(Debug, clap::Args)]
pub struct PlanArgs {
    /// The scan's files, or with --simulate alone the work folder of a plan
    #[arg(required = true, value_name = "SCAN")]
    scans: Vec<PathBuf>,
    /// The surface to write as one PLY file
    #[arg(short, long, value_name = "PLY")]
    output: Option<PathBuf>,
    /// Folder for the denoised points: a file for each of the scan's, with all that it holds
    #[arg(long, value_name = "FOLDER")]
    points: Option<PathBuf>,
    /// Standard deviation of the scan's noise in its unit [default: estimated]
    #[arg(long, value_name = "LENGTH", value_parser = clap::value_parser!(f64))]
    noise: Option<f64>,
    /// Lay out no UVs
    #[arg(long)]
    no_uv: bool,
    /// Do not plan: tell how the plan in this work folder would run on so many workers, by the times of the
    /// tasks that are done
    #[arg(long, value_name = "WORKERS", value_parser = clap::value_parser!(u64).range(1..))]
    simulate: Option<u64>,
    /// With --simulate: as if the scan had so many points of the same kind
    #[arg(
        long,
        value_name = "POINTS",
        requires = "simulate",
        value_parser = clap::value_parser!(u64).range(1..)
    )]
    as_if: Option<u64>,
    #[command(flatten)]
    tiles: TileArgs,
    #[command(flatten)]
    run: RunArgs,
}

/// How a scan is cut.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Tiles")]
pub struct TileArgs {
    /// Folder for the surface in tiles: 3D Tiles 1.1 (tileset.json and GLB files, with UVs and, of a coloured
    /// scan, textures)
    #[arg(long, value_name = "FOLDER")]
    tileset: Option<PathBuf>,
    /// Points of a tile at the most, without those about it [default: 1000000, or what --max-memory allows]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1000..))]
    tile_points: Option<u64>,
    /// Folder of the work; what is in it goes on [default: beside the first output, its name with .tiles]
    #[arg(long, value_name = "FOLDER")]
    work: Option<PathBuf>,
}

/// `--tiles` of `denoise`.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Tiles")]
pub struct InTiles {
    /// Work in tiles on disk: scans larger than memory. --output is PLY, --points a folder. A run that was
    /// killed goes on
    #[arg(long)]
    tiles: bool,
    #[command(flatten)]
    how: TileArgs,
}

/// Options of `tiles run`.
#[derive(Debug, clap::Args)]
pub struct TaskArgs {
    #[command(flatten)]
    work: WorkArgs,
    /// The task to run; its name stands in plan.json
    #[arg(long, value_name = "NAME")]
    task: Option<String>,
}

/// A work folder.
#[derive(Debug, clap::Args)]
pub struct WorkArgs {
    /// The work folder
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    #[command(flatten)]
    run: RunArgs,
}

/// Where results go.
pub struct Outputs<'a> {
    /// The surface.
    pub surface: Option<&'a Path>,
    /// Folder of the denoised points.
    pub points: Option<&'a Path>,
    /// Whether files that are there may be replaced by what comes of them.
    pub force: bool,
}

/// Points of a tile where nothing is said.
const TILE_POINTS: u64 = 1_000_000;
/// Bytes of memory for a point of a tile, those about it included: with larger tiles, less.
const BYTES_PER_POINT: u64 = 1600;

impl TileArgs {
    fn request(
        &self,
        scans: &[PathBuf],
        outputs: &Outputs<'_>,
        options: &DenoiseOptions,
        run: &RunArgs,
    ) -> Result<Request> {
        let usage = |text: String| -> Result<Request> { Err(Usage(text).into()) };
        let Some(first) = outputs.surface.or(outputs.points).or(self.tileset.as_deref()) else {
            return usage("nothing to write. Give --output, --points or --tileset".into());
        };
        let is_ply = |p: &Path| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply"));
        if let Some(surface) = outputs.surface.filter(|p| !is_ply(p)) {
            return usage(format!("{}: in tiles the surface is written as .ply", surface.display()));
        }
        if let Some(points) = outputs.points.filter(|p| p.is_file()) {
            return usage(format!("{}: in tiles --points is a folder", points.display()));
        }
        if let Some(surface) = outputs.surface
            && !outputs.force
            && scans.iter().any(|s| atlasfit_io::is_same_file(surface, s))
        {
            return usage(format!("{} is the scan itself. --force replaces it", surface.display()));
        }
        let folder = self.work.clone().unwrap_or_else(|| {
            let mut name = first.as_os_str().to_owned();
            name.push(".tiles");
            name.into()
        });
        let by_memory = run.max_memory.map(|bytes| (bytes / BYTES_PER_POINT).max(1000));
        Ok(Request {
            scans: scans.to_vec(),
            folder,
            surface: outputs.surface.map(Path::to_owned),
            points: outputs.points.map(Path::to_owned),
            tileset: self.tileset.clone(),
            tile_points: self.tile_points.or(by_memory).unwrap_or(TILE_POINTS),
            uv: options.uv,
            options: options.clone(),
        })
    }
}

impl InTiles {
    /// Whether work in tiles is asked for.
    pub fn asked(&self) -> bool {
        self.tiles || self.how.tileset.is_some() || self.how.tile_points.is_some()
    }

    /// Plans, runs, merges.
    pub fn denoise(
        &self,
        scans: &[PathBuf],
        outputs: &Outputs<'_>,
        options: &DenoiseOptions,
        run: &RunArgs,
        console: &Console,
    ) -> Result<()> {
        let request = self.how.request(scans, outputs, options, run)?;
        let plan = atlasfit_tiles::plan(&request, &mut console.start_silent(run), &console.stop(run))?;
        told(&plan, console);
        run_all(&plan, &request.folder, run, console, |_| true)?;
        report(&plan, &request.folder, console);
        Ok(())
    }
}

/// Runs.
pub fn run(what: &Tiles, console: &Console) -> Result<()> {
    match what {
        Tiles::Plan(args) => match args.simulate {
            Some(workers) => simulate(args, workers as usize, console),
            None => plan(args, console),
        },
        Tiles::Run(TaskArgs { work, task: None }) => {
            let plan = Plan::read(&work.folder)?;
            run_all(&plan, &work.folder, &work.run, console, |_| true)?;
            report(&plan, &work.folder, console);
            Ok(())
        }
        Tiles::Run(TaskArgs { work, task: Some(name) }) => {
            let plan = Plan::read(&work.folder)?;
            let mut run = console.start_silent(&work.run);
            atlasfit_tiles::task(&plan, &work.folder, name, &mut run, &console.stop(&work.run))?;
            console.report(&format!("{name}: done\n"), &json!({ "task": name, "done": true }));
            Ok(())
        }
        Tiles::Merge(work) => {
            let plan = Plan::read(&work.folder)?;
            run_all(&plan, &work.folder, &work.run, console, |name| !name.starts_with("tile-"))?;
            report(&plan, &work.folder, console);
            Ok(())
        }
        Tiles::Status(work) => {
            let (text, value) = standing(&Plan::read(&work.folder)?, &work.folder, console);
            console.answer(&text, &value);
            Ok(())
        }
    }
}

fn plan(args: &PlanArgs, console: &Console) -> Result<()> {
    let outputs = Outputs { surface: args.output.as_deref(), points: args.points.as_deref(), force: false };
    let options = DenoiseOptions::default().with_noise(args.noise).with_uv(!args.no_uv);
    let request = args.tiles.request(&args.scans, &outputs, &options, &args.run)?;
    let plan =
        atlasfit_tiles::plan(&request, &mut console.start_silent(&args.run), &console.stop(&args.run))?;
    told(&plan, console);
    report(&plan, &request.folder, console);
    Ok(())
}

/// What the user should know of a plan.
fn told(plan: &Plan, console: &Console) {
    plan.notes.iter().for_each(|n| console.note(n));
    if plan.not_finite > 0 {
        console.note(format!(
            "{} points with coordinates that are not finite stay as they are",
            plan.not_finite
        ));
    }
}

fn simulate(args: &PlanArgs, workers: usize, console: &Console) -> Result<()> {
    let folder = &args.scans[0];
    let plan = Plan::read(folder)?;
    let s = atlasfit_tiles::simulate(&plan, folder, workers, args.as_if);
    if !s.measured {
        console.note("no task of this plan has run: times are those of another machine (docs/scale.md)");
    }
    let text = format!(
        "{} tasks on {} workers: {} from the first to the last, {} of work, workers busy {:.0} %, up to \
         {:.1} \
         GB of memory on all of them\n",
        count(s.tasks),
        workers,
        seconds(s.seconds),
        seconds(s.work_seconds),
        100.0 * s.busy,
        s.peak_memory as f64 / 1e9
    );
    console.answer(&text, &serde_json::to_value(&s)?);
    Ok(())
}

/// Runs the tasks that are left and `wanted`.
fn run_all(
    plan: &Plan,
    folder: &Path,
    args: &RunArgs,
    console: &Console,
    wanted: impl Fn(&str) -> bool,
) -> Result<()> {
    let stop = console.stop(args);
    let left: Vec<_> = plan.tasks.iter().filter(|t| !t.is_done() && wanted(&t.name)).collect();
    for (i, task) in left.iter().enumerate() {
        console.part_to((i + 1) as f64 / left.len() as f64);
        console.check(args, "running tasks")?;
        console.step(format_args!("{} ({} of {}, {} points)", task.name, i + 1, left.len(), task.points));
        atlasfit_tiles::task(plan, folder, &task.name, &mut console.start_silent(args), &stop)?;
    }
    Ok(())
}

/// Tells how a plan stands.
fn report(plan: &Plan, folder: &Path, console: &Console) {
    let (text, value) = standing(plan, folder, console);
    console.report(&text, &value);
}

/// How a plan stands, as text and as JSON; warns of what did not come well.
fn standing(plan: &Plan, folder: &Path, console: &Console) -> (String, Value) {
    let status = atlasfit_tiles::status(plan, folder);
    if let Some(summary) = &status.summary {
        if summary.cracks > 0 {
            console.warn(format!(
                "{} edges at which tiles meet could not be joined: the surface has cracks there",
                summary.cracks
            ));
        }
        if summary.one_sided {
            console.warn("some part of the surface is one-sided");
        }
    }
    (text(plan, folder, &status), value(plan, folder, &status))
}

fn seconds(s: f64) -> String {
    match s {
        s if s < 100.0 => format!("{s:.1} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

fn text(plan: &Plan, folder: &Path, status: &Status) -> String {
    let mut text = format!(
        "{}: {} points in {} tiles with a halo of {:.4}; {} of {} tasks done\n",
        folder.display(),
        count(plan.known.points),
        count(plan.tiles.len()),
        plan.halo,
        count(status.done),
        count(status.tasks)
    );
    let known = &plan.known;
    let [spacing, noise] = [known.spacing, known.noise].map(|length| length * known.scale);
    let _ = writeln!(text, "spacing {spacing:.4}, noise {noise:.4}");
    if let Some(s) = &status.summary {
        let _ = writeln!(
            text,
            "surface: {} parts, {} boundaries; {} edges between tiles, {} places where tiles did not agree",
            count(s.parts),
            count(s.boundary_loops),
            count(s.seam_edges),
            count(s.closed_rings)
        );
    }
    for (name, why) in &status.failed {
        let _ = writeln!(text, "failed: {name}: {why}");
    }
    if let Some(left) = status.seconds_left.filter(|_| status.done < status.tasks) {
        let _ = writeln!(text, "about {} left, one task after the other", seconds(left));
    }
    text
}

fn value(plan: &Plan, folder: &Path, status: &Status) -> Value {
    let scale = plan.known.scale;
    json!({
        "work": files::text(folder), "points": plan.known.points, "tiles": plan.tiles.len(),
        "halo": number(plan.halo), "spacing": number(plan.known.spacing * scale),
        "noise": number(plan.known.noise * scale), "not_finite": plan.not_finite,
        "tasks": status.tasks, "done": status.done,
        "failed": status.failed.iter().map(|(n, e)| json!({ "task": n, "error": e })).collect::<Vec<_>>(),
        "missing": status.missing, "seconds_left": status.seconds_left.map(number),
        "surface": status.summary,
        "files": plan.tasks.iter().filter(|t| ["surface", "tileset"].contains(&t.name.as_str())
            || t.name.starts_with("points-")).filter_map(|t| t.outputs.first()).map(|o| files::text(o))
            .collect::<Vec<_>>(),
    })
}
