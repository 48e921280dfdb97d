//! Denoising gives what the core gives, whatever the caller's memory looks like.

use crate::scene::*;
use crate::{ok, triples};
use atlasfit::geometry::{Attribute, PointCloud, ScalarKind};
use atlasfit::{DenoiseOptions, Run};
use atlasfit_capi::arrays::*;
use atlasfit_capi::buffer::*;
use atlasfit_capi::denoise::*;
use atlasfit_capi::points::*;
use atlasfit_capi::result::*;
use atlasfit_capi::result_copy::*;
use atlasfit_capi::run::*;
use atlasfit_capi::status::*;
use atlasfit_net::Prior;
use atlasfit_net::explicit::{Network, NetworkOptions, Recipe};
use atlasfit_net::level_set::LevelSetOptions;
use std::ptr::{null, null_mut};

#[test]
fn defaults_are_the_core_s() {
    let (xyz, d) = (scan(1500), DenoiseOptions::default());
    let o: atlasfit_denoise_options = init(atlasfit_denoise_options_init);
    assert_eq!((o.detail, o.fill_holes, o.texture_size), (d.detail, d.fill_holes, d.texture_size));
    assert_eq!((o.noise, o.charts, o.uv), (0.0, 0, 1));
    assert_eq!((o.strength, d.strength), (1.0, 1.0));
    assert_eq!((o.faces, o.max_error, d.faces, d.max_error), (0, -1.0, None, None));
    let (n, recipe) = (NetworkOptions::default(), [Recipe::Fast, Recipe::Paper][o.recipe as usize]);
    assert_eq!(
        (recipe, o.network_charts as usize, o.network_iterations as usize),
        (n.recipe, n.charts, n.iterations)
    );
    assert_eq!((o.network_stretch_weight, o.network_learning_rate), (n.stretch_weight, n.learning_rate));
    let cloud = PointCloud::from_positions(triples(&xyz));
    let core = atlasfit::denoise(&cloud, &d, &mut Run::default()).expect("the core fits");
    let s = Scene::new(1500);
    let r = s.report;
    assert_eq!(
        (r.points, r.outliers, r.vertices),
        (core.points.len(), core.report.outliers, core.surface.positions.len())
    );
    assert_eq!((r.spacing, r.noise, r.voxel), (core.report.spacing, core.report.noise, core.report.voxel));
    let (mut p, mut v) = (vec![0f64; 3 * r.points], vec![0f64; 3 * r.vertices]);
    let (mut t, mut uv) = (vec![0u32; 3 * r.triangles], vec![0f32; 6 * r.triangles]);
    unsafe {
        ok(atlasfit_result_point_positions(s.result, p.as_mut_ptr(), p.len()));
        ok(atlasfit_result_surface_positions(s.result, v.as_mut_ptr(), v.len()));
        ok(atlasfit_result_surface_triangles(s.result, t.as_mut_ptr(), t.len()));
        ok(atlasfit_result_surface_corner_uv(s.result, uv.as_mut_ptr(), uv.len()));
    }
    assert_eq!(triples(&p), core.points.positions);
    assert_eq!(triples(&v), core.surface.positions);
    assert_eq!(t, core.surface.triangles.as_flattened());
    assert_eq!(uv, core.surface.corner_uv.expect("UVs").as_flattened().as_flattened());
}

#[test]
fn small_parts_are_left_out_and_their_points_stay_or_go_with_the_outliers() {
    // The scan, and a third of its points again: as large as 0.3 of it, beside it.
    let (mut xyz, kept) = (scan(3000), 3000);
    xyz.extend(scan(1000).chunks(3).flat_map(|p| [4.0 + 0.3 * p[0], 0.3 * p[1], 0.3 * p[2]]));
    let points = atlasfit_points {
        positions: xyz.as_ptr().cast(),
        count: 4000,
        scalar: ATLASFIT_F64,
        ..init(atlasfit_points_init)
    };
    let report = |spoil: &dyn Fn(&mut atlasfit_denoise_options)| unsafe {
        let mut options = atlasfit_denoise_options { uv: 0, ..init(atlasfit_denoise_options_init) };
        spoil(&mut options);
        let (mut result, mut report) = (null_mut(), output::<atlasfit_report>());
        ok(atlasfit_denoise(&points, &options, null(), &mut result));
        ok(atlasfit_result_report(result, &mut report));
        ok(atlasfit_result_free(result));
        report
    };
    let all = report(&|_| ());
    assert_eq!((all.parts, all.dropped_parts, all.dropped_points), (2, 0, 0));
    let large = report(&|o| o.min_part = 0.2);
    assert_eq!((large.parts, large.dropped_parts, large.points), (1, 1, 4000));
    assert!((980..=1000).contains(&large.dropped_points), "{}", large.dropped_points);
    let alone = report(&|o| (o.largest, o.outliers) = (1, ATLASFIT_OUTLIERS_DROP));
    assert_eq!((alone.vertices, alone.dropped_points), (large.vertices, large.dropped_points));
    assert_eq!(alone.points, 4000 - alone.dropped_points - alone.outliers);
    assert!(alone.points <= kept, "{}", alone.points);
}

#[test]
fn outliers_follow_their_neighbours_where_the_points_come_with_triangles() {
    let (xyz, triangles) = spiky_sheet();
    let spike = |p: &atlasfit_points| unsafe {
        let options = atlasfit_denoise_options { uv: 0, ..init(atlasfit_denoise_options_init) };
        let (mut result, mut report) = (null_mut(), output::<atlasfit_report>());
        ok(atlasfit_denoise(p, &options, null(), &mut result));
        ok(atlasfit_result_report(result, &mut report));
        let (mut p, mut chart) = (vec![0f64; 3 * report.points], vec![0u32; report.points]);
        ok(atlasfit_result_point_positions(result, p.as_mut_ptr(), p.len()));
        ok(atlasfit_result_point_charts(result, chart.as_mut_ptr(), chart.len()));
        ok(atlasfit_result_free(result));
        assert_eq!((report.outliers, chart[SPIKE]), (1, u32::MAX));
        (report.followed_outliers, p[3 * SPIKE + 2])
    };
    let bare = points(&xyz);
    let (triangles, triangle_count) = (triangles.as_ptr(), triangles.len() / 3);
    let mesh = atlasfit_points { triangles, triangle_count, ..bare };
    let (followed, height) = spike(&mesh);
    assert!(followed == 1 && height.abs() < 0.1, "{followed} {height}");
    assert_eq!(spike(&bare), (0, 12.0));
    // A caller that was built before there were triangles has a smaller struct.
    let older = atlasfit_points { struct_size: std::mem::offset_of!(atlasfit_points, triangles), ..mesh };
    assert_eq!(spike(&older), (0, 12.0));
    let mut result = null_mut();
    let wrong = atlasfit_points { count: 800, ..mesh };
    let status = unsafe { atlasfit_denoise(&wrong, null(), null(), &mut result) };
    assert_eq!(status, ATLASFIT_INDEX_OUT_OF_RANGE);
    assert!(
        last_error().contains("triangle 1482 holds 801 but there are only 800 points"),
        "{}",
        last_error()
    );
}

#[test]
fn a_surface_has_as_many_triangles_as_points_or_as_asked_for() {
    let xyz = scan(2000);
    let points = atlasfit_points {
        positions: xyz.as_ptr().cast(),
        count: 2000,
        scalar: ATLASFIT_F64,
        ..init(atlasfit_points_init)
    };
    let triangles = |faces, max_error| unsafe {
        let options =
            atlasfit_denoise_options { uv: 0, faces, max_error, ..init(atlasfit_denoise_options_init) };
        let (mut result, mut report) = (null_mut(), output::<atlasfit_report>());
        ok(atlasfit_denoise(&points, &options, null(), &mut result));
        ok(atlasfit_result_report(result, &mut report));
        ok(atlasfit_result_free(result));
        report.triangles
    };
    let (usual, dense, asked) = (triangles(0, -1.0), triangles(0, 0.0), triangles(700, -1.0));
    assert!(usual < 2400 && dense > 6000 && asked <= 700, "{usual} {dense} {asked}");
}

#[test]
fn warnings_are_the_core_s_and_training_that_diverges_is_a_status() {
    let xyz = scan(1500);
    let points = atlasfit_points {
        positions: xyz.as_ptr().cast(),
        count: 1500,
        scalar: ATLASFIT_F64,
        ..init(atlasfit_points_init)
    };
    let options = atlasfit_denoise_options {
        detail: 3.0,
        max_error: 0.0,
        uv: 0,
        ..init(atlasfit_denoise_options_init)
    };
    let how = DenoiseOptions::default().with_detail(3.0).with_max_error(Some(0.0)).with_uv(false);
    let core = atlasfit::denoise(&PointCloud::from_positions(triples(&xyz)), &how, &mut Run::default());
    let warnings = core.expect("the core fits").report.warnings.join("\n");
    assert!(warnings.contains("triangles"), "{warnings}");
    let (mut result, mut length, mut text) = (null_mut(), 0, vec![0u8; warnings.len() + 1]);
    unsafe {
        ok(atlasfit_denoise(&points, &options, null(), &mut result));
        let room = text.len();
        ok(atlasfit_result_warnings(result, text.as_mut_ptr().cast(), room, &mut length));
        ok(atlasfit_result_free(result));
    }
    assert_eq!((length, &text[..length]), (warnings.len(), warnings.as_bytes()));

    let options = atlasfit_denoise_options {
        prior: ATLASFIT_PRIOR_MLP,
        recipe: ATLASFIT_RECIPE_PAPER,
        network_charts: 1,
        network_iterations: 10,
        network_learning_rate: 1e37,
        ..init(atlasfit_denoise_options_init)
    };
    let status = unsafe { atlasfit_denoise(&points, &options, null(), &mut result) };
    assert_eq!((status, result.is_null()), (ATLASFIT_DIVERGED, true));
}

/// A scan as bytes: each point `stride` bytes after the last, `lead` bytes into the buffer.
fn packed_as(xyz: &[f64], f32s: bool, stride: usize, lead: usize) -> Vec<u8> {
    let mut bytes = vec![0xEE; lead + xyz.len() / 3 * stride];
    for (i, p) in xyz.as_chunks::<3>().0.iter().enumerate() {
        let at = lead + i * stride;
        let place: Vec<u8> = if f32s {
            p.iter().flat_map(|x| (*x as f32).to_ne_bytes()).collect()
        } else {
            p.iter().flat_map(|x| x.to_ne_bytes()).collect()
        };
        bytes[at..at + place.len()].copy_from_slice(&place);
    }
    bytes
}

/// Denoised positions and the surface's size.
#[derive(PartialEq)]
struct Denoised {
    positions: Vec<f64>,
    vertices: usize,
    triangles: usize,
}

fn denoised(p: &atlasfit_points, threads: u32) -> Denoised {
    let run = atlasfit_run { threads, ..init(atlasfit_run_init) };
    let (mut result, mut report) = (null_mut(), output::<atlasfit_report>());
    unsafe {
        ok(atlasfit_denoise(p, null(), &run, &mut result));
        ok(atlasfit_result_report(result, &mut report));
        let mut xyz = vec![0f64; 3 * report.points];
        ok(atlasfit_result_point_positions(result, xyz.as_mut_ptr(), xyz.len()));
        ok(atlasfit_result_free(result));
        Denoised { positions: xyz, vertices: report.vertices, triangles: report.triangles }
    }
}

#[test]
fn each_prior_gives_what_the_core_gives() {
    let xyz = scan(300);
    let cloud = PointCloud::from_positions(triples(&xyz));
    // Two steps tell the priors apart.
    let network = |network| {
        Prior::Network(
            NetworkOptions::default()
                .with_network(network)
                .with_recipe(Recipe::Paper)
                .with_charts(1)
                .with_iterations(2),
        )
    };
    for (prior, core) in [
        (ATLASFIT_PRIOR_MLP, network(Network::Dense)),
        (ATLASFIT_PRIOR_CONV, network(Network::Conv)),
        (ATLASFIT_PRIOR_LEVEL_SET, Prior::LevelSet(LevelSetOptions::default())),
    ] {
        let o = atlasfit_denoise_options {
            prior,
            recipe: ATLASFIT_RECIPE_PAPER,
            network_charts: 1,
            network_iterations: 2,
            uv: 0,
            ..init(atlasfit_denoise_options_init)
        };
        let options = DenoiseOptions::default().with_uv(false);
        let expected =
            atlasfit::pipeline::denoise_guided(&cloud, &options, core.guide(), &mut Run::default());
        let mut result = null_mut();
        let status = unsafe { atlasfit_denoise(&points(&xyz), &o, null(), &mut result) };
        match expected {
            Ok(core) => {
                let mut p = vec![0f64; 3 * core.points.len()];
                unsafe { ok(atlasfit_result_point_positions(result, p.as_mut_ptr(), p.len())) };
                assert_eq!(triples(&p), core.points.positions, "prior {prior}");
            }
            Err(e) => {
                assert!(status != ATLASFIT_OK && last_error().ends_with(&e.to_string()), "prior {prior}: {e}")
            }
        }
        assert_eq!(unsafe { atlasfit_result_free(result) }, ATLASFIT_OK);
    }
}

#[test]
fn strides_alignment_scalar_type_and_threads_change_no_bit() {
    // Rounded to f32 first, so that both types hold the same numbers.
    let xyz: Vec<f64> = scan(1200).iter().map(|x| f64::from(*x as f32)).collect();
    let plain = denoised(&points(&xyz), 1);
    for (f32s, stride, lead, threads) in [(true, 12, 0, 2), (true, 29, 3, 5), (false, 40, 1, 3)] {
        let bytes = packed_as(&xyz, f32s, stride, lead);
        let p = atlasfit_points {
            positions: bytes[lead..].as_ptr().cast(),
            stride,
            scalar: if f32s { ATLASFIT_F32 } else { ATLASFIT_F64 },
            ..points(&xyz)
        };
        assert!(denoised(&p, threads) == plain, "f32 {f32s}, stride {stride}, {threads} threads");
    }
}

/// The core's cloud with these colours (bytes), an intensity of half the index, and a label of a hundredth of
/// it.
fn core_cloud(xyz: &[f64], colors: &[u8]) -> PointCloud {
    let n = xyz.len() / 3;
    PointCloud {
        colors: Some(
            colors
                .as_chunks::<3>()
                .0
                .iter()
                .map(|c| [c[0], c[1], c[2], 255].map(|x| f32::from(x) / 255.0))
                .collect(),
        ),
        attributes: vec![
            Attribute {
                name: "intensity".into(),
                width: 1,
                kind: ScalarKind::F32,
                values: (0..n).map(|i| i as f64 * 0.5).collect(),
            },
            Attribute {
                name: "label".into(),
                width: 1,
                kind: ScalarKind::U16,
                values: (0..n).map(|i| (i / 100) as f64).collect(),
            },
        ],
        ..PointCloud::from_positions(triples(xyz))
    }
}

#[test]
fn colors_and_attributes_reach_the_surface_as_through_the_core() {
    let xyz = scan(1200);
    let n = xyz.len() / 3;
    let colors: Vec<u8> = (0..n).flat_map(|i| [(i % 256) as u8, 10, 200]).collect();
    // Intensity and label side by side in one array of the caller's.
    #[repr(C, packed)]
    struct Row {
        intensity: f32,
        label: u16,
    }
    let rows: Vec<Row> = (0..n).map(|i| Row { intensity: i as f32 * 0.5, label: (i / 100) as u16 }).collect();
    let base = init(atlasfit_attribute_init);
    let stride = size_of::<Row>();
    let attributes = [
        atlasfit_attribute { name: c"intensity".as_ptr(), values: rows.as_ptr().cast(), stride, ..base },
        atlasfit_attribute {
            values: unsafe { rows.as_ptr().cast::<u8>().add(4).cast() },
            stride,
            scalar: ATLASFIT_U16,
            ..base
        },
    ];
    let p = atlasfit_points {
        colors: colors.as_ptr().cast(),
        color_scalar: ATLASFIT_U8,
        color_width: 3,
        attribute_count: 2,
        attributes: attributes.as_ptr(),
        ..points(&xyz)
    };
    let cloud = core_cloud(&xyz, &colors);
    let o = atlasfit_denoise_options {
        uv: 0,
        outliers: ATLASFIT_OUTLIERS_DROP,
        ..init(atlasfit_denoise_options_init)
    };
    let how = DenoiseOptions::default().with_uv(false).with_outliers(atlasfit::pipeline::Outliers::Drop);
    let core = atlasfit::denoise(&cloud, &how, &mut Run::default()).expect("the core fits");
    let (mut result, mut r) = (null_mut(), output::<atlasfit_report>());
    unsafe {
        ok(atlasfit_denoise(&p, &o, null(), &mut result));
        ok(atlasfit_result_report(result, &mut r));
        assert_eq!((r.attributes, r.has_colors, r.has_uv, r.uv_charts), (2, 1, 0, 0));
        assert!(r.outliers >= 2 && r.points == n - r.outliers);
        let mut rgba = vec![0f32; 4 * r.vertices];
        ok(atlasfit_result_surface_colors(result, rgba.as_mut_ptr(), rgba.len()));
        assert_eq!(rgba, core.surface.colors.expect("colours").as_flattened());
        for k in 0..2 {
            let mut values = vec![0f64; r.vertices];
            ok(atlasfit_result_surface_attribute(result, k, values.as_mut_ptr(), values.len()));
            assert_eq!(values, core.surface.attributes[k].values);
        }
        let (mut sources, mut charts) = (vec![0u32; r.points], vec![0u32; r.points]);
        ok(atlasfit_result_point_sources(result, sources.as_mut_ptr(), sources.len()));
        ok(atlasfit_result_point_charts(result, charts.as_mut_ptr(), charts.len()));
        assert!(sources == core.point_source && charts == core.point_chart);
        assert!(charts.iter().all(|c| (*c as usize) < r.charts));
        assert_eq!(atlasfit_result_surface_corner_uv(result, null_mut(), 0), ATLASFIT_NOT_AVAILABLE);
        ok(atlasfit_result_free(result));
    }
}

#[test]
fn the_normals_of_corners_are_the_core_s() {
    // A roof with a little noise.
    let xyz: Vec<f64> = (0..4000)
        .flat_map(|i| {
            let [x, y, z] = [0.754_877, 0.569_840, 0.438_579].map(|step| (f64::from(i) * step).fract() - 0.5);
            [x, y, 0.004 * z - x.abs()]
        })
        .collect();
    let cloud = PointCloud::from_positions(triples(&xyz));
    let core = atlasfit::denoise(&cloud, &DenoiseOptions::default(), &mut Run::default());
    let expected = core.expect("the core fits").surface.corner_normals.expect("a ridge");
    let mut normals = vec![0f32; 9 * expected.len()];
    let to = atlasfit_buffer {
        data: normals.as_mut_ptr().cast(),
        capacity: normals.len(),
        ..init(atlasfit_buffer_init)
    };
    let mut result = null_mut();
    unsafe {
        ok(atlasfit_denoise(&points(&xyz), null(), null(), &mut result));
        ok(atlasfit_result_copy(result, ATLASFIT_SURFACE_CORNER_NORMALS, &to));
        ok(atlasfit_result_free(result));
    }
    assert_eq!(normals, *expected.as_flattened().as_flattened());
}
