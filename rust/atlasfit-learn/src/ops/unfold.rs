//! Pictures laid out so that a convolution is one matrix product: for each place of the result a row with all
//! that its window sees.

use super::{has_fused, made, slice, with_slice};
#[cfg(feature = "cuda")]
use candle_core::CudaStorage;
use candle_core::{CpuStorage, CustomOp1, Layout, Result, Shape, Tensor};
use rayon::prelude::*;
use std::ops::Range;

/// A convolution's window: `side` x `side` pixels, moved by `stride`, with `pad` zeros around the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Pixels along a side, odd.
    pub side: usize,
    /// Pixels between two windows.
    pub stride: usize,
}

impl Window {
    /// Zeros around the picture, so that a stride of 1 keeps its size.
    pub(super) const fn pad(self) -> usize {
        self.side / 2
    }

    /// Windows along a line of so many pixels.
    #[must_use]
    pub const fn along(self, pixels: usize) -> usize {
        (pixels + 2 * self.pad() - self.side) / self.stride + 1
    }
}

/// From pictures (count, rows, columns, channels) the windows (count, rows', columns', side side channels).
///
/// # Errors
/// Shapes that do not fit.
pub fn unfold(x: &Tensor, window: Window) -> Result<Tensor> {
    let (count, rows, columns, channels) = x.dims4()?;
    let size = [count, rows, columns, channels];
    if has_fused(x.device()) {
        x.contiguous()?.apply_op1(Unfold { size, window })
    } else {
        composed(x, window)
    }
}

/// The same by candle's operations.
pub(super) fn composed(x: &Tensor, window: Window) -> Result<Tensor> {
    let (_, rows, columns, _) = x.dims4()?;
    let pad = window.pad();
    let x = x.pad_with_zeros(1, pad, pad)?.pad_with_zeros(2, pad, pad)?;
    // Every stride-th pixel from `from` on.
    let every = |x: &Tensor, axis: usize, from: usize, n: usize| -> Result<Tensor> {
        let at: Vec<u32> = (0..n).map(|i| (from + i * window.stride) as u32).collect();
        x.index_select(&Tensor::from_vec(at, n, x.device())?, axis)
    };
    let mut taps = Vec::with_capacity(window.side * window.side);
    for i in 0..window.side {
        let lines = every(&x, 1, i, window.along(rows))?;
        for j in 0..window.side {
            taps.push(every(&lines, 2, j, window.along(columns))?);
        }
    }
    Tensor::cat(&taps, 3)
}

/// Pictures and the windows on them.
#[derive(Clone, Copy)]
pub(super) struct Unfold {
    /// Pictures, rows, columns, channels.
    pub(super) size: [usize; 4],
    pub(super) window: Window,
}

impl Unfold {
    /// Shape of the result.
    pub(super) const fn out(&self) -> [usize; 4] {
        let [count, rows, columns, channels] = self.size;
        let w = self.window;
        [count, w.along(rows), w.along(columns), w.side * w.side * channels]
    }

    /// Calls `at(pixel, place)` for each tap of each window on some lines of a picture's windows: offsets of
    /// the picture's pixel and of the tap, from the first of these lines on, in numbers.
    fn taps(&self, lines: Range<usize>, mut at: impl FnMut(usize, usize)) {
        let [_, rows, columns, channels] = self.size;
        let [_, _, wide, row] = self.out();
        let Window { side, stride } = self.window;
        let pad = self.window.pad();
        for y in lines.clone() {
            for x in 0..wide {
                for tap in 0..side * side {
                    let i = (y * stride + tap / side).wrapping_sub(pad);
                    let j = (x * stride + tap % side).wrapping_sub(pad);
                    if i < rows && j < columns {
                        at(
                            (i * columns + j) * channels,
                            ((y - lines.start) * wide + x) * row + tap * channels,
                        );
                    }
                }
            }
        }
    }
}

impl CustomOp1 for Unfold {
    fn name(&self) -> &'static str {
        "unfold"
    }

    fn cpu_fwd(&self, x: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let x = slice(x, layout)?;
        let [count, high, wide, row] = self.out();
        let [_, rows, columns, channels] = self.size;
        let mut out = vec![0.0; count * high * wide * row];
        let pictures = out.par_chunks_mut(high * wide * row).zip(x.par_chunks(rows * columns * channels));
        pictures.for_each(|(out, x)| {
            self.taps(0..high, |pixel, place| {
                out[place..place + channels].copy_from_slice(&x[pixel..pixel + channels]);
            });
        });
        Ok((CpuStorage::F32(out), (count, high, wide, row).into()))
    }

    #[cfg(feature = "cuda")]
    fn cuda_fwd(&self, x: &CudaStorage, layout: &Layout) -> Result<(CudaStorage, Shape)> {
        Ok((atlasfit_cuda::unfold((x, layout), &self.on_gpu())?, (&self.out()).into()))
    }

    fn bwd(&self, _x: &Tensor, _out: &Tensor, gradient: &Tensor) -> Result<Option<Tensor>> {
        Ok(Some(self.fold(gradient)?))
    }
}

impl Unfold {
    #[cfg(feature = "cuda")]
    const fn on_gpu(&self) -> atlasfit_cuda::Windows {
        let [_, high, wide, _] = self.out();
        let Window { side, stride } = self.window;
        atlasfit_cuda::Windows { size: self.size, along: [high, wide], side, stride }
    }

    /// The adjoint: for each number of the pictures the sum of what their windows hold of it.
    pub(super) fn fold(&self, gradient: &Tensor) -> Result<Tensor> {
        let [_, high, wide, row] = self.out();
        let [count, rows, columns, channels] = self.size;
        #[cfg(feature = "cuda")]
        if gradient.device().is_cuda() {
            let fold = |d: atlasfit_cuda::Given<'_>| atlasfit_cuda::fold(d, &self.on_gpu());
            return super::gpu::made(&gradient.contiguous()?, fold, (count, rows, columns, channels));
        }
        with_slice(gradient, |d| {
            let mut dx = vec![0.0; count * rows * columns * channels];
            let pictures = dx.par_chunks_mut(rows * columns * channels).zip(d.par_chunks(high * wide * row));
            pictures.for_each(|(dx, d)| self.fold_lines(0..high, d, dx));
            made(dx, (count, rows, columns, channels))
        })
    }

    /// Adds the windows on some lines of a picture's windows to the picture.
    pub(super) fn fold_lines(&self, lines: Range<usize>, windows: &[f32], picture: &mut [f32]) {
        let channels = self.size[3];
        self.taps(lines, |pixel, place| {
            let pixels = &mut picture[pixel..pixel + channels];
            for (x, d) in pixels.iter_mut().zip(&windows[place..place + channels]) {
                *x += d;
            }
        });
    }
}
