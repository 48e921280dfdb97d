//! The paper's explicit prior: each chart is a small network into space, trained on this scan alone.
//!
//! In: points in the normalised frame (longest side about 1, centred). Out: a [`NetworkAtlas`], whose charts
//! are samples on regular grids that can be meshed and trimmed. Source: *Deep Manifold Prior*, section 3
//! ("Method"), section 5.1 ("Experimental setup"), supplement A ("Convolutional Parametrizations").

mod atlas;
mod options;
mod start;
#[cfg(test)]
mod tests;
mod train;

pub use atlas::NetworkAtlas;
pub use options::{Dim, Network, NetworkOptions, Recipe, Start};
pub use train::{Loss, Trainer};

use atlasfit::error::Result;
use atlasfit::geometry::TriMesh;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::pipeline::Guide;
use atlasfit::run::{Context, Stage};
use options::{LEAST_FALL, WINDOW};

impl Guide for NetworkOptions {
    fn validate(&self) -> Result<()> {
        Self::validate(self)
    }
    fn surface(&self, points: &[Vec3], _sigma: f64, ctx: &Context<'_>) -> Result<TriMesh> {
        Ok(fit(points, self, ctx)?.surface())
    }
}

/// Where charts begin, as something else says: from points and the size of a chart's grid to samples of all
/// charts, as [`Trainer::starting_at`] takes them.
pub type First<'a> = dyn Fn(&[Vec3], [usize; 2], &Context<'_>) -> Result<Vec<Vec3>> + Sync + 'a;

/// Explicit networks whose charts begin where something else says, for example a model of a collection of
/// shapes.
pub struct Begun<'a> {
    /// How they are made and trained.
    pub options: NetworkOptions,
    /// Where they begin.
    pub first: &'a First<'a>,
}

impl Guide for Begun<'_> {
    fn validate(&self) -> Result<()> {
        self.options.validate()
    }
    fn surface(&self, points: &[Vec3], _sigma: f64, ctx: &Context<'_>) -> Result<TriMesh> {
        let first = (self.first)(points, self.options.grid(), ctx)?;
        let trainer = Trainer::starting_at(points, &self.options, &first, ctx)?;
        Ok(train(trainer, &self.options, ctx, &mut |_, _| true)?.surface())
    }
}

/// Fits networks to finite points in the normalised frame. Seed, threads and limits are those of the run.
///
/// # Errors
/// [`InvalidArgument`](atlasfit::Error::InvalidArgument); [`EmptyInput`](atlasfit::Error::EmptyInput) without
/// points; [`OutOfMemory`](atlasfit::Error::OutOfMemory); cancelled or out of time.
///
/// ```
/// use atlasfit::{Run, Vec3};
/// use atlasfit_net::explicit::{NetworkOptions, Recipe, fit};
/// let point = |i: u32| Vec3([f64::from(i / 10), f64::from(i % 10), 0.0]) * 0.05;
/// let points: Vec<Vec3> = (0..100).map(point).collect();
/// let how = NetworkOptions::default().with_charts(2).with_recipe(Recipe::Paper).with_iterations(1);
/// let atlas = Run::default().execute(|ctx| fit(&points, &how, ctx))?;
/// assert_eq!((atlas.charts, atlas.grid, atlas.samples.len()), (2, [64, 64], 2 * 64 * 64));
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn fit(points: &[Vec3], options: &NetworkOptions, ctx: &Context<'_>) -> Result<NetworkAtlas> {
    fit_watched(points, options, ctx, &mut |_, _| true)
}

/// As [`fit`], and calls `watch` after each step with the number of steps so far and the loss. Training ends
/// where it returns false. The loss of a thinned step is scaled to all samples and points.
///
/// # Errors
/// As [`fit`].
pub fn fit_watched(
    points: &[Vec3],
    options: &NetworkOptions,
    ctx: &Context<'_>,
    watch: &mut (dyn FnMut(usize, Loss) -> bool + Send),
) -> Result<NetworkAtlas> {
    train(Trainer::new(points, options, ctx)?, options, ctx, watch)
}

/// Trains networks from their start.
fn train(
    mut trainer: Trainer,
    options: &NetworkOptions,
    ctx: &Context<'_>,
    watch: &mut (dyn FnMut(usize, Loss) -> bool + Send),
) -> Result<NetworkAtlas> {
    let phases = options.phases();
    ctx.stage(Stage::Fit, phases.iter().map(|p| p.steps).sum());
    let (mut step, mut running) = (0, true);
    for phase in phases {
        if options.recipe == Recipe::Fast && options.network == Network::Dense {
            trainer.thin(phase.thin);
        }
        let (mut last, mut sum) = (f64::INFINITY, 0.0);
        for i in 0..phase.steps {
            let at = i as f64 / phase.steps.max(2) as f64;
            let rate = phase.rate[0] * (phase.rate[1] / phase.rate[0]).powf(at);
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
