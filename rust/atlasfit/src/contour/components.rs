//! The connected parts of the surface: which way each faces, and which are specks.
//!
//! In: triangles with every edge in at most two of them. Out: the same, each part consistently oriented where
//! that is possible and facing out or up; small parts, and parts that too few points carry, are gone.

use super::adjacency::{self, FaceAdjacency};
use super::compact::compact;
use super::constants::CONTOUR;
use super::surface::{Surface, remove_marked};
use crate::atlas::Vote;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::sets::Sets;
use crate::spatial::triangle::area_vector;
use std::f64::consts::PI;

/// A connected part of the surface.
struct Component {
    triangles: Vec<u32>,
    /// Signed volume that it spans with its centroid, for the turned triangles.
    volume: f64,
    /// Sum of its area vectors.
    mean_normal: Vec3,
    /// Whether it is an open sheet rather than a body.
    open: bool,
    /// How the scan votes on the side of the turned triangles.
    vote: Vote,
}

/// Which way a triangle must be turned so that its part is consistent.
#[derive(Clone, Copy, PartialEq)]
enum Turn {
    Unknown,
    AsIs,
    Flipped,
}

impl Turn {
    fn opposite(self) -> Self {
        match self {
            Self::Unknown => Self::Unknown,
            Self::AsIs => Self::Flipped,
            Self::Flipped => Self::AsIs,
        }
    }
}

/// Orients each part consistently (breadth first where the field's orientation is only local), outward by its
/// signed volume, or as the `votes` on its charts say; drops parts of fewer than `min_triangles`. One-sided
/// parts keep a seam of disagreeing neighbours.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn orient(
    s: &mut Surface,
    one_sided: bool,
    min_triangles: usize,
    votes: &[Vote],
    ctx: &Context<'_>,
) -> Result<()> {
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
            let mut component = measure(s, part, &turn, ctx)?;
            for &t in &component.triangles {
                let chart = s.chart[s.triangles[t as usize][0] as usize] as usize;
                if let Some(share) = shares.get(chart) {
                    let sign = if turn[t as usize] == Turn::Flipped { -1.0 } else { 1.0 };
                    component.vote.add_share(&votes[chart], *share, sign);
                }
            }
            found.push(component);
        }
    }
    // What the scan knows goes first. Otherwise a closed surface faces outward. Open sheets, such as parts of
    // a terrain, face along the one axis that they face most, upward.
    let faced =
        [0, 1, 2].map(|k| found.iter().filter(|c| c.open).map(|c| c.mean_normal[k].abs()).sum::<f64>());
    let up = (0..3).max_by(|&i, &j| faced[i].total_cmp(&faced[j])).unwrap_or(2);
    for c in &found {
        let shape = if c.open { c.mean_normal[up] } else { c.volume };
        let known = c.vote.verdict();
        let invert = if known == 0.0 { shape } else { known } < 0.0;
        for &t in &c.triangles {
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

/// What decides which way a part faces.
fn measure(s: &Surface, part: Vec<u32>, turn: &[Turn], ctx: &Context<'_>) -> Result<Component> {
    // Sums are taken about a vertex of the part: far from the origin they would lose digits.
    let centre = {
        let t = s.triangles[part[part.len() / 2] as usize];
        s.positions[t[0] as usize]
    };
    let mut mean = Vec3::ZERO;
    for (i, &t) in part.iter().enumerate() {
        ctx.check_at(i)?;
        mean += s.positions[s.triangles[t as usize][0] as usize] - centre;
    }
    let centre = centre + (mean * (1.0 / part.len() as f64));
    let (mut volume, mut area, mut mean_normal) = (0.0, 0.0, Vec3::ZERO);
    for (i, &t) in part.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b, c] = s.triangles[t as usize].map(|v| s.positions[v as usize] - centre);
        let sign = if turn[t as usize] == Turn::Flipped { -0.5 } else { 0.5 };
        let n = area_vector([a, b, c]) * sign;
        mean_normal += n;
        area += n.norm();
        volume += a.dot(n) / 3.0;
    }
    let facing = mean_normal.norm() / area.max(1e-300);
    let roundness = 6.0 * PI.sqrt() * volume.abs() / area.max(1e-300).powf(1.5);
    let open = facing > CONTOUR.open_facing && roundness < CONTOUR.open_volume;
    Ok(Component { triangles: part, volume, mean_normal, open, vote: Vote::default() })
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
            Run::default().execute(|ctx| orient(&mut s, false, 2, &votes, ctx)).unwrap();
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
        Run::default().execute(|ctx| orient(&mut s, false, 2, &[], ctx)).unwrap();
        let volume: f64 =
            s.triangles.iter().map(|t| corners(&s.positions, t)).map(|[a, b, c]| a.dot(b.cross(c))).sum();
        assert!(s.triangles.len() == 4 && volume > 0.0, "{volume}");
    }
}
