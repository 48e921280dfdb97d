//! The places of the first mesh that stay near.
//!
//! In: the first mesh, how far it is to be simplified. Out: its vertices, and the middles of its edges where
//! these are held too: between vertices alone, an edge of the new mesh may run across a triangle of the first
//! one far above it.

use super::data::{Dense, Goal, Points};
use crate::error::Result;
use crate::run::Context;
use crate::spatial::edges::Edges;
use std::borrow::Cow;

impl<'a> Points<'a> {
    pub(super) fn new(dense: &'a Dense<'a>, goal: &'a Goal, ctx: &Context<'_>) -> Result<Self> {
        let vertices = dense.positions.len();
        let mut owner = ctx.filled([0], vertices)?;
        for (f, t) in dense.triangles.iter().enumerate() {
            ctx.check_at(f)?;
            t.iter().for_each(|&v| owner[v as usize] = [f as u32]);
        }
        let mut out = Self {
            positions: Cow::Borrowed(dense.positions),
            normals: Cow::Borrowed(dense.normals),
            error: Cow::Borrowed(&goal.error),
            vertex: (0..vertices as u32).collect(),
            owner,
        };
        if !goal.between {
            return Ok(out);
        }
        let (positions, normals, error) = (out.positions.to_mut(), out.normals.to_mut(), out.error.to_mut());
        for (i, edge) in Edges::new(dense.triangles, ctx)?.iter().enumerate() {
            ctx.check_at(i)?;
            let [a, b] = edge[0].ends().map(|v| v as usize);
            positions.push((dense.positions[a] + dense.positions[b]) * 0.5);
            normals.push((dense.normals[a] + dense.normals[b]).normalized());
            error.push(goal.error[a].min(goal.error[b]));
            out.vertex.push(a as u32);
            out.owner.push([edge[0].face() as u32]);
        }
        Ok(out)
    }
}
