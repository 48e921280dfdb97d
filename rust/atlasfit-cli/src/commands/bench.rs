//! `atlasfit bench denoise`: our figures beside the peers'.
//!
//! Shapes and noisy samples come from `tests/peers/shapes.py`, the peers' surfaces from `tests/peers/meshlab.py`; all are
//! measured here, by the same code. The oracle is the best of the peers' settings in each cell, picked by someone who knows
//! the truth.

mod paper;
mod unwrap;

use crate::console::{Console, RunArgs};
use crate::files;
use crate::number::short;
use crate::render::camera::{Up, View};
use crate::render::{Mode, Style};
use anyhow::{Context as _, Result, bail};
use atlasfit::DenoiseOptions;
use atlasfit::geometry::TriMesh;
use atlasfit::measure::{DistanceOptions, SurfaceDistance, points, surface, uv};
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// What to benchmark.
#[derive(Debug, clap::Subcommand)]
pub enum Bench {
    /// Accuracy, completeness, topology and time of denoising, beside screened Poisson
    Denoise(Args),
    /// Charts, seams, stretch, coverage and time of unwrapping, beside uvunwrap, xatlas and Blender
    Unwrap(unwrap::Args),
    /// The tables of Deep Manifold Prior with its networks, beside the default prior
    Paper(paper::Args),
}

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
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100))]
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
    /// Keep the peers' results in this file (JSON lines) and take them from it. Times from it are marked with *
    #[arg(long, value_name = "FILE")]
    peer_cache: Option<PathBuf>,
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
    keep: Option<PathBuf>,
    #[command(flatten)]
    run: RunArgs,
}

/// Figures of one surface.
#[derive(Debug, Clone)]
struct Row {
    shape: String,
    sigma: f64,
    method: String,
    seconds: f64,
    /// From the cache: the time is from another run.
    cached: bool,
    figures: Value,
}

/// Numbers measured of each surface, in the order of the CSV.
const FIGURES: [&str; 16] = [
    "acc",
    "acc_med",
    "acc_p99",
    "com",
    "com_med",
    "com_p99",
    "cd",
    "floor",
    "f1",
    "normal",
    "orientation",
    "faces",
    "parts",
    "boundary",
    "loops",
    "nonmanifold",
];
/// The points' own figures, which peers do not have.
const POINT_FIGURES: [&str; 3] = ["points_rms", "points_med", "points_p99"];
/// Figures of our UVs.
const UV_FIGURES: [&str; 5] = ["uv_charts", "uv_p95", "uv_flips", "uv_overlaps", "uv_coverage"];

/// How the benchmarks' pictures are drawn.
const STYLE: Style = Style {
    mode: Mode::Shaded,
    view: View { azimuth: 20.0, elevation: 15.0 },
    up: Up::Y,
    size: [512; 2],
    flat: false,
    boundary: false,
    colors: true,
    point_size: None,
};

impl Row {
    fn get(&self, key: &str) -> f64 {
        self.figures[key].as_f64().unwrap_or(f64::NAN)
    }
}

/// Runs a benchmark.
pub fn run(bench: &Bench, console: &Console) -> Result<()> {
    let temporary = std::env::temp_dir().join(format!("atlasfit-bench-{}", std::process::id()));
    let keep = match bench {
        Bench::Denoise(args) => args.keep.clone(),
        Bench::Unwrap(_) | Bench::Paper(_) => None,
    };
    let folder = keep.clone().unwrap_or_else(|| temporary.clone());
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let done = match bench {
        Bench::Denoise(args) => denoise(args, &folder, console),
        Bench::Unwrap(args) => unwrap::run(args, &folder, console),
        Bench::Paper(args) => paper::run(args, console),
    };
    if keep.is_none() {
        // What cannot be removed stays in the system's temporary folder.
        let _ = std::fs::remove_dir_all(&temporary);
    }
    done
}

fn denoise(args: &Args, folder: &Path, console: &Console) -> Result<()> {
    let mut cache = read_cache(args)?;
    let mut rows: Vec<Row> = Vec::new();
    let mut failed: Vec<String> = Vec::new();
    let mut no_peers = args.no_peers;
    for &sigma in &args.sigmas {
        for shape in &args.shapes {
            console.check()?;
            let (truth_path, noisy_path) =
                (folder.join(format!("{shape}.ply")), folder.join(format!("{shape}-{sigma}.ply")));
            let (spread, count) = (sigma.to_string(), args.count.to_string());
            python(
                &args.python,
                &args.scripts.join("shapes.py"),
                &[shape, &spread, &truth_path, &noisy_path, &"--count", &count],
            )?;
            let truth = files::load(&truth_path, &args.run, console)?.into_mesh();
            if !args.only_peers {
                match ours(args, folder, shape, sigma, &noisy_path, &truth, console) {
                    Ok(row) => {
                        console.note(summary(&row));
                        rows.push(row);
                    }
                    // One cell that fails must not cost the others.
                    Err(e) if !cancelled(&e) => {
                        failed.push(format!("{shape} {sigma}: {e:#}"));
                        console.note(format_args!("failed: {shape} {sigma}: {e:#}"));
                    }
                    Err(e) => return Err(e),
                }
            }
            if no_peers {
                continue;
            }
            let missing: Vec<&String> = args
                .settings
                .iter()
                .filter(|s| !cache.iter().any(|r| r.shape == *shape && r.sigma == sigma && r.method == **s))
                .collect();
            if !missing.is_empty() {
                match peers(args, folder, shape, sigma, &noisy_path, &truth, &missing, console) {
                    Ok(fresh) => {
                        append_cache(args, &fresh)?;
                        cache.extend(fresh);
                    }
                    Err(e) if args.only_peers || cancelled(&e) => return Err(e),
                    Err(e) => {
                        console.note(format_args!("the peers are left out: {e:#}"));
                        no_peers = true;
                    }
                }
            }
            let cell = cache.iter().filter(|r| r.shape == *shape && r.sigma == sigma);
            for row in cell.filter(|r| args.settings.contains(&r.method)) {
                console.note(summary(row));
                rows.push(row.clone());
            }
        }
    }
    let mut table = table(args, &rows);
    for cell in &failed {
        let _ = writeln!(table, "\nFailed: {cell}");
    }
    if let Some(path) = &args.markdown {
        files::write(path, &table)?;
    }
    if let Some(path) = &args.csv {
        files::write(path, csv(&rows))?;
    }
    let json: Vec<Value> = rows.iter().map(row_json).collect();
    console.report(&table, &json!({ "rows": json, "failed": failed }));
    if failed.is_empty() { Ok(()) } else { bail!("{} of our fits failed", failed.len()) }
}

/// The middle of some numbers, or the mean of the two in the middle.
fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n => 0.5 * (values[(n - 1) / 2] + values[n / 2]),
    }
}

fn cancelled(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(atlasfit::Error::Cancelled))
}

/// Our own fit of one cell.
fn ours(
    args: &Args,
    folder: &Path,
    shape: &str,
    sigma: f64,
    noisy: &Path,
    truth: &TriMesh,
    console: &Console,
) -> Result<Row> {
    let cloud = files::load(noisy, &args.run, console)?.cloud;
    let mut times = Vec::new();
    let mut last = None;
    for _ in 0..args.repeat {
        let start = Instant::now();
        last = Some(atlasfit::denoise(
            &cloud,
            &DenoiseOptions::default(),
            &mut console.start_silent(&args.run),
        )?);
        times.push(start.elapsed().as_secs_f64());
    }
    let Some(outcome) = last else { bail!("no fit was run") };
    let mut figures = measured(&outcome.surface, truth, args, console)?;
    let p = console
        .start_silent(&args.run)
        .execute(|ctx| points(&outcome.points, truth, &DistanceOptions::default(), ctx))?;
    if outcome.surface.corner_uv.is_some() {
        let q = console.start_silent(&args.run).execute(|ctx| uv(&outcome.surface, ctx))?;
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
    if args.keep.is_some() {
        let path = folder.join(format!("{shape}-{sigma}-ours.ply"));
        atlasfit_io::save_mesh(&path, &outcome.surface, &atlasfit_io::SaveMesh::default())?;
    }
    Ok(Row {
        shape: shape.into(),
        sigma,
        method: "ours".into(),
        seconds: median(&mut times),
        cached: false,
        figures,
    })
}

/// MeshLab's surfaces of a scan, by meshlab.py: setting, surface, seconds. Its files in `folder` are removed.
fn meshlab(
    program: &Path,
    scripts: &Path,
    scan: &Path,
    folder: &Path,
    repeat: u32,
    settings: &[&String],
    load: &dyn Fn(&Path) -> Result<TriMesh>,
) -> Result<Vec<(String, TriMesh, f64)>> {
    let repeat = repeat.to_string();
    let mut command: Vec<&dyn AsRef<OsStr>> = vec![&scan, &folder, &repeat];
    command.extend(settings.iter().map(|s| s as &dyn AsRef<OsStr>));
    let out = python(program, &scripts.join("meshlab.py"), &command)?;
    let mut made = Vec::new();
    for line in out.lines().filter(|l| l.starts_with('{')) {
        let said: Value = serde_json::from_str(line).context("meshlab.py said something that is no JSON")?;
        let (Some(setting), Some(file), Some(seconds)) =
            (said["setting"].as_str(), said["file"].as_str(), said["seconds"].as_f64())
        else {
            bail!("meshlab.py said {line}: setting, file and seconds were expected");
        };
        made.push((setting.to_owned(), load(Path::new(file))?, seconds));
        let _ = std::fs::remove_file(file);
    }
    Ok(made)
}

/// The peers' surfaces of one cell.
#[expect(clippy::too_many_arguments, reason = "one cell's whole context, used once")]
fn peers(
    args: &Args,
    folder: &Path,
    shape: &str,
    sigma: f64,
    noisy: &Path,
    truth: &TriMesh,
    settings: &[&String],
    console: &Console,
) -> Result<Vec<Row>> {
    let load = |file: &Path| Ok(files::load(file, &args.run, console)?.into_mesh());
    let made = meshlab(&args.python, &args.scripts, noisy, folder, args.repeat, settings, &load)?;
    let mut rows = Vec::new();
    for (setting, mesh, seconds) in made {
        let figures = measured(&mesh, truth, args, console)?;
        rows.push(Row { shape: shape.into(), sigma, method: setting, seconds, cached: false, figures });
    }
    Ok(rows)
}

fn measured(mesh: &TriMesh, truth: &TriMesh, args: &Args, console: &Console) -> Result<Value> {
    // The shapes have size 1, so that the share is the length.
    let d: SurfaceDistance = console
        .start_silent(&args.run)
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

/// What a script says on its standard output.
fn python(program: &Path, script: &Path, arguments: &[&dyn AsRef<OsStr>]) -> Result<String> {
    let out = Command::new(program)
        .arg(script)
        .args(arguments.iter().map(|a| a.as_ref()))
        .output()
        .with_context(|| format!("cannot start {}. Give --python PROGRAM", program.display()))?;
    if !out.status.success() {
        let said = String::from_utf8_lossy(&out.stderr);
        let last = said.lines().rev().find(|l| !l.trim().is_empty()).unwrap_or("no message");
        bail!(
            "{} failed: {last}. It needs the packages of tests/requirements.txt; run from the repository's root or give --scripts",
            script.display()
        );
    }
    Ok(String::from_utf8_lossy(&out.stdout).into_owned())
}

fn row_json(row: &Row) -> Value {
    let mut out = json!({
        "shape": row.shape, "sigma": row.sigma, "method": row.method, "seconds": row.seconds, "cached": row.cached,
    });
    if let (Some(all), Some(figures)) = (out.as_object_mut(), row.figures.as_object()) {
        all.extend(figures.clone());
    }
    out
}

fn read_cache(args: &Args) -> Result<Vec<Row>> {
    let Some(path) = args.peer_cache.as_ref().filter(|p| p.exists()) else { return Ok(Vec::new()) };
    let content = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    content
        .lines()
        .map(|line| {
            let v: Value = serde_json::from_str(line)?;
            let word = |k: &str| v[k].as_str().map(ToString::to_string).context("a word is missing");
            let number = |k: &str| v[k].as_f64().context("a number is missing");
            // Scans of another size are other cells.
            let same = v["count"].as_u64() == Some(args.count as u64);
            Ok((
                same,
                Row {
                    shape: word("shape")?,
                    sigma: number("sigma")?,
                    method: word("method")?,
                    seconds: number("seconds")?,
                    cached: true,
                    figures: v.clone(),
                },
            ))
        })
        .filter_map(|r: Result<_>| r.map(|(same, row)| same.then_some(row)).transpose())
        .collect::<Result<Vec<_>>>()
        .with_context(|| format!("{} is no cache of peers. Remove it", path.display()))
}

fn append_cache(args: &Args, rows: &[Row]) -> Result<()> {
    use std::io::Write as _;
    let Some(path) = &args.peer_cache else { return Ok(()) };
    let mut lines = String::new();
    for row in rows {
        let mut v = row_json(row);
        v["count"] = json!(args.count);
        let _ = writeln!(lines, "{v}");
    }
    std::fs::OpenOptions::new()
        .create(true)
        .append(true)
        .open(path)
        .and_then(|mut f| f.write_all(lines.as_bytes()))
        .with_context(|| format!("cannot write {}", path.display()))
}

fn summary(row: &Row) -> String {
    format!(
        "{} {} {}: acc {} com {} in {} s",
        row.shape,
        row.sigma,
        row.method,
        short(row.get("acc")),
        short(row.get("com")),
        short(row.seconds)
    )
}

fn csv(rows: &[Row]) -> String {
    let mut out = format!(
        "shape,sigma,method,seconds,cached,{},{},{}\n",
        FIGURES.join(","),
        POINT_FIGURES.join(","),
        UV_FIGURES.join(",")
    );
    for row in rows {
        let _ =
            write!(out, "{},{},\"{}\",{:.4},{}", row.shape, row.sigma, row.method, row.seconds, row.cached);
        for key in FIGURES.iter().chain(&POINT_FIGURES).chain(&UV_FIGURES) {
            let value = row.get(key);
            let _ = if value.is_nan() { write!(out, ",") } else { write!(out, ",{value}") };
        }
        out.push('\n');
    }
    out
}

/// One line per cell: ours, the peer's default setting, the oracle, and ratios. Ratios below 1 are ours better.
fn table(args: &Args, rows: &[Row]) -> String {
    let mut out = String::from(
        "| shape | sigma | acc (med) | com (med) | CD / floor | points | s | parts, boundary, non-manifold | UV charts, 95%, flips, overlaps | Poisson acc, com, s | oracle acc, com | acc, com : Poisson | acc, com : oracle | s : Poisson |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let (mut cells, mut beats, mut beats_oracle) = (0, 0, 0);
    for &sigma in &args.sigmas {
        for shape in &args.shapes {
            let cell: Vec<&Row> = rows.iter().filter(|r| r.shape == *shape && r.sigma == sigma).collect();
            let ours = cell.iter().find(|r| r.method == "ours");
            let default = args.settings.first().and_then(|s| cell.iter().find(|r| r.method == *s));
            let best = |key: &str| {
                cell.iter().filter(|r| r.method != "ours").map(|r| r.get(key)).fold(f64::NAN, f64::min)
            };
            let _ = write!(out, "| {shape} | {sigma} ");
            match ours {
                Some(r) => {
                    let _ = write!(
                        out,
                        "| {} ({}) | {} ({}) | {:.2} | {} | {:.2} | {}, {}, {} | {}, {:.2}, {}, {} ",
                        short(r.get("acc")),
                        short(r.get("acc_med")),
                        short(r.get("com")),
                        short(r.get("com_med")),
                        r.get("cd") / r.get("floor"),
                        short(r.get("points_rms")),
                        r.seconds,
                        r.get("parts"),
                        r.get("boundary"),
                        r.get("nonmanifold"),
                        r.get("uv_charts"),
                        r.get("uv_p95"),
                        r.get("uv_flips"),
                        r.get("uv_overlaps")
                    );
                }
                None => out.push_str("| | | | | | | "),
            }
            match default {
                Some(p) => {
                    let _ = write!(
                        out,
                        "| {}, {}, {:.2}{} | {}, {} ",
                        short(p.get("acc")),
                        short(p.get("com")),
                        p.seconds,
                        if p.cached { "*" } else { "" },
                        short(best("acc")),
                        short(best("com"))
                    );
                }
                None => out.push_str("| | "),
            }
            if let (Some(r), Some(p)) = (ours, default) {
                let ratio = |key: &str, to: f64| r.get(key) / to;
                let (a, c) = (ratio("acc", p.get("acc")), ratio("com", p.get("com")));
                let (oa, oc) = (ratio("acc", best("acc")), ratio("com", best("com")));
                cells += 1;
                beats += usize::from(a <= 1.0 && c <= 1.0);
                beats_oracle += usize::from(oa <= 1.0 && oc <= 1.0);
                let star = if p.cached { "*" } else { "" };
                let _ = writeln!(
                    out,
                    "| {a:.2}, {c:.2} | {oa:.2}, {oc:.2} | {:.2}{star} |",
                    r.seconds / p.seconds
                );
            } else {
                out.push_str("| | | |\n");
            }
        }
    }
    if cells > 0 {
        let _ = writeln!(
            out,
            "\nAt or below Poisson's default in both acc and com: {beats} of {cells} cells; at or below the oracle: {beats_oracle} of {cells}."
        );
    }
    if rows.iter().any(|r| r.cached) {
        out.push_str("\n`*` the peer's time is from another run (--peer-cache).\n");
    }
    out
}
