//! The paper's implicit prior: one network from space to a number, whose zero set is the surface.
//!
//! In: points in the normalised frame. Out: a mesh. The network is trained to give +1 at the points moved by
//! epsilon along their normals and -1 at those moved against them; the error is the mean square, since the
//! paper names none. Normals are those of the default prior's surface, turned to its outside: the paper takes
//! planes through 20 neighbours and does not say how it turns them.
//! Source: *Deep Manifold Prior*, section 3 ("Manifolds as deep level-sets") and section 5.1 ("Benchmark").
//! The zero set is meshed by naive surface nets (crate fast-surface-nets).

#[cfg(test)]
mod shapes;

use crate::finite::check_finite;
use crate::net::Dense;
use crate::sample::Sample;
use atlasfit::error::{Error, Result};
use atlasfit::geometry::TriMesh;
use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::pipeline::{Guide, oriented_normals};
use atlasfit::run::{Context, Stage};
use atlasfit::setters;
use fast_surface_nets::ndshape::{RuntimeShape, Shape};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};

/// How the field is trained and meshed.
///
/// ```
/// use atlasfit_net::LevelSetOptions;
/// let how = LevelSetOptions::default().with_iterations(100).with_resolution(64);
/// assert_eq!(how.validate(), Ok(()));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct LevelSetOptions {
    /// Distance that points are moved along their normals, positive, in the normalised frame. `None`, the
    /// default: the standard deviation of the noise, but at least [`EPSILON`].
    pub epsilon: Option<f64>,
    /// Steps of Adam. Default 300, not the paper's, which names no number.
    pub iterations: usize,
    /// Adam's learning rate at the start, positive; a tenth of it at the end. Default 3e-3: the paper's is
    /// 1e-3 at every step.
    pub learning_rate: f64,
    /// Voxels along the longest side, 8 to 1024. Default 112; the paper does not say how it meshes the zero
    /// set.
    pub resolution: usize,
}

/// The paper's distance along the normals, in the normalised frame (section 5.1: equal to the noise of its
/// benchmark).
pub const EPSILON: f64 = 2e-3;

setters! {
    LevelSetOptions {
        with_epsilon: epsilon: Option<f64>,
        with_iterations: iterations: usize,
        with_learning_rate: learning_rate: f64,
        with_resolution: resolution: usize,
    }
}

/// Memory per point: the activations of 192 units at two samples (f32), those of the first layer left out,
/// inputs, outputs, neighbours. Fitted by hand to peaks of resident memory (2,260 from 20,000 to 200,000
/// points); `tests/memory.py` checks that it holds.
const BYTES_PER_POINT: u64 = 2500;
/// Memory per voxel: the field's value, and what its evaluation and meshing hold, rounded up.
const BYTES_PER_VOXEL: u64 = 40;
/// The learning rate at the end, as a share of that at the start: the last statistics of batch norm must fit
/// the last weights.
const LAST_RATE: f64 = 0.1;

impl Default for LevelSetOptions {
    fn default() -> Self {
        Self { epsilon: None, iterations: 300, learning_rate: 3e-3, resolution: 112 }
    }
}

impl LevelSetOptions {
    /// Fails on options out of range.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`].
    pub fn validate(&self) -> Result<()> {
        let invalid = |what: String, advice: &str| Err(Error::invalid(what, advice));
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if !self.epsilon.is_none_or(positive) {
            return invalid(format!("epsilon is {:?}", self.epsilon), "Give a positive length");
        }
        if !positive(self.learning_rate) {
            return invalid(format!("learning_rate is {}", self.learning_rate), "Give a positive number");
        }
        if !(8..=1024).contains(&self.resolution) {
            return invalid(format!("resolution is {}", self.resolution), "Give 8 to 1024 voxels");
        }
        Ok(())
    }
}

impl Guide for LevelSetOptions {
    fn validate(&self) -> Result<()> {
        Self::validate(self)
    }
    fn surface(&self, points: &[Vec3], sigma: f64, ctx: &Context<'_>) -> Result<TriMesh> {
        fit(points, sigma, self, ctx)
    }
}

/// Fits a field to finite points in the normalised frame and meshes its zero set within their bounding box.
/// `noise` is the standard deviation of the points' noise, in the same unit.
///
/// # Errors
/// [`Error::InvalidArgument`]; [`Error::EmptyInput`] without points; [`Error::Degenerate`] where the field
/// has no zero set; [`Error::Diverged`] where training leaves the finite numbers; cancelled or limited.
///
/// ```
/// use atlasfit::{Run, Vec3};
/// use atlasfit_net::level_set::{LevelSetOptions, fit};
/// let on_sphere = |i: i32| {
///     let (z, a) = (1.0 - (f64::from(i) + 0.5) / 150.0, 2.4 * f64::from(i));
///     Vec3([(1.0 - z * z).sqrt() * a.cos(), (1.0 - z * z).sqrt() * a.sin(), z]) * 0.5
/// };
/// let points: Vec<Vec3> = (0..300).map(on_sphere).collect();
/// let how = LevelSetOptions::default().with_epsilon(Some(0.05)).with_iterations(30).with_resolution(12);
/// let mesh = Run::default().execute(|ctx| fit(&points, 0.01, &how, ctx))?;
/// assert!(!mesh.triangles.is_empty());
/// # Ok::<(), atlasfit::Error>(())
/// ```
pub fn fit(points: &[Vec3], noise: f64, options: &LevelSetOptions, ctx: &Context<'_>) -> Result<TriMesh> {
    options.validate()?;
    ctx.reserve(
        BYTES_PER_POINT * points.len() as u64 + BYTES_PER_VOXEL * (options.resolution as u64 + 3).pow(3),
        "Raise the limit, lower the resolution, or give fewer points",
    )?;
    let epsilon = options.epsilon.unwrap_or(noise.max(EPSILON));
    let normals = oriented_normals(points, ctx)?;
    ctx.stage(Stage::Fit, options.iterations + 1);
    let mut net = Dense::new(3, 1, &mut Rng::stream(ctx.seed, 0));
    // Outliers have no side.
    let sided: Vec<(Vec3, Vec3)> =
        points.iter().copied().zip(normals).filter(|(_, n)| *n != Vec3::ZERO).collect();
    let moved = |side: f64| sided.iter().map(move |(p, n)| (*p + *n * (side * epsilon)).to_f32());
    ctx.check()?;
    let inputs: Vec<Sample> = moved(1.0).chain(moved(-1.0)).collect();
    ctx.check()?;
    net.set_inputs(&inputs, ctx)?;
    let mut out = vec![[0f32; 3]; inputs.len()];
    let share = 2.0 / inputs.len() as f32;
    for step in 0..options.iterations {
        net.forward(&mut out, ctx)?;
        check_finite(out.iter().map(|y| f64::from(y[0])), step)?;
        // The gradient of the mean squared error replaces the value it is taken at.
        for (i, y) in out.iter_mut().enumerate() {
            let label = if i < sided.len() { 1.0 } else { -1.0 };
            *y = [share * (y[0] - label), 0.0, 0.0];
        }
        net.backward(&out, ctx)?;
        let done = step as f64 / options.iterations as f64;
        net.step((options.learning_rate * LAST_RATE.powf(done)) as f32, ctx)?;
        ctx.advance(1);
    }
    // The statistics of batch norm belong to the last parameters.
    net.forward(&mut out, ctx)?;
    check_finite(out.iter().map(|y| f64::from(y[0])), options.iterations)?;
    mesh(points, &net, options.resolution, ctx)
}

/// Voxels per batch of the field's evaluation.
const SLAB: usize = 1 << 16;

/// Meshes the network's zero set within the points' bounding box.
fn mesh(points: &[Vec3], net: &Dense, resolution: usize, ctx: &Context<'_>) -> Result<TriMesh> {
    let low = Vec3::from_fn(|k| points.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min));
    let high = Vec3::from_fn(|k| points.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max));
    let size = (high - low).into_iter().fold(0.0, f64::max);
    if size <= 0.0 {
        return Err(Error::degenerate("all points lie in one place", "Give points that lie on a surface"));
    }
    let voxel = size / resolution as f64;
    // One voxel more on each side.
    let count = [0, 1, 2].map(|k| ((high[k] - low[k]) / voxel).ceil() as u32 + 3);
    let shape = RuntimeShape::<u32, 3>::new(count);
    let place = |g: [f64; 3]| [0, 1, 2].map(|k| low[k] + (g[k] - 1.0) * voxel);
    let total = shape.size();
    let mut field = Vec::with_capacity(total as usize);
    for from in (0..total).step_by(SLAB) {
        let at: Vec<Sample> = (from..(from + SLAB as u32).min(total))
            .map(|i| place(shape.delinearize(i).map(f64::from)).map(|x| x as f32))
            .collect();
        field.extend(net.evaluate(&at, ctx)?.iter().map(|y| y[0]));
    }
    let mut buffer = SurfaceNetsBuffer::default();
    surface_nets(&field, &shape, [0; 3], count.map(|n| n - 1), &mut buffer);
    if buffer.indices.is_empty() {
        return Err(Error::degenerate(
            "the level set is empty",
            "Train longer, or use another prior: open and thin shapes have no inside",
        ));
    }
    let positions = buffer.positions.iter().map(|p| place(p.map(f64::from))).collect();
    Ok(TriMesh::new(positions, buffer.indices.as_chunks().0.to_vec()))
}

#[cfg(test)]
mod tests {
    use super::shapes::sphere;
    use super::*;
    use atlasfit::run::Run;

    #[test]
    fn the_level_set_of_a_noisy_sphere_is_nearer_to_it_than_the_points() {
        let (points, sigma) = (sphere(1500, 0.01), 0.01);
        let how = LevelSetOptions { iterations: 100, resolution: 32, ..LevelSetOptions::default() };
        let fitted = |threads| {
            Run { threads, ..Run::default() }.execute(|ctx| fit(&points, sigma, &how, ctx)).unwrap()
        };
        let mesh = fitted(0);
        assert_eq!(mesh, fitted(1), "any number of threads");
        // Far from the points the field is free: only what lies near them counts.
        let near: Vec<f64> =
            mesh.positions.iter().map(|p| (Vec3(*p).norm() - 0.5).abs()).filter(|d| *d < 0.1).collect();
        assert!(near.len() > 500, "{}", near.len());
        let mean = near.iter().sum::<f64>() / near.len() as f64;
        assert!(mean < sigma * 0.7, "{mean}");
    }

    #[test]
    fn training_that_leaves_the_finite_numbers_has_diverged() {
        let how = LevelSetOptions { learning_rate: 1e37, iterations: 20, ..LevelSetOptions::default() };
        let fitted = Run::default().execute(|ctx| fit(&sphere(100, 0.0), 0.01, &how, ctx));
        assert!(matches!(fitted, Err(Error::Diverged { .. })), "{:?}", fitted.err());
    }

    #[test]
    fn options_out_of_range_and_no_points_are_errors() {
        let attempt = |points: &[Vec3], how: LevelSetOptions| {
            Run::default().execute(|ctx| fit(points, 0.01, &how, ctx)).unwrap_err()
        };
        let ok = LevelSetOptions { iterations: 1, ..LevelSetOptions::default() };
        for bad in [
            LevelSetOptions { epsilon: Some(0.0), ..ok },
            LevelSetOptions { learning_rate: f64::NAN, ..ok },
            LevelSetOptions { resolution: 1, ..ok },
        ] {
            assert!(matches!(attempt(&sphere(20, 0.0), bad), Error::InvalidArgument { .. }));
        }
        assert!(matches!(attempt(&[], ok), Error::EmptyInput { .. }));
        assert!(matches!(attempt(&[Vec3::ZERO; 30], ok), Error::Degenerate { .. }));
    }
}
