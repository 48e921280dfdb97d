//! A fitted atlas: projection, evaluation, saving, loading.

use crate::scene::*;
use crate::table::*;
use atlasfit_capi::atlas::*;
use atlasfit_capi::status::*;
use std::ptr::{null, null_mut, without_provenance_mut};

/// What it holds, projection, evaluation.
pub fn questions(t: &mut Table, s: &Scene) {
    let pts = s.points();
    unsafe {
        let name = "atlasfit_atlas_get_info";
        t.handle(name, s.result, |h| atlasfit_atlas_get_info(h, &mut output()));
        t.want(name, "info NULL", INVALID, atlasfit_atlas_get_info(s.atlas, null_mut()));
        t.sized(name, "info", &output::<atlasfit_atlas_info>(), ATLASFIT_OK, |i| {
            atlasfit_atlas_get_info(s.atlas, i)
        });
        let name = "atlasfit_atlas_project";
        let mut place = vec![0f64; 3 * pts.count];
        let good = atlasfit_projection {
            capacity: pts.count,
            positions: place.as_mut_ptr(),
            ..init(atlasfit_projection_init)
        };
        t.handle(name, s.result, |h| atlasfit_atlas_project(h, &pts, null(), &good));
        t.points(name, &pts, ATLASFIT_OK, |p| atlasfit_atlas_project(s.atlas, p, null(), &good));
        t.run(name, |r| atlasfit_atlas_project(s.atlas, &pts, r, &good));
        t.sized(name, "out", &good, ABI, |o| atlasfit_atlas_project(s.atlas, &pts, null(), o));
        t.want(name, "out NULL", INVALID, atlasfit_atlas_project(s.atlas, &pts, null(), null()));
        let few = atlasfit_projection { capacity: pts.count - 1, ..good };
        t.want(name, "no room", SMALL, atlasfit_atlas_project(s.atlas, &pts, null(), &few));
        let name = "atlasfit_atlas_eval";
        let eval = |h: *const atlasfit_atlas, chart: usize, uv: *const f64, n: usize, capacity: usize| {
            atlasfit_atlas_eval(h, chart, uv, n, null_mut(), null_mut(), null_mut(), capacity)
        };
        let uv = [0.0, 0.5, -1.0, 0.25];
        t.handle(name, s.result, |h| eval(h, 0, uv.as_ptr(), 2, 2));
        t.want(name, "good", ATLASFIT_OK, eval(s.atlas, 0, uv.as_ptr(), 2, 2));
        t.want(name, "none", ATLASFIT_OK, eval(s.atlas, 0, null(), 0, 0));
        t.want(name, "chart", ATLASFIT_INDEX_OUT_OF_RANGE, eval(s.atlas, usize::MAX, uv.as_ptr(), 2, 2));
        t.want(name, "room", SMALL, eval(s.atlas, 0, uv.as_ptr(), 2, 1));
        t.want(name, "uv NULL", INVALID, eval(s.atlas, 0, null(), 2, 2));
        t.want(name, "absurd count", INVALID, eval(s.atlas, 0, uv.as_ptr(), usize::MAX, usize::MAX));
        t.want(name, "uv outside", INVALID, eval(s.atlas, 0, [0.0, f64::NAN].as_ptr(), 1, 1));
    }
}

/// To bytes and back.
pub fn bytes(t: &mut Table, s: &Scene) {
    unsafe {
        let name = "atlasfit_atlas_save";
        let mut size = 0;
        t.handle(name, s.result, |h| atlasfit_atlas_save(h, null_mut(), 0, &mut 0));
        t.want(name, "size", ATLASFIT_OK, atlasfit_atlas_save(s.atlas, null_mut(), 0, &mut size));
        t.want(name, "size NULL", INVALID, atlasfit_atlas_save(s.atlas, null_mut(), 0, null_mut()));
        let mut saved = vec![0u8; size + 1];
        let to = saved.as_mut_ptr();
        t.want(name, "no room", SMALL, atlasfit_atlas_save(s.atlas, to, size - 1, &mut size));
        t.want(name, "room", ATLASFIT_OK, atlasfit_atlas_save(s.atlas, to, size, &mut size));
        let name = "atlasfit_atlas_load";
        let load = |bytes: *const u8, size: usize| {
            let mut out = without_provenance_mut(1);
            let status = atlasfit_atlas_load(bytes, size, &mut out);
            assert!(out.is_null() == (status != ATLASFIT_OK));
            assert_eq!(atlasfit_atlas_free(out), ATLASFIT_OK);
            status
        };
        t.want(name, "out NULL", INVALID, atlasfit_atlas_load(to, size, null_mut()));
        t.want(name, "NULL", INVALID, load(null(), size));
        t.want(name, "absurd size", INVALID, load(to, usize::MAX));
        t.want(name, "good", ATLASFIT_OK, load(to, size));
        t.want(name, "nothing", ATLASFIT_BAD_FILE, load(to, 0));
        t.want(name, "cut off", ATLASFIT_BAD_FILE, load(to, size - 1));
        t.want(name, "too long", ATLASFIT_BAD_FILE, load(to, size + 1));
    }
}
