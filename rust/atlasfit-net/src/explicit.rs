//! The paper's explicit prior: each chart is a small network into space, trained on this scan alone.
//!
//! In: points in the normalised frame (longest side about 1, centred). Out: a [`NetworkAtlas`], whose charts are samples on regular grids that
//! can be meshed and trimmed. Source: *Deep Manifold Prior*, sections 3 ("Method") and 5 ("Experimental setup"), supplement A.

use super::net::{Conv, Dense, Grid, conv};
use crate::loss::{Chamfer, Sample, stretch};
use atlasfit::error::{Error, Result};
use atlasfit::geometry::TriMesh;
use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3::{self, Vec3};
use atlasfit::run::{Context, Stage};
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

/// What a chart is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Network {
    /// Fully connected, a function of the place in the chart.
    #[default]
    Dense,
    /// Convolutions of fixed noise, 32 x 32 samples; surfaces in space only.
    Conv,
}

/// How training goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Recipe {
    /// As in the paper: all samples at every step, one learning rate.
    Paper,
    /// From few samples and points to all of them, at learning rates that fall.
    #[default]
    Fast,
}

/// How the networks are trained. The defaults are the paper's, but for the recipe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetworkOptions {
    /// What a chart is made of.
    pub network: Network,
    /// Number of charts, 1 or more. The paper compares 1 and 8.
    pub charts: usize,
    /// Curves or surfaces.
    pub dim: Dim,
    /// Charts lie in the plane z = 0 (drawings).
    pub flat: bool,
    /// How training goes.
    pub recipe: Recipe,
    /// Steps of the paper's recipe, at most: training stops early where the loss no longer falls.
    pub iterations: usize,
    /// Weight of the stretch against the Chamfer distance (lambda), 0 or more.
    pub stretch_weight: f64,
    /// Adam's learning rate in the paper's recipe, positive.
    pub learning_rate: f64,
}

impl Default for NetworkOptions {
    fn default() -> Self {
        Self {
            network: Network::Dense,
            charts: 8,
            dim: Dim::Surface,
            flat: false,
            recipe: Recipe::Fast,
            iterations: 1000,
            stretch_weight: 1.0,
            learning_rate: 1e-3,
        }
    }
}

/// A part of a training: so many steps with the grid's sides and the points thinned out by a power of two.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Leg {
    /// Samples per side are divided by 2^thin, points by 4^thin (a curve's samples by 4^thin).
    thin: u32,
    steps: usize,
    /// Learning rate at the start and at the end, geometric between them.
    rate: [f64; 2],
}

/// Steps after which the paper's recipe asks whether the loss still falls, and the least fall that counts.
const WINDOW: usize = 100;
const LEAST_FALL: f64 = 0.02;

/// The fast recipe. A quarter of the samples finds the shape; all of them take out what the gaps between samples hid. Larger rates fall faster
/// at first and end worse: batch norm makes the weights' sizes free, large steps make them grow, and the larger they are the less a step does.
const FAST_DENSE: [Leg; 2] =
    [Leg { thin: 1, steps: 350, rate: [1e-3; 2] }, Leg { thin: 0, steps: 200, rate: [1e-3, 2e-4] }];
/// Convolutions always give all samples.
const FAST_CONV: [Leg; 1] = [Leg { thin: 0, steps: 200, rate: [3e-3, 3e-4] }];

impl NetworkOptions {
    /// Fails on options out of range.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`].
    pub fn validate(&self) -> Result<()> {
        let invalid = |what: String, advice: &str| Err(Error::invalid(what, advice));
        if self.charts == 0 {
            return invalid("the network prior has 0 charts".into(), "Give at least 1; the paper uses 8");
        }
        if !(self.stretch_weight >= 0.0 && self.stretch_weight.is_finite()) {
            return invalid(format!("stretch_weight is {}", self.stretch_weight), "Give 0 or more");
        }
        if !(self.learning_rate > 0.0 && self.learning_rate.is_finite()) {
            return invalid(format!("learning_rate is {}", self.learning_rate), "Give a positive number");
        }
        if self.network == Network::Conv && (self.dim == Dim::Contour || self.flat) {
            return invalid(
                "the convolutional prior makes surfaces in space only".into(),
                "Use the fully connected one for curves and drawings",
            );
        }
        Ok(())
    }

    /// Lines and samples per line of each chart's grid: 4,096 samples per chart, 16,384 for a single one (paper, section 5).
    const fn grid(&self) -> [usize; 2] {
        match (self.network, self.dim, self.charts) {
            (Network::Conv, ..) => conv::GRID,
            (_, Dim::Surface, 1) => [128, 128],
            (_, Dim::Surface, _) => [64, 64],
            (_, Dim::Contour, 1) => [1, 16384],
            (_, Dim::Contour, _) => [1, 4096],
        }
    }

    fn legs(&self) -> Vec<Leg> {
        match (self.recipe, self.network) {
            (Recipe::Paper, _) => {
                vec![Leg { thin: 0, steps: self.iterations, rate: [self.learning_rate; 2] }]
            }
            (Recipe::Fast, Network::Dense) => FAST_DENSE.to_vec(),
            (Recipe::Fast, Network::Conv) => FAST_CONV.to_vec(),
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
    fn step(&mut self, rate: f32) {
        match self {
            Self::Dense(net) => net.step(rate),
            Self::Conv(net) => net.step(rate),
        }
    }
}

/// Networks in training.
pub struct Trainer {
    stretch_weight: f64,
    /// Parts that the points are taken in, one at each step.
    parts: usize,
    steps: usize,
    rng: Rng,
    /// The grid of the whole training and that of the running leg.
    full: [usize; 2],
    grid: [usize; 2],
    charts: Vec<Chart>,
    target: Chamfer,
    samples: Vec<Sample>,
    gradient: Vec<Sample>,
}

impl Trainer {
    /// Networks at a random start from `ctx.seed`. Points must be finite; the networks reach coordinates in (-1, 1).
    ///
    /// # Errors
    /// [`Error::InvalidArgument`], [`Error::EmptyInput`] without points, [`Error::OutOfMemory`].
    pub fn new(points: &[Vec3], options: &NetworkOptions, ctx: &Context<'_>) -> Result<Self> {
        options.validate()?;
        Self::on_grid(points, options, options.grid(), ctx)
    }

    fn on_grid(
        points: &[Vec3],
        options: &NetworkOptions,
        grid: [usize; 2],
        ctx: &Context<'_>,
    ) -> Result<Self> {
        // Activations of 464 values per sample; parameters with gradients and moments.
        let bytes = match options.network {
            Network::Dense => 2000 * (grid[0] * grid[1]) as u64 + 1_000_000,
            Network::Conv => 40_000_000,
        };
        ctx.reserve((options.charts as u64).saturating_mul(bytes))?;
        let charts = (0..options.charts as u64)
            .into_par_iter()
            .map(|chart| {
                let mut rng = Rng::stream(ctx.seed, chart);
                let inputs = if options.dim == Dim::Contour { 1 } else { 2 };
                match options.network {
                    Network::Dense => {
                        let outputs = if options.flat { 2 } else { 3 };
                        Chart::Dense(Box::new(Dense::new(inputs, outputs, &mut rng)))
                    }
                    Network::Conv => Chart::Conv(Box::new(Conv::new(&mut rng))),
                }
            })
            .collect();
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
        Ok(trainer)
    }

    /// Puts the samples at these places of the unit square, or interval.
    fn place(&mut self, first: [f32; 2], step: [f32; 2]) {
        for chart in &mut self.charts {
            if let Chart::Dense(net) = chart {
                net.set_grid(Grid { size: self.grid, first, step });
            }
        }
    }

    fn set_grid(&mut self, grid: [usize; 2]) {
        self.grid = grid;
        let batch = grid[0] * grid[1];
        self.place([0.0; 2], grid.map(|n| 1.0 / n.saturating_sub(1).max(1) as f32));
        self.samples = vec![[0.0; 3]; self.charts.len() * batch];
        self.gradient = self.samples.clone();
    }

    /// Goes on with fewer samples and points per step, or with all again: sides are divided by 2^thin, points (and a curve's samples) by
    /// 4^thin. Each step then takes others, so that nothing between them is left free.
    pub fn thin(&mut self, thin: u32) {
        let [lines, side] = self.full;
        let coarse = |n: usize, shift: u32| (n >> shift).max(8).min(n);
        self.parts = if self.target.points() >> (2 * thin) < 100 { 1 } else { 1 << (2 * thin) };
        self.set_grid(match lines {
            1 => [1, coarse(side, 2 * thin)],
            _ => [coarse(lines, thin), coarse(side, thin)],
        });
    }

    /// One full step: forward, both directions of the Chamfer distance, stretch, backward, Adam. Gives the loss before the step.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn step(&mut self, rate: f64, ctx: &Context<'_>) -> Result<Loss> {
        if self.grid != self.full {
            let step = self.grid.map(|n| 1.0 / n as f32);
            let first = step.map(|s| s * self.rng.uniform() as f32);
            self.place(first, step);
        }
        self.forward(ctx)?;
        self.gradient.fill([0.0; 3]);
        // Thinned sums stand for the whole ones.
        let batch = self.grid[0] * self.grid[1];
        let thin_samples = (self.full[0] * self.full[1]) as f64 / batch as f64;
        let part = [self.steps % self.parts, self.parts];
        self.steps += 1;
        let weights = [thin_samples, self.parts as f64];
        let chamfer = self.target.value_gradient(&self.samples, part, weights, &mut self.gradient, ctx)?;
        // Edges are as much longer as there are fewer of them along a line.
        let longer = (self.full[1] as f64 / self.grid[1] as f64).powi(2);
        let (grid, weight) = (self.grid, (self.stretch_weight / longer) as f32);
        let stretched = self
            .charts
            .par_iter_mut()
            .zip(self.samples.par_chunks(batch).zip(self.gradient.par_chunks_mut(batch)))
            .map(|(chart, (samples, gradient))| {
                let value = stretch(samples, grid, weight, gradient);
                chart.backward(gradient, ctx)?;
                chart.step(rate as f32);
                Ok(value)
            })
            .collect::<Result<Vec<f64>>>()?;
        let stretch = if weight > 0.0 { stretched.iter().sum::<f64>() / self.stretch_weight } else { 0.0 };
        Ok(Loss { chamfer, stretch })
    }

    fn forward(&mut self, ctx: &Context<'_>) -> Result<()> {
        let batch = self.grid[0] * self.grid[1];
        self.charts
            .par_iter_mut()
            .zip(self.samples.par_chunks_mut(batch))
            .try_for_each(|(chart, samples)| chart.forward(samples, ctx))
    }

    /// The atlas as it stands.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn finish(mut self, ctx: &Context<'_>) -> Result<NetworkAtlas> {
        self.set_grid(self.full);
        self.forward(ctx)?;
        let samples = self.samples.iter().map(|s| Vec3(s.map(f64::from))).collect();
        Ok(NetworkAtlas { charts: self.charts.len(), grid: self.grid, samples })
    }
}

/// A trained atlas: samples of its charts, in the frame of the points it was fitted to.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkAtlas {
    /// Number of charts.
    pub charts: usize,
    /// Lines and samples per line of each chart; a curve is one line.
    pub grid: [usize; 2],
    /// Chart after chart, line after line.
    pub samples: Vec<Vec3>,
}

/// Fits networks to points in the normalised frame.
///
/// # Errors
/// [`Error::InvalidArgument`], [`Error::EmptyInput`] without points, [`Error::OutOfMemory`], cancelled or out of time.
pub fn fit(points: &[Vec3], options: &NetworkOptions, ctx: &Context<'_>) -> Result<NetworkAtlas> {
    fit_watched(points, options, ctx, &mut |_, _| true)
}

/// [`fit`] that tells `watch` each step and its loss (of a thinned step, of what it stands for), and stops where it says false.
///
/// # Errors
/// As [`fit`].
pub fn fit_watched(
    points: &[Vec3],
    options: &NetworkOptions,
    ctx: &Context<'_>,
    watch: &mut (dyn FnMut(usize, Loss) -> bool + Send),
) -> Result<NetworkAtlas> {
    let legs = options.legs();
    ctx.stage(Stage::Fit, legs.iter().map(|l| l.steps).sum());
    let mut trainer = Trainer::new(points, options, ctx)?;
    let (mut step, mut running) = (0, true);
    for leg in legs {
        if options.recipe == Recipe::Fast && options.network == Network::Dense {
            trainer.thin(leg.thin);
        }
        let (mut last, mut sum) = (f64::INFINITY, 0.0);
        for i in 0..leg.steps {
            let at = i as f64 / leg.steps.max(2) as f64;
            let rate = leg.rate[0] * (leg.rate[1] / leg.rate[0]).powf(at);
            let loss = trainer.step(rate, ctx)?;
            ctx.advance(1);
            step += 1;
            running = watch(step, loss);
            sum += loss.chamfer + options.stretch_weight * loss.stretch;
            if !running {
                break;
            }
            if options.recipe == Recipe::Paper && (i + 1) % WINDOW == 0 {
                if sum > (1.0 - LEAST_FALL) * last {
                    break;
                }
                (last, sum) = (sum, 0.0);
            }
        }
        if !running {
            break;
        }
    }
    trainer.finish(ctx)
}

impl NetworkAtlas {
    /// The charts' grids as one mesh, chart after chart. A curve's triangles have no area: two of the corners are the same vertex.
    #[must_use]
    pub fn surface(&self) -> TriMesh {
        let [lines, side] = self.grid;
        let mut triangles = Vec::new();
        for chart in 0..self.charts {
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
        TriMesh::new(vec3::plain(self.samples.clone()), triangles)
    }

    /// Share of the samples that lie nearer to another chart's than half their own chart's spacing: how much charts overlap, in [0, 1].
    ///
    /// # Errors
    /// [`Error::EmptyInput`] without samples.
    pub fn overlap(&self, ctx: &Context<'_>) -> Result<f64> {
        let batch = self.grid[0] * self.grid[1];
        let tree = atlasfit::spatial::neighbours::Neighbours::build(&self.samples, ctx)?;
        let over = self
            .samples
            .par_iter()
            .enumerate()
            .filter(|(i, p)| {
                let mut found = Vec::new();
                tree.nearest(**p, 9, &mut found);
                let own = found.iter().filter(|f| f.index as usize / batch == i / batch).nth(1);
                let other = found.iter().find(|f| f.index as usize / batch != i / batch);
                other.is_some_and(|o| own.is_none_or(|s| o.dist2 < s.dist2))
            })
            .count();
        Ok(over as f64 / self.samples.len() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use atlasfit::measure::Locator;
    use atlasfit::run::{CancelToken, Run};
    use std::time::{Duration, Instant};

    fn sphere(n: usize) -> Vec<Vec3> {
        let mut rng = Rng::new(4);
        (0..n).map(|_| Vec3::from_fn(|_| rng.normal()).normalized() * 0.5).collect()
    }

    const PAPER: NetworkOptions = NetworkOptions {
        network: Network::Dense,
        charts: 2,
        dim: Dim::Surface,
        flat: false,
        recipe: Recipe::Paper,
        iterations: 20,
        stretch_weight: 1.0,
        learning_rate: 1e-3,
    };

    fn trained(
        points: &[Vec3],
        how: NetworkOptions,
        grid: [usize; 2],
        threads: usize,
    ) -> (NetworkAtlas, Vec<Loss>) {
        Run { threads, seed: 3, ..Run::default() }
            .execute(|ctx| {
                let mut trainer = Trainer::on_grid(points, &how, grid, ctx)?;
                let losses = (0..how.iterations)
                    .map(|_| trainer.step(how.learning_rate, ctx))
                    .collect::<Result<_>>()?;
                Ok((trainer.finish(ctx)?, losses))
            })
            .unwrap()
    }

    #[test]
    fn training_gives_the_same_bytes_for_any_number_of_threads_and_others_for_another_seed() {
        let points = sphere(500);
        // Two bands per chart, the last block not full; convolutions.
        for (network, grid, charts) in [(Network::Dense, [47, 49], 3), (Network::Conv, conv::GRID, 2)] {
            let how = NetworkOptions { network, charts, iterations: 3, ..PAPER };
            let (one, losses) = trained(&points, how, grid, 1);
            for threads in [2, 5] {
                let (other, again) = trained(&points, how, grid, threads);
                assert_eq!(one, other);
                assert_eq!(losses, again);
            }
            let other = Run { seed: 4, ..Run::default() }
                .execute(|ctx| Trainer::on_grid(&points, &how, grid, ctx)?.finish(ctx))
                .unwrap();
            assert_ne!(one.samples, other.samples);
        }
    }

    #[test]
    fn a_sphere_is_learned_and_points_are_drawn_to_it() {
        let points = sphere(1500);
        let how = NetworkOptions { charts: 4, iterations: 250, ..PAPER };
        let (atlas, losses) = trained(&points, how, [16, 16], 0);
        assert!(losses[249].chamfer < 0.02 * losses[0].chamfer, "{:?} {:?}", losses[0], losses[249]);
        let mut rng = Rng::new(8);
        let noisy: Vec<Vec3> = points.iter().map(|p| p.map(|x| x + 0.03 * rng.normal())).collect();
        let feet = Run::default()
            .execute(|ctx| Locator::new(&atlas.surface(), ctx)?.nearest_all(&noisy, ctx))
            .unwrap();
        let clean: Vec<Vec3> = feet.into_iter().map(|f| f.expect("points are finite").point).collect();
        let off = |points: &[Vec3]| -> f64 {
            (points.iter().map(|p| ((*p).norm() - 0.5).powi(2)).sum::<f64>() / points.len() as f64).sqrt()
        };
        assert!(off(&clean) < 0.6 * off(&noisy), "{} {}", off(&clean), off(&noisy));
    }

    #[test]
    fn a_curve_in_the_plane_follows_a_noisy_circle() {
        let mut rng = Rng::new(5);
        let points: Vec<Vec3> = (0..400)
            .map(|_| {
                let a = std::f64::consts::TAU * rng.uniform();
                Vec3([0.4 * a.cos() + 0.01 * rng.normal(), 0.4 * a.sin() + 0.01 * rng.normal(), 0.0])
            })
            .collect();
        let how = NetworkOptions { charts: 1, dim: Dim::Contour, flat: true, iterations: 300, ..PAPER };
        let (atlas, _) = trained(&points, NetworkOptions { learning_rate: 3e-3, ..how }, [1, 256], 0);
        assert!(atlas.samples.iter().all(|s| s[2] == 0.0));
        let off: f64 = atlas.samples.iter().map(|s| ((*s).norm() - 0.4).abs()).sum::<f64>() / 256.0;
        assert!(off < 0.02, "{off}");
        let mesh = atlas.surface();
        assert_eq!((mesh.triangles.len(), mesh.validate()), (255, Ok(())));
    }

    #[test]
    fn convolutions_learn_a_small_patch() {
        let points: Vec<Vec3> = (0..400)
            .map(|i| [f64::from(i / 20) / 19.0 - 0.5, f64::from(i % 20) / 19.0 - 0.5])
            .map(|[x, y]| Vec3([x, y, 0.2 * x * x]))
            .collect();
        let how = NetworkOptions { network: Network::Conv, charts: 1, iterations: 40, ..PAPER };
        let (_, losses) = trained(&points, how, conv::GRID, 0);
        assert!(losses[39].chamfer < 0.1 * losses[0].chamfer, "{:?} {:?}", losses[0], losses[39]);
    }

    #[test]
    fn thinned_steps_stand_for_whole_ones() {
        let points = sphere(2000);
        let how = NetworkOptions { charts: 2, stretch_weight: 100.0, ..PAPER };
        let [whole, thinned] = [0, 1].map(|thin| {
            Run::default()
                .execute(|ctx| {
                    let mut trainer = Trainer::on_grid(&points, &how, [64, 64], ctx)?;
                    trainer.thin(thin);
                    trainer.step(1e-3, ctx)
                })
                .unwrap()
        });
        assert!((thinned.chamfer / whole.chamfer - 1.0).abs() < 0.05, "{whole:?} {thinned:?}");
        // A coarse line cuts corners, so that its edges are shorter than twice as long.
        assert!((thinned.stretch / whole.stretch - 1.0).abs() < 0.2, "{whole:?} {thinned:?}");
    }

    #[test]
    fn a_stronger_stretch_gives_smaller_charts() {
        let points = sphere(400);
        let end = |stretch_weight| {
            let how = NetworkOptions { iterations: 60, stretch_weight, ..PAPER };
            let (atlas, _) = trained(&points, how, [12, 12], 0);
            let samples: Vec<Sample> = atlas.samples.iter().map(|s| s.to_f32()).collect();
            samples.chunks(144).map(|s| stretch(s, [12, 12], 1.0, &mut vec![[0.0; 3]; 144])).sum::<f64>()
        };
        let (none, some, much) = (end(0.0), end(30.0), end(1000.0));
        assert!(none > some && some > much, "{none} {some} {much}");
    }

    #[test]
    fn charts_overlap_where_they_say_the_same() {
        let sheet = |x: f64| (0..64).map(move |i| Vec3([x + f64::from(i / 8), f64::from(i % 8), 0.0]));
        let atlas = |offset: f64| NetworkAtlas {
            charts: 2,
            grid: [8, 8],
            samples: sheet(0.0).chain(sheet(offset)).collect(),
        };
        let overlap = |step| atlasfit::Run::default().execute(|ctx| atlas(step).overlap(ctx));
        assert_eq!(overlap(100.0), Ok(0.0));
        assert_eq!(overlap(0.25), Ok(1.0));
    }

    #[test]
    fn options_out_of_range_and_no_points_are_errors() {
        let attempt = |points: &[Vec3], how: NetworkOptions| {
            Run::default().execute(|ctx| fit(points, &how, ctx).map(|_| ())).unwrap_err()
        };
        let ok = NetworkOptions { iterations: 1, ..PAPER };
        for bad in [
            NetworkOptions { charts: 0, ..ok },
            NetworkOptions { stretch_weight: -1.0, ..ok },
            NetworkOptions { stretch_weight: f64::NAN, ..ok },
            NetworkOptions { learning_rate: 0.0, ..ok },
            NetworkOptions { learning_rate: f64::INFINITY, ..ok },
            NetworkOptions { network: Network::Conv, dim: Dim::Contour, ..ok },
            NetworkOptions { network: Network::Conv, flat: true, ..ok },
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
        let how = NetworkOptions { iterations: 100_000, ..NetworkOptions::default() };
        let result =
            Run { cancel: Some(token), ..Run::default() }.execute(|ctx| fit(&points, &how, ctx).map(|_| ()));
        let late = canceller.join().unwrap().elapsed();
        assert_eq!(result, Err(Error::Cancelled));
        // The promise is 100 ms; a loaded machine must not fail the test.
        assert!(late < Duration::from_secs(5), "{late:?}");
    }
}
