//! Batch norm after a hidden layer, and how it is folded into the next layer.

use super::band::{Band, Folded};
use super::layers::{FAN, OFFSETS};

/// Added to the variance: PyTorch's default (the paper names no value).
pub const EPS: f64 = 1e-5;

/// Batch norm of a layer in the last forward pass: statistics, and the affine map y = scale r + offset that
/// they make.
#[derive(Clone, Default)]
pub struct Norm {
    /// Mean of each unit over the batch.
    pub mean: Vec<f64>,
    /// 1 / sqrt(variance + EPS).
    pub inverse: Vec<f64>,
    /// Gain times inverse.
    pub scale: Vec<f32>,
    /// Shift - scale mean.
    pub offset: Vec<f32>,
}

impl Norm {
    /// Takes the statistics of layer `l` from the bands' sums; `batch` is the number of samples.
    pub fn set(&mut self, l: usize, bands: &[Band], params: &[f32], batch: f64) {
        self.mean.clear();
        self.inverse.clear();
        self.scale.clear();
        self.offset.clear();
        for j in 0..FAN[l][1] {
            let total = |of: fn(&Band) -> &[f64]| bands.iter().map(|b| of(b)[j]).sum::<f64>();
            let mean = total(|b| &b.sum) / batch;
            let variance = (total(|b| &b.square) / batch - mean * mean).max(0.0);
            let inverse = 1.0 / (variance + EPS).sqrt();
            let scale = f64::from(params[OFFSETS[l].g + j]) * inverse;
            self.mean.push(mean);
            self.inverse.push(inverse);
            self.scale.push(scale as f32);
            self.offset.push((f64::from(params[OFFSETS[l].s + j]) - scale * mean) as f32);
        }
    }
}

impl Folded {
    /// Takes the weights (`depth` x `width`) and the bias of a layer, with the batch norm before it folded
    /// in.
    pub fn fold(&mut self, mut w: Vec<f32>, mut b: Vec<f32>, before: Option<&Norm>) {
        if let Some(n) = before {
            for ((row, &a), &t) in w.chunks_exact_mut(b.len()).zip(&n.scale).zip(&n.offset) {
                for (w, b) in row.iter_mut().zip(&mut b) {
                    *b += t * *w;
                    *w *= a;
                }
            }
        }
        (self.weights, self.bias) = (w, b);
    }

    /// Packs the weights for the matrix products; the transpose only where gradients flow `back` through the
    /// layer.
    pub fn pack(&mut self, back: bool) {
        let width = self.bias.len();
        self.forward.set(&self.weights, width);
        if back {
            self.backward.set_transposed(&self.weights, width);
        }
    }
}
