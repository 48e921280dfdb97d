//! What ends a decoder: a bias and the hyperbolic tangent, in one pass over the values.

use super::norm::BLOCK;
use super::{made, slice, with_slice};
use candle_core::{CpuStorage, CustomOp2, Layout, Result, Shape, Tensor};
use rayon::prelude::*;

/// From (groups, rows, units) and a bias (groups, 1, units) the tangents of their sums.
///
/// # Errors
/// Shapes that do not fit.
pub fn bias_tanh(x: &Tensor, bias: &Tensor) -> Result<Tensor> {
    let (groups, rows, units) = x.dims3()?;
    if !x.device().is_cpu() {
        return x.broadcast_add(bias)?.tanh();
    }
    x.contiguous()?.apply_op2(&bias.contiguous()?, BiasTanh { size: [groups, rows, units] })
}

struct BiasTanh {
    /// Groups, rows, units.
    size: [usize; 3],
}

impl CustomOp2 for BiasTanh {
    fn name(&self) -> &'static str {
        "bias-tanh"
    }

    fn cpu_fwd(
        &self,
        x: &CpuStorage,
        lx: &Layout,
        bias: &CpuStorage,
        l: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (x, bias) = (slice(x, lx)?, slice(bias, l)?);
        let [groups, rows, units] = self.size;
        let mut out = vec![0.0; x.len()];
        let of_groups = out.par_chunks_mut(rows * units).zip(x.par_chunks(rows * units));
        of_groups.zip(bias.par_chunks(units)).for_each(|((out, x), bias)| {
            let blocks = out.par_chunks_mut(BLOCK * units).zip(x.par_chunks(BLOCK * units));
            blocks.for_each(|(out, x)| {
                for ((y, x), b) in out.iter_mut().zip(x).zip(bias.iter().cycle()) {
                    *y = (x + b).tanh();
                }
            });
        });
        Ok((CpuStorage::F32(out), (groups, rows, units).into()))
    }

    fn bwd(
        &self,
        _x: &Tensor,
        _bias: &Tensor,
        y: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        let [groups, rows, units] = self.size;
        with_slice(y, |y| {
            with_slice(gradient, |d| {
                let mut dx = vec![0.0; y.len()];
                let of_groups = dx.par_chunks_mut(rows * units).zip(y.par_chunks(rows * units));
                let sums: Vec<Vec<f32>> = of_groups
                    .zip(d.par_chunks(rows * units))
                    .map(|((dx, y), d)| {
                        let mut sum = vec![0.0f64; units];
                        let lines = dx.chunks_exact_mut(units).zip(y.chunks_exact(units));
                        for ((dx, y), d) in lines.zip(d.chunks_exact(units)) {
                            for (((dx, y), d), s) in dx.iter_mut().zip(y).zip(d).zip(&mut sum) {
                                *dx = d * (1.0 - y * y);
                                *s += f64::from(*dx);
                            }
                        }
                        sum.into_iter().map(|s| s as f32).collect()
                    })
                    .collect();
                let of_bias = made(sums.concat(), (groups, 1, units))?;
                Ok((Some(made(dx, (groups, rows, units))?), Some(of_bias)))
            })
        })
    }
}
