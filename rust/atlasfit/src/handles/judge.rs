//! What the points say of a cut.
//!
//! In: a piece of the surface, the points. Out: the piece as it is after the likeliest cut, where that is at
//! least as likely as before: what the points lose, and the points that the caps lack, is no more than what
//! the numbers that describe a tube cost (half the logarithm of the number of points for each; Schwarz 1978).

use super::constants::HANDLES;
use super::piece::Piece;
use super::{loops, open};
use crate::atlas::{KnownScan, ProjectedPoint};
use crate::contour::surface::Surface;
use crate::contour::{holes, smooth};
use crate::error::Result;
use crate::numeric::robust::cost;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::triangle::{area_vector, closest_on_triangle};

/// The points of a scan.
pub(super) struct Points<'a> {
    known: &'a KnownScan<'a>,
    projected: &'a [ProjectedPoint],
    /// The places of those that lie on charts, and which they are.
    tree: Neighbours,
    on_charts: Vec<u32>,
}

impl<'a> Points<'a> {
    pub fn new(projected: &'a [ProjectedPoint], known: &'a KnownScan<'a>, ctx: &Context<'_>) -> Result<Self> {
        let lies = |&i: &u32| projected[i as usize].chart != u32::MAX;
        let on_charts: Vec<u32> = (0..projected.len() as u32).filter(lies).collect();
        let places: Vec<Vec3> = on_charts.iter().map(|&i| projected[i as usize].position).collect();
        Ok(Self { known, projected, tree: Neighbours::build(&places, ctx)?, on_charts })
    }
    /// The points that lie on a piece, by their numbers.
    fn on(&self, piece: &Piece, unit: f64) -> Vec<u32> {
        let middle = piece.positions.iter().copied().sum::<Vec3>() * (1.0 / piece.positions.len() as f64);
        let reach = piece.positions.iter().map(|p| p.dist2(middle)).fold(0.0, f64::max).sqrt();
        let mut found = Vec::new();
        self.tree.within(middle, reach, &mut found);
        let found = found.iter().map(|n| self.on_charts[n.index as usize]);
        let is_near = |&i: &u32| {
            let at = self.projected[i as usize].position;
            piece.positions.iter().any(|p| p.dist2(at) < unit * unit)
        };
        found.filter(is_near).collect()
    }
    /// What triangles leave unexplained of points, in nats.
    fn misfit(&self, own: &[u32], positions: &[Vec3], triangles: &[[u32; 3]], ball: &Ball) -> f64 {
        let corners = triangles.iter().map(|t| t.map(|v| positions[v as usize]));
        let corners: Vec<[Vec3; 3]> =
            corners.filter(|t| t.iter().any(|p| p.dist2(ball.middle) < ball.radius2)).collect();
        let off = |&i: &u32| {
            let p = self.known.points[i as usize];
            let far =
                corners.iter().map(|t| closest_on_triangle(p, t).dist2(p)).fold(f64::INFINITY, f64::min);
            cost(far.sqrt() / self.known.noise_at(i).max(f64::MIN_POSITIVE))
        };
        own.iter().map(off).sum()
    }
    /// The piece with its handle cut in the likeliest way, new vertices after all its own; none where the
    /// points ask for the handle.
    pub fn cut(&self, s: &Surface, piece: &Piece, unit: f64, ctx: &Context<'_>) -> Result<Option<Surface>> {
        let own = self.on(piece, unit);
        // What a cut may cost, in nats: what the tube costs.
        let mut most = 0.5 * HANDLES.of_tube * (own.len().max(1) as f64).ln();
        let mut found = None;
        for around in loops::shortest(piece, ctx)? {
            let Some((opened, caps)) = closed(s, piece, &around, ctx)? else { continue };
            let missed = caps / (unit * unit);
            if missed >= most {
                continue;
            }
            // Points farther from the loop see nothing of the cut.
            let ball = |more: f64| Ball::about(piece, &around, more * unit);
            let (seen, near) = (ball(HANDLES.seen), ball(2.0 * HANDLES.seen));
            let sees = |&&i: &&u32| self.projected[i as usize].position.dist2(seen.middle) < seen.radius2;
            let own: Vec<u32> = own.iter().filter(sees).copied().collect();
            let before = self.misfit(&own, &piece.positions, &piece.corners, &near);
            let mut free = vec![false; opened.positions.len()];
            around.iter().for_each(|&v| free[v as usize] = true);
            free[piece.positions.len()..].fill(true);
            let mut drawn_in = drawn_in(&opened, &free);
            smooth::mend_normals(&mut drawn_in, &free, ctx)?;
            let mut smoothed = opened;
            smooth::smooth(&mut smoothed, self.known.charts, free, ctx)?;
            for mut after in [smoothed, drawn_in] {
                for v in (0..piece.positions.len()).filter(|&v| piece.on_ring[v]) {
                    let name = piece.vertices[v] as usize;
                    (after.positions[v], after.normals[v]) = (s.positions[name], s.normals[name]);
                }
                let lost = self.misfit(&own, &after.positions, &after.triangles, &near) - before;
                if missed + lost < most {
                    most = missed + lost;
                    found = Some(after);
                }
            }
        }
        Ok(found)
    }
}

/// A ball.
struct Ball {
    middle: Vec3,
    radius2: f64,
}

impl Ball {
    /// The ball about a loop that reaches so much farther.
    fn about(piece: &Piece, around: &[u32], more: f64) -> Self {
        let places = around.iter().map(|&v| piece.positions[v as usize]);
        let middle = places.clone().sum::<Vec3>() * (1.0 / around.len() as f64);
        let reach = places.map(|p| p.dist2(middle)).fold(0.0, f64::max).sqrt();
        Self { middle, radius2: (reach + more).powi(2) }
    }
}

/// A surface whose free vertices are drawn to their neighbours.
fn drawn_in(s: &Surface, free: &[bool]) -> Surface {
    let mut s = s.clone();
    for _ in 0..HANDLES.steps {
        let mut sum = vec![(Vec3::ZERO, 0.0); s.positions.len()];
        for &[a, b, c] in &s.triangles {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                sum[a as usize].0 += s.positions[b as usize];
                sum[a as usize].1 += 1.0;
            }
        }
        for ((p, (sum, count)), _) in s.positions.iter_mut().zip(sum).zip(free).filter(|v| *v.1) {
            *p = (*p + sum * (1.0 / count)) * 0.5;
        }
    }
    s
}

/// A piece cut along a loop, closed by two caps of the least area; and the area of both.
fn closed(s: &Surface, piece: &Piece, around: &[u32], ctx: &Context<'_>) -> Result<Option<(Surface, f64)>> {
    let Some(right) = open::along(&piece.corners, around) else { return Ok(None) };
    let places: Vec<Vec3> = around.iter().map(|&v| piece.positions[v as usize]).collect();
    let Some(cap) = holes::ring(&places, &chords(piece, around), ctx)? else { return Ok(None) };
    let area: f64 = cap.iter().map(|t| area_vector(t.map(|k| places[k as usize])).norm()).sum();
    let first = piece.positions.len() as u32;
    let mut triangles = piece.corners.clone();
    right.iter().for_each(|c| triangles[c.face as usize][c.corner] = first + c.place);
    for &[a, b, c] in &cap {
        triangles.push([a, b, c].map(|k| first + k));
        triangles.push([c, b, a].map(|k| around[k as usize]));
    }
    let of = || (0..first).chain(around.iter().copied()).map(|v| piece.vertices[v as usize] as usize);
    let after = Surface {
        positions: of().map(|v| s.positions[v]).collect(),
        normals: of().map(|v| s.normals[v]).collect(),
        chart: of().map(|v| s.chart[v]).collect(),
        triangles,
    };
    Ok(Some((after, area)))
}

/// The edges between two places of a loop that are not next to each other.
fn chords(piece: &Piece, around: &[u32]) -> Vec<[u32; 2]> {
    let n = around.len();
    let place = |v: u32| around.iter().position(|&w| w == v);
    let ends = piece.edges.iter().filter_map(|e| Some([place(e.ends[0])?, place(e.ends[1])?]));
    ends.filter(|&[a, b]| (a + 1) % n != b && (b + 1) % n != a).map(|e| e.map(|k| k as u32)).collect()
}
