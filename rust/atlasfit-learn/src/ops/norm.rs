//! Batch norm and what follows it, in one pass over the values.
//!
//! In: values of shape (groups, rows, units), gain and shift of shape (groups, units). Each unit of each
//! group
//! is normalised over its rows. Out: slope-ReLU of the normalised values. The gradient is that of Ioffe and
//! Szegedy 2015 with the statistics' own dependence on the values.

use super::{made, slice, with_slice};
use candle_core::{CpuStorage, CustomOp3, Layout, Result, Shape, Tensor};
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};

/// Added to the variance: PyTorch's default (the paper names no value).
const EPS: f64 = 1e-5;
/// Rows whose sums are taken by one task: the order of sums follows from it, never from the threads.
const BLOCK: usize = 512;

/// Mean and variance (not corrected for the count) of each unit of each group, one after the other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Moments {
    /// Mean.
    pub mean: Vec<f32>,
    /// Variance.
    pub variance: Vec<f32>,
}

/// Normalises, scales and shifts `x`, then multiplies negative values by `slope` (1: leaves all as they are,
/// 0: ReLU). With `given` moments these are used and are constants; without, those of the batch, which are
/// returned.
///
/// # Errors
/// Shapes that do not fit.
pub fn norm_activate(
    x: &Tensor,
    gain: &Tensor,
    shift: &Tensor,
    slope: f32,
    given: Option<&Moments>,
) -> Result<(Tensor, Moments)> {
    let (groups, rows, units) = x.dims3()?;
    let moments = Arc::new(OnceLock::new());
    if let Some(given) = given {
        let _ = moments.set(given.clone());
    }
    let y = if x.device().is_cpu() {
        let op =
            Norm { size: [groups, rows, units], slope, fixed: given.is_some(), moments: moments.clone() };
        x.contiguous()?.apply_op3(&gain.contiguous()?, &shift.contiguous()?, op)?
    } else {
        composed(x, gain, shift, slope, &moments)?
    };
    Ok((y, moments.get().cloned().unwrap_or_default()))
}

/// The same by candle's operations.
pub(super) fn composed(
    x: &Tensor,
    gain: &Tensor,
    shift: &Tensor,
    slope: f32,
    moments: &OnceLock<Moments>,
) -> Result<Tensor> {
    let (groups, rows, units) = x.dims3()?;
    let (mean, variance) = match moments.get() {
        Some(m) => {
            let tensor = |v: &Vec<f32>| Tensor::from_vec(v.clone(), (groups, 1, units), x.device());
            (tensor(&m.mean)?, tensor(&m.variance)?)
        }
        None => {
            let mean = x.mean_keepdim(1)?;
            let variance = (x.broadcast_sub(&mean)?.sqr()?.sum_keepdim(1)? / rows as f64)?;
            let flat = |t: &Tensor| t.flatten_all()?.to_vec1::<f32>();
            let _ = moments.set(Moments { mean: flat(&mean)?, variance: flat(&variance)? });
            (mean, variance)
        }
    };
    let normalised = x.broadcast_sub(&mean)?.broadcast_div(&(variance + EPS)?.sqrt()?)?;
    let y = normalised.broadcast_mul(&gain.unsqueeze(1)?)?.broadcast_add(&shift.unsqueeze(1)?)?;
    if slope == 1.0 { Ok(y) } else { y.maximum(&(&y * f64::from(slope))?) }
}

struct Norm {
    /// Groups, rows, units.
    size: [usize; 3],
    slope: f32,
    /// Whether the moments are constants.
    fixed: bool,
    moments: Arc<OnceLock<Moments>>,
}

/// For each unit of each group two sums over its rows, which `add` takes from one row's units.
fn sums(
    [groups, rows, units]: [usize; 3],
    add: impl Fn(usize, usize, &mut [f32], &mut [f32]) + Sync,
) -> [Vec<f64>; 2] {
    let blocks = rows.div_ceil(BLOCK);
    let partial: Vec<Vec<f32>> = (0..groups * blocks)
        .into_par_iter()
        .map(|task| {
            let (group, block) = (task / blocks, task % blocks);
            let mut both = vec![0.0; 2 * units];
            let (a, b) = both.split_at_mut(units);
            for row in block * BLOCK..((block + 1) * BLOCK).min(rows) {
                add(group, group * rows + row, a, b);
            }
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

impl Norm {
    /// The batch's moments: variances about the first row's value, which is near the mean, so that f32 sums
    /// lose little.
    fn take(&self, x: &[f32]) -> Moments {
        let [_, rows, units] = self.size;
        let [sum, square] = sums(self.size, |group, row, a, b| {
            let first = &x[group * rows * units..][..units];
            for (((a, b), x), f) in a.iter_mut().zip(b).zip(&x[row * units..][..units]).zip(first) {
                let d = x - f;
                *a += d;
                *b += d * d;
            }
        });
        let n = rows as f64;
        let first = |i: usize| f64::from(x[i / units * rows * units + i % units]);
        let mean = sum.iter().enumerate().map(|(i, s)| (first(i) + s / n) as f32).collect();
        let variance =
            sum.iter().zip(&square).map(|(s, q)| (q / n - (s / n).powi(2)).max(0.0) as f32).collect();
        Moments { mean, variance }
    }

    /// Rows of `out` made by several threads.
    fn rows(&self, out: &mut [f32], make: impl Fn(usize, usize, &mut [f32]) + Sync) {
        let [_, rows, units] = self.size;
        out.par_chunks_mut(BLOCK * units).enumerate().for_each(|(block, out)| {
            for (i, out) in out.chunks_exact_mut(units).enumerate() {
                let row = block * BLOCK + i;
                make(row / rows, row, out);
            }
        });
    }

    fn inverse(moments: &Moments) -> Vec<f32> {
        moments.variance.iter().map(|v| (1.0 / (f64::from(*v) + EPS).sqrt()) as f32).collect()
    }
}

/// Row `i` of row-major values.
fn part(values: &[f32], i: usize, units: usize) -> &[f32] {
    &values[i * units..][..units]
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
        let m = self.moments.get_or_init(|| self.take(x));
        let inverse = Self::inverse(m);
        let scale: Vec<f32> = gain.iter().zip(&inverse).map(|(g, i)| g * i).collect();
        let offset: Vec<f32> = shift.iter().zip(&scale).zip(&m.mean).map(|((s, a), m)| s - a * m).collect();
        let mut out = vec![0.0; groups * rows * units];
        self.rows(&mut out, |group, row, out| {
            let (scale, offset) = (&scale[group * units..][..units], &offset[group * units..][..units]);
            let x = &x[row * units..][..units];
            for (((y, x), a), b) in out.iter_mut().zip(x).zip(scale).zip(offset) {
                let z = a * x + b;
                *y = if z > 0.0 { z } else { self.slope * z };
            }
        });
        Ok((CpuStorage::F32(out), (groups, rows, units).into()))
    }

    fn bwd(
        &self,
        x: &Tensor,
        gain: &Tensor,
        _shift: &Tensor,
        y: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
        let [groups, rows, units] = self.size;
        let m = self.moments.get().cloned().unwrap_or_default();
        let inverse = Self::inverse(&m);
        with_slice(x, |x| {
            with_slice(y, |y| {
                with_slice(gradient, |d| {
                    let [shift_sum, gain_sum] = sums(self.size, |group, row, a, b| {
                        let (mean, inverse) = (part(&m.mean, group, units), part(&inverse, group, units));
                        let (x, y, d) = (part(x, row, units), part(y, row, units), part(d, row, units));
                        let (a, b) = (&mut a[..units], &mut b[..units]);
                        for j in 0..units {
                            let d = if y[j] > 0.0 { d[j] } else { self.slope * d[j] };
                            a[j] += d;
                            b[j] += d * (x[j] - mean[j]) * inverse[j];
                        }
                    });
                    let gains = gain.flatten_all()?.to_vec1::<f32>()?;
                    let n = if self.fixed { f64::INFINITY } else { rows as f64 };
                    // dx = a (d - sum d / n - (x - m) inverse sum(d normalised) / n), as a d + p x + q.
                    let a: Vec<f32> = gains.iter().zip(&inverse).map(|(g, i)| g * i).collect();
                    let p: Vec<f32> = (0..groups * units)
                        .map(|i| (-f64::from(a[i] * inverse[i]) * gain_sum[i] / n) as f32)
                        .collect();
                    let q: Vec<f32> = (0..groups * units)
                        .map(|i| (-f64::from(a[i]) * shift_sum[i] / n - f64::from(p[i] * m.mean[i])) as f32)
                        .collect();
                    let mut dx = vec![0.0; x.len()];
                    self.rows(&mut dx, |group, row, out| {
                        let (x, y, d) = (part(x, row, units), part(y, row, units), part(d, row, units));
                        let [a, p, q] = [&a, &p, &q].map(|v| part(v, group, units));
                        let out = &mut out[..units];
                        for j in 0..units {
                            let d = if y[j] > 0.0 { d[j] } else { self.slope * d[j] };
                            out[j] = a[j] * d + p[j] * x[j] + q[j];
                        }
                    });
                    let small =
                        |sum: Vec<f64>| made(sum.into_iter().map(|x| x as f32).collect(), (groups, units));
                    Ok((
                        Some(made(dx, (groups, rows, units))?),
                        Some(small(gain_sum)?),
                        Some(small(shift_sum)?),
                    ))
                })
            })
        })
    }
}
