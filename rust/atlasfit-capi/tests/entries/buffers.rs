//! Results in the caller's layout.
#![expect(clippy::type_complexity, reason = "tables of calls")]

use crate::scene::*;
use crate::table::*;
use atlasfit_capi::arrays::*;
use atlasfit_capi::buffer::*;
use atlasfit_capi::result_copy::*;
use atlasfit_capi::status::*;
use atlasfit_capi::uv::*;
use std::ptr::{null, null_mut};

/// Both functions with good and hostile buffers.
pub fn copies(t: &mut Table, s: &Scene) {
    let mut room = vec![0u64; 3 * s.report.points.max(72)];
    let good = atlasfit_buffer {
        data: room.as_mut_ptr().cast(),
        capacity: room.len() / 3,
        ..init(atlasfit_buffer_init)
    };
    unsafe {
        t.init("atlasfit_buffer_init", atlasfit_buffer_init);
        let name = "atlasfit_uv_copy";
        t.handle(name, s.result, |h| atlasfit_uv_copy(h, 0, &good));
        t.want(name, "no such array", INVALID, atlasfit_uv_copy(s.uv, 3, &good));
        t.want(name, "buffer NULL", INVALID, atlasfit_uv_copy(s.uv, 0, null()));
        t.want(name, "floats", ATLASFIT_OK, atlasfit_uv_copy(s.uv, 0, &good));
        let name = "atlasfit_result_copy";
        t.handle(name, s.uv, |h| atlasfit_result_copy(h, 0, &good));
        t.sized(name, "buffer", &good, ABI, |b| atlasfit_result_copy(s.result, 0, b));
        t.want(name, "no such array", INVALID, atlasfit_result_copy(s.result, 16, &good));
        let none = atlasfit_result_copy(s.result, ATLASFIT_SURFACE_COLORS, &good);
        t.want(name, "no colours", ATLASFIT_NOT_AVAILABLE, none);
        let none = atlasfit_result_copy(s.result, ATLASFIT_SURFACE_CORNER_NORMALS, &good);
        t.want(name, "no creases", ATLASFIT_NOT_AVAILABLE, none);
        for array in ATLASFIT_POINT_UNCERTAINTY..=ATLASFIT_SURFACE_EXTRAPOLATED {
            let none = atlasfit_result_copy(s.result, array, &good);
            t.want(name, format!("array {array} was not asked for"), ATLASFIT_NOT_AVAILABLE, none);
        }
        let all: [(&str, i32, &dyn Fn(&mut atlasfit_buffer)); 8] = [
            ("no room", SMALL, &|b| b.capacity = 1499),
            ("NULL data", INVALID, &|b| b.data = null_mut()),
            ("reserved", INVALID, &|b| b.reserved = 1),
            ("positions as integers", INVALID, &|b| b.scalar = ATLASFIT_I32),
            ("unknown scalar", INVALID, &|b| b.scalar = 99),
            ("stride too small", INVALID, &|b| b.stride = 3),
            ("components too close", INVALID, &|b| b.component_stride = 1),
            ("absurd stride", INVALID, &|b| b.stride = usize::MAX),
        ];
        for (case, want, spoil) in all {
            let mut b = good;
            spoil(&mut b);
            t.want(name, case, want, atlasfit_result_copy(s.result, ATLASFIT_POINT_POSITIONS, &b));
        }
        let tiny = atlasfit_buffer { scalar: ATLASFIT_U8, ..good };
        let large = atlasfit_result_copy(s.result, ATLASFIT_POINT_SOURCES, &tiny);
        t.want(name, "indices that a byte does not hold", ATLASFIT_INDEX_OUT_OF_RANGE, large);
    }
}
