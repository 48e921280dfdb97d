//! Chamfer distance between a scan and samples of charts (paper, section 3): summed squared nearest distances, both ways added.
//!
//! In: the scan once, samples at every step. Out: the value and its gradient. Which point is nearest to which is piecewise constant,
//! so the gradient is exact for the nearest points found.
//!
//! Samples move little between steps, so a sample's nearest point is first sought around its last one: no point outside the list of p's
//! neighbours lies within reach(p) of p, hence none lies within reach(p) - |s - p| of s. Only samples that this does not settle ask the tree.

use super::Sample;
use crate::error::Result;
use crate::geometry::neighbours::Neighbours;
use crate::geometry::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// Queries per task: below a millisecond of work between two looks at the cancel flag.
const BLOCK: usize = 512;

/// Neighbours kept per point. Their reach is about twice the point spacing.
const AROUND: usize = 12;
/// Margin for the rounding of f32 distances between normalised points.
const ROUNDING: f32 = 1e-5;

/// The scan, prepared for comparison with samples.
pub struct Chamfer {
    points: Vec<Sample>,
    tree: Neighbours,
    /// For each point its nearest neighbours, itself among them, and the distance within which there are no others.
    around: Vec<(Vec<u32>, f32)>,
    /// For each sample its nearest point in the last call.
    last: Vec<u32>,
}

impl Chamfer {
    /// Prepares a scan of finite points.
    ///
    /// # Errors
    /// [`crate::Error::EmptyInput`] without points; cancelled or out of time.
    pub fn new(points: &[Vec3], ctx: &Context<'_>) -> Result<Self> {
        let tree = Neighbours::build(points, ctx)?;
        let around = points
            .par_chunks(BLOCK)
            .map(|block| {
                ctx.check()?;
                let mut found = Vec::new();
                Ok(block
                    .iter()
                    .map(|p| {
                        tree.nearest(*p, AROUND, &mut found);
                        // With all points in the list there is nothing beyond it.
                        let all = found.len() == points.len();
                        let reach = found.last().map_or(0.0, |f| f.dist2.sqrt() as f32);
                        (found.iter().map(|f| f.index).collect(), if all { f32::INFINITY } else { reach })
                    })
                    .collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>>>()?
            .concat();
        let points = points.iter().map(|p| p.map(|x| x as f32)).collect();
        Ok(Self { points, tree, around, last: Vec::new() })
    }

    /// The Chamfer distance to finite `samples`; its gradient is added to `gradient`, one per sample.
    ///
    /// # Errors
    /// Cancelled, out of time; [`crate::Error::EmptyInput`] without samples.
    pub fn value_gradient(
        &mut self,
        samples: &[Sample],
        gradient: &mut [Sample],
        ctx: &Context<'_>,
    ) -> Result<f64> {
        let wide: Vec<Vec3> = samples.iter().map(|s| s.map(f64::from)).collect();
        let moving = Neighbours::build(&wide, ctx)?;
        let mut last = std::mem::take(&mut self.last);
        last.resize(samples.len(), u32::MAX);
        let to_points: f64 = samples
            .par_chunks(BLOCK)
            .zip(gradient.par_chunks_mut(BLOCK).zip(last.par_chunks_mut(BLOCK)))
            .map(|(samples, (gradient, last))| {
                ctx.check()?;
                let mut sum = 0.0;
                for ((s, g), last) in samples.iter().zip(gradient).zip(last) {
                    *last = self
                        .settle(s, *last)
                        .unwrap_or_else(|| self.tree.nearest_one(s.map(f64::from)).index);
                    sum += f64::from(pull(s, &self.points[*last as usize], g));
                }
                Ok(sum)
            })
            .collect::<Result<Vec<f64>>>()?
            .iter()
            .sum();
        let nearest = self
            .points
            .par_chunks(BLOCK)
            .map(|points| {
                ctx.check()?;
                Ok(points.iter().map(|p| moving.nearest_one(p.map(f64::from)).index).collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>>>()?
            .concat();
        let mut to_samples = 0.0;
        for (p, &i) in self.points.iter().zip(&nearest) {
            to_samples += f64::from(pull(&samples[i as usize], p, &mut gradient[i as usize]));
        }
        self.last = last;
        Ok(to_points + to_samples)
    }

    /// The point nearest to `s`, where the neighbours of the point `last` are enough to know it.
    fn settle(&self, s: &Sample, last: u32) -> Option<u32> {
        let (around, reach) = self.around.get(last as usize)?;
        let mut best = (f32::INFINITY, last);
        for &i in around {
            let d = distance2(s, &self.points[i as usize]);
            if d < best.0 {
                best = (d, i);
            }
        }
        let limit = distance2(s, &self.points[last as usize]).sqrt() + best.0.sqrt() + ROUNDING;
        (limit < *reach).then_some(best.1)
    }
}

fn distance2(a: &Sample, b: &Sample) -> f32 {
    let d: Sample = std::array::from_fn(|k| a[k] - b[k]);
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

/// Squared distance from `s` to `p`; its gradient with respect to `s` is added to `g`.
fn pull(s: &Sample, p: &Sample, g: &mut Sample) -> f32 {
    let mut sum = 0.0;
    for k in 0..3 {
        let d = s[k] - p[k];
        g[k] += 2.0 * d;
        sum += d * d;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;
    use crate::run::Run;

    fn run(points: &[Vec3], samples: &[Sample]) -> (f64, Vec<Sample>) {
        Run::default()
            .execute(|ctx| {
                let mut gradient = vec![[0.0; 3]; samples.len()];
                let value = Chamfer::new(points, ctx)?.value_gradient(samples, &mut gradient, ctx)?;
                Ok((value, gradient))
            })
            .unwrap()
    }

    #[test]
    fn small_sets_have_the_sum_of_both_directions() {
        // The sample at 0 is nearest to the point at 1 (1); the points at 1 and 3 are nearest to it (1 + 9).
        let (value, gradient) = run(&[[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]], &[[0.0; 3]]);
        assert_eq!(value, 11.0);
        assert_eq!(gradient, [[-2.0 - 2.0 - 6.0, 0.0, 0.0]]);
        let (value, gradient) = run(&[[0.5, 0.25, 0.0]], &[[0.5, 0.25, 0.0]]);
        assert_eq!((value, gradient[0]), (0.0, [0.0; 3]));
    }

    /// Chamfer distance by trying every pair, in f64.
    fn slow(points: &[Vec3], samples: &[Vec3]) -> f64 {
        let one_way = |from: &[Vec3], to: &[Vec3]| -> f64 {
            from.iter()
                .map(|a| {
                    to.iter().map(|b| crate::geometry::vec3::dist2(*a, *b)).fold(f64::INFINITY, f64::min)
                })
                .sum()
        };
        one_way(points, samples) + one_way(samples, points)
    }

    #[test]
    fn value_and_gradient_are_those_of_all_pairs_near_and_far() {
        let mut rng = Rng::new(5);
        for spread in [0.01, 0.3, 3.0] {
            let points: Vec<Vec3> = (0..300).map(|_| [0; 3].map(|_| rng.uniform() - 0.5)).collect();
            let samples: Vec<Sample> =
                (0..200).map(|i| points[i].map(|x| (x + spread * rng.normal()) as f32)).collect();
            let (value, gradient) = run(&points, &samples);
            let wide: Vec<Vec3> = samples.iter().map(|s| s.map(f64::from)).collect();
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
        let points: Vec<Vec3> = (0..400).map(|_| [rng.uniform(), rng.uniform(), 0.0]).collect();
        let mut samples: Vec<Sample> =
            (0..600).map(|_| [rng.uniform() as f32, rng.uniform() as f32, 0.0]).collect();
        let mut settled = 0;
        Run::default()
            .execute(|ctx| {
                let mut chamfer = Chamfer::new(&points, ctx)?;
                for step in [0.0, 0.001, 0.01, 0.1] {
                    for x in samples.iter_mut().flatten() {
                        *x += step * rng.normal() as f32;
                    }
                    let known = |(s, last): (&Sample, &u32)| chamfer.settle(s, *last).is_some();
                    settled += samples.iter().zip(&chamfer.last).filter(|x| known(*x)).count();
                    let mut gradient = vec![[0.0; 3]; samples.len()];
                    let value = chamfer.value_gradient(&samples, &mut gradient, ctx)?;
                    assert_eq!((value, gradient), run(&points, &samples));
                }
                Ok(())
            })
            .unwrap();
        assert!(settled > 600, "{settled}");
    }
}
