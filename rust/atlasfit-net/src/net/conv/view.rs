//! The numbers of a convolutional network, for comparison with other implementations.

use super::Conv;

/// The numbers of one block, and their gradients of the last [`Conv::backward`].
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct BlockView<'a> {
    /// Before the convolution.
    pub channels: usize,
    /// After it.
    pub outputs: usize,
    /// Columns of the weights: 9 taps of `outputs` each, then padding.
    pub width: usize,
    /// Channels x width.
    pub weights: &'a [f32],
    /// Gains, then shifts, of batch norm; of the last block the bias.
    pub affine: &'a [f32],
    /// Gradient of the weights.
    pub d_weights: &'a [f32],
    /// Gradient of `affine`.
    pub d_affine: &'a [f32],
}

impl Conv {
    /// The blocks, for comparison with other implementations.
    pub fn blocks(&self) -> impl Iterator<Item = BlockView<'_>> {
        self.blocks.iter().map(|b| BlockView {
            channels: b.channels,
            outputs: b.outputs,
            width: b.width,
            weights: &b.weights,
            affine: &b.affine,
            d_weights: &b.d_weights,
            d_affine: &b.d_affine,
        })
    }

    /// The fixed noise, upsampled: what the first convolution sees, row after row, 8 x 8 x channels.
    #[must_use]
    pub fn noise(&self) -> &[f32] {
        &self.blocks[0].x
    }
}
