//! The first hidden layer on a regular grid of inputs, and the product after it, for the cost of the layer's
//! kinks.
//!
//! In: the first layer's parameters and the next layer's weights. Out: the next layer after ReLU; sums that
//! all gradients follow from. The first layer's activations are never made. Derived here; the paper computes
//! them.
//!
//! Along a line of the grid a unit is r = max(0, alpha + beta v): it is on over one run of samples. So the
//! product r W is A + v B with A = sum alpha W and B = sum beta W over the units that are on. These two rows
//! change only where a unit turns on or off: twice per unit and line instead of once per unit and sample. In
//! the same way the sums of G, u G and v G over the samples where a unit is on are differences of running
//! sums at the two ends of its run. With r = c + a u + b v they give r^T G, and with W the gradient of a, b
//! and c.

use super::gemm::{Kernel, PANEL, dispatch, vectors, vectors_mut};
use pulp::Simd;
use std::ops::Range;

/// Samples of a line that are worked on at a time, at most: longer running sums lose digits of f32.
const LONGEST: usize = 256;
/// Panels of columns at a time: their running rows fill half of AVX2's sixteen registers, enough to hide the
/// latency of adding.
const WIDE: usize = 2;
/// Sums of G per unit: plain, times u, times v.
pub const SUMS: usize = 3;

/// A regular grid of inputs: sample i of line l is at (u, v) = (first[0] + l step[0], first[1] + i step[1]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Lines, and samples per line. A curve is one line at u = 0.
    pub size: [usize; 2],
    /// The first sample.
    pub first: [f32; 2],
    /// From sample to sample, not 0.
    pub step: [f32; 2],
}

impl Grid {
    /// The inputs of a sample: (u, v), or v alone for a curve.
    pub fn input(&self, i: usize) -> [f32; 3] {
        let [lines, side] = self.size;
        let at = |k: usize, axis: usize| self.first[axis] + k as f32 * self.step[axis];
        if lines == 1 { [at(i, 1), 0.0, 0.0] } else { [at(i / side, 0), at(i % side, 1), 0.0] }
    }
    /// Which inputs u and v are.
    pub const fn axes(&self) -> [usize; 2] {
        if self.size[0] == 1 { [1, 0] } else { [0, 1] }
    }
    /// The largest number of rows, at most `most`, that is whole lines, or of a long line whole pieces.
    pub const fn whole_lines(&self, most: usize) -> usize {
        let side = self.size[1];
        if side > most { most / LONGEST * LONGEST } else { most / side * side }
    }
}

/// The first layer: r = max(0, c + a u + b v) for each unit.
pub struct Layer<'a> {
    /// Factors of u.
    pub a: &'a [f32],
    /// Factors of v.
    pub b: &'a [f32],
    /// Biases.
    pub c: &'a [f32],
}

/// Sums over the samples where a unit is on: 1, u, v, u u, u v, v v.
pub type Moments = [f64; 6];

/// A unit turns on (`sign` is 1) or off (-1); its alpha and beta times the sign.
#[derive(Clone, Copy, Default)]
struct Turn {
    unit: u32,
    sign: f32,
    alpha: f32,
    beta: f32,
}

/// A piece of a line.
struct Piece {
    u: f32,
    v: f32,
    count: usize,
    /// Turns before sample 0, 1, ..., and those after the last one, where all that is on turns off.
    turns: Vec<Turn>,
    /// Where those before each sample begin; two entries more than samples.
    start: Vec<u32>,
}

impl Piece {
    fn turns(&self, sample: usize) -> &[Turn] {
        &self.turns[self.start[sample] as usize..self.start[sample + 1] as usize]
    }

    /// Finds where units turn; adds to their moments.
    fn find(&mut self, layer: &Layer<'_>, step: f32, moments: &mut [Moments]) {
        let Self { u, v, count, turns, start } = self;
        let ranges: Vec<([f32; 2], Range<usize>)> = (layer.a.iter().zip(layer.b).zip(layer.c))
            .map(|((a, &beta), c)| {
                let alpha = c + a * *u;
                // Where alpha + beta v is 0, in samples.
                let zero = (-f64::from(alpha) / f64::from(beta) - f64::from(*v)) / f64::from(step);
                // Conversions saturate; not a number is 0.
                let range = if beta > 0.0 {
                    (zero.floor() + 1.0) as usize..*count
                } else if beta < 0.0 {
                    0..(zero.ceil() as usize).min(*count)
                } else {
                    0..if alpha > 0.0 { *count } else { 0 }
                };
                ([alpha, beta], range)
            })
            .collect();
        let on = || ranges.iter().enumerate().filter(|(_, (_, range))| !range.is_empty());
        start.clear();
        start.resize(*count + 3, 0);
        for (_, (_, range)) in on() {
            start[range.start + 2] += 1;
            start[range.end + 2] += 1;
        }
        for i in 2..start.len() {
            start[i] += start[i - 1];
        }
        turns.clear();
        turns.resize(start[*count + 2] as usize, Turn::default());
        for (unit, ([alpha, beta], range)) in on() {
            for (at, sign) in [(range.start, 1.0), (range.end, -1.0)] {
                let to = &mut start[at + 1];
                turns[*to as usize] =
                    Turn { unit: unit as u32, sign, alpha: sign * alpha, beta: sign * beta };
                *to += 1;
            }
            // Sums of 0..n and of their squares.
            let below = |n: f64| [n, n * (n - 1.0) / 2.0, n * (n - 1.0) * (2.0 * n - 1.0) / 6.0];
            let (to, from) = (below(range.end as f64), below(range.start as f64));
            let [n, k, kk] = [0, 1, 2].map(|i| to[i] - from[i]);
            let (u, v, step) = (f64::from(*u), f64::from(*v), f64::from(step));
            let (sv, svv) = (n * v + k * step, n * v * v + 2.0 * v * step * k + step * step * kk);
            for (m, x) in moments[unit].iter_mut().zip([n, n * u, sv, n * u * u, u * sv, svv]) {
                *m += x;
            }
        }
        // Each entry was moved to where the next one's begin.
        start.pop();
    }
}

/// Pieces of lines that are consecutive rows.
pub struct Hinges {
    pieces: Vec<Piece>,
    step: f32,
    /// Of each unit, after [`Self::find`].
    pub moments: Vec<Moments>,
    /// [`SUMS`] rows per unit, as wide as the next layer, after [`Self::pull`].
    pub sums: Vec<f32>,
}

impl Hinges {
    /// For some rows of a grid, which begin and end with lines or pieces of them.
    pub fn new(grid: &Grid, rows: Range<usize>) -> Self {
        let mut hinges = Self { pieces: Vec::new(), step: 1.0, moments: Vec::new(), sums: Vec::new() };
        let side = grid.size[1];
        let mut at = rows.start;
        while at < rows.end {
            let count = (side - at % side).min(rows.end - at).min(LONGEST);
            hinges.pieces.push(Piece { u: 0.0, v: 0.0, count, turns: Vec::new(), start: Vec::new() });
            at += count;
        }
        hinges.move_to(grid, rows.start);
        hinges
    }

    /// Moves to another grid of the same size.
    pub fn move_to(&mut self, grid: &Grid, mut row: usize) {
        self.step = grid.step[1];
        let [u, v] = grid.axes();
        for piece in &mut self.pieces {
            let input = grid.input(row);
            (piece.u, piece.v) = (input[u], input[v]);
            row += piece.count;
        }
    }

    /// Finds where the layer's units turn on and off.
    pub fn find(&mut self, layer: &Layer<'_>) {
        self.moments.clear();
        self.moments.resize(layer.c.len(), [0.0; 6]);
        for piece in &mut self.pieces {
            piece.find(layer, self.step, &mut self.moments);
        }
    }

    /// Writes ReLU of the layer's activations times `weights` (row-major) plus `bias` to the rows of `out`.
    /// `flush` gets each piece's column sums of the values and of their squares, and clears them.
    pub fn forward(
        &self,
        weights: &[f32],
        bias: &[f32],
        out: &mut [f32],
        mut flush: impl FnMut(&mut [f32], &mut [f32]),
    ) {
        let (mut sum, mut square) = (vec![0.0; bias.len()], vec![0.0; bias.len()]);
        let mut rest = out;
        for piece in &self.pieces {
            let out;
            (out, rest) = rest.split_at_mut(piece.count * bias.len());
            dispatch(Forward {
                piece,
                step: self.step,
                weights,
                bias,
                out,
                sum: &mut sum,
                square: &mut square,
            });
            flush(&mut sum, &mut square);
        }
    }

    /// Sums of the rows of `gradient`, which has `width` columns, over the samples where each unit is on.
    pub fn pull(&mut self, gradient: &[f32], width: usize) {
        self.sums.clear();
        self.sums.resize(self.moments.len() * SUMS * width, 0.0);
        let mut rest = gradient;
        for piece in &self.pieces {
            let gradient;
            (gradient, rest) = rest.split_at(piece.count * width);
            dispatch(Pull { piece, step: self.step, gradient, width, sums: &mut self.sums });
        }
    }
}

/// [`WIDE`] panels of a row.
#[inline(always)]
fn load<S: Simd, const V: usize>(row: &[f32]) -> [[S::f32s; V]; WIDE] {
    std::array::from_fn(|i| std::array::from_fn(|v| vectors::<S>(&row[i * PANEL..])[v]))
}

struct Forward<'a> {
    piece: &'a Piece,
    step: f32,
    weights: &'a [f32],
    bias: &'a [f32],
    out: &'a mut [f32],
    sum: &'a mut [f32],
    square: &'a mut [f32],
}

impl Kernel for Forward<'_> {
    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        let width = self.bias.len();
        let zero = simd.splat_f32s(0.0);
        for column in (0..width).step_by(WIDE * PANEL) {
            let mut a = load::<S, V>(&self.bias[column..]);
            let mut b = [[zero; V]; WIDE];
            for k in 0..self.piece.count {
                for turn in self.piece.turns(k) {
                    let w =
                        load::<S, V>(&self.weights[turn.unit as usize * width + column..][..WIDE * PANEL]);
                    let (alpha, beta) = (simd.splat_f32s(turn.alpha), simd.splat_f32s(turn.beta));
                    for i in 0..WIDE {
                        for v in 0..V {
                            a[i][v] = simd.mul_add_e_f32s(alpha, w[i][v], a[i][v]);
                            b[i][v] = simd.mul_add_e_f32s(beta, w[i][v], b[i][v]);
                        }
                    }
                }
                let at = simd.splat_f32s(self.piece.v + k as f32 * self.step);
                for i in 0..WIDE {
                    let part = column + i * PANEL;
                    let out = vectors_mut::<S>(&mut self.out[k * width + part..]);
                    let sums = vectors_mut::<S>(&mut self.sum[part..]);
                    let squares = vectors_mut::<S>(&mut self.square[part..]);
                    for v in 0..V {
                        let x = simd.max_f32s(simd.mul_add_e_f32s(at, b[i][v], a[i][v]), zero);
                        out[v] = x;
                        sums[v] = simd.add_f32s(sums[v], x);
                        squares[v] = simd.mul_add_e_f32s(x, x, squares[v]);
                    }
                }
            }
        }
    }
}

struct Pull<'a> {
    piece: &'a Piece,
    step: f32,
    gradient: &'a [f32],
    width: usize,
    sums: &'a mut [f32],
}

impl Kernel for Pull<'_> {
    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        let width = self.width;
        let u = simd.splat_f32s(self.piece.u);
        for column in (0..width).step_by(WIDE * PANEL) {
            let mut plain = [[simd.splat_f32s(0.0); V]; WIDE];
            let mut along = plain;
            for k in 0..=self.piece.count {
                for turn in self.piece.turns(k) {
                    // The running sum where a unit turns off, less that where it turned on.
                    let sign = simd.splat_f32s(-turn.sign);
                    let across = simd.mul_f32s(sign, u);
                    let row = turn.unit as usize * SUMS * width + column;
                    for i in 0..WIDE {
                        for (r, factor, from) in [(0, sign, &plain), (1, across, &plain), (2, sign, &along)] {
                            let to = vectors_mut::<S>(&mut self.sums[row + r * width + i * PANEL..]);
                            for v in 0..V {
                                to[v] = simd.mul_add_e_f32s(factor, from[i][v], to[v]);
                            }
                        }
                    }
                }
                if k == self.piece.count {
                    break;
                }
                let at = simd.splat_f32s(self.piece.v + k as f32 * self.step);
                let g = load::<S, V>(&self.gradient[k * width + column..]);
                for i in 0..WIDE {
                    for v in 0..V {
                        plain[i][v] = simd.add_f32s(plain[i][v], g[i][v]);
                        along[i][v] = simd.mul_add_e_f32s(at, g[i][v], along[i][v]);
                    }
                }
            }
        }
    }
}
