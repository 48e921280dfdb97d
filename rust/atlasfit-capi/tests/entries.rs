//! Every function of the header, called with NULL, wrong sizes, absurd counts, wrong handles: a status and a
//! text, never a crash.
#![expect(clippy::type_complexity, reason = "tables of calls")]

mod scene;

use atlasfit_capi::arrays::*;
use atlasfit_capi::atlas::*;
use atlasfit_capi::bake::*;
use atlasfit_capi::denoise::*;
use atlasfit_capi::handle::*;
use atlasfit_capi::measure::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::points::*;
use atlasfit_capi::result::*;
use atlasfit_capi::run::*;
use atlasfit_capi::status::*;
use atlasfit_capi::unwrap::*;
use scene::*;
use std::ffi::{CStr, c_void};
use std::ptr::{null, null_mut, without_provenance_mut};

const INVALID: i32 = ATLASFIT_INVALID_ARGUMENT;
const SMALL: i32 = ATLASFIT_BUFFER_TOO_SMALL;
const ABI: i32 = ATLASFIT_ABI_MISMATCH;
const HANDLE: i32 = ATLASFIT_INVALID_HANDLE;

/// What each call came to, and what it should have.
struct Table {
    calls: Vec<(&'static str, String, i32, i32)>,
}

impl Table {
    fn want(&mut self, function: &'static str, case: impl Into<String>, want: i32, status: i32) {
        let case = case.into();
        if want != ATLASFIT_OK && status == want {
            let text = last_error();
            assert!(
                text.starts_with(&format!("{function}: ")) && text.len() > function.len() + 8,
                "{function}, {case}: {text}"
            );
        }
        self.calls.push((function, case, want, status));
    }

    /// A function that takes a handle first.
    fn handle<H, O>(&mut self, function: &'static str, other: *mut O, call: impl Fn(*mut H) -> i32) {
        self.want(function, "NULL", INVALID, call(null_mut()));
        self.wrong_handle(function, other, call);
    }

    fn wrong_handle<H, O>(&mut self, function: &'static str, other: *mut O, call: impl Fn(*mut H) -> i32) {
        self.want(function, "another kind", HANDLE, call(other.cast()));
        self.want(function, "never made", HANDLE, call(without_provenance_mut(1)));
        self.want(function, "far away", HANDLE, call(without_provenance_mut(usize::MAX - 7)));
        let mut token = null_mut();
        unsafe {
            assert_eq!(atlasfit_cancel_new(&mut token), ATLASFIT_OK);
            assert_eq!(atlasfit_cancel_free(token), ATLASFIT_OK);
        }
        self.want(function, "freed", HANDLE, call(token.cast()));
    }

    /// A function that copies `needed` numbers to a buffer.
    fn copy<T: Copy + PartialEq + std::fmt::Debug>(
        &mut self,
        function: &'static str,
        needed: usize,
        mark: T,
        call: impl Fn(*mut T, usize) -> i32,
    ) {
        let mut buffer = vec![mark; needed + 1];
        self.want(function, "NULL buffer", INVALID, call(null_mut(), needed));
        self.want(function, "no room", SMALL, call(buffer.as_mut_ptr(), 0));
        self.want(function, "one too few", SMALL, call(buffer.as_mut_ptr(), needed - 1));
        assert!(buffer.iter().all(|x| *x == mark), "{function} wrote on failure");
        self.want(function, "room", ATLASFIT_OK, call(buffer.as_mut_ptr(), needed));
        assert_eq!(buffer[needed], mark, "{function} wrote beyond the buffer");
        self.want(function, "absurd room", ATLASFIT_OK, call(buffer.as_mut_ptr(), usize::MAX));
    }

    /// A function that fills a struct whose size is given.
    fn init<T>(&mut self, function: &'static str, f: unsafe extern "C" fn(*mut T, usize) -> i32) {
        let size = size_of::<T>();
        let mut room = vec![0xAAu8; size + 64];
        let at: *mut T = room.as_mut_ptr().cast();
        self.want(function, "NULL", INVALID, unsafe { f(null_mut(), size) });
        for wrong in [0, 1, 8, size - 1, 4097, usize::MAX] {
            self.want(function, format!("struct_size {wrong}"), ABI, unsafe { f(at, wrong) });
        }
        assert!(room.iter().all(|b| *b == 0xAA), "{function} wrote on failure");
        self.want(function, "larger", ATLASFIT_OK, unsafe { f(at, size + 32) });
        assert!(
            room[size..size + 32].iter().all(|b| *b == 0) && room[size + 32..].iter().all(|b| *b == 0xAA)
        );
        // One byte off: nothing needs to be aligned.
        self.want(function, "unaligned", ATLASFIT_OK, unsafe { f(room.as_mut_ptr().add(1).cast(), size) });
    }

    /// A struct that goes in or out: wrong sizes, and fields of a newer header.
    fn sized<T: Copy>(
        &mut self,
        function: &'static str,
        name: &str,
        good: &T,
        newer: i32,
        call: impl Fn(*mut T) -> i32,
    ) {
        let size = size_of::<T>();
        let mut room = vec![0u8; size + 16];
        let at: *mut T = room.as_mut_ptr().cast();
        let set = |at: *mut T, size: usize| unsafe {
            std::ptr::copy_nonoverlapping((good as *const T).cast::<u8>(), at.cast::<u8>(), size_of::<T>());
            at.cast::<usize>().write_unaligned(size);
        };
        for wrong in [0, 1, size - 8, 4097, usize::MAX] {
            set(at, wrong);
            self.want(function, format!("{name}.struct_size {wrong}"), ABI, call(at));
        }
        set(at, size + 16);
        self.want(function, format!("{name} newer, nothing new set"), ATLASFIT_OK, call(at));
        set(at, size + 16);
        room[size + 15] = 1;
        self.want(function, format!("{name} newer, something new set"), newer, call(at));
    }

    fn run(&mut self, function: &'static str, call: impl Fn(*const atlasfit_run) -> i32) {
        let good = init(atlasfit_run_init);
        self.sized(function, "run", &good, ABI, |r| call(r));
        let all: [(&str, &dyn Fn(&mut atlasfit_run)); 6] = [
            ("reserved", &|r| r.reserved = 1),
            ("threads", &|r| r.threads = u32::MAX),
            ("negative limit", &|r| r.time_limit_s = -1.0),
            ("limit no number", &|r| r.time_limit_s = f64::NAN),
            ("endless limit", &|r| r.time_limit_s = f64::INFINITY),
            ("cancel is NULL + 1", &|r| r.cancel = without_provenance_mut(1)),
        ];
        for (case, spoil) in all {
            let mut run = good;
            spoil(&mut run);
            self.want(
                function,
                format!("run: {case}"),
                if run.cancel.is_null() { INVALID } else { HANDLE },
                call(&run),
            );
        }
        unsafe extern "C" fn stop(_: *mut c_void, _: u32, _: f64) -> i32 {
            0
        }
        let run = atlasfit_run { progress: Some(stop), ..good };
        self.want(function, "progress says stop", ATLASFIT_CANCELLED, call(&run));
        let run = atlasfit_run { time_limit_s: 1e-9, ..good };
        self.want(function, "no time", ATLASFIT_TIMED_OUT, call(&run));
    }

    fn points(
        &mut self,
        function: &'static str,
        good: &atlasfit_points,
        empty: i32,
        call: impl Fn(*const atlasfit_points) -> i32,
    ) {
        self.want(function, "points NULL", INVALID, call(null()));
        self.given_points(function, good, empty, call);
    }

    /// Points where NULL means none.
    fn given_points(
        &mut self,
        function: &'static str,
        good: &atlasfit_points,
        empty: i32,
        call: impl Fn(*const atlasfit_points) -> i32,
    ) {
        self.sized(function, "points", good, ABI, |p| call(p));
        let all: [(&str, i32, &dyn Fn(&mut atlasfit_points)); 9] = [
            ("none", empty, &|p| p.count = 0),
            ("NULL positions", INVALID, &|p| p.positions = null()),
            ("unknown scalar", INVALID, &|p| p.scalar = 99),
            ("integer scalar", INVALID, &|p| p.scalar = ATLASFIT_U8),
            ("stride too small", INVALID, &|p| p.stride = 23),
            ("absurd stride", INVALID, &|p| p.stride = usize::MAX),
            ("absurd count", INVALID, &|p| p.count = usize::MAX),
            ("count beyond indices", INVALID, &|p| p.count = u32::MAX as usize),
            ("count and stride beyond memory", INVALID, &|p| (p.count, p.stride) = (1 << 31, 1 << 40)),
        ];
        for (case, want, spoil) in all {
            let mut p = *good;
            spoil(&mut p);
            self.want(function, format!("points: {case}"), want, call(&p));
        }
    }

    fn mesh(
        &mut self,
        function: &'static str,
        good: &atlasfit_mesh,
        empty: i32,
        call: impl Fn(*const atlasfit_mesh) -> i32,
    ) {
        self.want(function, "mesh NULL", INVALID, call(null()));
        self.sized(function, "mesh", good, ABI, |m| call(m));
        let far: Vec<u32> = (0..3 * good.triangle_count as u32).map(|i| 1000 + i).collect();
        let (range, out) = (ATLASFIT_INDEX_OUT_OF_RANGE, far.as_ptr());
        let all: [(&str, i32, &dyn Fn(&mut atlasfit_mesh)); 10] = [
            ("no triangle", empty, &|m| m.triangle_count = 0),
            ("no vertex", range, &|m| m.vertex_count = 0),
            ("index beyond the vertices", range, &|m| m.triangles = out),
            ("NULL triangles", INVALID, &|m| m.triangles = null()),
            ("NULL positions", INVALID, &|m| m.positions = null()),
            ("absurd triangle count", INVALID, &|m| m.triangle_count = usize::MAX),
            ("absurd vertex count", INVALID, &|m| m.vertex_count = usize::MAX),
            ("absurd seam count", INVALID, &|m| m.seam_edge_count = usize::MAX),
            ("NULL seams", INVALID, &|m| (m.seam_edge_count, m.seam_edges) = (4, null())),
            ("reserved", INVALID, &|m| m.reserved = 7),
        ];
        for (case, want, spoil) in all {
            let mut m = *good;
            spoil(&mut m);
            self.want(function, format!("mesh: {case}"), want, call(&m));
        }
    }
}

#[test]
fn every_function_answers_hostile_arguments_with_a_status() {
    let s = Scene::new(1500);
    let mut t = Table { calls: Vec::new() };
    let (pts, cube) = (s.points(), s.mesh());
    let uv_info: atlasfit_uv_info = unsafe {
        let mut info = output();
        assert_eq!(atlasfit_uv_get_info(s.uv, &mut info), ATLASFIT_OK);
        info
    };
    unsafe {
        // General.
        let agree = atlasfit_version()
            == ATLASFIT_VERSION_MAJOR << 24 | ATLASFIT_VERSION_MINOR << 16 | ATLASFIT_VERSION_PATCH << 8;
        t.want("atlasfit_version", "value", ATLASFIT_OK, i32::from(!agree));
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

        // Structs.
        t.init("atlasfit_run_init", atlasfit_run_init);
        t.init("atlasfit_attribute_init", atlasfit_attribute_init);
        t.init("atlasfit_points_init", atlasfit_points_init);
        t.init("atlasfit_mesh_init", atlasfit_mesh_init);
        t.init("atlasfit_denoise_options_init", atlasfit_denoise_options_init);
        t.init("atlasfit_unwrap_options_init", atlasfit_unwrap_options_init);
        t.init("atlasfit_bake_options_init", atlasfit_bake_options_init);
        t.init("atlasfit_distance_options_init", atlasfit_distance_options_init);
        t.init("atlasfit_projection_init", atlasfit_projection_init);

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

        // Denoising.
        let denoise =
            |p: *const atlasfit_points, o: *const atlasfit_denoise_options, r: *const atlasfit_run| {
                let mut out = without_provenance_mut(1);
                let status = atlasfit_denoise(p, o, r, &mut out);
                assert!(out.is_null() == (status != ATLASFIT_OK));
                assert_eq!(atlasfit_result_free(out), ATLASFIT_OK);
                status
            };
        let name = "atlasfit_denoise";
        t.want(name, "out NULL", INVALID, atlasfit_denoise(&pts, null(), null(), null_mut()));
        t.points(name, &pts, ATLASFIT_EMPTY_INPUT, |p| denoise(p, null(), null()));
        t.run(name, |r| denoise(&pts, null(), r));
        let good = init(atlasfit_denoise_options_init);
        t.sized(name, "options", &good, ABI, |o| denoise(&pts, o, null()));
        let all: [(&str, &dyn Fn(&mut atlasfit_denoise_options)); 12] = [
            ("noise", &|o| o.noise = -1.0),
            ("noise no number", &|o| o.noise = f64::NAN),
            ("detail", &|o| o.detail = 0.0),
            ("detail no number", &|o| o.detail = f64::NAN),
            ("fill_holes", &|o| o.fill_holes = -0.5),
            ("prior", &|o| o.prior = 4),
            ("outliers", &|o| o.outliers = 2),
            ("uv", &|o| o.uv = 2),
            ("recipe", &|o| o.recipe = 2),
            ("texture", &|o| o.texture_size = 0),
            ("network charts", &|o| (o.prior, o.network_charts) = (ATLASFIT_PRIOR_MLP, 0)),
            ("network rate", &|o| (o.prior, o.network_learning_rate) = (ATLASFIT_PRIOR_CONV, f64::NAN)),
        ];
        for (case, spoil) in all {
            let mut o = good;
            spoil(&mut o);
            t.want(name, format!("options: {case}"), INVALID, denoise(&pts, &o, null()));
        }
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
        let line: Vec<f64> = (0..300).map(f64::from).collect();
        t.want(name, "a line", ATLASFIT_DEGENERATE, denoise(&points(&line), null(), null()));
        t.want(
            name,
            "nothing finite",
            ATLASFIT_EMPTY_INPUT,
            denoise(&points(&[f64::NAN; 300]), null(), null()),
        );
        t.want(name, "one place", ATLASFIT_DEGENERATE, denoise(&points(&[1.0; 300]), null(), null()));
        let huge: Vec<f64> = s.xyz.iter().map(|x| x * 1e300).collect();
        let status = denoise(&points(&huge), null(), null());
        t.want(name, "huge coordinates", status, status);

        let name = "atlasfit_result_report";
        t.handle(name, s.atlas, |h| atlasfit_result_report(h, &mut output()));
        t.want(name, "report NULL", INVALID, atlasfit_result_report(s.result, null_mut()));
        t.sized(name, "report", &output::<atlasfit_report>(), ATLASFIT_OK, |r| {
            atlasfit_result_report(s.result, r)
        });
        macro_rules! getter {
            ($name:ident, $handle:expr, $other:expr, $needed:expr, $mark:expr) => {
                let mut room = vec![$mark; $needed];
                let at = room.as_mut_ptr();
                t.handle(stringify!($name), $other, |h| $name(h, at, $needed));
                t.copy(stringify!($name), $needed, $mark, |b, n| $name($handle, b, n));
            };
        }
        // Cells: the closures above and the buffers they write.
        let r = s.report;
        getter!(atlasfit_result_point_positions, s.result, s.uv, 3 * r.points, -7f64);
        getter!(atlasfit_result_point_normals, s.result, s.uv, 3 * r.points, -7f32);
        getter!(atlasfit_result_point_sources, s.result, s.uv, r.points, u32::MAX - 1);
        getter!(atlasfit_result_point_charts, s.result, s.uv, r.points, u32::MAX - 1);
        getter!(atlasfit_result_surface_positions, s.result, s.uv, 3 * r.vertices, -7f64);
        getter!(atlasfit_result_surface_normals, s.result, s.uv, 3 * r.vertices, -7f32);
        getter!(atlasfit_result_surface_triangles, s.result, s.uv, 3 * r.triangles, u32::MAX - 1);
        getter!(atlasfit_result_surface_corner_uv, s.result, s.uv, 6 * r.triangles, -7f32);
        getter!(atlasfit_result_surface_face_charts, s.result, s.uv, r.triangles, u32::MAX - 1);
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

        // The atlas.
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

        // UVs.
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
        t.sized(name, "options", &good, ABI, |o| unwrap(&cube, o, null()));
        let all: [(&str, &dyn Fn(&mut atlasfit_unwrap_options)); 12] = [
            ("stretch", &|o| o.max_stretch = 1.0),
            ("stretch no number", &|o| o.max_stretch = f64::NAN),
            ("width", &|o| o.page_width = 0),
            ("height", &|o| o.page_height = u32::MAX),
            ("padding", &|o| o.padding = u32::MAX),
            ("pages", &|o| o.pages = u32::MAX),
            ("packer", &|o| o.packer = 9),
            ("keep_uv_seams", &|o| o.keep_uv_seams = 2),
            ("reserved", &|o| o.reserved = 1),
            ("density", &|o| o.texels_per_unit = -1.0),
            ("angle", &|o| o.hard_edge_angle = 181.0),
            ("angle no number", &|o| o.hard_edge_angle = f64::NAN),
        ];
        for (case, spoil) in all {
            let mut o = good;
            spoil(&mut o);
            t.want(name, format!("options: {case}"), INVALID, unwrap(&cube, &o, null()));
        }
        let flat = [0f32; 24];
        t.want(name, "no area", ATLASFIT_DEGENERATE, unwrap(&mesh(&flat, &s.cube.1), null(), null()));
        let name = "atlasfit_uv_get_info";
        t.handle(name, s.result, |h| atlasfit_uv_get_info(h, &mut output()));
        t.want(name, "info NULL", INVALID, atlasfit_uv_get_info(s.uv, null_mut()));
        t.sized(name, "info", &output::<atlasfit_uv_info>(), ATLASFIT_OK, |i| atlasfit_uv_get_info(s.uv, i));
        getter!(atlasfit_uv_corners, s.uv, s.atlas, 72, -7f32);
        getter!(atlasfit_uv_face_charts, s.uv, s.atlas, 12, u32::MAX);
        getter!(atlasfit_uv_face_pages, s.uv, s.atlas, 12, u32::MAX);
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

        // Measuring.
        let name = "atlasfit_measure_topology";
        t.mesh(name, &cube, ATLASFIT_OK, |m| atlasfit_measure_topology(m, null(), &mut output()));
        t.run(name, |r| atlasfit_measure_topology(&cube, r, &mut output()));
        t.sized(name, "out", &output::<atlasfit_topology>(), ATLASFIT_OK, |o| {
            atlasfit_measure_topology(&cube, null(), o)
        });
        t.want(name, "out NULL", INVALID, atlasfit_measure_topology(&cube, null(), null_mut()));
        let name = "atlasfit_measure_uv";
        let mut corners = vec![0f32; 72];
        assert_eq!(atlasfit_uv_corners(s.uv, corners.as_mut_ptr(), 72), ATLASFIT_OK);
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
        t.sized(name, "out", &output::<atlasfit_uv_quality>(), ATLASFIT_OK, |o| {
            atlasfit_measure_uv(&with_uv, null(), o, null_mut(), 0)
        });
        t.want(name, "out NULL", INVALID, atlasfit_measure_uv(&with_uv, null(), null_mut(), null_mut(), 0));
        let e = each.as_mut_ptr();
        t.want(name, "no room", SMALL, atlasfit_measure_uv(&with_uv, null(), &mut output(), e, 11));
        t.want(name, "room", ATLASFIT_OK, atlasfit_measure_uv(&with_uv, null(), &mut output(), e, 12));

        // Baking.
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

    let wrong: Vec<String> = t
        .calls
        .iter()
        .filter(|(_, _, want, got)| want != got)
        .map(|(f, case, want, got)| format!("{f}, {case}: {got} instead of {want}"))
        .collect();
    assert!(wrong.is_empty(), "{} of {} calls:\n{}", wrong.len(), t.calls.len(), wrong.join("\n"));
    let mut called: Vec<String> = t.calls.iter().map(|c| c.0.to_owned()).collect();
    called.sort();
    called.dedup();
    assert_eq!(called, declared(), "the table and the header's functions differ");
}
