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
        let first = std::mem::offset_of!(atlasfit_bake_options, textures);
        t.sized_grown(name, "options", (&small, first), ABI, |o| bake(&painted, null(), o, null()));
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

/// Old textures.
pub fn textures(t: &mut Table, s: &Scene) {
    let cube = s.mesh();
    unsafe {
        let new = corners(s);
        let mesh = atlasfit_mesh { corner_uv: new.as_ptr(), ..cube };
        let texels = [9u8; 4 * 6];
        let image =
            atlasfit_image { rgba: texels.as_ptr(), width: 3, height: 2, ..init(atlasfit_image_init) };
        let images = [image; 2];
        let old = atlasfit_textures {
            images: images.as_ptr(),
            image_count: 2,
            corner_uv: new.as_ptr(),
            ..init(atlasfit_textures_init)
        };
        let name = "atlasfit_textures_page";
        let (mut side, mut padding, mut density) = (0, 0, 0.0);
        let mut page = |m: *const atlasfit_mesh, o: *const atlasfit_textures, r: *const atlasfit_run| {
            atlasfit_textures_page(m, o, r, &mut side, &mut padding, &mut density)
        };
        t.want(name, "defaults", ATLASFIT_OK, page(&mesh, &old, null()));
        t.want(name, "mesh NULL", INVALID, page(null(), &old, null()));
        t.want(name, "textures NULL", INVALID, page(&mesh, null(), null()));
        assert!((256..=8192).contains(&side) && padding > 0 && density > 0.0);
        let page = |o: *const atlasfit_textures, r: *const atlasfit_run| {
            atlasfit_textures_page(&mesh, o, r, &mut 0, &mut 0, &mut 0.0)
        };
        t.run(name, |r| page(&old, r));
        t.sized(name, "textures", &old, ABI, |o| page(o, null()));
        let none = std::ptr::null_mut();
        t.want(
            name,
            "NULL out",
            INVALID,
            atlasfit_textures_page(&mesh, &old, null(), none, &mut 0, &mut 0.0),
        );
        t.want(
            "atlasfit_texture_side",
            "many",
            ATLASFIT_OK,
            i32::from(atlasfit_texture_side(usize::MAX) != 8192),
        );

        let far = [7u32; 12];
        let other = [image, atlasfit_image { struct_size: 8, ..image }];
        let all: [(&str, i32, &dyn Fn(&mut atlasfit_textures)); 8] = [
            ("no images", ATLASFIT_EMPTY_INPUT, &|o| o.image_count = 0),
            ("images NULL", INVALID, &|o| o.images = null()),
            ("absurdly many", INVALID, &|o| o.image_count = usize::MAX),
            ("another size", ABI, &|o| o.images = other.as_ptr()),
            ("old UVs NULL", INVALID, &|o| o.corner_uv = null()),
            ("no such image", INVALID, &|o| o.face_image = far.as_ptr()),
            ("normals is 2", INVALID, &|o| o.normals = 2),
            ("reserved", INVALID, &|o| o.reserved = 1),
        ];
        let bake = |o: *const atlasfit_textures, p: *const atlasfit_points| {
            let how = atlasfit_bake_options {
                width: 8,
                height: 4,
                textures: o,
                ..init(atlasfit_bake_options_init)
            };
            let mut rgba = [0u8; 128];
            let status = atlasfit_bake(&mesh, p, &how, null(), rgba.as_mut_ptr(), 128);
            assert!(status != ATLASFIT_OK || rgba == [9; 128]);
            status
        };
        for (case, want, spoil) in all {
            let mut o = old;
            spoil(&mut o);
            t.want(name, format!("textures: {case}"), want, page(&o, null()));
            t.want("atlasfit_bake", format!("textures: {case}"), want, bake(&o, null()));
        }
        t.want("atlasfit_bake", "textures", ATLASFIT_OK, bake(&old, null()));
        t.want("atlasfit_bake", "textures and points", INVALID, bake(&old, &s.points()));
    }
}
