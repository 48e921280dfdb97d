//! How sure a result is comes through the C ABI as the core has it, and only where it was asked for.

use crate::scene::*;
use crate::{ok, triples};
use atlasfit::geometry::{Attribute, PointCloud};
use atlasfit::pipeline::{EXTRAPOLATED, NOISE, OUTLIER_PROBABILITY, UNCERTAINTY};
use atlasfit::{DenoiseOptions, Run};
use atlasfit_capi::arrays::*;
use atlasfit_capi::buffer::*;
use atlasfit_capi::denoise::*;
use atlasfit_capi::points::*;
use atlasfit_capi::result::*;
use atlasfit_capi::result_copy::*;
use atlasfit_capi::status::*;
use std::ptr::{null, null_mut};

const SCAN: usize = 1200;

/// Each array: its number, whether it is of points, its name in the core.
const ARRAYS: [(u32, bool, &str); 5] = [
    (ATLASFIT_POINT_UNCERTAINTY, true, UNCERTAINTY),
    (ATLASFIT_POINT_NOISE, true, NOISE),
    (ATLASFIT_POINT_OUTLIER_PROBABILITY, true, OUTLIER_PROBABILITY),
    (ATLASFIT_SURFACE_UNCERTAINTY, false, UNCERTAINTY),
    (ATLASFIT_SURFACE_EXTRAPOLATED, false, EXTRAPOLATED),
];

/// A result that frees itself, and its report.
struct Made(*mut atlasfit_result, atlasfit_report);

impl Drop for Made {
    fn drop(&mut self) {
        ok(unsafe { atlasfit_result_free(self.0) });
    }
}

/// Denoises points without UVs.
fn made(points: &atlasfit_points, spoil: impl Fn(&mut atlasfit_denoise_options)) -> Made {
    let mut options = atlasfit_denoise_options { uv: 0, ..init(atlasfit_denoise_options_init) };
    spoil(&mut options);
    let mut made = Made(null_mut(), output());
    unsafe {
        ok(atlasfit_denoise(points, &options, null(), &mut made.0));
        ok(atlasfit_result_report(made.0, &mut made.1));
    }
    made
}

/// Copies an array as doubles; the status.
fn copy(from: &Made, array: u32, to: &mut [f64]) -> i32 {
    let buffer = atlasfit_buffer {
        data: to.as_mut_ptr().cast(),
        capacity: to.len(),
        scalar: ATLASFIT_F64,
        ..init(atlasfit_buffer_init)
    };
    unsafe { atlasfit_result_copy(from.0, array, &buffer) }
}

fn positions(of: &Made) -> (Vec<f64>, Vec<f64>) {
    let (mut points, mut vertices) = (vec![0.0; 3 * of.1.points], vec![0.0; 3 * of.1.vertices]);
    unsafe {
        ok(atlasfit_result_point_positions(of.0, points.as_mut_ptr(), points.len()));
        ok(atlasfit_result_surface_positions(of.0, vertices.as_mut_ptr(), vertices.len()));
    }
    (points, vertices)
}

#[test]
fn uncertainty_is_the_core_s_and_nothing_else_changes() {
    // Enough points for their residuals to tell the factor.
    let xyz = scan(4000);
    let how = DenoiseOptions::default().with_uv(false).with_uncertainty(true);
    let core = atlasfit::denoise(&PointCloud::from_positions(triples(&xyz)), &how, &mut Run::default());
    let core = core.expect("the core fits");
    let (plain, sure) = (made(&points(&xyz), |_| ()), made(&points(&xyz), |o| o.uncertainty = 1));
    assert_eq!(positions(&plain), positions(&sure));
    assert_eq!((plain.1.attributes, sure.1.attributes), (0, 2));
    assert_eq!(plain.1.uncertainty_factor, 0.0);
    assert!(sure.1.uncertainty_factor >= 1.0);
    assert_eq!(Some(sure.1.uncertainty_factor), core.report.uncertainty_factor);
    for (array, of_points, name) in ARRAYS {
        let (count, of) = match of_points {
            true => (sure.1.points, &core.points.attributes),
            false => (sure.1.vertices, &core.surface.attributes),
        };
        let mut values = vec![-7.0; count];
        ok(copy(&sure, array, &mut values));
        assert_eq!(values, Attribute::named(of, name).expect("the core tells it").values, "array {array}");
        assert_eq!(copy(&sure, array, &mut values[1..]), ATLASFIT_BUFFER_TOO_SMALL);
    }
}

#[test]
fn what_was_not_asked_for_is_not_available_even_where_the_points_bring_such_a_column() {
    let xyz = scan(SCAN);
    let brought = vec![3f32; SCAN];
    let names = [c"uncertainty", c"extrapolated"];
    let columns = names.map(|name| atlasfit_attribute {
        name: name.as_ptr(),
        values: brought.as_ptr().cast(),
        ..init(atlasfit_attribute_init)
    });
    let with = atlasfit_points { attributes: columns.as_ptr(), attribute_count: 2, ..points(&xyz) };
    let mut room = vec![-7.0; 20 * SCAN];
    for array in ARRAYS.map(|a| a.0) {
        assert_eq!(copy(&made(&with, |_| ()), array, &mut room), ATLASFIT_NOT_AVAILABLE);
        let said = last_error();
        assert!(said.contains("it was not asked for. Denoise with uncertainty"), "{said}");
    }
    assert!(room.iter().all(|x| *x == -7.0), "a failure wrote");
    // Asked for, the arrays are what was found, not what was brought; that keeps its place.
    let sure = made(&with, |o| o.uncertainty = 1);
    ok(copy(&sure, ATLASFIT_POINT_UNCERTAINTY, &mut room));
    assert!(room[2..SCAN].iter().all(|x| *x < 0.1), "they are brought ones");
    ok(copy(&sure, ATLASFIT_SURFACE_EXTRAPOLATED, &mut room));
    assert!(room[..sure.1.vertices].iter().all(|x| *x == 0.0 || *x == 1.0));
    let mut carried = vec![0.0; sure.1.vertices];
    ok(unsafe { atlasfit_result_surface_attribute(sure.0, 0, carried.as_mut_ptr(), carried.len()) });
    assert!(carried.iter().all(|x| (*x - 3.0).abs() < 1e-6));
}

#[test]
fn a_solid_tells_what_was_invented_without_uncertainty_too_and_points_need_no_surface() {
    let xyz = scan(SCAN);
    let solid = made(&points(&xyz), |o| o.watertight = 1);
    let mut marks = vec![-7.0; solid.1.vertices];
    ok(copy(&solid, ATLASFIT_SURFACE_EXTRAPOLATED, &mut marks));
    assert!(marks.iter().all(|x| *x == 0.0 || *x == 1.0));
    assert_eq!(copy(&solid, ATLASFIT_SURFACE_UNCERTAINTY, &mut marks), ATLASFIT_NOT_AVAILABLE);
    let bare = made(&points(&xyz), |o| (o.surface, o.uncertainty) = (ATLASFIT_SURFACE_NONE, 1));
    let mut values = vec![-7.0; SCAN];
    ok(copy(&bare, ATLASFIT_POINT_NOISE, &mut values));
    assert!(values.iter().all(|x| *x >= 0.0));
    ok(copy(&bare, ATLASFIT_SURFACE_UNCERTAINTY, &mut []));
}

#[test]
fn uncertainty_takes_memory_that_is_told() {
    let needed = |uncertainty| {
        let options = atlasfit_denoise_options { uncertainty, ..init(atlasfit_denoise_options_init) };
        let mut bytes = 0;
        ok(unsafe { atlasfit_denoise_memory_needed(1_000_000, &options, null(), &mut bytes) });
        bytes
    };
    assert!(needed(1) >= needed(0));
}
