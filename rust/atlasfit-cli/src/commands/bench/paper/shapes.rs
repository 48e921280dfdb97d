//! The shapes of the paper's tables, each with a noisy scan: from shapes.py, or made up with `--quick`.

use super::args::Args;
use crate::commands::bench::peers::Scripts;
use crate::console::Console;
use crate::files;
use anyhow::Result;
use atlasfit::geometry::TriMesh;
use atlasfit::measure::sample;
use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3::{self, Vec3};

/// The paper's noise: standard deviation, for shapes of size 1.
pub const SIGMA: f64 = 0.002;
/// The paper's points per scan and per evaluation.
pub const COUNT: usize = 16_000;

/// A true surface and its noisy scan.
pub struct Shape {
    pub truth: TriMesh,
    pub scan: Vec<Vec3>,
}

/// A shape by its name.
pub fn shape(name: &str, args: &Args, console: &Console) -> Result<Shape> {
    if args.quick {
        return made(name, args, console);
    }
    let folder = args.output.join("shapes");
    std::fs::create_dir_all(&folder)?;
    let [truth, noisy] = [folder.join(format!("{name}.ply")), folder.join(format!("{name}-noisy.ply"))];
    if !noisy.exists() {
        let scripts = Scripts { python: &args.python, folder: &args.scripts };
        scripts.run("shapes.py", &[&name, &SIGMA.to_string(), &truth, &noisy])?;
    }
    let load = |path| files::load(path, &args.run, console);
    Ok(Shape { truth: load(&truth)?.into_mesh(), scan: vec3::of(&load(&noisy)?.cloud.positions).to_vec() })
}

/// A made-up shape: a ring for what is thin, a sphere for all else.
pub fn made(name: &str, args: &Args, console: &Console) -> Result<Shape> {
    let truth =
        if matches!(name, "ring" | "spiral") { torus(0.5 - 0.5 * 0.03, 0.5 * 0.03) } else { sphere(0.5) };
    let scan = console.start_silent(&args.run).execute(|ctx| {
        let mut rng = Rng::stream(ctx.seed, 7);
        let clean = sample::uniform(&truth, count(args), ctx.seed, ctx)?;
        Ok(clean.iter().map(|s| s.point.map(|x| x + SIGMA * rng.normal())).collect())
    })?;
    Ok(Shape { truth, scan })
}

/// Points per scan.
fn count(args: &Args) -> usize {
    if args.quick { 1500 } else { COUNT }
}

fn sphere(radius: f64) -> TriMesh {
    grid(64, 128, |u, v| {
        let (t, a) = (std::f64::consts::PI * u, std::f64::consts::TAU * v);
        Vec3([t.sin() * a.cos(), t.sin() * a.sin(), t.cos()]).normalized() * radius
    })
}

fn torus(large: f64, small: f64) -> TriMesh {
    grid(256, 48, |u, v| {
        let (a, b) = (std::f64::consts::TAU * u, std::f64::consts::TAU * v);
        let r = large + small * b.cos();
        Vec3([r * a.cos(), r * a.sin(), small * b.sin()])
    })
}

/// Triangles of a grid of parameters in the unit square.
fn grid(n: u32, m: u32, at: impl Fn(f64, f64) -> Vec3) -> TriMesh {
    let index = |i: u32, j: u32| i * (m + 1) + j;
    let place = |i: u32, n: u32| f64::from(i) / f64::from(n);
    let positions = (0..=n)
        .flat_map(|i| (0..=m).map(move |j| (i, j)))
        .map(|(i, j)| at(place(i, n), place(j, m)).0)
        .collect();
    let triangles = (0..n)
        .flat_map(|i| (0..m).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    TriMesh::new(positions, triangles)
}
