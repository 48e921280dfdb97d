//! Where two ways through a residual network meet: ReLU of their sum, in one pass over the values.

use super::{NUMBERS, made, slice, with_slice};
use candle_core::{CpuStorage, CustomOp2, Layout, Result, Shape, Tensor};
use rayon::prelude::*;

/// ReLU of the sum of two tensors of one shape.
///
/// # Errors
/// Shapes that do not fit.
pub fn add_relu(x: &Tensor, y: &Tensor) -> Result<Tensor> {
    if !x.device().is_cpu() {
        return (x + y)?.relu();
    }
    x.contiguous()?.apply_op2(&y.contiguous()?, AddRelu)
}

struct AddRelu;

impl CustomOp2 for AddRelu {
    fn name(&self) -> &'static str {
        "add-relu"
    }

    fn cpu_fwd(
        &self,
        x: &CpuStorage,
        lx: &Layout,
        y: &CpuStorage,
        ly: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (x, y) = (slice(x, lx)?, slice(y, ly)?);
        let mut out = vec![0.0; x.len()];
        let blocks = out.par_chunks_mut(NUMBERS).zip(x.par_chunks(NUMBERS)).zip(y.par_chunks(NUMBERS));
        blocks.for_each(|((out, x), y)| {
            for ((o, x), y) in out.iter_mut().zip(x).zip(y) {
                *o = (x + y).max(0.0);
            }
        });
        Ok((CpuStorage::F32(out), lx.shape().clone()))
    }

    fn bwd(
        &self,
        _x: &Tensor,
        _y: &Tensor,
        out: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        with_slice(out, |out| {
            with_slice(gradient, |d| {
                let mut of_both = vec![0.0; d.len()];
                let blocks = of_both.par_chunks_mut(NUMBERS).zip(out.par_chunks(NUMBERS));
                blocks.zip(d.par_chunks(NUMBERS)).for_each(|((to, out), d)| {
                    for ((t, o), d) in to.iter_mut().zip(out).zip(d) {
                        *t = if *o > 0.0 { *d } else { 0.0 };
                    }
                });
                let of_both = made(of_both, gradient.shape())?;
                Ok((Some(of_both.clone()), Some(of_both)))
            })
        })
    }
}
