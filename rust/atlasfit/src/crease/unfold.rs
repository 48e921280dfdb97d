//! Vertices beside creases spread out where the mesh is folded over them.
//!
//! In: a surface, creases, what they ask of each vertex. Out: the same with vertices of folded triangles
//! moved among their neighbours, so that the two sides, each a height over the other vertices' places, have
//! no folds.

use super::chains::Creases;
use super::constants::CREASE;
use super::pull::{Pulls, pull};
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::{Edges, HalfEdge};
use crate::spatial::lists::Lists;
use crate::spatial::triangle::area_vector;
use rayon::prelude::*;

/// What lies about vertices.
pub(super) struct Rings<'a> {
    /// All edges.
    pub edges: &'a Edges,
    /// The neighbours of each vertex.
    pub neighbours: &'a Lists,
}

/// Moves the vertices of folded triangles to the middle of their neighbours, a few times. Those of the
/// boundary stay.
pub(super) fn unfold(
    s: &mut Surface,
    creases: &Creases,
    pulls: &mut Pulls,
    rings: &Rings<'_>,
    ctx: &Context<'_>,
) -> Result<()> {
    let mut on_boundary = ctx.filled(false, s.positions.len())?;
    let rim = |edge: &[HalfEdge], rim: &mut Vec<u32>| {
        if let [only] = edge {
            rim.extend(only.ends());
        }
    };
    rings.edges.gather(rim, ctx)?.into_iter().for_each(|v| on_boundary[v as usize] = true);
    for _ in 0..CREASE.unfoldings {
        let folded = folded(s, pulls, ctx)?;
        if folded.is_empty() {
            break;
        }
        let moved = folded.par_iter().filter(|v| !on_boundary[**v as usize]).map(|&v| {
            ctx.check()?;
            let own = rings.neighbours.of(v);
            let sum = own.iter().fold(Vec3::ZERO, |sum, &w| sum + s.positions[w as usize]);
            let normals = own.iter().map(|&w| pulls.of(w).map_or(Vec3::ZERO, |p| p.normal));
            let normal = normals.fold(Vec3::ZERO, |sum, n| sum + n);
            let to = sum * (1.0 / own.len() as f64);
            Ok((v, to, pull(creases, to, normal.normalized(), None)))
        });
        for (v, to, pull) in moved.collect::<Result<Vec<_>>>()? {
            s.positions[v as usize] = to;
            pulls.set(v, pull);
        }
    }
    Ok(())
}

/// The vertices of triangles that face away from the sides that they lie on, ascending.
fn folded(s: &Surface, pulls: &Pulls, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let found = s.triangles.par_chunks(CREASE.triangles_at_once).map(|chunk| {
        ctx.check()?;
        Ok(chunk.iter().filter(|t| is_folded(s, pulls, t)).flatten().copied().collect::<Vec<_>>())
    });
    let mut folded = found.collect::<Result<Vec<_>>>()?.concat();
    sort(&mut folded, ctx)?;
    folded.dedup();
    Ok(folded)
}

/// Whether a triangle beside a crease will face away from the sides that its corners lie on.
pub(super) fn is_folded(s: &Surface, pulls: &Pulls, t: &[u32; 3]) -> bool {
    // A corner that no crease asks anything of may be the tip of a spike.
    let own = t.map(|v| pulls.of(v));
    if own.iter().flatten().count() < 2 {
        return false;
    }
    let mut corners = t.map(|v| s.positions[v as usize]);
    let mut mean = Vec3::ZERO;
    for (p, pull) in corners.iter_mut().zip(own) {
        let Some(pull) = pull else { continue };
        *p = pull.moved(*p, pull.normal).0;
        mean += pull.normal;
    }
    area_vector(corners).normalized().dot(mean.normalized()) < CREASE.folded
}
