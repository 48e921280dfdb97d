//! Operations on tensors that candle's CPU lacks, or does by one thread: each with its exact gradient.
//!
//! On a CPU they are fused and shared among the threads of the run; sums go over blocks of fixed size in
//! fixed order, so that results do not depend on the number of threads. On an NVIDIA GPU they are the kernels
//! of `atlasfit-cuda`, and elsewhere candle's own operations; tests compare them.
//!
//! Pictures are stored as (pictures, rows, columns, channels), so that a convolution is one matrix product.

mod conv;
mod direct;
#[cfg(feature = "cuda")]
pub(crate) mod gpu;
mod join;
mod norm;
mod outer;
mod outer_norm;
mod product;
mod rows;
mod tanh;
mod unfold;
mod upsample;

pub use conv::conv;
pub use join::add_relu;
pub use norm::{identity_moments, norm_activate};
pub use outer::outer_add;
pub use outer_norm::outer_norm;
pub use product::shared_product;
pub use tanh::bias_tanh;
pub use unfold::{Window, unfold};
pub use upsample::upsample;

use candle_core::{CpuStorage, Device, Layout, Result, Shape, Storage, Tensor, bail};

/// Numbers that one task works through where none depends on another. Source: chosen, 128 kB: a task takes
/// far longer than to hand it out.
pub(crate) const NUMBERS: usize = 1 << 15;

/// Calls `f` with the numbers of a contiguous tensor on the CPU.
fn with_slice<T>(x: &Tensor, f: impl FnOnce(&[f32]) -> Result<T>) -> Result<T> {
    let x = x.contiguous()?;
    let (storage, layout) = x.storage_and_layout();
    match &*storage {
        Storage::Cpu(storage) => f(slice(storage, layout)?),
        _ => bail!("a tensor of another device than the CPU"),
    }
}

/// The numbers behind a contiguous layout.
fn slice<'a>(storage: &'a CpuStorage, layout: &Layout) -> Result<&'a [f32]> {
    let Some((from, to)) = layout.contiguous_offsets() else { bail!("a tensor that is not contiguous") };
    Ok(&storage.as_slice::<f32>()?[from..to])
}

/// Whether a device has these operations fused; elsewhere they are composed of candle's.
fn has_fused(device: &Device) -> bool {
    device.is_cpu() || (cfg!(feature = "cuda") && device.is_cuda())
}

/// A tensor on the CPU.
fn made(values: Vec<f32>, shape: impl Into<Shape>) -> Result<Tensor> {
    Tensor::from_vec(values, shape.into(), &Device::Cpu)
}

#[cfg(test)]
mod tests;
