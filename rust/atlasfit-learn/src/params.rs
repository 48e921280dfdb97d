//! The numbers of a model: variables that are trained, and the running moments of batch norm, by name and in
//! the order in which they were made.

use crate::ops::{identity_moments, norm_activate};
use atlasfit::numeric::rng::Rng;
use candle_core::{Device, Result, Shape, Tensor, Var};
use std::sync::{Arc, Mutex};

/// The share of a batch's moments in the running ones: PyTorch's default.
const MOMENTUM: f64 = 0.1;

/// Whether batch norm takes the moments of the batch, or those that ran along in training.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Moments of the batch, which are added to the running ones.
    Train,
    /// Running moments: each answer depends on its own input only.
    Use,
}

/// All numbers of a model.
pub struct Params {
    /// Trained variables.
    pub vars: Vec<(String, Var)>,
    /// Running moments of batch norm, (2, groups, units): mean and variance.
    pub moments: Vec<(String, Arc<Mutex<Tensor>>)>,
    device: Device,
    rng: Rng,
}

impl Params {
    /// None yet; random ones come from `seed`.
    #[must_use]
    pub fn new(seed: u64, device: &Device) -> Self {
        Self { vars: Vec::new(), moments: Vec::new(), device: device.clone(), rng: Rng::new(seed) }
    }

    /// A variable, uniform within 1/sqrt(`inputs`): PyTorch's default for linear layers and convolutions.
    pub(crate) fn uniform(&mut self, name: &str, shape: impl Into<Shape>, inputs: usize) -> Result<Tensor> {
        let bound = 1.0 / (inputs as f64).sqrt();
        let shape = shape.into();
        let mut random = || ((2.0 * self.rng.uniform() - 1.0) * bound) as f32;
        let values = (0..shape.elem_count()).map(|_| random()).collect();
        self.var(name, values, shape)
    }

    fn var(&mut self, name: &str, values: Vec<f32>, shape: Shape) -> Result<Tensor> {
        let var = Var::from_tensor(&Tensor::from_vec(values, shape, &self.device)?)?;
        let tensor = var.as_tensor().clone();
        self.vars.push((name.to_owned(), var));
        Ok(tensor)
    }

    /// Batch norm of so many units in each of so many groups, then negative values times `slope`.
    pub(crate) fn norm(&mut self, name: &str, groups: usize, units: usize, slope: f32) -> Result<Norm> {
        let n = groups * units;
        let gain = self.var(&format!("{name}.gain"), vec![1.0; n], (groups, units).into())?;
        let shift = self.var(&format!("{name}.shift"), vec![0.0; n], (groups, units).into())?;
        let moments = Arc::new(Mutex::new(identity_moments(groups, units, &self.device)?));
        self.moments.push((name.to_owned(), moments.clone()));
        Ok(Norm { gain, shift, slope, moments })
    }

    /// How many numbers are trained.
    #[must_use]
    pub fn count(&self) -> usize {
        self.vars.iter().map(|(_, v)| v.elem_count()).sum()
    }

    /// How many of these belong to a part of the model, by the beginning of their names.
    #[must_use]
    pub fn count_of(&self, part: &str) -> usize {
        self.vars.iter().filter(|(name, _)| name.starts_with(part)).map(|(_, v)| v.elem_count()).sum()
    }
}

/// Batch norm with what follows it.
pub(crate) struct Norm {
    gain: Tensor,
    shift: Tensor,
    slope: f32,
    moments: Arc<Mutex<Tensor>>,
}

impl Norm {
    /// From (groups, rows, units) the same shape.
    pub(crate) fn forward(&self, x: &Tensor, mode: Mode) -> Result<Tensor> {
        let mut running = self.moments.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if mode == Mode::Use {
            return Ok(norm_activate(x, &self.gain, &self.shift, self.slope, Some(&running))?.0);
        }
        let (y, of_batch) = norm_activate(x, &self.gain, &self.shift, self.slope, None)?;
        // As in PyTorch, the running variance is that of the population.
        let rows = x.dim(1)? as f64;
        let unbiased = Tensor::new(&[1.0, (rows / (rows - 1.0).max(1.0)) as f32], x.device())?;
        let new = of_batch.broadcast_mul(&unbiased.reshape((2, 1, 1))?)?;
        *running = ((&*running * (1.0 - MOMENTUM))? + (new * MOMENTUM)?)?;
        Ok(y)
    }
}
