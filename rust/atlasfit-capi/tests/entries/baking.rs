//! Baking colours into a texture.
#![expect(clippy::type_complexity, reason = "tables of calls")]

use crate::scene::*;
use crate::table::*;
use crate::uvs::corners;
use atlasfit_capi::arrays::*;
use atlasfit_capi::bake::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::points::*;
use atlasfit_capi::run::*;
use atlasfit_capi::status::*;
use std::ptr::null;

/// The mesh, the points, the options, the run.
pub fn arguments(t: &mut Table, s: &Scene) {
    let pts = s.points();
    let cube = s.mesh();
    unsafe {
        let corners = corners(s);
        let with_uv = atlasfit_mesh { corner_uv: corners.as_ptr(), ..cube };
        let far = [4096u32; 12];
        let name = "atlasfit_bake";
        let (paint, pages) = (vec![0.5f32; 4 * pts.count], [0u32; 12]);
        let painted = atlasfit_mesh { colors: paint.as_ptr().cast(), ..with_uv };
        let spots = atlasfit_points { colors: paint.as_ptr().cast(), ..pts };
        let small =
            atlasfit_bake_options { width: 8, height: 4, padding: 1, ..init(atlasfit_bake_options_init) };
        let bake =
            |m: *const atlasfit_mesh,
             p: *const atlasfit_points,
             o: *const atlasfit_bake_options,
             r: *const atlasfit_run| { atlasfit_bake(m, p, o, r, [0u8; 128].as_mut_ptr(), 128) };
        t.mesh(name, &painted, ATLASFIT_EMPTY_INPUT, |m| bake(m, null(), &small, null()));
        t.given_points(name, &spots, ATLASFIT_EMPTY_INPUT, |p| bake(&painted, p, &small, null()));
        t.run(name, |r| bake(&painted, null(), &small, r));
        t.sized(name, "options", &small, ABI, |o| bake(&painted, null(), o, null()));
        t.copy(name, 128, 7u8, |to, n| atlasfit_bake(&painted, null(), &small, null(), to, n));
        t.want(name, "default size", SMALL, bake(&painted, null(), null(), null()));
        t.want(name, "no UVs", ATLASFIT_EMPTY_INPUT, bake(&cube, null(), &small, null()));
        t.want(name, "no colours", ATLASFIT_EMPTY_INPUT, bake(&with_uv, null(), &small, null()));
        t.want(name, "points without colours", ATLASFIT_EMPTY_INPUT, bake(&painted, &pts, &small, null()));
        let all: [(&str, i32, &dyn Fn(&mut atlasfit_bake_options)); 6] = [
            ("no width", INVALID, &|o| o.width = 0),
            ("too wide", SMALL, &|o| o.width = 65537),
            ("absurdly large", SMALL, &|o| (o.width, o.height) = (u32::MAX, u32::MAX)),
            ("thin and absurdly wide", INVALID, &|o| (o.width, o.height) = (u32::MAX, 0)),
            ("page without triangles", ATLASFIT_INDEX_OUT_OF_RANGE, &|o| o.page = 1),
            ("absurd padding", ATLASFIT_OK, &|o| o.padding = u32::MAX),
        ];
        for (case, want, spoil) in all {
            let mut o = small;
            spoil(&mut o);
            t.want(name, format!("options: {case}"), want, bake(&painted, null(), &o, null()));
        }
        let all: [(&str, i32, &dyn Fn(&mut atlasfit_mesh)); 5] = [
            ("pages", ATLASFIT_OK, &|m| m.face_page = pages.as_ptr()),
            ("other pages", ATLASFIT_INDEX_OUT_OF_RANGE, &|m| m.face_page = far.as_ptr()),
            ("two channels", INVALID, &|m| m.color_width = 2),
            ("colours of f64", INVALID, &|m| m.color_scalar = ATLASFIT_F64),
            ("colours too near", INVALID, &|m| m.color_stride = 15),
        ];
        for (case, want, spoil) in all {
            let mut m = painted;
            spoil(&mut m);
            t.want(name, format!("mesh: {case}"), want, bake(&m, null(), &small, null()));
        }
    }
}
