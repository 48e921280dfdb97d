//! Adam (Kingma and Ba 2014) with moments that can be written and read, so that training goes on with the same
//! bytes.

use crate::params::Params;
use candle_core::backprop::GradStore;
use candle_core::{Result, Tensor};

/// Decay of the moments, and what keeps the division finite: the authors' values, PyTorch's defaults.
const BETA: [f64; 2] = [0.9, 0.999];
const EPS: f64 = 1e-8;

/// The state of Adam.
pub struct Adam {
    /// Steps taken.
    pub steps: u64,
    /// First and second moments of each variable's gradient.
    pub moments: Vec<[Tensor; 2]>,
}

impl Adam {
    /// Moments of 0.
    ///
    /// # Errors
    /// Those of candle.
    pub fn new(params: &Params) -> Result<Self> {
        let moments = params
            .vars
            .iter()
            .map(|(_, v)| Ok([v.zeros_like()?, v.zeros_like()?]))
            .collect::<Result<Vec<_>>>()?;
        Ok(Self { steps: 0, moments })
    }

    /// One step with the learning rate `rate`. Variables without a gradient stay.
    ///
    /// # Errors
    /// Those of candle.
    pub fn step(&mut self, params: &Params, gradients: &GradStore, rate: f64) -> Result<()> {
        self.steps += 1;
        let t = i32::try_from(self.steps).unwrap_or(i32::MAX);
        let corrections = BETA.map(|b| 1.0 - b.powi(t));
        for ((_, var), moments) in params.vars.iter().zip(&mut self.moments) {
            let Some(g) = gradients.get(var.as_tensor()) else { continue };
            let g = g.detach();
            let [m, v] = &*moments;
            let m = ((m * BETA[0])? + (&g * (1.0 - BETA[0]))?)?;
            let v = ((v * BETA[1])? + (g.sqr()? * (1.0 - BETA[1]))?)?;
            let size = ((&v / corrections[1])?.sqrt()? + EPS)?;
            let step = ((&m * (rate / corrections[0]))? / size)?;
            var.set(&(var.as_tensor() - step)?)?;
            *moments = [m, v];
        }
        Ok(())
    }
}
