//! One matrix times each of several.

use candle_core::{Result, Tensor};

/// From (rows, inputs) and (groups, inputs, units) the products (groups, rows, units).
///
/// The groups' matrices are laid side by side and multiplied at once. (candle 0.9.2 multiplies a matrix that
/// is
/// broadcast over the groups with the wrong numbers: it takes the groups' matrices to lie side by side.)
///
/// # Errors
/// Shapes that do not fit.
pub fn shared_product(x: &Tensor, weights: &Tensor) -> Result<Tensor> {
    let (groups, inputs, units) = weights.dims3()?;
    if groups == 1 {
        return x.unsqueeze(0)?.matmul(weights);
    }
    let beside = weights.transpose(0, 1)?.contiguous()?.reshape((inputs, groups * units))?;
    x.matmul(&beside)?.reshape((x.dim(0)?, groups, units))?.transpose(0, 1)?.contiguous()
}
