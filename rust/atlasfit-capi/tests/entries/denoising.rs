//! Denoising, and the getters of its result.
#![expect(clippy::type_complexity, reason = "tables of calls")]

use crate::scene::*;
use crate::table::*;
use atlasfit_capi::arrays::*;
use atlasfit_capi::atlas::*;
use atlasfit_capi::denoise::*;
use atlasfit_capi::points::*;
use atlasfit_capi::result::*;
use atlasfit_capi::run::*;
use atlasfit_capi::status::*;
use std::mem::offset_of;
use std::ptr::{null, null_mut, without_provenance_mut};

/// Denoises and frees the result: there is one where the status says so.
unsafe fn denoise(
    p: *const atlasfit_points,
    o: *const atlasfit_denoise_options,
    r: *const atlasfit_run,
) -> i32 {
    let mut out = without_provenance_mut(1);
    unsafe {
        let status = atlasfit_denoise(p, o, r, &mut out);
        assert!(out.is_null() == (status != ATLASFIT_OK));
        assert_eq!(atlasfit_result_free(out), ATLASFIT_OK);
        status
    }
}

/// The scan, the options, the run.
pub fn arguments(t: &mut Table, s: &Scene) {
    let pts = s.points();
    unsafe {
        let name = "atlasfit_denoise";
        t.want(name, "out NULL", INVALID, atlasfit_denoise(&pts, null(), null(), null_mut()));
        t.points(name, &pts, ATLASFIT_EMPTY_INPUT, |p| denoise(p, null(), null()));
        t.run(name, |r| denoise(&pts, null(), r));
        let good = init(atlasfit_denoise_options_init);
        let first = offset_of!(atlasfit_denoise_options, viewpoint);
        t.sized_grown(name, "options", (&good, first), ABI, |o| denoise(&pts, o, null()));
        let all: [(&str, &dyn Fn(&mut atlasfit_denoise_options)); 28] = [
            ("noise", &|o| o.noise = -1.0),
            ("noise no number", &|o| o.noise = f64::NAN),
            ("strength", &|o| o.strength = -0.1),
            ("strength no number", &|o| o.strength = f64::NAN),
            ("strength without end", &|o| o.strength = f64::INFINITY),
            ("detail", &|o| o.detail = 0.0),
            ("detail no number", &|o| o.detail = f64::NAN),
            ("fill_holes", &|o| o.fill_holes = -0.5),
            ("prior", &|o| o.prior = 4),
            ("outliers", &|o| o.outliers = 2),
            ("uv", &|o| o.uv = 2),
            ("recipe", &|o| o.recipe = 2),
            ("has_viewpoint", &|o| o.has_viewpoint = 2),
            ("viewpoint no number", &|o| (o.has_viewpoint, o.viewpoint) = (1, [0.0, f64::NAN, 0.0])),
            ("watertight", &|o| o.watertight = 2),
            ("min_part below 0", &|o| o.min_part = -0.1),
            ("min_part above 1", &|o| o.min_part = 1.1),
            ("min_part no number", &|o| o.min_part = f64::NAN),
            ("surface", &|o| o.surface = 3),
            ("uncertainty", &|o| o.uncertainty = 2),
            ("the largest part of no surface", &|o| (o.surface, o.largest) = (0, 1)),
            ("largest", &|o| o.largest = 2),
            ("max_error", &|o| o.max_error = f64::INFINITY),
            ("max_error no number", &|o| o.max_error = f64::NAN),
            ("faces of a solid", &|o| (o.faces, o.watertight) = (9, 1)),
            ("texture", &|o| o.texture_size = 0),
            ("network charts", &|o| (o.prior, o.network_charts) = (ATLASFIT_PRIOR_MLP, 0)),
            ("network rate", &|o| (o.prior, o.network_learning_rate) = (ATLASFIT_PRIOR_CONV, f64::NAN)),
        ];
        for (case, spoil) in all {
            let mut o = good;
            spoil(&mut o);
            t.want(name, format!("options: {case}"), INVALID, denoise(&pts, &o, null()));
        }
        let name = "atlasfit_denoise_memory_needed";
        let mut bytes = 7;
        let mut needed = |o, r| atlasfit_denoise_memory_needed(1_000_000, o, r, &mut bytes);
        t.want(name, "out NULL", INVALID, atlasfit_denoise_memory_needed(1, null(), null(), null_mut()));
        let needed_for = |o| atlasfit_denoise_memory_needed(1, o, null(), &mut 0);
        t.sized_grown(name, "options", (&good, first), ABI, |o| needed_for(o));
        let run = atlasfit_run { threads: u32::MAX, ..init(atlasfit_run_init) };
        t.want(name, "threads", INVALID, atlasfit_denoise_memory_needed(1, null(), &run, &mut 0));
        t.want(name, "all well", ATLASFIT_OK, needed(&good, null()));
        assert!(bytes > 100 << 20, "{bytes}");
        let name = "atlasfit_denoise";
        let line: Vec<f64> = (0..300).map(f64::from).collect();
        t.want(name, "a line", ATLASFIT_DEGENERATE, denoise(&points(&line), null(), null()));
        t.want(
            name,
            "nothing finite",
            ATLASFIT_EMPTY_INPUT,
            denoise(&points(&[f64::NAN; 300]), null(), null()),
        );
        t.want(name, "one place", ATLASFIT_DEGENERATE, denoise(&points(&[1.0; 300]), null(), null()));
        let corners = [0, 1, u32::MAX];
        let mesh = |triangles, triangle_count| atlasfit_points { triangles, triangle_count, ..pts };
        let call = |p: atlasfit_points| denoise(&p, null(), null());
        t.want(name, "triangles NULL", INVALID, call(mesh(null(), 1)));
        t.want(name, "absurd triangle count", INVALID, call(mesh(corners.as_ptr(), usize::MAX)));
        t.want(name, "no such point", ATLASFIT_INDEX_OUT_OF_RANGE, call(mesh(corners.as_ptr(), 1)));
        let huge: Vec<f64> = s.xyz.iter().map(|x| x * 1e300).collect();
        let status = denoise(&points(&huge), null(), null());
        t.want(name, "huge coordinates", status, status);
    }
}

/// Colours and attributes of the points.
pub fn columns(t: &mut Table, s: &Scene) {
    let pts = s.points();
    unsafe {
        let name = "atlasfit_denoise";
        let column = vec![0f32; pts.count * 4];
        let attribute =
            atlasfit_attribute { values: column.as_ptr().cast(), ..init(atlasfit_attribute_init) };
        let with = |spoil: &dyn Fn(&mut atlasfit_points, &mut atlasfit_attribute)| {
            let (mut p, mut a) = (pts, attribute);
            p.attribute_count = 1;
            spoil(&mut p, &mut a);
            if p.attribute_count == 1 {
                p.attributes = &a;
            }
            denoise(&p, null(), null())
        };
        t.want(name, "attribute", ATLASFIT_OK, with(&|_, _| ()));
        let all: [(&str, i32, &dyn Fn(&mut atlasfit_points, &mut atlasfit_attribute)); 10] = [
            ("NULL attributes", INVALID, &|p, _| p.attribute_count = 2),
            ("absurd attribute count", INVALID, &|p, _| p.attribute_count = u32::MAX),
            ("attribute size", ABI, &|_, a| a.struct_size = 3),
            ("attribute width 0", INVALID, &|_, a| a.width = 0),
            ("attribute width", INVALID, &|_, a| a.width = u32::MAX),
            ("attribute scalar", INVALID, &|_, a| a.scalar = 8),
            ("attribute values", INVALID, &|_, a| a.values = null()),
            ("attribute stride", INVALID, &|_, a| a.stride = 3),
            ("color width", INVALID, &|p, _| (p.colors, p.color_width) = (p.positions, 2)),
            ("color scalar", INVALID, &|p, _| (p.colors, p.color_scalar) = (p.positions, ATLASFIT_F64)),
        ];
        for (case, want, spoil) in all {
            t.want(name, case, want, with(spoil));
        }
    }
}

/// What a result gives.
pub fn getters(t: &mut Table, s: &Scene) {
    unsafe {
        let name = "atlasfit_result_report";
        t.handle(name, s.atlas, |h| atlasfit_result_report(h, &mut output()));
        t.want(name, "report NULL", INVALID, atlasfit_result_report(s.result, null_mut()));
        let first = offset_of!(atlasfit_report, dropped_parts);
        t.sized_grown(name, "report", (&output::<atlasfit_report>(), first), ATLASFIT_OK, |r| {
            atlasfit_result_report(s.result, r)
        });
        let name = "atlasfit_result_sweep";
        t.handle(name, s.atlas, |h| atlasfit_result_sweep(h, 0, &mut output()));
        t.want(name, "sweep NULL", INVALID, atlasfit_result_sweep(s.result, 0, null_mut()));
        t.want(name, "none", ATLASFIT_INDEX_OUT_OF_RANGE, atlasfit_result_sweep(s.result, 0, &mut output()));
        t.lines("atlasfit_result_warnings", s.result, s.uv, |h, text, room, length| {
            atlasfit_result_warnings(h, text, room, length)
        });
        let r = s.report;
        getter!(t, atlasfit_result_point_positions, s.result, s.uv, 3 * r.points, -7f64);
        getter!(t, atlasfit_result_point_normals, s.result, s.uv, 3 * r.points, -7f32);
        getter!(t, atlasfit_result_point_sources, s.result, s.uv, r.points, u32::MAX - 1);
        getter!(t, atlasfit_result_point_charts, s.result, s.uv, r.points, u32::MAX - 1);
        getter!(t, atlasfit_result_surface_positions, s.result, s.uv, 3 * r.vertices, -7f64);
        getter!(t, atlasfit_result_surface_normals, s.result, s.uv, 3 * r.vertices, -7f32);
        getter!(t, atlasfit_result_surface_triangles, s.result, s.uv, 3 * r.triangles, u32::MAX - 1);
        getter!(t, atlasfit_result_surface_corner_uv, s.result, s.uv, 6 * r.triangles, -7f32);
        getter!(t, atlasfit_result_surface_face_charts, s.result, s.uv, r.triangles, u32::MAX - 1);
        let missing = ATLASFIT_NOT_AVAILABLE;
        let mut four = vec![0f32; 4 * r.vertices];
        let name = "atlasfit_result_surface_colors";
        t.handle(name, s.uv, |h| atlasfit_result_surface_colors(h, null_mut(), 0));
        t.want(
            name,
            "none",
            missing,
            atlasfit_result_surface_colors(s.result, four.as_mut_ptr(), four.len()),
        );
        let name = "atlasfit_result_surface_attribute";
        t.handle(name, s.uv, |h| atlasfit_result_surface_attribute(h, 0, null_mut(), 0));
        for i in [0, 1, usize::MAX] {
            let status = atlasfit_result_surface_attribute(s.result, i, null_mut(), usize::MAX);
            t.want(name, format!("attribute {i} of none"), ATLASFIT_INDEX_OUT_OF_RANGE, status);
        }
        let name = "atlasfit_result_atlas";
        let mut atlas = null_mut();
        t.handle(name, s.uv, |h| atlasfit_result_atlas(h, &mut null_mut()));
        t.want(name, "out NULL", INVALID, atlasfit_result_atlas(s.result, null_mut()));
        t.want(name, "good", ATLASFIT_OK, atlasfit_result_atlas(s.result, &mut atlas));
        assert_eq!(atlasfit_atlas_free(atlas), ATLASFIT_OK);
    }
}
