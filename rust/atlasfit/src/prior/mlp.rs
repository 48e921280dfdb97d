//! The paper's network prior: each chart is a small network from the unit square (or interval) into space, trained on this scan alone.
//!
//! In: points in the normalised frame (longest side about 1, centred). Out: an [`MlpAtlas`], whose charts can be evaluated, meshed and
//! projected onto. Source: *Deep Manifold Prior*, sections 3 ("Method") and 5 ("Experimental setup"). The architecture and the
//! regular-grid inputs are the paper's; no trimming happens here.

mod gemm;
mod net;

use crate::error::{Error, Result};
use crate::geometry::TriMesh;
use crate::geometry::vec3::Vec3;
use crate::loss::{Chamfer, Sample, stretch};
use crate::measure::Locator;
use crate::rng::Rng;
use crate::run::{Context, Stage};
use net::Net;
use rayon::prelude::*;

/// The dimension of a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Dim {
    /// Curves: charts are maps from the unit interval.
    Contour,
    /// Surfaces: charts are maps from the unit square.
    #[default]
    Surface,
}

/// How the networks are trained. The defaults are the paper's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MlpOptions {
    /// Number of charts, 1 or more. The paper compares 1 and 8.
    pub charts: usize,
    /// Curves or surfaces.
    pub dim: Dim,
    /// Steps of Adam. The paper does not say; after 400 the Chamfer distance of a surface falls slowly.
    pub iterations: usize,
    /// Weight of the stretch against the Chamfer distance (lambda), 0 or more.
    pub stretch_weight: f64,
    /// Adam's learning rate, positive.
    pub learning_rate: f64,
}

impl Default for MlpOptions {
    fn default() -> Self {
        Self { charts: 8, dim: Dim::Surface, iterations: 400, stretch_weight: 1.0, learning_rate: 1e-3 }
    }
}

impl MlpOptions {
    /// Fails on options out of range.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`].
    pub fn validate(&self) -> Result<()> {
        if self.charts == 0 {
            return Err(Error::invalid(
                "the network prior has 0 charts",
                "Give at least 1; the paper uses 8",
            ));
        }
        if !(self.stretch_weight >= 0.0 && self.stretch_weight.is_finite()) {
            return Err(Error::invalid(
                format!("stretch_weight is {}", self.stretch_weight),
                "Give 0 or more",
            ));
        }
        if !(self.learning_rate > 0.0 && self.learning_rate.is_finite()) {
            return Err(Error::invalid(
                format!("learning_rate is {}", self.learning_rate),
                "Give a positive number",
            ));
        }
        Ok(())
    }

    /// Lines and samples per line of each chart's grid: 4,096 samples per chart, 16,384 for a single one (paper, section 5).
    const fn grid(&self) -> [usize; 2] {
        match (self.dim, self.charts) {
            (Dim::Surface, 1) => [128, 128],
            (Dim::Surface, _) => [64, 64],
            (Dim::Contour, 1) => [1, 16384],
            (Dim::Contour, _) => [1, 4096],
        }
    }
}

/// What a training step minimised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// Summed squared nearest distances, both ways added.
    pub chamfer: f64,
    /// Stretch, added over the charts, before its weight.
    pub stretch: f64,
}

/// Networks in training.
pub struct Trainer {
    options: MlpOptions,
    grid: [usize; 2],
    nets: Vec<Net>,
    target: Chamfer,
    samples: Vec<Sample>,
    gradient: Vec<Sample>,
}

impl Trainer {
    /// Networks at a random start from `ctx.seed`. Points must be finite; the networks reach coordinates in (-1, 1).
    ///
    /// # Errors
    /// [`Error::InvalidArgument`], [`Error::EmptyInput`] without points, [`Error::OutOfMemory`].
    pub fn new(points: &[Vec3], options: &MlpOptions, ctx: &Context<'_>) -> Result<Self> {
        options.validate()?;
        Self::on_grid(points, options, options.grid(), ctx)
    }

    fn on_grid(points: &[Vec3], options: &MlpOptions, grid: [usize; 2], ctx: &Context<'_>) -> Result<Self> {
        let batch = grid[0] * grid[1];
        // Activations of 456 values per sample and parameters with gradients and moments.
        ctx.reserve((options.charts as u64).saturating_mul(2000 * batch as u64 + 1_000_000))?;
        let nets = (0..options.charts as u64)
            .into_par_iter()
            .map(|chart| Net::new(grid, &mut Rng::stream(ctx.seed, chart)))
            .collect();
        Ok(Self {
            options: *options,
            grid,
            nets,
            target: Chamfer::new(points, ctx)?,
            samples: vec![[0.0; 3]; options.charts * batch],
            gradient: vec![[0.0; 3]; options.charts * batch],
        })
    }

    /// One full step: forward, both directions of the Chamfer distance, stretch, backward, Adam. Gives the loss before the step.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn step(&mut self, ctx: &Context<'_>) -> Result<Loss> {
        self.forward(ctx)?;
        self.gradient.fill([0.0; 3]);
        let chamfer = self.target.value_gradient(&self.samples, &mut self.gradient, ctx)?;
        let batch = self.grid[0] * self.grid[1];
        let (grid, weight) = (self.grid, self.options.stretch_weight as f32);
        let rate = self.options.learning_rate as f32;
        let stretched = self
            .nets
            .par_iter_mut()
            .zip(self.samples.par_chunks(batch).zip(self.gradient.par_chunks_mut(batch)))
            .map(|(net, (samples, gradient))| {
                let value = stretch(samples, grid, weight, gradient);
                net.backward(gradient, ctx)?;
                net.adam(rate);
                Ok(value)
            })
            .collect::<Result<Vec<f64>>>()?;
        let stretch = if weight > 0.0 { stretched.iter().sum::<f64>() / f64::from(weight) } else { 0.0 };
        Ok(Loss { chamfer, stretch })
    }

    fn forward(&mut self, ctx: &Context<'_>) -> Result<()> {
        let batch = self.grid[0] * self.grid[1];
        self.nets
            .par_iter_mut()
            .zip(self.samples.par_chunks_mut(batch))
            .try_for_each(|(net, samples)| net.forward(samples, ctx))
    }

    /// The atlas as it stands.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn finish(mut self, ctx: &Context<'_>) -> Result<MlpAtlas> {
        self.forward(ctx)?;
        let samples = self.samples.iter().map(|s| s.map(f64::from)).collect();
        Ok(MlpAtlas { nets: self.nets, grid: self.grid, samples })
    }
}

/// A trained atlas, in the frame of the points it was fitted to.
pub struct MlpAtlas {
    nets: Vec<Net>,
    grid: [usize; 2],
    samples: Vec<Vec3>,
}

/// Fits networks to points in the normalised frame.
///
/// # Errors
/// [`Error::InvalidArgument`], [`Error::EmptyInput`] without points, [`Error::OutOfMemory`], cancelled or out of time.
pub fn fit(points: &[Vec3], options: &MlpOptions, ctx: &Context<'_>) -> Result<MlpAtlas> {
    ctx.stage(Stage::Fit, options.iterations);
    let mut trainer = Trainer::new(points, options, ctx)?;
    for _ in 0..options.iterations {
        trainer.step(ctx)?;
        ctx.advance(1);
    }
    trainer.finish(ctx)
}

impl MlpAtlas {
    /// Number of charts.
    #[must_use]
    pub fn charts(&self) -> usize {
        self.nets.len()
    }

    /// The position of chart `chart` at (u, v) in the unit square; a contour ignores u. `None` for a chart that does not exist.
    #[must_use]
    pub fn evaluate(&self, chart: usize, uv: [f64; 2]) -> Option<Vec3> {
        let u = if self.grid[0] > 1 { uv[0] } else { 0.0 };
        Some(self.nets.get(chart)?.evaluate([u as f32, uv[1] as f32]).map(f64::from))
    }

    /// The charts' grids as one mesh, chart after chart. A contour's triangles have no area: two of the corners are the same vertex.
    #[must_use]
    pub fn surface(&self) -> TriMesh {
        let [lines, side] = self.grid;
        let mut triangles = Vec::new();
        for chart in 0..self.nets.len() {
            let at = |i: usize, j: usize| (chart * lines * side + i * side + j) as u32;
            for i in 0..lines.max(2) - 1 {
                for j in 0..side - 1 {
                    if lines == 1 {
                        triangles.push([at(0, j), at(0, j + 1), at(0, j + 1)]);
                        continue;
                    }
                    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        TriMesh::new(self.samples.clone(), triangles)
    }

    /// For each point, the nearest place on the charts' grids (exact on their triangles or segments). Points must be finite.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn project(&self, points: &[Vec3], ctx: &Context<'_>) -> Result<Vec<Vec3>> {
        let feet = Locator::new(&self.surface(), ctx)?.nearest_all(points, ctx)?;
        Ok(points.iter().zip(feet).map(|(p, foot)| foot.map_or(*p, |f| f.point)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::vec3::{dist2, norm, normalize, scale};
    use crate::run::{CancelToken, Run};
    use std::time::{Duration, Instant};

    fn sphere(n: usize) -> Vec<Vec3> {
        let mut rng = Rng::new(4);
        (0..n).map(|_| scale(normalize([0; 3].map(|_| rng.normal())), 0.5)).collect()
    }

    fn trained(points: &[Vec3], how: MlpOptions, grid: [usize; 2], threads: usize) -> (MlpAtlas, Vec<Loss>) {
        Run { threads, seed: 3, ..Run::default() }
            .execute(|ctx| {
                let mut trainer = Trainer::on_grid(points, &how, grid, ctx)?;
                let losses = (0..how.iterations).map(|_| trainer.step(ctx)).collect::<Result<_>>()?;
                Ok((trainer.finish(ctx)?, losses))
            })
            .unwrap()
    }

    #[test]
    fn training_gives_the_same_bytes_for_any_number_of_threads_and_others_for_another_seed() {
        // Two bands per chart, the last block not full.
        let how = MlpOptions { charts: 3, iterations: 4, ..MlpOptions::default() };
        let points = sphere(500);
        let (one, losses) = trained(&points, how, [47, 49], 1);
        for threads in [2, 5] {
            let (other, again) = trained(&points, how, [47, 49], threads);
            assert_eq!(one.samples, other.samples);
            assert_eq!(losses, again);
        }
        let other = Run { seed: 4, ..Run::default() }
            .execute(|ctx| Trainer::on_grid(&points, &how, [47, 49], ctx)?.finish(ctx))
            .unwrap();
        assert_ne!(one.samples, other.samples);
    }

    #[test]
    fn a_sphere_is_learned_and_points_are_drawn_to_it() {
        let points = sphere(1500);
        let how = MlpOptions { charts: 4, iterations: 250, ..MlpOptions::default() };
        let (atlas, losses) = trained(&points, how, [16, 16], 0);
        assert!(losses[249].chamfer < 0.02 * losses[0].chamfer, "{:?} {:?}", losses[0], losses[249]);
        let mut rng = Rng::new(8);
        let noisy: Vec<Vec3> = points.iter().map(|p| p.map(|x| x + 0.03 * rng.normal())).collect();
        let clean = Run::default().execute(|ctx| atlas.project(&noisy, ctx)).unwrap();
        let off = |points: &[Vec3]| -> f64 {
            (points.iter().map(|p| (norm(*p) - 0.5).powi(2)).sum::<f64>() / points.len() as f64).sqrt()
        };
        assert!(off(&clean) < 0.6 * off(&noisy), "{} {}", off(&clean), off(&noisy));
    }

    #[test]
    fn projection_is_no_farther_than_any_sample_and_stays_put() {
        for (dim, grid) in [(Dim::Surface, [12, 11]), (Dim::Contour, [1, 40])] {
            let points = sphere(300);
            let how = MlpOptions { charts: 2, dim, iterations: 20, ..MlpOptions::default() };
            let (atlas, _) = trained(&points, how, grid, 0);
            let (clean, again) = Run::default()
                .execute(|ctx| {
                    let clean = atlas.project(&points, ctx)?;
                    let again = atlas.project(&clean, ctx)?;
                    Ok((clean, again))
                })
                .unwrap();
            for ((p, c), a) in points.iter().zip(&clean).zip(&again) {
                let nearest = atlas.samples.iter().map(|s| dist2(*p, *s)).fold(f64::INFINITY, f64::min);
                assert!(dist2(*p, *c) <= nearest + 1e-12);
                assert!(dist2(*c, *a) < 1e-16);
            }
            assert_eq!(atlas.charts(), 2);
            assert_eq!(atlas.evaluate(2, [0.5, 0.5]), None);
            let corner = atlas.evaluate(1, [0.0, 0.0]).unwrap();
            assert!(dist2(corner, atlas.samples[grid[0] * grid[1]]) < 1e-8);
            assert_eq!(atlas.surface().validate(), Ok(()));
        }
    }

    #[test]
    fn a_stronger_stretch_gives_smaller_charts() {
        let points = sphere(400);
        let end = |stretch_weight| {
            let how = MlpOptions { charts: 2, iterations: 60, stretch_weight, ..MlpOptions::default() };
            let (atlas, _) = trained(&points, how, [12, 12], 0);
            let samples: Vec<Sample> = atlas.samples.iter().map(|s| s.map(|x| x as f32)).collect();
            samples.chunks(144).map(|s| stretch(s, [12, 12], 1.0, &mut vec![[0.0; 3]; 144])).sum::<f64>()
        };
        let (none, some, much) = (end(0.0), end(30.0), end(1000.0));
        assert!(none > some && some > much, "{none} {some} {much}");
    }

    #[test]
    fn denoising_with_networks_answers_for_every_point_and_gives_one_surface() {
        use crate::denoise::{DenoiseOptions, Prior, denoise};
        let mut rng = Rng::new(9);
        let noisy = sphere(3000).iter().map(|p| p.map(|x| 20.0 * x + 3.0 + 0.1 * rng.normal())).collect();
        let cloud = crate::geometry::PointCloud::from_positions(noisy);
        // Far from trained: what the networks do not reach must come out as with the default prior.
        let prior = Prior::Mlp(MlpOptions { charts: 1, iterations: 5, ..MlpOptions::default() });
        let how = DenoiseOptions { prior, uv: false, ..DenoiseOptions::default() };
        let result = denoise(&cloud, &how, &mut Run::default()).unwrap();
        assert_eq!(result.points.len(), 3000);
        assert!((result.report.noise / 0.1 - 1.0).abs() < 0.3, "{}", result.report.noise);
        assert_eq!(result.report.parts, 1);
        let off = |points: &[Vec3]| -> f64 {
            points.iter().map(|p| (norm(p.map(|x| x - 3.0)) - 10.0).powi(2)).sum::<f64>()
        };
        assert!(off(&result.points.positions) < off(&cloud.positions));
    }

    #[test]
    fn options_out_of_range_and_no_points_are_errors() {
        let attempt = |points: &[Vec3], how: MlpOptions| {
            Run::default().execute(|ctx| fit(points, &how, ctx).map(|_| ())).unwrap_err()
        };
        let ok = MlpOptions { iterations: 1, ..MlpOptions::default() };
        for bad in [
            MlpOptions { charts: 0, ..ok },
            MlpOptions { stretch_weight: -1.0, ..ok },
            MlpOptions { stretch_weight: f64::NAN, ..ok },
            MlpOptions { learning_rate: 0.0, ..ok },
            MlpOptions { learning_rate: f64::INFINITY, ..ok },
        ] {
            assert!(matches!(attempt(&sphere(20), bad), Error::InvalidArgument { .. }));
        }
        assert!(matches!(attempt(&[], ok), Error::EmptyInput { .. }));
    }

    #[test]
    fn a_cancel_takes_effect_inside_a_step() {
        let token = CancelToken::new();
        let points = sphere(16_000);
        let watch = token.clone();
        let canceller = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(300));
            watch.cancel();
            Instant::now()
        });
        let how = MlpOptions { iterations: 100_000, ..MlpOptions::default() };
        let result =
            Run { cancel: Some(token), ..Run::default() }.execute(|ctx| fit(&points, &how, ctx).map(|_| ()));
        let late = canceller.join().unwrap().elapsed();
        assert_eq!(result, Err(Error::Cancelled));
        // The promise is 100 ms; a loaded machine must not fail the test.
        assert!(late < Duration::from_secs(5), "{late:?}");
    }
}
