//! The network of one chart: 2-256-128-64-3, ReLU then batch norm at each hidden layer, tanh at the end; forward, backward, Adam.
//!
//! In: the regular grid of inputs, gradients with respect to the outputs. Out: positions; updated parameters.
//!
//! Only two passes per layer touch the activations outside the matrix products, because batch norm folds away. With r the activations
//! after ReLU, m and v their batch mean and variance, a = g / sqrt(v + eps) and t = s - a m, the next layer sees y = a r + t, so
//!   forward:   y W + b = r (a W) + (b + t W)                            (folded weights a W, on r itself)
//!   weights:   dW = y^T G = a (r^T G) + t (1^T G)
//!   batch norm, with D = G W^T the gradient with respect to y, over N samples:
//!              ds = 1^T D = W (1^T G),   sum D r = rows of W . (r^T G),   dg = (sum D r - m ds) / sqrt(v + eps)
//!              dr = a (D - ds / N - dg (r - m) / (sqrt(v + eps) N)) = G (a W)^T + p r + q
//! All sums that batch norm's gradient needs follow from r^T G and 1^T G, which the weights' gradient needs anyway.

use super::gemm::{Mat, gemm};
use crate::error::Result;
use crate::loss::Sample;
use crate::rng::Rng;
use crate::run::Context;
use rayon::prelude::*;
use std::ops::Range;

/// Layers: three hidden, one output.
const LAYERS: usize = 4;
/// Width of the output after padding 3 to the width of the matrix kernels. The padding's weights stay 0.
const OUT: usize = 8;
/// Inputs and outputs of each layer. A contour uses the second input alone.
const FAN: [[usize; 2]; LAYERS] = [[2, 256], [256, 128], [128, 64], [64, OUT]];
/// Added to the variance (PyTorch's default).
const EPS: f64 = 1e-5;
/// Rows per matrix product: enough that packing the weights costs little, few enough for the cache and for a cancel (a millisecond each).
const BLOCK: usize = 512;
/// Rows per task. Partial sums are kept per task and added in order, so this, not the number of threads, decides rounding.
const BAND: usize = 2048;
/// Adam's decay rates and guard against division by zero (Kingma and Ba 2015).
const BETA: [f32; 2] = [0.9, 0.999];
const ADAM_EPS: f32 = 1e-8;

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
/// Parameters of a chart, with padding.
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

/// Some rows of a chart's batch with their activations.
struct Band {
    rows: Range<usize>,
    /// After ReLU; the backward pass replaces the upper two by gradients before ReLU.
    act: [Vec<f32>; LAYERS - 1],
    /// Rows of OUT: positions, then gradients before tanh.
    out: Vec<f32>,
    sum: Vec<f64>,
    square: Vec<f64>,
    dw: Vec<f32>,
    db: Vec<f32>,
    scratch: Vec<f32>,
}

/// The network of one chart with its training state.
pub struct Net {
    grid: [usize; 2],
    params: Vec<f32>,
    grads: Vec<f32>,
    first: Vec<f32>,
    second: Vec<f32>,
    steps: i32,
    norm: [Norm; LAYERS - 1],
    /// Weights and biases with the preceding batch norm folded in (the first layer's are the parameters).
    folded: [(Vec<f32>, Vec<f32>); LAYERS],
    bands: Vec<Band>,
}

impl Net {
    /// A random network for a batch on a regular grid of `grid[0]` lines of `grid[1]` samples over the unit square; a contour is one
    /// line. Weights and biases are uniform within 1/sqrt(inputs), batch norm starts as gain 1 and shift 0.
    pub fn new(grid: [usize; 2], rng: &mut Rng) -> Self {
        let mut params = vec![0.0; PARAMETERS];
        for (l, &[inputs, outputs]) in FAN.iter().enumerate() {
            let lines = grid[0] > 1;
            let bound = 1.0 / f64::sqrt(if l == 0 && !lines { 1.0 } else { inputs as f64 });
            let mut fill = |values: &mut [f32]| {
                for row in values.chunks_exact_mut(outputs) {
                    for x in &mut row[..if l + 1 < LAYERS { outputs } else { 3 }] {
                        *x = ((2.0 * rng.uniform() - 1.0) * bound) as f32;
                    }
                }
            };
            fill(&mut params[weights(l)]);
            fill(&mut params[bias(l)]);
            if l + 1 < LAYERS {
                params[gain(l)].fill(1.0);
            }
        }
        let batch = grid[0] * grid[1];
        let bands = (0..batch)
            .step_by(BAND)
            .map(|from| {
                let rows = from..(from + BAND).min(batch);
                let n = rows.len();
                Band {
                    rows,
                    act: std::array::from_fn(|l| vec![0.0; n * FAN[l][1]]),
                    out: vec![0.0; n * OUT],
                    sum: Vec::new(),
                    square: Vec::new(),
                    dw: Vec::new(),
                    db: Vec::new(),
                    scratch: vec![0.0; BLOCK * FAN[0][1]],
                }
            })
            .collect();
        Self {
            grid,
            grads: vec![0.0; PARAMETERS],
            first: vec![0.0; PARAMETERS],
            second: vec![0.0; PARAMETERS],
            params,
            steps: 0,
            norm: Default::default(),
            folded: std::array::from_fn(|l| (vec![0.0; FAN[l][0] * FAN[l][1]], vec![0.0; FAN[l][1]])),
            bands,
        }
    }

    /// Positions of the whole grid, written to `out`.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn forward(&mut self, out: &mut [Sample], ctx: &Context<'_>) -> Result<()> {
        self.fold(0);
        for l in 0..LAYERS {
            let (w, b) = &self.folded[l];
            let grid = self.grid;
            self.bands.par_iter_mut().try_for_each(|band| match l {
                0 => band.forward_input(grid, w, b, ctx),
                _ => band.forward(l, w, b, ctx),
            })?;
            if l + 1 < LAYERS {
                self.normalise(l);
                self.fold(l + 1);
            }
        }
        for band in &self.bands {
            for (o, y) in out[band.rows.clone()].iter_mut().zip(band.out.chunks_exact(OUT)) {
                o.copy_from_slice(&y[..3]);
            }
        }
        Ok(())
    }

    /// Gradients of all parameters from those of the positions that the last [`Self::forward`] gave.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn backward(&mut self, gradient: &[Sample], ctx: &Context<'_>) -> Result<()> {
        self.bands.par_iter_mut().try_for_each(|band| band.backward_output(gradient, ctx))?;
        let batch = (self.grid[0] * self.grid[1]) as f64;
        for l in (1..LAYERS).rev() {
            let [inputs, outputs] = FAN[l];
            let (dw, db) = reduce(&self.bands, inputs * outputs, outputs);
            let n = &self.norm[l - 1];
            let w = &self.params[weights(l)];
            let (mut p, mut q) = (vec![0.0; inputs], vec![0.0; inputs]);
            for j in 0..inputs {
                let row = j * outputs..(j + 1) * outputs;
                let (mut sum, mut product) = (0.0, 0.0);
                for ((w, dw), db) in w[row.clone()].iter().zip(&dw[row.clone()]).zip(&db) {
                    sum += f64::from(*w) * f64::from(*db);
                    product += f64::from(*w) * f64::from(*dw);
                }
                let dg = n.inverse[j] * (product - n.mean[j] * sum);
                let curve = f64::from(n.scale[j]) * n.inverse[j] * dg / batch;
                p[j] = (-curve) as f32;
                q[j] = (curve * n.mean[j] - f64::from(n.scale[j]) * sum / batch) as f32;
                self.grads[PLACES[l - 1].g + j] = dg as f32;
                self.grads[PLACES[l - 1].s + j] = sum as f32;
                let (a, t) = (n.scale[j], n.offset[j]);
                for ((g, dw), db) in self.grads[weights(l)][row.clone()].iter_mut().zip(&dw[row]).zip(&db) {
                    *g = a * dw + t * db;
                }
            }
            self.grads[bias(l)].copy_from_slice(&db);
            let (w, grid) = (&self.folded[l].0, self.grid);
            self.bands.par_iter_mut().try_for_each(|band| band.backward(l, w, &p, &q, grid, ctx))?;
        }
        let (dw, db) = reduce(&self.bands, FAN[0][0] * FAN[0][1], FAN[0][1]);
        self.grads[weights(0)].copy_from_slice(&dw);
        self.grads[bias(0)].copy_from_slice(&db);
        Ok(())
    }

    /// One step of Adam with the gradients of the last [`Self::backward`].
    pub fn adam(&mut self, rate: f32) {
        self.steps += 1;
        let correct = BETA.map(|b| 1.0 / (1.0 - f64::from(b).powi(self.steps)));
        let (step, second) = (rate * correct[0] as f32, correct[1].sqrt() as f32);
        for (((x, g), m), v) in
            self.params.iter_mut().zip(&self.grads).zip(&mut self.first).zip(&mut self.second)
        {
            *m = BETA[0] * *m + (1.0 - BETA[0]) * g;
            *v = BETA[1] * *v + (1.0 - BETA[1]) * g * g;
            *x -= step * *m / (v.sqrt() * second + ADAM_EPS);
        }
    }

    /// The position at (u, v) in the unit square, with batch norm's statistics of the last [`Self::forward`].
    pub fn evaluate(&self, uv: [f32; 2]) -> Sample {
        let mut x = uv.to_vec();
        for (l, (w, b)) in self.folded.iter().enumerate() {
            let mut y = b.clone();
            for (x, w) in x.iter().zip(w.chunks_exact(FAN[l][1])) {
                for (y, w) in y.iter_mut().zip(w) {
                    *y += x * w;
                }
            }
            for y in &mut y {
                *y = if l + 1 < LAYERS { y.max(0.0) } else { y.tanh() };
            }
            x = y;
        }
        [x[0], x[1], x[2]]
    }

    fn normalise(&mut self, l: usize) {
        let batch = (self.grid[0] * self.grid[1]) as f64;
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
        let (w, b) = &mut self.folded[l];
        w.copy_from_slice(&self.params[weights(l)]);
        b.copy_from_slice(&self.params[bias(l)]);
        if l == 0 {
            return;
        }
        let n = &self.norm[l - 1];
        for ((row, &a), &t) in w.chunks_exact_mut(FAN[l][1]).zip(&n.scale).zip(&n.offset) {
            for (w, b) in row.iter_mut().zip(&mut *b) {
                *b += t * *w;
                *w *= a;
            }
        }
    }
}

/// Sums of the bands' partial gradients, in order.
fn reduce(bands: &[Band], weights: usize, biases: usize) -> (Vec<f32>, Vec<f32>) {
    let (mut dw, mut db) = (vec![0.0; weights], vec![0.0; biases]);
    for band in bands {
        for (sum, x) in dw.iter_mut().zip(&band.dw) {
            *sum += x;
        }
        for (sum, x) in db.iter_mut().zip(&band.db) {
            *sum += x;
        }
    }
    (dw, db)
}

/// Adds a block's f32 sums to the band's.
fn flush(total: &mut [f64], block: &mut [f32]) {
    for (t, b) in total.iter_mut().zip(block) {
        *t += f64::from(std::mem::take(b));
    }
}

impl Band {
    /// Ranges of rows in blocks, relative to the band.
    fn blocks(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let n = self.rows.len();
        (0..n).step_by(BLOCK).map(move |from| from..(from + BLOCK).min(n))
    }

    fn clear(&mut self, width: usize) {
        for v in [&mut self.sum, &mut self.square] {
            v.clear();
            v.resize(width, 0.0);
        }
    }

    fn forward_input(&mut self, grid: [usize; 2], w: &[f32], b: &[f32], ctx: &Context<'_>) -> Result<()> {
        const WIDTH: usize = FAN[0][1];
        self.clear(WIDTH);
        let (wu, wv) = w.split_at(WIDTH);
        let (mut s, mut q) = ([0f32; WIDTH], [0f32; WIDTH]);
        let mut base = [0f32; WIDTH];
        for block in self.blocks() {
            ctx.check()?;
            let act = &mut self.act[0][block.start * WIDTH..block.end * WIDTH];
            for (i, row) in (self.rows.start + block.start..).zip(act.chunks_exact_mut(WIDTH)) {
                let [u, v] = place(grid, i);
                if i % grid[1] == 0 || i == self.rows.start + block.start {
                    for ((base, wu), b) in base.iter_mut().zip(wu).zip(b) {
                        *base = b + u * wu;
                    }
                }
                for ((r, base), wv) in row.iter_mut().zip(&base).zip(wv) {
                    *r = base + v * wv;
                }
                rectify(row, &mut s, &mut q);
            }
            flush(&mut self.sum, &mut s);
            flush(&mut self.square, &mut q);
        }
        Ok(())
    }

    fn forward(&mut self, l: usize, w: &[f32], b: &[f32], ctx: &Context<'_>) -> Result<()> {
        let [inputs, width] = FAN[l];
        self.clear(width);
        let (mut s, mut q) = (vec![0f32; width], vec![0f32; width]);
        for block in self.blocks() {
            ctx.check()?;
            let (lower, upper) = self.act.split_at_mut(l);
            let r = &lower[l - 1][block.start * inputs..block.end * inputs];
            let z = &mut upper.first_mut().unwrap_or(&mut self.out)[block.start * width..block.end * width];
            gemm(z, Mat::new(r, inputs), Mat::new(w, width), false);
            for row in z.chunks_exact_mut(width) {
                if l + 1 < LAYERS {
                    for (z, b) in row.iter_mut().zip(b) {
                        *z += b;
                    }
                    rectify(row, &mut s, &mut q);
                } else {
                    for (z, b) in row[..3].iter_mut().zip(b) {
                        *z = (*z + b).tanh();
                    }
                }
            }
            flush(&mut self.sum, &mut s);
            flush(&mut self.square, &mut q);
        }
        Ok(())
    }

    /// Gradient before tanh, and the output layer's partial sums.
    fn backward_output(&mut self, gradient: &[Sample], ctx: &Context<'_>) -> Result<()> {
        const INPUTS: usize = FAN[LAYERS - 1][0];
        self.clear_gradient(INPUTS * OUT, OUT);
        for (y, g) in self.out.chunks_exact_mut(OUT).zip(&gradient[self.rows.clone()]) {
            for k in 0..3 {
                y[k] = g[k] * (1.0 - y[k] * y[k]);
                self.db[k] += y[k];
            }
        }
        for block in self.blocks() {
            ctx.check()?;
            let r = &self.act[LAYERS - 2][block.start * INPUTS..block.end * INPUTS];
            let dz = &self.out[block.start * OUT..block.end * OUT];
            gemm(&mut self.dw, Mat::new(r, INPUTS).t(), Mat::new(dz, OUT), true);
        }
        Ok(())
    }

    /// From the gradient before layer `l`'s nonlinearity to that of the layer below, with the latter's partial sums.
    fn backward(
        &mut self,
        l: usize,
        w: &[f32],
        p: &[f32],
        q: &[f32],
        grid: [usize; 2],
        ctx: &Context<'_>,
    ) -> Result<()> {
        let [width, outputs] = FAN[l];
        let below = FAN[l - 1][0];
        self.clear_gradient(below * width, width);
        let (mut line, mut along) = (vec![0f32; width], vec![0f32; width]);
        for block in self.blocks() {
            ctx.check()?;
            let (lower, upper) = self.act.split_at_mut(l);
            let (lowest, middle) = lower.split_at_mut(l - 1);
            let dz = &upper.first().unwrap_or(&self.out)[block.start * outputs..block.end * outputs];
            let r = &mut middle[0][block.start * width..block.end * width];
            let d = &mut self.scratch[..r.len()];
            gemm(d, Mat::new(dz, outputs), Mat::new(w, outputs).t(), false);
            if l > 1 {
                for (r, d) in r.chunks_exact_mut(width).zip(d.chunks_exact(width)) {
                    normalised_gradient(r, d, p, q);
                    accumulate(&mut self.db, r, 1.0);
                }
                let x = &lowest[l - 2][block.start * below..block.end * below];
                gemm(&mut self.dw, Mat::new(x, below).t(), Mat::new(r, width), true);
                continue;
            }
            // The inputs of the first layer are the grid's: sums along each line first, u once per line.
            let mut from = self.rows.start + block.start;
            for (i, (r, d)) in (from..).zip(r.chunks_exact_mut(width).zip(d.chunks_exact(width))) {
                let v = place(grid, i)[1];
                normalised_gradient(r, d, p, q);
                accumulate(&mut line, r, 1.0);
                accumulate(&mut along, r, v);
                if (i + 1) % grid[1] == 0 || i + 1 == self.rows.start + block.end {
                    let u = place(grid, from)[0];
                    let (du, dv) = self.dw.split_at_mut(width);
                    for j in 0..width {
                        du[j] += u * line[j];
                        dv[j] += along[j];
                        self.db[j] += line[j];
                    }
                    line.fill(0.0);
                    along.fill(0.0);
                    from = i + 1;
                }
            }
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

/// ReLU in place; its values and their squares are added to the column sums.
fn rectify(row: &mut [f32], sum: &mut [f32], square: &mut [f32]) {
    for ((z, s), q) in row.iter_mut().zip(sum).zip(square) {
        let x = z.max(0.0);
        *z = x;
        *s += x;
        *q += x * x;
    }
}

/// Replaces activations `r` by the gradient before ReLU, from `d`, the product part of the gradient after it, and batch norm's p and q.
fn normalised_gradient(r: &mut [f32], d: &[f32], p: &[f32], q: &[f32]) {
    for (((r, d), p), q) in r.iter_mut().zip(d).zip(p).zip(q) {
        let g = d + p * *r + q;
        *r = if *r > 0.0 { g } else { 0.0 };
    }
}

/// sum += factor * row.
fn accumulate(sum: &mut [f32], row: &[f32], factor: f32) {
    for (s, x) in sum.iter_mut().zip(row) {
        *s += factor * x;
    }
}

/// Where sample `i` of a grid lies in the unit square. A line alone lies at u = 0.
pub fn place(grid: [usize; 2], i: usize) -> [f32; 2] {
    let at = |k: usize, n: usize| k as f32 / n.saturating_sub(1).max(1) as f32;
    [at(i / grid[1], grid[0]), at(i % grid[1], grid[1])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    const fn shift(l: usize) -> Range<usize> {
        PLACES[l].s..PLACES[l].s + FAN[l][1]
    }

    /// The network as the paper states it, in f64, without folding.
    fn plain(params: &[f64], grid: [usize; 2]) -> Vec<[f64; 3]> {
        let n = grid[0] * grid[1];
        let mut h: Vec<Vec<f64>> = (0..n).map(|i| place(grid, i).map(f64::from).to_vec()).collect();
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

    /// A network away from its start (gains and shifts too), its outputs and its gradients for a random linear functional.
    fn case(grid: [usize; 2]) -> (Net, Vec<Sample>, Vec<Sample>) {
        let mut rng = Rng::new(11);
        let mut net = Net::new(grid, &mut rng);
        for l in 0..LAYERS - 1 {
            for i in gain(l).chain(shift(l)) {
                net.params[i] += 0.2 * rng.normal() as f32;
            }
        }
        let n = grid[0] * grid[1];
        let functional: Vec<Sample> = (0..n).map(|_| [0; 3].map(|_| rng.normal() as f32)).collect();
        let mut out = vec![[0.0; 3]; n];
        let net = Run::default()
            .execute(|ctx| {
                net.forward(&mut out, ctx)?;
                net.backward(&functional, ctx)?;
                Ok(net)
            })
            .unwrap();
        (net, out, functional)
    }

    #[test]
    fn the_folded_network_is_the_plain_one() {
        for grid in [[6, 7], [1, 30], [48, 48]] {
            let (net, out, _) = case(grid);
            let params: Vec<f64> = net.params.iter().map(|&x| f64::from(x)).collect();
            for (i, (a, b)) in out.iter().zip(plain(&params, grid)).enumerate() {
                let alone = net.evaluate(place(grid, i));
                for k in 0..3 {
                    assert!((f64::from(a[k]) - b[k]).abs() < 1e-4, "{grid:?} {a:?} {b:?}");
                    assert!((a[k] - alone[k]).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn gradients_are_finite_differences_of_the_plain_network() {
        // More rows than a block, and a last block that is not full.
        for grid in [[6, 7], [1, 30], [17, 18]] {
            let (net, _, functional) = case(grid);
            let params: Vec<f64> = net.params.iter().map(|&x| f64::from(x)).collect();
            let value = |params: &[f64]| -> f64 {
                plain(params, grid)
                    .iter()
                    .zip(&functional)
                    .map(|(y, c)| (0..3).map(|k| y[k] * f64::from(c[k])).sum::<f64>())
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
                let h = 1e-6;
                let expected = (at(h) - at(-h)) / (2.0 * h);
                let got: f64 =
                    net.grads[range.clone()].iter().zip(&direction).map(|(g, d)| f64::from(*g) * d).sum();
                let size: f64 =
                    net.grads[range.clone()].iter().map(|g| f64::from(*g).powi(2)).sum::<f64>().sqrt();
                assert!(
                    (got - expected).abs() < 2e-3 * size + 1e-4,
                    "{grid:?} {range:?}: {got} {expected} {size}"
                );
            }
        }
    }

    #[test]
    fn padding_stays_zero_and_adam_goes_downhill() {
        let (mut net, _, functional) = case([6, 7]);
        let value = |out: &[Sample]| -> f32 {
            out.iter().zip(&functional).flat_map(|(y, c)| (0..3).map(|k| y[k] * c[k])).sum()
        };
        let mut out = vec![[0.0; 3]; 42];
        let values: Vec<f32> = Run::default()
            .execute(|ctx| {
                (0..5)
                    .map(|_| {
                        net.forward(&mut out, ctx)?;
                        net.backward(&functional, ctx)?;
                        net.adam(1e-3);
                        Ok(value(&out))
                    })
                    .collect()
            })
            .unwrap();
        assert!(values.windows(2).all(|v| v[1] < v[0]), "{values:?}");
        assert!(net.params[weights(LAYERS - 1)].chunks(OUT).all(|row| row[3..].iter().all(|x| *x == 0.0)));
    }
}
