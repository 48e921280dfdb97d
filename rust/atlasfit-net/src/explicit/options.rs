//! How the explicit networks are made and trained.

use crate::net::conv;
use atlasfit::error::{Error, Result};
use atlasfit::setters;

/// The dimension of a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Dim {
    /// Curves: charts are maps from the unit interval.
    Contour,
    /// Surfaces: charts are maps from the unit square.
    #[default]
    Surface,
}

/// What a chart is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Network {
    /// Fully connected, a function of the point of the unit square (section 5.1).
    #[default]
    Dense,
    /// Convolutions of fixed noise, 32 x 32 samples (supplement A.1); surfaces in space only.
    Conv,
}

/// Where charts begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Start {
    /// Each as a small flat patch of its own, at places of the scan that are spread out, in the plane of the
    /// points there. Our choice: the paper does not say.
    #[default]
    Patches,
    /// At random, as PyTorch starts linear layers and convolutions: uniform within 1/sqrt(inputs). Batch norm
    /// makes such charts about twice as large as the scan, all around its middle.
    Torch,
}

/// How training goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Recipe {
    /// As in the paper, section 5.1: all samples at every step, one learning rate.
    Paper,
    /// From few samples and points to all of them, at learning rates that fall.
    #[default]
    Fast,
}

/// How the networks are made and trained. The defaults are the paper's (section 5.1) where it says, but for
/// the recipe.
///
/// ```
/// use atlasfit_net::explicit::{NetworkOptions, Recipe};
/// let how = NetworkOptions::default().with_charts(4).with_recipe(Recipe::Paper).with_iterations(300);
/// assert_eq!(how.validate(), Ok(()));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct NetworkOptions {
    /// What a chart is made of. Default: fully connected.
    pub network: Network,
    /// Number of charts, 1 or more. Default 8: the paper compares 1 and 8 (table 2).
    pub charts: usize,
    /// Curves or surfaces. Default: surfaces.
    pub dim: Dim,
    /// Whether the charts lie in the plane z = 0, as drawings do. Default: no.
    pub flat: bool,
    /// Where charts begin. Default: small patches on the scan.
    pub start: Start,
    /// How training goes. Default: the fast recipe.
    pub recipe: Recipe,
    /// Steps of the paper's recipe, at most: training stops early where the loss no longer falls. Default
    /// 1000, not the paper's, which names no number.
    pub iterations: usize,
    /// Weight of the stretch against the Chamfer distance, 0 or more: lambda in the paper's equation 4.
    /// Default 1.
    pub stretch_weight: f64,
    /// Adam's learning rate in the paper's recipe, positive. Default 1e-3, the paper's.
    pub learning_rate: f64,
}

setters! {
    NetworkOptions {
        with_network: network: Network,
        with_charts: charts: usize,
        with_dim: dim: Dim,
        with_flat: flat: bool,
        with_start: start: Start,
        with_recipe: recipe: Recipe,
        with_iterations: iterations: usize,
        with_stretch_weight: stretch_weight: f64,
        with_learning_rate: learning_rate: f64,
    }
}

impl Default for NetworkOptions {
    fn default() -> Self {
        Self {
            network: Network::Dense,
            charts: 8,
            dim: Dim::Surface,
            flat: false,
            start: Start::Patches,
            recipe: Recipe::Fast,
            iterations: 1000,
            stretch_weight: 1.0,
            learning_rate: 1e-3,
        }
    }
}

/// A part of a training, whose steps see some of the samples and points only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Phase {
    /// Samples per side are divided by 2^thin, points by 4^thin (a curve's samples by 4^thin).
    pub thin: u32,
    /// Steps of Adam.
    pub steps: usize,
    /// Learning rate at the start and at the end, geometric between them.
    pub rate: [f64; 2],
}

/// Steps after which the paper's recipe asks whether the loss still falls. The paper says neither how many
/// steps it takes nor when it stops.
pub(super) const WINDOW: usize = 100;
/// The least fall of the loss from one window to the next, as a share, with which training goes on.
pub(super) const LEAST_FALL: f64 = 0.02;

/// The fast recipe. A quarter of the samples finds the shape; all of them then mend what the gaps between
/// samples hid. Larger rates fall faster at first and end worse: batch norm makes the size of the weights
/// free, large steps make them grow, and the larger they are the less a step does. Measured by `atlasfit
/// bench paper`.
const FAST_DENSE: [Phase; 2] =
    [Phase { thin: 1, steps: 350, rate: [1e-3; 2] }, Phase { thin: 0, steps: 200, rate: [1e-3, 2e-4] }];
/// The fast recipe of convolutions, which always give all samples. Measured by `atlasfit bench paper`.
const FAST_CONV: [Phase; 1] = [Phase { thin: 0, steps: 200, rate: [3e-3, 3e-4] }];

impl NetworkOptions {
    /// Fails on options out of range.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`].
    pub fn validate(&self) -> Result<()> {
        let invalid = |what: String, advice: &str| Err(Error::invalid(what, advice));
        if self.charts == 0 {
            return invalid("the network prior has 0 charts".into(), "Give at least 1; the paper uses 8");
        }
        if !(self.stretch_weight >= 0.0 && self.stretch_weight.is_finite()) {
            return invalid(format!("stretch_weight is {}", self.stretch_weight), "Give 0 or more");
        }
        if !(self.learning_rate > 0.0 && self.learning_rate.is_finite()) {
            return invalid(format!("learning_rate is {}", self.learning_rate), "Give a positive number");
        }
        if self.network == Network::Conv && (self.dim == Dim::Contour || self.flat) {
            return invalid(
                "the convolutional prior makes surfaces in space only".into(),
                "Use the fully connected one for curves and drawings",
            );
        }
        Ok(())
    }

    /// Lines and samples per line of each chart's grid: 4,096 samples per chart, 16,384 ("16K") for a single
    /// one, 1,024 for convolutions (*Deep Manifold Prior*, section 5.1 and supplement A.1).
    pub(super) const fn grid(&self) -> [usize; 2] {
        match (self.network, self.dim, self.charts) {
            (Network::Conv, ..) => conv::GRID,
            (_, Dim::Surface, 1) => [128, 128],
            (_, Dim::Surface, _) => [64, 64],
            (_, Dim::Contour, 1) => [1, 16384],
            (_, Dim::Contour, _) => [1, 4096],
        }
    }

    /// The parts of the training.
    pub(super) fn phases(&self) -> Vec<Phase> {
        match (self.recipe, self.network) {
            (Recipe::Paper, _) => {
                vec![Phase { thin: 0, steps: self.iterations, rate: [self.learning_rate; 2] }]
            }
            (Recipe::Fast, Network::Dense) => FAST_DENSE.to_vec(),
            (Recipe::Fast, Network::Conv) => FAST_CONV.to_vec(),
        }
    }
}
