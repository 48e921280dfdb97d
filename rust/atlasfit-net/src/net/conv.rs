//! The convolutional network of one chart. Fixed Gaussian noise of 4 x 4 x 512 goes through three blocks of
//! bilinear upsampling and a 3 x 3 convolution. The first two convolutions halve the channels and are
//! followed by batch norm and LeakyReLU 0.2; the last gives 3 channels and is followed by tanh.
//!
//! In: gradients with respect to the outputs. Out: positions on a grid of 32 x 32; updated parameters.
//! Source: *Deep Manifold Prior*, supplement A ("Convolutional Parametrizations") and A.1; tanh from section
//! 3.
//!
//! A convolution is one matrix product of pixels and all nine taps, x W with W of channels x (9 outputs); the
//! taps are then shifted and added, so that nothing is copied into columns. Biases before batch norm have no
//! effect and are left out.

mod view;

pub use view::BlockView;

use super::adam::Adam;
use super::dense::EPS;
use super::gemm::{PANEL, Packed, Store, TILE, add_outer_of, multiply_panels};
use super::ridge::regress;
use crate::sample::Sample;
use atlasfit::error::Result;
use atlasfit::numeric::rng::Rng;
use atlasfit::run::Context;

/// Side of the noise, in pixels (supplement A.1).
const NOISE_SIDE: usize = 4;
/// Channels of the noise (supplement A.1).
const CHANNELS: usize = 512;
/// Blocks of upsampling and convolution (supplement A.1).
const BLOCKS: usize = 3;
/// Channels at the end: x, y, z.
const OUT: usize = 3;
/// Taps of a 3 x 3 convolution (supplement A).
const TAPS: usize = 9;
/// Pixels per matrix product.
const ROWS: usize = 64;
/// Panels, and columns, of a product between two looks at the cancel flag: a millisecond or two of work.
const PANELS: usize = 16;
const COLUMNS: usize = 8 * TILE;
/// Slope of LeakyReLU for negative values (supplement A).
const LEAK: f32 = 0.2;
/// Lines and samples per line of the output: 32 each.
pub const GRID: [usize; 2] = [NOISE_SIDE << BLOCKS; 2];

/// One block: upsampling, convolution, and what follows it.
struct Block {
    /// Of the picture.
    side: usize,
    /// Before and after the convolution.
    channels: usize,
    outputs: usize,
    /// Columns of the weights: tap after tap, padded for the matrix kernels. The padding stays 0.
    width: usize,
    weights: Vec<f32>,
    d_weights: Vec<f32>,
    adam: Adam,
    /// Gains, then shifts, of batch norm; of the last block the bias.
    affine: Vec<f32>,
    d_affine: Vec<f32>,
    adam_affine: Adam,
    /// Pixels before the convolution.
    x: Vec<f32>,
    /// Batch norm's output before its gain and shift; in the last block unused.
    normalised: Vec<f32>,
    inverse: Vec<f32>,
    /// After the nonlinearity.
    y: Vec<f32>,
    taps: Vec<f32>,
}

/// A network with its training state.
pub struct Conv {
    blocks: Vec<Block>,
    packed: Packed,
}

impl Conv {
    /// A random network on random noise. Weights are uniform within 1/sqrt(9 channels) (PyTorch's default for
    /// convolutions); batch norm starts as gain 1 and shift 0.
    pub fn new(rng: &mut Rng) -> Self {
        Self::with_channels(CHANNELS, rng)
    }

    fn with_channels(most: usize, rng: &mut Rng) -> Self {
        let noise: Vec<f32> = (0..NOISE_SIDE * NOISE_SIDE * most).map(|_| rng.normal() as f32).collect();
        let mut blocks: Vec<Block> = (0..BLOCKS)
            .map(|l| {
                let (side, channels) = (NOISE_SIDE << (l + 1), most >> l);
                let outputs = if l + 1 < BLOCKS { channels / 2 } else { OUT };
                let (pixels, width) = (side * side, (TAPS * outputs).next_multiple_of(PANEL));
                let bound = 1.0 / f64::sqrt((TAPS * channels) as f64);
                let mut uniform = || ((2.0 * rng.uniform() - 1.0) * bound) as f32;
                let mut weights = vec![0.0; channels * width];
                for row in weights.chunks_exact_mut(width) {
                    row[..TAPS * outputs].fill_with(&mut uniform);
                }
                let affine: Vec<f32> = match l + 1 < BLOCKS {
                    true => [1.0, 0.0].iter().flat_map(|&x| vec![x; outputs]).collect(),
                    false => (0..OUT).map(|_| uniform()).collect(),
                };
                Block {
                    side,
                    channels,
                    outputs,
                    width,
                    d_weights: vec![0.0; weights.len()],
                    adam: Adam::new(weights.len()),
                    weights,
                    d_affine: vec![0.0; affine.len()],
                    adam_affine: Adam::new(affine.len()),
                    affine,
                    x: vec![0.0; pixels * channels],
                    normalised: vec![0.0; pixels * outputs],
                    inverse: vec![0.0; outputs],
                    y: vec![0.0; pixels * outputs],
                    taps: vec![0.0; pixels * width],
                }
            })
            .collect();
        upsample(&noise, NOISE_SIDE, most, &mut blocks[0].x);
        Self { blocks, packed: Packed::default() }
    }

    /// Positions of the whole grid, written to `out`.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn forward(&mut self, out: &mut [Sample], ctx: &Context<'_>) -> Result<()> {
        for l in 0..BLOCKS {
            let (done, rest) = self.blocks.split_at_mut(l);
            let block = &mut rest[0];
            if let Some(before) = done.last() {
                upsample(&before.y, before.side, block.channels, &mut block.x);
            }
            let (n, width) = (block.outputs, block.width);
            ctx.check()?;
            self.packed.set(&block.weights, width);
            ctx.check()?;
            let none = vec![0.0; width];
            let rows = ROWS * block.channels;
            for (x, taps) in block.x.chunks(rows).zip(block.taps.chunks_mut(ROWS * width)) {
                watched_product(x, &self.packed, &mut Store { out: taps, bias: &none }, ctx)?;
            }
            block.y.fill(0.0);
            shifted(block.side, |pixel, from, tap| {
                let taps = &block.taps[from * width + tap * n..][..n];
                for (y, t) in block.y[pixel * n..][..n].iter_mut().zip(taps) {
                    *y += t;
                }
            });
            if l + 1 < BLOCKS {
                block.normalise();
            }
        }
        let last = &mut self.blocks[BLOCKS - 1];
        for (y, o) in last.y.chunks_exact_mut(OUT).zip(out) {
            for k in 0..OUT {
                y[k] = (y[k] + last.affine[k]).tanh();
                o[k] = y[k];
            }
        }
        Ok(())
    }

    /// Gradients of all parameters from those of the positions that the last [`Self::forward`] gave.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn backward(&mut self, gradient: &[Sample], ctx: &Context<'_>) -> Result<()> {
        let last = &mut self.blocks[BLOCKS - 1];
        last.d_affine.fill(0.0);
        let mut d: Vec<f32> = vec![0.0; last.y.len()];
        for ((d, y), g) in d.chunks_exact_mut(OUT).zip(last.y.chunks_exact(OUT)).zip(gradient) {
            for k in 0..OUT {
                d[k] = g[k] * (1.0 - y[k] * y[k]);
                last.d_affine[k] += d[k];
            }
        }
        for l in (0..BLOCKS).rev() {
            let block = &mut self.blocks[l];
            if l + 1 < BLOCKS {
                block.denormalise(&mut d);
            }
            let (n, width) = (block.outputs, block.width);
            block.taps.fill(0.0);
            shifted(block.side, |pixel, from, tap| {
                block.taps[from * width + tap * n..][..n].copy_from_slice(&d[pixel * n..][..n]);
            });
            block.d_weights.fill(0.0);
            let rows = ROWS * block.channels;
            for (x, taps) in block.x.chunks(rows).zip(block.taps.chunks(ROWS * width)) {
                self.packed.set(taps, width);
                for from in (0..block.channels).step_by(COLUMNS) {
                    ctx.check()?;
                    let of = from..block.channels.min(from + COLUMNS);
                    add_outer_of(&mut block.d_weights, x, block.channels, of, &self.packed);
                }
            }
            if l == 0 {
                break; // the noise is fixed
            }
            ctx.check()?;
            self.packed.set_transposed(&block.weights, width);
            let none = vec![0.0; block.channels];
            let mut dx = vec![0.0; block.x.len()];
            for (dx, taps) in dx.chunks_mut(rows).zip(block.taps.chunks(ROWS * width)) {
                watched_product(taps, &self.packed, &mut Store { out: dx, bias: &none }, ctx)?;
            }
            d = downsample(&dx, block.side / 2, block.channels);
        }
        Ok(())
    }

    /// Sets the last block so that the network begins at about `wanted`, within (-1, 1): its middle tap alone
    /// looks at the picture, the others begin at 0.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn aim(&mut self, wanted: &[Sample], ctx: &Context<'_>) -> Result<()> {
        let mut out = vec![[0.0; 3]; wanted.len()];
        self.forward(&mut out, ctx)?;
        let last = &mut self.blocks[BLOCKS - 1];
        let layer = regress(&last.x, last.channels, wanted, ctx)?;
        last.weights.fill(0.0);
        for (row, w) in last.weights.chunks_exact_mut(last.width).zip(&layer.weights) {
            row[TAPS / 2 * OUT..][..OUT].copy_from_slice(w);
        }
        last.affine.copy_from_slice(&layer.bias);
        Ok(())
    }

    /// One step of Adam with the gradients of the last [`Self::backward`].
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn step(&mut self, rate: f32, ctx: &Context<'_>) -> Result<()> {
        for b in &mut self.blocks {
            b.adam.step(&mut b.weights, &b.d_weights, rate, ctx)?;
            b.adam_affine.step(&mut b.affine, &b.d_affine, rate, ctx)?;
        }
        Ok(())
    }
}

/// [`multiply`](super::gemm::multiply), with looks at the run.
fn watched_product(a: &[f32], b: &Packed, out: &mut Store<'_>, ctx: &Context<'_>) -> Result<()> {
    for from in (0..b.panels()).step_by(PANELS) {
        ctx.check()?;
        multiply_panels(a, b, from..b.panels().min(from + PANELS), out);
    }
    Ok(())
}

impl Block {
    /// Batch norm over the pixels and LeakyReLU of `y`, in place.
    fn normalise(&mut self) {
        let n = self.inverse.len();
        let pixels = (self.y.len() / n) as f64;
        let mean = column_sums(n, self.y.iter().map(|x| f64::from(*x))).into_iter().map(|s| s / pixels);
        let mean: Vec<f64> = mean.collect();
        let off = self.y.iter().enumerate().map(|(i, x)| (f64::from(*x) - mean[i % n]).powi(2));
        for (inverse, s) in self.inverse.iter_mut().zip(column_sums(n, off)) {
            *inverse = (1.0 / (s / pixels + EPS).sqrt()) as f32;
        }
        let (gain, shift) = self.affine.split_at(n);
        for (y, normalised) in self.y.chunks_exact_mut(n).zip(self.normalised.chunks_exact_mut(n)) {
            for j in 0..n {
                normalised[j] = (y[j] - mean[j] as f32) * self.inverse[j];
                let z = gain[j] * normalised[j] + shift[j];
                y[j] = if z > 0.0 { z } else { LEAK * z };
            }
        }
    }

    /// From the gradient after LeakyReLU to that before batch norm, in place.
    fn denormalise(&mut self, d: &mut [f32]) {
        let n = self.inverse.len();
        let pixels = (d.len() / n) as f64;
        for (d, y) in d.iter_mut().zip(&self.y) {
            // The sign of a leaky value is that of its argument.
            *d *= if *y > 0.0 { 1.0 } else { LEAK };
        }
        let shift = column_sums(n, d.iter().map(|x| f64::from(*x)));
        let gain = column_sums(n, d.iter().zip(&self.normalised).map(|(d, x)| f64::from(*d) * f64::from(*x)));
        for j in 0..n {
            self.d_affine[j] = gain[j] as f32;
            self.d_affine[n + j] = shift[j] as f32;
        }
        for (d, x) in d.chunks_exact_mut(n).zip(self.normalised.chunks_exact(n)) {
            for j in 0..n {
                let (mean, along) = ((shift[j] / pixels) as f32, (gain[j] / pixels) as f32);
                d[j] = self.affine[j] * self.inverse[j] * (d[j] - mean - along * x[j]);
            }
        }
    }
}

/// Sums of the `n` columns of row-major values.
fn column_sums(n: usize, values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sums = vec![0.0; n];
    for (i, x) in values.enumerate() {
        sums[i % n] += x;
    }
    sums
}

/// Calls `at(pixel, from, tap)` where tap `tap` of the convolution at `pixel` looks at pixel `from` of a
/// square picture.
fn shifted(side: usize, mut at: impl FnMut(usize, usize, usize)) {
    for i in 0..side {
        for j in 0..side {
            for tap in 0..TAPS {
                let (a, b) = ((i + tap / 3).wrapping_sub(1), (j + tap % 3).wrapping_sub(1));
                if a < side && b < side {
                    at(i * side + j, a * side + b, tap);
                }
            }
        }
    }
}

/// The two source lines of line `i` after upsampling, each with its weight (half-pixel centres, clamped at
/// the border).
fn sources(i: usize, side: usize) -> [(usize, f32); 2] {
    let near = i / 2;
    let far = if i.is_multiple_of(2) { near.saturating_sub(1) } else { (near + 1).min(side - 1) };
    [(near, 0.75), (far, 0.25)]
}

/// Twice the size, bilinear.
fn upsample(x: &[f32], side: usize, channels: usize, out: &mut [f32]) {
    out.fill(0.0);
    for (pixel, out) in out.chunks_exact_mut(channels).enumerate() {
        for (a, wa) in sources(pixel / (2 * side), side) {
            for (b, wb) in sources(pixel % (2 * side), side) {
                let w = wa * wb;
                for (o, x) in out.iter_mut().zip(&x[(a * side + b) * channels..]) {
                    *o += w * x;
                }
            }
        }
    }
}

/// The adjoint of [`upsample`]; `side` is that of the result.
fn downsample(d: &[f32], side: usize, channels: usize) -> Vec<f32> {
    let mut out = vec![0.0; side * side * channels];
    for (pixel, d) in d.chunks_exact(channels).enumerate() {
        for (a, wa) in sources(pixel / (2 * side), side) {
            for (b, wb) in sources(pixel % (2 * side), side) {
                let w = wa * wb;
                for (o, x) in out[(a * side + b) * channels..][..channels].iter_mut().zip(d) {
                    *o += w * x;
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use atlasfit::error::Error;
    use atlasfit::run::{CancelToken, Run};

    /// The network as the supplement states it, in f64, by the definition of each layer.
    fn plain(noise: &[f64], blocks: &[Block], parameters: &[[Vec<f64>; 2]]) -> Vec<f64> {
        let mut x = noise.to_vec();
        for (l, [weights, affine]) in parameters.iter().enumerate() {
            let Block { side: s, channels: c, outputs: n, width, .. } = blocks[l];
            let at = |i: isize, j: isize, k: usize| -> f64 {
                if i < 0 || j < 0 || i >= s as isize || j >= s as isize {
                    return 0.0;
                }
                // Bilinear at half-pixel centres of a picture of half the side.
                let place = |i: isize| ((i as f64 + 0.5) / 2.0 - 0.5).clamp(0.0, (s / 2 - 1) as f64);
                let ((u, v), half) = ((place(i), place(j)), s / 2);
                let (a, b) = (u.floor() as usize, v.floor() as usize);
                let get = |a: usize, b: usize| x[(a.min(half - 1) * half + b.min(half - 1)) * c + k];
                let (fu, fv) = (u - a as f64, v - b as f64);
                (1.0 - fu) * ((1.0 - fv) * get(a, b) + fv * get(a, b + 1))
                    + fu * ((1.0 - fv) * get(a + 1, b) + fv * get(a + 1, b + 1))
            };
            let up: Vec<f64> =
                (0..s * s * c).map(|i| at((i / c / s) as isize, (i / c % s) as isize, i % c)).collect();
            let mut y = vec![0.0; s * s * n];
            for (pixel, y) in y.chunks_exact_mut(n).enumerate() {
                for tap in 0..TAPS {
                    let (i, j) = (pixel / s + tap / 3, pixel % s + tap % 3);
                    if !(1..=s).contains(&i) || !(1..=s).contains(&j) {
                        continue;
                    }
                    let from = ((i - 1) * s + j - 1) * c;
                    for (k, row) in up[from..from + c].iter().zip(weights.chunks_exact(width)) {
                        for (y, w) in y.iter_mut().zip(&row[tap * n..]) {
                            *y += k * w;
                        }
                    }
                }
            }
            let pixels = (s * s) as f64;
            for k in 0..n {
                let column = || (k..y.len()).step_by(n);
                if l + 1 == BLOCKS {
                    for i in column().collect::<Vec<_>>() {
                        y[i] = (y[i] + affine[k]).tanh();
                    }
                    continue;
                }
                let mean = column().map(|i| y[i]).sum::<f64>() / pixels;
                let variance = column().map(|i| (y[i] - mean).powi(2)).sum::<f64>() / pixels;
                for i in column().collect::<Vec<_>>() {
                    let z = affine[k] * (y[i] - mean) / (variance + EPS).sqrt() + affine[n + k];
                    y[i] = if z > 0.0 { z } else { f64::from(LEAK) * z };
                }
            }
            x = y;
        }
        x
    }

    fn wide(x: &[f32]) -> Vec<f64> {
        x.iter().map(|&x| f64::from(x)).collect()
    }

    #[test]
    fn each_part_of_a_step_hears_a_cancel() {
        let mut net = Conv::with_channels(64, &mut Rng::new(3));
        let mut out = vec![[0.0; 3]; GRID[0] * GRID[1]];
        let gradient = out.clone();
        let token = CancelToken::new();
        let heard = Run { cancel: Some(token.clone()), ..Run::default() }.execute(|ctx| {
            token.cancel();
            let parts = [net.forward(&mut out, ctx), net.backward(&gradient, ctx), net.step(1e-3, ctx)];
            assert_eq!(parts, [const { Err(Error::Cancelled) }; 3]);
            Ok(())
        });
        assert_eq!(heard, Err(Error::Cancelled));
    }

    #[test]
    fn outputs_and_gradients_are_those_of_the_plain_network() {
        let mut rng = Rng::new(3);
        let mut net = Conv::with_channels(64, &mut rng.clone());
        // The noise is what the generator gives first.
        let noise: Vec<f64> = (0..16 * 64).map(|_| f64::from(rng.normal() as f32)).collect();
        for block in &mut net.blocks {
            for x in &mut block.affine {
                *x += 0.2 * rng.normal() as f32;
            }
        }
        let n = GRID[0] * GRID[1];
        let functional: Vec<Sample> = (0..n).map(|_| [0; 3].map(|_| rng.normal() as f32)).collect();
        let mut out = vec![[0.0; 3]; n];
        Run::default()
            .execute(|ctx| {
                net.forward(&mut out, ctx)?;
                net.backward(&functional, ctx)
            })
            .unwrap();
        let parameters: Vec<[Vec<f64>; 2]> =
            net.blocks.iter().map(|b| [wide(&b.weights), wide(&b.affine)]).collect();
        for (a, b) in out.iter().flatten().zip(plain(&noise, &net.blocks, &parameters)) {
            assert!((f64::from(*a) - b).abs() < 1e-4, "{a} {b}");
        }
        let value = |parameters: &[[Vec<f64>; 2]]| -> f64 {
            plain(&noise, &net.blocks, parameters)
                .iter()
                .zip(functional.iter().flatten())
                .map(|(y, c)| y * f64::from(*c))
                .sum()
        };
        for (l, block) in net.blocks.iter().enumerate() {
            for (which, grads) in [&block.d_weights, &block.d_affine].into_iter().enumerate() {
                // A random direction of the whole tensor, its padding left out.
                let used = |i: usize| which == 1 || i % block.width < TAPS * block.outputs;
                let direction: Vec<f64> =
                    (0..grads.len()).map(|i| if used(i) { rng.normal() } else { 0.0 }).collect();
                let at = |h: f64| {
                    let mut moved = parameters.clone();
                    for (x, d) in moved[l][which].iter_mut().zip(&direction) {
                        *x += h * d;
                    }
                    value(&moved)
                };
                let h = 1e-6;
                let expected = (at(h) - at(-h)) / (2.0 * h);
                let got: f64 = grads.iter().zip(&direction).map(|(g, d)| f64::from(*g) * d).sum();
                let size: f64 = grads.iter().map(|g| f64::from(*g).powi(2)).sum::<f64>().sqrt();
                assert!((got - expected).abs() < 2e-3 * size + 1e-4, "{l} {which}: {got} {expected} {size}");
            }
        }
    }
}
