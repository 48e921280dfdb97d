//! The networks of the paper as guides for [`atlasfit`]: a scan is projected onto their surface before charts are fitted.
//!
//! In: points in the normalised frame (longest side 1). Out: charts of networks ([`explicit`]) or a level set ([`level_set`]),
//! trained on these points alone. Source: *Deep Manifold Prior* (Gadelha, Wang, Maji), section 3.

pub mod explicit;
pub mod level_set;
pub mod loss;
pub mod net;
mod trim;

pub use explicit::NetworkOptions;
pub use level_set::LevelSetOptions;
pub use trim::trim;

use atlasfit::geometry::TriMesh;
use atlasfit::pipeline::Guide;
use atlasfit::{Context, Result, Vec3};

/// Which prior the charts are fitted with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Prior {
    /// The Gaussian-process limit of the paper's networks: no guide.
    #[default]
    Gp,
    /// The paper's explicit networks, fully connected or convolutional.
    Network(NetworkOptions),
    /// The paper's level set of one network.
    LevelSet(LevelSetOptions),
}

impl Prior {
    /// The guide that this prior is; none for the default.
    #[must_use]
    pub fn guide(&self) -> Option<&dyn Guide> {
        match self {
            Self::Gp => None,
            Self::Network(how) => Some(how),
            Self::LevelSet(how) => Some(how),
        }
    }
}

impl Guide for NetworkOptions {
    fn validate(&self) -> Result<()> {
        Self::validate(self)
    }
    fn surface(&self, points: &[Vec3], _sigma: f64, ctx: &Context<'_>) -> Result<TriMesh> {
        Ok(explicit::fit(points, self, ctx)?.surface())
    }
}

impl Guide for LevelSetOptions {
    fn validate(&self) -> Result<()> {
        Self::validate(self)
    }
    fn surface(&self, points: &[Vec3], sigma: f64, ctx: &Context<'_>) -> Result<TriMesh> {
        level_set::fit(points, sigma, self, ctx)
    }
}
