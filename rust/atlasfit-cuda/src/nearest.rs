//! Nearest points by looking at all of them, and what pulls samples to theirs: the twin of the core's trees
//! in `loss`.

use crate::launch::{BLOCK, Call, Given, Input, index, view};
use candle_core::backend::BackendStorage;
use candle_core::{CudaStorage, Result, bail};

/// For each point of `answers` sets the place among all others of the nearest one of its set: points (sets,
/// n, 3), others (sets, m, 3), where either may have fewer sets, which are then taken in turn. The result is
/// (answers, n), of u32.
///
/// # Errors
/// Those of candle; more numbers than 32 bits count.
pub fn nearest(
    points: Given<'_>,
    others: Given<'_>,
    [n, m]: [usize; 2],
    answers: usize,
) -> Result<CudaStorage> {
    let sets = points.1.shape().elem_count() / (3 * n);
    let other_sets = others.1.shape().elem_count() / (3 * m);
    index(answers * n.max(m) * 3)?;
    let sizes = [index(n)?, index(m)?, index(sets)?, index(other_sets)?];
    let grid = [(sizes[0].div_ceil(BLOCK), index(answers)?, 1), (BLOCK, 1, 1)];
    let inputs = [view(points)?, view(others)?];
    let call = Call { name: "nearest", grid, inputs: &inputs, sizes: &sizes, factors: &[] };
    call.make::<u32>(points.0.device(), answers * n)
}

/// Indices that lie in order.
fn indices<'a>((s, layout): Given<'a>) -> Result<Input<'a>> {
    let Some((from, to)) = layout.contiguous_offsets() else { bail!("indices that do not lie in order") };
    Ok(Input::Index(s.as_cuda_slice::<u32>()?.slice(from..to)))
}

/// The gradient at each sample (all samples, 3) of the mean squared distance to the nearest points and of
/// that of the points, which may be taken several times, to the nearest samples. `of_samples` and `of_points`
/// are the places that [`nearest`] found.
///
/// # Errors
/// As [`nearest`].
pub fn chamfer_gradient(
    samples: Given<'_>,
    points: Given<'_>,
    of_samples: Given<'_>,
    of_points: Given<'_>,
) -> Result<CudaStorage> {
    let device = samples.0.device();
    let len = |given: Given<'_>| given.1.shape().elem_count();
    let (numbers, pairs) = (len(samples), len(of_points));
    let mut pulls = device.alloc_zeros::<i64>(numbers)?;
    let sizes = [index(pairs)?, index(len(points) / 3)?];
    let inputs = [view(samples)?, view(points)?, indices(of_points)?];
    let grid = Call::threads(sizes[0]);
    Call { name: "chamfer_pulls", grid, inputs: &inputs, sizes: &sizes, factors: &[] }
        .fill(device, &mut pulls)?;
    let [a, b, _] = inputs;
    let inputs = [a, b, indices(of_samples)?, Input::Whole(&pulls)];
    let (sizes, factors) = ([index(numbers)?], [2.0 / (numbers / 3) as f32, 2.0 / pairs as f32]);
    let grid = Call::threads(sizes[0]);
    let call = Call { name: "chamfer_gradient", grid, inputs: &inputs, sizes: &sizes, factors: &factors };
    call.make::<f32>(device, numbers)
}
