//! A table of calls: each function with good and hostile arguments, and the status that each should give.
#![expect(clippy::type_complexity, reason = "tables of calls")]

use crate::scene::*;
use atlasfit_capi::arrays::*;
use atlasfit_capi::faces::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::points::*;
use atlasfit_capi::run::*;
use atlasfit_capi::status::*;
use std::ffi::c_void;
use std::ptr::{null, null_mut, without_provenance_mut};

pub const INVALID: i32 = ATLASFIT_INVALID_ARGUMENT;
pub const SMALL: i32 = ATLASFIT_BUFFER_TOO_SMALL;
pub const ABI: i32 = ATLASFIT_ABI_MISMATCH;
pub const HANDLE: i32 = ATLASFIT_INVALID_HANDLE;

/// A getter: wrong handles, NULL, too little room, room.
macro_rules! getter {
    ($table:expr, $name:ident, $handle:expr, $other:expr, $needed:expr, $mark:expr) => {
        let mut room = vec![$mark; $needed];
        let at = room.as_mut_ptr();
        $table.handle(stringify!($name), $other, |h| $name(h, at, $needed));
        $table.copy(stringify!($name), $needed, $mark, |b, n| $name($handle, b, n));
    };
}
pub(crate) use getter;

/// One call: what it came to, and what it should have.
pub struct Call {
    pub function: &'static str,
    pub case: String,
    pub want: i32,
    pub got: i32,
}

/// All calls.
#[derive(Default)]
pub struct Table {
    pub calls: Vec<Call>,
}

impl Table {
    /// Notes a call. One that fails as it should leaves a text that begins with the function's name.
    pub fn want(&mut self, function: &'static str, case: impl Into<String>, want: i32, status: i32) {
        let case = case.into();
        if want != ATLASFIT_OK && status == want {
            let text = last_error();
            assert!(
                text.starts_with(&format!("{function}: ")) && text.len() > function.len() + 8,
                "{function}, {case}: {text}"
            );
        }
        self.calls.push(Call { function, case, want, got: status });
    }

    /// A function that takes a handle first.
    pub fn handle<H, O>(&mut self, function: &'static str, other: *mut O, call: impl Fn(*mut H) -> i32) {
        self.want(function, "NULL", INVALID, call(null_mut()));
        self.wrong_handle(function, other, call);
    }

    /// Handles that are none of the kind that is asked for.
    pub fn wrong_handle<H, O>(
        &mut self,
        function: &'static str,
        other: *mut O,
        call: impl Fn(*mut H) -> i32,
    ) {
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
    pub fn copy<T: Copy + PartialEq + std::fmt::Debug>(
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

    /// A function that copies lines of text and tells their length; `other` is a handle of another kind.
    pub fn lines<H, O>(
        &mut self,
        function: &'static str,
        good: *mut H,
        other: *mut O,
        call: impl Fn(*mut H, *mut std::ffi::c_char, usize, *mut usize) -> i32,
    ) {
        let mut length = usize::MAX;
        self.handle(function, other, |h| call(h, null_mut(), 0, &mut 0));
        self.want(function, "length NULL", INVALID, call(good, null_mut(), 0, null_mut()));
        self.want(function, "length", ATLASFIT_OK, call(good, null_mut(), 0, &mut length));
        let mut text = vec![7; length + 2];
        self.want(function, "no room for the 0", SMALL, call(good, text.as_mut_ptr(), length, &mut 0));
        assert!(text.iter().all(|c| *c == 7), "{function} wrote on failure");
        self.want(function, "room", ATLASFIT_OK, call(good, text.as_mut_ptr(), length + 1, &mut 0));
        assert!(text[..length].iter().all(|c| *c != 0) && text[length..] == [0, 7]);
    }

    /// A function that fills a struct whose size is given.
    pub fn init<T>(&mut self, function: &'static str, f: unsafe extern "C" fn(*mut T, usize) -> i32) {
        self.init_grown(function, size_of::<T>(), f);
    }

    /// The same for a struct that was only `first` bytes long in the first version of the header.
    pub fn init_grown<T>(
        &mut self,
        function: &'static str,
        first: usize,
        f: unsafe extern "C" fn(*mut T, usize) -> i32,
    ) {
        let size = size_of::<T>();
        let mut room = vec![0xAAu8; size + 64];
        let at: *mut T = room.as_mut_ptr().cast();
        self.want(function, "NULL", INVALID, unsafe { f(null_mut(), size) });
        for wrong in [0, 1, 8, first - 1, 4097, usize::MAX] {
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
    pub fn sized<T: Copy>(
        &mut self,
        function: &'static str,
        name: &str,
        good: &T,
        newer: i32,
        call: impl Fn(*mut T) -> i32,
    ) {
        self.sized_grown(function, name, (good, size_of::<T>()), newer, call);
    }

    /// The same for a struct, and how many bytes it was long in the first version of the header.
    pub fn sized_grown<T: Copy>(
        &mut self,
        function: &'static str,
        name: &str,
        (good, first): (&T, usize),
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
        for wrong in [0, 1, first - 16, 4097, usize::MAX] {
            set(at, wrong);
            self.want(function, format!("{name}.struct_size {wrong}"), ABI, call(at));
        }
        set(at, size + 16);
        self.want(function, format!("{name} newer, nothing new set"), ATLASFIT_OK, call(at));
        set(at, size + 16);
        room[size + 15] = 1;
        self.want(function, format!("{name} newer, something new set"), newer, call(at));
    }

    /// A function that takes a run.
    pub fn run(&mut self, function: &'static str, call: impl Fn(*const atlasfit_run) -> i32) {
        let good = init(atlasfit_run_init);
        let first = std::mem::offset_of!(atlasfit_run, overall);
        self.sized_grown(function, "run", (&good, first), ABI, |r| call(r));
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

    /// A function that takes points.
    pub fn points(
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
    pub fn given_points(
        &mut self,
        function: &'static str,
        good: &atlasfit_points,
        empty: i32,
        call: impl Fn(*const atlasfit_points) -> i32,
    ) {
        let first = std::mem::offset_of!(atlasfit_points, triangles);
        self.sized_grown(function, "points", (good, first), ABI, |p| call(p));
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

    /// A function that takes a mesh.
    pub fn mesh(
        &mut self,
        function: &'static str,
        good: &atlasfit_mesh,
        empty: i32,
        call: impl Fn(*const atlasfit_mesh) -> i32,
    ) {
        self.want(function, "mesh NULL", INVALID, call(null()));
        let first = std::mem::offset_of!(atlasfit_mesh, component_stride);
        self.sized_grown(function, "mesh", (good, first), ABI, |m| call(m));
        let far: Vec<u32> = (0..3 * good.triangle_count as u32).map(|i| 1000 + i).collect();
        let (range, out) = (ATLASFIT_INDEX_OUT_OF_RANGE, far.as_ptr());
        let (polygons, negative) = (good.triangles.cast::<c_void>(), [-1i64; 3]);
        let faces = |m: &mut atlasfit_mesh, faces: atlasfit_faces| {
            (m.triangles, m.triangle_count, m.faces) = (null(), 0, faces);
        };
        let triangle = atlasfit_faces { corners: polygons, count: 1, ..good.faces };
        let (falling, far_end) = ([0u32, 3, 2], [0u32, u32::MAX]);
        let all: [(&str, i32, &dyn Fn(&mut atlasfit_mesh)); 20] = [
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
            ("triangles and faces", INVALID, &|m| m.faces = triangle),
            ("faces without corners", INVALID, &|m| faces(m, atlasfit_faces { count: 1, ..good.faces })),
            ("faces reserved", INVALID, &|m| faces(m, atlasfit_faces { reserved: 1, ..triangle })),
            ("faces of floats", INVALID, &|m| faces(m, atlasfit_faces { scalar: ATLASFIT_F32, ..triangle })),
            ("absurd face count", INVALID, &|m| faces(m, atlasfit_faces { count: usize::MAX, ..triangle })),
            ("absurd face stride", INVALID, &|m| {
                faces(m, atlasfit_faces { count: 2, face_stride: usize::MAX, ..triangle });
            }),
            ("corner is negative", range, &|m| {
                let corners = negative.as_ptr().cast();
                faces(m, atlasfit_faces { corners, scalar: ATLASFIT_I64, ..triangle });
            }),
            ("offsets fall", INVALID, &|m| {
                faces(m, atlasfit_faces { count: 2, offsets: falling.as_ptr().cast(), ..triangle });
            }),
            ("offsets have no end", range, &|m| {
                faces(m, atlasfit_faces { offsets: far_end.as_ptr().cast(), ..triangle });
            }),
            ("components too close", INVALID, &|m| m.component_stride = 1),
        ];
        for (case, want, spoil) in all {
            let mut m = *good;
            spoil(&mut m);
            self.want(function, format!("mesh: {case}"), want, call(&m));
        }
    }
}
