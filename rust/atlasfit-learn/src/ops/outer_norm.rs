//! Batch norm of the sums of every row of one matrix with every row of another, and what follows it: the
//! first layer of a chart's network, without an array of the sums.
//!
//! Over all pairs the mean of the sums is the sum of the means, and the variance that of the variances; so
//! the rows of each matrix are scaled by themselves, and only the result is as large as all pairs. The
//! gradient is that of `norm`, summed over the pairs of a row.

use super::{made, norm_activate, outer_add, slice, with_slice};
use candle_core::{CpuStorage, CustomOp3, Layout, Result, Shape, Tensor};
use pulp::Arch;
use rayon::prelude::*;

/// From x (groups, a, units) and y (groups, b, units) what [`norm_activate`] gives of their sums, (groups,
/// a b, units).
///
/// # Errors
/// Shapes that do not fit.
pub fn outer_norm(
    [x, y]: [&Tensor; 2],
    gain: &Tensor,
    shift: &Tensor,
    slope: f32,
    given: Option<&Tensor>,
) -> Result<(Tensor, Tensor)> {
    let ((groups, a, units), (_, b, _)) = (x.dims3()?, y.dims3()?);
    if !x.device().is_cpu() {
        let sums = outer_add(x, y)?.reshape((groups, a * b, units))?;
        return norm_activate(&sums, gain, shift, slope, given);
    }
    let moments = match given {
        Some(given) => given.clone(),
        None => (moments(x)? + moments(y)?)?,
    };
    let numbers = |i: usize| moments.get(i)?.flatten_all()?.to_vec1::<f32>();
    let inverse = |v: f32| (1.0 / (f64::from(v) + super::norm::EPS).sqrt()) as f32;
    let op = OuterNorm {
        size: [groups, a, b, units],
        slope,
        fixed: given.is_some(),
        mean: numbers(0)?,
        inverse: numbers(1)?.into_iter().map(inverse).collect(),
    };
    let affine = Tensor::stack(&[gain, shift], 0)?.contiguous()?;
    Ok((x.contiguous()?.apply_op3(&y.contiguous()?, &affine, op)?, moments))
}

/// Mean and variance of each unit over the rows, (2, groups, units).
fn moments(x: &Tensor) -> Result<Tensor> {
    let (groups, rows, units) = x.dims3()?;
    let mut out = vec![0.0; 2 * groups * units];
    with_slice(x, |x| {
        for i in 0..groups * units {
            let at = |row: usize| f64::from(x[(i / units * rows + row) * units + i % units]);
            let mean = (0..rows).map(at).sum::<f64>() / rows as f64;
            out[i] = mean as f32;
            let squares: f64 = (0..rows).map(|row| (at(row) - mean).powi(2)).sum();
            out[groups * units + i] = (squares / rows as f64) as f32;
        }
        Ok(())
    })?;
    made(out, (2, groups, units))
}

struct OuterNorm {
    /// Groups, rows of the first, rows of the second, units.
    size: [usize; 4],
    slope: f32,
    /// Whether the moments are constants.
    fixed: bool,
    mean: Vec<f32>,
    /// One over the standard deviations.
    inverse: Vec<f32>,
}

impl OuterNorm {
    /// A group's rows, scaled: their sums are the results before the slope.
    fn scaled(&self, group: usize, x: &[f32], y: &[f32], affine: &[f32]) -> [Vec<f32>; 2] {
        let [groups, a, b, units] = self.size;
        let scale = |j: usize| affine[group * units + j] * self.inverse[group * units + j];
        let shift = |j: usize| affine[(groups + group) * units + j] - scale(j) * self.mean[group * units + j];
        let (x, y) = (&x[group * a * units..][..a * units], &y[group * b * units..][..b * units]);
        let (scales, shifts): (Vec<f32>, Vec<f32>) = (0..units).map(|j| (scale(j), shift(j))).unzip();
        let first = x.iter().enumerate().map(|(i, x)| scales[i % units] * x + shifts[i % units]);
        let second = y.iter().enumerate().map(|(i, y)| scales[i % units] * y);
        [first.collect(), second.collect()]
    }
}

/// A row plus each of some rows, negative sums times the slope.
#[inline(always)]
fn activate(first: &[f32], second: &[f32], slope: f32, out: &mut [f32]) {
    let units = first.len();
    for (out, second) in out.chunks_exact_mut(units).zip(second.chunks_exact(units)) {
        for j in 0..units {
            let z = first[j] + second[j];
            out[j] = if z > 0.0 { z } else { slope * z };
        }
    }
}

/// Adds the gradients before the slope to those of a row and to those of each of some rows.
#[inline(always)]
fn add_pulls([first, second, d]: [&[f32]; 3], slope: f32, of_first: &mut [f32], of_second: &mut [f32]) {
    let units = first.len();
    let of_first = &mut of_first[..units];
    let rows = second.chunks_exact(units).zip(d.chunks_exact(units));
    for ((second, d), of_second) in rows.zip(of_second.chunks_exact_mut(units)) {
        for j in 0..units {
            let d = if first[j] + second[j] > 0.0 { d[j] } else { slope * d[j] };
            of_first[j] += d;
            of_second[j] += d;
        }
    }
}

impl CustomOp3 for OuterNorm {
    fn name(&self) -> &'static str {
        "outer-norm"
    }

    fn cpu_fwd(
        &self,
        x: &CpuStorage,
        lx: &Layout,
        y: &CpuStorage,
        ly: &Layout,
        affine: &CpuStorage,
        l: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (x, y, affine) = (slice(x, lx)?, slice(y, ly)?, slice(affine, l)?);
        let [groups, a, b, units] = self.size;
        let mut out = vec![0.0; groups * a * b * units];
        out.par_chunks_mut(a * b * units).enumerate().for_each(|(group, out)| {
            let [first, second] = self.scaled(group, x, y, affine);
            out.par_chunks_mut(b * units).zip(first.par_chunks(units)).for_each(|(out, first)| {
                Arch::new().dispatch(|| activate(first, &second, self.slope, out));
            });
        });
        Ok((CpuStorage::F32(out), (groups, a * b, units).into()))
    }

    fn bwd(
        &self,
        x: &Tensor,
        y: &Tensor,
        affine: &Tensor,
        _out: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
        let [groups, a, b, units] = self.size;
        let affine = affine.flatten_all()?.to_vec1::<f32>()?;
        with_slice(x, |x| {
            with_slice(y, |y| {
                with_slice(gradient, |d| {
                    let each = d.par_chunks(a * b * units).enumerate();
                    let each: Vec<[Vec<f32>; 4]> =
                        each.map(|(group, d)| self.gradients(group, [x, y, &affine, d])).collect();
                    let all = |k: usize| each.iter().map(|g| g[k].as_slice()).collect::<Vec<_>>().concat();
                    let of_affine = made([all(2), all(3)].concat(), (2, groups, units))?;
                    let of_rows = |k: usize, rows: usize| made(all(k), (groups, rows, units));
                    Ok((Some(of_rows(0, a)?), Some(of_rows(1, b)?), Some(of_affine)))
                })
            })
        })
    }
}

impl OuterNorm {
    /// Of a group the gradients of both matrices' rows, of gain and of shift.
    fn gradients(&self, group: usize, [x, y, affine, d]: [&[f32]; 4]) -> [Vec<f32>; 4] {
        let [_, a, b, units] = self.size;
        let [first, second] = self.scaled(group, x, y, affine);
        let (mut of_x, mut of_y) = (vec![0.0; a * units], vec![0.0; b * units]);
        for (i, d) in d.chunks_exact(b * units).enumerate() {
            let (first, of_x) = (&first[i * units..][..units], &mut of_x[i * units..][..units]);
            Arch::new().dispatch(|| add_pulls([first, &second, d], self.slope, of_x, &mut of_y));
        }
        let (x, y) = (&x[group * a * units..][..a * units], &y[group * b * units..][..b * units]);
        let (mut gains, mut shifts) = (vec![0.0; units], vec![0.0; units]);
        for j in 0..units {
            let inverse = f64::from(self.inverse[group * units + j]);
            let scale = f64::from(affine[group * units + j]) * inverse;
            let mean_of =
                |v: &[f32], n: usize| (0..n).map(|i| f64::from(v[i * units + j])).sum::<f64>() / n as f64;
            // Any parts of the mean do where it is given: the sum counts.
            let mean_y = mean_of(y, b);
            let means = [f64::from(self.mean[group * units + j]) - mean_y, mean_y];
            let product = |v: &[f32], g: &[f32], n: usize, mean: f64| -> f64 {
                (0..n).map(|i| f64::from(g[i * units + j]) * (f64::from(v[i * units + j]) - mean)).sum()
            };
            let total: f64 = (0..a).map(|i| f64::from(of_x[i * units + j])).sum();
            let gain = inverse * (product(x, &of_x, a, means[0]) + product(y, &of_y, b, means[1]));
            (gains[j], shifts[j]) = (gain as f32, total as f32);
            for (v, g, n, mean) in [(x, &mut of_x, a, means[0]), (y, &mut of_y, b, means[1])] {
                let share = if self.fixed { 0.0 } else { 1.0 / n as f64 };
                for i in 0..n {
                    let g = &mut g[i * units + j];
                    let about = total + gain * inverse * (f64::from(v[i * units + j]) - mean);
                    *g = (scale * (f64::from(*g) - about * share)) as f32;
                }
            }
        }
        [of_x, of_y, gains, shifts]
    }
}
