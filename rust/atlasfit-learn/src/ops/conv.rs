//! Convolutions: on a GPU one matrix product of the windows, with a gradient that keeps the windows' own in
//! no sum; on a CPU those of `direct`.

use super::direct::Direct;
use super::unfold::Unfold;
use super::{Window, has_fused, made, slice, unfold, with_slice};
use candle_core::{CpuStorage, CustomOp2, Layout, Result, Shape, Tensor};
#[cfg(feature = "cuda")]
use candle_core::{CudaStorage, backend::BackendStorage, bail};

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
    let seen = match x.device().is_cpu() {
        true => None,
        false => Some(unfold(&x.detach(), window)?.reshape((groups, (), inputs))?),
    };
    let direct =
        Direct { groups, unfold: Unfold { size: [count, rows, columns, channels], window }, outputs };
    x.contiguous()?.apply_op2(&weights.contiguous()?, Conv { seen, direct, wanted: x.track_op() })
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
    /// On a GPU the windows, (groups, rows, inputs).
    seen: Option<Tensor>,
    direct: Direct,
    /// Whether the pictures' gradient is.
    wanted: bool,
}

impl Conv {
    /// Of the result: groups, rows, outputs.
    fn shape(&self) -> Shape {
        let [count, high, wide, _] = self.direct.unfold.out();
        (self.direct.groups, count * high * wide / self.direct.groups, self.direct.outputs).into()
    }

    /// The gradients on a CPU.
    fn on_cpu(
        &self,
        x: &Tensor,
        weights: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        with_slice(gradient, |d| {
            let of_weights = with_slice(x, |x| made(self.direct.of_weights(x, d), weights.shape()))?;
            let of_pictures = match self.wanted {
                true => Some(with_slice(weights, |w| made(self.direct.of_pictures(d, w), x.shape()))?),
                false => None,
            };
            Ok((of_pictures, Some(of_weights)))
        })
    }
}

impl CustomOp2 for Conv {
    fn name(&self) -> &'static str {
        "conv"
    }

    fn cpu_fwd(
        &self,
        x: &CpuStorage,
        lx: &Layout,
        weights: &CpuStorage,
        l: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        Ok((CpuStorage::F32(self.direct.forward(slice(x, lx)?, slice(weights, l)?)), self.shape()))
    }

    #[cfg(feature = "cuda")]
    fn cuda_fwd(
        &self,
        _x: &CudaStorage,
        _lx: &Layout,
        weights: &CudaStorage,
        l: &Layout,
    ) -> Result<(CudaStorage, Shape)> {
        let Some(seen) = &self.seen else { bail!("no windows on the GPU") };
        let (shape, inputs) = (self.shape(), seen.dim(2)?);
        let (groups, rows, outputs) = shape.dims3()?;
        super::gpu::with(seen, |(seen, at)| {
            rounded(|| seen.matmul(weights, (groups, rows, outputs, inputs), at, l))
        })
        .map(|product| (product, shape))
    }

    fn bwd(
        &self,
        x: &Tensor,
        weights: &Tensor,
        _y: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        let Some(seen) = &self.seen else { return self.on_cpu(x, weights, gradient) };
        let d = gradient.contiguous()?;
        let of_weights = rounded(|| seen.t()?.matmul(&d))?;
        let of_pictures = match self.wanted {
            true => Some(self.direct.unfold.fold(&rounded(|| d.matmul(&weights.t()?))?)?),
            false => None,
        };
        Ok((of_pictures, Some(of_weights)))
    }
}
