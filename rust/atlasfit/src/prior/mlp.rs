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
            return Err(Error::invalid("the network prior has 0 charts", "Give at least 1; the paper uses 8"));
        }
        if !(self.stretch_weight >= 0.0 && self.stretch_weight.is_finite()) {
            return Err(Error::invalid(format!("stretch_weight is {}", self.stretch_weight), "Give 0 or more"));
        }
        if !(self.learning_rate > 0.0 && self.learning_rate.is_finite()) {
            return Err(Error::invalid(format!("learning_rate is {}", self.learning_rate), "Give a positive number"));
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
            target: Chamfer::new(points)?,
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
        let feet = Locator::new(&self.surface())?.nearest_all(points, ctx)?;
        Ok(points.iter().zip(feet).map(|(p, foot)| foot.map_or(*p, |f| f.point)).collect())
    }
}
