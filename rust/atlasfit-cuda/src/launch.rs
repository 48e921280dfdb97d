//! The one place that launches kernels: the only unsafe code of this crate.
//!
//! In: a kernel's name, its inputs, its output, sizes and factors, in the order of the kernel's parameters. A
//! kernel writes all of its output and nothing else, and reads its inputs within the sizes that the callers
//! derive from the same shapes as the lengths.

use candle_core::cuda_backend::cudarc::driver::{
    CudaSlice, CudaView, DeviceRepr, LaunchConfig, PushKernelArg,
};
use candle_core::cuda_backend::{CudaDType, CudaDevice, WrapErr};
use candle_core::{CudaStorage, Layout, Result, bail};

/// The kernels, compiled by build.rs.
const KERNELS: &str = include_str!(concat!(env!("OUT_DIR"), "/kernels.ptx"));
/// Threads of a block of the kernels that have a thread for each number.
pub(crate) const BLOCK: u32 = 256;

/// A tensor's numbers.
pub type Given<'a> = (&'a CudaStorage, &'a Layout);

/// Numbers that lie in order, on the GPU.
pub(crate) fn view<'a>((s, layout): Given<'a>) -> Result<Input<'a>> {
    let Some((from, to)) = layout.contiguous_offsets() else { bail!("a tensor that does not lie in order") };
    Ok(Input::Real(s.as_cuda_slice::<f32>()?.slice(from..to)))
}

/// A count that kernels can index.
pub(crate) fn index(n: usize) -> Result<u32> {
    match u32::try_from(n) {
        Ok(n) if n < u32::MAX - BLOCK => Ok(n),
        _ => bail!("{n} numbers in one tensor are too many for a GPU; make train.batch smaller"),
    }
}

/// Numbers that a kernel reads.
pub(crate) enum Input<'a> {
    Real(CudaView<'a, f32>),
    Index(CudaView<'a, u32>),
    Whole(&'a CudaSlice<i64>),
}

/// All arguments of a kernel.
pub(crate) struct Call<'a> {
    pub name: &'a str,
    /// Blocks, and threads of each.
    pub grid: [(u32, u32, u32); 2],
    pub inputs: &'a [Input<'a>],
    pub sizes: &'a [u32],
    pub factors: &'a [f32],
}

impl Call<'_> {
    /// One thread for each of so many numbers.
    pub(crate) const fn threads(n: u32) -> [(u32, u32, u32); 2] {
        [(n.div_ceil(BLOCK), 1, 1), (BLOCK, 1, 1)]
    }

    /// Launches the kernel into numbers that are there.
    pub(crate) fn fill<T: DeviceRepr>(&self, device: &CudaDevice, out: &mut CudaSlice<T>) -> Result<()> {
        let [grid_dim, block_dim] = self.grid;
        let kernel = device.get_or_load_custom_func(self.name, "atlasfit", KERNELS)?;
        let mut launch = kernel.builder();
        for input in self.inputs {
            match input {
                Input::Real(x) => launch.arg(x),
                Input::Index(x) => launch.arg(x),
                Input::Whole(x) => launch.arg(*x),
            };
        }
        launch.arg(out);
        for size in self.sizes {
            launch.arg(size);
        }
        for factor in self.factors {
            launch.arg(factor);
        }
        // SAFETY: parameters have the order and types of the kernel, and sizes that fit the slices: see the
        // head of this file. All run on the device's one stream, so nothing is read before it is written.
        #[allow(unsafe_code)]
        unsafe { launch.launch(LaunchConfig { grid_dim, block_dim, shared_mem_bytes: 0 }) }.w()?;
        Ok(())
    }

    /// Launches the kernel into `len` new numbers.
    pub(crate) fn make<T: CudaDType + DeviceRepr>(
        &self,
        device: &CudaDevice,
        len: usize,
    ) -> Result<CudaStorage> {
        // SAFETY: the kernel writes each of these numbers before anything reads it: see the head of this
        // file.
        #[allow(unsafe_code)]
        let mut out = unsafe { device.alloc::<T>(len) }?;
        if len > 0 {
            self.fill(device, &mut out)?;
        }
        Ok(CudaStorage::wrap_cuda_slice(out, device.clone()))
    }
}
