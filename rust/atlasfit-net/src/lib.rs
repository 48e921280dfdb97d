//! The networks of the paper *Deep Manifold Prior* (Gadelha, Wang, Maji) as guides for [`atlasfit`].
//!
//! A guide makes a surface near noisy points. [`atlasfit::pipeline::denoise_guided`] projects a scan onto it
//! before charts are fitted; all other steps are those of [`atlasfit::denoise`]. The guides here are trained
//! on the scan alone:
//!
//! | Prior | What is trained | In the paper | File |
//! |---|---|---|---|
//! | [`Prior::Gp`] | nothing: as smooth as the limit of the networks, the default | section 4 | the core |
//! | [`Prior::Network`] | a network per chart, from the unit square to space | sections 3, 5.1 | [`explicit`] |
//! | the same, convolutional | a network per chart, from noise to a grid | supplement A | [`net::conv`] |
//! | [`Prior::LevelSet`] | one network from space to a number | sections 3, 5.1 | [`level_set`] |
//!
//! In: points in the normalised frame (longest side 1). Out: a triangle mesh near them.
//!
//! ```
//! use atlasfit::geometry::PointCloud;
//! use atlasfit::pipeline::{DenoiseOptions, denoise_guided};
//! use atlasfit_net::{NetworkOptions, Prior, explicit::Recipe};
//! # let mut rng = atlasfit::numeric::rng::Rng::new(9);
//! # let mut random = || atlasfit::Vec3::from_fn(|_| rng.normal());
//! # let scan: Vec<[f64; 3]> =
//! #     (0..1500).map(|_| (random().normalized() * 10.0 + random() * 0.1).0).collect();
//! let cloud = PointCloud::from_positions(scan);
//! let few = NetworkOptions::default().with_charts(1).with_recipe(Recipe::Paper).with_iterations(2);
//! let prior = Prior::Network(few);
//! let how = DenoiseOptions::default().with_uv(false);
//! let result = denoise_guided(&cloud, &how, prior.guide(), &mut atlasfit::Run::default())?;
//! assert_eq!(result.points.len(), cloud.len());
//! # Ok::<(), atlasfit::Error>(())
//! ```
//!
//! # How to add a prior
//!
//! 1. Write one file here with an options struct and `impl Guide for` it. [`Guide::validate`] refuses
//!    options out of range; [`Guide::surface`] takes the points and the standard deviation of their noise,
//!    and returns a mesh. It takes random numbers from `ctx.seed`, calls `ctx.check()` every few
//!    milliseconds and gives the same bytes for any number of threads.
//! 2. Add a variant to [`Prior`] with its line in [`Prior::guide`].
//!
//! The program and the C ABI then need one line each to name it. A prior outside this crate needs step 1
//! only: `denoise_guided` takes any [`Guide`].

pub mod explicit;
mod finite;
pub mod level_set;
pub mod loss;
pub mod net;
mod sample;
mod trim;

pub use explicit::NetworkOptions;
pub use level_set::LevelSetOptions;
pub use trim::trim;

use atlasfit::pipeline::Guide;

/// Which prior a scan is denoised with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Prior {
    /// A Gaussian process as smooth as the limit of the paper's networks: no guide.
    #[default]
    Gp,
    /// The paper's explicit networks, fully connected or convolutional.
    Network(NetworkOptions),
    /// The paper's level set of one network.
    LevelSet(LevelSetOptions),
}

impl Prior {
    /// The guide to hand to [`atlasfit::pipeline::denoise_guided`]; `None` for the default prior, which needs
    /// none.
    #[must_use]
    pub fn guide(&self) -> Option<&dyn Guide> {
        match self {
            Self::Gp => None,
            Self::Network(how) => Some(how),
            Self::LevelSet(how) => Some(how),
        }
    }
}
