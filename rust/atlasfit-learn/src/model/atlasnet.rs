//! From a code to charts, each a fully connected network of the code and a place of the unit square.
//! Source: AtlasNet (Groueix et al. 2018). Its first layer sees code and place side by side; here it is the
//! sum of a product of each: the same function, without a copy of the code at every place.

use crate::ops::{bias_tanh, shared_product};
use crate::params::{Mode, Norm, Params};
use candle_core::{Device, Result, Tensor, bail};

pub(super) struct AtlasNet {
    charts: usize,
    of_code: Tensor,
    of_place: Tensor,
    norms: Vec<Norm>,
    /// Weights of the layers after the first.
    weights: Vec<Tensor>,
    bias: Tensor,
}

impl AtlasNet {
    pub(super) fn new(params: &mut Params, charts: usize, code: usize, hidden: &[usize]) -> Result<Self> {
        let first = hidden.first().copied().unwrap_or(1);
        let of_code = params.uniform("decoder.0.code", (charts, code, first), code + 2)?;
        let of_place = params.uniform("decoder.0.place", (charts, 2, first), code + 2)?;
        let mut norms = vec![params.norm("decoder.0", charts, first, 0.0)?];
        let mut weights = Vec::new();
        let mut inputs = first;
        for (l, &n) in hidden.iter().enumerate().skip(1) {
            let name = format!("decoder.{l}");
            weights.push(params.uniform(&format!("{name}.weight"), (charts, inputs, n), inputs)?);
            norms.push(params.norm(&name, charts, n, 0.0)?);
            inputs = n;
        }
        weights.push(params.uniform("decoder.last.weight", (charts, inputs, 3), inputs)?);
        let bias = params.uniform("decoder.last.bias", (charts, 1, 3), inputs)?;
        Ok(Self { charts, of_code, of_place, norms, weights, bias })
    }

    /// From codes (shapes, code) the samples (charts, shapes, side side, 3).
    pub(super) fn forward(&self, codes: &Tensor, side: usize, mode: Mode) -> Result<Tensor> {
        let (shapes, n) = (codes.dim(0)?, side * side);
        let a = shared_product(codes, &self.of_code)?;
        let b = shared_product(&places(side, codes.device())?, &self.of_place)?;
        let mut layers = self.norms.iter().zip(&self.weights);
        let Some((norm, weight)) = layers.next() else { bail!("a network without layers") };
        let mut x = norm.forward_outer(&a, &b, mode)?.matmul(weight)?;
        for (norm, weight) in layers {
            x = norm.forward(&x, mode)?.matmul(weight)?;
        }
        bias_tanh(&x, &self.bias)?.reshape((self.charts, shapes, n, 3))
    }
}

/// The places of a regular grid in the unit square, (side side, 2).
fn places(side: usize, device: &Device) -> Result<Tensor> {
    let last = side.max(2) - 1;
    let at = |i: usize| i as f32 / last as f32;
    let all: Vec<f32> = (0..side * side).flat_map(|i| [at(i / side), at(i % side)]).collect();
    Tensor::from_vec(all, (side * side, 2), device)
}
