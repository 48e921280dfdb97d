//! The numbers of a model: variables that are trained, and the running moments of batch norm, by name and in
//! the order in which they were made.

use crate::ops::{identity_moments, norm_activate, outer_norm};
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
        self.run(x.dim(1)?, mode, |given| norm_activate(x, &self.gain, &self.shift, self.slope, given))
    }

    /// From (groups, a, units) and (groups, b, units) the same of the sums of all pairs of rows, (groups,
    /// a b, units).
    pub(crate) fn forward_outer(&self, x: &Tensor, y: &Tensor, mode: Mode) -> Result<Tensor> {
        let run = |given: Option<&Tensor>| outer_norm([x, y], &self.gain, &self.shift, self.slope, given);
        self.run(x.dim(1)? * y.dim(1)?, mode, run)
    }

    /// Calls `norm` with the moments to take, and adds those of a batch to the running ones.
    fn run(
        &self,
        rows: usize,
        mode: Mode,
        norm: impl FnOnce(Option<&Tensor>) -> Result<(Tensor, Tensor)>,
    ) -> Result<Tensor> {
        let mut running = self.moments.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if mode == Mode::Use {
            return Ok(norm(Some(&running))?.0);
        }
        let (y, of_batch) = norm(None)?;
        // As in PyTorch, the running variance is that of the population.
        let rows = rows as f64;
        let unbiased = Tensor::new(&[1.0, (rows / (rows - 1.0).max(1.0)) as f32], y.device())?;
        let new = of_batch.broadcast_mul(&unbiased.reshape((2, 1, 1))?)?;
        *running = ((&*running * (1.0 - MOMENTUM))? + (new * MOMENTUM)?)?;
        Ok(y)
    }
}
