//! Where the surface bends sharply, and places there to look for creases at.
//!
//! In: a surface. Out: vertices of edges whose triangles meet at an angle; of those a few, evenly spread.

use super::constants::CREASE;
use super::window::Windows;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::edges::{Edges, HalfEdge};
use crate::spatial::triangle::area_vector;

/// The vertices, ascending.
pub(super) fn find(s: &Surface, edges: &Edges, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let normal = |f: usize| area_vector(s.triangles[f].map(|v| s.positions[v as usize])).normalized();
    let bends = |edge: &[HalfEdge], bent: &mut Vec<u32>| {
        if let [a, b] = edge
            && !a.runs_as(*b, &s.triangles)
            && normal(a.face()).dot(normal(b.face())) < CREASE.bend
        {
            bent.extend(a.ends());
        }
    };
    let mut bent = edges.gather(bends, ctx)?;
    sort(&mut bent, ctx)?;
    bent.dedup();
    Ok(bent)
}

/// Some of the vertices, counted, no two nearer to each other than so many spacings of the points.
pub(super) fn spread(
    bent: &[u32],
    apart: f64,
    s: &Surface,
    windows: &Windows<'_>,
    ctx: &Context<'_>,
) -> Result<Vec<u32>> {
    let places: Vec<Vec3> = bent.iter().map(|&v| s.positions[v as usize]).collect();
    let tree = Neighbours::build(&places, ctx)?;
    let mut taken = ctx.filled(false, bent.len())?;
    let (mut chosen, mut near) = (Vec::new(), Vec::new());
    for (k, &v) in bent.iter().enumerate() {
        ctx.check_at(k)?;
        if taken[k] {
            continue;
        }
        let Some(unit) = windows.unit(v) else { continue };
        tree.within(places[k], apart * unit, &mut near);
        near.iter().for_each(|n| taken[n.index as usize] = true);
        chosen.push(k as u32);
    }
    Ok(chosen)
}
