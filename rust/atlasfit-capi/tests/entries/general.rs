//! Version, names, the last error, `_init` of each struct, freeing.

use crate::scene::*;
use crate::table::*;
use atlasfit_capi::atlas::*;
use atlasfit_capi::bake::*;
use atlasfit_capi::denoise::*;
use atlasfit_capi::files::*;
use atlasfit_capi::handle::*;
use atlasfit_capi::measure::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::points::*;
use atlasfit_capi::result::*;
use atlasfit_capi::run::*;
use atlasfit_capi::save::*;
use atlasfit_capi::status::*;
use atlasfit_capi::unwrap::*;
use atlasfit_capi::uv::*;
use std::ffi::CStr;
use std::mem::offset_of;
use std::ptr::{null, null_mut};

/// Version, names, the last error.
pub fn names(t: &mut Table, _: &Scene) {
    unsafe {
        let agree = atlasfit_version()
            == ATLASFIT_VERSION_MAJOR << 24 | ATLASFIT_VERSION_MINOR << 16 | ATLASFIT_VERSION_PATCH << 8;
        t.want("atlasfit_version", "value", ATLASFIT_OK, i32::from(!agree));
        let permissive = CStr::from_ptr(atlasfit_features()).is_empty();
        t.want("atlasfit_features", "none", ATLASFIT_OK, i32::from(!permissive));
        for status in [i32::MIN, -1, 0, 7, 100, 101, i32::MAX] {
            let length = CStr::from_ptr(atlasfit_status_name(status)).count_bytes();
            t.want("atlasfit_status_name", status.to_string(), ATLASFIT_OK, i32::from(length == 0));
        }
        for stage in [0, 3, 10, 11, u32::MAX] {
            let length = CStr::from_ptr(atlasfit_stage_name(stage)).count_bytes();
            t.want("atlasfit_stage_name", stage.to_string(), ATLASFIT_OK, i32::from(length == 0));
        }
        t.want("atlasfit_live_handles", "count", ATLASFIT_OK, i32::from(atlasfit_live_handles() < 4));
        let mut tiny = [1 as std::ffi::c_char; 4];
        assert_eq!(atlasfit_cancel_request(null()), INVALID);
        let full = atlasfit_last_error(null_mut(), usize::MAX);
        assert_eq!(atlasfit_last_error(tiny.as_mut_ptr(), 0), full);
        assert_eq!(tiny[0], 1);
        assert_eq!(atlasfit_last_error(tiny.as_mut_ptr(), 3), full);
        assert_eq!(tiny, [b'a' as _, b't' as _, 0, 1]);
        t.want("atlasfit_last_error", "length", ATLASFIT_OK, i32::from(full < 20));
    }
}

/// Structs and handles.
pub fn structs_and_handles(t: &mut Table, s: &Scene) {
    unsafe {
        // Structs.
        t.init_grown("atlasfit_run_init", offset_of!(atlasfit_run, overall), atlasfit_run_init);
        t.init("atlasfit_attribute_init", atlasfit_attribute_init);
        t.init_grown("atlasfit_points_init", offset_of!(atlasfit_points, triangles), atlasfit_points_init);
        t.init_grown("atlasfit_mesh_init", offset_of!(atlasfit_mesh, component_stride), atlasfit_mesh_init);
        let first = offset_of!(atlasfit_denoise_options, viewpoint);
        t.init_grown("atlasfit_denoise_options_init", first, atlasfit_denoise_options_init);
        let first = offset_of!(atlasfit_unwrap_options, keep_uvs);
        t.init_grown("atlasfit_unwrap_options_init", first, atlasfit_unwrap_options_init);
        let first = offset_of!(atlasfit_bake_options, textures);
        t.init_grown("atlasfit_bake_options_init", first, atlasfit_bake_options_init);
        t.init("atlasfit_image_init", atlasfit_image_init);
        t.init("atlasfit_textures_init", atlasfit_textures_init);
        t.init("atlasfit_distance_options_init", atlasfit_distance_options_init);
        t.init("atlasfit_projection_init", atlasfit_projection_init);
        let first = offset_of!(atlasfit_save_options, corner_normals);
        t.init_grown("atlasfit_save_options_init", first, atlasfit_save_options_init);

        // Handles.
        t.want("atlasfit_cancel_new", "NULL", INVALID, atlasfit_cancel_new(null_mut()));
        t.handle("atlasfit_cancel_request", s.atlas, |h| atlasfit_cancel_request(h));
        t.want("atlasfit_cancel_free", "NULL", ATLASFIT_OK, atlasfit_cancel_free(null_mut()));
        t.wrong_handle("atlasfit_cancel_free", s.atlas, |h| atlasfit_cancel_free(h));
        t.want("atlasfit_result_free", "NULL", ATLASFIT_OK, atlasfit_result_free(null_mut()));
        t.wrong_handle("atlasfit_result_free", s.atlas, |h| atlasfit_result_free(h));
        t.want("atlasfit_atlas_free", "NULL", ATLASFIT_OK, atlasfit_atlas_free(null_mut()));
        t.wrong_handle("atlasfit_atlas_free", s.result, |h| atlasfit_atlas_free(h));
        t.want("atlasfit_uv_free", "NULL", ATLASFIT_OK, atlasfit_uv_free(null_mut()));
        t.wrong_handle("atlasfit_uv_free", s.result, |h| atlasfit_uv_free(h));
        t.want("atlasfit_file_free", "NULL", ATLASFIT_OK, atlasfit_file_free(null_mut()));
        t.wrong_handle("atlasfit_file_free", s.result, |h| atlasfit_file_free(h));
    }
}
