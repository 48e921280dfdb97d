#![no_main]
//! Any points are denoised or refused; the first bytes choose the options.

mod common;

use atlasfit_capi::denoise::*;
use atlasfit_capi::points::*;
use atlasfit_capi::result::*;
use common::*;
use std::ptr::null_mut;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some((&[a, b], rest)) = data.split_first_chunk::<2>() else { return };
    let xyz = coordinates(rest, 900);
    let options = atlasfit_denoise_options {
        uv: u32::from(a & 1),
        outliers: u32::from(a >> 1 & 1),
        noise: if a & 4 == 0 { 0.0 } else { f64::from(b) / 16.0 },
        charts: u32::from(a >> 4),
        fill_holes: if a & 8 == 0 { 0.0 } else { f64::from(b) },
        ..init(atlasfit_denoise_options_init)
    };
    let points = atlasfit_points {
        positions: xyz.as_ptr().cast(),
        count: xyz.len() / 3,
        ..init(atlasfit_points_init)
    };
    let mut result = null_mut();
    unsafe {
        let status = atlasfit_denoise(&points, &options, &run(), &mut result);
        fine(status);
        assert_eq!(atlasfit_result_free(result), 0);
    }
});
