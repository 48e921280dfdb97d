//! Corners: places where three creases end.
//!
//! In: creases and the points about their ends. Out: where three sides meet, if the points are likelier with
//! three planes there than with what the charts say. A crease is seen by windows of two sides, so that it
//! ends short of the third.

use super::chains::Creases;
use super::constants::CREASE;
use super::piece::Piece;
use super::sides::Side;
use super::window::{Scratch, Windows};
use crate::error::Result;
use crate::numeric::robust;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::bvh::{Aabb, Bvh};
use std::ops::ControlFlow;

/// A corner of three sides.
#[derive(Debug, Clone)]
pub(super) struct Corner {
    /// Where it is.
    pub at: Vec3,
    /// Outward unit normals of the sides.
    pub sides: [Vec3; 3],
    /// Whether the crease between the two other sides is a ridge, else it is a groove.
    ridge: [bool; 3],
    /// The ends of creases that meet: a piece, and which end of it.
    ends: [(u32, usize); 3],
    /// How far from it the creases end.
    pub radius: f64,
    /// Spacing of the points.
    pub unit: f64,
}

impl Corner {
    /// A place on a crease, as a corner whose last two sides are one.
    pub fn edge(at: Vec3, [a, b]: [Vec3; 2], ridge: bool, unit: f64) -> Self {
        Self { at, sides: [a, b, b], ridge: [ridge; 3], ends: [(0, 0); 3], radius: 0.0, unit }
    }
    /// Signed distance of a place from the three sides, about; outside it is positive.
    pub fn signed(&self, p: Vec3) -> f64 {
        let [a, b, c] = self.sides.map(|n| n.dot(p - self.at));
        match self.ridge {
            [true, true, true] => a.max(b).max(c),
            [false, false, false] => a.min(b).min(c),
            [false, true, true] => b.min(c).max(a),
            [true, false, true] => c.min(a).max(b),
            [true, true, false] => a.min(b).max(c),
            [true, false, false] => b.max(c).min(a),
            [false, true, false] => c.max(a).min(b),
            [false, false, true] => a.max(b).min(c),
        }
    }
    /// The number of the side that a place lies on; none where it lies on a crease.
    pub fn one_side(&self, p: Vec3) -> Option<usize> {
        let side = self.side(p);
        let off = |k: usize| self.sides[k].dot(p - self.at).abs();
        let on_crease = (0..3).any(|k| k != side && off(k).max(off(side)) < CREASE.snap * self.unit);
        (!on_crease).then_some(side)
    }
    /// The side that a place lies on, or next to: its number.
    pub fn side(&self, p: Vec3) -> usize {
        let off = |k: usize| (self.sides[k].dot(p - self.at).abs() - self.signed(p).abs()).abs();
        let nearer = |best: usize, k: usize| if off(k) < off(best) { k } else { best };
        (1..3).fold(0, nearer)
    }
}

/// Creases as far as the corners that they end in, and a little beyond.
pub(super) fn extended(mut creases: Creases, corners: &[Corner], ctx: &Context<'_>) -> Result<Creases> {
    for corner in corners {
        for (piece, end) in corner.ends {
            let piece = &mut creases.pieces[piece as usize];
            let y = piece.local(corner.at)[1].abs() + CREASE.strip;
            piece.along[end] = piece.along[end].max(y);
        }
    }
    creases.bounds = creases.pieces.iter().map(Piece::bounds).collect();
    creases.tree = Bvh::build(&creases.bounds, ctx)?;
    Ok(creases)
}

/// An end of a crease.
struct End {
    piece: u32,
    end: usize,
    chain: u32,
    at: Vec3,
    /// Direction in which the crease would go on.
    onward: Vec3,
    sides: [Vec3; 2],
    ridge: bool,
    unit: f64,
}

/// The corners, each end in one of them at most.
pub(super) fn find(creases: &Creases, windows: &Windows<'_>, ctx: &Context<'_>) -> Result<Vec<Corner>> {
    let ends = ends(creases, ctx)?;
    if ends.len() < 3 {
        return Ok(Vec::new());
    }
    let places: Vec<Vec3> = ends.iter().map(|e| e.at).collect();
    let tree = Neighbours::build(&places, ctx)?;
    let mut scratch = windows.scratch(ctx)?;
    let (mut near, mut taken, mut corners) = (Vec::new(), vec![false; ends.len()], Vec::new());
    for (i, one) in ends.iter().enumerate() {
        ctx.check()?;
        tree.within(one.at, CREASE.meet * one.unit, &mut near);
        let others: Vec<usize> = near.iter().map(|n| n.index as usize).filter(|&j| j > i).collect();
        let triples =
            others.iter().enumerate().flat_map(|(n, &j)| others[n + 1..].iter().map(move |&k| [i, j, k]));
        for triple in triples {
            if triple.iter().any(|&e| taken[e]) {
                continue;
            }
            let Some(corner) = corner(triple.map(|e| &ends[e])) else { continue };
            if is_likelier(&corner, windows, &mut scratch) {
                let corner = settled(corner, windows, &mut scratch);
                triple.iter().for_each(|&e| taken[e] = true);
                corners.push(corner);
            }
        }
    }
    Ok(corners)
}

/// Where creases end: at ends of pieces that no other piece of the crease goes beyond.
fn ends(creases: &Creases, ctx: &Context<'_>) -> Result<Vec<End>> {
    let mut out: Vec<End> = Vec::new();
    for (k, piece) in creases.pieces.iter().enumerate() {
        ctx.check_at(k)?;
        for (end, sign) in [-1.0, 1.0].into_iter().enumerate() {
            let y = sign * piece.along[end];
            let at = piece.on_line(y);
            let chain = creases.chain[k];
            let goes_on = creases.tree.meeting(&Aabb::of(&[at]), |o| {
                let (other, own) = (&creases.pieces[o as usize], creases.chain[o as usize] == chain);
                let [x, y, z] = other.local(at);
                let on = o as usize != k && own && z.abs() < other.longest() && other.far2(x, y) < 1.0;
                if on { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            if goes_on.is_break() {
                continue;
            }
            out.push(End {
                piece: k as u32,
                end,
                chain,
                at,
                onward: (at - piece.on_line(y - 0.5 * sign)).normalized(),
                sides: piece.sides(y),
                ridge: piece.model.is_ridge(),
                unit: piece.unit,
            });
        }
    }
    Ok(out)
}

/// The corner that three ends make: each side belongs to two of them.
fn corner(ends: [&End; 3]) -> Option<Corner> {
    if ends[0].chain == ends[1].chain || ends[1].chain == ends[2].chain || ends[2].chain == ends[0].chain {
        return None;
    }
    (0..8u32).find_map(|turn| {
        // Side k lies between the ends after the k-th.
        let of = |e: usize, second: bool| ends[e].sides[usize::from(second != (turn >> e & 1 == 1))];
        let pairs = [
            (of(1, true), 1, of(2, false), 2),
            (of(2, true), 2, of(0, false), 0),
            (of(0, true), 0, of(1, false), 1),
        ];
        if pairs.iter().any(|(a, _, b, _)| a.dot(*b) < CREASE.parallel) {
            return None;
        }
        let sides = pairs.map(|(a, _, b, _)| (a + b).normalized());
        let origin = ends[0].at;
        let height = |k: usize| {
            let (_, i, _, j) = pairs[k];
            0.5 * (sides[k].dot(ends[i].at - origin) + sides[k].dot(ends[j].at - origin))
        };
        let at = origin + meeting(sides, [0, 1, 2].map(height))?;
        let unit = ends.iter().map(|e| e.unit).fold(0.0, f64::max);
        let ahead = |e: &End| {
            let d = at - e.at;
            let on = e.onward.dot(d);
            (d - e.onward * on).norm() < CREASE.aligned * unit && on > -CREASE.meet * unit
        };
        let radius = ends.iter().map(|e| (e.at - at).norm()).fold(0.0, f64::max);
        let near = radius < CREASE.meet * unit && ends.iter().all(|e| ahead(e));
        near.then(|| Corner {
            at,
            sides,
            // The k-th end is of the crease between the sides that are not the k-th.
            ridge: ends.map(|e| e.ridge),
            ends: ends.map(|e| (e.piece, e.end)),
            radius,
            unit,
        })
    })
}

/// Where three planes with these unit normals and distances from the origin meet; none where they hardly do.
fn meeting([a, b, c]: [Vec3; 3], off: [f64; 3]) -> Option<Vec3> {
    let across = [b.cross(c), c.cross(a), a.cross(b)];
    let volume = a.dot(across[0]);
    let sum: Vec3 = (0..3).map(|k| across[k] * off[k]).sum();
    (volume.abs() >= CREASE.spread).then(|| sum * (1.0 / volume))
}

/// The corner of the planes that the points on each of its sides ask for, if these are likelier with it:
/// creases end short of the corner, where they say least about its sides.
fn settled(corner: Corner, windows: &Windows<'_>, scratch: &mut Scratch) -> Corner {
    let [radius, _] = CREASE.radii[1];
    let ball = windows.ball(corner.at, radius * corner.unit, scratch);
    let cost = |c: &Corner| -> f64 {
        ball.points.iter().map(|(p, _)| robust::cost(c.signed(*p) / ball.sigma)).sum()
    };
    let plane = |k: usize| {
        let own = ball.points.iter().map(|(p, _)| *p).filter(|&p| corner.side(p) == k);
        let weight = |p: Vec3| robust::tukey(corner.signed(p) / ball.sigma, robust::TUKEY);
        Side::of(own.map(|p| (p - corner.at, weight(p))), corner.sides[k])
    };
    let [Some(a), Some(b), Some(c)] = [0, 1, 2].map(plane) else { return corner };
    let planes = [a, b, c];
    let sides = planes.map(|side| side.normal);
    let Some(moved) = meeting(sides, planes.map(|side| -side.off(Vec3::ZERO))) else { return corner };
    let new = Corner { at: corner.at + moved, sides, ..corner };
    let stays = moved.norm() < CREASE.deepest * corner.unit;
    if stays && cost(&new) < cost(&corner) { new } else { corner }
}

/// Whether the points about a corner are likelier with it than with what the charts say.
fn is_likelier(corner: &Corner, windows: &Windows<'_>, scratch: &mut Scratch) -> bool {
    let radius = corner.radius + CREASE.strip * corner.unit;
    let ball = windows.ball(corner.at, radius, scratch);
    let cost = |p: Vec3| robust::cost(corner.signed(p) / ball.sigma);
    let gain: f64 = ball.points.iter().map(|&(p, claimed)| claimed - cost(p)).sum();
    // Three creases that end together would be a corner by themselves.
    gain > -CREASE.margin
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The corner of the octant x, y, z < 0, from three ridges that end short of it.
    fn ends() -> [End; 3] {
        [0, 1, 2].map(|k| {
            let axis = |i: usize| Vec3::from_fn(|j| f64::from(u8::from(j == i % 3)));
            End {
                piece: k as u32,
                end: 1,
                chain: k as u32,
                at: axis(k) * -1.5,
                onward: axis(k),
                sides: [axis(k + 1), axis(k + 2)],
                ridge: true,
                unit: 1.0,
            }
        })
    }

    #[test]
    fn three_ridges_that_end_together_make_a_corner_whatever_their_order_and_sides() {
        let ends = ends();
        for order in [[0, 1, 2], [2, 1, 0], [1, 0, 2]] {
            for turned in 0..8 {
                let own = order.map(|k| {
                    let End { piece, end, chain, at, onward, mut sides, ridge, unit } = ends[k];
                    if turned >> k & 1 == 1 {
                        sides.reverse();
                    }
                    End { piece, end, chain, at, onward, sides, ridge, unit }
                });
                let found = corner([&own[0], &own[1], &own[2]]).expect("a corner");
                assert!(found.at.norm() < 1e-12 && (found.radius - 1.5).abs() < 1e-12, "{found:?}");
            }
        }
        let mut apart = ends;
        apart[0].at = Vec3([-1.5, 1.4, 0.0]);
        assert!(corner([&apart[0], &apart[1], &apart[2]]).is_none());
    }

    #[test]
    fn distances_are_from_the_sides_and_outside_is_positive() {
        let [a, b, c] = ends();
        let found = corner([&a, &b, &c]).expect("a corner");
        for (p, off) in [([-1.0, -1.0, 0.5], 0.5), ([-1.0, -1.0, -0.2], -0.2), ([0.3, 0.4, -1.0], 0.4)] {
            assert!((found.signed(Vec3(p)) - off).abs() < 1e-12, "{p:?}");
        }
        let up = found.sides[found.side(Vec3([-1.0, -1.0, 0.1]))];
        assert_eq!(up, Vec3([0.0, 0.0, 1.0]));
        // Two ridges and a groove: an L, whose groove lies between the sides that are not the last.
        let groove = Corner { ridge: [true, true, false], ..found };
        assert!((groove.signed(Vec3([0.3, -0.4, -1.0])) + 0.4).abs() < 1e-12);
        assert!((groove.signed(Vec3([0.3, -0.4, 0.2])) - 0.2).abs() < 1e-12);
    }
}
