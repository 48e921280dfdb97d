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
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::triangle::area_vector;

/// Moves the vertices of folded triangles to the middle of their neighbours, a few times.
pub(super) fn unfold(
    s: &mut Surface,
    creases: &Creases,
    pulls: &mut Pulls,
    edges: &Edges,
    ctx: &Context<'_>,
) -> Result<()> {
    for _ in 0..CREASE.unfoldings {
        let mut folded = folded(s, pulls, ctx)?;
        if !folded.contains(&true) {
            break;
        }
        // Positions of the neighbours, and the normals of the sides that they lie on.
        let mut sum = ctx.filled((Vec3::ZERO, Vec3::ZERO, 0.0), s.positions.len())?;
        for (i, edge) in edges.iter().enumerate() {
            ctx.check_at(i)?;
            let [a, b] = edge[0].ends().map(|v| v as usize);
            if let [_] = edge {
                (folded[a], folded[b]) = (false, false);
            }
            for (v, w) in [(a, b), (b, a)].into_iter().filter(|x| folded[x.0]) {
                sum[v].0 += s.positions[w];
                sum[v].1 += pulls.of(w as u32).map_or(Vec3::ZERO, |p| p.normal);
                sum[v].2 += 1.0;
            }
        }
        for (v, (sum, normal, count)) in sum.into_iter().enumerate() {
            ctx.check_at(v)?;
            if count == 0.0 || !folded[v] {
                continue;
            }
            s.positions[v] = sum * (1.0 / count);
            pulls.set(v as u32, pull(creases, s.positions[v], normal.normalized(), None));
        }
    }
    Ok(())
}

/// Which vertices belong to triangles that face away from the sides that they lie on.
fn folded(s: &Surface, pulls: &Pulls, ctx: &Context<'_>) -> Result<Vec<bool>> {
    let mut folded = ctx.filled(false, s.positions.len())?;
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        if is_folded(s, pulls, t) {
            t.iter().for_each(|&v| folded[v as usize] = true);
        }
    }
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
