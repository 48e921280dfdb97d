//! One matrix times each of several.

use candle_core::{Result, Tensor};

/// From (rows, inputs) and (groups, inputs, units) the products (groups, rows, units).
///
/// Either the groups' matrices are laid side by side and multiplied at once, or the rows are copied for each
/// group, whichever copies less. (candle 0.9.2 multiplies a matrix that is broadcast over the groups with the
/// wrong numbers: it takes the groups' matrices to lie side by side.)
///
/// # Errors
/// Shapes that do not fit.
pub fn shared_product(x: &Tensor, weights: &Tensor) -> Result<Tensor> {
    let ((rows, _), (groups, inputs, units)) = (x.dims2()?, weights.dims3()?);
    if groups == 1 {
        return x.unsqueeze(0)?.matmul(weights);
    }
    if rows < units {
        return x.broadcast_left(groups)?.contiguous()?.matmul(weights);
    }
    let beside = weights.transpose(0, 1)?.contiguous()?.reshape((inputs, groups * units))?;
    x.matmul(&beside)?.reshape((rows, groups, units))?.transpose(0, 1)?.contiguous()
}
