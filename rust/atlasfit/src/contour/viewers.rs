//! Which parts of the surface show their right side to viewers.
//!
//! In: parts of the surface, what else is said of the side of each. Out: the same sides, or such as are
//! likelier by what is seen from afar ([`crate::orient::Views`]): an object on the ground, and the ground, face
//! those who see both.

use super::adjacency::Turn;
use super::constants::CONTOUR;
use super::surface::{Surface, corners};
use crate::atlas::Relation;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::orient::constants::ORIENT;
use crate::orient::{Piece, Views};
use crate::run::Context;
use crate::spatial::triangle::area_vector;
use std::collections::BTreeMap;

/// What viewers see of the parts.
pub(super) struct Seen {
    /// Of pieces of the parts: what one chart has of each.
    views: Views,
    /// All pieces.
    pieces: Vec<u32>,
    /// The part that each piece is of.
    part: Vec<u32>,
    /// The parts that are turned each by itself, the largest first.
    large: Vec<usize>,
}

impl Seen {
    /// Looks at the parts, each as its triangles, from afar. `turn` says how each triangle is turned.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(super) fn of(s: &Surface, parts: &[&[u32]], turn: &[Turn], ctx: &Context<'_>) -> Result<Self> {
        let all: usize = parts.iter().map(|part| part.len()).sum();
        let step = all.div_ceil(CONTOUR.seen_triangles).max(1);
        let mut squares: BTreeMap<(u32, u32), Vec<Piece>> = BTreeMap::new();
        for (k, part) in (0..).zip(parts) {
            for (i, &t) in part.iter().step_by(step).enumerate() {
                ctx.check_at(i)?;
                let triangle = &s.triangles[t as usize];
                let corners = corners(&s.positions, triangle);
                let area = area_vector(corners) * (0.5 * turn[t as usize].sign());
                let position = corners.into_iter().fold(Vec3::ZERO, |a, b| a + b) * (1.0 / 3.0);
                let piece =
                    Piece { position, normal: area.normalized(), side: (area.norm() * step as f64).sqrt() };
                squares.entry((k, s.chart[triangle[0] as usize])).or_default().push(piece);
            }
        }
        let all: Vec<&[Piece]> = squares.values().map(Vec::as_slice).collect();
        let mut large: Vec<usize> = (0..parts.len()).collect();
        large.sort_by_key(|&k| std::cmp::Reverse(parts[k].len()));
        large.truncate(CONTOUR.seen_parts);
        Ok(Self {
            views: Views::of(&all, ctx)?,
            pieces: (0..all.len() as u32).collect(),
            part: squares.keys().map(|key| key.0).collect(),
            large,
        })
    }

    /// How likely the sides of the parts are, in nats.
    fn likelihood(&self, signs: &[f64]) -> f64 {
        let of_piece: Vec<f64> = self.part.iter().map(|&k| signs[k as usize]).collect();
        ORIENT.seen * self.views.likelihood(&self.pieces, &of_piece)
    }

    /// Turns all parts, or single ones, as long as that is likelier: by what is seen, what was said of each
    /// part (`votes`), and how parts face each other (`relations`), in nats.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(super) fn turn(
        &self,
        votes: &[(u32, f64)],
        relations: &[Relation],
        signs: &mut [f64],
        ctx: &Context<'_>,
    ) -> Result<()> {
        // Both are differences: half of each for, half against.
        let likelihood = |signs: &[f64]| {
            let said: f64 = votes.iter().map(|&(k, v)| v * signs[k as usize]).sum();
            let related: f64 =
                relations.iter().map(|r| r.agreement * signs[r.a as usize] * signs[r.b as usize]).sum();
            0.5 * (said + related) + self.likelihood(signs)
        };
        let mut best = likelihood(signs);
        let one = self.large.iter().map(|&k| vec![k]).filter(|_| self.large.len() > 1);
        let sets: Vec<Vec<usize>> = std::iter::once((0..signs.len()).collect()).chain(one).collect();
        for _ in 0..CONTOUR.seen_rounds {
            let mut settled = true;
            for set in &sets {
                ctx.check()?;
                set.iter().for_each(|&k| signs[k] = -signs[k]);
                let turned = likelihood(signs);
                if turned > best {
                    (best, settled) = (turned, false);
                } else {
                    set.iter().for_each(|&k| signs[k] = -signs[k]);
                }
            }
            if settled {
                break;
            }
        }
        Ok(())
    }
}
