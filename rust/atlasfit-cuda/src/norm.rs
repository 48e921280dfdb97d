//! Batch norm with what follows it: the twin of `ops::norm`. `packed` are mean, variance, gain and shift, (4,
//! groups, units).

use crate::launch::{Call, Given, Input, index, view};
use candle_core::backend::BackendStorage;
use candle_core::{CudaStorage, Result};

/// A block's units and rows, as in kernels.cu.
const TILE: (u32, u32, u32) = (32, 8, 1);
/// Rows that a block adds up at least: enough work to hide its start.
const RUN: usize = 256;
/// Runs of rows at most: their sums are added by one more launch.
const RUNS: usize = 128;

/// A normalisation.
#[derive(Debug, Clone, Copy)]
pub struct NormSize {
    /// Groups, rows, units.
    pub size: [usize; 3],
    /// Factor of negative results.
    pub slope: f32,
    /// Added to variances.
    pub eps: f32,
}

impl NormSize {
    fn total(&self) -> Result<u32> {
        index(self.size.iter().product())
    }

    /// Sums over the rows by `name`, whose inputs end with the values: (2, groups, units), as they are or as
    /// mean and variance.
    fn sums(
        &self,
        name: &str,
        inputs: &[Given<'_>],
        factors: &[f32],
        as_moments: bool,
    ) -> Result<CudaStorage> {
        self.total()?;
        let [groups, rows, units] = self.size;
        let run = RUN.max(rows.div_ceil(RUNS));
        let runs = rows.div_ceil(run).max(1);
        let sizes = [index(groups)?, index(rows)?, index(units)?, index(run)?];
        let x = inputs[usize::from(!as_moments)];
        let views = inputs.iter().map(|&given| view(given)).collect::<Result<Vec<_>>>()?;
        let grid = [(sizes[2].div_ceil(TILE.0), index(runs)?, sizes[0]), TILE];
        let parts = Call { name, grid, inputs: &views, sizes: &sizes, factors };
        let all = groups * units;
        let parts = parts.make::<f32>(x.0.device(), 2 * runs * all)?;
        let parts = Input::Real(parts.as_cuda_slice::<f32>()?.slice(..));
        let sizes = [index(all)?, sizes[2], sizes[1], index(runs)?, u32::from(as_moments)];
        let grid = [(sizes[0].div_ceil(TILE.0), 1, 1), TILE];
        let inputs = [parts, view(x)?];
        let total = Call { name: "norm_total", grid, inputs: &inputs, sizes: &sizes, factors: &[] };
        total.make::<f32>(x.0.device(), 2 * all)
    }
}

/// Mean and variance (not corrected for the count) of each unit of each group, (2, groups, units).
///
/// # Errors
/// Those of candle; more numbers than 32 bits count.
pub fn norm_moments(x: Given<'_>, size: [usize; 3]) -> Result<CudaStorage> {
    NormSize { size, slope: 1.0, eps: 0.0 }.sums("norm_moments", &[x], &[], true)
}

/// The values, normalised, scaled, shifted, negative ones times the slope.
///
/// # Errors
/// As [`norm_moments`].
pub fn norm_apply(x: Given<'_>, packed: Given<'_>, norm: &NormSize) -> Result<CudaStorage> {
    let [groups, rows, units] = norm.size;
    let sizes = [norm.total()?, index(groups * units)?, index(rows)?, index(units)?];
    let inputs = [view(x)?, view(packed)?];
    let (grid, factors) = (Call::threads(sizes[0]), [norm.slope, norm.eps]);
    let call = Call { name: "norm_apply", grid, inputs: &inputs, sizes: &sizes, factors: &factors };
    call.make::<f32>(x.0.device(), groups * rows * units)
}

/// Sums over the rows of the gradient before the slope, and of its product with the normalised values: the
/// gradients of shift and gain, (2, groups, units).
///
/// # Errors
/// As [`norm_moments`].
pub fn norm_sums(d: Given<'_>, x: Given<'_>, packed: Given<'_>, norm: &NormSize) -> Result<CudaStorage> {
    norm.sums("norm_sums", &[d, x, packed], &[norm.slope, norm.eps], false)
}

/// The gradient of the values from that of the result and its `sums`; with `fixed` moments these are
/// constants.
///
/// # Errors
/// As [`norm_moments`].
pub fn norm_gradient(
    d: Given<'_>,
    x: Given<'_>,
    packed: Given<'_>,
    sums: Given<'_>,
    norm: &NormSize,
    fixed: bool,
) -> Result<CudaStorage> {
    let [groups, rows, units] = norm.size;
    let sizes = [norm.total()?, index(groups * units)?, index(rows)?, index(units)?, u32::from(fixed)];
    let inputs = [view(d)?, view(x)?, view(packed)?, view(sums)?];
    let (grid, factors) = (Call::threads(sizes[0]), [norm.slope, norm.eps]);
    let call = Call { name: "norm_gradient", grid, inputs: &inputs, sizes: &sizes, factors: &factors };
    call.make::<f32>(x.0.device(), groups * rows * units)
}
