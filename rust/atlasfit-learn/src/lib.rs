//! Atlases learned from a collection of shapes, as in *Deep Manifold Prior* (Gadelha, Wang, Maji), section
//! "Learning from data" and supplement A: the same charts and the same stretch as in `atlasfit-net`, made by
//! a network from points or from one picture. Tensors and gradients are candle's; nearest neighbours, Chamfer
//! distance, overlap and UV quality are the core's.
//!
//! | What | File | In the paper |
//! |---|---|---|
//! | encoders, decoders | [`model`] | section 5.3, supplement A.2 |
//! | the loss | [`loss`] | section 3 |
//! | collections of shapes | [`shapes`], [`data`] | our own; ShapeNet |
//! | training, files | [`train`], [`checkpoint`], [`recipe`] | supplement A.2 |
//! | figures | [`eval`], [`correspond`] | tables of section 5.3 and supplement A.2 |
//!
//! ```
//! use atlasfit_learn::{Device, Model, Recipe, params::Mode};
//! use candle_core::Tensor;
//! let recipe = Recipe::read("[model]\nencoder = \"points\"\ncharts = 4\nside = 5\n")?;
//! let model = Model::new(&recipe.model, 1, &Device::Cpu)?;
//! let points = Tensor::zeros((2, 100, 3), candle_core::DType::F32, &Device::Cpu)?;
//! let codes = model.encode_points(&points, Mode::Use)?.expect("the model has this encoder");
//! assert_eq!(model.decode(&codes, Mode::Use)?.dims(), [2, 4, 25, 3]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod adam;
pub mod checkpoint;
pub mod correspond;
pub mod data;
pub mod error;
pub mod eval;
pub mod loss;
pub mod model;
mod nearest;
pub mod ops;
pub mod params;
pub mod recipe;
pub mod shapes;
pub mod state;
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
