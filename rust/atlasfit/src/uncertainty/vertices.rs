//! How sure the vertices of a surface are.
//!
//! In: vertices, the scan's points on the charts and their uncertainty. Out: a standard deviation for each
//! vertex, and whether it was invented where no data are. A vertex is as sure as the points about it, and
//! less by how far it lies off their charts: contouring, fewer triangles, curves along rims and edges may
//! move it. Where no data are, at a distance d from the data, the surface may be off by what a surface that
//! bends as the scan usually does would be: half the curvature times d squared.

use super::PointUncertainty;
use super::claimed::{Claimed, claimed};
use super::constants::UNCERTAINTY;
use crate::atlas::{Chart, ProjectedPoint};
use crate::blend::constants::BLEND;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::Neighbour;
use rayon::prelude::*;

/// How sure a vertex is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct VertexUncertainty {
    /// Standard deviation along the normal.
    pub sd: f64,
    /// Whether no data are near.
    pub extrapolated: bool,
}

/// How sure each vertex is. `spacing` is that of the points. Standard deviations are infinite where no point
/// lies on a chart.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn of_vertices(
    vertices: &[Vec3],
    charts: &[Chart],
    projected: &[ProjectedPoint],
    spacing: &[f32],
    points: &PointUncertainty,
    ctx: &Context<'_>,
) -> Result<Vec<VertexUncertainty>> {
    let Claimed { tree, index } = claimed(projected, ctx)?;
    let one = |v: &Vec3, found: &mut Vec<Neighbour>| {
        tree.nearest(*v, UNCERTAINTY.about_vertex, found);
        let Some(nearest) = found.first().copied() else {
            return VertexUncertainty { sd: f64::INFINITY, extrapolated: true };
        };
        let soft = nearest.dist2 * 0.1 + 1e-18;
        let (mut total, mut variance) = (0.0, 0.0);
        for f in found.iter() {
            let w = 1.0 / (f.dist2 + soft);
            total += w;
            variance += w * f64::from(points.sd[index[f.index as usize] as usize]).powi(2);
        }
        let reach = BLEND.reach * f64::from(spacing[index[nearest.index as usize] as usize]);
        let beyond = nearest.dist2.sqrt();
        let off = if beyond > reach {
            0.5 * points.curvature * beyond * beyond
        } else {
            let own = found.iter().map(|f| projected[index[f.index as usize] as usize].chart);
            let off = own.filter_map(|c| charts.get(c as usize)).map(|c| {
                let foot = c.nearest(*v);
                (foot.position - *v).dot(foot.normal).abs()
            });
            off.fold(f64::INFINITY, f64::min)
        };
        let sd = (variance / total).sqrt().hypot(off);
        VertexUncertainty { sd, extrapolated: beyond > reach }
    };
    let blocks = vertices.par_chunks(1024).map(|block| {
        ctx.check()?;
        let mut found = Vec::new();
        Ok(block.iter().map(|v| one(v, &mut found)).collect::<Vec<_>>())
    });
    Ok(blocks.collect::<Result<Vec<_>>>()?.concat())
}

/// The distance of each place to the nearest point on a chart; infinite where there is none.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn distances(
    places: &[Vec3],
    projected: &[ProjectedPoint],
    ctx: &Context<'_>,
) -> Result<Vec<f64>> {
    let Claimed { tree, index } = claimed(projected, ctx)?;
    let blocks = places.par_chunks(1024).map(|block| {
        ctx.check()?;
        let far = |p: &Vec3| if index.is_empty() { f64::INFINITY } else { tree.nearest_one(*p).dist2.sqrt() };
        Ok(block.iter().map(far).collect::<Vec<_>>())
    });
    Ok(blocks.collect::<Result<Vec<_>>>()?.concat())
}
