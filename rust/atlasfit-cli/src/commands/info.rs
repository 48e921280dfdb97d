//! `atlasfit info`: what a file holds, and what is odd about it.
//!
//! Spacing and noise are those that `denoise` starts from: the core's estimates for the distinct finite
//! points.

use crate::commands::measure::{topology_json, topology_text};
use crate::console::{Console, RunArgs};
use crate::files::{self, InputArgs};
use crate::number::{count, counted, json as number, short};
use anyhow::Result;
use atlasfit::geometry::{ScalarKind, TriMesh};
use atlasfit::measure::{self, Topology, topology};
use atlasfit::numeric::sort::sort;
use atlasfit::numeric::vec3;
use atlasfit::pipeline::prepare::{self, MIN_POINTS};
use atlasfit::{Context, Error};
use atlasfit_io::Format;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Options of `info`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Points or a mesh, in any format, or - for standard input
    file: PathBuf,
    #[command(flatten)]
    read: InputArgs,
    #[command(flatten)]
    run: RunArgs,
}

/// What was found out about the points and faces.
#[derive(Default)]
struct Facts {
    not_finite: usize,
    /// Points at the place of an earlier one.
    duplicates: usize,
    /// Faces that name the same places as an earlier one, in any order.
    duplicate_faces: usize,
    extent: Option<[[f64; 3]; 2]>,
    spacing: Option<f64>,
    noise: Option<f64>,
    groups: Option<Groups>,
    topology: Option<Topology>,
}

/// How a cloud's points hang together.
struct Groups {
    /// Groups of points.
    count: usize,
    /// Points that belong to none.
    stray: usize,
}

/// Bytes for one point: copies, tree, neighbours (measured, rounded up).
const BYTES_PER_POINT: u64 = 130;

/// Tells.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    let bytes = std::fs::metadata(&args.file).map(|m| m.len()).unwrap_or_default();
    let loaded = files::load_as(&args.file, args.read.input_format, &args.run, console)?;
    let (format, repairs) = (loaded.format, files::repairs(&loaded));
    let mesh = loaded.into_mesh();
    let facts = console.start(&args.run).execute(|ctx| facts(&mesh, ctx))?;
    let warnings = warnings(&mesh, &facts);
    let json = json!({
        "file": files::text(&args.file), "format": format.name(), "bytes": bytes,
        "points": mesh.positions.len(), "faces": mesh.triangles.len(), "attributes": attributes(&mesh),
        "extent": facts.extent.map(|[min, max]| json!({ "min": min.map(number), "max": max.map(number) })),
        "not_finite": facts.not_finite, "duplicates": facts.duplicates,
        "duplicate_faces": facts.duplicate_faces,
        "spacing": facts.spacing.map(number), "noise": facts.noise.map(number),
        "parts": facts.topology.as_ref().map(|t| t.parts).or(facts.groups.as_ref().map(|g| g.count)),
        "stray": facts.groups.as_ref().map(|g| g.stray),
        "topology": facts.topology.as_ref().map(topology_json),
        "repairs": repairs, "warnings": warnings,
    });
    console.answer(&text(args, format, bytes, &mesh, &facts, &warnings), &json);
    Ok(())
}

/// Looks at the points and faces.
fn facts(mesh: &TriMesh, ctx: &Context<'_>) -> atlasfit::Result<Facts> {
    let n = mesh.positions.len();
    let of_faces = measure::memory_needed(0, mesh.triangles.len(), ctx.threads());
    ctx.reserve(
        mesh.bytes() + BYTES_PER_POINT * n as u64 + of_faces,
        "Raise the limit, or give fewer points",
    )?;
    let found = prepare::distinct(vec3::of(&mesh.positions), ctx)?;
    let mut out = Facts { not_finite: found.not_finite, duplicates: found.duplicates, ..Facts::default() };
    if !mesh.triangles.is_empty() {
        let place = |v: u32| match found.of_input[v as usize] {
            // Positions that are not finite stay alone.
            u32::MAX => found.points.len() as u32 + v,
            p => p,
        };
        let mut faces: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.map(place)).collect();
        faces.iter_mut().for_each(|f| f.sort_unstable());
        faces.retain(|[a, b, c]| a != b && b != c);
        sort(&mut faces, ctx)?;
        out.duplicate_faces = faces.chunk_by(|a, b| a == b).map(|g| g.len() - 1).sum();
        out.topology = Some(topology(mesh, ctx)?);
    }
    let Some(&first) = found.points.first() else { return Ok(out) };
    out.extent = Some(found.points.iter().fold([first.0; 2], |[lo, hi], p| {
        [[0, 1, 2].map(|k| lo[k].min(p[k])), [0, 1, 2].map(|k| hi[k].max(p[k]))]
    }));
    let scan = match prepare::prepare(found, None, ctx) {
        Ok(scan) => scan,
        // What is no surface still has the facts above.
        Err(Error::Degenerate { .. }) => return Ok(out),
        Err(e) => return Err(e),
    };
    out.spacing = Some(scan.sampling.median * scan.frame.scale);
    out.noise = Some(scan.noise.sigma * scan.frame.scale);
    if mesh.triangles.is_empty() {
        let (parts, alone) = prepare::parts(&scan, ctx)?;
        out.groups = Some(Groups { count: parts, stray: alone + scan.input.stray });
    }
    Ok(out)
}

/// Name, kind and width of each column.
fn attributes(mesh: &TriMesh) -> Value {
    let mut out = Vec::new();
    let mut add = |name: &str, kind: &str, width: usize, of: &str| {
        out.push(json!({ "name": name, "kind": kind, "width": width, "of": of }));
    };
    if mesh.normals.is_some() {
        add("normal", "f32", 3, "point");
    }
    if mesh.colors.is_some() {
        add("colour", "f32", 4, "point");
    }
    for a in &mesh.attributes {
        add(&a.name, kind(a.kind), a.width, "point");
    }
    if mesh.corner_normals.is_some() {
        add("normal", "f32", 3, "corner");
    }
    if mesh.corner_uv.is_some() {
        add("uv", "f32", 2, "corner");
    }
    if mesh.face_chart.is_some() {
        add("chart", "u32", 1, "face");
    }
    out.into()
}

fn kind(kind: ScalarKind) -> &'static str {
    match kind {
        ScalarKind::U8 => "u8",
        ScalarKind::I8 => "i8",
        ScalarKind::U16 => "u16",
        ScalarKind::I16 => "i16",
        ScalarKind::U32 => "u32",
        ScalarKind::I32 => "i32",
        ScalarKind::F32 => "f32",
        ScalarKind::F64 => "f64",
    }
}

/// What may surprise, in words.
fn warnings(mesh: &TriMesh, facts: &Facts) -> Vec<String> {
    let mut out = Vec::new();
    let n = mesh.positions.len();
    let mut add = |some: usize, what: &str| {
        if some > 0 {
            out.push(format!("{} {what}", count(some)));
        }
    };
    add(facts.not_finite, "points have a coordinate that is not finite");
    if mesh.triangles.is_empty() {
        add(facts.duplicates, "points repeat the position of an earlier one");
    }
    if let Some(t) = &facts.topology {
        add(t.degenerate_faces, "faces name the same place twice");
        add(facts.duplicate_faces, "faces repeat an earlier one");
        add(t.non_manifold_edges, "edges have more than two faces");
        add(t.non_manifold_vertices, "vertices join faces that share no edge there");
        add(t.inconsistent_edges, "edges have faces that are turned against each other");
        add(t.unused_vertices, "vertices belong to no face");
    }
    if n == 0 {
        out.push("there are no points".into());
    } else if let Some([min, max]) = facts.extent {
        let distinct = n - facts.not_finite - facts.duplicates;
        if distinct < MIN_POINTS {
            out.push(format!("only {distinct} distinct points: too few to fit a surface"));
        } else if facts.spacing.is_none() {
            out.push(
                "neither spacing nor noise can be told: most points all but coincide beside the extent"
                    .into(),
            );
        }
        let far = min.iter().chain(&max).fold(0.0f64, |a, &b| a.max(b.abs()));
        if facts.spacing.is_some_and(|s| far * f64::from(f32::EPSILON) > 0.1 * s) {
            out.push("so far from the origin that programs with 32-bit floats lose the detail".into());
        }
    }
    out
}

fn text(
    args: &Args,
    format: Format,
    bytes: u64,
    mesh: &TriMesh,
    facts: &Facts,
    warnings: &[String],
) -> String {
    let mut s = String::new();
    let _ = writeln!(
        s,
        "file           {}, {}, {} bytes",
        args.file.display(),
        format.name(),
        count(bytes as usize)
    );
    let _ = writeln!(
        s,
        "content        {}, {}",
        counted(mesh.positions.len(), "point"),
        counted(mesh.triangles.len(), "face")
    );
    let names: Vec<String> = attributes(mesh)
        .as_array()
        .into_iter()
        .flatten()
        .map(|a| {
            let width = a["width"].as_u64().filter(|&w| w > 1).map(|w| format!(" x {w}")).unwrap_or_default();
            format!(
                "{} ({}{width})",
                a["name"].as_str().unwrap_or_default(),
                a["kind"].as_str().unwrap_or_default()
            )
        })
        .collect();
    if !names.is_empty() {
        let _ = writeln!(s, "attributes     {}", names.join(", "));
    }
    if let Some([min, max]) = facts.extent {
        let size = [0, 1, 2].map(|k| short(max[k] - min[k]));
        let _ = writeln!(
            s,
            "extent         {} from ({}) to ({})",
            size.join(" x "),
            min.map(|x| x.to_string()).join(", "),
            max.map(|x| x.to_string()).join(", ")
        );
    }
    if let (Some(spacing), Some(noise)) = (facts.spacing, facts.noise) {
        let _ = writeln!(s, "spacing        {}", short(spacing));
        let _ = writeln!(s, "noise          {}", short(noise));
    }
    if let Some(groups) = &facts.groups {
        let _ = writeln!(
            s,
            "parts          {}, {}, {}",
            count(groups.count),
            counted(groups.stray, "stray point"),
            counted(facts.duplicates, "duplicate")
        );
    }
    if let Some(t) = &facts.topology {
        s += &topology_text(t);
        let _ = writeln!(
            s,
            "duplicates     {}, {}",
            counted(facts.duplicates, "point"),
            counted(facts.duplicate_faces, "face")
        );
    }
    for w in warnings {
        let _ = writeln!(s, "warning        {w}");
    }
    s
}
