//! Which figures there are.

use super::laws::{convolution, curvature, kernels, spectrum, width};
use super::patches::bridge;
use super::prior::{level_sets, networks, prior};
use crate::plot::Figure;

/// Makes a figure from a seed.
pub type Make = fn(u64) -> Figure;

/// All figures, by the name of their files.
pub const ALL: [(&str, Make); 9] = [
    ("prior", prior),
    ("networks", networks),
    ("kernels", kernels),
    ("convolution", convolution),
    ("curvature", curvature),
    ("width", width),
    ("spectrum", spectrum),
    ("level-sets", level_sets),
    ("bridge", bridge),
];
