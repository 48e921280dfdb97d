//! Convolutions on a CPU: products of windows that are read from padded pictures, block by block, so that no
//! array of all windows is ever made.
//!
//! In: pictures (groups count, rows, columns, channels), weights (groups, side side channels, outputs), and
//! for the gradients those of the result, (groups, count rows' columns', outputs). Blocks follow from the
//! sizes, so that sums do not depend on the number of threads.

use super::rows::{Rows, add_outer, multiply};
use super::unfold::Unfold;
use atlasfit_net::net::gemm::{PANEL, Packed, TILE};
use rayon::prelude::*;

/// Windows of a block at least, where the pictures have so many: packed weights are read once for each.
const BLOCK: usize = 256;
/// Windows whose gradients of the weights are added up in one sum at least: more would spend the time on
/// adding the sums.
const SUMMED: usize = 2048;
/// Sums of the weights' gradient that may be made at a time, whole or in parts.
const SUMS: usize = 16;

/// A convolution.
#[derive(Clone, Copy)]
pub(super) struct Direct {
    pub(super) groups: usize,
    pub(super) unfold: Unfold,
    pub(super) outputs: usize,
}

impl Direct {
    /// Numbers of a picture, windows on it, numbers of a window.
    fn sizes(&self) -> [usize; 3] {
        let [_, rows, columns, channels] = self.unfold.size;
        let [_, high, wide, inputs] = self.unfold.out();
        [rows * columns * channels, high * wide, inputs]
    }

    /// Pictures of a group, and of a block.
    fn blocks(&self) -> [usize; 2] {
        let (of_group, [_, windows, _]) = (self.unfold.size[0] / self.groups, self.sizes());
        [of_group, (BLOCK / windows).clamp(1, of_group.max(1))]
    }

    /// The result, (groups, windows, outputs).
    pub(super) fn forward(&self, x: &[f32], weights: &[f32]) -> Vec<f32> {
        let inputs = self.sizes()[2];
        let pack = |w: &[f32]| {
            let mut packed = Packed::default();
            packed.set_padded(w, self.outputs);
            packed
        };
        let packed: Vec<Packed> = weights.par_chunks(inputs * self.outputs).map(pack).collect();
        self.products(x, &packed)
    }

    fn products(&self, x: &[f32], packed: &[Packed]) -> Vec<f32> {
        let [numbers, windows, _] = self.sizes();
        let [of_group, per] = self.blocks();
        let at = self.starts(per);
        let mut out = vec![0.0; self.unfold.size[0] * windows * self.outputs];
        let groups = out.par_chunks_mut(of_group * windows * self.outputs).zip(packed);
        groups.zip(x.par_chunks(of_group * numbers)).for_each(|((out, packed), x)| {
            let blocks = out.par_chunks_mut(per * windows * self.outputs).zip(x.par_chunks(per * numbers));
            blocks.for_each_init(Vec::new, |padded, (out, x)| {
                self.pad(x, padded);
                let at = &at[..x.len() / numbers * windows];
                multiply(self.rows(padded, at), packed, self.outputs, out);
            });
        });
        out
    }

    /// The gradient of the pictures.
    pub(super) fn of_pictures(&self, d: &[f32], weights: &[f32]) -> Vec<f32> {
        let [count, rows, columns, channels] = self.unfold.size;
        let (inputs, outputs, window) = (self.sizes()[2], self.outputs, self.unfold.window);
        if window.stride == 1 {
            // A convolution too, of the weights turned round.
            let packed: Vec<Packed> = weights.par_chunks(inputs * outputs).map(|w| self.turned(w)).collect();
            let unfold = Unfold { size: [count, rows, columns, outputs], window };
            return Self { unfold, outputs: channels, ..*self }.products(d, &packed);
        }
        let pack = |w: &[f32]| {
            let mut packed = Packed::default();
            packed.set_padded(&transposed(w, outputs), inputs);
            packed
        };
        let packed: Vec<Packed> = weights.par_chunks(inputs * outputs).map(pack).collect();
        let [numbers, windows, _] = self.sizes();
        let [_, high, wide, _] = self.unfold.out();
        let lines = (BLOCK / wide).clamp(1, high);
        let at: Vec<usize> = (0..lines * wide).map(|i| i * outputs).collect();
        let mut dx = vec![0.0; count * numbers];
        let pictures = dx.par_chunks_mut(numbers).zip(d.par_chunks(windows * outputs)).enumerate();
        pictures.for_each_init(Vec::new, |seen, (i, (dx, d))| {
            seen.resize(lines * wide * inputs, 0.0);
            for (k, d) in d.chunks(lines * wide * outputs).enumerate() {
                let (at, first) = (&at[..d.len() / outputs], k * lines);
                let seen = &mut seen[..at.len() * inputs];
                let rows = Rows { data: d, at, run: outputs, step: 0 };
                multiply(rows, &packed[i / self.blocks()[0]], inputs, seen);
                self.unfold.fold_lines(first..first + at.len() / wide, seen, dx);
            }
        });
        dx
    }

    /// The gradient of the weights.
    pub(super) fn of_weights(&self, x: &[f32], d: &[f32]) -> Vec<f32> {
        let [numbers, windows, inputs] = self.sizes();
        let ([of_group, per], outputs) = (self.blocks(), self.outputs);
        // Where the weights are many and the windows few, parts of one sum, else sums over some pictures.
        let sums = (of_group * windows / SUMMED).clamp(1, SUMS).min(of_group);
        let in_sum = of_group.div_ceil(sums);
        let part = inputs.div_ceil(SUMS.div_ceil(sums * self.groups)).next_multiple_of(TILE);
        let (at, width) = (self.starts(per), outputs.next_multiple_of(PANEL));
        let mut out = vec![0.0; self.groups * inputs * outputs];
        let groups = out.par_chunks_mut(inputs * outputs).zip(x.par_chunks(of_group * numbers));
        groups.zip(d.par_chunks(of_group * windows * outputs)).for_each(|((out, x), d)| {
            let several = x.par_chunks(in_sum * numbers).zip(d.par_chunks(in_sum * windows * outputs));
            let sums: Vec<Vec<f32>> = several
                .map(|(x, d)| {
                    let (mut sum, mut padded) = (vec![0.0; inputs * width], Vec::new());
                    let mut packed = Packed::default();
                    for (x, d) in x.chunks(per * numbers).zip(d.chunks(per * windows * outputs)) {
                        self.pad(x, &mut padded);
                        packed.set_padded(d, outputs);
                        let rows = self.rows(&padded, &at[..x.len() / numbers * windows]);
                        sum.par_chunks_mut(part * width).enumerate().for_each(|(i, sum)| {
                            add_outer(sum, rows, i * part..(i * part + sum.len() / width), &packed);
                        });
                    }
                    sum
                })
                .collect();
            out.par_chunks_mut(outputs).enumerate().for_each(|(i, out)| {
                for sum in &sums {
                    for (o, s) in out.iter_mut().zip(&sum[i * width..]) {
                        *o += s;
                    }
                }
            });
        });
        out
    }

    /// The weights as the gradient of the pictures takes them: (side side outputs, channels).
    fn turned(&self, weights: &[f32]) -> Packed {
        let (channels, outputs) = (self.unfold.size[3], self.outputs);
        let mut turned = vec![0.0; weights.len()];
        let taps =
            turned.par_chunks_mut(channels * outputs).zip(weights.par_chunks(channels * outputs).rev());
        taps.for_each(|(to, from)| to.copy_from_slice(&transposed(from, outputs)));
        let mut packed = Packed::default();
        packed.set_padded(&turned, channels);
        packed
    }

    /// Pictures with zeros around; what is in `out` before are such pictures, or nothing.
    fn pad(&self, pictures: &[f32], out: &mut Vec<f32>) {
        let ([_, rows, columns, channels], pad) = (self.unfold.size, self.unfold.window.pad());
        let (line, padded) = (columns * channels, (columns + 2 * pad) * channels);
        let numbers = (rows + 2 * pad) * padded;
        out.resize(out.len().max(pictures.len() / (rows * line) * numbers), 0.0);
        for (x, out) in pictures.chunks_exact(rows * line).zip(out.chunks_exact_mut(numbers)) {
            let lines = out.chunks_exact_mut(padded).skip(pad);
            for (x, out) in x.chunks_exact(line).zip(lines) {
                out[pad * channels..][..line].copy_from_slice(x);
            }
        }
    }

    /// Where the windows on so many padded pictures begin.
    fn starts(&self, pictures: usize) -> Vec<usize> {
        let ([_, rows, columns, channels], window) = (self.unfold.size, self.unfold.window);
        let [_, high, wide, _] = self.unfold.out();
        let padded = (columns + 2 * window.pad()) * channels;
        let place = |i: usize| {
            let (picture, y, x) = (i / (high * wide), i / wide % high, i % wide);
            (picture * (rows + 2 * window.pad()) + y * window.stride) * padded + x * window.stride * channels
        };
        (0..pictures * high * wide).map(place).collect()
    }

    fn rows<'a>(&self, padded: &'a [f32], at: &'a [usize]) -> Rows<'a> {
        let ([_, _, columns, channels], window) = (self.unfold.size, self.unfold.window);
        let step = (columns + 2 * window.pad()) * channels;
        Rows { data: padded, at, run: window.side * channels, step }
    }
}

/// The transpose of a row-major matrix of `columns` columns.
fn transposed(matrix: &[f32], columns: usize) -> Vec<f32> {
    let rows = matrix.len() / columns;
    (0..matrix.len()).map(|i| matrix[i % rows * columns + i / rows]).collect()
}
