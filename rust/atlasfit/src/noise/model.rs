//! The noise of a scan and where it is known from.
use super::constants::NOISE;

/// Where the noise is known from, the least informed source first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum NoiseSource {
    /// Residuals of local quadrics.
    Quadrics,
    /// Patches grown with the quadrics' estimate.
    Patches,
    /// Thin tubes that hold most of the scan.
    Tubes,
    /// Charts fitted to a sample of patches.
    Charts,
    /// Neighbourhoods of several steps, where depth is rounded to such: no less noise is believed.
    Rounding,
    /// The user.
    Given,
}

/// The noise of a scan: standard deviation along the surface normal, in the unit of its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseModel {
    /// What the source says.
    pub sigma: f64,
    /// Charts are fitted with at least this much.
    pub floor: f64,
    /// The least that a scan is said to have.
    pub rounding: f64,
    /// Where `sigma` is known from.
    pub source: NoiseSource,
}

impl NoiseModel {
    /// Noise `sigma` known from `source`, among points with this median spacing.
    #[must_use]
    pub fn new(sigma: f64, source: NoiseSource, median_spacing: f64) -> Self {
        let spacing = median_spacing.max(NOISE.least_spacing);
        Self { sigma, floor: NOISE.floor * spacing, rounding: NOISE.rounding * spacing, source }
    }
    /// Whether the user gave the noise: then it is not questioned.
    #[must_use]
    pub fn is_given(&self) -> bool {
        self.source == NoiseSource::Given
    }
    /// Whether charts cannot correct the noise downwards: it was given, or the depth was rounded.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.is_given() || self.source == NoiseSource::Rounding
    }
    /// What charts are cut and fitted with.
    #[must_use]
    pub fn for_charts(&self) -> f64 {
        self.sigma.max(self.floor)
    }
}
