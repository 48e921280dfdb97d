//! Times a full training step of the network prior beside the matrix products it cannot do without.
//!
//! usage: `mlp_step [STEPS] [POINTS.xyz64] [MESH.obj]`: points as raw little-endian f64 triples (default: a noisy sphere); the charts'
//! grids are written as OBJ.

use atlasfit::geometry::vec3::{Vec3, normalize, scale};
use atlasfit::prior::mlp::{MlpOptions, Trainer};
use atlasfit::rng::Rng;
use atlasfit::{Context, Result, Run};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::io::Write;
use std::time::Instant;

/// Seconds of one step's matrix products alone, in parallel blocks as the trainer runs them (8 charts of 4,096 samples): forward,
/// gradient of the weights, gradient of the inputs.
fn floor() -> f64 {
    const BLOCK: usize = 256;
    let started = Instant::now();
    let matrix = |r: usize, c: usize| DMatrix::<f32>::from_element(r, c, 0.5);
    let setup = || {
        [[256, 128], [128, 64]]
            .map(|[i, o]| [matrix(i, BLOCK), matrix(o, i), matrix(i, o), matrix(BLOCK, i), matrix(o, BLOCK)])
    };
    (0..8 * 4096 / BLOCK).into_par_iter().for_each_init(setup, |layers, _| {
        for [x, w, wt, xt, z] in layers {
            z.gemm(1e-9, w, x, 0.0);
            w.gemm(1e-9, z, xt, 1.0);
            x.gemm(1e-9, wt, z, 0.0);
        }
    });
    started.elapsed().as_secs_f64()
}

fn train(points: &[Vec3], steps: usize, ctx: &Context<'_>) -> Result<Vec<u8>> {
    let options = MlpOptions::default();
    let mut trainer = Trainer::new(points, &options, ctx)?;
    let (mut times, mut floors) = (Vec::new(), Vec::new());
    let started = Instant::now();
    for step in 0..steps {
        if step % 10 == 0 {
            floors.push(floor());
        }
        let at = Instant::now();
        let loss = trainer.step(ctx)?;
        times.push(at.elapsed().as_secs_f64());
        if (step + 1) % 50 == 0 || step + 1 == steps {
            println!(
                "step {} chamfer {:.4} stretch {:.4} seconds {:.1}",
                step + 1,
                loss.chamfer,
                loss.stretch,
                started.elapsed().as_secs_f64()
            );
        }
    }
    for t in [&mut times, &mut floors] {
        t.sort_by(f64::total_cmp);
    }
    let report = |name: &str, t: &[f64]| {
        println!("{name}: best {:.1} ms, median {:.1} ms", t[0] * 1e3, t[t.len() / 2] * 1e3);
    };
    report("step", &times);
    report("matrix products alone", &floors);
    let mesh = trainer.finish(ctx)?.surface();
    let mut obj = Vec::new();
    for p in &mesh.positions {
        let _ = writeln!(obj, "v {} {} {}", p[0], p[1], p[2]);
    }
    for t in &mesh.triangles {
        let _ = writeln!(obj, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1);
    }
    Ok(obj)
}

fn main() -> std::result::Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let steps = args.get(1).map_or(Ok(20), |s| s.parse())?;
    let points: Vec<Vec3> = match args.get(2) {
        Some(path) => {
            let bytes = std::fs::read(path)?;
            let v: Vec<f64> = bytes.as_chunks().0.iter().map(|c| f64::from_le_bytes(*c)).collect();
            v.as_chunks().0.to_vec()
        }
        None => {
            let mut rng = Rng::new(1);
            let mut normal = || [rng.normal(), rng.normal(), rng.normal()];
            (0..16_000).map(|_| scale(normalize(normal()), 0.5)).collect()
        }
    };
    let obj = Run::default().execute(|ctx| train(&points, steps, ctx))?;
    if let Some(path) = args.get(3) {
        std::fs::write(path, obj)?;
    }
    Ok(())
}
