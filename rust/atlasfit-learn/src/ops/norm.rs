//! Batch norm and what follows it, in one pass over the values.
//!
//! In: values of shape (groups, rows, units), gain and shift of shape (groups, units). Each unit of each
//! group is normalised over its rows. Moments are mean and variance (not corrected for the count), (2,
//! groups, units), on the device of the values. Out: slope-ReLU of the normalised values. The gradient is
//! that of Ioffe and Szegedy 2015 with the statistics' own dependence on the values.

use super::{has_fused, made, slice, with_slice};
#[cfg(feature = "cuda")]
use candle_core::CudaStorage;
use candle_core::{CpuStorage, CustomOp1, CustomOp3, DType, Device, Layout, Result, Shape, Tensor};
use pulp::Arch;
use rayon::prelude::*;
use std::ops::Range;

/// Added to the variance: PyTorch's default (the paper names no value).
pub(super) const EPS: f64 = 1e-5;
/// Rows whose sums are taken by one task: the order of sums follows from it, never from the threads.
pub(super) const BLOCK: usize = 512;

/// Mean 0, variance 1.
///
/// # Errors
/// Those of candle.
pub fn identity_moments(groups: usize, units: usize, device: &Device) -> Result<Tensor> {
    let of = |f: fn((usize, usize), DType, &Device) -> Result<Tensor>| f((groups, units), DType::F32, device);
    Tensor::stack(&[of(Tensor::zeros)?, of(Tensor::ones)?], 0)
}

/// Normalises, scales and shifts `x`, then multiplies negative values by `slope` (1: leaves all as they are,
/// 0: ReLU). With `given` moments these are used and are constants; without, those of the batch. Also gives
/// the moments that were used.
///
/// # Errors
/// Shapes that do not fit.
pub fn norm_activate(
    x: &Tensor,
    gain: &Tensor,
    shift: &Tensor,
    slope: f32,
    given: Option<&Tensor>,
) -> Result<(Tensor, Tensor)> {
    let (groups, rows, units) = x.dims3()?;
    let size = [groups, rows, units];
    if !has_fused(x.device()) {
        return composed(x, gain, shift, slope, given);
    }
    let x = x.contiguous()?;
    let moments = match given {
        Some(given) => given.clone(),
        None => x.apply_op1_no_bwd(&Take { size })?,
    };
    let op = Norm {
        size,
        slope,
        fixed: given.is_some(),
        moments: moments.clone(),
        #[cfg(feature = "cuda")]
        packed: super::gpu::packed(&moments, gain, shift)?,
    };
    Ok((x.apply_op3(&gain.contiguous()?, &shift.contiguous()?, op)?, moments))
}

/// The same by candle's operations.
pub(super) fn composed(
    x: &Tensor,
    gain: &Tensor,
    shift: &Tensor,
    slope: f32,
    given: Option<&Tensor>,
) -> Result<(Tensor, Tensor)> {
    let rows = x.dim(1)?;
    let (mean, variance) = match given {
        Some(m) => (m.get(0)?.unsqueeze(1)?, m.get(1)?.unsqueeze(1)?),
        None => {
            let mean = x.mean_keepdim(1)?;
            let variance = (x.broadcast_sub(&mean)?.sqr()?.sum_keepdim(1)? / rows as f64)?;
            (mean, variance)
        }
    };
    let moments = Tensor::stack(&[mean.squeeze(1)?, variance.squeeze(1)?], 0)?.detach();
    let normalised = x.broadcast_sub(&mean)?.broadcast_div(&(variance + EPS)?.sqrt()?)?;
    let y = normalised.broadcast_mul(&gain.unsqueeze(1)?)?.broadcast_add(&shift.unsqueeze(1)?)?;
    let y = if slope == 1.0 { y } else { y.maximum(&(&y * f64::from(slope))?)? };
    Ok((y, moments))
}

/// The batch's moments.
struct Take {
    /// Groups, rows, units.
    size: [usize; 3],
}

struct Norm {
    /// Groups, rows, units.
    size: [usize; 3],
    slope: f32,
    /// Whether the moments are constants.
    fixed: bool,
    moments: Tensor,
    /// Moments, gain and shift as the kernels take them.
    #[cfg(feature = "cuda")]
    packed: Option<Tensor>,
}

/// For each unit of each group two sums over its rows, to which `add` adds a group's rows of a range.
fn sums(
    [groups, rows, units]: [usize; 3],
    add: impl Fn(usize, Range<usize>, &mut [f32], &mut [f32]) + Sync,
) -> [Vec<f64>; 2] {
    let blocks = rows.div_ceil(BLOCK);
    let partial: Vec<Vec<f32>> = (0..groups * blocks)
        .into_par_iter()
        .map(|task| {
            let (group, block) = (task / blocks, task % blocks);
            let mut both = vec![0.0; 2 * units];
            let (a, b) = both.split_at_mut(units);
            let of = group * rows + block * BLOCK..group * rows + ((block + 1) * BLOCK).min(rows);
            add(group, of, a, b);
            both
        })
        .collect();
    let mut out = [vec![0.0; groups * units], vec![0.0; groups * units]];
    for (task, both) in partial.iter().enumerate() {
        let at = task / blocks * units;
        for (k, out) in out.iter_mut().enumerate() {
            for (sum, x) in out[at..at + units].iter_mut().zip(&both[k * units..]) {
                *sum += f64::from(*x);
            }
        }
    }
    out
}

impl CustomOp1 for Take {
    fn name(&self) -> &'static str {
        "norm-moments"
    }

    /// Variances are taken about the first row's value, which is near the mean, so that f32 sums lose little.
    fn cpu_fwd(&self, x: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        let x = slice(x, layout)?;
        let [groups, rows, units] = self.size;
        let [sum, square] = sums(self.size, |group, of, a, b| {
            let first = part(x, group * rows..group * rows + 1, units);
            Arch::new().dispatch(|| add_about(first, part(x, of, units), a, b));
        });
        let n = rows as f64;
        let first = |i: usize| f64::from(x[i / units * rows * units + i % units]);
        let mut out: Vec<f32> = sum.iter().enumerate().map(|(i, s)| (first(i) + s / n) as f32).collect();
        out.extend(sum.iter().zip(&square).map(|(s, q)| (q / n - (s / n).powi(2)).max(0.0) as f32));
        Ok((CpuStorage::F32(out), (2, groups, units).into()))
    }

    #[cfg(feature = "cuda")]
    fn cuda_fwd(&self, x: &CudaStorage, layout: &Layout) -> Result<(CudaStorage, Shape)> {
        let [groups, _, units] = self.size;
        Ok((atlasfit_cuda::norm_moments((x, layout), self.size)?, (2, groups, units).into()))
    }
}

impl Norm {
    /// Rows made by several threads: `make` makes a group's rows of a range.
    fn rows(&self, make: impl Fn(usize, Range<usize>, &mut [f32]) + Sync) -> Vec<f32> {
        let [groups, rows, units] = self.size;
        let mut out = vec![0.0; groups * rows * units];
        out.par_chunks_mut((rows * units).max(1)).enumerate().for_each(|(group, out)| {
            out.par_chunks_mut(BLOCK * units).enumerate().for_each(|(block, out)| {
                let first = group * rows + block * BLOCK;
                let of = first..first + out.len() / units;
                make(group, of, out);
            });
        });
        out
    }

    /// Means, and one over the standard deviations.
    fn means(&self) -> Result<(Vec<f32>, Vec<f32>)> {
        let mean = self.moments.get(0)?.flatten_all()?.to_vec1()?;
        let variance = self.moments.get(1)?.flatten_all()?.to_vec1::<f32>()?;
        Ok((mean, variance.iter().map(|v| (1.0 / (f64::from(*v) + EPS).sqrt()) as f32).collect()))
    }

    /// The result before the slope is `scale` times a value plus `offset`.
    fn scales(&self, gain: &[f32], shift: &[f32]) -> Result<[Vec<f32>; 2]> {
        let (mean, inverse) = self.means()?;
        let scale: Vec<f32> = gain.iter().zip(&inverse).map(|(g, i)| g * i).collect();
        let offset = shift.iter().zip(&scale).zip(&mean).map(|((s, a), m)| s - a * m).collect();
        Ok([scale, offset])
    }

    #[cfg(feature = "cuda")]
    const fn on_gpu(&self) -> atlasfit_cuda::NormSize {
        atlasfit_cuda::NormSize { size: self.size, slope: self.slope, eps: EPS as f32 }
    }
}

/// Some rows of row-major values.
fn part(values: &[f32], rows: Range<usize>, units: usize) -> &[f32] {
    &values[rows.start * units..rows.end * units]
}

/// Adds rows less the first one, and their squares.
#[inline(always)]
fn add_about(first: &[f32], x: &[f32], a: &mut [f32], b: &mut [f32]) {
    let units = first.len();
    let (a, b) = (&mut a[..units], &mut b[..units]);
    for x in x.chunks_exact(units) {
        for j in 0..units {
            let d = x[j] - first[j];
            a[j] += d;
            b[j] += d * d;
        }
    }
}

/// Rows scaled, shifted, negative ones times the slope.
#[inline(always)]
fn activate(x: &[f32], [scale, offset]: [&[f32]; 2], slope: f32, out: &mut [f32]) {
    let units = scale.len();
    let offset = &offset[..units];
    for (y, x) in out.chunks_exact_mut(units).zip(x.chunks_exact(units)) {
        for j in 0..units {
            let z = scale[j] * x[j] + offset[j];
            y[j] = if z > 0.0 { z } else { slope * z };
        }
    }
}

/// Adds the gradients before the slope, and their products with the normalised values.
#[inline(always)]
fn add_pulls([x, d]: [&[f32]; 2], of: [&[f32]; 4], slope: f32, a: &mut [f32], b: &mut [f32]) {
    let units = of[0].len();
    let [scale, offset, mean, inverse] = of.map(|v| &v[..units]);
    let (a, b) = (&mut a[..units], &mut b[..units]);
    for (x, d) in x.chunks_exact(units).zip(d.chunks_exact(units)) {
        for j in 0..units {
            let d = if scale[j] * x[j] + offset[j] > 0.0 { d[j] } else { slope * d[j] };
            a[j] += d;
            b[j] += d * (x[j] - mean[j]) * inverse[j];
        }
    }
}

/// The gradient of the values, as scale d + p x + q.
#[inline(always)]
fn pull([x, d]: [&[f32]; 2], of: [&[f32]; 4], slope: f32, out: &mut [f32]) {
    let units = of[0].len();
    let [scale, offset, p, q] = of.map(|v| &v[..units]);
    let rows = x.chunks_exact(units).zip(d.chunks_exact(units));
    for ((x, d), out) in rows.zip(out.chunks_exact_mut(units)) {
        for j in 0..units {
            let d = if scale[j] * x[j] + offset[j] > 0.0 { d[j] } else { slope * d[j] };
            out[j] = scale[j] * d + p[j] * x[j] + q[j];
        }
    }
}

impl CustomOp3 for Norm {
    fn name(&self) -> &'static str {
        "norm-activate"
    }

    fn cpu_fwd(
        &self,
        x: &CpuStorage,
        lx: &Layout,
        gain: &CpuStorage,
        lg: &Layout,
        shift: &CpuStorage,
        ls: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (x, gain, shift) = (slice(x, lx)?, slice(gain, lg)?, slice(shift, ls)?);
        let [groups, rows, units] = self.size;
        let [scale, offset] = self.scales(gain, shift)?;
        let out = self.rows(|group, of, out| {
            let scales = [&scale, &offset].map(|v| part(v, group..group + 1, units));
            Arch::new().dispatch(|| activate(part(x, of, units), scales, self.slope, out));
        });
        Ok((CpuStorage::F32(out), (groups, rows, units).into()))
    }

    #[cfg(feature = "cuda")]
    fn cuda_fwd(
        &self,
        x: &CudaStorage,
        lx: &Layout,
        _gain: &CudaStorage,
        _lg: &Layout,
        _shift: &CudaStorage,
        _ls: &Layout,
    ) -> Result<(CudaStorage, Shape)> {
        let y = super::gpu::with(super::gpu::some(&self.packed)?, |packed| {
            atlasfit_cuda::norm_apply((x, lx), packed, &self.on_gpu())
        })?;
        Ok((y, (&self.size).into()))
    }

    fn bwd(
        &self,
        x: &Tensor,
        gain: &Tensor,
        shift: &Tensor,
        _y: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
        let [groups, rows, units] = self.size;
        #[cfg(feature = "cuda")]
        if let Some(packed) = &self.packed {
            let (dx, sums) = super::gpu::norm_gradient(gradient, x, packed, &self.on_gpu(), self.fixed)?;
            return Ok((Some(dx), Some(sums.get(1)?), Some(sums.get(0)?)));
        }
        let (mean, inverse) = self.means()?;
        let [gains, shifts] = [gain, shift].map(|t| t.flatten_all()?.to_vec1::<f32>());
        let (gains, shifts) = (gains?, shifts?);
        let [scale, offset] = self.scales(&gains, &shifts)?;
        with_slice(x, |x| {
            with_slice(gradient, |d| {
                // Which results are negative is found again: to read them would take longer.
                let [shift_sum, gain_sum] = sums(self.size, |group, of, a, b| {
                    let of_group =
                        [&scale, &offset, &mean, &inverse].map(|v| part(v, group..group + 1, units));
                    let both = [x, d].map(|v| part(v, of.clone(), units));
                    Arch::new().dispatch(|| add_pulls(both, of_group, self.slope, a, b));
                });
                let n = if self.fixed { f64::INFINITY } else { rows as f64 };
                // dx = a (d - sum d / n - (x - m) inverse sum(d normalised) / n), as a d + p x + q.
                let p: Vec<f32> = (0..groups * units)
                    .map(|i| (-f64::from(scale[i] * inverse[i]) * gain_sum[i] / n) as f32)
                    .collect();
                let q: Vec<f32> = (0..groups * units)
                    .map(|i| (-f64::from(scale[i]) * shift_sum[i] / n - f64::from(p[i] * mean[i])) as f32)
                    .collect();
                let dx = self.rows(|group, of, out| {
                    let of_group = [&scale, &offset, &p, &q].map(|v| part(v, group..group + 1, units));
                    let both = [x, d].map(|v| part(v, of.clone(), units));
                    Arch::new().dispatch(|| pull(both, of_group, self.slope, out));
                });
                let small =
                    |sum: Vec<f64>| made(sum.into_iter().map(|x| x as f32).collect(), (groups, units));
                Ok((Some(made(dx, (groups, rows, units))?), Some(small(gain_sum)?), Some(small(shift_sum)?)))
            })
        })
    }
}
