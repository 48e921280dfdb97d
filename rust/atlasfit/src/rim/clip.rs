//! What lies beyond the boundary cut off.
//!
//! In: a surface, the curves where it ends. Out: the surface cut along the boundary:
//! triangles that it crosses are split there.

use super::constants::RIM;
use super::curve::{Curve, Node};
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::lists::Lists;
use crate::spatial::neighbours::Neighbours;
use crate::spatial::triangle::area_vector;
use rayon::prelude::*;

/// Where a vertex is.
#[derive(Clone, Copy)]
struct Place {
    /// How far beyond the boundary, in spacings; minus infinity where none is near.
    far: f64,
    /// The way back to the boundary.
    back: Vec3,
}

/// Which side of the boundary a vertex is on.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Within,
    On,
    Beyond,
}

/// How far each vertex lies beyond the curve next to it, and the way out there.
fn places(
    s: &Surface,
    rings: &[Vec<u32>],
    curves: &[Curve],
    around: &Lists,
    ctx: &Context<'_>,
) -> Result<Vec<Place>> {
    let nodes: Vec<Node> = curves.iter().flat_map(|c| &c.nodes).copied().collect();
    let at: Vec<Vec3> = nodes.iter().map(|n| n.position).collect();
    let tree = Neighbours::build(&at, ctx)?;
    let place = |v: &u32| {
        let (p, normal) = (s.positions[*v as usize], s.normals[*v as usize]);
        let node = &nodes[tree.nearest_one(p).index as usize];
        let off = (p - node.position) * (1.0 / node.spacing);
        let near = off.norm() < RIM.band
            && off.dot(node.normal).abs() < RIM.off
            && normal.dot(node.normal).abs() > RIM.same_way;
        let far = if near { off.dot(node.out) - node.slack } else { f64::NEG_INFINITY };
        Place { far, back: node.out * (-far * node.spacing) }
    };
    let near = near(s, rings, around, ctx)?;
    let found = near.par_chunks(1024).map(|chunk| {
        ctx.check()?;
        Ok(chunk.iter().map(place).collect::<Vec<_>>())
    });
    let found = found.collect::<Result<Vec<_>>>()?.concat();
    let mut places = ctx.filled(Place { far: f64::NEG_INFINITY, back: Vec3::ZERO }, s.positions.len())?;
    near.iter().zip(found).for_each(|(&v, place)| places[v as usize] = place);
    Ok(places)
}

/// The vertices of the rings, and those a few edges from them.
fn near(s: &Surface, rings: &[Vec<u32>], around: &Lists, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let mut seen = ctx.filled(false, s.positions.len())?;
    let mut found: Vec<u32> = rings.iter().flatten().copied().collect();
    found.iter().for_each(|&v| seen[v as usize] = true);
    let mut from = 0;
    for _ in 0..RIM.rings {
        ctx.check()?;
        let to = found.len();
        for i in from..to {
            for v in around.of(found[i]).iter().flat_map(|&f| s.triangles[f as usize]) {
                if !std::mem::replace(&mut seen[v as usize], true) {
                    found.push(v);
                }
            }
        }
        from = to;
    }
    Ok(found)
}

/// Cuts off what lies beyond the curves and hangs together with the vertices of `rings`.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn clip(s: &mut Surface, rings: &[Vec<u32>], curves: &[Curve], ctx: &Context<'_>) -> Result<()> {
    let edges = Edges::new(&s.triangles, ctx)?;
    let around = Lists::new(s.positions.len(), &s.triangles, ctx)?;
    let places = places(s, rings, curves, &around, ctx)?;
    let sides = sides(rings, &places, &edges, ctx)?;
    for v in 0..sides.len() as u32 {
        ctx.check_at(v as usize)?;
        if sides[v as usize] != Side::On {
            continue;
        }
        let to = s.positions[v as usize] + places[v as usize].back;
        let of = around.of(v);
        let area =
            |s: &Surface, f: u32| area_vector(s.triangles[f as usize].map(|v| s.positions[v as usize]));
        let before: Vec<_> = of.iter().map(|&f| area(s, f)).collect();
        let from = std::mem::replace(&mut s.positions[v as usize], to);
        if of.iter().zip(before).any(|(&f, before)| area(s, f).dot(before) <= 0.0) {
            s.positions[v as usize] = from;
        }
    }
    cut(s, &sides, &places, &edges, ctx)
}

/// The side of each vertex. Those beyond hang together with the boundary.
fn sides(rings: &[Vec<u32>], places: &[Place], edges: &Edges, ctx: &Context<'_>) -> Result<Vec<Side>> {
    let far = |v: u32| places[v as usize].far;
    let mut links: Vec<[u32; 2]> = Vec::new();
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        let ends = edge[0].ends();
        if ends.iter().all(|&v| far(v) > RIM.on) {
            links.push(ends);
        }
    }
    let mut ends = links.clone();
    ends.extend(links.iter().map(|&[a, b]| [b, a]));
    ends.sort_unstable();
    let mut sides = ctx.filled(Side::Within, places.len())?;
    let mut front: Vec<u32> = rings.iter().flatten().copied().filter(|&v| far(v) > RIM.on).collect();
    front.iter().for_each(|&v| sides[v as usize] = Side::Beyond);
    while let Some(v) = front.pop() {
        let from = ends.partition_point(|e| e[0] < v);
        for &[_, w] in ends[from..].iter().take_while(|e| e[0] == v) {
            if sides[w as usize] != Side::Beyond {
                sides[w as usize] = Side::Beyond;
                front.push(w);
            }
        }
    }
    for (v, side) in sides.iter_mut().enumerate() {
        if *side == Side::Within && places[v].far.abs() <= RIM.on {
            *side = Side::On;
        }
    }
    Ok(sides)
}

/// Splits the triangles that the boundary crosses, and takes those away that lie beyond it.
fn cut(s: &mut Surface, sides: &[Side], places: &[Place], edges: &Edges, ctx: &Context<'_>) -> Result<()> {
    // For each triangle the new vertex on each of its edges.
    let mut new = ctx.filled([u32::MAX; 3], s.triangles.len())?;
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        let [mut a, mut b] = edge[0].ends();
        if sides[a as usize] == Side::Beyond {
            (a, b) = (b, a);
        }
        if sides[a as usize] != Side::Within || sides[b as usize] != Side::Beyond {
            continue;
        }
        let [low, high] = [a, b].map(|v| places[v as usize].far);
        // No boundary is near the inner end: it lies no nearer than the outer one.
        let low = low.max(-high);
        let share = low / (low - high);
        let [p, q] = [a, b].map(|v| s.positions[v as usize]);
        let [m, n] = [a, b].map(|v| s.normals[v as usize]);
        let vertex = s.positions.len() as u32;
        s.positions.push(p + (q - p) * share);
        s.normals.push((m + (n - m) * share).normalized());
        s.chart.push(s.chart[if share < 0.5 { a } else { b } as usize]);
        for half in edge {
            new[half.face()][half.side()] = vertex;
        }
    }
    let mut kept = Vec::with_capacity(s.triangles.len());
    for (f, t) in s.triangles.iter().enumerate() {
        ctx.check_at(f)?;
        let out = t.map(|v| sides[v as usize] == Side::Beyond);
        if !out.contains(&true) {
            kept.push(*t);
            continue;
        }
        // The corners of what is left, in order.
        let mut left: Vec<u32> = Vec::with_capacity(4);
        for k in 0..3 {
            if !out[k] {
                left.push(t[k]);
            }
            if new[f][k] != u32::MAX {
                left.push(new[f][k]);
            }
        }
        if left.len() == 3 {
            kept.push([left[0], left[1], left[2]]);
        } else if let &[a, b, c, d] = &left[..] {
            let at = |v: u32| s.positions[v as usize];
            if at(a).dist2(at(c)) < at(b).dist2(at(d)) {
                kept.extend([[a, b, c], [a, c, d]]);
            } else {
                kept.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    s.triangles = kept;
    Ok(())
}
