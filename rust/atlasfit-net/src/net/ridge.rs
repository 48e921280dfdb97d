//! An output layer with which a network begins near given outputs.
//!
//! In: the last hidden layer's features and the outputs that are wanted, over a batch. Out: weights and bias
//! of the output layer before its tanh, by ridge regression (Hoerl and Kennard 1970); the hidden layers stay
//! random.

use crate::sample::Sample;
use atlasfit::error::Result;
use atlasfit::numeric::dense::{cholesky, cholesky_solve};
use atlasfit::run::Context;

/// Ridge beside the features' variance of 1: keeps the weights small where features say the same. Source:
/// chosen; a plane is still met within a hundredth of its size.
const RIDGE: f64 = 1e-3;
/// Guard against division by zero, for features that do not vary.
const EPS: f64 = 1e-9;
/// Samples between two looks at the run: below a millisecond.
const LOOK: usize = 64;

/// An output layer: outputs are tanh(bias + weights . features).
pub struct Layer {
    /// One row of three per feature.
    pub weights: Vec<[f32; 3]>,
    /// One per output.
    pub bias: [f32; 3],
}

/// The layer that gives about `wanted`, within (-1, 1), where the features are `features` (rows of `width`).
///
/// # Errors
/// Cancelled or out of time.
pub fn regress(features: &[f32], width: usize, wanted: &[Sample], ctx: &Context<'_>) -> Result<Layer> {
    let count = wanted.len() as f64;
    let mut mean = vec![0.0; width];
    let mut middle = [0.0; 3];
    for (row, wanted) in features.chunks_exact(width).zip(wanted) {
        mean.iter_mut().zip(row).for_each(|(m, x)| *m += f64::from(*x) / count);
        middle.iter_mut().zip(wanted).for_each(|(m, x)| *m += f64::from(*x).atanh() / count);
    }
    let mut matrix = vec![0.0; width * width];
    let mut sides = vec![vec![0.0; width]; 3];
    let mut y = vec![0.0; width];
    for (i, (row, wanted)) in features.chunks_exact(width).zip(wanted).enumerate() {
        if i.is_multiple_of(LOOK) {
            ctx.check()?;
        }
        y.iter_mut().zip(row).zip(&mean).for_each(|((y, x), m)| *y = f64::from(*x) - m);
        for (i, line) in matrix.chunks_exact_mut(width).enumerate() {
            line[i..].iter_mut().zip(&y[i..]).for_each(|(m, b)| *m += y[i] * b / count);
        }
        for ((side, wanted), middle) in sides.iter_mut().zip(wanted).zip(middle) {
            let off = (f64::from(*wanted).atanh() - middle) / count;
            side.iter_mut().zip(&y).for_each(|(s, y)| *s += y * off);
        }
    }
    let deviation: Vec<f64> = matrix.iter().step_by(width + 1).map(|v| v.max(EPS).sqrt()).collect();
    for (i, line) in matrix.chunks_exact_mut(width).enumerate() {
        line.iter_mut().zip(&deviation).for_each(|(m, d)| *m /= d * deviation[i]);
        line[i] += RIDGE;
    }
    let mut layer = Layer { weights: vec![[0.0; 3]; width], bias: middle.map(|x| x as f32) };
    // A correlation matrix with a ridge is positive definite, if it is finite.
    if !cholesky(&mut matrix, width) {
        return Ok(layer);
    }
    for (k, side) in sides.iter_mut().enumerate() {
        ctx.check()?;
        side.iter_mut().zip(&deviation).for_each(|(s, d)| *s /= d);
        cholesky_solve(&matrix, width, side);
        let mut bias = middle[k];
        for (((w, s), d), m) in layer.weights.iter_mut().zip(side).zip(&deviation).zip(&mean) {
            w[k] = (*s / d) as f32;
            bias -= *s / d * m;
        }
        layer.bias[k] = bias as f32;
    }
    Ok(layer)
}
