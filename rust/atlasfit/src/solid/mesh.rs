//! What a solid is asked about the triangles of its surface.
//!
//! In: triangles in a tree. Out: where the surface turns its other side, and where a segment leaves through
//! it.

use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::Aabb;
use crate::spatial::edges::Edges;
use crate::spatial::faces::Faces;
use crate::spatial::triangle::crossing;
use std::ops::ControlFlow;

/// Where a segment leaves through the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Exit {
    pub(super) triangle: u32,
    /// Share of the way along the segment.
    pub(super) share: f64,
}

impl Faces<'_> {
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
