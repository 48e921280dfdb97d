//! What is minimised: Chamfer distance to the shape plus the weighted stretch of the charts.
//!
//! In: samples (shapes, samples, 3), points (shapes, points, 3). Out: the mean over the shapes, with
//! gradients through the samples. Which point is nearest to which comes from `nearest`, on an
//! NVIDIA GPU from all pairs, and is piecewise constant, so the gradient is exact for the nearest points
//! found. Source: *Deep Manifold Prior*, section 3; sums over points are means, as in
//! `atlasfit::measure::chamfer`.

use crate::nearest::Set;
use atlasfit::run::Context;
use candle_core::{CpuStorage, CustomOp1, Layout, Result, Shape, Tensor};
use rayon::prelude::*;

/// Chamfer distance of each shape's samples to its points, mean over the shapes: a scalar. There may be
/// several answers to each shape: samples (answers shapes, samples, 3), all shapes' first answers first.
///
/// # Errors
/// Shapes that do not fit; samples that are not finite ([`atlasfit::Error::Diverged`]; on a GPU the distance
/// is not finite instead); cancelled or out of time.
pub fn chamfer(samples: &Tensor, points: &Tensor, ctx: &Context<'_>) -> crate::Result<Tensor> {
    let ((all, n, _), (shapes, m, _)) = (samples.dims3()?, points.dims3()?);
    #[cfg(feature = "cuda")]
    if samples.device().is_cuda() {
        return Ok(on_gpu::chamfer(&samples.contiguous()?, &points.contiguous()?)?);
    }
    let plain = |t: &Tensor| t.detach().flatten_all()?.to_vec1::<f32>();
    let (s, p) = (plain(samples)?, plain(points)?);
    let (s, p) = (finite(&s)?, finite(&p)?);
    let sets = p.chunks_exact(m).map(|p| Set::new(p, ctx)).collect::<atlasfit::Result<Vec<_>>>()?;
    let each: Vec<(f64, Vec<f32>)> = s
        .par_chunks_exact(n)
        .enumerate()
        .map(|(i, s)| {
            let p = &p[i % shapes * m..][..m];
            let to_points = sets[i % shapes].nearest(s, ctx)?;
            let to_samples = Set::new(s, ctx)?.nearest(p, ctx)?;
            Ok(pulls([s, p], [&to_points, &to_samples], all))
        })
        .collect::<atlasfit::Result<_>>()?;
    Ok(known(samples, each)?)
}

/// The sum of parts whose gradients at the samples are known, from the first sample on.
fn known(samples: &Tensor, parts: Vec<(f64, Vec<f32>)>) -> Result<Tensor> {
    let value = parts.iter().map(|(value, _)| value).sum::<f64>() as f32;
    let gradients: Vec<&[f32]> = parts.iter().map(|(_, gradient)| gradient.as_slice()).collect();
    let gradient = Tensor::from_vec(gradients.concat(), samples.shape(), samples.device())?;
    samples.apply_op1(Known { value: Tensor::new(value, samples.device())?, gradient })
}

/// Points of finite coordinates.
fn finite(flat: &[f32]) -> atlasfit::Result<&[[f32; 3]]> {
    if flat.iter().any(|x| !x.is_finite()) {
        return Err(atlasfit::Error::Diverged {
            what: "a sample of a chart is not finite".into(),
            advice: "Lower the learning rate".into(),
        });
    }
    Ok(flat.as_chunks::<3>().0)
}

/// What one of `answers` answers adds to the Chamfer distance, and the gradient at its samples, from samples
/// and points and the nearest ones of each among the others.
fn pulls([s, p]: [&[[f32; 3]]; 2], near: [&[u32]; 2], answers: usize) -> (f64, Vec<f32>) {
    let mut gradient = vec![[0.0f32; 3]; s.len()];
    let mut sums = [0.0f64; 2];
    let mut pull = |k: usize, i: usize, j: usize, weight: f64| {
        for axis in 0..3 {
            let d = f64::from(s[i][axis]) - f64::from(p[j][axis]);
            sums[k] += d * d;
            gradient[i][axis] += (2.0 * weight * d) as f32;
        }
    };
    let weights = [s.len(), p.len()].map(|n| 1.0 / (answers * n) as f64);
    for (i, j) in near[0].iter().enumerate() {
        pull(0, i, *j as usize, weights[0]);
    }
    for (j, i) in near[1].iter().enumerate() {
        pull(1, *i as usize, j, weights[1]);
    }
    (sums[0] * weights[0] + sums[1] * weights[1], gradient.into_flattened())
}

/// A number whose gradient is known.
struct Known {
    value: Tensor,
    gradient: Tensor,
}

impl CustomOp1 for Known {
    fn name(&self) -> &'static str {
        "chamfer"
    }

    fn cpu_fwd(&self, _: &CpuStorage, _: &Layout) -> Result<(CpuStorage, Shape)> {
        Ok((CpuStorage::F32(vec![self.value.to_scalar()?]), ().into()))
    }

    #[cfg(feature = "cuda")]
    fn cuda_fwd(
        &self,
        _: &candle_core::CudaStorage,
        _: &Layout,
    ) -> Result<(candle_core::CudaStorage, Shape)> {
        use candle_core::backend::BackendStorage;
        Ok((crate::ops::gpu::with(&self.value, |(s, layout)| s.try_clone(layout))?, ().into()))
    }

    fn bwd(&self, _: &Tensor, _: &Tensor, gradient: &Tensor) -> Result<Option<Tensor>> {
        Ok(Some(self.gradient.broadcast_mul(gradient)?))
    }
}

/// Stretch of charts, samples (shapes, charts, side side, 3): as `atlasfit_net::loss::stretch`, the mean over
/// a chart's samples of the summed squared distances to their grid neighbours; added over the charts, mean
/// over the shapes. A scalar.
///
/// # Errors
/// Shapes that do not fit.
pub fn stretch(samples: &Tensor, side: usize) -> crate::Result<Tensor> {
    let (shapes, charts, n, _) = samples.dims4()?;
    // Every edge counts twice, once from each end.
    let weight = 2.0 / (n * shapes) as f64;
    if samples.device().is_cpu() {
        let flat = samples.detach().flatten_all()?.to_vec1::<f32>()?;
        return Ok(known(samples, each_stretch(&flat, side, weight))?);
    }
    let grid = samples.reshape((shapes * charts, side, side, 3))?;
    let edges = |axis: usize| -> candle_core::Result<Tensor> {
        (grid.narrow(axis, 1, side - 1)? - grid.narrow(axis, 0, side - 1)?)?.sqr()?.sum_all()
    };
    Ok(((edges(1)? + edges(2)?)? * weight)?)
}

/// What each chart adds to the stretch, and the gradient at its samples.
fn each_stretch(samples: &[f32], side: usize, weight: f64) -> Vec<(f64, Vec<f32>)> {
    let of_chart = |chart: &[f32]| {
        let at = chart.as_chunks::<3>().0;
        let mut gradient = vec![[0.0f32; 3]; at.len()];
        let mut sum = 0.0;
        let mut edge = |i: usize, j: usize| {
            for axis in 0..3 {
                let d = at[j][axis] - at[i][axis];
                sum += f64::from(d) * f64::from(d);
                let pull = (2.0 * weight) as f32 * d;
                gradient[j][axis] += pull;
                gradient[i][axis] -= pull;
            }
        };
        for i in 0..at.len() {
            if i % side + 1 < side {
                edge(i, i + 1);
            }
            if i + side < at.len() {
                edge(i, i + side);
            }
        }
        (sum * weight, gradient.into_flattened())
    };
    samples.par_chunks_exact(3 * side * side).map(of_chart).collect()
}

/// The same on an NVIDIA GPU, which looks at all pairs. Samples that are not finite make a distance that is
/// not.
#[cfg(feature = "cuda")]
mod on_gpu {
    use super::Known;
    use crate::ops::gpu::{made, with};
    use candle_core::op::BackpropOp;
    use candle_core::{D, Result, Storage, Tensor};

    pub(super) fn chamfer(samples: &Tensor, points: &Tensor) -> Result<Tensor> {
        let ((all, n, _), m) = (samples.dims3()?, points.dim(1)?);
        let (s, flat) = (samples.detach(), samples.detach().flatten_to(1)?);
        let nearest = |from: &Tensor, to: &Tensor, size: [usize; 2]| -> Result<Tensor> {
            let indices = with(from, |a| with(to, |b| atlasfit_cuda::nearest(a, b, size, all)))?;
            Ok(Tensor::from_storage(Storage::Cuda(indices), all * size[0], BackpropOp::none(), false))
        };
        let of_samples = nearest(&s, points, [n, m])?;
        let of_points = nearest(points, &s, [m, n])?;
        let targets = points.flatten_to(1)?;
        let repeated = Tensor::cat(&vec![&targets; all / points.dim(0)?], 0)?;
        let mean = |d: Tensor| d.sqr()?.sum(D::Minus1)?.mean_all();
        let to_points = mean((&flat - targets.index_select(&of_samples, 0)?)?)?;
        let value = (to_points + mean((flat.index_select(&of_points, 0)? - repeated)?)?)?;
        let kernel = |s: atlasfit_cuda::Given<'_>| {
            with(points, |p| {
                with(&of_samples, |i| with(&of_points, |j| atlasfit_cuda::chamfer_gradient(s, p, i, j)))
            })
        };
        let gradient = made(&s, kernel, (all, n, 3))?;
        samples.apply_op1(Known { value, gradient })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use atlasfit::numeric::rng::Rng;
    use atlasfit::run::Run;
    use candle_core::{Device, Var};

    #[test]
    fn gradients_of_both_losses_are_those_of_finite_differences() {
        let mut rng = Rng::new(1);
        let mut random = |shape: &[usize]| {
            let values: Vec<f32> = (0..shape.iter().product()).map(|_| rng.normal() as f32).collect();
            Tensor::from_vec(values, shape, &Device::Cpu).unwrap()
        };
        // Two answers to each of three shapes.
        let points = random(&[3, 20, 3]);
        let chamfer_of = |x: &Tensor| {
            let x = x.reshape((6, 32, 3)).unwrap();
            Run::default().execute(|ctx| Ok(chamfer(&x, &points, ctx).unwrap())).unwrap()
        };
        let stretch_of = |x: &Tensor| stretch(x, 4).unwrap();
        let (start, along) = (random(&[6, 2, 16, 3]), random(&[6, 2, 16, 3]));
        for loss in [&chamfer_of as &dyn Fn(&Tensor) -> Tensor, &stretch_of] {
            let x = Var::from_tensor(&start).unwrap();
            let gradient = loss(x.as_tensor()).backward().unwrap().get(&x).unwrap().clone();
            let slope = (gradient * &along).unwrap().sum_all().unwrap().to_scalar::<f32>().unwrap();
            let at = |h: f64| loss(&(&start + (&along * h).unwrap()).unwrap()).to_scalar::<f32>().unwrap();
            // Where other points become the nearest ones there are kinks, which spoil large steps; rounding
            // spoils small ones. The best step counts.
            let off = [2e-3, 1e-3, 5e-4, 2.5e-4].map(|h| {
                let change = f64::from(at(h) - at(-h)) / (2.0 * h);
                (change - f64::from(slope)).abs()
            });
            let best = off.into_iter().fold(f64::INFINITY, f64::min);
            assert!(best < 0.01 * f64::from(slope.abs()) + 2e-3, "{off:?} off from {slope}");
        }
    }
}
