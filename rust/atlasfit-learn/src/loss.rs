//! What is minimised: Chamfer distance to the shape plus the weighted stretch of the charts.
//!
//! In: samples (shapes, samples, 3), points (shapes, points, 3). Out: the mean over the shapes, with
//! gradients through the samples. Which point is nearest to which comes from the core's trees, on an
//! NVIDIA GPU from all pairs, and is piecewise constant, so the gradient is exact for the nearest points
//! found. Source: *Deep Manifold Prior*, section 3; sums over points are means, as in
//! `atlasfit::measure::chamfer`.

use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::Context;
use atlasfit::spatial::Neighbours;
use candle_core::{D, Tensor};
use rayon::prelude::*;

use crate::error::Result;

/// Chamfer distance of each shape's samples to its points, mean over the shapes: a scalar. There may be
/// several answers to each shape: samples (answers shapes, samples, 3), all shapes' first answers first.
///
/// # Errors
/// Shapes that do not fit; samples that are not finite ([`atlasfit::Error::Diverged`]; on a GPU the distance
/// is not finite instead); cancelled or out of time.
pub fn chamfer(samples: &Tensor, points: &Tensor, ctx: &Context<'_>) -> Result<Tensor> {
    let ((all, n, _), (shapes, m, _)) = (samples.dims3()?, points.dims3()?);
    let device = samples.device();
    #[cfg(feature = "cuda")]
    if device.is_cuda() {
        return Ok(on_gpu::chamfer(&samples.contiguous()?, &points.contiguous()?)?);
    }
    let plain = |t: &Tensor| t.detach().flatten_all()?.to_vec1::<f32>();
    let (s, p) = (vectors(&plain(samples)?)?, vectors(&plain(points)?)?);
    let nearest: Vec<Vec<[Vec<u32>; 2]>> = (0..shapes)
        .into_par_iter()
        .map(|shape| {
            let p = &p[shape * m..][..m];
            let of_points = Neighbours::build(p, ctx)?;
            (shape..all)
                .step_by(shapes)
                .map(|i| {
                    let s = &s[i * n..][..n];
                    let of_samples = Neighbours::build(s, ctx)?;
                    Ok([nearest(s, &of_points, shape * m, ctx)?, nearest(p, &of_samples, i * n, ctx)?])
                })
                .collect()
        })
        .collect::<atlasfit::Result<_>>()?;
    let indices = |k: usize| -> Result<Tensor> {
        let flat: Vec<u32> =
            (0..all).flat_map(|i| nearest[i % shapes][i / shapes][k].iter().copied()).collect();
        let len = flat.len();
        Ok(Tensor::from_vec(flat, len, device)?)
    };
    let (flat, target) = (samples.reshape((all * n, 3))?, points.reshape((shapes * m, 3))?);
    let targets = Tensor::cat(&vec![&target; all / shapes], 0)?;
    let to_points = (&flat - target.index_select(&indices(0)?, 0)?)?.sqr()?.sum(D::Minus1)?.mean_all()?;
    let to_samples = (flat.index_select(&indices(1)?, 0)? - targets)?.sqr()?.sum(D::Minus1)?.mean_all()?;
    Ok((to_points + to_samples)?)
}

/// Points of the core; fails where one is not finite.
fn vectors(flat: &[f32]) -> atlasfit::Result<Vec<Vec3>> {
    if flat.iter().any(|x| !x.is_finite()) {
        return Err(atlasfit::Error::Diverged {
            what: "a sample of a chart is not finite".into(),
            advice: "Lower the learning rate".into(),
        });
    }
    Ok(flat.as_chunks::<3>().0.iter().map(|p| Vec3(p.map(f64::from))).collect())
}

/// For each point the index of its nearest one in a tree, plus `offset`.
fn nearest(from: &[Vec3], tree: &Neighbours, offset: usize, ctx: &Context<'_>) -> atlasfit::Result<Vec<u32>> {
    let mut out = Vec::with_capacity(from.len());
    for (i, p) in from.iter().enumerate() {
        ctx.check_at(i)?;
        out.push(offset as u32 + tree.nearest_one(*p).index);
    }
    Ok(out)
}

/// Stretch of charts, samples (shapes, charts, side side, 3): as `atlasfit_net::loss::stretch`, the mean over
/// a chart's samples of the summed squared distances to their grid neighbours; added over the charts, mean
/// over the shapes. A scalar.
///
/// # Errors
/// Shapes that do not fit.
pub fn stretch(samples: &Tensor, side: usize) -> Result<Tensor> {
    let (shapes, charts, n, _) = samples.dims4()?;
    let grid = samples.reshape((shapes * charts, side, side, 3))?;
    let edges = |axis: usize| -> candle_core::Result<Tensor> {
        (grid.narrow(axis, 1, side - 1)? - grid.narrow(axis, 0, side - 1)?)?.sqr()?.sum_all()
    };
    // Every edge counts twice, once from each end.
    Ok(((edges(1)? + edges(2)?)? * (2.0 / (n * shapes) as f64))?)
}

/// The same on an NVIDIA GPU, which looks at all pairs. Samples that are not finite make a distance that is
/// not.
#[cfg(feature = "cuda")]
mod on_gpu {
    use crate::ops::gpu::{made, with};
    use candle_core::op::BackpropOp;
    use candle_core::{CpuStorage, CudaStorage, CustomOp1, D, Layout, Result, Shape, Storage, Tensor, bail};

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
            bail!("the CPU takes trees")
        }

        fn cuda_fwd(&self, _: &CudaStorage, _: &Layout) -> Result<(CudaStorage, Shape)> {
            use candle_core::backend::BackendStorage;
            Ok((with(&self.value, |(s, layout)| s.try_clone(layout))?, ().into()))
        }

        fn bwd(&self, _: &Tensor, _: &Tensor, gradient: &Tensor) -> Result<Option<Tensor>> {
            Ok(Some(self.gradient.broadcast_mul(gradient)?))
        }
    }
}
