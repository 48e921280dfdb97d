//! Measuring: topology, UV quality, distances.

use crate::scene::*;
use crate::table::*;
use crate::uvs::corners;
use atlasfit_capi::measure::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::points::*;
use atlasfit_capi::run::*;
use atlasfit_capi::status::*;
use std::ptr::{null, null_mut};

/// Topology and UVs of a mesh.
pub fn meshes(t: &mut Table, s: &Scene) {
    let cube = s.mesh();
    unsafe {
        let name = "atlasfit_measure_topology";
        t.mesh(name, &cube, ATLASFIT_OK, |m| atlasfit_measure_topology(m, null(), &mut output()));
        t.run(name, |r| atlasfit_measure_topology(&cube, r, &mut output()));
        t.sized(name, "out", &output::<atlasfit_topology>(), ATLASFIT_OK, |o| {
            atlasfit_measure_topology(&cube, null(), o)
        });
        t.want(name, "out NULL", INVALID, atlasfit_measure_topology(&cube, null(), null_mut()));
        let name = "atlasfit_measure_uv";
        let corners = corners(s);
        let with_uv = atlasfit_mesh { corner_uv: corners.as_ptr(), ..cube };
        let mut each = vec![0f32; 12];
        let measure = |m: *const atlasfit_mesh, r: *const atlasfit_run| {
            atlasfit_measure_uv(m, r, &mut output(), null_mut(), 0)
        };
        t.mesh(name, &with_uv, ATLASFIT_EMPTY_INPUT, |m| measure(m, null()));
        t.run(name, |r| measure(&with_uv, r));
        t.want(name, "no UVs", ATLASFIT_EMPTY_INPUT, measure(&cube, null()));
        let far = [4096u32; 12];
        let paged = atlasfit_mesh { face_page: far.as_ptr(), ..with_uv };
        t.want(name, "absurd pages", ATLASFIT_INDEX_OUT_OF_RANGE, measure(&paged, null()));
        let thin = atlasfit_mesh { page_width: 1, ..with_uv };
        t.want(name, "a page without height", INVALID, measure(&thin, null()));
        let first = std::mem::offset_of!(atlasfit_uv_quality, straightness);
        t.sized_grown(name, "out", (&output::<atlasfit_uv_quality>(), first), ATLASFIT_OK, |o| {
            atlasfit_measure_uv(&with_uv, null(), o, null_mut(), 0)
        });
        t.want(name, "out NULL", INVALID, atlasfit_measure_uv(&with_uv, null(), null_mut(), null_mut(), 0));
        let e = each.as_mut_ptr();
        t.want(name, "no room", SMALL, atlasfit_measure_uv(&with_uv, null(), &mut output(), e, 11));
        t.want(name, "room", ATLASFIT_OK, atlasfit_measure_uv(&with_uv, null(), &mut output(), e, 12));
    }
}

/// Distances to a true surface.
pub fn distances(t: &mut Table, s: &Scene) {
    let pts = s.points();
    let cube = s.mesh();
    unsafe {
        let few = atlasfit_distance_options {
            samples: 500,
            chamfer_samples: 200,
            ..init(atlasfit_distance_options_init)
        };
        let name = "atlasfit_measure_surface";
        let compare =
            |a: *const atlasfit_mesh,
             b: *const atlasfit_mesh,
             o: *const atlasfit_distance_options,
             r: *const atlasfit_run| { atlasfit_measure_surface(a, b, o, r, &mut output()) };
        t.mesh(name, &cube, ATLASFIT_EMPTY_INPUT, |m| compare(m, &cube, &few, null()));
        t.mesh(name, &cube, ATLASFIT_EMPTY_INPUT, |m| compare(&cube, m, &few, null()));
        t.run(name, |r| compare(&cube, &cube, &few, r));
        t.sized(name, "options", &few, ABI, |o| compare(&cube, &cube, o, null()));
        t.sized(name, "out", &output::<atlasfit_distance>(), ATLASFIT_OK, |o| {
            atlasfit_measure_surface(&cube, &cube, &few, null(), o)
        });
        let absurd = atlasfit_distance_options { samples: usize::MAX, ..few };
        t.want(name, "absurd samples", INVALID, compare(&cube, &cube, &absurd, null()));
        let none = atlasfit_distance_options { chamfer_samples: 0, ..few };
        t.want(name, "no samples", INVALID, compare(&cube, &cube, &none, null()));
        let wrong = atlasfit_distance_options { threshold: f64::NAN, ..few };
        t.want(name, "threshold", INVALID, compare(&cube, &cube, &wrong, null()));
        let name = "atlasfit_measure_points";
        let mut each = vec![0f64; pts.count];
        let judge = |p: *const atlasfit_points, m: *const atlasfit_mesh, r: *const atlasfit_run| {
            atlasfit_measure_points(p, m, &few, r, &mut output(), null_mut(), 0)
        };
        t.points(name, &pts, ATLASFIT_EMPTY_INPUT, |p| judge(p, &cube, null()));
        t.mesh(name, &cube, ATLASFIT_EMPTY_INPUT, |m| judge(&pts, m, null()));
        t.run(name, |r| judge(&pts, &cube, r));
        t.sized(name, "options", &few, ABI, |o| {
            atlasfit_measure_points(&pts, &cube, o, null(), &mut output(), null_mut(), 0)
        });
        t.sized(name, "out", &output::<atlasfit_distance>(), ATLASFIT_OK, |o| {
            atlasfit_measure_points(&pts, &cube, &few, null(), o, null_mut(), 0)
        });
        let e = each.as_mut_ptr();
        let room = |n: usize| atlasfit_measure_points(&pts, &cube, &few, null(), &mut output(), e, n);
        t.want(name, "no room", SMALL, room(pts.count - 1));
        t.want(name, "room", ATLASFIT_OK, room(pts.count));
    }
}
