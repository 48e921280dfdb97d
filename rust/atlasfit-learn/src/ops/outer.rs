//! Sums of every row of one matrix with every row of another: what a layer's units get from a shape and from
//! a place of its chart, without a copy of the shape's numbers at each place.

use super::{has_fused, made, slice, with_slice};
#[cfg(feature = "cuda")]
use candle_core::CudaStorage;
use candle_core::{CpuStorage, CustomOp2, Layout, Result, Shape, Tensor};
use rayon::prelude::*;

/// From (groups, a, units) and (groups, b, units) the sums (groups, a, b, units).
///
/// # Errors
/// Shapes that do not fit.
pub fn outer_add(x: &Tensor, y: &Tensor) -> Result<Tensor> {
    let ((groups, a, units), (_, b, _)) = (x.dims3()?, y.dims3()?);
    if has_fused(x.device()) {
        x.contiguous()?.apply_op2(&y.contiguous()?, OuterAdd { size: [groups, a, b, units] })
    } else {
        x.unsqueeze(2)?.broadcast_add(&y.unsqueeze(1)?)
    }
}

struct OuterAdd {
    /// Groups, rows of the first, rows of the second, units.
    size: [usize; 4],
}

impl CustomOp2 for OuterAdd {
    fn name(&self) -> &'static str {
        "outer-add"
    }

    fn cpu_fwd(
        &self,
        x: &CpuStorage,
        lx: &Layout,
        y: &CpuStorage,
        ly: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (x, y) = (slice(x, lx)?, slice(y, ly)?);
        let [groups, a, b, units] = self.size;
        let mut out = vec![0.0; groups * a * b * units];
        out.par_chunks_mut(b * units).enumerate().for_each(|(i, out)| {
            let x = &x[i * units..][..units];
            let y = &y[i / a * b * units..][..b * units];
            for (out, y) in out.chunks_exact_mut(units).zip(y.chunks_exact(units)) {
                for ((o, x), y) in out.iter_mut().zip(x).zip(y) {
                    *o = x + y;
                }
            }
        });
        Ok((CpuStorage::F32(out), (groups, a, b, units).into()))
    }

    #[cfg(feature = "cuda")]
    fn cuda_fwd(
        &self,
        x: &CudaStorage,
        lx: &Layout,
        y: &CudaStorage,
        ly: &Layout,
    ) -> Result<(CudaStorage, Shape)> {
        Ok((atlasfit_cuda::outer_add((x, lx), (y, ly), self.size)?, (&self.size).into()))
    }

    fn bwd(
        &self,
        _x: &Tensor,
        _y: &Tensor,
        _out: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        let [groups, a, b, units] = self.size;
        #[cfg(feature = "cuda")]
        if gradient.device().is_cuda() {
            let d = gradient.contiguous()?;
            let sums = |size: [usize; 3], shape: [usize; 3]| {
                super::gpu::made(&d, |d| atlasfit_cuda::sum_middle(d, size), &shape)
            };
            let of_x = sums([groups * a, b, units], [groups, a, units])?;
            return Ok((Some(of_x), Some(sums([groups, a, b * units], [groups, b, units])?)));
        }
        with_slice(gradient, |d| {
            let mut dx = vec![0.0; groups * a * units];
            dx.par_chunks_mut(units).enumerate().for_each(|(i, dx)| {
                add_rows(dx, d[i * b * units..][..b * units].chunks_exact(units));
            });
            let mut dy = vec![0.0; groups * b * units];
            dy.par_chunks_mut(units).enumerate().for_each(|(i, dy)| {
                let (group, row) = (i / b, i % b);
                let all = d[group * a * b * units..][..a * b * units].chunks_exact(units);
                add_rows(dy, all.skip(row).step_by(b));
            });
            Ok((Some(made(dx, (groups, a, units))?), Some(made(dy, (groups, b, units))?)))
        })
    }
}

/// Adds rows to a sum, in order.
fn add_rows<'a>(sum: &mut [f32], rows: impl Iterator<Item = &'a [f32]>) {
    for row in rows {
        for (s, x) in sum.iter_mut().zip(row) {
            *s += x;
        }
    }
}
