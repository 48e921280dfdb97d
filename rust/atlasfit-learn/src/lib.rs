//! Atlases learned from a collection of shapes, as in *Deep Manifold Prior* (Gadelha, Wang, Maji), section
//! "Learning from data" and supplement A: the same charts and the same stretch as in `atlasfit-net`, made by a
//! network from points or from one picture.

pub mod adam;
pub mod data;
pub mod error;
pub mod loss;
pub mod model;
pub mod ops;
pub mod params;
pub mod recipe;
pub mod shapes;

pub use error::{Error, Result};
pub use model::Model;
pub use recipe::Recipe;
