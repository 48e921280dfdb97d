//! What is done with the tiles of the network's matrix products while they are still in registers.

use crate::net::gemm::{Finish, vectors, vectors_mut};
use pulp::Simd;

/// Adds a block's f32 sums to a band's f64 sums, and clears them.
pub fn flush(total: &mut [f64], block: &mut [f32]) {
    for (t, b) in total.iter_mut().zip(block) {
        *t += f64::from(std::mem::take(b));
    }
}

/// Stores ReLU of a product plus bias, and adds its values and their squares to the column sums.
pub struct Rectify<'a> {
    /// Rows of the layer, row-major.
    pub out: &'a mut [f32],
    /// One per column.
    pub bias: &'a [f32],
    /// Column sums of the values.
    pub sum: &'a mut [f32],
    /// Column sums of their squares.
    pub square: &'a mut [f32],
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

/// Replaces activations r by the gradient before ReLU: product + p r + q where r is positive, else 0. The
/// product is the part of the gradient that does not come from batch norm's statistics. The column sums of
/// the gradient are added to `sum`.
pub struct Pull<'a> {
    /// Activations, then gradients, row-major.
    pub r: &'a mut [f32],
    /// One per column.
    pub p: &'a [f32],
    /// One per column.
    pub q: &'a [f32],
    /// Column sums of the gradients.
    pub sum: &'a mut [f32],
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
