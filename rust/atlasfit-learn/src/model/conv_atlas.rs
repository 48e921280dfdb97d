//! From a code to charts, each a convolutional network: the code becomes a small picture, which blocks of
//! upsampling and convolution double while they halve its channels. Source: *Deep Manifold Prior*, supplement
//! A ("ConvAtlas"). It does not say how the code enters; here one linear layer, shared by all charts, makes a
//! picture of 4 x 4 from it.

use crate::ops::{Window, bias_tanh, conv, shared_product, unfold, upsample};
use crate::params::{Mode, Norm, Params};
use candle_core::{Result, Tensor};

/// Side of the first picture (supplement A.1).
const START: usize = 4;
/// Blocks of upsampling and convolution (supplement A.1).
const BLOCKS: usize = 3;
/// Slope of LeakyReLU for negative values (supplement A).
const LEAK: f32 = 0.2;
/// Samples along a side of a chart: 32.
pub(super) const SIDE: usize = START << BLOCKS;
/// Size of the convolutions (supplement A).
const WINDOW: Window = Window { side: 3, stride: 1 };

pub(super) struct ConvAtlas {
    charts: usize,
    channels: usize,
    of_code: Tensor,
    norm: Norm,
    weights: Vec<Tensor>,
    norms: Vec<Norm>,
    bias: Tensor,
}

impl ConvAtlas {
    /// `channels` of the first picture; a multiple of 4.
    pub(super) fn new(params: &mut Params, charts: usize, code: usize, channels: usize) -> Result<Self> {
        let start = START * START * channels;
        let of_code = params.uniform("decoder.code.weight", (1, code, start), code)?;
        let norm = params.norm("decoder.code", 1, start, LEAK)?;
        let (mut weights, mut norms) = (Vec::new(), Vec::new());
        for block in 0..BLOCKS {
            let from = channels >> block;
            let to = if block + 1 < BLOCKS { from / 2 } else { 3 };
            let inputs = WINDOW.side * WINDOW.side * from;
            weights.push(params.uniform(&format!("decoder.{block}.weight"), (charts, inputs, to), inputs)?);
            if block + 1 < BLOCKS {
                norms.push(params.norm(&format!("decoder.{block}"), charts, to, LEAK)?);
            }
        }
        let inputs = WINDOW.side * WINDOW.side * (channels >> (BLOCKS - 1));
        let bias = params.uniform("decoder.last.bias", (charts, 1, 3), inputs)?;
        Ok(Self { charts, channels, of_code, norm, weights, norms, bias })
    }

    /// From codes (shapes, code) the samples (charts, shapes, 32 32, 3).
    pub(super) fn forward(&self, codes: &Tensor, mode: Mode) -> Result<Tensor> {
        let shapes = codes.dim(0)?;
        let x = self.norm.forward(&codes.unsqueeze(0)?.matmul(&self.of_code)?, mode)?;
        let x = x.reshape((shapes, START, START, self.channels))?;
        self.decode_doubled(&upsample(&x)?, mode)
    }

    /// From pictures of twice the first side, (shapes, 8, 8, channels), that all charts share.
    pub(super) fn decode_doubled(&self, doubled: &Tensor, mode: Mode) -> Result<Tensor> {
        let shapes = doubled.dim(0)?;
        let mut x = doubled.clone();
        for (block, weight) in self.weights.iter().enumerate() {
            let y = if block == 0 {
                // One product for all charts: they see the same picture.
                let seen = unfold(&x, WINDOW)?;
                let (_, side, _, inputs) = seen.dims4()?;
                shared_product(&seen.reshape((shapes * side * side, inputs))?, weight)?
            } else {
                conv(&upsample(&x)?, weight, WINDOW)?
            };
            let side = START << (block + 1);
            let Some(norm) = self.norms.get(block) else {
                return bias_tanh(&y, &self.bias)?.reshape((self.charts, shapes, side * side, 3));
            };
            x = norm.forward(&y, mode)?.reshape((self.charts * shapes, side, side, ()))?;
        }
        Ok(x)
    }
}
