//! `atlasfit measure`: distances, topology, UV quality.

use crate::console::{Console, RunArgs, Usage};
use crate::files::{self, InputArgs};
use crate::number::{boundary, count, counted, json as number, short, vertex, vertices};
use crate::values::direction;
use anyhow::Result;
use atlasfit::measure::uv::seams_seen;
use atlasfit::measure::{
    DistanceOptions, Distances, PointDistance, RimDistance, SurfaceDistance, Topology, UvQuality, points,
    rims, self_intersecting, surface, topology, uv,
};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Options of `measure`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A mesh or points, or - for standard input
    result: PathBuf,
    /// The true surface, in the same frame
    #[arg(long, value_name = "TRUTH")]
    against: Option<PathBuf>,
    /// Measure a mesh's vertices as points
    #[arg(long, requires = "against")]
    points: bool,
    /// Samples of each surface
    #[arg(long, default_value_t = DistanceOptions::default().samples, value_name = "N")]
    samples: usize,
    /// Samples of each surface for the Chamfer distance
    #[arg(long, default_value_t = DistanceOptions::default().chamfer_samples, value_name = "N")]
    chamfer_samples: usize,
    /// Distance of the F-score; 0.5% of the truth's longest side where it is not given
    #[arg(long, value_name = "LENGTH")]
    threshold: Option<f64>,
    /// The direction up: nobody looks at UV seams from below [default: they look from all around]
    #[arg(long, value_name = "X,Y,Z", value_parser = direction, allow_hyphen_values = true)]
    up: Option<[f64; 3]>,
    #[command(flatten)]
    read: InputArgs,
    #[command(flatten)]
    run: RunArgs,
}

/// Measures.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    let loaded = files::load_as(&args.result, args.read.input_format, &args.run, console)?;
    let as_points = args.points || loaded.faces.is_empty();
    let mesh = loaded.into_mesh();
    let options = DistanceOptions::default()
        .with_samples(args.samples)
        .with_chamfer_samples(args.chamfer_samples)
        .with_threshold(args.threshold);
    let mut run = console.start(&args.run);
    let mut known = None;
    let (mut text, mut json) = (String::new(), json!({ "file": files::text(&args.result) }));
    if let Some(path) = &args.against {
        let truth = files::load(path, &args.run, console)?.into_mesh();
        if truth.triangles.is_empty() {
            return Err(Usage(format!("{} has no faces: the truth must be a surface", path.display())).into());
        }
        json["against"] = json!(files::text(path));
        if as_points {
            let cloud = mesh.to_cloud();
            let d = run.execute(|ctx| points(&cloud, &truth, &options, ctx))?;
            text += &point_text(&d);
            json["points"] = point_json(&d);
        } else {
            let d = run.execute(|ctx| surface(&mesh, &truth, &options, ctx))?;
            text += &surface_text(&d);
            json["surface"] = surface_json(&d);
            if let Some(rims) = run.execute(|ctx| rims(&mesh, &truth, &options, ctx))? {
                text += &rims_text(&rims);
                json["rims"] = rims_json(&rims);
            }
            known = Some(d.topology);
        }
    } else if as_points {
        return Err(Usage(format!(
            "{} has no faces: there is no topology to measure. Give --against TRUTH",
            args.result.display()
        ))
        .into());
    }
    if !as_points {
        let t = match known {
            Some(t) => t,
            None => run.execute(|ctx| topology(&mesh, ctx))?,
        };
        text += &topology_text(&t);
        json["topology"] = topology_json(&t);
        let met = run.execute(|ctx| self_intersecting(&mesh, ctx))?;
        let _ = writeln!(text, "intersections  {} that meet others", counted(met, "face"));
        json["topology"]["self_intersecting_faces"] = json!(met);
        if mesh.corner_uv.is_some() {
            let q = run.execute(|ctx| uv(&mesh, ctx))?;
            let seen = run.execute(|ctx| seams_seen(&mesh, args.up, ctx))?;
            text += &uv_text(&q);
            let _ = writeln!(text, "seams seen     {} of their length, from outside", short(seen));
            json["uv"] = uv_json(&q);
            json["uv"]["seams_seen"] = number(seen);
        }
    }
    drop(run);
    console.answer(&text, &json);
    Ok(())
}

fn distances(d: &Distances) -> String {
    format!("rms {}, median {}, 99% {}, max {}", short(d.rms), short(d.median), short(d.p99), short(d.max))
}

fn distances_json(d: &Distances) -> Value {
    json!({
        "rms": number(d.rms), "mean": number(d.mean), "median": number(d.median), "p95": number(d.p95),
        "p99": number(d.p99), "max": number(d.max),
    })
}

fn surface_text(d: &SurfaceDistance) -> String {
    let mut s = String::new();
    let _ = writeln!(s, "accuracy       {}", distances(&d.accuracy));
    let _ = writeln!(s, "completeness   {}", distances(&d.completeness));
    let _ = writeln!(s, "Chamfer        {} (floor {})", short(d.chamfer), short(d.chamfer_floor));
    let _ = writeln!(s, "F-score        {} at {}", short(d.f_score), short(d.threshold));
    let _ = writeln!(
        s,
        "normals        consistency {}, orientation {}",
        short(d.normal_consistency),
        short(d.normal_orientation)
    );
    s
}

/// A surface's distances as JSON.
pub fn surface_json(d: &SurfaceDistance) -> Value {
    json!({
        "chamfer": number(d.chamfer), "chamfer_floor": number(d.chamfer_floor),
        "accuracy": distances_json(&d.accuracy), "completeness": distances_json(&d.completeness),
        "f_score": number(d.f_score), "threshold": number(d.threshold),
        "normal_consistency": number(d.normal_consistency),
        "normal_orientation": number(d.normal_orientation),
    })
}

fn rims_text(r: &RimDistance) -> String {
    let [forth, back] = [&r.accuracy, &r.completeness].map(|d| short(d.rms));
    let lengths = format!("length {} for {}", short(r.length), short(r.true_length));
    format!("rims           rms {forth} to the truth's, {back} back, {lengths}\n")
}

fn rims_json(r: &RimDistance) -> Value {
    json!({
        "accuracy": distances_json(&r.accuracy), "completeness": distances_json(&r.completeness),
        "length": number(r.length), "true_length": number(r.true_length),
    })
}

fn point_text(d: &PointDistance) -> String {
    let bad = if d.not_finite > 0 {
        format!("not finite     {}, left out\n", counted(d.not_finite, "point"))
    } else {
        String::new()
    };
    format!(
        "accuracy       {}\nChamfer        {} (floor {})\n{bad}",
        distances(&d.accuracy),
        short(d.chamfer),
        short(d.chamfer_floor)
    )
}

fn point_json(d: &PointDistance) -> Value {
    json!({
        "accuracy": distances_json(&d.accuracy), "chamfer": number(d.chamfer),
        "chamfer_floor": number(d.chamfer_floor), "not_finite": d.not_finite,
    })
}

/// A topology for people.
pub fn topology_text(t: &Topology) -> String {
    let mut s = format!(
        "mesh           {}, {}, {}, {}\n",
        vertices(t.vertices),
        counted(t.edges, "edge"),
        counted(t.faces, "face"),
        counted(t.parts, "part")
    );
    let genus = t.genus.map_or_else(|| "undefined".into(), |g| g.to_string());
    let sides = if t.orientable { "orientable" } else { "one-sided" };
    let _ = writeln!(s, "shape          Euler {}, genus {genus}, {sides}", t.euler);
    let _ = writeln!(s, "boundary       {}", boundary(t.boundary_edges, t.boundary_loops));
    let _ = writeln!(
        s,
        "defects        {}, {} non-manifold {}, {}, {}, {} unused {}",
        counted(t.non_manifold_edges, "non-manifold edge"),
        count(t.non_manifold_vertices),
        vertex(t.non_manifold_vertices),
        counted(t.inconsistent_edges, "inconsistent edge"),
        counted(t.degenerate_faces, "degenerate face"),
        count(t.unused_vertices),
        vertex(t.unused_vertices)
    );
    s
}

/// A topology as JSON.
pub fn topology_json(t: &Topology) -> Value {
    json!({
        "vertices": t.vertices, "edges": t.edges, "faces": t.faces, "degenerate_faces": t.degenerate_faces,
        "unused_vertices": t.unused_vertices, "parts": t.parts, "boundary_edges": t.boundary_edges,
        "boundary_loops": t.boundary_loops, "non_manifold_edges": t.non_manifold_edges,
        "non_manifold_vertices": t.non_manifold_vertices, "inconsistent_edges": t.inconsistent_edges,
        "orientable": t.orientable, "euler": t.euler, "genus": t.genus, "closed": t.is_closed(),
    })
}

fn uv_text(q: &UvQuality) -> String {
    let mut s = String::new();
    let _ = writeln!(
        s,
        "UV charts      {}, seam length {} of the area's root, {:.1}% of the outlines along the page",
        count(q.charts),
        short(q.seam),
        100.0 * q.straightness
    );
    let _ = writeln!(
        s,
        "UV stretch     L2 {}, Linf {}, median {}, 95% {}, conformal {}",
        short(q.stretch_l2),
        short(q.stretch_linf),
        short(q.stretch_median),
        short(q.stretch_p95),
        short(q.conformal)
    );
    let _ = writeln!(
        s,
        "UV defects     {}, {}, {} of texels overlap, {}",
        counted(q.flips, "flip"),
        counted(q.overlapping_faces, "overlapping face"),
        short(q.overlap),
        counted(q.degenerate, "degenerate face")
    );
    let place = match (q.finite, q.inside) {
        (false, _) => "some not finite",
        (true, false) => "some outside [0, 1]",
        (true, true) => "all in [0, 1]",
    };
    let _ = writeln!(s, "UV layout      coverage {}, {place}", short(q.coverage));
    s
}

/// UV quality as JSON.
pub fn uv_json(q: &UvQuality) -> Value {
    json!({
        "faces": q.faces, "charts": q.charts, "seam": number(q.seam), "stretch_l2": number(q.stretch_l2),
        "stretch_linf": number(q.stretch_linf), "stretch_median": number(q.stretch_median),
        "stretch_p95": number(q.stretch_p95), "conformal": number(q.conformal), "flips": q.flips,
        "degenerate": q.degenerate, "overlap": number(q.overlap), "overlapping_faces": q.overlapping_faces,
        "straightness": number(q.straightness),
        "coverage": number(q.coverage), "inside": q.inside, "finite": q.finite,
    })
}
