//! Matrix products whose rows are read where they lie: windows of a picture, without a copy of them.
//!
//! In: [`Rows`], and matrices that are packed. Out: row-major products. One thread; callers split the work
//! into blocks of fixed size, so that sums do not depend on the number of threads.

use atlasfit_net::net::gemm::{Kernel, PANEL, Packed, TILE, dispatch, vectors_mut};
use pulp::Simd;
use std::ops::Range;

/// Rows that are several runs of numbers each, all at the same distances.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub(super) data: &'a [f32],
    /// Where each row's first run begins.
    pub(super) at: &'a [usize],
    /// Numbers of a run.
    pub(super) run: usize,
    /// From the beginning of a run to that of the next.
    pub(super) step: usize,
}

/// Rows that pass through all panels of the matrix together: what they read stays in the second cache.
const TOGETHER: usize = 768;

/// The product of rows and a matrix, (rows, `width`), where the matrix may be padded to more columns.
pub(super) fn multiply(rows: Rows<'_>, matrix: &Packed, width: usize, out: &mut [f32]) {
    for (at, out) in rows.at.chunks(TOGETHER).zip(out.chunks_mut(TOGETHER * width)) {
        dispatch(Multiply { rows: Rows { at, ..rows }, matrix, width, out });
    }
}

struct Multiply<'a> {
    rows: Rows<'a>,
    matrix: &'a Packed,
    width: usize,
    out: &'a mut [f32],
}

impl Kernel for Multiply<'_> {
    #[inline(always)]
    fn run<S: Simd, const V: usize>(self, simd: S) {
        let Rows { data, at, run, step } = self.rows;
        for (p, panel) in self.matrix.each().enumerate() {
            let panel = S::as_simd_f32s(panel).0.as_chunks::<V>().0;
            let wide = PANEL.min(self.width - p * PANEL);
            for (tile, at) in at.chunks(TILE).enumerate() {
                // Where rows are missing the last one is taken several times.
                let from: [usize; TILE] = std::array::from_fn(|i| at[i.min(at.len() - 1)]);
                let mut sums = [[simd.splat_f32s(0.0); V]; TILE];
                for (r, part) in panel.chunks_exact(run).enumerate() {
                    let runs: [&[f32]; TILE] = std::array::from_fn(|i| &data[from[i] + r * step..][..run]);
                    for (k, columns) in part.iter().enumerate() {
                        for i in 0..TILE {
                            let x = simd.splat_f32s(runs[i][k]);
                            for v in 0..V {
                                sums[i][v] = simd.mul_add_e_f32s(x, columns[v], sums[i][v]);
                            }
                        }
                    }
                }
                for (i, sums) in sums.iter().enumerate().take(at.len()) {
                    let out = &mut self.out[(tile * TILE + i) * self.width + p * PANEL..][..wide];
                    if wide == PANEL {
                        vectors_mut::<S>(out).copy_from_slice(sums);
                    } else {
                        let mut line = [0.0; PANEL];
                        vectors_mut::<S>(&mut line).copy_from_slice(sums);
                        out.copy_from_slice(&line[..wide]);
                    }
                }
            }
        }
    }
}

/// Adds rowsᵀ times a matrix with as many rows to `sum`: of the rows' numbers only those of the range `of`,
/// (`of`, the matrix' columns with its padding).
pub(super) fn add_outer(sum: &mut [f32], rows: Rows<'_>, of: Range<usize>, matrix: &Packed) {
    dispatch(Outer { sum, rows, of, matrix });
}

struct Outer<'a> {
    sum: &'a mut [f32],
    rows: Rows<'a>,
    of: Range<usize>,
    matrix: &'a Packed,
}

/// Rows whose factors are gathered at a time: those of a tile, 6 kB, then stay in the first cache.
const GATHER: usize = 256;

impl Kernel for Outer<'_> {
    #[inline(always)]
    fn run<S: Simd, const V: usize>(mut self, simd: S) {
        let mut at = self.of.start;
        while at < self.of.end {
            // Tiles end with the run.
            let left = (self.rows.run - at % self.rows.run).min(self.of.end - at);
            at += match left {
                TILE.. => self.tile::<S, V, TILE>(simd, at),
                4.. => self.tile::<S, V, 4>(simd, at),
                2.. => self.tile::<S, V, 2>(simd, at),
                _ => self.tile::<S, V, 1>(simd, at),
            };
        }
    }
}

impl Outer<'_> {
    /// Adds what M numbers from `first` on give; M.
    #[inline(always)]
    fn tile<S: Simd, const V: usize, const M: usize>(&mut self, simd: S, first: usize) -> usize {
        let Rows { data, at, run, step } = self.rows;
        let (offset, columns) = (first / run * step + first % run, self.matrix.panels() * PANEL);
        let mut factors = [[0f32; M]; GATHER];
        for (part, at) in at.chunks(GATHER).enumerate() {
            for (f, at) in factors.iter_mut().zip(at) {
                f.copy_from_slice(&data[at + offset..][..M]);
            }
            for (p, panel) in self.matrix.each().enumerate() {
                let panel = &panel[part * GATHER * PANEL..][..at.len() * PANEL];
                let mut sums = [[simd.splat_f32s(0.0); V]; M];
                for (f, columns) in factors.iter().zip(S::as_simd_f32s(panel).0.as_chunks::<V>().0) {
                    for i in 0..M {
                        let x = simd.splat_f32s(f[i]);
                        for v in 0..V {
                            sums[i][v] = simd.mul_add_e_f32s(x, columns[v], sums[i][v]);
                        }
                    }
                }
                for (i, sums) in sums.iter().enumerate() {
                    let to = &mut self.sum[(first - self.of.start + i) * columns + p * PANEL..];
                    for (to, s) in vectors_mut::<S>(to).iter_mut().zip(sums) {
                        *to = simd.add_f32s(*to, *s);
                    }
                }
            }
        }
        M
    }
}
