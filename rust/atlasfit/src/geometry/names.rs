//! Names of the attributes that results carry.

/// The attribute, after the scan's own, of the vertices of a watertight surface, and of any where uncertainty
/// is asked for, that is 1 where they were invented, 0 where data are.
pub const EXTRAPOLATED: &str = "extrapolated";

/// The attribute of denoised points and vertices that is their standard deviation along the normal, in the
/// scan's unit. Of outliers it is their distance from the nearest point that is none; not a number where a
/// point is not finite.
pub const UNCERTAINTY: &str = "uncertainty";

/// The attribute of points of several files that numbers their file: 0, 1, and so on.
pub const FILE: &str = "file";

/// The attribute of denoised points that is the standard deviation of the noise they had, in the scan's unit;
/// 0 of outliers.
pub const NOISE: &str = "noise";

/// The attribute of denoised points that is the probability that they belong to no surface, 0 to 1.
pub const OUTLIER_PROBABILITY: &str = "outlier_probability";
