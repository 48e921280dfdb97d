//! What the C ABI adds to the core's own time: the time of all calls, results copied out, less that of the
//! core in the same run; the least of some runs each.
//!
//! `cargo bench -p atlasfit-capi`. A measurement: what else the machine does counts too.

#[path = "../tests/scene/mod.rs"]
mod scene;

use atlasfit_capi::denoise::*;
use atlasfit_capi::result::*;
use atlasfit_capi::run::*;
use atlasfit_capi::status::ATLASFIT_OK;
use atlasfit_capi::unwrap::*;
use atlasfit_capi::uv::*;
use scene::*;
use std::hint::black_box;
use std::ptr::{null, null_mut};
use std::time::Instant;

/// Runs of each.
const RUNS: usize = 7;

fn ok(status: i32) {
    assert_eq!(status, ATLASFIT_OK, "{}", last_error());
}

/// Runs `abi`, which gives its own seconds and the core's in them, and prints the least of both parts.
fn measure(what: &str, abi: impl Fn() -> (f64, f64)) {
    let runs = (0..RUNS).map(|_| abi()).map(|(all, core)| (core, all - core));
    let (core, more) = runs.fold((f64::INFINITY, f64::INFINITY), |a, r| (a.0.min(r.0), a.1.min(r.1)));
    println!("{what}: core {:.1} ms, ABI {:+.2} ms, {:+.2} %", 1e3 * core, 1e3 * more, 100.0 * more / core);
}

/// A grid of waves of 2 n² triangles.
fn waves(n: u32) -> (Vec<f32>, Vec<u32>) {
    let at = |i: u32, j: u32| {
        [i as f32, j as f32, 6.0 * (i as f32 / 9.0).sin() * (j as f32 / 11.0).cos()].map(|x| x / n as f32)
    };
    let xyz = (0..=n).flat_map(|i| (0..=n).flat_map(move |j| at(i, j))).collect();
    let quad = |i: u32, j: u32| {
        let a = i * (n + 1) + j;
        [a, a + n + 1, a + n + 2, a, a + n + 2, a + 1]
    };
    (xyz, (0..n).flat_map(|i| (0..n).flat_map(move |j| quad(i, j))).collect())
}

fn main() {
    for n in [300, 3_000, 30_000] {
        let xyz = scan(n);
        let abi = || unsafe {
            let start = Instant::now();
            let (mut result, mut report) = (null_mut(), output::<atlasfit_report>());
            ok(atlasfit_denoise(&points(&xyz), null(), &init(atlasfit_run_init), &mut result));
            ok(atlasfit_result_report(result, &mut report));
            let mut positions = vec![0f64; 3 * report.vertices];
            let (mut triangles, mut uv) =
                (vec![0u32; 3 * report.triangles], vec![0f32; 6 * report.triangles]);
            ok(atlasfit_result_surface_positions(result, positions.as_mut_ptr(), positions.len()));
            ok(atlasfit_result_surface_triangles(result, triangles.as_mut_ptr(), triangles.len()));
            ok(atlasfit_result_surface_corner_uv(result, uv.as_mut_ptr(), uv.len()));
            ok(atlasfit_result_free(result));
            black_box((positions, triangles, uv));
            (start.elapsed().as_secs_f64(), report.stage_seconds.iter().sum::<f64>())
        };
        measure(&format!("denoise, {n} points"), abi);
    }
    for n in [20, 100, 500] {
        let (xyz, triangles) = waves(n);
        let abi = || unsafe {
            let start = Instant::now();
            let (mut uv, mut info) = (null_mut(), output::<atlasfit_uv_info>());
            let mut corners = vec![0f32; 2 * triangles.len()];
            ok(atlasfit_unwrap(&mesh(&xyz, &triangles), null(), &init(atlasfit_run_init), &mut uv));
            ok(atlasfit_uv_get_info(uv, &mut info));
            ok(atlasfit_uv_corners(uv, corners.as_mut_ptr(), corners.len()));
            ok(atlasfit_uv_free(uv));
            black_box(corners);
            (start.elapsed().as_secs_f64(), info.seconds)
        };
        measure(&format!("unwrap, {} triangles", 2 * n * n), abi);
    }
}
