//! Adam: the twin of `atlasfit_learn::adam`. Both change numbers in place.

use crate::launch::{Call, Given, index, view};
use candle_core::backend::BackendStorage;
use candle_core::{CudaStorage, Layout, Result};

/// The numbers behind a layout that covers them all.
fn whole(layout: &Layout, len: usize) -> Result<u32> {
    match layout.contiguous_offsets() {
        Some((0, to)) if to == len => index(len),
        _ => candle_core::bail!("a variable that is a part of another tensor"),
    }
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
    let inputs = [view(gradient)?];
    let on = moments.device().clone();
    let out = moments.as_cuda_slice_mut::<f32>()?;
    let n = whole(layout, gradient.1.shape().elem_count() * 2)? / 2;
    let call =
        Call { name: "adam_moments", grid: Call::threads(n), inputs: &inputs, sizes: &[n], factors: &beta };
    call.fill(&on, out)
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
    let inputs = [view(moments)?];
    let on = values.device().clone();
    let out = values.as_cuda_slice_mut::<f32>()?;
    let n = whole(layout, moments.1.shape().elem_count() / 2)?;
    let call =
        Call { name: "adam_move", grid: Call::threads(n), inputs: &inputs, sizes: &[n], factors: &factors };
    call.fill(&on, out)
}
