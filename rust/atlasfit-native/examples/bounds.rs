//! What calls of CGAL and OpenMesh need: how long each goes on after it was asked to stop, and its memory.
//!
//!     cargo run -p atlasfit-native --features cgal,openmesh --example bounds -- [RINGS]
//!
//! On a bowl of 4 x RINGS^2 triangles each call is run whole, then again and again and asked to stop at
//! evenly spaced moments. Printed: seconds of the whole call, the longest time from asking to the return in
//! milliseconds, and by how much memory peaked (Linux), in bytes for a triangle that goes in or comes out.

use atlasfit::geometry::TriMesh;
use atlasfit::{CancelToken, Context, Result, Run};
use atlasfit_native::{Subdivision, cgal, openmesh};
use std::time::{Duration, Instant};

/// Moments at which each call is asked to stop.
const STOPS: u32 = 12;

/// A job and how many triangles it made.
type Job<'a> = Box<dyn Fn(&Context<'_>) -> Result<usize> + Sync + 'a>;

fn main() -> Result<()> {
    let rings: u32 = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(250);
    let mesh = bowl(rings);
    println!("{} triangles", mesh.triangles.len());
    println!(
        "| call | triangles made | s | stops after, ms | bytes / triangle in | bytes / triangle in and out |"
    );
    println!("|---|---|---|---|---|---|");
    let edge = 2.2 / f64::from(rings);
    let mut jobs: Vec<(&str, Job<'_>)> = Vec::new();
    if let Some(cgal) = cgal() {
        let (alpha, mesh) = (8.0 * edge, &mesh);
        let wrap = move |ctx: &Context<'_>| {
            cgal.alpha_wrap(mesh, alpha, 0.1 * alpha, ctx).map(|m| m.triangles.len())
        };
        jobs.push(("alpha_wrap", Box::new(wrap)));
        jobs.push(("self_intersections", Box::new(move |ctx| cgal.self_intersections(mesh, ctx).map(|_| 0))));
        let remesh = move |ctx: &Context<'_>| cgal.remesh(mesh, edge, 3, ctx).map(|m| m.triangles.len());
        jobs.push(("remesh", Box::new(remesh)));
    }
    if let Some(openmesh) = openmesh() {
        for (name, how) in
            [("subdivide, Loop", Subdivision::Loop), ("subdivide, sqrt(3)", Subdivision::Sqrt3)]
        {
            let mesh = &mesh;
            let step =
                move |ctx: &Context<'_>| openmesh.subdivide(mesh, how, 1, ctx).map(|m| m.triangles.len());
            jobs.push((name, Box::new(step)));
        }
    }
    for (name, job) in &jobs {
        let (before, start) = (reset_peak(), Instant::now());
        let made = Run::default().execute(job)?;
        let whole = start.elapsed();
        let used = peak().saturating_sub(before) as f64;
        let slowest = (1..=STOPS).map(|k| stopped_after(job, whole * k / (STOPS + 1))).max();
        let given = mesh.triangles.len();
        println!(
            "| {name} | {made} | {:.2} | {:.0} | {:.0} | {:.0} |",
            whole.as_secs_f64(),
            slowest.unwrap_or_default().as_secs_f64() * 1e3,
            used / given as f64,
            used / (given + made) as f64
        );
    }
    Ok(())
}

/// How long a job goes on once it is asked to stop.
fn stopped_after(job: &Job<'_>, moment: Duration) -> Duration {
    let cancel = CancelToken::new();
    let token = cancel.clone();
    let asker = std::thread::spawn(move || {
        std::thread::sleep(moment);
        token.cancel();
        Instant::now()
    });
    let mut run = Run { cancel: Some(cancel), ..Run::default() };
    let ended = run.execute(job).map_or_else(|_| Some(Instant::now()), |_| None);
    let asked = asker.join().ok();
    match (ended, asked) {
        (Some(ended), Some(asked)) => ended.saturating_duration_since(asked),
        _ => Duration::ZERO,
    }
}

/// Forgets the peak of resident memory; gives what is resident now.
fn reset_peak() -> u64 {
    // Where that cannot be done, the peak is that of all calls so far.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    status("VmRSS:")
}

fn peak() -> u64 {
    status("VmHWM:")
}

/// A number of bytes in the process's status; 0 where there is none.
fn status(name: &str) -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix(name)).unwrap_or_default();
    line.split_whitespace().next().and_then(|n| n.parse::<u64>().ok()).unwrap_or(0) * 1024
}

/// A sphere without its north.
fn bowl(rings: u32) -> TriMesh {
    let sides = 2 * rings;
    let at = |k: u32| {
        let (i, j) = (k / sides, k % sides);
        let (b, a) = (0.1 + 2.2 * f64::from(i) / f64::from(rings), f64::from(j) / f64::from(sides));
        let (sa, ca) = (std::f64::consts::TAU * a).sin_cos();
        [(3.1 - b).sin() * ca, (3.1 - b).sin() * sa, (3.1 - b).cos()]
    };
    let corner = |i: u32, j: u32| i * sides + j % sides;
    let square = |k: u32| {
        let (i, j) = (k / sides, k % sides);
        let [a, b, c, d] = [corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)];
        [[a, b, c], [a, c, d]]
    };
    TriMesh::new((0..(rings + 1) * sides).map(at).collect(), (0..rings * sides).flat_map(square).collect())
}
