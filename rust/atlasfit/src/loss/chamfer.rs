//! Chamfer distance between a scan and samples of charts (paper, section 3): summed squared nearest distances, both ways added.
//!
//! In: the scan once, samples at every step. Out: the value and its gradient. Which point is nearest to which is piecewise constant,
//! so the gradient is exact for the nearest points found.

use super::Sample;
use crate::error::Result;
use crate::geometry::neighbours::Neighbours;
use crate::geometry::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// Queries per task: below a millisecond of work between two looks at the cancel flag.
const BLOCK: usize = 512;

/// The scan, prepared for comparison with samples.
pub struct Chamfer {
    points: Vec<Sample>,
    tree: Neighbours,
}

impl Chamfer {
    /// Prepares a scan of finite points.
    ///
    /// # Errors
    /// [`crate::Error::EmptyInput`] without points.
    pub fn new(points: &[Vec3]) -> Result<Self> {
        Ok(Self {
            points: points.iter().map(|p| p.map(|x| x as f32)).collect(),
            tree: Neighbours::build(points)?,
        })
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
        let moving = Neighbours::build(&wide)?;
        let to_points: f64 = samples
            .par_chunks(BLOCK)
            .zip(gradient.par_chunks_mut(BLOCK))
            .map(|(samples, gradient)| {
                ctx.check()?;
                let mut sum = 0.0;
                for (s, g) in samples.iter().zip(gradient) {
                    let p = self.points[self.tree.nearest_one(s.map(f64::from)).index as usize];
                    sum += f64::from(pull(s, &p, g));
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
        Ok(to_points + to_samples)
    }
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
                let value = Chamfer::new(points)?.value_gradient(samples, &mut gradient, ctx)?;
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
}
