//! A fully connected network 256-128-64, ReLU then batch norm at each hidden layer, tanh at the end: forward, backward, Adam.
//!
//! In: up to three inputs per sample, gradients with respect to the outputs. Out: up to three outputs per sample; updated parameters.
//! Source: *Deep Manifold Prior*, section 5 ("Experimental setup").
//!
//! Nothing but the matrix products touches the activations, because batch norm folds away and the rest is done on their tiles. With r the
//! activations after ReLU, m and v their batch mean and variance, a = g / sqrt(v + eps) and t = s - a m, the next layer sees y = a r + t, so
//!   forward:   y W + b = r (a W) + (b + t W)                            (folded weights a W, on r itself)
//!   weights:   dW = y^T G = a (r^T G) + t (1^T G)
//!   batch norm, with D = G W^T the gradient with respect to y, over N samples:
//!              ds = 1^T D = W (1^T G),   sum D r = rows of W . (r^T G),   dg = (sum D r - m ds) / sqrt(v + eps)
//!              dr = a (D - ds / N - dg (r - m) / (sqrt(v + eps) N)) = G (a W)^T + p r + q
//! All sums that batch norm's gradient needs follow from r^T G and 1^T G, which the weights' gradient needs anyway.
//! On a regular grid the first layer and the product after it, nearly all of the work, cost next to nothing: see [`hinge`](super::hinge).

use super::adam::Adam;
use super::gemm::{Finish, PANEL, Packed, Store, add_outer, multiply, vectors, vectors_mut};
use super::hinge::{Grid, Hinges, Layer, SUMS};
use crate::loss::Sample;
use atlasfit::error::Result;
use atlasfit::numeric::rng::Rng;
use atlasfit::run::Context;
use pulp::Simd;
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

/// Layers: three hidden, one output.
const LAYERS: usize = 4;
/// Inputs, padded. Those that are not used are 0 and so stay their weights.
const IN: usize = 4;
/// Outputs, padded to a panel of the matrix kernels. The padding's weights stay 0.
const OUT: usize = PANEL;
/// Inputs and outputs of each layer.
const FAN: [[usize; 2]; LAYERS] = [[IN, 256], [256, 128], [128, 64], [64, OUT]];
/// Added to the variance (PyTorch's default).
pub const EPS: f64 = 1e-5;
/// Rows per matrix product: a block and the weights stay in the second cache. A fraction of a millisecond each, for the cancel.
const BLOCK: usize = 128;
/// Rows per task. Partial sums are kept per task and added in order, so this, not the number of threads, decides rounding.
const BAND: usize = 2048;

/// Where a layer's parameters lie: weights (inputs x outputs, row-major), bias, and for hidden layers batch norm's gain and shift.
#[derive(Clone, Copy)]
struct Place {
    w: usize,
    b: usize,
    g: usize,
    s: usize,
}

const fn places() -> ([Place; LAYERS], usize) {
    let mut out = [Place { w: 0, b: 0, g: 0, s: 0 }; LAYERS];
    let (mut at, mut l) = (0, 0);
    while l < LAYERS {
        let [i, o] = FAN[l];
        let hidden = if l + 1 < LAYERS { o } else { 0 };
        out[l] = Place { w: at, b: at + i * o, g: at + i * o + o, s: at + i * o + o + hidden };
        at += i * o + o + 2 * hidden;
        l += 1;
    }
    (out, at)
}
const PLACES: [Place; LAYERS] = places().0;
/// Parameters of a network, with padding.
const PARAMETERS: usize = places().1;

const fn weights(l: usize) -> Range<usize> {
    PLACES[l].w..PLACES[l].b
}
const fn bias(l: usize) -> Range<usize> {
    PLACES[l].b..PLACES[l].b + FAN[l][1]
}
const fn gain(l: usize) -> Range<usize> {
    PLACES[l].g..PLACES[l].s
}

/// Batch norm of a layer in the last forward pass: statistics, and the affine map y = scale r + offset they make.
#[derive(Clone, Default)]
struct Norm {
    mean: Vec<f64>,
    inverse: Vec<f64>,
    scale: Vec<f32>,
    offset: Vec<f32>,
}

/// A layer's weights and bias with the preceding batch norm folded in.
#[derive(Clone, Default)]
struct Folded {
    weights: Vec<f32>,
    forward: Packed,
    backward: Packed,
    bias: Vec<f32>,
}

/// Where the samples lie.
enum Inputs {
    /// Rows of IN.
    Scattered(Vec<f32>),
    Grid(Grid),
}

impl Inputs {
    /// Some values of scattered ones; of a grid none.
    fn scattered(&self, values: Range<usize>) -> &[f32] {
        match self {
            Self::Scattered(rows) => &rows[values],
            Self::Grid(_) => &[],
        }
    }
    fn rows(&self) -> usize {
        match self {
            Self::Scattered(rows) => rows.len() / IN,
            Self::Grid(grid) => grid.size[0] * grid.size[1],
        }
    }
}

/// Some rows of the batch with their activations.
struct Band {
    rows: Range<usize>,
    /// Of samples on a grid, whose first layer's activations are not made.
    hinges: Option<Hinges>,
    /// After ReLU; the backward pass replaces them by gradients before ReLU.
    act: [Vec<f32>; LAYERS - 1],
    /// Rows of OUT: outputs, then gradients before tanh.
    out: Vec<f32>,
    sum: Vec<f64>,
    square: Vec<f64>,
    dw: Vec<f32>,
    db: Vec<f32>,
    packed: Packed,
}

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
    /// A random network from `used` inputs to `outputs` outputs, each at most 3. Weights and biases are uniform within 1/sqrt(inputs), batch
    /// norm starts as gain 1 and shift 0.
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

    /// Sets the batch. Inputs that are not used must be 0.
    pub fn set_inputs(&mut self, inputs: impl Iterator<Item = [f32; 3]>) {
        self.inputs = Inputs::Scattered(inputs.flat_map(|[u, v, w]| [u, v, w, 0.0]).collect());
        self.set_bands(BAND, |_| None);
    }

    /// Sets the batch to a grid's samples: the inputs are those of [`Grid::place`].
    pub fn set_grid(&mut self, grid: Grid) {
        let before = std::mem::replace(&mut self.inputs, Inputs::Grid(grid));
        if matches!(before, Inputs::Grid(g) if g.size == grid.size) {
            for band in &mut self.bands {
                if let Some(hinges) = &mut band.hinges {
                    hinges.place(&grid, band.rows.start);
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
                let (n, hinges) = (rows.len(), hinges(rows.clone()));
                let first = if hinges.is_some() { 1 } else { 0 };
                Band {
                    rows,
                    hinges,
                    act: std::array::from_fn(|l| vec![0.0; if l < first { 0 } else { n * FAN[l][1] }]),
                    out: vec![0.0; n * OUT],
                    sum: Vec::new(),
                    square: Vec::new(),
                    dw: Vec::new(),
                    db: Vec::new(),
                    packed: Packed::default(),
                }
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
            let (folded, inputs) = (&self.folded[l], &self.inputs);
            self.bands.par_iter_mut().try_for_each(|band| match inputs {
                Inputs::Grid(grid) if l < 2 => band.forward_hinges(l, grid, folded, ctx),
                _ => band.forward(l, inputs, folded, ctx),
            })?;
            if l + 1 < LAYERS {
                self.normalise(l);
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
                self.grads[PLACES[l - 1].g + j] = dg as f32;
                self.grads[PLACES[l - 1].s + j] = sum as f32;
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
            let (folded, inputs) = (&self.folded[l], &self.inputs);
            self.bands.par_iter_mut().try_for_each(|band| band.backward(l, inputs, folded, [&p, &q], ctx))?;
        }
        let dw = total(&self.bands, |b| &b.dw);
        let db = total(&self.bands, |b| &b.db);
        self.grads[weights(0)].copy_from_slice(&dw);
        self.grads[bias(0)].copy_from_slice(&db);
        Ok(())
    }

    /// Gradients of the first layer on a grid, from the sums of the next one's where each unit is on.
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
            grads[PLACES[0].b + j] = dc as f32;
            grads[PLACES[0].w + u * FAN[0][1] + j] = da as f32;
            grads[PLACES[0].w + v * FAN[0][1] + j] = db as f32;
        }
    }

    /// One step of Adam with the gradients of the last [`Self::backward`].
    pub fn step(&mut self, rate: f32) {
        self.adam.step(&mut self.params, &self.grads, rate);
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

    fn normalise(&mut self, l: usize) {
        let batch = self.batch();
        let n = &mut self.norm[l];
        let width = FAN[l][1];
        n.mean.clear();
        n.inverse.clear();
        n.scale.clear();
        n.offset.clear();
        for j in 0..width {
            let total = |of: fn(&Band) -> &[f64]| self.bands.iter().map(|b| of(b)[j]).sum::<f64>();
            let mean = total(|b| &b.sum) / batch;
            let variance = (total(|b| &b.square) / batch - mean * mean).max(0.0);
            let inverse = 1.0 / (variance + EPS).sqrt();
            let scale = f64::from(self.params[PLACES[l].g + j]) * inverse;
            n.mean.push(mean);
            n.inverse.push(inverse);
            n.scale.push(scale as f32);
            n.offset.push((f64::from(self.params[PLACES[l].s + j]) - scale * mean) as f32);
        }
    }

    fn fold(&mut self, l: usize) {
        let mut w = self.params[weights(l)].to_vec();
        let mut b = self.params[bias(l)].to_vec();
        if l > 0 {
            let n = &self.norm[l - 1];
            for ((row, &a), &t) in w.chunks_exact_mut(FAN[l][1]).zip(&n.scale).zip(&n.offset) {
                for (w, b) in row.iter_mut().zip(&mut b) {
                    *b += t * *w;
                    *w *= a;
                }
            }
        }
        let folded = &mut self.folded[l];
        if l > 1 || matches!(self.inputs, Inputs::Scattered(_)) {
            folded.forward.set(&w, FAN[l][1]);
            // Nothing flows back to the inputs.
            if l > 0 {
                folded.backward.set_transposed(&w, FAN[l][1]);
            }
        }
        (folded.weights, folded.bias) = (w, b);
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

/// The first layer as a function of a grid's coordinates.
fn layer<'a>(weights: &'a [f32], bias: &'a [f32], grid: &Grid) -> Layer<'a> {
    let [a, b] = grid.axes().map(|k| &weights[k * bias.len()..(k + 1) * bias.len()]);
    Layer { a, b, c: bias }
}

/// Adds a block's f32 sums to the band's.
fn flush(total: &mut [f64], block: &mut [f32]) {
    for (t, b) in total.iter_mut().zip(block) {
        *t += f64::from(std::mem::take(b));
    }
}

/// Stores ReLU of a product plus bias; its values and their squares are added to the column sums.
struct Rectify<'a> {
    out: &'a mut [f32],
    bias: &'a [f32],
    sum: &'a mut [f32],
    square: &'a mut [f32],
}

impl Finish for Rectify<'_> {
    #[inline(always)]
    fn take<S: Simd, const V: usize>(&mut self, simd: S, row: usize, column: usize, tile: &[[S::f32s; V]]) {
        let width = self.bias.len();
        let bias = vectors::<S>(&self.bias[column..]);
        let sums = vectors_mut::<S>(&mut self.sum[column..]);
        let squares = vectors_mut::<S>(&mut self.square[column..]);
        let zero = simd.splat_f32s(0.0);
        for (i, values) in tile.iter().enumerate() {
            let out = vectors_mut::<S>(&mut self.out[(row + i) * width + column..]);
            for v in 0..V {
                let x = simd.max_f32s(simd.add_f32s(values[v], bias[v]), zero);
                out[v] = x;
                sums[v] = simd.add_f32s(sums[v], x);
                squares[v] = simd.mul_add_e_f32s(x, x, squares[v]);
            }
        }
    }
}

/// Replaces activations r by the gradient before ReLU, from a product that is part of the gradient after it, and batch norm's p and q. The
/// column sums are added to `sum`.
struct Pull<'a> {
    r: &'a mut [f32],
    p: &'a [f32],
    q: &'a [f32],
    sum: &'a mut [f32],
}

impl Finish for Pull<'_> {
    #[inline(always)]
    fn take<S: Simd, const V: usize>(&mut self, simd: S, row: usize, column: usize, tile: &[[S::f32s; V]]) {
        let width = self.p.len();
        let (p, q) = (vectors::<S>(&self.p[column..]), vectors::<S>(&self.q[column..]));
        let sums = vectors_mut::<S>(&mut self.sum[column..]);
        let zero = simd.splat_f32s(0.0);
        for (i, values) in tile.iter().enumerate() {
            let r = vectors_mut::<S>(&mut self.r[(row + i) * width + column..]);
            for v in 0..V {
                let g = simd.add_f32s(values[v], simd.mul_add_e_f32s(p[v], r[v], q[v]));
                r[v] = simd.select_f32s(simd.greater_than_f32s(r[v], zero), g, zero);
                sums[v] = simd.add_f32s(sums[v], r[v]);
            }
        }
    }
}

impl Band {
    /// Ranges of rows in blocks, relative to the band.
    fn blocks(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let n = self.rows.len();
        (0..n).step_by(BLOCK).map(move |from| from..(from + BLOCK).min(n))
    }

    /// The rows of a block in the whole batch's inputs.
    fn at(&self, block: &Range<usize>) -> Range<usize> {
        (self.rows.start + block.start) * IN..(self.rows.start + block.end) * IN
    }

    fn clear_sums(&mut self, width: usize) {
        for v in [&mut self.sum, &mut self.square] {
            v.clear();
            v.resize(width, 0.0);
        }
    }

    /// The first two layers on a grid.
    fn forward_hinges(&mut self, l: usize, grid: &Grid, folded: &Folded, ctx: &Context<'_>) -> Result<()> {
        ctx.check()?;
        self.clear_sums(FAN[l][1]);
        let Some(hinges) = &mut self.hinges else { return Ok(()) };
        if l == 0 {
            let layer = layer(&folded.weights, &folded.bias, grid);
            hinges.find(&layer);
            for (j, [n, u, v, uu, uv, vv]) in hinges.moments.iter().enumerate() {
                let [a, b, c] = [layer.a[j], layer.b[j], layer.c[j]].map(f64::from);
                self.sum[j] = c * n + a * u + b * v;
                self.square[j] = c * (self.sum[j] + a * u + b * v) + a * (a * uu + 2.0 * b * uv) + b * b * vv;
            }
        } else {
            hinges.forward(&folded.weights, &folded.bias, &mut self.act[l], |sum, square| {
                flush(&mut self.sum, sum);
                flush(&mut self.square, square);
            });
        }
        Ok(())
    }

    fn forward(&mut self, l: usize, inputs: &Inputs, folded: &Folded, ctx: &Context<'_>) -> Result<()> {
        let [depth, width] = FAN[l];
        self.clear_sums(width);
        let (mut sum, mut square) = (vec![0f32; width], vec![0f32; width]);
        for block in self.blocks() {
            ctx.check()?;
            let at = self.at(&block);
            let (lower, upper) = self.act.split_at_mut(l);
            let x = match lower.last() {
                Some(r) => &r[block.start * depth..block.end * depth],
                None => inputs.scattered(at),
            };
            let to = block.start * width..block.end * width;
            if let Some(upper) = upper.first_mut() {
                let out = &mut upper[to];
                let bias = &folded.bias;
                multiply(x, &folded.forward, &mut Rectify { out, bias, sum: &mut sum, square: &mut square });
                flush(&mut self.sum, &mut sum);
                flush(&mut self.square, &mut square);
                continue;
            }
            let out = &mut self.out[to];
            multiply(x, &folded.forward, &mut Store { out, bias: &folded.bias });
            for row in out.chunks_exact_mut(width) {
                for z in &mut row[..3] {
                    *z = z.tanh();
                }
            }
        }
        Ok(())
    }

    /// Gradient before tanh, and the output layer's partial sums.
    fn backward_output(&mut self, gradient: &[Sample], outputs: usize, ctx: &Context<'_>) -> Result<()> {
        const INPUTS: usize = FAN[LAYERS - 1][0];
        self.clear_gradient(INPUTS * OUT, OUT);
        for (y, g) in self.out.chunks_exact_mut(OUT).zip(&gradient[self.rows.clone()]) {
            for k in 0..3 {
                y[k] = if k < outputs { g[k] * (1.0 - y[k] * y[k]) } else { 0.0 };
                self.db[k] += y[k];
            }
        }
        for block in self.blocks() {
            ctx.check()?;
            let r = &self.act[LAYERS - 2][block.start * INPUTS..block.end * INPUTS];
            self.packed.set(&self.out[block.start * OUT..block.end * OUT], OUT);
            add_outer(&mut self.dw, r, INPUTS, &self.packed);
        }
        Ok(())
    }

    /// From the gradient before layer `l`'s nonlinearity to that of the layer below, with the latter's partial sums.
    fn backward(
        &mut self,
        l: usize,
        inputs: &Inputs,
        folded: &Folded,
        [p, q]: [&[f32]; 2],
        ctx: &Context<'_>,
    ) -> Result<()> {
        let [width, outputs] = FAN[l];
        let below = FAN[l - 1][0];
        // The sums that hinges give replace the gradient of the layer below.
        let on_grid = l == 2 && self.hinges.is_some();
        self.clear_gradient(if on_grid { 0 } else { below * width }, width);
        for block in self.blocks() {
            ctx.check()?;
            let at = self.at(&block);
            let (lower, upper) = self.act.split_at_mut(l);
            let (lowest, middle) = lower.split_at_mut(l - 1);
            let dz = &upper.first().unwrap_or(&self.out)[block.start * outputs..block.end * outputs];
            let r = &mut middle[0][block.start * width..block.end * width];
            multiply(dz, &folded.backward, &mut Pull { r, p, q, sum: &mut self.db });
            if on_grid {
                continue;
            }
            self.packed.set(r, width);
            let x = match lowest.last() {
                Some(x) => &x[block.start * below..block.end * below],
                None => inputs.scattered(at),
            };
            add_outer(&mut self.dw, x, below, &self.packed);
        }
        if let Some(hinges) = self.hinges.as_mut().filter(|_| on_grid) {
            hinges.pull(&self.act[1], width);
        }
        Ok(())
    }

    fn clear_gradient(&mut self, weights: usize, biases: usize) {
        self.dw.clear();
        self.dw.resize(weights, 0.0);
        self.db.clear();
        self.db.resize(biases, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use atlasfit::run::Run;

    const fn shift(l: usize) -> Range<usize> {
        PLACES[l].s..PLACES[l].s + FAN[l][1]
    }

    /// The network as the paper states it, in f64, without folding.
    fn plain(params: &[f64], inputs: &[[f32; 3]]) -> Vec<[f64; 3]> {
        let mut h: Vec<Vec<f64>> =
            inputs.iter().map(|x| x.iter().map(|&x| f64::from(x)).chain([0.0]).collect()).collect();
        let n = h.len();
        for l in 0..LAYERS {
            let [inputs, outputs] = FAN[l];
            let (w, b) = (&params[weights(l)], &params[bias(l)]);
            for row in &mut h {
                *row = (0..outputs)
                    .map(|k| b[k] + (0..inputs).map(|j| row[j] * w[j * outputs + k]).sum::<f64>())
                    .map(|z| if l + 1 < LAYERS { z.max(0.0) } else { z.tanh() })
                    .collect();
            }
            if l + 1 == LAYERS {
                break;
            }
            for k in 0..outputs {
                let mean = h.iter().map(|r| r[k]).sum::<f64>() / n as f64;
                let variance = h.iter().map(|r| (r[k] - mean).powi(2)).sum::<f64>() / n as f64;
                for r in &mut h {
                    r[k] = (r[k] - mean) / (variance + EPS).sqrt() * params[PLACES[l].g + k]
                        + params[PLACES[l].s + k];
                }
            }
        }
        h.iter().map(|r| [r[0], r[1], r[2]]).collect()
    }

    fn samples(net: &Dense) -> Vec<[f32; 3]> {
        match &net.inputs {
            Inputs::Scattered(rows) => rows.chunks_exact(IN).map(|x| [x[0], x[1], x[2]]).collect(),
            Inputs::Grid(grid) => (0..net.inputs.rows()).map(|i| grid.place(i)).collect(),
        }
    }

    /// What a case is about: samples (scattered, or lines of a grid), inputs, outputs.
    type Case = (Vec<usize>, usize, usize);

    /// A network away from its start (gains and shifts too), its outputs and its gradients for a random linear functional.
    fn case((batch, used, outputs): &Case) -> (Dense, Vec<Sample>, Vec<Sample>) {
        let mut rng = Rng::new(11);
        let (size, (used, outputs)) = (batch.clone(), (*used, *outputs));
        let batch = size.iter().product();
        let mut net = Dense::new(used, outputs, &mut rng);
        for l in 0..LAYERS - 1 {
            for i in gain(l).chain(shift(l)) {
                net.params[i] += 0.2 * rng.normal() as f32;
            }
        }
        let mut random = || [0; 3].map(|_| rng.normal() as f32);
        let functional: Vec<Sample> = (0..batch).map(|_| random()).collect();
        if let &[lines, side] = &size[..] {
            let step = [0.9 / lines as f32, 0.8 / side as f32];
            net.set_grid(Grid { size: [lines, side], first: [0.013, 0.027], step });
        } else {
            let inputs: Vec<[f32; 3]> = (0..batch)
                .map(|_| random())
                .map(|x| [0, 1, 2].map(|k| if k < used { x[k] } else { 0.0 }))
                .collect();
            net.set_inputs(inputs.into_iter());
        }
        let mut out = vec![[0.0; 3]; batch];
        let net = Run::default()
            .execute(|ctx| {
                net.forward(&mut out, ctx)?;
                net.backward(&functional, ctx)?;
                Ok(net)
            })
            .unwrap();
        (net, out, functional)
    }

    /// Batches of less than a block, of several with a last one that is not full, and of several bands; curves, surfaces, fields.
    fn cases() -> Vec<Case> {
        [
            (vec![42], 2, 3),
            (vec![30], 1, 2),
            (vec![306], 3, 1),
            (vec![6, 7], 2, 3),
            (vec![17, 18], 2, 3),
            (vec![1, 600], 1, 2),
            (vec![2304], 2, 3),
            (vec![43, 61], 2, 3),
            (vec![1, 4500], 1, 3),
        ]
        .to_vec()
    }

    #[test]
    fn the_folded_network_is_the_plain_one() {
        for shape in cases() {
            let (net, out, _) = case(&shape);
            let params: Vec<f64> = net.params.iter().map(|&x| f64::from(x)).collect();
            let inputs = samples(&net);
            let alone = Run::default().execute(|ctx| net.evaluate(&inputs, ctx)).unwrap();
            for ((a, b), c) in out.iter().zip(plain(&params, &inputs)).zip(alone) {
                for k in 0..3 {
                    assert!((f64::from(a[k]) - b[k]).abs() < 1e-4, "{shape:?} {a:?} {b:?}");
                    assert!((a[k] - c[k]).abs() < 1e-4);
                    assert!(k < shape.2 || a[k] == 0.0);
                }
            }
        }
    }

    #[test]
    fn gradients_are_finite_differences_of_the_plain_network() {
        for shape in &cases()[..6] {
            let (net, _, functional) = case(shape);
            let params: Vec<f64> = net.params.iter().map(|&x| f64::from(x)).collect();
            let value = |params: &[f64]| -> f64 {
                plain(params, &samples(&net))
                    .iter()
                    .zip(&functional)
                    .map(|(y, c)| (0..shape.2).map(|k| y[k] * f64::from(c[k])).sum::<f64>())
                    .sum()
            };
            let mut rng = Rng::new(2);
            let tensors = (0..LAYERS).flat_map(|l| {
                [weights(l), bias(l)]
                    .into_iter()
                    .chain((l + 1 < LAYERS).then(|| [gain(l), shift(l)]).into_iter().flatten())
            });
            for range in tensors {
                // A random direction of the whole tensor. Biases before ReLU and batch norm included.
                let direction: Vec<f64> = range.clone().map(|_| rng.normal()).collect();
                let at = |h: f64| {
                    let mut moved = params.clone();
                    for (x, d) in moved[range.clone()].iter_mut().zip(&direction) {
                        *x += h * d;
                    }
                    value(&moved)
                };
                let h = 1e-8; // no unit of ReLU may change sides
                let expected = (at(h) - at(-h)) / (2.0 * h);
                let got: f64 =
                    net.grads[range.clone()].iter().zip(&direction).map(|(g, d)| f64::from(*g) * d).sum();
                let size: f64 =
                    net.grads[range.clone()].iter().map(|g| f64::from(*g).powi(2)).sum::<f64>().sqrt();
                assert!(
                    (got - expected).abs() < 2e-3 * size + 1e-4,
                    "{shape:?} {range:?}: {got} {expected} {size}"
                );
            }
        }
    }

    #[test]
    fn padding_stays_zero_and_adam_goes_downhill() {
        let (mut net, _, functional) = case(&(vec![42], 1, 2));
        let value = |out: &[Sample]| -> f32 {
            out.iter().zip(&functional).flat_map(|(y, c)| (0..2).map(|k| y[k] * c[k])).sum()
        };
        let mut out = vec![[0.0; 3]; 42];
        let values: Vec<f32> = Run::default()
            .execute(|ctx| {
                (0..5)
                    .map(|_| {
                        net.forward(&mut out, ctx)?;
                        net.backward(&functional, ctx)?;
                        net.step(1e-3);
                        Ok(value(&out))
                    })
                    .collect()
            })
            .unwrap();
        assert!(values.windows(2).all(|v| v[1] < v[0]), "{values:?}");
        assert!(net.params[weights(LAYERS - 1)].chunks(OUT).all(|row| row[2..].iter().all(|x| *x == 0.0)));
        assert!(net.params[weights(0)][FAN[0][1]..].iter().all(|x| *x == 0.0));
    }
}
