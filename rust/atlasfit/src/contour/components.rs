//! The connected parts of the surface: which way each faces, and which are specks.
//!
//! In: triangles with every edge in at most two of them. Out: the same, each part consistently oriented where
//! that is possible; small parts, and parts that too few points carry, are gone.

use super::Facing;
use super::adjacency::{self, FaceAdjacency, Turn};
use super::before;
use super::compact::compact;
use super::facing::{self, Component, Sides};
use super::surface::{Surface, remove_marked};
use super::viewers::Seen;
use crate::atlas::{Chart, Vote};
use crate::error::Result;
use crate::run::Context;
use crate::spatial::sets::Sets;

/// Orients each part consistently (breadth first where the field's orientation is only local), and all as
/// [`facing::sides`] says; drops parts of fewer than `min_triangles`. One-sided parts keep a seam of
/// disagreeing neighbours.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn orient(
    s: &mut Surface,
    charts: &[Chart],
    facing: &Facing<'_>,
    min_triangles: usize,
    ctx: &Context<'_>,
) -> Result<()> {
    let Facing { one_sided, votes, opposing } = *facing;
    let shares = shares(s, votes);
    let adjacency = adjacency::of(&s.triangles, ctx)?;
    let mut turn = vec![Turn::Unknown; s.triangles.len()];
    let mut speck = vec![false; s.triangles.len()];
    let mut found: Vec<Component> = Vec::new();
    for start in 0..s.triangles.len() {
        if turn[start] != Turn::Unknown {
            continue;
        }
        let part = collect(&adjacency, start as u32, one_sided, &mut turn, ctx)?;
        if part.len() < min_triangles {
            for &t in &part {
                speck[t as usize] = true;
            }
        } else {
            let mut vote = Vote::default();
            for (i, &t) in part.iter().enumerate() {
                ctx.check_at(i)?;
                let chart = s.chart[s.triangles[t as usize][0] as usize] as usize;
                if let Some(share) = shares.get(chart) {
                    vote.add_share(&votes[chart], *share, turn[t as usize].sign());
                }
            }
            found.push(Component::new(s, part, &Sides { turn: &turn, adjacency: &adjacency }, vote, ctx)?);
        }
    }
    // The signs of charts say nothing of triangles that were turned one by one.
    let before = if one_sided { Vec::new() } else { before::relations(s, charts, opposing, &found, ctx)? };
    // What is closed knows its outside, and what the scan knows needs no guess at who saw it.
    let asked = votes.is_empty() && found.iter().any(Component::is_open);
    let triangles: Vec<&[u32]> = found.iter().map(|part| &part.triangles[..]).collect();
    let seen = if asked { Some(Seen::of(s, &triangles, &turn, ctx)?) } else { None };
    for (component, side) in found.iter().zip(facing::sides(&found, before, seen.as_ref(), ctx)?) {
        let invert = side < 0.0;
        for &t in &component.triangles {
            if (turn[t as usize] == Turn::Flipped) != invert {
                s.triangles[t as usize].swap(1, 2);
            }
        }
    }
    remove_marked(&mut s.triangles, &speck);
    ctx.check()
}

/// The share of its chart's votes that each triangle carries, per chart: a chart's votes are shared out over
/// the triangles that begin at one of its vertices.
fn shares(s: &Surface, votes: &[Vote]) -> Vec<f64> {
    let mut triangles = vec![0u32; votes.len()];
    for t in &s.triangles {
        if let Some(n) = triangles.get_mut(s.chart[t[0] as usize] as usize) {
            *n += 1;
        }
    }
    triangles.iter().map(|&n| 1.0 / f64::from(n.max(1))).collect()
}

/// The part that a triangle belongs to, breadth first; says how each of its triangles must be turned.
fn collect(
    adjacency: &[FaceAdjacency],
    start: u32,
    one_sided: bool,
    turn: &mut [Turn],
    ctx: &Context<'_>,
) -> Result<Vec<u32>> {
    let mut part = vec![start];
    turn[start as usize] = Turn::AsIs;
    let mut head = 0;
    while head < part.len() {
        ctx.check_at(head)?;
        let t = part[head] as usize;
        head += 1;
        for (u, opposed) in adjacency[t].neighbours() {
            if turn[u as usize] == Turn::Unknown {
                // Two-sided surfaces come consistently oriented from the field.
                turn[u as usize] = if one_sided && opposed { turn[t].opposite() } else { turn[t] };
                part.push(u);
            }
        }
    }
    Ok(part)
}

/// Removes parts of the surface that fewer than `least` points lie on. `points` says for each chart how many
/// points are its own; they are shared out evenly over the chart's vertices.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn remove_unsupported(
    s: &mut Surface,
    points: &[u32],
    least: f64,
    ctx: &Context<'_>,
) -> Result<()> {
    let mut sets = Sets::of_triangles(s.positions.len(), &s.triangles, ctx)?;
    let mut vertices = vec![0u32; points.len()];
    for &c in &s.chart {
        if let Some(n) = vertices.get_mut(c as usize) {
            *n += 1;
        }
    }
    let mut support = vec![0.0; s.positions.len()];
    for (v, &c) in s.chart.iter().enumerate() {
        ctx.check_at(v)?;
        if let Some(&n) = points.get(c as usize) {
            support[sets.find(v as u32) as usize] += f64::from(n) / f64::from(vertices[c as usize]);
        }
    }
    s.triangles.retain(|t| support[sets.find(t[0]) as usize] >= least);
    compact(s, ctx)
}

#[cfg(test)]
mod tests {
    use super::super::surface::corners;
    use super::*;
    use crate::Run;
    use crate::numeric::vec3::Vec3;

    fn surface(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Surface {
        let n = positions.len();
        Surface { positions, normals: vec![Vec3::ZERO; n], chart: vec![0; n], triangles }
    }

    /// A tetrahedron about the origin, facing out for a positive size.
    fn tetrahedron(size: f64, first: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let at = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
        (at.map(|p| Vec3(p) * size).to_vec(), triangles.map(|t| t.map(|v| v + first)).to_vec())
    }

    fn volume(s: &Surface, triangles: std::ops::Range<usize>) -> f64 {
        s.triangles[triangles]
            .iter()
            .map(|t| corners(&s.positions, t))
            .map(|[a, b, c]| a.dot(b.cross(c)))
            .sum()
    }

    #[test]
    fn votes_go_before_volume_unless_they_say_no_more_than_chance() {
        for (sum, outward) in [(-9.0, false), (9.0, true), (-1.0, true)] {
            let (at, triangles) = tetrahedron(1.0, 0);
            let mut s = surface(at, triangles);
            // The charts face as the triangles do: outward where their volume is positive.
            let sign = volume(&s, 0..4).signum();
            let votes = [Vote { sum: sum * sign, squares: 4.0 }];
            Run::default()
                .execute(|ctx| {
                    orient(&mut s, &[], &Facing { one_sided: false, votes: &votes, opposing: &[] }, 2, ctx)
                })
                .unwrap();
            assert_eq!(volume(&s, 0..4) > 0.0, outward, "{sum}");
        }
    }

    #[test]
    fn a_closed_part_faces_out_and_a_speck_goes() {
        let mut at: Vec<Vec3> =
            (0..4).map(|k| Vec3::from_fn(|c| if k == c + 1 { 1.0 } else { 0.0 })).collect();
        at.extend((0..3).map(|k| Vec3([5.0 + f64::from(k % 2), 5.0 + f64::from(k / 2), 5.0])));
        // A tetrahedron that faces in, and a triangle alone.
        let mut s = surface(at, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2], [4, 5, 6]]);
        Run::default()
            .execute(|ctx| {
                orient(&mut s, &[], &Facing { one_sided: false, votes: &[], opposing: &[] }, 2, ctx)
            })
            .unwrap();
        let volume: f64 =
            s.triangles.iter().map(|t| corners(&s.positions, t)).map(|[a, b, c]| a.dot(b.cross(c))).sum();
        assert!(s.triangles.len() == 4 && volume > 0.0, "{volume}");
    }
}
