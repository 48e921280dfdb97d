#![no_main]
//! Any mesh is unwrapped and measured, or refused.

mod common;

use atlasfit_capi::measure::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::unwrap::*;
use atlasfit_capi::uv::*;
use common::*;
use std::ptr::null_mut;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some((&[vertices, a], rest)) = data.split_first_chunk::<2>() else { return };
    let (vertices, split) = (usize::from(vertices), usize::from(vertices) * 12);
    if rest.len() < split {
        return;
    }
    let xyz = coordinates(&rest[..split], 3 * vertices);
    // Indices of one byte: mostly in range.
    let triangles: Vec<u32> = rest[split..]
        .iter()
        .take(900)
        .map(|b| u32::from(*b) % (vertices as u32 + u32::from(a == 255)).max(1))
        .collect();
    let corner_uv: Vec<f32> =
        triangles.iter().flat_map(|t| [*t as f32 / 7.0 % 1.0, *t as f32 / 16.0]).collect();
    let mesh = atlasfit_mesh {
        positions: xyz.as_ptr().cast(),
        vertex_count: vertices,
        triangles: triangles.as_ptr(),
        triangle_count: triangles.len() / 3,
        corner_uv: corner_uv.as_ptr(),
        ..init(atlasfit_mesh_init)
    };
    let options = atlasfit_unwrap_options {
        max_stretch: 1.05 + f64::from(a & 7) / 4.0,
        keep_uv_seams: u32::from(a >> 3 & 1),
        max_charts: u32::from(a >> 4 & 3),
        straighten: u32::from(a >> 7),
        seams_hidden: f64::from(a >> 5 & 1),
        hard_edge_angle: if a & 64 == 0 { 180.0 } else { 30.0 },
        ..init(atlasfit_unwrap_options_init)
    };
    let mut uv = null_mut();
    unsafe {
        fine(atlasfit_unwrap(&mesh, &options, &run(), &mut uv));
        assert_eq!(atlasfit_uv_free(uv), 0);
        fine(atlasfit_measure_topology(&mesh, &run(), &mut output()));
        fine(atlasfit_measure_uv(&mesh, &run(), &mut output(), null_mut(), 0));
    }
});
