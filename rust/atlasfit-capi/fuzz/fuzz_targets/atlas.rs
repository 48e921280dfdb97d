#![no_main]
//! Any bytes are a bad file, or an atlas that can be asked and saved.

mod common;

use atlasfit_capi::atlas::*;
use atlasfit_capi::points::*;
use common::*;
use std::ptr::null_mut;

libfuzzer_sys::fuzz_target!(|data: &[u8]| unsafe {
    let mut atlas = null_mut();
    let status = atlasfit_atlas_load(data.as_ptr(), data.len(), &mut atlas);
    fine(status);
    if status != 0 {
        return;
    }
    let xyz = [0f32, 0.0, 0.0, 1.0, 2.0, 3.0, 1e30, -1e30, f32::NAN];
    let points = atlasfit_points { positions: xyz.as_ptr().cast(), count: 3, ..init(atlasfit_points_init) };
    let mut place = [0f64; 9];
    let out =
        atlasfit_projection { capacity: 3, positions: place.as_mut_ptr(), ..init(atlasfit_projection_init) };
    fine(atlasfit_atlas_project(atlas, &points, &run(), &out));
    let mut size = 0;
    assert_eq!(atlasfit_atlas_save(atlas, null_mut(), 0, &mut size), 0);
    assert_eq!(atlasfit_atlas_free(atlas), 0);
});
