//! Adam: the twin of `atlasfit_learn::adam`. Both change numbers in place.

use crate::launch::{Call, Given, index, view};
use candle_core::backend::BackendStorage;
use candle_core::{CudaStorage, Layout, Result, bail};

/// Calls a kernel that changes `numbers` numbers, for each of `n`, by those of another tensor.
fn change(
    name: &str,
    (changed, layout): (&mut CudaStorage, &Layout),
    by: Given<'_>,
    [numbers, n]: [usize; 2],
    factors: &[f32],
) -> Result<()> {
    if layout.contiguous_offsets() != Some((0, numbers)) {
        bail!("a variable that is a part of another tensor");
    }
    index(numbers)?;
    let (sizes, inputs) = ([index(n)?], [view(by)?]);
    let device = changed.device().clone();
    let call = Call { name, grid: Call::threads(sizes[0]), inputs: &inputs, sizes: &sizes, factors };
    call.fill(&device, changed.as_cuda_slice_mut::<f32>()?)
}

/// Both moments (2, n) of a gradient, with the decays `beta`.
///
/// # Errors
/// Those of candle; more numbers than 32 bits count.
pub fn adam_moments(
    moments: &mut CudaStorage,
    layout: &Layout,
    gradient: Given<'_>,
    beta: [f32; 2],
) -> Result<()> {
    let n = gradient.1.shape().elem_count();
    change("adam_moments", (moments, layout), gradient, [2 * n, n], &beta)
}

/// Moves the numbers by their moments: `factors` are the size of the step, the second moments' correction and
/// what keeps the division finite.
///
/// # Errors
/// As [`adam_moments`].
pub fn adam_move(
    values: &mut CudaStorage,
    layout: &Layout,
    moments: Given<'_>,
    factors: [f32; 3],
) -> Result<()> {
    let n = layout.shape().elem_count();
    index(moments.1.shape().elem_count())?;
    change("adam_move", (values, layout), moments, [n, n], &factors)
}
