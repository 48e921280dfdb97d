//! Atlases learned from a collection of shapes, as in *Deep Manifold Prior* (Gadelha, Wang, Maji), section
//! "Learning from data" and supplement A: the same charts and the same stretch as in `atlasfit-net`, made by a
//! network from points or from one picture.

pub mod adam;
pub mod checkpoint;
pub mod correspond;
pub mod data;
pub mod error;
pub mod eval;
pub mod loss;
pub mod model;
pub mod ops;
pub mod params;
pub mod recipe;
pub mod shapes;
pub mod train;

pub use error::{Error, Result};
pub use model::Model;
pub use recipe::Recipe;

pub use candle_core::Device;

/// The device of a name: `cpu`, `cuda`, `metal`.
///
/// # Errors
/// [`Error::Tensor`] where this build, or this machine, has none.
pub fn device(name: &str) -> Result<Device> {
    Ok(match name {
        "cuda" => Device::new_cuda(0)?,
        "metal" => Device::new_metal(0)?,
        _ => Device::Cpu,
    })
}

/// The small model that comes with the program: points or one picture of the generator's families. How it was
/// trained stands in docs/learning.md.
pub const SMALL_MODEL: &[u8] = include_bytes!("../models/small.safetensors");
