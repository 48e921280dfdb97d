//! Adam (Kingma and Ba 2014) with moments that can be written and read, so that training goes on with the
//! same bytes. Moments and variables change in place, on their device.

use crate::ops::NUMBERS;
use crate::params::Params;
#[cfg(feature = "cuda")]
use candle_core::CudaStorage;
use candle_core::backprop::GradStore;
use candle_core::{CpuStorage, DType, InplaceOp2, Layout, Result, Tensor, bail};
use rayon::prelude::*;

/// Decay of the moments, and what keeps the division finite: the authors' values, PyTorch's defaults.
const BETA: [f32; 2] = [0.9, 0.999];
const EPS: f32 = 1e-8;

/// The state of Adam.
pub struct Adam {
    /// Steps taken.
    pub steps: u64,
    /// First and second moments of each variable's gradient, (2, numbers).
    pub moments: Vec<Tensor>,
}

impl Adam {
    /// Moments of 0.
    ///
    /// # Errors
    /// Those of candle.
    pub fn new(params: &Params) -> Result<Self> {
        let zeros = |n: usize, v: &Tensor| Tensor::zeros((2, n), DType::F32, v.device());
        let moments = params.vars.iter().map(|(_, v)| zeros(v.elem_count(), v)).collect::<Result<_>>()?;
        Ok(Self { steps: 0, moments })
    }

    /// One step with the learning rate `rate`. Variables without a gradient stay.
    ///
    /// # Errors
    /// Those of candle.
    pub fn step(&mut self, params: &Params, gradients: &GradStore, rate: f64) -> Result<()> {
        self.steps += 1;
        let t = i32::try_from(self.steps).unwrap_or(i32::MAX);
        let corrections = BETA.map(|b| 1.0 - f64::from(b).powi(t));
        let (size, root) = ((rate / corrections[0]) as f32, (1.0 / corrections[1]).sqrt() as f32);
        for ((_, var), moments) in params.vars.iter().zip(&self.moments) {
            let Some(gradient) = gradients.get(var.as_tensor()) else { continue };
            moments.inplace_op2(&gradient.contiguous()?, &Decay)?;
            var.inplace_op2(moments, &Move { size, root })?;
        }
        Ok(())
    }
}

/// All numbers behind a layout, to change and to read.
fn parts<'a>(
    changed: &'a mut CpuStorage,
    lc: &Layout,
    read: &'a CpuStorage,
    lr: &Layout,
) -> Result<(&'a mut [f32], &'a [f32])> {
    let (Some((from, to)), Some((a, b))) = (lc.contiguous_offsets(), lr.contiguous_offsets()) else {
        bail!("a variable that does not lie in order")
    };
    let CpuStorage::F32(changed) = changed else { bail!("a variable that is not of f32") };
    Ok((&mut changed[from..to], &read.as_slice::<f32>()?[a..b]))
}

/// Both moments take in a gradient.
struct Decay;

impl InplaceOp2 for Decay {
    fn name(&self) -> &'static str {
        "adam-moments"
    }

    fn cpu_fwd(&self, m: &mut CpuStorage, lm: &Layout, g: &CpuStorage, lg: &Layout) -> Result<()> {
        let (moments, gradient) = parts(m, lm, g, lg)?;
        let (first, second) = moments.split_at_mut(gradient.len());
        let blocks = first.par_chunks_mut(NUMBERS).zip(second.par_chunks_mut(NUMBERS));
        blocks.zip(gradient.par_chunks(NUMBERS)).for_each(|((first, second), gradient)| {
            for ((m, v), g) in first.iter_mut().zip(second).zip(gradient) {
                *m = BETA[0] * *m + (1.0 - BETA[0]) * g;
                *v = BETA[1] * *v + (1.0 - BETA[1]) * g * g;
            }
        });
        Ok(())
    }

    #[cfg(feature = "cuda")]
    fn cuda_fwd(&self, m: &mut CudaStorage, lm: &Layout, g: &CudaStorage, lg: &Layout) -> Result<()> {
        atlasfit_cuda::adam_moments(m, lm, (g, lg), BETA)
    }
}

/// A variable follows its moments.
struct Move {
    /// The step, corrected for the moments that began at 0.
    size: f32,
    /// The correction of the second moments' root.
    root: f32,
}

impl InplaceOp2 for Move {
    fn name(&self) -> &'static str {
        "adam-move"
    }

    fn cpu_fwd(&self, x: &mut CpuStorage, lx: &Layout, m: &CpuStorage, lm: &Layout) -> Result<()> {
        let (values, moments) = parts(x, lx, m, lm)?;
        let (first, second) = moments.split_at(values.len());
        let blocks = values.par_chunks_mut(NUMBERS).zip(first.par_chunks(NUMBERS));
        blocks.zip(second.par_chunks(NUMBERS)).for_each(|((values, first), second)| {
            for ((x, m), v) in values.iter_mut().zip(first).zip(second) {
                *x -= self.size * m / (v.sqrt() * self.root + EPS);
            }
        });
        Ok(())
    }

    #[cfg(feature = "cuda")]
    fn cuda_fwd(&self, x: &mut CudaStorage, lx: &Layout, m: &CudaStorage, lm: &Layout) -> Result<()> {
        atlasfit_cuda::adam_move(x, lx, (m, lm), [self.size, self.root, EPS])
    }
}
