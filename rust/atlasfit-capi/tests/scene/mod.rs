//! What the tests share: small inputs, and handles made from them.

#![allow(dead_code)]

use atlasfit_capi::arrays::*;
use atlasfit_capi::atlas::*;
use atlasfit_capi::denoise::*;
use atlasfit_capi::mesh::*;
use atlasfit_capi::points::*;
use atlasfit_capi::result::*;
use atlasfit_capi::run::*;
use atlasfit_capi::status::*;
use atlasfit_capi::unwrap::*;
use atlasfit_capi::uv::*;
use std::ptr::null_mut;

/// The text of this thread's last failure.
pub fn last_error() -> String {
    let length = unsafe { atlasfit_last_error(null_mut(), 0) };
    let mut text = vec![0u8; length + 1];
    assert_eq!(unsafe { atlasfit_last_error(text.as_mut_ptr().cast(), text.len()) }, length);
    text.pop();
    String::from_utf8(text).expect("texts are UTF-8")
}

/// Points about a bumpy sphere, with noise and two strays. No random numbers: sines look random enough.
pub fn scan(count: usize) -> Vec<f64> {
    let noise = |i: usize, k: f64| ((i as f64 * 12.9898 + k).sin() * 43758.5453).fract();
    let mut xyz = Vec::new();
    for i in 0..count {
        let z = 2.0 * (i as f64 + 0.5) / count as f64 - 1.0;
        let (a, r) = (i as f64 * 2.399_963_229_728_653, (1.0 - z * z).sqrt());
        let size = 3.0
            + 0.3 * (2.0 * a).cos() * r * r
            + 0.02 * (noise(i, 0.0) + noise(i, 1.0) + noise(i, 2.0) - 1.5);
        xyz.extend([size * r * a.cos() + 100.0, size * r * a.sin(), size * z]);
    }
    xyz[..3].copy_from_slice(&[110.0, 9.0, 9.0]);
    xyz[3..6].copy_from_slice(&[90.0, -9.0, 9.0]);
    xyz
}

/// A noisy sheet of 40 x 40 vertices with steps of 1, with one spike, and its triangles.
pub fn spiky_sheet() -> (Vec<f64>, Vec<u32>) {
    let noise = |i: u32| 0.1 * ((f64::from(i) * 12.9898).sin() * 43758.5453).fract();
    let at = |i: u32| [f64::from(i % 40), f64::from(i / 40), noise(i)];
    let mut xyz: Vec<f64> = (0..1600).flat_map(at).collect();
    xyz[3 * SPIKE + 2] = 12.0;
    let corners = (0..39 * 39).map(|i| i / 39 * 40 + i % 39);
    (xyz, corners.flat_map(|a| [a, a + 1, a + 41, a, a + 41, a + 40]).collect())
}
/// The vertex of the sheet that has the spike.
pub const SPIKE: usize = 820;

/// The corners of a box and its twelve triangles.
pub fn cube() -> (Vec<f32>, Vec<u32>) {
    let xyz = (0..8).flat_map(|i| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|x| x as f32)).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|q| [q[0], q[1], q[2], q[0], q[2], q[3]]).collect();
    (xyz, triangles)
}

/// A struct filled by its `_init`.
pub fn init<T>(f: unsafe extern "C" fn(*mut T, usize) -> i32) -> T {
    let mut value = std::mem::MaybeUninit::<T>::uninit();
    assert_eq!(unsafe { f(value.as_mut_ptr(), size_of::<T>()) }, ATLASFIT_OK);
    unsafe { value.assume_init() }
}

/// A struct for a result: zeros and its size.
pub fn output<T>() -> T {
    let mut value = std::mem::MaybeUninit::<T>::zeroed();
    unsafe {
        value.as_mut_ptr().cast::<usize>().write(size_of::<T>());
        value.assume_init()
    }
}

/// Points of packed f64.
pub fn points(xyz: &[f64]) -> atlasfit_points {
    let p = init(atlasfit_points_init);
    atlasfit_points { positions: xyz.as_ptr().cast(), count: xyz.len() / 3, scalar: ATLASFIT_F64, ..p }
}

/// A mesh of packed f32.
pub fn mesh(xyz: &[f32], triangles: &[u32]) -> atlasfit_mesh {
    atlasfit_mesh {
        positions: xyz.as_ptr().cast(),
        vertex_count: xyz.len() / 3,
        triangles: triangles.as_ptr(),
        triangle_count: triangles.len() / 3,
        ..init(atlasfit_mesh_init)
    }
}

/// One live handle of each kind, and the inputs they came from.
pub struct Scene {
    pub xyz: Vec<f64>,
    pub cube: (Vec<f32>, Vec<u32>),
    pub report: atlasfit_report,
    pub result: *mut atlasfit_result,
    pub atlas: *mut atlasfit_atlas,
    pub uv: *mut atlasfit_uv,
    pub cancel: *mut atlasfit_cancel,
}

impl Scene {
    pub fn new(count: usize) -> Self {
        let (xyz, cube) = (scan(count), cube());
        let (mut result, mut atlas, mut uv, mut cancel) = (null_mut(), null_mut(), null_mut(), null_mut());
        let mut report = output();
        let ok = |status: i32| assert_eq!(status, ATLASFIT_OK, "{}", last_error());
        unsafe {
            ok(atlasfit_denoise(&points(&xyz), std::ptr::null(), std::ptr::null(), &mut result));
            ok(atlasfit_result_report(result, &mut report));
            ok(atlasfit_result_atlas(result, &mut atlas));
            let m = mesh(&cube.0, &cube.1);
            ok(atlasfit_unwrap(&m, std::ptr::null(), std::ptr::null(), &mut uv));
            ok(atlasfit_cancel_new(&mut cancel));
        }
        Self { xyz, cube, report, result, atlas, uv, cancel }
    }
    pub fn points(&self) -> atlasfit_points {
        points(&self.xyz)
    }
    pub fn mesh(&self) -> atlasfit_mesh {
        mesh(&self.cube.0, &self.cube.1)
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        unsafe {
            for status in [
                atlasfit_result_free(self.result),
                atlasfit_atlas_free(self.atlas),
                atlasfit_uv_free(self.uv),
                atlasfit_cancel_free(self.cancel),
            ] {
                assert_eq!(status, ATLASFIT_OK);
            }
        }
    }
}

/// The names of the functions that the header declares.
pub fn declared() -> Vec<String> {
    let header = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../include/atlasfit.h"))
        .expect("the header lies in include/");
    let mut names: Vec<String> = header
        .split("\nATLASFIT_API")
        .skip(1)
        .map(|d| {
            d[..d.find('(').expect("a declaration")]
                .split(['*', ' ', '\n'])
                .next_back()
                .unwrap_or("")
                .to_owned()
        })
        .collect();
    names.sort();
    names
}
