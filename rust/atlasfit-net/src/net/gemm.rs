//! Matrix products of row-major f32 slices on one thread, with what follows a product done while its tile is
//! still in registers.
//!
//! In: rows and a [`Packed`] matrix, or two blocks whose product is summed over their rows. Out: tiles handed
//! to a [`Finish`]. Vector instructions (AVX2 and FMA, NEON, none) are chosen at run time by pulp. Callers
//! split work into blocks of fixed size and run those in parallel, so that sums do not depend on the number
//! of threads.

use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Columns of a panel, two vectors of AVX2; widths of packed matrices are multiples of it. The twelve sums of
/// a tile of [`TILE`] rows, two vectors of columns and a factor fit AVX2's sixteen registers.
pub const PANEL: usize = 16;
/// Rows of a tile: see [`PANEL`].
pub const TILE: usize = 6;

/// A matrix in panels of [`PANEL`] columns, each row by row.
#[derive(Clone, Default)]
pub struct Packed {
    data: Vec<f32>,
    rows: usize,
    columns: usize,
}

impl Packed {
    /// A new one, as [`Self::set`].
    pub fn of(matrix: &[f32], columns: usize) -> Self {
        let mut packed = Self::default();
        packed.set(matrix, columns);
        packed
    }
    /// Takes a row-major matrix of any number of columns; zeros fill its last panel.
    pub fn set_padded(&mut self, matrix: &[f32], columns: usize) {
        self.resize(matrix.len() / columns, columns.next_multiple_of(PANEL));
        let rows = self.rows;
        for (r, row) in matrix.chunks_exact(columns).enumerate() {
            for (p, part) in row.chunks(PANEL).enumerate() {
                let to = &mut self.data[(p * rows + r) * PANEL..][..PANEL];
                to[..part.len()].copy_from_slice(part);
                to[part.len()..].fill(0.0);
            }
        }
    }
    /// Takes a row-major matrix of `columns` columns, a multiple of [`PANEL`].
    pub fn set(&mut self, matrix: &[f32], columns: usize) {
        debug_assert!(columns.is_multiple_of(PANEL) && matrix.len().is_multiple_of(columns));
        self.resize(matrix.len() / columns, columns);
        let rows = self.rows;
        for (r, row) in matrix.chunks_exact(columns).enumerate() {
            for (p, part) in row.chunks_exact(PANEL).enumerate() {
                self.data[(p * rows + r) * PANEL..][..PANEL].copy_from_slice(part);
            }
        }
    }
    /// Takes the transpose of a row-major matrix of `columns` columns and a multiple of [`PANEL`] rows.
    pub fn set_transposed(&mut self, matrix: &[f32], columns: usize) {
        debug_assert!((matrix.len() / columns).is_multiple_of(PANEL));
        self.resize(columns, matrix.len() / columns);
        for (panel, rows) in
            self.data.chunks_exact_mut(PANEL * columns).zip(matrix.chunks_exact(PANEL * columns))
        {
            for (j, row) in rows.chunks_exact(columns).enumerate() {
                for (x, to) in row.iter().zip(panel.chunks_exact_mut(PANEL)) {
                    to[j] = *x;
                }
            }
        }
    }
    /// Number of panels.
    pub fn panels(&self) -> usize {
        self.columns / PANEL
    }
    /// The panels, each row by row.
    pub fn each(&self) -> impl Iterator<Item = &[f32]> {
        self.data.chunks_exact((self.rows * PANEL).max(1))
    }
    fn resize(&mut self, rows: usize, columns: usize) {
        (self.rows, self.columns) = (rows, columns);
        self.data.resize(rows * columns, 0.0);
    }
}

/// Work on vectors, V of which make a panel.
pub trait Kernel {
    /// Does the work with the vector instructions of `simd`.
    fn run<S: Simd, const V: usize>(self, simd: S);
}

/// Runs a kernel with the vector instructions of this machine.
pub fn dispatch(kernel: impl Kernel) {
    struct Widths<K>(K);
    impl<K: Kernel> WithSimd for Widths<K> {
        type Output = ();
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            match PANEL / S::F32_LANES {
                1 => self.0.run::<S, 1>(simd),
                2 => self.0.run::<S, 2>(simd),
                4 => self.0.run::<S, 4>(simd),
                _ => self.0.run::<S, 16>(simd),
            }
        }
    }
    Arch::new().dispatch(Widths(kernel));
}

/// What is done with each tile of a product.
pub trait Finish {
    /// Takes rows `row..row + tile.len()` of columns `column..column + PANEL`.
    fn take<S: Simd, const V: usize>(&mut self, simd: S, row: usize, column: usize, tile: &[[S::f32s; V]]);
}

/// The vectors of a part of a row that is a panel wide.
#[inline(always)]
pub fn vectors<S: Simd>(part: &[f32]) -> &[S::f32s] {
    S::as_simd_f32s(&part[..PANEL]).0
}
/// The vectors of a part of a row that is a panel wide.
#[inline(always)]
pub fn vectors_mut<S: Simd>(part: &mut [f32]) -> &mut [S::f32s] {
    S::as_mut_simd_f32s(&mut part[..PANEL]).0
}

/// Runs `finish` on the tiles of `a` times `b`; `a` is row-major with as many columns as `b` has rows.
pub fn multiply(a: &[f32], b: &Packed, finish: &mut impl Finish) {
    multiply_panels(a, b, 0..b.panels(), finish);
}

/// The part of [`multiply`] that some panels of `b` give.
pub fn multiply_panels(a: &[f32], b: &Packed, panels: Range<usize>, finish: &mut impl Finish) {
    dispatch(Multiply { a, b, panels, finish });
}

struct Multiply<'a, F> {
    a: &'a [f32],
    b: &'a Packed,
    panels: Range<usize>,
    finish: &'a mut F,
}

impl<F: Finish> Kernel for Multiply<'_, F> {
    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        let depth = self.b.rows;
        let panels = self.b.data.chunks_exact(depth * PANEL).enumerate();
        for (p, panel) in panels.take(self.panels.end).skip(self.panels.start) {
            let panel = S::as_simd_f32s(panel).0.as_chunks::<V>().0;
            let tiles = self.a.chunks_exact(TILE * depth);
            let rest = tiles.remainder();
            for (i, rows) in tiles.enumerate() {
                let tile = product::<S, V, TILE>(simd, rows, panel);
                self.finish.take(simd, i * TILE, p * PANEL, &tile);
            }
            let done = (self.a.len() - rest.len()) / depth;
            for (i, row) in rest.chunks_exact(depth).enumerate() {
                let tile = product::<S, V, 1>(simd, row, panel);
                self.finish.take(simd, done + i, p * PANEL, &tile);
            }
        }
    }
}

/// The product of M rows and a panel.
#[inline(always)]
fn product<S: Simd, const V: usize, const M: usize>(
    simd: S,
    rows: &[f32],
    panel: &[[S::f32s; V]],
) -> [[S::f32s; V]; M] {
    let depth = panel.len();
    let rows: [&[f32]; M] = std::array::from_fn(|i| &rows[i * depth..(i + 1) * depth]);
    let mut sums = [[simd.splat_f32s(0.0); V]; M];
    for (k, columns) in panel.iter().enumerate() {
        for i in 0..M {
            let x = simd.splat_f32s(rows[i][k]);
            for v in 0..V {
                sums[i][v] = simd.mul_add_e_f32s(x, columns[v], sums[i][v]);
            }
        }
    }
    sums
}

/// Adds aᵀ b to `sum`, row-major. `a` has `inputs` columns and as many rows as `b`.
pub fn add_outer(sum: &mut [f32], a: &[f32], inputs: usize, b: &Packed) {
    add_outer_of(sum, a, inputs, 0..inputs, b);
}

/// The part of [`add_outer`] that some columns of `a` give. The bytes are the same where all parts but the
/// last begin and end at multiples of [`TILE`].
pub fn add_outer_of(sum: &mut [f32], a: &[f32], inputs: usize, of: Range<usize>, b: &Packed) {
    dispatch(Outer { sum, a, inputs, of, b });
}

struct Outer<'a> {
    sum: &'a mut [f32],
    a: &'a [f32],
    inputs: usize,
    of: Range<usize>,
    b: &'a Packed,
}

/// Rows whose factors are gathered at a time: those of a tile, 6 kB, then stay in the first cache.
const GATHER: usize = 256;

impl Kernel for Outer<'_> {
    #[inline(always)]
    fn run<S: Simd, const V: usize>(mut self, simd: S) {
        let Range { start: mut at, end } = self.of;
        while at < end {
            match end - at {
                TILE.. => self.tile::<S, V, TILE>(simd, at),
                4.. => self.tile::<S, V, 4>(simd, at),
                2.. => self.tile::<S, V, 2>(simd, at),
                _ => self.tile::<S, V, 1>(simd, at),
            }
            at += match end - at {
                TILE.. => TILE,
                4.. => 4,
                2.. => 2,
                _ => 1,
            };
        }
    }
}

impl Outer<'_> {
    #[inline(always)]
    fn tile<S: Simd, const V: usize, const M: usize>(&mut self, simd: S, at: usize) {
        let mut factors = [[0f32; M]; GATHER];
        let rows = self.b.rows;
        for from in (0..rows).step_by(GATHER) {
            let n = GATHER.min(rows - from);
            for (f, row) in
                factors.iter_mut().zip(self.a[from * self.inputs..].chunks_exact(self.inputs)).take(n)
            {
                f.copy_from_slice(&row[at..at + M]);
            }
            for (p, panel) in self.b.data.chunks_exact(rows * PANEL).enumerate() {
                let panel = S::as_simd_f32s(&panel[from * PANEL..(from + n) * PANEL]).0.as_chunks::<V>().0;
                let mut sums = [[simd.splat_f32s(0.0); V]; M];
                for (f, columns) in factors.iter().zip(panel) {
                    for i in 0..M {
                        let x = simd.splat_f32s(f[i]);
                        for v in 0..V {
                            sums[i][v] = simd.mul_add_e_f32s(x, columns[v], sums[i][v]);
                        }
                    }
                }
                for (i, sums) in sums.iter().enumerate() {
                    let to = &mut self.sum[(at + i) * self.b.columns + p * PANEL..];
                    for (to, s) in vectors_mut::<S>(to).iter_mut().zip(sums) {
                        *to = simd.add_f32s(*to, *s);
                    }
                }
            }
        }
    }
}

/// Stores a product plus a bias.
pub struct Store<'a> {
    /// Row-major, as wide as the product.
    pub out: &'a mut [f32],
    /// Added to each row.
    pub bias: &'a [f32],
}

impl Finish for Store<'_> {
    #[inline(always)]
    fn take<S: Simd, const V: usize>(&mut self, simd: S, row: usize, column: usize, tile: &[[S::f32s; V]]) {
        let width = self.bias.len();
        let bias = vectors::<S>(&self.bias[column..]);
        for (i, values) in tile.iter().enumerate() {
            let out = vectors_mut::<S>(&mut self.out[(row + i) * width + column..]);
            for ((o, x), b) in out.iter_mut().zip(values).zip(bias) {
                *o = simd.add_f32s(*x, *b);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use atlasfit::numeric::rng::Rng;

    fn random(n: usize, rng: &mut Rng) -> Vec<f32> {
        (0..n).map(|_| rng.normal() as f32).collect()
    }

    fn slow(a: &[f32], b: &[f32], [m, k, n]: [usize; 3]) -> Vec<f64> {
        (0..m * n)
            .map(|i| (0..k).map(|j| f64::from(a[i / n * k + j]) * f64::from(b[j * n + i % n])).sum())
            .collect()
    }

    fn close(a: &[f32], b: &[f64]) {
        for (x, y) in a.iter().zip(b) {
            assert!((f64::from(*x) - y).abs() < 1e-3, "{x} {y}");
        }
    }

    #[test]
    fn products_are_those_of_the_definition_for_whole_and_broken_tiles() {
        let mut rng = Rng::new(1);
        for [m, k, n] in [[1, 1, 16], [6, 4, 32], [17, 64, 16], [300, 7, 48]] {
            let (a, b, bias) = (random(m * k, &mut rng), random(k * n, &mut rng), vec![0.0; n]);
            let mut packed = Packed::default();
            packed.set(&b, n);
            let mut out = vec![0.0; m * n];
            multiply(&a, &packed, &mut Store { out: &mut out, bias: &bias });
            close(&out, &slow(&a, &b, [m, k, n]));
            let mut parts = vec![0.0; m * n];
            for p in 0..packed.panels() {
                multiply_panels(&a, &packed, p..p + 1, &mut Store { out: &mut parts, bias: &bias });
            }
            assert!(out == parts, "parts of {n} columns");
            // bᵀ by its transpose.
            let across: Vec<f32> = (0..n * k).map(|i| b[i % k * n + i / k]).collect();
            packed.set_transposed(&across, k);
            multiply(&a, &packed, &mut Store { out: &mut out, bias: &bias });
            close(&out, &slow(&a, &b, [m, k, n]));
        }
    }

    #[test]
    fn outer_products_add_up_over_rows() {
        let mut rng = Rng::new(2);
        for [rows, inputs, n] in [[1, 4, 16], [5, 7, 32], [700, 13, 16]] {
            let (a, b) = (random(rows * inputs, &mut rng), random(rows * n, &mut rng));
            let across: Vec<f32> = (0..rows * inputs).map(|i| a[i % rows * inputs + i / rows]).collect();
            let mut packed = Packed::default();
            packed.set(&b, n);
            let mut sum = vec![1.0; inputs * n];
            add_outer(&mut sum, &a, inputs, &packed);
            let mut parts = vec![1.0; inputs * n];
            for from in (0..inputs).step_by(TILE) {
                add_outer_of(&mut parts, &a, inputs, from..inputs.min(from + TILE), &packed);
            }
            assert!(sum == parts, "parts of {inputs} columns");
            let expected: Vec<f64> = slow(&across, &b, [inputs, rows, n]).iter().map(|x| x + 1.0).collect();
            close(&sum, &expected);
        }
    }
}
