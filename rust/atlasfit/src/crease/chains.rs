//! Pieces that go on from each other: creases.
//!
//! In: pieces. Out: those that belong to a crease long enough, all of one turned alike.

use super::constants::CREASE;
use super::piece::Piece;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;

/// Creases.
pub(super) struct Creases {
    /// Their pieces.
    pub pieces: Vec<Piece>,
    /// Which crease each belongs to.
    pub chain: Vec<u32>,
    /// Search tree over the pieces' middles.
    pub tree: Neighbours,
    /// How far the farthest reaches.
    pub reach: f64,
}

/// Whether one piece goes on from another, and whether it must be turned for that.
fn goes_on(a: &Piece, b: &Piece) -> Option<bool> {
    let along = a.direction().dot(b.direction());
    let [x, y, z] = a.local(b.middle());
    let on = a.far2(x, y) <= 1.0
        && (x - a.model.line(y)).abs() < CREASE.aligned
        && (z - a.model.height(a.model.line(y), y)).abs() < CREASE.aligned
        && a.frame[2].dot(b.frame[2]) > CREASE.parallel
        && along.abs() > CREASE.parallel;
    on.then_some(along < 0.0)
}

/// Joins the pieces to creases; none where no crease is long enough.
pub(super) fn chains(mut pieces: Vec<Piece>, ctx: &Context<'_>) -> Result<Option<Creases>> {
    if pieces.is_empty() {
        return Ok(None);
    }
    let middles: Vec<Vec3> = pieces.iter().map(Piece::middle).collect();
    let tree = Neighbours::build(&middles, ctx)?;
    let n = pieces.len();
    let (mut chain, mut near, mut queue) = (vec![u32::MAX; n], Vec::new(), Vec::new());
    let mut keeps = Vec::new();
    for first in 0..n {
        if chain[first] != u32::MAX {
            continue;
        }
        let name = keeps.len() as u32;
        chain[first] = name;
        queue.clear();
        queue.push(first);
        let mut next = 0;
        while let Some(&a) = queue.get(next) {
            ctx.check_at(next)?;
            next += 1;
            tree.within(middles[a], pieces[a].radius(), &mut near);
            for b in near.iter().map(|f| f.index as usize) {
                if chain[b] != u32::MAX {
                    continue;
                }
                if let Some(turn) = goes_on(&pieces[a], &pieces[b]) {
                    if turn {
                        pieces[b] = pieces[b].clone().turned();
                    }
                    chain[b] = name;
                    queue.push(b);
                }
            }
        }
        keeps.push(is_long(&pieces, &queue));
    }
    let mut chains = chain.iter();
    pieces.retain(|_| chains.next().is_some_and(|&c| keeps[c as usize]));
    chain.retain(|&c| keeps[c as usize]);
    let middles: Vec<Vec3> = pieces.iter().map(Piece::middle).collect();
    if pieces.is_empty() {
        return Ok(None);
    }
    let reach = pieces.iter().map(Piece::radius).fold(0.0, f64::max);
    Ok(Some(Creases { tree: Neighbours::build(&middles, ctx)?, pieces, chain, reach }))
}

/// Whether the pieces reach farther than the window of the first.
fn is_long(pieces: &[Piece], own: &[usize]) -> bool {
    let Some(&first) = own.first() else { return false };
    let at = pieces[first].middle();
    let farthest = |from: Vec3| {
        own.iter().map(|&k| pieces[k].middle()).max_by(|a, b| a.dist2(from).total_cmp(&b.dist2(from)))
    };
    let Some(one) = farthest(at) else { return false };
    let other = farthest(one).unwrap_or(one);
    let longest = CREASE.longest_alone * pieces[first].longest() * pieces[first].unit;
    one.dist2(other) >= longest * longest
}
