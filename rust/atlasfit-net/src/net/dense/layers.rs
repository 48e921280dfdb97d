//! The sizes of the network's layers, and where their parameters lie in one array.

use crate::net::gemm::PANEL;
use std::ops::Range;

/// Layers with weights: three hidden ones and the output (*Deep Manifold Prior*, section 5.1, "Experimental
/// setup").
pub const LAYERS: usize = 4;
/// Numbers per input of a sample, padded with zeros. The gradient of a padding input's weights is 0: they
/// never change.
pub const IN: usize = 4;
/// Outputs, padded to a panel of the matrix kernels. The padding's weights stay 0.
pub const OUT: usize = PANEL;
/// Inputs and outputs of each layer: 256, 128 and 64 hidden units (*Deep Manifold Prior*, section 5.1).
pub const FAN: [[usize; 2]; LAYERS] = [[IN, 256], [256, 128], [128, 64], [64, OUT]];

/// Where a layer's parameters begin: weights (inputs x outputs, row-major), bias, and for hidden layers batch
/// norm's gain and shift.
#[derive(Clone, Copy)]
pub struct Offsets {
    /// Weights.
    pub w: usize,
    /// Bias.
    pub b: usize,
    /// Gain of batch norm.
    pub g: usize,
    /// Shift of batch norm.
    pub s: usize,
}

/// The offsets of all layers, and the number of parameters.
const fn offsets() -> ([Offsets; LAYERS], usize) {
    let mut out = [Offsets { w: 0, b: 0, g: 0, s: 0 }; LAYERS];
    let (mut at, mut l) = (0, 0);
    while l < LAYERS {
        let [i, o] = FAN[l];
        let hidden = if l + 1 < LAYERS { o } else { 0 };
        out[l] = Offsets { w: at, b: at + i * o, g: at + i * o + o, s: at + i * o + o + hidden };
        at += i * o + o + 2 * hidden;
        l += 1;
    }
    (out, at)
}

/// Where each layer's parameters begin.
pub const OFFSETS: [Offsets; LAYERS] = offsets().0;
/// Parameters of a network, with padding.
pub const PARAMETERS: usize = offsets().1;

/// Where layer `l`'s weights lie.
pub const fn weights(l: usize) -> Range<usize> {
    OFFSETS[l].w..OFFSETS[l].b
}

/// Where layer `l`'s bias lies.
pub const fn bias(l: usize) -> Range<usize> {
    OFFSETS[l].b..OFFSETS[l].b + FAN[l][1]
}

/// Where the gain of batch norm after layer `l` lies.
pub const fn gain(l: usize) -> Range<usize> {
    OFFSETS[l].g..OFFSETS[l].s
}
