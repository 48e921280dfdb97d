//! A guide: a first surface that a scan is projected onto before charts are fitted, such as the paper's
//! networks.
//!
//! In: a prepared scan and a [`Guide`]. Out: the scan with its points on the guide's surface. What is left of
//! the noise is then the scan's, and everything after that is the same as without a guide.

use super::checks;
use super::copies::{self, Places};
use super::prepare::{self, Scan};
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::measure::Locator;
use crate::noise::{NoiseModel, NoiseSource, estimate};
use crate::numeric::robust::TUKEY;
use crate::numeric::vec3::Vec3;
use crate::run::{Context, Stage};
use crate::spatial::spacing::Sampling;

/// Something that can make a surface near noisy points. A new prior implements this.
pub trait Guide: Sync {
    /// Fails on options out of range.
    ///
    /// # Errors
    /// [`crate::Error::InvalidArgument`].
    fn validate(&self) -> Result<()>;

    /// A surface near `points`. Points and surface are in the normalised frame (the scan's longest side is
    /// 1); `sigma` is the standard deviation of their noise.
    ///
    /// # Errors
    /// Those of the guide; cancelled or out of time.
    fn surface(&self, points: &[Vec3], sigma: f64, ctx: &Context<'_>) -> Result<TriMesh>;
}

/// Moves the scan's points onto the guide's surface. Points that the guide has not followed stay: those
/// farther from it than noise reaches.
pub(super) fn follow(guide: &dyn Guide, scan: Scan, ctx: &Context<'_>) -> Result<Scan> {
    let surface = guide.surface(&scan.points, scan.noise.sigma, ctx)?;
    let Scan { points, tree, noise, mut input, .. } = scan;
    drop(tree);
    ctx.stage(Stage::Project, points.len());
    let mut moved = project(&surface, &points, ctx)?;
    let limit = (TUKEY * noise.sigma).powi(2);
    for (c, p) in moved.iter_mut().zip(&points) {
        if c.dist2(*p) > limit {
            *c = *p;
        }
    }
    // Points beyond the border of a guide's chart meet at the border.
    let distinct = prepare::distinct(&moved, ctx)?;
    copies::rename(&mut input.of_input, &distinct.of_input);
    ctx.stage(Stage::Analyse, distinct.points.len());
    let places = copies::join(distinct.points, true, ctx)?;
    places.rename(&mut input.of_input);
    input.count = Vec::new();
    let Places { points, tree, spacing, .. } = places;
    checks::surface(&points)?;
    let sampling = Sampling::new(spacing);
    // A given noise is the scan's; what the guide leaves is always estimated, but then not questioned either.
    let source = if noise.is_given() { NoiseSource::Given } else { NoiseSource::Quadrics };
    let looked = estimate::look(&points, &tree, ctx)?;
    let left = estimate::noise(&points, &tree, &looked, ctx)?.sigma;
    let noise = NoiseModel::new(left, source, sampling.median);
    let (relative_noise, frame, whole) = (Vec::new(), scan.frame, points.len());
    let rows = (0..points.len() as u64).collect();
    let (told, cameras) = (None, Vec::new());
    Ok(Scan { points, tree, sampling, noise, relative_noise, input, frame, rows, whole, told, cameras })
}

/// For each point the nearest place of a mesh (exact on its triangles). Points must be finite.
fn project(mesh: &TriMesh, points: &[Vec3], ctx: &Context<'_>) -> Result<Vec<Vec3>> {
    let feet = Locator::new(mesh, ctx)?.nearest_all(points, ctx)?;
    Ok(points.iter().zip(feet).map(|(p, foot)| foot.map_or(*p, |f| f.point)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    #[test]
    fn projection_is_no_farther_than_any_vertex_and_stays_put() {
        let mesh = TriMesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
        let points = [Vec3([0.25, 0.5, 0.5]), Vec3([2.0, -1.0, 0.0])];
        let (once, twice) = Run::default()
            .execute(|ctx| {
                let once = project(&mesh, &points, ctx)?;
                let twice = project(&mesh, &once, ctx)?;
                Ok((once, twice))
            })
            .unwrap();
        assert_eq!(once, [Vec3([0.25, 0.5, 0.0]), Vec3([1.0, 0.0, 0.0])]);
        assert_eq!(once, twice);
    }
}
