//! Chamfer distance between a scan and samples of charts: squared distances to the nearest point of the other
//! set, summed over both sets.
//!
//! In: the scan once, samples at every step. Out: the value and its gradient. Which point is nearest to which
//! is piecewise constant, so the gradient is exact for the nearest points found.
//! Source: *Deep Manifold Prior*, section 3 ("Loss function"; the equation has no number).
//!
//! Samples move little between steps, so the distance to the last nearest point bounds the search. Where it
//! is short the search goes through cells, otherwise through a tree.

use crate::sample::Sample;
use atlasfit::error::Result;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::Context;
use atlasfit::spatial::neighbours::Neighbours;
use rayon::prelude::*;

/// Queries per task.
const BLOCK: usize = 512;
/// Queries between two looks at the cancel flag: a query far from everything takes up to 50 us.
const LOOK: usize = 32;

/// Margin for the rounding of f32 distances between normalised points: as a length in the normalised frame,
/// and as a share of the distance. About a hundred times the rounding of f32 (6e-8).
const ROUNDING: f32 = 1e-5;
/// A length above any between points of the normalised frame and samples, whose coordinates lie in (-1, 1).
const EVERYWHERE: f32 = 4.0;
/// Cells along the longest side per square root of the number of samples: a cell that a surface of this
/// extent passes through then holds a few samples.
const CELLS_PER_SIDE: f32 = 0.35;
/// The fewest and the most cells along the longest side: the most bounds the memory of the cells.
const SIDE: [f32; 2] = [4.0, 64.0];
/// The least extent of the cells, where all samples lie in one place.
const LEAST_EXTENT: f32 = 1e-6;

/// The scan, prepared for comparison with samples.
///
/// ```
/// use atlasfit::{Run, Vec3};
/// use atlasfit_net::loss::Chamfer;
/// let value = Run::default().execute(|ctx| {
///     let mut scan = Chamfer::new(&[Vec3([0.5, 0.0, 0.0]), Vec3([-0.5, 0.0, 0.0])], ctx)?;
///     scan.value_gradient(&[[0.0; 3]], [0, 1], [1.0; 2], &mut [[0.0; 3]], ctx)
/// })?;
/// assert_eq!(value, 0.25 + (0.25 + 0.25));
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub struct Chamfer {
    points: Vec<Sample>,
    tree: Neighbours,
    cells: Cells,
    /// For each sample its nearest point in the last call.
    last: Vec<u32>,
    /// For each point its nearest sample in the last call that asked.
    last_sample: Vec<u32>,
}

impl Chamfer {
    /// Prepares a scan of finite points.
    ///
    /// # Errors
    /// [`atlasfit::Error::EmptyInput`] without points; cancelled or out of time.
    pub fn new(points: &[Vec3], ctx: &Context<'_>) -> Result<Self> {
        let tree = Neighbours::build(points, ctx)?;
        let points: Vec<Sample> = points.iter().map(|p| p.to_f32()).collect();
        let cells = Cells::new(&points);
        Ok(Self { last_sample: vec![u32::MAX; points.len()], points, tree, cells, last: Vec::new() })
    }

    /// Number of points of the scan.
    #[must_use]
    pub fn points(&self) -> usize {
        self.points.len()
    }

    /// The Chamfer distance to finite `samples`, a squared length. Its gradient is added to `gradient`, which
    /// is as long as `samples`.
    ///
    /// `weights` are the factors of the sum over samples and of the sum over points, both 1 in the paper. The
    /// sum over points takes only points `part[0]`, `part[0] + part[1]` and so on; `[0, 1]` takes all.
    ///
    /// # Errors
    /// Cancelled, out of time; [`atlasfit::Error::EmptyInput`] without samples.
    pub fn value_gradient(
        &mut self,
        samples: &[Sample],
        part: [usize; 2],
        weights: [f64; 2],
        gradient: &mut [Sample],
        ctx: &Context<'_>,
    ) -> Result<f64> {
        let mut last = std::mem::take(&mut self.last);
        last.resize(samples.len(), u32::MAX);
        let to_points: f64 = samples
            .par_chunks(BLOCK)
            .zip(gradient.par_chunks_mut(BLOCK).zip(last.par_chunks_mut(BLOCK)))
            .map(|(samples, (gradient, last))| {
                let mut sum = 0.0;
                for (i, ((s, g), last)) in samples.iter().zip(gradient).zip(last).enumerate() {
                    if i.is_multiple_of(LOOK) {
                        ctx.check()?;
                    }
                    let bound = bound(s, &self.points, *last);
                    *last = if bound.sqrt() <= FAR * self.cells.size {
                        self.cells.nearest(s, *last, bound)
                    } else {
                        self.tree.nearest_one(Vec3(s.map(f64::from))).index
                    };
                    sum += f64::from(pull(s, &self.points[*last as usize], weights[0] as f32, g));
                }
                Ok(sum)
            })
            .collect::<Result<Vec<f64>>>()?
            .iter()
            .sum();
        let some: Vec<usize> = (part[0]..self.points.len()).step_by(part[1]).collect();
        // A tree is only made where most need it.
        let bound = |i: usize| bound(&self.points[i], samples, self.last_sample[i]);
        let mean = some.iter().map(|&i| f64::from(bound(i)).sqrt()).sum::<f64>() / some.len().max(1) as f64;
        let cells = Cells::new(samples);
        let tree = match mean <= f64::from(FAR * cells.size) {
            true => None,
            false => Some(Neighbours::build(
                &samples.iter().map(|s| Vec3(s.map(f64::from))).collect::<Vec<_>>(),
                ctx,
            )?),
        };
        let nearest = some
            .par_chunks(BLOCK)
            .map(|some| {
                let mut found: Vec<u32> = Vec::with_capacity(some.len());
                for some in some.chunks(LOOK) {
                    ctx.check()?;
                    found.extend(some.iter().map(|&i| match &tree {
                        Some(tree) => tree.nearest_one(Vec3(self.points[i].map(f64::from))).index,
                        None => cells.nearest(&self.points[i], self.last_sample[i], bound(i)),
                    }));
                }
                Ok(found)
            })
            .collect::<Result<Vec<_>>>()?
            .concat();
        for (&i, &n) in some.iter().zip(&nearest) {
            self.last_sample[i] = n;
        }
        let mut to_samples = 0.0;
        for (&i, &n) in some.iter().zip(&nearest) {
            let (s, p) = (&samples[n as usize], &self.points[i]);
            to_samples += f64::from(pull(s, p, weights[1] as f32, &mut gradient[n as usize]));
        }
        self.last = last;
        Ok(to_points + to_samples)
    }
}

/// Distance to the last nearest point, in cells, above which a search in a tree is faster.
const FAR: f32 = 2.0;

/// Squared distance from `p` to the last one of `others`; infinite where there is none.
fn bound(p: &Sample, others: &[Sample], last: u32) -> f32 {
    others.get(last as usize).map_or(f32::INFINITY, |o| distance2(o, p))
}

/// Samples sorted into cells. They are made at every step, in a fraction of the time that a tree takes.
struct Cells {
    low: Sample,
    size: f32,
    count: [usize; 3],
    /// Where each cell's samples begin; one entry more than cells.
    start: Vec<u32>,
    /// Samples with their indices, cell after cell.
    sorted: Vec<(Sample, u32)>,
}

impl Cells {
    /// Sorts finite samples; there is at least one.
    fn new(samples: &[Sample]) -> Self {
        let fold = |f: fn(f32, f32) -> f32, from: f32| -> Sample {
            [0, 1, 2].map(|k| samples.iter().map(|s| s[k]).fold(from, f))
        };
        let (low, high) = (fold(f32::min, f32::INFINITY), fold(f32::max, f32::NEG_INFINITY));
        let longest = (0..3).map(|k| high[k] - low[k]).fold(LEAST_EXTENT, f32::max);
        let side = (CELLS_PER_SIDE * (samples.len() as f32).sqrt()).clamp(SIDE[0], SIDE[1]);
        let size = longest / side;
        let count = [0, 1, 2].map(|k| ((high[k] - low[k]) / size) as usize + 1);
        let mut cells = Self { low, size, count, start: Vec::new(), sorted: Vec::new() };
        let cell: Vec<u32> =
            samples.iter().map(|s| cells.index([0, 1, 2].map(|k| cells.at(s[k], k))) as u32).collect();
        let mut start = vec![0u32; count[0] * count[1] * count[2] + 1];
        for &c in &cell {
            start[c as usize + 1] += 1;
        }
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut next = start.clone();
        cells.sorted = vec![([0.0; 3], 0); samples.len()];
        for (i, (s, &c)) in samples.iter().zip(&cell).enumerate() {
            let to = &mut next[c as usize];
            cells.sorted[*to as usize] = (*s, i as u32);
            *to += 1;
        }
        cells.start = start;
        cells
    }

    /// The cell of a coordinate along an axis; outside of the cells the nearest one.
    fn at(&self, x: f32, axis: usize) -> usize {
        (((x - self.low[axis]) / self.size).max(0.0) as usize).min(self.count[axis] - 1)
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.count[1] + y) * self.count[2] + z
    }

    /// The sample nearest to `p`, given one, `last`, at the squared distance `bound`; `bound` is infinite
    /// where none is known.
    fn nearest(&self, p: &Sample, last: u32, bound: f32) -> u32 {
        let mut best = (bound, last);
        let look = |from: usize, to: usize, best: &mut (f32, u32)| {
            for (s, i) in &self.sorted[self.start[from] as usize..self.start[to + 1] as usize] {
                let d = distance2(s, p);
                if d < best.0 {
                    *best = (d, *i);
                }
            }
        };
        // The cell of `p` first: what is found there bounds the search.
        let own = self.index([0, 1, 2].map(|k| self.at(p[k], k)));
        look(own, own, &mut best);
        let reach = if best.0.is_finite() { best.0.sqrt() * (1.0 + ROUNDING) + ROUNDING } else { EVERYWHERE };
        let [x, y, z] = [0, 1, 2].map(|k| (self.at(p[k] - reach, k), self.at(p[k] + reach, k)));
        for i in x.0..=x.1 {
            for j in y.0..=y.1 {
                // Cells along the last axis lie side by side.
                look(self.index([i, j, z.0]), self.index([i, j, z.1]), &mut best);
            }
        }
        best.1
    }
}

fn distance2(a: &Sample, b: &Sample) -> f32 {
    let d: Sample = std::array::from_fn(|k| a[k] - b[k]);
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

/// Weighted squared distance from `s` to `p`; its gradient with respect to `s` is added to `g`.
fn pull(s: &Sample, p: &Sample, weight: f32, g: &mut Sample) -> f32 {
    let mut sum = 0.0;
    for k in 0..3 {
        let d = s[k] - p[k];
        g[k] += 2.0 * weight * d;
        sum += d * d;
    }
    weight * sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use atlasfit::numeric::rng::Rng;
    use atlasfit::run::Run;

    fn run(points: &[Vec3], samples: &[Sample]) -> (f64, Vec<Sample>) {
        Run::default()
            .execute(|ctx| {
                let mut gradient = vec![[0.0; 3]; samples.len()];
                let value = Chamfer::new(points, ctx)?.value_gradient(
                    samples,
                    [0, 1],
                    [1.0; 2],
                    &mut gradient,
                    ctx,
                )?;
                Ok((value, gradient))
            })
            .unwrap()
    }

    #[test]
    fn small_sets_have_the_sum_of_both_directions() {
        // The sample at 0 is nearest to the point at 1 (1); the points at 1 and 3 are nearest to it (1 + 9).
        let (value, gradient) = run(&[Vec3([1.0, 0.0, 0.0]), Vec3([3.0, 0.0, 0.0])], &[[0.0; 3]]);
        assert_eq!(value, 11.0);
        assert_eq!(gradient, [[-2.0 - 2.0 - 6.0, 0.0, 0.0]]);
        let (value, gradient) = run(&[Vec3([0.5, 0.25, 0.0])], &[[0.5, 0.25, 0.0]]);
        assert_eq!((value, gradient[0]), (0.0, [0.0; 3]));
    }

    /// Chamfer distance by trying every pair, in f64.
    fn slow(points: &[Vec3], samples: &[Vec3]) -> f64 {
        let one_way = |from: &[Vec3], to: &[Vec3]| -> f64 {
            from.iter().map(|a| to.iter().map(|b| a.dist2(*b)).fold(f64::INFINITY, f64::min)).sum()
        };
        one_way(points, samples) + one_way(samples, points)
    }

    #[test]
    fn value_and_gradient_are_those_of_all_pairs_near_and_far() {
        let mut rng = Rng::new(5);
        for spread in [0.01, 0.3, 3.0] {
            let points: Vec<Vec3> = (0..300).map(|_| Vec3::from_fn(|_| rng.uniform() - 0.5)).collect();
            let samples: Vec<Sample> =
                (0..200).map(|i| points[i].map(|x| x + spread * rng.normal()).to_f32()).collect();
            let (value, gradient) = run(&points, &samples);
            let wide: Vec<Vec3> = samples.iter().map(|s| Vec3(s.map(f64::from))).collect();
            let exact = slow(&points, &wide);
            assert!((value - exact).abs() < 1e-5 * exact, "{value} {exact}");
            let h = 1e-7;
            for i in (0..200).step_by(17) {
                for k in 0..3 {
                    let at = |d: f64| {
                        let mut moved = wide.clone();
                        moved[i][k] += d;
                        slow(&points, &moved)
                    };
                    let difference = (at(h) - at(-h)) / (2.0 * h);
                    assert!((difference - f64::from(gradient[i][k])).abs() < 1e-4 * (1.0 + difference.abs()));
                }
            }
        }
    }

    #[test]
    fn moving_samples_get_what_fresh_ones_get() {
        let mut rng = Rng::new(6);
        let points: Vec<Vec3> = (0..400).map(|_| Vec3([rng.uniform(), rng.uniform(), 0.0])).collect();
        let mut samples: Vec<Sample> =
            (0..600).map(|_| [rng.uniform() as f32, rng.uniform() as f32, 0.0]).collect();
        let mut by_cells = 0;
        Run::default()
            .execute(|ctx| {
                let mut chamfer = Chamfer::new(&points, ctx)?;
                for step in [0.0, 0.001, 0.01, 0.1] {
                    for x in samples.iter_mut().flatten() {
                        *x += step * rng.normal() as f32;
                    }
                    let near = |(s, last): (&Sample, &u32)| {
                        bound(s, &chamfer.points, *last).sqrt() <= FAR * chamfer.cells.size
                    };
                    by_cells += samples.iter().zip(&chamfer.last).filter(|x| near(*x)).count();
                    let mut gradient = vec![[0.0; 3]; samples.len()];
                    let value = chamfer.value_gradient(&samples, [0, 1], [1.0; 2], &mut gradient, ctx)?;
                    assert_eq!((value, gradient), run(&points, &samples));
                }
                Ok(())
            })
            .unwrap();
        assert!(by_cells > 600, "{by_cells}");
    }
}
