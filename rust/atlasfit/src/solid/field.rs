//! What is inside: the winding number of the surface, less the level that bounds the solid.
//!
//! In: a site of the lattice. Out: where its vertex lies, and a value that is positive inside.
//!
//! What the surface encloses winds about a point by more than half a turn. Where it encloses nothing (a
//! sheet, a relief, a room seen from within), the level sinks behind it, to a quarter above the mean of the
//! winding number's two sides, so that a plate of the stated thickness stands behind it.

use super::constants::SOLID;
use super::lattice::{Site, jittered};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::{Aabb, Bvh};
use crate::spatial::faces::Faces;
use crate::spatial::triangle::{closest_on_segment, closest_on_triangle, weights};
use crate::spatial::winding::Winding;
use rayon::prelude::*;

/// A vertex of the lattice.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Its position: not quite the site's, where that is too near to the surface.
    pub(super) position: Vec3,
    /// Positive inside the solid.
    pub(super) value: f64,
}

impl Sample {
    pub(super) fn inside(&self) -> bool {
        self.value > 0.0
    }
}

/// The field of a surface.
pub(super) struct Field<'a> {
    faces: &'a Faces<'a>,
    winding: Winding<'a>,
    /// For each vertex of the surface the mean of the winding number's two sides.
    means: Vec<f64>,
    seams: Seams,
    /// Side of the lattice's cubes.
    pub(super) side: f64,
    /// Thickness of what encloses nothing.
    pub(super) thickness: f64,
}

/// Where a one-sided surface turns over: no side of it is behind there, so the solid has a bar instead.
struct Seams {
    edges: Vec<[Vec3; 2]>,
    tree: Bvh,
}

impl<'a> Field<'a> {
    /// # Errors
    /// Cancelled or out of time.
    pub(super) fn new(
        faces: &'a Faces<'a>,
        winding: Winding<'a>,
        side: f64,
        thickness: f64,
        ctx: &Context<'_>,
    ) -> Result<Self> {
        let means = faces
            .positions
            .par_chunks(SOLID.check)
            .map(|chunk| {
                ctx.check()?;
                Ok(chunk.iter().map(|&p| winding.at(p)).collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>>>()?
            .concat();
        let edges = faces.seams(ctx)?;
        let boxes: Vec<Aabb> = edges.iter().map(|e| Aabb::of(e)).collect();
        let seams = Seams { tree: Bvh::build(&boxes, ctx)?, edges };
        Ok(Self { faces, winding, means, seams, side, thickness })
    }

    /// The level behind a vertex of the surface.
    pub(super) fn level(&self, vertex: usize) -> f64 {
        SOLID.level.min(self.means[vertex] + SOLID.above_mean)
    }

    /// The lattice's vertex of a site.
    pub(super) fn sample(&self, site: Site) -> Sample {
        let mut p = jittered(site, self.side);
        let clearance = SOLID.clearance * self.side;
        let reach = self.thickness.max(clearance);
        let corners = |t: u32| &self.faces.corners[t as usize];
        let to_triangle = |t: u32| p.dist2(closest_on_triangle(p, corners(t)));
        let mut level = SOLID.level;
        if let Some((t, distance2)) = self.faces.tree.nearest(p, reach * reach, to_triangle) {
            let foot = closest_on_triangle(p, corners(t));
            let distance = distance2.sqrt();
            if distance < clearance {
                let away = if distance > 1e-6 * clearance { p - foot } else { self.faces.normal(t) };
                p = foot + away.normalized() * clearance;
            }
            let at = self.faces.triangles[t as usize];
            let low: f64 =
                weights(foot, corners(t)).iter().zip(at).map(|(w, v)| w * self.level(v as usize)).sum();
            let fade = (2.0 * distance / self.thickness - 1.0).clamp(0.0, 1.0);
            level = low.min(level) + fade * (level - low.min(level));
        }
        Sample {
            position: p,
            value: (self.winding.at(p) - level).max(self.seams.bar(p, 0.5 * self.thickness)),
        }
    }
}

impl Seams {
    /// Positive in a bar of some radius about the seams: 0.5 on them, falling to 0 at the bar's surface.
    fn bar(&self, p: Vec3, radius: f64) -> f64 {
        let to_edge = |e: u32| {
            let [a, b] = self.edges[e as usize];
            p.dist2(closest_on_segment(p, a, b))
        };
        match self.tree.nearest(p, 4.0 * radius * radius, to_edge) {
            Some((_, distance2)) => 0.5 - 0.5 * distance2.sqrt() / radius,
            None => f64::NEG_INFINITY,
        }
    }
}
