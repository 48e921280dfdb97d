//! Projection, evaluation, saving and loading of an atlas.

use crate::ok;
use crate::scene::*;
use atlasfit_capi::atlas::*;
use atlasfit_capi::points::*;
use atlasfit_capi::result::*;
use atlasfit_capi::run::*;
use atlasfit_capi::status::*;
use std::ptr::null_mut;

/// Projection of points, as the arrays of an atlasfit_projection.
#[derive(PartialEq)]
struct Projection {
    positions: Vec<f64>,
    normals: Vec<f32>,
    charts: Vec<u32>,
    chart_uv: Vec<f32>,
    distances: Vec<f64>,
}

fn projected(atlas: *const atlasfit_atlas, p: &atlasfit_points) -> Projection {
    let n = p.count;
    let mut all = Projection {
        positions: vec![0.0; 3 * n],
        normals: vec![0.0; 3 * n],
        charts: vec![0; n],
        chart_uv: vec![0.0; 2 * n],
        distances: vec![0.0; n],
    };
    let out = atlasfit_projection {
        capacity: n,
        positions: all.positions.as_mut_ptr(),
        normals: all.normals.as_mut_ptr(),
        charts: all.charts.as_mut_ptr(),
        chart_uv: all.chart_uv.as_mut_ptr(),
        distances: all.distances.as_mut_ptr(),
        ..init(atlasfit_projection_init)
    };
    let run = atlasfit_run { threads: 1, ..init(atlasfit_run_init) };
    ok(unsafe { atlasfit_atlas_project(atlas, p, &run, &out) });
    all
}

#[test]
fn projection_of_the_scan_is_its_denoising_and_lies_on_the_charts() {
    let s = Scene::new(3000);
    let n = s.xyz.len() / 3;
    let Projection { positions: xyz, normals, charts, distances, .. } = projected(s.atlas, &s.points());
    let (mut denoised, mut claimed) = (vec![0f64; 3 * n], vec![0u32; n]);
    unsafe {
        ok(atlasfit_result_point_positions(s.result, denoised.as_mut_ptr(), denoised.len()));
        ok(atlasfit_result_point_charts(s.result, claimed.as_mut_ptr(), n));
    }
    let mut apart = 0.0;
    for i in (0..n).filter(|&i| claimed[i] != u32::MAX) {
        let d = |k: usize| (xyz[3 * i + k] - denoised[3 * i + k]).powi(2);
        apart += d(0) + d(1) + d(2);
        assert!((charts[i] as usize) < s.report.charts);
        assert!(((0..3).map(|k| normals[3 * i + k].powi(2)).sum::<f32>() - 1.0).abs() < 1e-4);
    }
    let rms = (apart / n as f64).sqrt();
    assert!(rms < 0.5 * s.report.noise, "rms {rms} beside a noise of {}", s.report.noise);
    // The two strays are far from everything.
    assert!(claimed[0] == u32::MAX && distances[0] > 3.0 && distances[1] > 3.0);
    // Projecting twice changes little: the places are on the surface.
    let again = projected(s.atlas, &points(&xyz)).distances;
    let mut sorted: Vec<f64> = again[2..].to_vec();
    sorted.sort_by(f64::total_cmp);
    assert!(sorted[n * 9 / 10] < 0.2 * s.report.noise, "{} beside {}", sorted[n * 9 / 10], s.report.noise);
}

#[test]
fn points_that_are_not_finite_are_projected_nowhere() {
    let s = Scene::new(1500);
    let odd = [f64::NAN, 1.0, 2.0, 103.0, 0.0, 0.0, f64::INFINITY, 0.0, 0.0];
    let Projection { positions: xyz, normals, charts, distances, .. } = projected(s.atlas, &points(&odd));
    assert!(charts[0] == u32::MAX && charts[2] == u32::MAX && charts[1] != u32::MAX);
    assert!(xyz[0].is_nan() && xyz[1] == 1.0 && normals[..3] == [0.0; 3] && distances[0] == 0.0);
    assert!(distances[1] < 1.0);
}

#[test]
fn sixty_four_threads_on_one_atlas_get_the_bytes_that_one_gets() {
    let s = Scene::new(1500);
    let alone = projected(s.atlas, &s.points());
    let (atlas, xyz) = (s.atlas.addr(), &s.xyz);
    std::thread::scope(|scope| {
        let all: Vec<_> = (0..64)
            .map(|_| scope.spawn(move || projected(std::ptr::with_exposed_provenance(atlas), &points(xyz))))
            .collect();
        for one in all {
            assert!(one.join().expect("no thread fails") == alone);
        }
    });
}

#[test]
fn evaluation_gives_the_place_that_projection_found() {
    let s = Scene::new(1500);
    let all = projected(s.atlas, &s.points());
    let mut near = 0;
    for i in 2..200 {
        let uv = [f64::from(all.chart_uv[2 * i]), f64::from(all.chart_uv[2 * i + 1])];
        let (mut xyz, mut normal, mut inside) = ([0f64; 3], [0f32; 3], 0f32);
        let chart = all.charts[i] as usize;
        ok(unsafe {
            atlasfit_atlas_eval(
                s.atlas,
                chart,
                uv.as_ptr(),
                1,
                xyz.as_mut_ptr(),
                normal.as_mut_ptr(),
                &mut inside,
                1,
            )
        });
        let apart = (0..3).map(|k| (xyz[k] - all.positions[3 * i + k]).powi(2)).sum::<f64>().sqrt();
        let along = (0..3).map(|k| normal[k] * all.normals[3 * i + k]).sum::<f32>();
        assert!(inside >= 0.49 && along > 0.8, "{inside} {along}");
        near += usize::from(apart < s.report.noise);
    }
    // Blending with other charts moves a place by less than the noise, but for a few.
    assert!(near > 180, "{near}");
}

/// The bytes of an atlas.
fn saved(atlas: *const atlasfit_atlas) -> Vec<u8> {
    let mut size = 0;
    ok(unsafe { atlasfit_atlas_save(atlas, null_mut(), 0, &mut size) });
    let mut bytes = vec![0u8; size];
    ok(unsafe { atlasfit_atlas_save(atlas, bytes.as_mut_ptr(), size, &mut size) });
    bytes
}

#[test]
fn a_loaded_atlas_answers_as_the_saved_one_and_saves_to_the_same_bytes() {
    let s = Scene::new(1500);
    let bytes = saved(s.atlas);
    let mut loaded = null_mut();
    ok(unsafe { atlasfit_atlas_load(bytes.as_ptr(), bytes.len(), &mut loaded) });
    assert!(saved(loaded) == bytes);
    assert!(projected(loaded, &s.points()) == projected(s.atlas, &s.points()));
    ok(unsafe { atlasfit_atlas_free(loaded) });
}

#[test]
fn damaged_bytes_are_a_bad_file_or_an_atlas_that_answers() {
    let s = Scene::new(300);
    let bytes = saved(s.atlas);
    let few = points(&s.xyz[..30]);
    let mut refused = 0;
    for i in 0..400 {
        let mut damaged = bytes.clone();
        // Both the header and the numbers; single bits, and whole words of ones (not a number).
        let at = if i % 2 == 0 { i * 3 % 900 } else { i * 7919 % (bytes.len() - 8) };
        if i % 3 == 0 {
            damaged[at..at + 8].fill(0xFF);
        } else {
            damaged[at] ^= 1 << (i % 8);
        }
        let mut loaded = null_mut();
        match unsafe { atlasfit_atlas_load(damaged.as_ptr(), damaged.len(), &mut loaded) } {
            ATLASFIT_OK => {
                projected(loaded, &few);
                ok(unsafe { atlasfit_atlas_free(loaded) });
            }
            status => {
                assert_eq!(status, ATLASFIT_BAD_FILE, "{}", last_error());
                refused += 1;
            }
        }
    }
    assert!(refused > 100, "{refused}");
}

/// A seed for the fuzz target `atlas`.
#[test]
#[ignore = "writes a file"]
fn write_a_fuzz_seed() {
    let s = Scene::new(120);
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/corpus/atlas");
    std::fs::create_dir_all(folder).expect("the folder is made");
    std::fs::write(format!("{folder}/small"), saved(s.atlas)).expect("the seed is written");
}
