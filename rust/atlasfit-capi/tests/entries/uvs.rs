//! Unwrapping, and the getters of its layout.
#![expect(clippy::type_complexity, reason = "tables of calls")]

use crate::scene::*;
use crate::table::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::run::*;
use atlasfit_capi::status::*;
use atlasfit_capi::unwrap::*;
use atlasfit_capi::uv::*;
use std::ptr::{null, null_mut, without_provenance_mut};

/// UVs of the scene's mesh, for each corner.
pub fn corners(s: &Scene) -> Vec<f32> {
    let mut corners = vec![0f32; 72];
    assert_eq!(unsafe { atlasfit_uv_corners(s.uv, corners.as_mut_ptr(), 72) }, ATLASFIT_OK);
    corners
}

/// The mesh, the options, the run.
pub fn arguments(t: &mut Table, s: &Scene) {
    let cube = s.mesh();
    unsafe {
        let unwrap = |m: *const atlasfit_mesh, o: *const atlasfit_unwrap_options, r: *const atlasfit_run| {
            let mut out = without_provenance_mut(1);
            let status = atlasfit_unwrap(m, o, r, &mut out);
            assert!(out.is_null() == (status != ATLASFIT_OK));
            assert_eq!(atlasfit_uv_free(out), ATLASFIT_OK);
            status
        };
        let name = "atlasfit_unwrap";
        t.want(name, "out NULL", INVALID, atlasfit_unwrap(&cube, null(), null(), null_mut()));
        t.mesh(name, &cube, ATLASFIT_DEGENERATE, |m| unwrap(m, null(), null()));
        t.run(name, |r| unwrap(&cube, null(), r));
        let good = init(atlasfit_unwrap_options_init);
        let first = std::mem::offset_of!(atlasfit_unwrap_options, keep_uvs);
        t.sized_grown(name, "options", (&good, first), ABI, |o| unwrap(&cube, o, null()));
        let preset = "atlasfit_unwrap_options_set_preset";
        t.want(preset, "NULL", INVALID, atlasfit_unwrap_options_set_preset(null_mut(), 0));
        t.sized_grown(preset, "options", (&good, first), ABI, |o| atlasfit_unwrap_options_set_preset(o, 0));
        let mut chosen = good;
        t.want(preset, "preset", INVALID, atlasfit_unwrap_options_set_preset(&mut chosen, 3));
        assert_eq!(chosen.max_stretch, good.max_stretch, "{preset} wrote on failure");
        let all: [(&str, &dyn Fn(&mut atlasfit_unwrap_options)); 20] = [
            ("keep_uvs", &|o| o.keep_uvs = 2),
            ("keep_uvs without UVs", &|o| o.keep_uvs = 1),
            ("stretch", &|o| o.max_stretch = 1.0),
            ("stretch no number", &|o| o.max_stretch = f64::NAN),
            ("width", &|o| o.page_width = 0),
            ("height", &|o| o.page_height = u32::MAX),
            ("padding", &|o| o.padding = u32::MAX),
            ("pages", &|o| o.pages = u32::MAX),
            ("packer", &|o| o.packer = 9),
            ("keep_uv_seams", &|o| o.keep_uv_seams = 2),
            ("reserved", &|o| o.reserved = 1),
            ("reserved too", &|o| o.reserved_too = 1),
            ("stack", &|o| o.stack = 3),
            ("straighten", &|o| o.straighten = 2),
            ("density", &|o| o.texels_per_unit = -1.0),
            ("seams hidden", &|o| o.seams_hidden = 1.5),
            ("seams hidden no number", &|o| o.seams_hidden = f64::NAN),
            ("up no number", &|o| o.up = [f64::NAN, 0.0, 1.0]),
            ("angle", &|o| o.hard_edge_angle = 181.0),
            ("angle no number", &|o| o.hard_edge_angle = f64::NAN),
        ];
        for (case, spoil) in all {
            let mut o = good;
            spoil(&mut o);
            t.want(name, format!("options: {case}"), INVALID, unwrap(&cube, &o, null()));
        }
        let name = "atlasfit_unwrap_memory_needed";
        let mut bytes = 7;
        t.want(name, "out NULL", INVALID, atlasfit_unwrap_memory_needed(1, 1, null(), null(), null_mut()));
        t.sized_grown(name, "options", (&good, first), ABI, |o| {
            atlasfit_unwrap_memory_needed(1, 1, o, null(), &mut 0)
        });
        let run = atlasfit_run { threads: u32::MAX, ..init(atlasfit_run_init) };
        t.want(name, "threads", INVALID, atlasfit_unwrap_memory_needed(1, 1, null(), &run, &mut 0));
        let needed = atlasfit_unwrap_memory_needed(500_000, 1_000_000, &good, null(), &mut bytes);
        t.want(name, "all well", ATLASFIT_OK, needed);
        assert!(bytes > 100 << 20, "{bytes}");
        let name = "atlasfit_unwrap";
        let flat = [0f32; 24];
        t.want(name, "no area", ATLASFIT_DEGENERATE, unwrap(&mesh(&flat, &s.cube.1), null(), null()));
    }
}

/// What a layout gives.
pub fn getters(t: &mut Table, s: &Scene) {
    unsafe {
        let mut uv_info: atlasfit_uv_info = output();
        t.lines("atlasfit_uv_warnings", s.uv, s.result, |h, text, room, length| {
            atlasfit_uv_warnings(h, text, room, length)
        });
        assert_eq!(atlasfit_uv_get_info(s.uv, &mut uv_info), ATLASFIT_OK);
        let name = "atlasfit_uv_get_info";
        t.handle(name, s.result, |h| atlasfit_uv_get_info(h, &mut output()));
        t.want(name, "info NULL", INVALID, atlasfit_uv_get_info(s.uv, null_mut()));
        let first = std::mem::offset_of!(atlasfit_uv_info, padding);
        let info = output::<atlasfit_uv_info>();
        t.sized_grown(name, "info", (&info, first), ATLASFIT_OK, |i| atlasfit_uv_get_info(s.uv, i));
        getter!(t, atlasfit_uv_corners, s.uv, s.atlas, 72, -7f32);
        getter!(t, atlasfit_uv_face_charts, s.uv, s.atlas, 12, u32::MAX);
        getter!(t, atlasfit_uv_face_pages, s.uv, s.atlas, 12, u32::MAX);
        let name = "atlasfit_uv_face_torn";
        t.handle(name, s.result, |h| atlasfit_uv_face_torn(h, null_mut(), 0));
        t.want(name, "none", ATLASFIT_OK, atlasfit_uv_face_torn(s.uv, null_mut(), 0));
        let name = "atlasfit_uv_split";
        let n = uv_info.split_vertices;
        let (mut indices, mut sources, mut vertex_uv) = (vec![0u32; 36], vec![0u32; n], vec![0f32; 2 * n]);
        let (i, v, u) = (indices.as_mut_ptr(), sources.as_mut_ptr(), vertex_uv.as_mut_ptr());
        t.handle(name, s.result, |h| atlasfit_uv_split(h, i, 36, v, u, n));
        t.want(name, "good", ATLASFIT_OK, atlasfit_uv_split(s.uv, i, 36, v, u, n));
        t.want(name, "few indices", SMALL, atlasfit_uv_split(s.uv, i, 35, v, u, n));
        t.want(name, "few vertices", SMALL, atlasfit_uv_split(s.uv, i, 36, v, u, n - 1));
        t.want(name, "NULL indices", INVALID, atlasfit_uv_split(s.uv, null_mut(), 36, v, u, n));
        t.want(name, "NULL sources", INVALID, atlasfit_uv_split(s.uv, i, 36, null_mut(), u, n));
        t.want(name, "NULL uv", INVALID, atlasfit_uv_split(s.uv, i, 36, v, null_mut(), n));
    }
}
