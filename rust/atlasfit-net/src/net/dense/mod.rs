//! A fully connected network: hidden layers of 256, 128 and 64 units, each with ReLU and then batch norm, and
//! an output layer with tanh. Forward pass, backward pass, steps of Adam.
//!
//! In: up to three inputs per sample, gradients with respect to the outputs. Out: up to three outputs per
//! sample; updated parameters. Source: *Deep Manifold Prior*, section 5.1 ("Experimental setup").
//!
//! Only the matrix products go through the activations: batch norm is folded into the weights of the next
//! layer, and all other work is done on the products' tiles. With r the activations after ReLU, m and v their
//! mean and variance over the batch, gain g and shift s, a = g / sqrt(v + eps) and t = s - a m, the next
//! layer sees y = a r + t. Therefore
//!
//! - forward: y W + b = r (a W) + (b + t W), with the folded weights a W on r itself;
//! - weights: dW = y^T G = a (r^T G) + t (1^T G), with G the gradient of the next layer's sums;
//! - batch norm, with D = G W^T the gradient with respect to y over N samples:
//!   ds = 1^T D = W (1^T G), sum D r = rows of W . (r^T G), dg = (sum D r - m ds) / sqrt(v + eps),
//!   dr = a (D - ds / N - dg (r - m) / (sqrt(v + eps) N)) = G (a W)^T + p r + q.
//!
//! All sums in batch norm's gradient follow from r^T G and 1^T G, which the gradient of the weights needs
//! anyway. On a regular grid the first layer and the product after it, nearly all of the work, cost next to
//! nothing: see [`hinge`](super::hinge).

mod band;
mod layers;
mod norm;
#[cfg(test)]
mod tests;
mod tiles;

pub use norm::EPS;

use super::adam::Adam;
use super::gemm::{Packed, Store, multiply};
use super::hinge::{Grid, Hinges, Layer, SUMS};
use super::ridge::regress;
use crate::sample::Sample;
use atlasfit::error::Result;
use atlasfit::numeric::rng::Rng;
use atlasfit::run::Context;
use band::{BLOCK, Band, Folded, Inputs, layer};
use layers::{FAN, IN, LAYERS, OFFSETS, OUT, PARAMETERS, bias, gain, weights};
use norm::Norm;
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

/// Samples per task. Partial sums are kept per task and added in order, so this, not the number of threads,
/// decides rounding.
const BAND: usize = 2048;

/// A network with its training state.
pub struct Dense {
    inputs: Inputs,
    /// Outputs in use, at most 3.
    outputs: usize,
    params: Vec<f32>,
    grads: Vec<f32>,
    adam: Adam,
    norm: [Norm; LAYERS - 1],
    folded: [Folded; LAYERS],
    bands: Vec<Band>,
}

impl Dense {
    /// A random network from `used` inputs to `outputs` outputs, each at most 3. Weights and biases are
    /// uniform within 1/sqrt(inputs) (PyTorch's default for linear layers); batch norm starts as gain 1 and
    /// shift 0.
    pub fn new(used: usize, outputs: usize, rng: &mut Rng) -> Self {
        let mut params = vec![0.0; PARAMETERS];
        for (l, &[inputs, width]) in FAN.iter().enumerate() {
            let inputs = if l == 0 { used } else { inputs };
            let bound = 1.0 / f64::sqrt(inputs as f64);
            let mut fill = |values: &mut [f32]| {
                for row in values.chunks_exact_mut(width) {
                    for x in &mut row[..if l + 1 < LAYERS { width } else { outputs }] {
                        *x = ((2.0 * rng.uniform() - 1.0) * bound) as f32;
                    }
                }
            };
            fill(&mut params[weights(l)][..inputs * width]);
            fill(&mut params[bias(l)]);
            if l + 1 < LAYERS {
                params[gain(l)].fill(1.0);
            }
        }
        Self {
            inputs: Inputs::Scattered(Vec::new()),
            outputs,
            grads: vec![0.0; PARAMETERS],
            adam: Adam::new(PARAMETERS),
            params,
            norm: Default::default(),
            folded: Default::default(),
            bands: Vec::new(),
        }
    }

    /// Sets the batch. Of each input the numbers that are not used must be 0.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn set_inputs(&mut self, inputs: &[[f32; 3]], ctx: &Context<'_>) -> Result<()> {
        let mut rows = Vec::with_capacity(IN * inputs.len());
        for (i, &[u, v, w]) in inputs.iter().enumerate() {
            ctx.check_at(i)?;
            rows.extend([u, v, w, 0.0]);
        }
        self.inputs = Inputs::Scattered(rows);
        self.set_bands(BAND, |_| None);
        Ok(())
    }

    /// Sets the batch to a grid's samples: the inputs are those of [`Grid::input`].
    pub fn set_grid(&mut self, grid: Grid) {
        let before = std::mem::replace(&mut self.inputs, Inputs::Grid(grid));
        if matches!(before, Inputs::Grid(g) if g.size == grid.size) {
            for band in &mut self.bands {
                if let Some(hinges) = &mut band.hinges {
                    hinges.move_to(&grid, band.rows.start);
                }
            }
        } else {
            self.set_bands(grid.whole_lines(BAND), |rows| Some(Hinges::new(&grid, rows)));
        }
    }

    fn set_bands(&mut self, most: usize, hinges: impl Fn(Range<usize>) -> Option<Hinges>) {
        let batch = self.inputs.rows();
        self.bands = (0..batch)
            .step_by(most)
            .map(|from| {
                let rows = from..(from + most).min(batch);
                Band::new(rows.clone(), hinges(rows))
            })
            .collect();
    }

    fn batch(&self) -> f64 {
        self.inputs.rows() as f64
    }

    /// Outputs of the whole batch, written to `out`.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn forward(&mut self, out: &mut [Sample], ctx: &Context<'_>) -> Result<()> {
        for l in 0..LAYERS {
            self.fold(l);
            let (folded, inputs) = (&self.folded, &self.inputs);
            self.bands.par_iter_mut().try_for_each(|band| match inputs {
                Inputs::Grid(grid) if l < 2 => band.forward_hinges(l, grid, &folded[l], ctx),
                _ => band.forward(l, inputs, folded, ctx),
            })?;
            if l + 1 < LAYERS {
                let batch = self.batch();
                self.norm[l].set(l, &self.bands, &self.params, batch);
            }
        }
        for band in &self.bands {
            for (o, y) in out[band.rows.clone()].iter_mut().zip(band.out.chunks_exact(OUT)) {
                o.copy_from_slice(&y[..3]);
            }
        }
        Ok(())
    }

    /// Gradients of all parameters from those of the outputs that the last [`Self::forward`] gave.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn backward(&mut self, gradient: &[Sample], ctx: &Context<'_>) -> Result<()> {
        let outputs = self.outputs;
        self.bands.par_iter_mut().try_for_each(|band| band.backward_output(gradient, outputs, ctx))?;
        let batch = self.batch();
        for l in (1..LAYERS).rev() {
            let [inputs, outputs] = FAN[l];
            let grid = match &self.inputs {
                Inputs::Grid(grid) if l == 1 => Some(*grid),
                _ => None,
            };
            let db = total(&self.bands, |b| &b.db);
            let (on, dw) = match grid {
                None => (Cow::default(), total(&self.bands, |b| &b.dw)),
                Some(grid) => {
                    let on = total(&self.bands, |b| b.hinges.as_ref().map_or(&[], |h| &h.sums));
                    let Layer { a, b, c } = layer(&self.params[weights(0)], &self.params[bias(0)], &grid);
                    let mut dw = Vec::with_capacity(inputs * outputs);
                    for (((on, a), b), c) in on.chunks_exact(SUMS * outputs).zip(a).zip(b).zip(c) {
                        let (on, (u, v)) = (&on[..outputs], on[outputs..].split_at(outputs));
                        dw.extend(on.iter().zip(u).zip(v).map(|((on, u), v)| c * on + a * u + b * v));
                    }
                    (on, Cow::from(dw))
                }
            };
            let n = &self.norm[l - 1];
            let w = &self.params[weights(l)];
            let (mut p, mut q) = (vec![0.0; inputs], vec![0.0; inputs]);
            for j in 0..inputs {
                let row = j * outputs..(j + 1) * outputs;
                let (sum, product) = (dot(&w[row.clone()], &db), dot(&w[row.clone()], &dw[row.clone()]));
                let dg = n.inverse[j] * (product - n.mean[j] * sum);
                let curve = f64::from(n.scale[j]) * n.inverse[j] * dg / batch;
                p[j] = -curve;
                q[j] = curve * n.mean[j] - f64::from(n.scale[j]) * sum / batch;
                self.grads[OFFSETS[l - 1].g + j] = dg as f32;
                self.grads[OFFSETS[l - 1].s + j] = sum as f32;
                let (a, t) = (n.scale[j], n.offset[j]);
                for ((g, dw), db) in self.grads[weights(l)][row.clone()].iter_mut().zip(&dw[row]).zip(&*db) {
                    *g = a * dw + t * db;
                }
            }
            self.grads[bias(l)].copy_from_slice(&db);
            if let Some(grid) = grid {
                let mut grads = std::mem::take(&mut self.grads);
                self.backward_hinges(&grid, &on, [&p, &q], &mut grads);
                self.grads = grads;
                return Ok(());
            }
            let [p, q] = [p, q].map(|x| x.into_iter().map(|x| x as f32).collect::<Vec<_>>());
            let (folded, inputs) = (&self.folded, &self.inputs);
            self.bands.par_iter_mut().try_for_each(|band| band.backward(l, inputs, folded, [&p, &q], ctx))?;
        }
        let dw = total(&self.bands, |b| &b.dw);
        let db = total(&self.bands, |b| &b.db);
        self.grads[weights(0)].copy_from_slice(&dw);
        self.grads[bias(0)].copy_from_slice(&db);
        Ok(())
    }

    /// Gradients of the first layer on a grid. `on` are the sums of the next layer's gradients over the
    /// samples where each unit is on (see [`Hinges::sums`]); `p` and `q` are the factors of batch norm's
    /// gradient.
    fn backward_hinges(&self, grid: &Grid, on: &[f32], [p, q]: [&[f64]; 2], grads: &mut [f32]) {
        let [_, width] = FAN[1];
        let (w, scale) = (&self.params[weights(1)], &self.norm[0].scale);
        let Layer { a, b, c } = layer(&self.params[weights(0)], &self.params[bias(0)], grid);
        let [u, v] = grid.axes();
        for j in 0..FAN[0][1] {
            let [n, nu, nv, uu, uv, vv] = std::array::from_fn(|k| {
                self.bands.iter().flat_map(|b| &b.hinges).map(|h| h.moments[j][k]).sum::<f64>()
            });
            let [a, b, c] = [a[j], b[j], c[j]].map(f64::from);
            let w = &w[j * width..(j + 1) * width];
            // The sums of dr times 1, u and v.
            let summed = |k: usize, n: f64, r: f64| {
                f64::from(scale[j]) * dot(w, &on[(j * SUMS + k) * width..]) + p[j] * r + q[j] * n
            };
            let dc = summed(0, n, c * n + a * nu + b * nv);
            let da = summed(1, nu, c * nu + a * uu + b * uv);
            let db = summed(2, nv, c * nv + a * uv + b * vv);
            grads[OFFSETS[0].b + j] = dc as f32;
            grads[OFFSETS[0].w + u * FAN[0][1] + j] = da as f32;
            grads[OFFSETS[0].w + v * FAN[0][1] + j] = db as f32;
        }
    }

    /// One step of Adam with the gradients of the last [`Self::backward`].
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn step(&mut self, rate: f32, ctx: &Context<'_>) -> Result<()> {
        self.adam.step(&mut self.params, &self.grads, rate, ctx)
    }

    /// Outputs for any inputs, with batch norm's statistics of the last [`Self::forward`].
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn evaluate(&self, inputs: &[[f32; 3]], ctx: &Context<'_>) -> Result<Vec<Sample>> {
        let packed: Vec<Packed> = (self.folded.iter().zip(FAN))
            .map(|(folded, [_, width])| Packed::of(&folded.weights, width))
            .collect();
        let blocks = inputs
            .par_chunks(BLOCK)
            .map(|block| {
                ctx.check()?;
                let mut x: Vec<f32> = block.iter().flat_map(|&[u, v, w]| [u, v, w, 0.0]).collect();
                for (l, (folded, packed)) in self.folded.iter().zip(&packed).enumerate() {
                    let mut y = vec![0.0; block.len() * FAN[l][1]];
                    multiply(&x, packed, &mut Store { out: &mut y, bias: &folded.bias });
                    for y in &mut y {
                        *y = if l + 1 < LAYERS { y.max(0.0) } else { y.tanh() };
                    }
                    x = y;
                }
                Ok(x.chunks_exact(OUT).map(|y| [y[0], y[1], y[2]]).collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(blocks.concat())
    }

    /// Sets the output layer so that the network begins at about `wanted`, within (-1, 1), on the batch.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn aim(&mut self, wanted: &[Sample], ctx: &Context<'_>) -> Result<()> {
        const FEATURES: usize = FAN[LAYERS - 1][0];
        let mut out = vec![[0.0; 3]; wanted.len()];
        self.forward(&mut out, ctx)?;
        let norm = &self.norm[LAYERS - 2];
        let mut features = Vec::with_capacity(wanted.len() * FEATURES);
        for row in self.bands.iter().flat_map(|b| b.act[LAYERS - 2].chunks_exact(FEATURES)) {
            features.extend(row.iter().zip(&norm.scale).zip(&norm.offset).map(|((r, a), t)| a * r + t));
        }
        let layer = regress(&features, FEATURES, wanted, ctx)?;
        for (row, w) in self.params[weights(LAYERS - 1)].chunks_exact_mut(OUT).zip(&layer.weights) {
            row[..self.outputs].copy_from_slice(&w[..self.outputs]);
        }
        self.params[bias(LAYERS - 1)][..self.outputs].copy_from_slice(&layer.bias[..self.outputs]);
        Ok(())
    }

    fn fold(&mut self, l: usize) {
        let folded = &mut self.folded[l];
        let before = l.checked_sub(1).map(|l| &self.norm[l]);
        folded.fold(self.params[weights(l)].to_vec(), self.params[bias(l)].to_vec(), before);
        // On a grid the first two layers need no packed weights. Nothing flows back to the inputs.
        if l > 1 || matches!(self.inputs, Inputs::Scattered(_)) {
            folded.pack(l > 0);
        }
    }
}

/// Sums of the bands' partial sums, in order.
fn total<'a>(bands: &'a [Band], of: impl Fn(&'a Band) -> &'a [f32]) -> Cow<'a, [f32]> {
    let mut sums = bands.first().map_or(Cow::default(), |b| Cow::from(of(b)));
    for band in bands.iter().skip(1) {
        for (sum, x) in sums.to_mut().iter_mut().zip(of(band)) {
            *sum += x;
        }
    }
    sums
}

fn dot(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
}
