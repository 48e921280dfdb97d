//! What comes through the C ABI is what the core makes, whatever the caller's memory looks like and however
//! many threads ask.
#![expect(clippy::type_complexity, reason = "all that a projection gives")]

mod scene;

use atlasfit::bake::{BakeOptions, Colors, bake};
use atlasfit::geometry::{Attribute, PointCloud, ScalarKind, TriMesh};
use atlasfit::{DenoiseOptions, Run};
use atlasfit_capi::arrays::*;
use atlasfit_capi::atlas::*;
use atlasfit_capi::bake::*;
use atlasfit_capi::denoise::*;
use atlasfit_capi::measure::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::points::*;
use atlasfit_capi::result::*;
use atlasfit_capi::run::*;
use atlasfit_capi::status::*;
use atlasfit_capi::unwrap::*;
use atlasfit_net::Prior;
use atlasfit_net::explicit::{Network, NetworkOptions, Recipe};
use atlasfit_net::level_set::LevelSetOptions;
use scene::*;
use std::ptr::{null, null_mut};

fn ok(status: i32) {
    assert_eq!(status, ATLASFIT_OK, "{}", last_error());
}

fn triples(xyz: &[f64]) -> Vec<[f64; 3]> {
    xyz.as_chunks().0.to_vec()
}

#[test]
fn defaults_are_the_core_s() {
    let (xyz, d) = (scan(1500), DenoiseOptions::default());
    let o: atlasfit_denoise_options = init(atlasfit_denoise_options_init);
    assert_eq!((o.detail, o.fill_holes, o.texture_size), (d.detail, d.fill_holes, d.texture_size));
    assert_eq!((o.noise, o.charts, o.uv), (0.0, 0, 1));
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
fn denoised(p: &atlasfit_points, threads: u32) -> (Vec<f64>, usize, usize) {
    let run = atlasfit_run { threads, ..init(atlasfit_run_init) };
    let (mut result, mut report) = (null_mut(), output::<atlasfit_report>());
    unsafe {
        ok(atlasfit_denoise(p, null(), &run, &mut result));
        ok(atlasfit_result_report(result, &mut report));
        let mut xyz = vec![0f64; 3 * report.points];
        ok(atlasfit_result_point_positions(result, xyz.as_mut_ptr(), xyz.len()));
        ok(atlasfit_result_free(result));
        (xyz, report.vertices, report.triangles)
    }
}

#[test]
fn each_prior_gives_what_the_core_gives() {
    let xyz = scan(300);
    let cloud = PointCloud::from_positions(triples(&xyz));
    // Two steps tell the priors apart.
    let network = |network| {
        Prior::Network(NetworkOptions {
            network,
            recipe: Recipe::Paper,
            charts: 1,
            iterations: 2,
            ..NetworkOptions::default()
        })
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
    let cloud = PointCloud {
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
        ..PointCloud::from_positions(triples(&xyz))
    };
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

/// Projection of points: positions, normals, charts, chart coordinates, distances.
fn projected(
    atlas: *const atlasfit_atlas,
    p: &atlasfit_points,
) -> (Vec<f64>, Vec<f32>, Vec<u32>, Vec<f32>, Vec<f64>) {
    let n = p.count;
    let mut all = (vec![0f64; 3 * n], vec![0f32; 3 * n], vec![0u32; n], vec![0f32; 2 * n], vec![0f64; n]);
    let out = atlasfit_projection {
        capacity: n,
        positions: all.0.as_mut_ptr(),
        normals: all.1.as_mut_ptr(),
        charts: all.2.as_mut_ptr(),
        chart_uv: all.3.as_mut_ptr(),
        distances: all.4.as_mut_ptr(),
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
    let (xyz, normals, charts, _, distances) = projected(s.atlas, &s.points());
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
    let again = projected(s.atlas, &points(&xyz)).4;
    let mut sorted: Vec<f64> = again[2..].to_vec();
    sorted.sort_by(f64::total_cmp);
    assert!(sorted[n * 9 / 10] < 0.2 * s.report.noise, "{} beside {}", sorted[n * 9 / 10], s.report.noise);
}

#[test]
fn points_that_are_not_finite_are_projected_nowhere() {
    let s = Scene::new(1500);
    let odd = [f64::NAN, 1.0, 2.0, 103.0, 0.0, 0.0, f64::INFINITY, 0.0, 0.0];
    let (xyz, normals, charts, _, distances) = projected(s.atlas, &points(&odd));
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
    let mut seen = 0;
    for i in 2..200 {
        let uv = [f64::from(all.3[2 * i]), f64::from(all.3[2 * i + 1])];
        let (mut xyz, mut normal, mut inside) = ([0f64; 3], [0f32; 3], 0f32);
        let chart = all.2[i] as usize;
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
        let apart = (0..3).map(|k| (xyz[k] - all.0[3 * i + k]).powi(2)).sum::<f64>().sqrt();
        let along = (0..3).map(|k| normal[k] * all.1[3 * i + k]).sum::<f32>();
        assert!(inside >= 0.49 && along > 0.8, "{inside} {along}");
        seen += usize::from(apart < s.report.noise);
    }
    // Blending with other charts moves a place by less than the noise, but for a few.
    assert!(seen > 180, "{seen}");
}

#[test]
fn the_split_form_is_the_mesh_with_its_corner_uvs() {
    let s = Scene::new(1500);
    let mut info = output::<atlasfit_uv_info>();
    ok(unsafe { atlasfit_uv_get_info(s.uv, &mut info) });
    let n = info.split_vertices;
    let (mut i, mut v, mut uv, mut corner) =
        (vec![0u32; 36], vec![0u32; n], vec![0f32; 2 * n], vec![0f32; 72]);
    unsafe {
        ok(atlasfit_uv_split(s.uv, i.as_mut_ptr(), 36, v.as_mut_ptr(), uv.as_mut_ptr(), n));
        ok(atlasfit_uv_corners(s.uv, corner.as_mut_ptr(), 72));
    }
    for c in 0..36 {
        let k = i[c] as usize;
        assert_eq!(v[k], s.cube.1[c]);
        assert_eq!(uv[2 * k..2 * k + 2], corner[2 * c..2 * c + 2]);
    }
    assert!((8..=36).contains(&n));
}

#[test]
fn uvs_on_pages_that_are_not_square_measure_as_on_one_that_is() {
    let cube = cube();
    let options = atlasfit_unwrap_options {
        page_width: 128,
        page_height: 64,
        texels_per_unit: 50.0,
        ..init(atlasfit_unwrap_options_init)
    };
    let (mut uv, mut info, mut q) =
        (null_mut(), output::<atlasfit_uv_info>(), output::<atlasfit_uv_quality>());
    let (mut corners, mut pages) = (vec![0f32; 72], vec![0u32; 12]);
    unsafe {
        ok(atlasfit_unwrap(&mesh(&cube.0, &cube.1), &options, null(), &mut uv));
        ok(atlasfit_uv_get_info(uv, &mut info));
        ok(atlasfit_uv_corners(uv, corners.as_mut_ptr(), 72));
        ok(atlasfit_uv_face_pages(uv, pages.as_mut_ptr(), 12));
        ok(atlasfit_uv_free(uv));
        let m = atlasfit_mesh {
            corner_uv: corners.as_ptr(),
            face_page: pages.as_ptr(),
            page_width: 128,
            page_height: 64,
            ..mesh(&cube.0, &cube.1)
        };
        ok(atlasfit_measure_uv(&m, null(), &mut q, null_mut(), 0));
    }
    assert!(info.pages > 1 && q.charts == info.charts && q.overlapping_faces == 0 && q.inside == 1);
    assert!((q.stretch_linf - 1.0).abs() < 1e-4, "the box is flattened without stretch: {}", q.stretch_linf);
    assert!((q.coverage - info.coverage).abs() < 0.02, "{} {}", q.coverage, info.coverage);
}

/// A texture of 64 by 32 texels.
fn baked(m: &atlasfit_mesh, p: *const atlasfit_points, page: u32) -> Vec<u8> {
    let options = atlasfit_bake_options { width: 64, height: 32, page, ..init(atlasfit_bake_options_init) };
    let mut rgba = vec![0u8; 4 * 64 * 32];
    unsafe { ok(atlasfit_bake(m, p, &options, null(), rgba.as_mut_ptr(), rgba.len())) };
    rgba
}

#[test]
fn baked_texels_are_the_core_s_and_each_page_has_its_triangles() {
    let s = Scene::new(1500);
    let (bytes, mut uv) = ((0..24).map(|i| 10 * i).collect::<Vec<u8>>(), vec![0f32; 72]);
    unsafe { ok(atlasfit_uv_corners(s.uv, uv.as_mut_ptr(), 72)) };
    let m = atlasfit_mesh {
        corner_uv: uv.as_ptr(),
        colors: bytes.as_ptr().cast(),
        color_scalar: ATLASFIT_U8,
        color_width: 3,
        ..s.mesh()
    };
    let colors: Vec<[f32; 4]> = bytes
        .chunks(3)
        .map(|c| [0, 1, 2, 3].map(|k| c.get(k).map_or(1.0, |&x| f32::from(x) / 255.0)))
        .collect();
    let corners: Vec<[[f32; 2]; 3]> =
        uv.chunks(6).map(|c| [[c[0], c[1]], [c[2], c[3]], [c[4], c[5]]]).collect();
    let mut core = TriMesh {
        corner_uv: Some(corners.clone()),
        colors: Some(colors.clone()),
        ..TriMesh::new(
            s.cube.0.chunks(3).map(|p| [0, 1, 2].map(|k| f64::from(p[k]))).collect(),
            s.cube.1.as_chunks().0.to_vec(),
        )
    };
    let options = BakeOptions { size: [64, 32], ..BakeOptions::default() };
    let expected = |mesh: &TriMesh, colors: Colors<'_>| {
        let image = Run::default().execute(|ctx| bake(mesh, colors, &options, ctx)).expect("the core bakes");
        image.rgba.into_flattened()
    };
    assert_eq!(baked(&m, null(), 0), expected(&core, Colors::Vertices));
    // The colours of a scan: here, the corners and the middle of the box.
    let xyz: Vec<f64> = core.positions.iter().flatten().copied().chain([0.5; 3]).collect();
    let paint: Vec<f32> = colors.iter().flatten().copied().chain([1.0; 4]).collect();
    let scan = atlasfit_points { colors: paint.as_ptr().cast(), ..points(&xyz) };
    let cloud = PointCloud {
        colors: Some(paint.as_chunks().0.to_vec()),
        ..PointCloud::from_positions(triples(&xyz))
    };
    assert_eq!(baked(&m, &scan, 0), expected(&core, Colors::Points(&cloud)));
    let pages: Vec<u32> = (0..12).map(|i| i / 6).collect();
    let paged = atlasfit_mesh { face_page: pages.as_ptr(), ..m };
    core.triangles.drain(..6);
    core.corner_uv = Some(corners[6..].to_vec());
    assert_eq!(baked(&paged, null(), 1), expected(&core, Colors::Vertices));
}

#[test]
fn measures_of_a_cube_are_those_of_a_cube() {
    let s = Scene::new(1500);
    let cube = s.mesh();
    let (mut t, mut d, mut q) =
        (output::<atlasfit_topology>(), output::<atlasfit_distance>(), output::<atlasfit_uv_quality>());
    let mut corner = vec![0f32; 72];
    let mut stretch = vec![0f32; 12];
    unsafe {
        ok(atlasfit_measure_topology(&cube, null(), &mut t));
        ok(atlasfit_measure_surface(&cube, &cube, null(), null(), &mut d));
        ok(atlasfit_uv_corners(s.uv, corner.as_mut_ptr(), 72));
        let with_uv = atlasfit_mesh { corner_uv: corner.as_ptr(), ..cube };
        ok(atlasfit_measure_uv(&with_uv, null(), &mut q, stretch.as_mut_ptr(), 12));
    }
    assert_eq!((t.vertices, t.edges, t.faces, t.euler, t.genus, t.closed), (8, 18, 12, 2, 0, 1));
    assert!(d.accuracy.max < 1e-12 && d.f_score == 1.0 && d.normal_orientation > 0.99);
    assert!(q.flips == 0 && q.overlapping_faces == 0 && q.inside == 1 && q.stretch_l2 < 1.01);
    assert!(stretch.iter().all(|x| (0.99..1.01).contains(x)), "{stretch:?}");
    let outside = [0.5, 0.5, 1.25, f64::NAN, 0.0, 0.0];
    let mut each = [0f64; 2];
    ok(unsafe {
        atlasfit_measure_points(&points(&outside), &cube, null(), null(), &mut d, each.as_mut_ptr(), 2)
    });
    assert!((each[0] - 0.25).abs() < 1e-12 && each[1] == f64::INFINITY && d.not_finite == 1);
}

#[test]
fn progress_comes_on_the_calling_thread_and_a_token_cancels_from_another() {
    use std::ffi::c_void;
    struct Seen {
        thread: std::thread::ThreadId,
        calls: usize,
        stages: u32,
    }
    unsafe extern "C" fn tell(user: *mut c_void, stage: u32, fraction: f64) -> i32 {
        let seen = unsafe { &mut *user.cast::<Seen>() };
        assert_eq!(std::thread::current().id(), seen.thread);
        assert!((0.0..=1.0).contains(&fraction));
        seen.calls += 1;
        seen.stages |= 1 << stage;
        1
    }
    let xyz = scan(20_000);
    let mut seen = Seen { thread: std::thread::current().id(), calls: 0, stages: 0 };
    let run = atlasfit_run {
        progress: Some(tell),
        progress_user: (&raw mut seen).cast(),
        ..init(atlasfit_run_init)
    };
    let mut result = null_mut();
    ok(unsafe { atlasfit_denoise(&points(&xyz), null(), &run, &mut result) });
    ok(unsafe { atlasfit_result_free(result) });
    assert!(seen.calls > 3 && seen.stages.count_ones() > 2);

    let mut token = null_mut();
    ok(unsafe { atlasfit_cancel_new(&mut token) });
    let run = atlasfit_run { cancel: token, ..init(atlasfit_run_init) };
    let from_elsewhere = token.expose_provenance();
    let canceller = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_millis(50));
        unsafe { atlasfit_cancel_request(std::ptr::with_exposed_provenance(from_elsewhere)) }
    });
    // Cancelled before it begins or in its midst, as the clock will have it.
    let status = unsafe { atlasfit_denoise(&points(&scan(60_000)), null(), &run, &mut result) };
    assert_eq!(canceller.join().expect("the canceller ends"), ATLASFIT_OK);
    assert_eq!((status, result.is_null()), (ATLASFIT_CANCELLED, true));
    ok(unsafe { atlasfit_cancel_free(token) });
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
