//! `atlasfit bench unwrap`: our layouts beside the peers', mesh by mesh, in one run.
//!
//! Peers run through `tests/peers/uv.py` on the same meshes right after ours. All layouts are measured here
//! by the same code and, on request, by an independent judge too. What counts is the median, over the meshes,
//! of the ratios to a peer.

use super::against::Against;
use super::peers::python;
use super::shared::{STYLE, cancelled, median};
use crate::commands::render::write_png;
use crate::console::{Console, RunArgs, Usage};
use crate::files;
use crate::number::{count, short};
use crate::render::{Mode, Style, render};
use crate::values::{direction, share};
use anyhow::{Context as _, Result, bail};
use atlasfit::geometry::TriMesh;
use atlasfit::measure::uv::seams_seen;
use atlasfit::measure::{UvQuality, uv};
use atlasfit::unwrap::{UnwrapOptions, unwrap};
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Options of `bench unwrap`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Meshes, or folders of meshes
    #[arg(required = true)]
    meshes: Vec<PathBuf>,
    /// Peers: xatlas, uvunwrap, blender-smart, blender-unwrap; the ratios are to the first that is installed
    #[arg(long, value_delimiter = ',', default_value = "uvunwrap,xatlas,blender-smart,blender-unwrap")]
    peers: Vec<String>,
    /// Leave the peers out
    #[arg(long)]
    no_peers: bool,
    /// Our bound on the stretch
    #[arg(long, default_value_t = UnwrapOptions::default().max_stretch, value_name = "FACTOR")]
    max_stretch: f64,
    /// Also lay out with seams hidden as far as this, and tell what share of them is seen
    #[arg(long, default_value_t = 0.0, value_name = "SHARE", value_parser = share)]
    seams_hidden: f64,
    /// The direction up, for seams that are hidden [default: they are looked at from all around]
    #[arg(long, value_name = "X,Y,Z", value_parser = direction, allow_hyphen_values = true)]
    up: Option<[f64; 3]>,
    /// Runs per mesh and method; the median time counts
    #[arg(
        long,
        default_value_t = 1,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=100)
    )]
    repeat: u32,
    /// Seconds that a peer has for one mesh
    #[arg(long, default_value_t = 600, value_name = "SECONDS")]
    peer_limit: u32,
    /// Draw the layouts to this folder
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
    /// Also have our layouts judged by uvmetrics.py in this folder, and tell where it disagrees with our
    /// measure
    #[arg(long, value_name = "DIR")]
    judge: Option<PathBuf>,
    /// Time this build and another one (a program) in turn instead: `unwrap` of each mesh, --repeat runs of
    /// each; nothing else is measured
    #[arg(long, value_name = "PROGRAM", conflicts_with_all = ["pictures", "judge", "markdown"])]
    against: Option<PathBuf>,
    /// Write the table as Markdown
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// The Python that has numpy and the peers
    #[arg(long, default_value = "python3", value_name = "PROGRAM")]
    python: PathBuf,
    /// The folder of uv.py
    #[arg(long, default_value = "tests/peers", value_name = "DIR")]
    scripts: PathBuf,
    #[command(flatten)]
    run: RunArgs,
}

/// One layout.
struct Row {
    mesh: String,
    method: String,
    seconds: f64,
    quality: UvQuality,
    /// Share of the seams that is seen, where that is asked for.
    seen: Option<f64>,
}

/// The method that hides seams.
const HIDDEN: &str = "hidden";

/// A figure of a layout: its name, and whether more is better.
type Figure = (&'static str, fn(&Row) -> f64);

/// What the ratios are made of.
const FIGURES: [Figure; 5] = [
    ("charts", |r| r.quality.charts as f64),
    ("seam", |r| r.quality.seam),
    ("stretch 95%", |r| r.quality.stretch_p95),
    ("coverage", |r| r.quality.coverage),
    ("seconds", |r| r.seconds),
];

/// Runs the benchmark.
pub fn run(args: &Args, folder: &Path, console: &Console) -> Result<()> {
    let meshes = list(&args.meshes)?;
    if let Some(other) = &args.against {
        return in_turn(&meshes, other, args, folder, console);
    }
    let script = args.scripts.join("uv.py");
    let peers = installed(args, &script, console)?;
    if let Some(pictures) = &args.pictures {
        std::fs::create_dir_all(pictures).with_context(|| format!("cannot make {}", pictures.display()))?;
    }
    let mut rows: Vec<Row> = Vec::new();
    let mut failed: Vec<String> = Vec::new();
    let mut disagreement: Vec<(&str, f64)> = Vec::new();
    for path in &meshes {
        console.check(&args.run, "measuring")?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let loaded = files::load(path, &args.run, console)?;
        let mut mesh = TriMesh::new(loaded.cloud.positions, loaded.faces);
        let raw = folder.join("mesh.bin");
        files::write(&raw, bytes(&mesh))?;
        match ours(&mesh, 0.0, args, console) {
            Ok((corner_uv, seconds)) => {
                mesh.corner_uv = Some(corner_uv);
                let row = row(&mesh, &name, "atlasfit", seconds, args, console)?;
                if let Some(judge) = &args.judge {
                    let file = folder.join("ours.uv");
                    let numbers = mesh.corner_uv.iter().flatten().flatten().flatten();
                    files::write(&file, numbers.flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())?;
                    let said = python(&args.python, &script, &[&"judge", &raw, &file, judge])?;
                    let said: Value = serde_json::from_str(said.trim()).context("the judge said no JSON")?;
                    compare(&said, &row.quality, &mut disagreement);
                }
                rows.push(row);
            }
            Err(e) if cancelled(&e) => return Err(e),
            Err(e) => failed.push(format!("{name} atlasfit: {e:#}")),
        }
        if args.seams_hidden > 0.0 {
            let (corner_uv, seconds) = ours(&mesh, args.seams_hidden, args, console)?;
            mesh.corner_uv = Some(corner_uv);
            rows.push(row(&mesh, &name, HIDDEN, seconds, args, console)?);
        }
        if peers.is_empty() {
            continue;
        }
        let (repeat, limit) = (args.repeat.to_string(), args.peer_limit.to_string());
        let mut command: Vec<&dyn AsRef<OsStr>> = vec![&"run", &raw, &folder, &repeat, &limit];
        command.extend(peers.iter().map(|p| p as &dyn AsRef<OsStr>));
        for line in python(&args.python, &script, &command)?.lines().filter(|l| l.starts_with('{')) {
            let said: Value = serde_json::from_str(line).context("uv.py said something that is no JSON")?;
            let peer = said["peer"].as_str().unwrap_or_default();
            let (Some(file), Some(seconds)) = (said["file"].as_str(), said["seconds"].as_f64()) else {
                failed
                    .push(format!("{name} {peer}: {}", said["error"].as_str().unwrap_or("no reason given")));
                continue;
            };
            mesh.corner_uv = Some(layout(file, mesh.triangles.len())?);
            rows.push(row(&mesh, &name, peer, seconds, args, console)?);
        }
    }
    let mut table = table(&rows, &peers);
    for (figure, most) in &disagreement {
        let _ = writeln!(table, "\nLargest disagreement with the judge: {figure} {}", short(*most));
    }
    for f in &failed {
        let _ = writeln!(table, "\nFailed: {f}");
    }
    if let Some(path) = &args.markdown {
        files::write(path, &table)?;
    }
    let rows: Vec<Value> = rows.iter().map(json_row).collect();
    console.answer(&table, &json!({ "rows": rows, "failed": failed }));
    if failed.iter().any(|f| f.contains(" atlasfit: ")) {
        bail!("not every mesh was unwrapped")
    }
    Ok(())
}

/// Times each mesh with this build and another one.
fn in_turn(meshes: &[PathBuf], other: &Path, args: &Args, folder: &Path, console: &Console) -> Result<()> {
    let mut times = Against::new(other, args.repeat);
    let (stretch, threads) = (args.max_stretch.to_string(), args.run.threads.to_string());
    let out = folder.join("in-turn.obj");
    for mesh in meshes {
        console.check(&args.run, "measuring")?;
        let name = mesh.file_stem().unwrap_or_default().to_string_lossy();
        let arguments: [&dyn AsRef<OsStr>; 8] =
            [&"unwrap", mesh, &"-o", &out, &"--max-stretch", &stretch, &"--threads", &threads];
        times.time(&name, &arguments.map(AsRef::as_ref), console)?;
    }
    times.report(console);
    Ok(())
}

/// The meshes named, folders opened.
fn list(paths: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut out = Vec::new();
    for path in paths {
        if !path.is_dir() {
            out.push(path.clone());
            continue;
        }
        let entries = std::fs::read_dir(path).with_context(|| format!("cannot read {}", path.display()))?;
        let mut own: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
        own.retain(|p| atlasfit_io::Format::from_path(p).is_some());
        own.sort();
        out.extend(own);
    }
    if out.is_empty() {
        return Err(Usage("there is no mesh in the folders given".into()).into());
    }
    Ok(out)
}

/// Peers asked for that can run here.
fn installed(args: &Args, script: &Path, console: &Console) -> Result<Vec<String>> {
    if args.no_peers {
        return Ok(Vec::new());
    }
    let said = python(&args.python, script, &[&"peers"])?;
    let here: Vec<&str> = said.split_whitespace().collect();
    for peer in args.peers.iter().filter(|p| !here.contains(&p.as_str())) {
        console.note(format_args!("{peer} is not installed and left out"));
    }
    Ok(args.peers.iter().filter(|p| here.contains(&p.as_str())).cloned().collect())
}

/// Our layout with seams hidden so far, and the median time.
fn ours(mesh: &TriMesh, hidden: f64, args: &Args, console: &Console) -> Result<(Vec<[[f32; 2]; 3]>, f64)> {
    let options = UnwrapOptions::default()
        .with_max_stretch(args.max_stretch)
        .with_seams_hidden(hidden)
        .with_up(args.up);
    let mut times = Vec::new();
    let mut last = Vec::new();
    for _ in 0..args.repeat {
        let start = Instant::now();
        last = console.start_silent(&args.run).execute(|ctx| unwrap(mesh, &options, ctx))?.corner_uv;
        times.push(start.elapsed().as_secs_f64());
    }
    Ok((last, median(&mut times)))
}

/// Measures a layout and draws it.
fn row(
    mesh: &TriMesh,
    name: &str,
    method: &str,
    seconds: f64,
    args: &Args,
    console: &Console,
) -> Result<Row> {
    let quality = console.start_silent(&args.run).execute(|ctx| uv(mesh, ctx))?;
    if let Some(folder) = &args.pictures {
        let style = Style { mode: Mode::Uv, size: [768; 2], ..STYLE };
        let picture = console.start_silent(&args.run).execute(|ctx| render(mesh, None, &style, ctx))?;
        write_png(&folder.join(format!("{name}-{method}.png")), &picture)?;
    }
    let seen = (args.seams_hidden > 0.0)
        .then(|| console.start_silent(&args.run).execute(|ctx| seams_seen(mesh, args.up, ctx)))
        .transpose()?;
    let row = Row { mesh: name.into(), method: method.into(), seconds, quality, seen };
    console.note(format_args!(
        "{name} {method}: {} charts, seam {}, 95% {:.3}, coverage {:.3}, {} s",
        row.quality.charts,
        short(row.quality.seam),
        row.quality.stretch_p95,
        row.quality.coverage,
        short(seconds)
    ));
    Ok(row)
}

/// Notes where an independent judge's figures of a layout differ from ours, relative to them.
fn compare(said: &Value, quality: &UvQuality, worst: &mut Vec<(&'static str, f64)>) {
    for (name, key, own) in [
        ("charts", "charts", quality.charts as f64),
        ("seam", "seam", quality.seam),
        ("stretch L2", "L2", quality.stretch_l2),
        ("stretch 95%", "sd95", quality.stretch_p95),
        ("coverage", "cover", quality.coverage),
        ("flips", "flips", quality.flips as f64),
        ("collapsed", "deg", quality.degenerate as f64),
    ] {
        let judged = said[key].as_f64().unwrap_or(f64::NAN);
        let off = (own - judged).abs() / judged.abs().max(1.0);
        match worst.iter_mut().find(|w| w.0 == name) {
            // Not a number counts as the largest.
            Some(w) if off <= w.1 => {}
            Some(w) => w.1 = off,
            None => worst.push((name, off)),
        }
    }
}

/// A mesh as uv.py reads it.
fn bytes(mesh: &TriMesh) -> Vec<u8> {
    let mut out = Vec::new();
    for n in [mesh.positions.len(), mesh.triangles.len()] {
        out.extend_from_slice(&(n as u32).to_le_bytes());
    }
    mesh.positions.as_flattened().iter().for_each(|x| out.extend_from_slice(&x.to_le_bytes()));
    mesh.triangles.as_flattened().iter().for_each(|v| out.extend_from_slice(&v.to_le_bytes()));
    out
}

/// A layout as uv.py writes it.
fn layout(file: &str, triangles: usize) -> Result<Vec<[[f32; 2]; 3]>> {
    let bytes = std::fs::read(file).with_context(|| format!("cannot read {file}"))?;
    let numbers: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    if numbers.len() != 6 * triangles {
        bail!("{file} holds {} numbers for {triangles} triangles: the peer dropped some", numbers.len());
    }
    Ok(numbers.as_chunks::<2>().0.as_chunks::<3>().0.to_vec())
}

fn json_row(r: &Row) -> Value {
    let q = &r.quality;
    json!({
        "mesh": r.mesh, "method": r.method, "seconds": r.seconds, "faces": q.faces, "charts": q.charts,
        "seam": q.seam, "stretch_l2": q.stretch_l2, "stretch_p95": q.stretch_p95, "conformal": q.conformal,
        "coverage": q.coverage, "flips": q.flips, "collapsed": q.degenerate,
        "overlapping_faces": q.overlapping_faces, "inside": q.inside, "seams_seen": r.seen,
    })
}

/// What share of the seams is seen once they are hidden, beside that of the plain layouts; nothing where none
/// is hidden.
fn seen(plain: &[&Row], hidden: &[&Row]) -> String {
    let share = |own: &&Row| {
        let after = hidden.iter().find(|h| h.mesh == own.mesh)?.seen?;
        Some(after / own.seen?.max(1e-9))
    };
    let mut ratios: Vec<f64> = plain.iter().filter_map(share).collect();
    if ratios.is_empty() {
        return String::new();
    }
    let halved = ratios.iter().filter(|r| **r <= 0.5).count();
    format!(
        "\nShare of the seams that is seen, {HIDDEN} : atlasfit: {:.3} in the median; \
         at most half on {halved} of {}\n",
        median(&mut ratios),
        ratios.len()
    )
}

/// A line per mesh with the ratios to the first peer; medians of all methods; medians of the ratios to every
/// peer.
fn table(rows: &[Row], peers: &[String]) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "| mesh | faces | method | charts | seam | 95% | L2 | coverage \
         | flips, overlapping, collapsed | s |\n\
         |---|---|---|---|---|---|---|---|---|---|"
    );
    for r in rows {
        let q = &r.quality;
        let _ = writeln!(
            out,
            "| {} | {} | {} | {} | {:.2} | {:.3} | {:.4} | {:.3} | {}, {}, {} | {:.3} |",
            r.mesh,
            count(q.faces),
            r.method,
            q.charts,
            q.seam,
            q.stretch_p95,
            q.stretch_l2,
            q.coverage,
            q.flips,
            q.overlapping_faces,
            q.degenerate,
            r.seconds
        );
    }
    let of = |method: &str| rows.iter().filter(|r| r.method == method).collect::<Vec<_>>();
    let _ = writeln!(
        out,
        "\n| method | meshes | charts | seam | 95% | worst | coverage | seconds \
         | with flips, overlaps, collapsed, outside |\n|---|---|---|---|---|---|---|---|---|"
    );
    for method in ["atlasfit", HIDDEN].into_iter().chain(peers.iter().map(String::as_str)) {
        let own = of(method);
        if own.is_empty() {
            continue;
        }
        let m = |f: fn(&Row) -> f64| median(&mut own.iter().map(|r| f(r)).collect::<Vec<_>>());
        let bad = |f: fn(&UvQuality) -> bool| own.iter().filter(|r| f(&r.quality)).count();
        let _ = writeln!(
            out,
            "| {method} | {} | {:.1} | {:.2} | {:.3} | {:.3} | {:.3} | {:.3} | {}, {}, {}, {} |",
            own.len(),
            m(FIGURES[0].1),
            m(FIGURES[1].1),
            m(FIGURES[2].1),
            own.iter().map(|r| r.quality.stretch_p95).fold(0.0, f64::max),
            m(FIGURES[3].1),
            m(FIGURES[4].1),
            bad(|q| q.flips > 0),
            bad(|q| q.overlapping_faces > 0),
            bad(|q| q.degenerate > 0),
            bad(|q| !q.inside || !q.finite)
        );
    }
    out += &seen(&of("atlasfit"), &of(HIDDEN));
    for peer in std::iter::once(HIDDEN).chain(peers.iter().map(String::as_str)) {
        let theirs = of(peer);
        let pairs: Vec<(&Row, &Row)> = (of("atlasfit").into_iter())
            .filter_map(|o| theirs.iter().find(|t| t.mesh == o.mesh).map(|t| (o, *t)))
            .collect();
        if pairs.is_empty() {
            continue;
        }
        let ratios: Vec<String> = FIGURES
            .iter()
            .map(|(name, f)| {
                let mut all: Vec<f64> = pairs.iter().map(|(o, t)| f(o) / f(t).max(1e-9)).collect();
                format!("{name} {:.3}", median(&mut all))
            })
            .collect();
        let _ = writeln!(
            out,
            "\nMedians of the ratios atlasfit : {peer} over {} meshes: {}",
            pairs.len(),
            ratios.join(", ")
        );
    }
    out
}
