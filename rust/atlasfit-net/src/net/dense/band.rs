//! A band of the batch: some consecutive samples with their activations and partial sums.
//!
//! In: folded weights of a layer. Out: the layer's activations, or gradients, and sums over the band's
//! samples. Bands are worked on in parallel; their sums are added in order, so that results do not depend on
//! the number of threads.

use super::layers::{FAN, IN, LAYERS, OUT};
use super::tiles::{Pull, Rectify, flush};
use crate::net::gemm::{Packed, Store, add_outer, multiply};
use crate::net::hinge::{Grid, Hinges, Layer};
use crate::sample::Sample;
use atlasfit::error::Result;
use atlasfit::run::Context;
use std::ops::Range;

/// Rows per matrix product. A block and the weights fit the second cache; a product takes a fraction of a
/// millisecond, so that a cancel takes effect at once.
pub const BLOCK: usize = 128;

/// A layer's weights and bias with the preceding batch norm folded in.
#[derive(Clone, Default)]
pub struct Folded {
    /// Inputs x outputs, row-major.
    pub weights: Vec<f32>,
    /// The weights, packed.
    pub forward: Packed,
    /// Their transpose, packed.
    pub backward: Packed,
    /// One per output.
    pub bias: Vec<f32>,
}

/// The inputs of the batch.
pub enum Inputs {
    /// Rows of [`IN`] numbers.
    Scattered(Vec<f32>),
    /// The points of a grid.
    Grid(Grid),
}

impl Inputs {
    /// A range of the numbers of scattered inputs; empty for a grid.
    fn scattered(&self, values: Range<usize>) -> &[f32] {
        match self {
            Self::Scattered(rows) => &rows[values],
            Self::Grid(_) => &[],
        }
    }
    /// Number of samples.
    pub fn rows(&self) -> usize {
        match self {
            Self::Scattered(rows) => rows.len() / IN,
            Self::Grid(grid) => grid.size[0] * grid.size[1],
        }
    }
}

/// Consecutive samples of the batch with their activations.
pub struct Band {
    /// The samples, in the batch.
    pub rows: Range<usize>,
    /// For samples on a grid, whose first layer's activations are never made.
    pub hinges: Option<Hinges>,
    /// Activations after ReLU. The backward pass replaces them by gradients before ReLU. Those of the first
    /// layer are never kept.
    pub act: [Vec<f32>; LAYERS - 1],
    /// The first layer's activations of one block of scattered inputs.
    first: First,
    /// Rows of [`OUT`]: outputs, then gradients before tanh.
    pub out: Vec<f32>,
    /// Column sums of a layer's activations.
    pub sum: Vec<f64>,
    /// Column sums of their squares.
    pub square: Vec<f64>,
    /// Gradient of a layer's weights before folding: r^T G.
    pub dw: Vec<f32>,
    /// Gradient of a layer's bias: 1^T G.
    pub db: Vec<f32>,
    packed: Packed,
}

/// The first layer's activations of one block, made from its inputs each time they are needed: those of all
/// blocks would take more memory than those of all other layers.
#[derive(Default)]
struct First {
    act: Vec<f32>,
    sum: Vec<f32>,
    square: Vec<f32>,
}

impl First {
    /// Makes the activations of the inputs `x`, their sums and those of their squares.
    fn make(&mut self, x: &[f32], folded: &Folded) -> &mut [f32] {
        let width = folded.bias.len();
        self.act.resize(x.len() / IN * width, 0.0);
        for sums in [&mut self.sum, &mut self.square] {
            sums.clear();
            sums.resize(width, 0.0);
        }
        let (out, bias) = (&mut self.act[..], &folded.bias);
        let (sum, square) = (&mut self.sum[..], &mut self.square[..]);
        multiply(x, &folded.forward, &mut Rectify { out, bias, sum, square });
        &mut self.act
    }
}

/// The first layer as a function of a grid's coordinates.
pub fn layer<'a>(weights: &'a [f32], bias: &'a [f32], grid: &Grid) -> Layer<'a> {
    let [a, b] = grid.axes().map(|k| &weights[k * bias.len()..(k + 1) * bias.len()]);
    Layer { a, b, c: bias }
}

impl Band {
    /// A band of the samples `rows`, before the first forward pass.
    pub fn new(rows: Range<usize>, hinges: Option<Hinges>) -> Self {
        let n = rows.len();
        Self {
            rows,
            hinges,
            act: std::array::from_fn(|l| vec![0.0; if l == 0 { 0 } else { n * FAN[l][1] }]),
            first: First::default(),
            out: vec![0.0; n * OUT],
            sum: Vec::new(),
            square: Vec::new(),
            dw: Vec::new(),
            db: Vec::new(),
            packed: Packed::default(),
        }
    }

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

    /// The activations of layer `l`, 0 or 1, on a grid: for the first only their sums.
    pub fn forward_hinges(
        &mut self,
        l: usize,
        grid: &Grid,
        folded: &Folded,
        ctx: &Context<'_>,
    ) -> Result<()> {
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

    /// The activations of layer `l` and their sums; for the last the outputs. `folded` are those of all
    /// layers.
    pub fn forward(
        &mut self,
        l: usize,
        inputs: &Inputs,
        folded: &[Folded; LAYERS],
        ctx: &Context<'_>,
    ) -> Result<()> {
        let [depth, width] = FAN[l];
        self.clear_sums(width);
        let (mut sum, mut square) = (vec![0f32; width], vec![0f32; width]);
        for block in self.blocks() {
            ctx.check()?;
            let at = self.at(&block);
            let (lower, upper) = self.act.split_at_mut(l);
            if l == 0 {
                self.first.make(inputs.scattered(at), &folded[0]);
                flush(&mut self.sum, &mut self.first.sum);
                flush(&mut self.square, &mut self.first.square);
                continue;
            }
            let x = match lower.last() {
                Some(r) if l > 1 => &r[block.start * depth..block.end * depth],
                _ => self.first.make(inputs.scattered(at), &folded[0]),
            };
            let to = block.start * width..block.end * width;
            let Folded { forward, bias, .. } = &folded[l];
            if let Some(upper) = upper.first_mut() {
                let out = &mut upper[to];
                multiply(x, forward, &mut Rectify { out, bias, sum: &mut sum, square: &mut square });
                flush(&mut self.sum, &mut sum);
                flush(&mut self.square, &mut square);
                continue;
            }
            let out = &mut self.out[to];
            multiply(x, forward, &mut Store { out, bias });
            for row in out.chunks_exact_mut(width) {
                for z in &mut row[..3] {
                    *z = z.tanh();
                }
            }
        }
        Ok(())
    }

    /// Gradient before tanh, and the output layer's partial sums.
    pub fn backward_output(&mut self, gradient: &[Sample], outputs: usize, ctx: &Context<'_>) -> Result<()> {
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

    /// From the gradient before layer `l`'s nonlinearity to that of the layer below, with the partial sums of
    /// the latter. `p` and `q` are the layer below's factors of [`Pull`], `folded` the weights of all layers.
    pub fn backward(
        &mut self,
        l: usize,
        inputs: &Inputs,
        folded: &[Folded; LAYERS],
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
            let r = match l {
                1 => self.first.make(inputs.scattered(at.clone()), &folded[0]),
                _ => &mut middle[0][block.start * width..block.end * width],
            };
            multiply(dz, &folded[l].backward, &mut Pull { r, p, q, sum: &mut self.db });
            if on_grid {
                continue;
            }
            self.packed.set(r, width);
            let x = match lowest.last() {
                None => inputs.scattered(at),
                Some(_) if l == 2 => self.first.make(inputs.scattered(at), &folded[0]),
                Some(x) => &x[block.start * below..block.end * below],
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
