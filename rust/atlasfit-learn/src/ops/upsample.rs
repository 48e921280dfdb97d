//! Pictures of twice the size, bilinear: half-pixel centres, clamped at the border, as in the paper's
//! convolutional networks of `atlasfit-net`.

use super::{has_fused, made, slice, with_slice};
#[cfg(feature = "cuda")]
use candle_core::CudaStorage;
use candle_core::{CpuStorage, CustomOp1, Device, Layout, Result, Shape, Tensor};
use rayon::prelude::*;

/// From pictures (count, side, side, channels) those of twice the side.
///
/// # Errors
/// Shapes that do not fit.
pub fn upsample(x: &Tensor) -> Result<Tensor> {
    let (count, side, _, channels) = x.dims4()?;
    if has_fused(x.device()) {
        x.contiguous()?.apply_op1(Upsample { size: [count, side, channels] })
    } else {
        composed(x)
    }
}

/// The same by candle's operations.
pub(super) fn composed(x: &Tensor) -> Result<Tensor> {
    let (count, side, _, channels) = x.dims4()?;
    // Rows first, then columns, each by one small matrix.
    let twice = matrix(side, x.device())?;
    let x = x.reshape((count, side, side * channels))?;
    let x = twice.broadcast_as((count, 2 * side, side))?.contiguous()?.matmul(&x)?;
    let x = x.reshape((count * 2 * side, side, channels))?;
    let x = twice.broadcast_as((count * 2 * side, 2 * side, side))?.contiguous()?.matmul(&x)?;
    x.reshape((count, 2 * side, 2 * side, channels))
}

/// The two lines that line `i` of the result is made of, with their weights.
const fn sources(i: usize, side: usize) -> [(usize, f32); 2] {
    let near = i / 2;
    let far = if i.is_multiple_of(2) {
        near.saturating_sub(1)
    } else if near + 1 < side {
        near + 1
    } else {
        near
    };
    [(near, 0.75), (far, 0.25)]
}

/// The weights of `side` lines in 2 `side` lines.
fn matrix(side: usize, device: &Device) -> Result<Tensor> {
    let mut weights = vec![0.0f32; 2 * side * side];
    for i in 0..2 * side {
        for (from, weight) in sources(i, side) {
            weights[i * side + from] += weight;
        }
    }
    Tensor::from_vec(weights, (2 * side, side), device)
}

struct Upsample {
    /// Pictures, side before, channels.
    size: [usize; 3],
}

impl Upsample {
    /// Calls `at(to, from, weight)` for each pixel of the result and each of the four that it is made of:
    /// offsets in numbers.
    fn taps(&self, mut at: impl FnMut(usize, usize, f32)) {
        let [_, side, channels] = self.size;
        for i in 0..2 * side {
            for j in 0..2 * side {
                for (a, wa) in sources(i, side) {
                    for (b, wb) in sources(j, side) {
                        at((i * 2 * side + j) * channels, (a * side + b) * channels, wa * wb);
                    }
                }
            }
        }
    }
}

/// Adds `weight` times `x` to `y`.
fn add(y: &mut [f32], x: &[f32], weight: f32) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += weight * x;
    }
}

impl CustomOp1 for Upsample {
    fn name(&self) -> &'static str {
        "upsample"
    }

    fn cpu_fwd(&self, x: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let x = slice(x, layout)?;
        let [count, side, n] = self.size;
        let mut out = vec![0.0; 4 * x.len()];
        out.par_chunks_mut(4 * side * side * n).zip(x.par_chunks(side * side * n)).for_each(|(out, x)| {
            self.taps(|to, from, weight| add(&mut out[to..to + n], &x[from..from + n], weight));
        });
        Ok((CpuStorage::F32(out), (count, 2 * side, 2 * side, n).into()))
    }

    #[cfg(feature = "cuda")]
    fn cuda_fwd(&self, x: &CudaStorage, layout: &Layout) -> Result<(CudaStorage, Shape)> {
        let [count, side, n] = self.size;
        Ok((atlasfit_cuda::upsample((x, layout), self.size)?, (count, 2 * side, 2 * side, n).into()))
    }

    fn bwd(&self, _x: &Tensor, _out: &Tensor, gradient: &Tensor) -> Result<Option<Tensor>> {
        let [count, side, n] = self.size;
        #[cfg(feature = "cuda")]
        if gradient.device().is_cuda() {
            let adjoint = |d: atlasfit_cuda::Given<'_>| atlasfit_cuda::upsample_adjoint(d, self.size);
            return Ok(Some(super::gpu::made(&gradient.contiguous()?, adjoint, (count, side, side, n))?));
        }
        with_slice(gradient, |d| {
            let mut dx = vec![0.0; d.len() / 4];
            dx.par_chunks_mut(side * side * n).zip(d.par_chunks(4 * side * side * n)).for_each(|(dx, d)| {
                self.taps(|to, from, weight| add(&mut dx[from..from + n], &d[to..to + n], weight));
            });
            Ok(Some(made(dx, (count, side, side, n))?))
        })
    }
}
