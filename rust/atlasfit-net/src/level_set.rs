//! The paper's implicit prior: one network from space to a number, whose zero set is the surface.
//!
//! In: points in the normalised frame. Out: a mesh. The network is trained to give +1 at the points moved by epsilon along their normals and -1
//! at those moved against them; normals are those of the nearest neighbours' planes, made to agree along a minimum spanning tree.
//! Source: *Deep Manifold Prior*, sections 3 ("Manifolds as deep level-sets") and 5 ("Benchmark"); the tree is Hoppe et al. 1992,
//! "Surface reconstruction from unorganized points". The zero set is meshed by naive surface nets (crate fast-surface-nets).

use super::net::Dense;
use crate::loss::Sample;
use atlasfit::error::{Error, Result};
use atlasfit::geometry::TriMesh;
use atlasfit::numeric::dense::eigen3;
use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::{Context, Stage};
use atlasfit::spatial::neighbours::Neighbours;
use atlasfit::spatial::sets::SignedSets;
use fast_surface_nets::ndshape::{RuntimeShape, Shape};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use rayon::prelude::*;

/// How the field is trained and meshed. The defaults are the paper's where it says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelSetOptions {
    /// Distance that points are moved along their normals, positive, in the normalised frame; `None`: the noise, at least the paper's.
    pub epsilon: Option<f64>,
    /// Neighbours that a normal is estimated from, 3 or more.
    pub neighbours: usize,
    /// Steps of Adam.
    pub iterations: usize,
    /// Adam's learning rate, positive.
    pub learning_rate: f64,
    /// Voxels along the longest side, 8 to 1024.
    pub resolution: usize,
}

/// The paper's distance along the normals.
pub const EPSILON: f64 = 2e-3;

impl Default for LevelSetOptions {
    fn default() -> Self {
        Self { epsilon: None, neighbours: 20, iterations: 300, learning_rate: 3e-3, resolution: 112 }
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
        if self.neighbours < 3 {
            return invalid(format!("{} neighbours", self.neighbours), "Give at least 3 for a normal");
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

/// Fits a field to points in the normalised frame and meshes its zero set within their box, `noise` (a standard deviation) known.
///
/// # Errors
/// [`Error::InvalidArgument`]; [`Error::EmptyInput`] without points; [`Error::Degenerate`] where the field has no zero set; cancelled or limited.
pub fn fit(points: &[Vec3], noise: f64, options: &LevelSetOptions, ctx: &Context<'_>) -> Result<TriMesh> {
    options.validate()?;
    // Activations of 464 values per sample; the field's values and their inputs.
    ctx.reserve(4000 * points.len() as u64 + 40 * (options.resolution as u64 + 3).pow(3))?;
    ctx.stage(Stage::Fit, options.iterations + 1);
    let epsilon = options.epsilon.unwrap_or(noise.max(EPSILON));
    let normals = oriented_normals(points, options.neighbours, ctx)?;
    let mut net = Dense::new(3, 1, &mut Rng::stream(ctx.seed, 0));
    let moved =
        |side: f64| points.iter().zip(&normals).map(move |(p, n)| (*p + *n * (side * epsilon)).to_f32());
    let inputs: Vec<Sample> = moved(1.0).chain(moved(-1.0)).collect();
    net.set_inputs(inputs.iter().copied());
    let mut out = vec![[0f32; 3]; inputs.len()];
    let share = 2.0 / inputs.len() as f32;
    for step in 0..options.iterations {
        net.forward(&mut out, ctx)?;
        // The gradient of the mean squared error replaces the value it is taken at.
        for (i, y) in out.iter_mut().enumerate() {
            let label = if i < points.len() { 1.0 } else { -1.0 };
            *y = [share * (y[0] - label), 0.0, 0.0];
        }
        net.backward(&out, ctx)?;
        // A tenth of the rate at the end, when the average counts.
        let done = step as f64 / options.iterations as f64;
        net.step((options.learning_rate * 0.1f64.powf(done)) as f32);
        ctx.advance(1);
    }
    // The statistics of batch norm belong to the last parameters.
    net.forward(&mut out, ctx)?;
    mesh(points, &net, options.resolution, ctx)
}

/// Points per batch of the field's evaluation: a few milliseconds' work per thread between two looks at the cancel flag.
const SLAB: usize = 1 << 16;

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

/// Normals of the neighbours' planes, pointing outward where there is an outside.
fn oriented_normals(points: &[Vec3], neighbours: usize, ctx: &Context<'_>) -> Result<Vec<Vec3>> {
    let tree = Neighbours::build(points, ctx)?;
    let around: Vec<(Vec3, Vec<u32>)> = points
        .par_chunks(512)
        .map(|block| {
            ctx.check()?;
            let mut found = Vec::new();
            Ok(block
                .iter()
                .map(|p| {
                    tree.nearest(*p, neighbours + 1, &mut found);
                    let n = found.len() as f64;
                    let mean =
                        Vec3::from_fn(|k| found.iter().map(|f| points[f.index as usize][k]).sum::<f64>() / n);
                    let mut m = [0.0; 6];
                    for f in &found {
                        let d = points[f.index as usize] - mean;
                        for (m, (i, j)) in m.iter_mut().zip([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)])
                        {
                            *m += d[i] * d[j];
                        }
                    }
                    (eigen3(m).1[0], found.iter().map(|f| f.index).collect())
                })
                .collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    // Kruskal's tree over the neighbourhood graph, the most parallel normals first; each point knows whether it agrees with its parent.
    let mut edges: Vec<(f64, u32, u32)> = around
        .iter()
        .enumerate()
        .flat_map(|(i, (n, found))| {
            let around = &around;
            found
                .iter()
                .filter(move |j| **j as usize != i)
                .map(move |&j| (1.0 - (*n).dot(around[j as usize].0).abs(), i as u32, j))
        })
        .collect();
    edges.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    ctx.check()?;
    let mut sets = SignedSets::new(points.len());
    for (_, i, j) in edges {
        sets.join(i, j, around[i as usize].0.dot(around[j as usize].0) < 0.0);
    }
    // The highest point of each part faces up.
    let roots: Vec<(u32, bool)> = (0..points.len() as u32).map(|i| sets.find(i)).collect();
    let mut highest = vec![u32::MAX; points.len()];
    for (i, (r, _)) in roots.iter().enumerate() {
        let h = &mut highest[*r as usize];
        if *h == u32::MAX || points[i][2] > points[*h as usize][2] {
            *h = i as u32;
        }
    }
    Ok((0..points.len())
        .map(|i| {
            let top = highest[roots[i].0 as usize] as usize;
            let down = (around[top].0[2] < 0.0) ^ roots[top].1 ^ roots[i].1;
            around[i].0.map(|x| if down { -x } else { x })
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use atlasfit::run::Run;

    fn sphere(n: usize, sigma: f64) -> Vec<Vec3> {
        let mut rng = Rng::new(4);
        (0..n)
            .map(|_| {
                let p = Vec3::from_fn(|_| rng.normal()).normalized() * 0.5;
                p.map(|x| x + sigma * rng.normal())
            })
            .collect()
    }

    #[test]
    fn normals_of_a_sphere_point_outward() {
        let points = sphere(2000, 0.003);
        let normals = Run::default().execute(|ctx| oriented_normals(&points, 20, ctx)).unwrap();
        assert!(points.iter().zip(&normals).all(|(p, n)| (*p).dot(*n) > 0.45 * (*n).norm()));
    }

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
    fn options_out_of_range_and_no_points_are_errors() {
        let attempt = |points: &[Vec3], how: LevelSetOptions| {
            Run::default().execute(|ctx| fit(points, 0.01, &how, ctx)).unwrap_err()
        };
        let ok = LevelSetOptions { iterations: 1, ..LevelSetOptions::default() };
        for bad in [
            LevelSetOptions { epsilon: Some(0.0), ..ok },
            LevelSetOptions { neighbours: 2, ..ok },
            LevelSetOptions { learning_rate: f64::NAN, ..ok },
            LevelSetOptions { resolution: 1, ..ok },
        ] {
            assert!(matches!(attempt(&sphere(20, 0.0), bad), Error::InvalidArgument { .. }));
        }
        assert!(matches!(attempt(&[], ok), Error::EmptyInput { .. }));
        assert!(matches!(attempt(&[Vec3::ZERO; 30], ok), Error::Degenerate { .. }));
    }
}
