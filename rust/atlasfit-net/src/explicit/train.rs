//! Training of explicit networks, step by step.
//!
//! In: points in the normalised frame, options. Out: the loss of each step; the trained [`NetworkAtlas`].
//! Source: *Deep Manifold Prior*, equation 4 and section 5.1 ("Experimental setup").

use super::atlas::NetworkAtlas;
use super::options::{Dim, Network, NetworkOptions, Start};
use super::start::patches;
use crate::finite::check_finite;
use crate::loss::{Chamfer, stretch};
use crate::net::{Conv, Dense, Grid};
use crate::sample::Sample;
use atlasfit::error::{Error, Result};
use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::Context;
use rayon::prelude::*;

/// Memory per sample of a fully connected chart: the activations of 464 units, inputs and outputs (f32),
/// rounded up.
const BYTES_PER_SAMPLE: u64 = 2000;
/// Memory for the parameters of a fully connected chart, with gradients and Adam's moments, rounded up.
const BYTES_PER_DENSE: u64 = 1_000_000;
/// Memory for a convolutional chart: parameters with gradients and moments, activations, rounded up.
const BYTES_PER_CONV: u64 = 40_000_000;
/// The fewest samples along a line of a thinned grid.
const LEAST_SIDE: usize = 8;
/// The fewest points that a step looks at; where thinning left fewer, all are taken.
const LEAST_POINTS: usize = 100;

/// What a training step minimised: the two terms of the paper's equation 4.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Loss {
    /// Chamfer distance: summed squared nearest distances, both ways added. Squared length of the normalised
    /// frame.
    pub chamfer: f64,
    /// Stretch (equation 3), added over the charts, before its weight. Squared length of the normalised
    /// frame.
    pub stretch: f64,
}

/// A chart in training.
enum Chart {
    Dense(Box<Dense>),
    Conv(Box<Conv>),
}

impl Chart {
    fn forward(&mut self, out: &mut [Sample], ctx: &Context<'_>) -> Result<()> {
        match self {
            Self::Dense(net) => net.forward(out, ctx),
            Self::Conv(net) => net.forward(out, ctx),
        }
    }
    fn backward(&mut self, gradient: &[Sample], ctx: &Context<'_>) -> Result<()> {
        match self {
            Self::Dense(net) => net.backward(gradient, ctx),
            Self::Conv(net) => net.backward(gradient, ctx),
        }
    }
    fn aim(&mut self, wanted: &[Sample], ctx: &Context<'_>) -> Result<()> {
        match self {
            Self::Dense(net) => net.aim(wanted, ctx),
            Self::Conv(net) => net.aim(wanted, ctx),
        }
    }
    fn step(&mut self, rate: f32, ctx: &Context<'_>) -> Result<()> {
        match self {
            Self::Dense(net) => net.step(rate, ctx),
            Self::Conv(net) => net.step(rate, ctx),
        }
    }
}

/// Networks in training.
///
/// ```
/// use atlasfit::{Run, Vec3};
/// use atlasfit_net::explicit::{NetworkOptions, Start, Trainer};
/// let point = |i: u32| Vec3([f64::from(i / 10), f64::from(i % 10), 0.0]) * 0.05;
/// let points: Vec<Vec3> = (0..100).map(point).collect();
/// // From the other start a chart lies on so flat a scan at once.
/// let how = NetworkOptions::default().with_charts(1).with_start(Start::Torch);
/// let losses = Run::default().execute(|ctx| {
///     let mut trainer = Trainer::new(&points, &how, ctx)?;
///     trainer.thin(2);
///     (0..4).map(|_| Ok(trainer.step(1e-3, ctx)?.chamfer)).collect::<atlasfit::Result<Vec<f64>>>()
/// })?;
/// assert!(losses[3] < losses[0]);
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub struct Trainer {
    stretch_weight: f64,
    /// Parts that the points are taken in, one at each step.
    parts: usize,
    steps: usize,
    rng: Rng,
    /// The grid of all samples, and that of the running phase.
    full: [usize; 2],
    grid: [usize; 2],
    charts: Vec<Chart>,
    target: Chamfer,
    samples: Vec<Sample>,
    gradient: Vec<Sample>,
}

impl Trainer {
    /// Networks at their start: random from `ctx.seed`, and as [`Start`] says. Points must be finite; the
    /// networks reach coordinates in (-1, 1).
    ///
    /// # Errors
    /// [`atlasfit::Error::InvalidArgument`], [`atlasfit::Error::EmptyInput`] without points,
    /// [`atlasfit::Error::OutOfMemory`].
    pub fn new(points: &[Vec3], options: &NetworkOptions, ctx: &Context<'_>) -> Result<Self> {
        options.validate()?;
        Self::on_grid(points, options, options.grid(), None, ctx)
    }

    /// [`Self::new`], but the charts begin at samples on their grids, in place of what [`Start`] says: chart
    /// after
    /// chart, line after line, coordinates within (-1, 1).
    ///
    /// # Errors
    /// As [`Self::new`]; [`atlasfit::Error::InvalidArgument`] where there are not as many samples as the
    /// grids
    /// have.
    pub fn starting_at(
        points: &[Vec3],
        options: &NetworkOptions,
        first: &[Vec3],
        ctx: &Context<'_>,
    ) -> Result<Self> {
        options.validate()?;
        let grid = options.grid();
        let wanted = options.charts * grid[0] * grid[1];
        if first.len() != wanted {
            return Err(Error::invalid(
                format!("{} samples to start at", first.len()),
                format!("Give {} x {} for each of {} charts", grid[0], grid[1], options.charts),
            ));
        }
        Self::on_grid(points, options, grid, Some(first), ctx)
    }

    /// [`Self::new`] with another grid of samples per chart, and where charts begin.
    pub(super) fn on_grid(
        points: &[Vec3],
        options: &NetworkOptions,
        grid: [usize; 2],
        first: Option<&[Vec3]>,
        ctx: &Context<'_>,
    ) -> Result<Self> {
        let bytes = match options.network {
            Network::Dense => BYTES_PER_SAMPLE * (grid[0] * grid[1]) as u64 + BYTES_PER_DENSE,
            Network::Conv => BYTES_PER_CONV,
        };
        let needed = (options.charts as u64).saturating_mul(bytes);
        ctx.reserve(needed, "Raise the limit, or ask for fewer charts")?;
        let charts = (0..options.charts as u64)
            .into_par_iter()
            .map(|chart| {
                ctx.check()?;
                let mut rng = Rng::stream(ctx.seed, chart);
                let inputs = if options.dim == Dim::Contour { 1 } else { 2 };
                Ok(match options.network {
                    Network::Dense => {
                        let outputs = if options.flat { 2 } else { 3 };
                        Chart::Dense(Box::new(Dense::new(inputs, outputs, &mut rng)))
                    }
                    Network::Conv => Chart::Conv(Box::new(Conv::new(&mut rng))),
                })
            })
            .collect::<Result<_>>()?;
        let mut trainer = Self {
            stretch_weight: options.stretch_weight,
            parts: 1,
            steps: 0,
            rng: Rng::stream(ctx.seed, u64::MAX),
            full: grid,
            grid,
            charts,
            target: Chamfer::new(points, ctx)?,
            samples: Vec::new(),
            gradient: Vec::new(),
        };
        trainer.set_grid(grid);
        if let Some(first) = first {
            let samples: Vec<Sample> = first.iter().map(|p| p.to_f32()).collect();
            (trainer.charts.par_iter_mut().zip(samples.par_chunks(grid[0] * grid[1])))
                .try_for_each(|(chart, samples)| chart.aim(samples, ctx))?;
        } else if options.start == Start::Patches {
            let patches = patches(points, options.charts, ctx)?;
            (trainer.charts.par_iter_mut().zip(patches))
                .try_for_each(|(chart, patch)| chart.aim(&patch.samples(options.dim, grid), ctx))?;
        }
        Ok(trainer)
    }

    /// Sets the samples' inputs: those of a grid in the unit square, or interval, from `first` on in steps of
    /// `step`.
    fn set_inputs(&mut self, first: [f32; 2], step: [f32; 2]) {
        for chart in &mut self.charts {
            if let Chart::Dense(net) = chart {
                net.set_grid(Grid { size: self.grid, first, step });
            }
        }
    }

    fn set_grid(&mut self, grid: [usize; 2]) {
        self.grid = grid;
        let batch = grid[0] * grid[1];
        self.set_inputs([0.0; 2], grid.map(|n| 1.0 / n.saturating_sub(1).max(1) as f32));
        self.samples = vec![[0.0; 3]; self.charts.len() * batch];
        self.gradient = self.samples.clone();
    }

    /// Goes on with fewer samples and points per step, or with all again (0): a grid's sides are divided by
    /// 2^thin, points and a curve's samples by 4^thin. Each step then takes other ones, so that the surface
    /// between them is fitted too.
    pub fn thin(&mut self, thin: u32) {
        let [lines, side] = self.full;
        let coarse = |n: usize, shift: u32| (n >> shift).max(LEAST_SIDE).min(n);
        self.parts = if self.target.points() >> (2 * thin) < LEAST_POINTS { 1 } else { 1 << (2 * thin) };
        self.set_grid(match lines {
            1 => [1, coarse(side, 2 * thin)],
            _ => [coarse(lines, thin), coarse(side, thin)],
        });
    }

    /// One step of Adam with the learning rate `rate`, positive. Gives the loss before the step.
    ///
    /// # Errors
    /// [`atlasfit::Error::Diverged`] where the loss is no finite number; cancelled or out of time.
    pub fn step(&mut self, rate: f64, ctx: &Context<'_>) -> Result<Loss> {
        if self.grid != self.full {
            let step = self.grid.map(|n| 1.0 / n as f32);
            let first = step.map(|s| s * self.rng.uniform() as f32);
            self.set_inputs(first, step);
        }
        self.forward(ctx)?;
        self.gradient.fill([0.0; 3]);
        // Sums over some of the samples and points are scaled up to those over all.
        let batch = self.grid[0] * self.grid[1];
        let thin_samples = (self.full[0] * self.full[1]) as f64 / batch as f64;
        let part = [self.steps % self.parts, self.parts];
        self.steps += 1;
        let weights = [thin_samples, self.parts as f64];
        let chamfer = self.target.value_gradient(&self.samples, part, weights, &mut self.gradient, ctx)?;
        // A thinned grid has fewer edges along a line, which are longer by the same factor.
        let longer = (self.full[1] as f64 / self.grid[1] as f64).powi(2);
        let (grid, weight) = (self.grid, (self.stretch_weight / longer) as f32);
        let stretched = self
            .charts
            .par_iter_mut()
            .zip(self.samples.par_chunks(batch).zip(self.gradient.par_chunks_mut(batch)))
            .map(|(chart, (samples, gradient))| {
                let value = stretch(samples, grid, weight, gradient);
                chart.backward(gradient, ctx)?;
                chart.step(rate as f32, ctx)?;
                Ok(value)
            })
            .collect::<Result<Vec<f64>>>()?;
        let stretch = if weight > 0.0 { stretched.iter().sum::<f64>() / self.stretch_weight } else { 0.0 };
        check_finite([chamfer, stretch], self.steps - 1)?;
        Ok(Loss { chamfer, stretch })
    }

    fn forward(&mut self, ctx: &Context<'_>) -> Result<()> {
        let batch = self.grid[0] * self.grid[1];
        self.charts.par_iter_mut().zip(self.samples.par_chunks_mut(batch)).try_for_each(|(chart, samples)| {
            chart.forward(samples, ctx)?;
            // Before anything is searched among them.
            check_finite(samples.iter().flatten().map(|x| f64::from(*x)), self.steps)
        })
    }

    /// The atlas as it stands.
    ///
    /// # Errors
    /// [`atlasfit::Error::Diverged`] where a network gives no finite numbers; cancelled or out of time.
    pub fn finish(mut self, ctx: &Context<'_>) -> Result<NetworkAtlas> {
        self.set_grid(self.full);
        self.forward(ctx)?;
        let samples = self.samples.iter().map(|s| Vec3(s.map(f64::from))).collect();
        Ok(NetworkAtlas { charts: self.charts.len(), grid: self.grid, samples })
    }
}
