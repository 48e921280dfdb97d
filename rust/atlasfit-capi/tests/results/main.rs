//! What comes through the C ABI is what the core makes, whatever the caller's memory looks like and however
//! many threads ask.

#[path = "../scene/mod.rs"]
mod scene;

mod atlas;
mod denoising;
mod meshes;
mod polygons;
mod running;
mod uncertainty;

use atlasfit_capi::status::ATLASFIT_OK;
use scene::last_error;

fn ok(status: i32) {
    assert_eq!(status, ATLASFIT_OK, "{}", last_error());
}

fn triples(xyz: &[f64]) -> Vec<[f64; 3]> {
    xyz.as_chunks().0.to_vec()
}
