//! UVs, textures and measures of meshes are the core's.

use crate::scene::*;
use crate::{ok, triples};
use atlasfit::Run;
use atlasfit::bake::{BakeOptions, Colors, bake};
use atlasfit::geometry::{PointCloud, TriMesh};
use atlasfit::unwrap::{Preset, Straighten, UnwrapOptions, unwrap};
use atlasfit_capi::arrays::*;
use atlasfit_capi::bake::*;
use atlasfit_capi::measure::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::points::*;
use atlasfit_capi::status::*;
use atlasfit_capi::unwrap::*;
use atlasfit_capi::uv::*;
use std::mem::offset_of;
use std::ptr::{null, null_mut};

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
    let options = BakeOptions::default().with_size([64, 32]);
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
fn presets_are_the_core_s() {
    for (number, preset) in Preset::ALL.into_iter().enumerate() {
        let mut options = init(atlasfit_unwrap_options_init);
        options.max_charts = 7;
        ok(unsafe { atlasfit_unwrap_options_set_preset(&mut options, number as u32) });
        assert_eq!((options.max_stretch, options.max_charts), (preset.max_stretch(), 7));
    }
    assert_eq!(
        [ATLASFIT_PRESET_FEW_SEAMS, ATLASFIT_PRESET_BALANCED, ATLASFIT_PRESET_LOW_STRETCH],
        [Preset::FewSeams, Preset::Balanced, Preset::LowStretch].map(|p| p as u32)
    );
}

/// A band of a plane's ring that rises: with least stretch it is an arc.
fn strip() -> (Vec<f32>, Vec<u32>) {
    let at = |i: u32, j: u32| {
        let (u, r) = (i as f32 / 40.0, 1.0 + 0.02 * j as f32);
        [r * (2.0 * u).cos(), r * (2.0 * u).sin(), 0.1 * u * u]
    };
    let xyz = (0..41).flat_map(|i| (0..7).flat_map(move |j| at(i, j))).collect();
    let quads = (0..40).flat_map(|i| (0..6).map(move |j| 7 * i + j));
    (xyz, quads.flat_map(|a| [a, a + 7, a + 8, a, a + 8, a + 1]).collect())
}

/// The strip's corner UVs, what they hold and how good they are.
fn strip_laid(options: &atlasfit_unwrap_options) -> (Vec<f32>, atlasfit_uv_info, atlasfit_uv_quality) {
    let (xyz, triangles) = strip();
    let m = mesh(&xyz, &triangles);
    let (mut uv, mut corners) = (null_mut(), vec![0f32; 2 * triangles.len()]);
    let (mut info, mut quality) = (output::<atlasfit_uv_info>(), output::<atlasfit_uv_quality>());
    unsafe {
        ok(atlasfit_unwrap(&m, options, null(), &mut uv));
        ok(atlasfit_uv_get_info(uv, &mut info));
        ok(atlasfit_uv_corners(uv, corners.as_mut_ptr(), corners.len()));
        ok(atlasfit_uv_free(uv));
        let with_uv = atlasfit_mesh { corner_uv: corners.as_ptr(), ..m };
        ok(atlasfit_measure_uv(&with_uv, null(), &mut quality, null_mut(), 0));
    }
    (corners, info, quality)
}

fn straightening() -> atlasfit_unwrap_options {
    atlasfit_unwrap_options { straighten: ATLASFIT_STRAIGHTEN_AUTO, ..init(atlasfit_unwrap_options_init) }
}

#[test]
fn charts_are_straightened_as_the_core_does_where_that_is_asked_for() {
    let (xyz, triangles) = strip();
    let core = TriMesh::new(
        xyz.chunks(3).map(|p| [0, 1, 2].map(|k| f64::from(p[k]))).collect(),
        triangles.as_chunks().0.to_vec(),
    );
    let options = UnwrapOptions::default().with_straighten(Straighten::Auto);
    let expected = Run::default().execute(|ctx| unwrap(&core, &options, ctx)).expect("the core unwraps");
    let (corners, info, quality) = strip_laid(&straightening());
    assert_eq!(corners, expected.corner_uv.as_flattened().as_flattened());
    assert_eq!([info.charts, info.straightened_charts], [expected.charts, expected.straightened_charts]);
    assert_eq!(info.straightened_charts, info.charts, "the strip is one, and so are its pieces");
    assert_eq!(quality.straightness, 1.0);
    let (_, plain, quality) = strip_laid(&init(atlasfit_unwrap_options_init));
    assert!(plain.straightened_charts == 0 && quality.straightness < 0.5, "{}", quality.straightness);
}

#[test]
fn what_cannot_be_straightened_is_refused_with_a_reason() {
    let (xyz, triangles) = strip();
    let corner_uv = strip_laid(&init(atlasfit_unwrap_options_init)).0;
    let m = atlasfit_mesh { corner_uv: corner_uv.as_ptr(), ..mesh(&xyz, &triangles) };
    let refused = |options: atlasfit_unwrap_options, reason: &str| {
        let mut uv = null_mut();
        assert_eq!(unsafe { atlasfit_unwrap(&m, &options, null(), &mut uv) }, ATLASFIT_INVALID_ARGUMENT);
        assert!(uv.is_null() && last_error().contains(reason), "{}", last_error());
    };
    let unknown = atlasfit_unwrap_options { straighten: 2, ..straightening() };
    refused(unknown, "straighten is 2. Give ATLASFIT_STRAIGHTEN_OFF or ATLASFIT_STRAIGHTEN_AUTO");
    let kept = atlasfit_unwrap_options { keep_uvs: 1, ..straightening() };
    refused(kept, "straighten is asked for with keep_uvs");
}

#[test]
fn programs_that_know_nothing_of_straightening_get_what_they_got() {
    let older = offset_of!(atlasfit_unwrap_options, straighten);
    let garbage = atlasfit_unwrap_options { struct_size: older, reserved_too: 9, ..straightening() };
    let plain = strip_laid(&init(atlasfit_unwrap_options_init)).0;
    assert_eq!(strip_laid(&garbage).0, plain);
    let (xyz, triangles) = strip();
    let m = atlasfit_mesh { corner_uv: plain.as_ptr(), ..mesh(&xyz, &triangles) };
    let mut quality = atlasfit_uv_quality {
        struct_size: offset_of!(atlasfit_uv_quality, straightness),
        straightness: 7.0,
        ..output()
    };
    let mut uv = null_mut();
    let mut info = atlasfit_uv_info {
        struct_size: offset_of!(atlasfit_uv_info, straightened_charts),
        straightened_charts: 7,
        ..output()
    };
    unsafe {
        ok(atlasfit_measure_uv(&m, null(), &mut quality, null_mut(), 0));
        ok(atlasfit_unwrap(&m, null(), null(), &mut uv));
        ok(atlasfit_uv_get_info(uv, &mut info));
        ok(atlasfit_uv_free(uv));
    }
    assert!(quality.finite == 1 && quality.straightness == 7.0);
    assert!(info.charts > 0 && info.straightened_charts == 7);
}

#[test]
fn seams_cost_what_the_caller_says() {
    let (xyz, triangles) = strip();
    let core = TriMesh::new(
        xyz.chunks(3).map(|p| [0, 1, 2].map(|k| f64::from(p[k]))).collect(),
        triangles.as_chunks().0.to_vec(),
    );
    // Every tenth vertex is cheap.
    let price: Vec<f32> = (0..core.positions.len()).map(|i| if i % 10 == 0 { 0.1 } else { 1.0 }).collect();
    let up = [0.0, 0.0, 3.0];
    let options = (UnwrapOptions::default().with_seams_hidden(0.5).with_up(Some(up)))
        .with_seam_price(Some(price.clone()));
    let expected = Run::default().execute(|ctx| unwrap(&core, &options, ctx)).expect("the core unwraps");
    let options = atlasfit_unwrap_options { seams_hidden: 0.5, up, ..init(atlasfit_unwrap_options_init) };
    let m = atlasfit_mesh { seam_price: price.as_ptr(), ..mesh(&xyz, &triangles) };
    let (mut uv, mut corners) = (null_mut(), vec![0f32; 2 * triangles.len()]);
    unsafe {
        ok(atlasfit_unwrap(&m, &options, null(), &mut uv));
        ok(atlasfit_uv_corners(uv, corners.as_mut_ptr(), corners.len()));
        ok(atlasfit_uv_free(uv));
    }
    assert_eq!(corners, expected.corner_uv.as_flattened().as_flattened());
    let wrong = [-1.0f32; 1 << 12];
    let m = atlasfit_mesh { seam_price: wrong.as_ptr(), ..m };
    assert_eq!(unsafe { atlasfit_unwrap(&m, &options, null(), &mut uv) }, ATLASFIT_INVALID_ARGUMENT);
    assert!(last_error().contains("seam_price of vertex 0 is -1"), "{}", last_error());
}

#[test]
fn charts_keep_free_of_what_is_occupied() {
    let (xyz, triangles) = strip();
    let options = init(atlasfit_unwrap_options_init);
    // The lower half of the page.
    let half = [0.0f32, 0.0, 1.0, 0.0, 1.0, 0.5, 0.0, 0.0, 1.0, 0.5, 0.0, 0.5];
    let m = atlasfit_mesh { occupied_uv: half.as_ptr(), occupied_count: 2, ..mesh(&xyz, &triangles) };
    let (mut uv, mut corners) = (null_mut(), vec![0f32; 2 * triangles.len()]);
    unsafe {
        ok(atlasfit_unwrap(&m, &options, null(), &mut uv));
        ok(atlasfit_uv_corners(uv, corners.as_mut_ptr(), corners.len()));
        ok(atlasfit_uv_free(uv));
    }
    assert!(corners.chunks(2).all(|c| c[1] > 0.5));
    let wrong = [f32::NAN; 6];
    for (occupied, count, words) in [
        (wrong.as_ptr(), 1, "corner 0 of occupied triangle 0 is not finite"),
        (null(), 1, "occupied_uv"),
        ([0.0f32, 0.0, 2.0, 0.0, 0.0, 2.0].as_ptr(), 1, "there is no room for"),
    ] {
        let m = atlasfit_mesh { occupied_uv: occupied, occupied_count: count, ..m };
        assert_ne!(unsafe { atlasfit_unwrap(&m, &options, null(), &mut uv) }, ATLASFIT_OK);
        assert!(last_error().contains(words), "{}", last_error());
    }
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
