//! Simplifying, and the getters of what it made.

use crate::scene::*;
use crate::table::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::run::*;
use atlasfit_capi::simplify::*;
use atlasfit_capi::status::*;
use std::ptr::{null, null_mut, without_provenance_mut};

fn options() -> atlasfit_simplify_options {
    atlasfit_simplify_options { faces: 4, ..init(atlasfit_simplify_options_init) }
}

/// The mesh, the options, the run.
pub fn arguments(t: &mut Table, s: &Scene) {
    let (cube, good) = (s.mesh(), options());
    unsafe {
        let simplify =
            |m: *const atlasfit_mesh, o: *const atlasfit_simplify_options, r: *const atlasfit_run| {
                let mut out = without_provenance_mut(1);
                let status = atlasfit_simplify(m, o, r, &mut out);
                assert!(out.is_null() == (status != ATLASFIT_OK));
                assert_eq!(atlasfit_simplified_free(out), ATLASFIT_OK);
                status
            };
        let name = "atlasfit_simplify";
        t.init("atlasfit_simplify_options_init", atlasfit_simplify_options_init);
        t.want(name, "out NULL", INVALID, atlasfit_simplify(&cube, &good, null(), null_mut()));
        t.want(name, "nothing is asked for", INVALID, simplify(&cube, null(), null()));
        t.mesh(name, &cube, ATLASFIT_DEGENERATE, |m| simplify(m, &good, null()));
        t.run(name, |r| simplify(&cube, &good, r));
        t.sized(name, "options", &good, ABI, |o| simplify(&cube, o, null()));
        for wrong in [-1.0, f64::NAN, f64::INFINITY] {
            let o = atlasfit_simplify_options { max_error: wrong, ..good };
            t.want(name, format!("max_error {wrong}"), INVALID, simplify(&cube, &o, null()));
        }
    }
}

/// What a simplified mesh gives.
pub fn getters(t: &mut Table, s: &Scene) {
    let corners = crate::uvs::corners(s);
    let paint = [0.5f32; 32];
    let cube = atlasfit_mesh { corner_uv: corners.as_ptr(), colors: paint.as_ptr().cast(), ..s.mesh() };
    unsafe {
        let mut light = null_mut();
        assert_eq!(atlasfit_simplify(&cube, &options(), null(), &mut light), ATLASFIT_OK);
        let name = "atlasfit_simplified_get_info";
        let mut info = output::<atlasfit_simplified_info>();
        t.handle(name, s.uv, |h| atlasfit_simplified_get_info(h, &mut output()));
        t.want(name, "info NULL", INVALID, atlasfit_simplified_get_info(light, null_mut()));
        t.sized(name, "info", &output::<atlasfit_simplified_info>(), ATLASFIT_OK, |i| {
            atlasfit_simplified_get_info(light, i)
        });
        assert_eq!(atlasfit_simplified_get_info(light, &mut info), ATLASFIT_OK);
        assert_eq!((info.has_uv, info.has_colors), (1, 1));
        let (v, f) = (info.vertices, info.triangles);
        getter!(t, atlasfit_simplified_positions, light, s.uv, 3 * v, -7f64);
        getter!(t, atlasfit_simplified_triangles, light, s.uv, 3 * f, u32::MAX);
        getter!(t, atlasfit_simplified_sources, light, s.uv, v, u32::MAX);
        getter!(t, atlasfit_simplified_corner_uv, light, s.uv, 6 * f, -7f32);
        getter!(t, atlasfit_simplified_colors, light, s.uv, 4 * v, -7f32);
        t.lines("atlasfit_simplified_warnings", light, s.uv, |h, text, room, length| {
            atlasfit_simplified_warnings(h, text, room, length)
        });
        t.wrong_handle("atlasfit_simplified_free", s.uv, |h| atlasfit_simplified_free(h));
        t.want("atlasfit_simplified_free", "all well", ATLASFIT_OK, atlasfit_simplified_free(light));
        assert_eq!(atlasfit_simplify(&s.mesh(), &options(), null(), &mut light), ATLASFIT_OK);
        let (mut uv, mut rgba) = ([0f32; 72], [0f32; 32]);
        let none = atlasfit_simplified_corner_uv(light, uv.as_mut_ptr(), 72);
        t.want("atlasfit_simplified_corner_uv", "none", ATLASFIT_NOT_AVAILABLE, none);
        let none = atlasfit_simplified_colors(light, rgba.as_mut_ptr(), 32);
        t.want("atlasfit_simplified_colors", "none", ATLASFIT_NOT_AVAILABLE, none);
        assert_eq!(atlasfit_simplified_free(light), ATLASFIT_OK);
    }
}
