//! Convolutions as one matrix product of the windows, with a gradient that keeps the windows' own in no sum.

use super::unfold::Unfold;
use super::{Window, has_fused, unfold};
#[cfg(feature = "cuda")]
use candle_core::CudaStorage;
use candle_core::backend::BackendStorage;
use candle_core::{CpuStorage, CustomOp2, Layout, Result, Shape, Storage, Tensor, bail};

/// Convolutions of pictures (groups count, rows, columns, channels), each group with weights of its own
/// (groups, side side channels, outputs): (groups, count rows' columns', outputs).
///
/// # Errors
/// Shapes that do not fit.
pub fn conv(x: &Tensor, weights: &Tensor, window: Window) -> Result<Tensor> {
    let (groups, inputs, outputs) = weights.dims3()?;
    if !has_fused(x.device()) {
        return unfold(x, window)?.reshape((groups, (), inputs))?.matmul(weights);
    }
    let (count, rows, columns, channels) = x.dims4()?;
    let seen = unfold(&x.detach(), window)?.reshape((groups, (), inputs))?;
    let unfold = Unfold { size: [count, rows, columns, channels], window };
    let size = [groups, seen.dim(1)?, inputs, outputs];
    x.apply_op2(&weights.contiguous()?, Conv { seen, unfold, size, wanted: x.track_op() })
}

/// Calls `f`, whose products an NVIDIA GPU makes of factors of 10 bits (TF32): several times as fast, and
/// PyTorch's default for convolutions.
fn rounded<T>(f: impl FnOnce() -> Result<T>) -> Result<T> {
    #[cfg(feature = "cuda")]
    candle_core::cuda_backend::set_gemm_reduced_precision_f32(true);
    let result = f();
    #[cfg(feature = "cuda")]
    candle_core::cuda_backend::set_gemm_reduced_precision_f32(false);
    result
}

struct Conv {
    /// The windows, (groups, rows, inputs).
    seen: Tensor,
    unfold: Unfold,
    /// Groups, rows, inputs, outputs.
    size: [usize; 4],
    /// Whether the pictures' gradient is.
    wanted: bool,
}

impl Conv {
    fn product<B: BackendStorage>(
        &self,
        seen: &B,
        at: &Layout,
        weights: &B,
        l: &Layout,
    ) -> Result<(B, Shape)> {
        let [groups, rows, inputs, outputs] = self.size;
        let product = seen.matmul(weights, (groups, rows, outputs, inputs), at, l)?;
        Ok((product, (groups, rows, outputs).into()))
    }
}

impl CustomOp2 for Conv {
    fn name(&self) -> &'static str {
        "conv"
    }

    fn cpu_fwd(
        &self,
        _x: &CpuStorage,
        _lx: &Layout,
        weights: &CpuStorage,
        l: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (seen, at) = self.seen.storage_and_layout();
        match &*seen {
            Storage::Cpu(seen) => self.product(seen, at, weights, l),
            _ => bail!("windows on another device than the weights"),
        }
    }

    #[cfg(feature = "cuda")]
    fn cuda_fwd(
        &self,
        _x: &CudaStorage,
        _lx: &Layout,
        weights: &CudaStorage,
        l: &Layout,
    ) -> Result<(CudaStorage, Shape)> {
        let (seen, at) = self.seen.storage_and_layout();
        match &*seen {
            Storage::Cuda(seen) => rounded(|| self.product(seen, at, weights, l)),
            _ => bail!("windows on another device than the weights"),
        }
    }

    fn bwd(
        &self,
        _x: &Tensor,
        weights: &Tensor,
        _y: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        let d = gradient.contiguous()?;
        let of_weights = rounded(|| self.seen.t()?.matmul(&d))?;
        let of_pictures = match self.wanted {
            true => Some(self.unfold.fold(&rounded(|| d.matmul(&weights.t()?))?)?),
            false => None,
        };
        Ok((of_pictures, Some(of_weights)))
    }
}
