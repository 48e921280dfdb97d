//! Adam (Kingma and Ba 2014) with moments that can be written and read, so that training goes on with the
//! same
//! bytes.

use crate::params::Params;
use candle_core::backprop::GradStore;
use candle_core::{Result, Tensor};

/// Decay of the moments, and what keeps the division finite: the authors' values, PyTorch's defaults.
const BETA: [f32; 2] = [0.9, 0.999];
const EPS: f32 = 1e-8;

/// The state of Adam. Moments lie in main memory, whatever the device.
pub struct Adam {
    /// Steps taken.
    pub steps: u64,
    /// First and second moments of each variable's gradient.
    pub moments: Vec<[Vec<f32>; 2]>,
}

impl Adam {
    /// Moments of 0.
    #[must_use]
    pub fn new(params: &Params) -> Self {
        let zeros = |n: usize| [vec![0.0; n], vec![0.0; n]];
        Self { steps: 0, moments: params.vars.iter().map(|(_, v)| zeros(v.elem_count())).collect() }
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
        for ((_, var), [first, second]) in params.vars.iter().zip(&mut self.moments) {
            let Some(gradient) = gradients.get(var.as_tensor()) else { continue };
            let gradient = gradient.flatten_all()?.to_vec1::<f32>()?;
            let mut values = var.flatten_all()?.to_vec1::<f32>()?;
            for (((x, g), m), v) in values.iter_mut().zip(gradient).zip(first).zip(second) {
                *m = BETA[0] * *m + (1.0 - BETA[0]) * g;
                *v = BETA[1] * *v + (1.0 - BETA[1]) * g * g;
                *x -= size * *m / (v.sqrt() * root + EPS);
            }
            var.set(&Tensor::from_vec(values, var.shape(), var.device())?)?;
        }
        Ok(())
    }
}
