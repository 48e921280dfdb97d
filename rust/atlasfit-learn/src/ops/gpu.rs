//! What the gradients of the operations need of the GPU: from tensors to tensors, by the kernels of
//! `atlasfit-cuda`.

use atlasfit_cuda::{Given, NormSize};
use candle_core::op::BackpropOp;
use candle_core::{CudaStorage, Result, Shape, Storage, Tensor, bail};

/// Calls `f` with the numbers of a tensor on the GPU.
pub(crate) fn with<T>(x: &Tensor, f: impl FnOnce(Given<'_>) -> Result<T>) -> Result<T> {
    let (storage, layout) = x.storage_and_layout();
    match &*storage {
        Storage::Cuda(storage) => f((storage, layout)),
        _ => bail!("a tensor of another device than the GPU"),
    }
}

/// A tensor of what a kernel makes of one.
pub(crate) fn made(
    x: &Tensor,
    kernel: impl FnOnce(Given<'_>) -> Result<CudaStorage>,
    shape: impl Into<Shape>,
) -> Result<Tensor> {
    Ok(Tensor::from_storage(Storage::Cuda(with(x, kernel)?), shape, BackpropOp::none(), false))
}

pub(super) fn some(packed: &Option<Tensor>) -> Result<&Tensor> {
    packed.as_ref().ok_or_else(|| candle_core::Error::Msg("moments of another device than the GPU".into()))
}

/// Moments, gain and shift in one tensor (4, groups, units); `None` on another device.
pub(super) fn packed(moments: &Tensor, gain: &Tensor, shift: &Tensor) -> Result<Option<Tensor>> {
    if !moments.device().is_cuda() {
        return Ok(None);
    }
    let [gain, shift] = [gain, shift].map(|x| x.detach().unsqueeze(0));
    Ok(Some(Tensor::cat(&[moments, &gain?, &shift?], 0)?))
}

/// The gradient of the values of a batch norm, and those of shift and gain, (2, groups, units).
pub(super) fn norm_gradient(
    gradient: &Tensor,
    x: &Tensor,
    packed: &Tensor,
    norm: &NormSize,
    fixed: bool,
) -> Result<(Tensor, Tensor)> {
    let [groups, _, units] = norm.size;
    let (d, x) = (gradient.contiguous()?, x.contiguous()?);
    let kernel = |d: Given<'_>| with(&x, |x| with(packed, |p| atlasfit_cuda::norm_sums(d, x, p, norm)));
    let sums = made(&d, kernel, (2, groups, units))?;
    let kernel = |d: Given<'_>| {
        with(&x, |x| with(packed, |p| with(&sums, |s| atlasfit_cuda::norm_gradient(d, x, p, s, norm, fixed))))
    };
    Ok((made(&d, kernel, &norm.size)?, sums))
}
