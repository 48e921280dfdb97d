//! The surface that a solid is made of, prepared: corners, boxes, seams.
//!
//! In: a surface. Out: a tree of its triangles, and what is asked about them: whether they are a solid as
//! they are, and where a segment leaves through them.

use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::{Aabb, Bvh};
use crate::spatial::edges::Edges;
use crate::spatial::triangle::area_vector;
use crate::spatial::triangle::crossing;
use std::ops::ControlFlow;

/// A surface's triangles in a tree.
pub(super) struct Faces<'a> {
    pub(super) positions: &'a [Vec3],
    pub(super) triangles: &'a [[u32; 3]],
    /// The corners of each triangle.
    pub(super) corners: Vec<[Vec3; 3]>,
    pub(super) tree: Bvh,
}

/// Where a segment leaves through the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Exit {
    pub(super) triangle: u32,
    /// Share of the way along the segment.
    pub(super) share: f64,
}

impl<'a> Faces<'a> {
    /// # Errors
    /// Cancelled or out of time.
    pub(super) fn new(s: &'a Surface, ctx: &Context<'_>) -> Result<Self> {
        let mut corners = Vec::with_capacity(s.triangles.len());
        let mut boxes = Vec::with_capacity(s.triangles.len());
        for (i, t) in s.triangles.iter().enumerate() {
            ctx.check_at(i)?;
            let at = t.map(|v| s.positions[v as usize]);
            corners.push(at);
            boxes.push(Aabb::of(&at));
        }
        Ok(Self { positions: &s.positions, triangles: &s.triangles, corners, tree: Bvh::build(&boxes, ctx)? })
    }

    /// Along a triangle's normal.
    pub(super) fn normal(&self, triangle: u32) -> Vec3 {
        area_vector(self.corners[triangle as usize]).normalized()
    }

    /// The edges at which the two triangles face opposite ways.
    pub(super) fn seams(&self, ctx: &Context<'_>) -> Result<Vec<[Vec3; 2]>> {
        let mut seams = Vec::new();
        for (i, edge) in Edges::new(self.triangles, ctx)?.iter().enumerate() {
            ctx.check_at(i)?;
            if let [x, y] = edge
                && x.runs_as(*y, self.triangles)
            {
                seams.push(x.ends().map(|v| self.positions[v as usize]));
            }
        }
        Ok(seams)
    }

    /// Where the segment from `p` to `q` last leaves through a triangle, from behind it to its front.
    pub(super) fn exit(&self, p: Vec3, q: Vec3) -> Option<Exit> {
        let mut last: Option<Exit> = None;
        let _ = self.tree.meeting(&Aabb::of(&[p, q]), |t| {
            if let Some((share, false)) = crossing(p, q, &self.corners[t as usize])
                && last.is_none_or(|l| (share, t) > (l.share, l.triangle))
            {
                last = Some(Exit { triangle: t, share });
            }
            ControlFlow::<()>::Continue(())
        });
        last
    }
}
