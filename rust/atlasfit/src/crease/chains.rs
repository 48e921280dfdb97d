//! Pieces that go on from each other: creases.
//!
//! In: pieces. Out: those that belong to a crease long enough, all of one turned alike.

use super::constants::CREASE;
use super::piece::Piece;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::{Aabb, Bvh};
use crate::spatial::lists::Lists;
use crate::spatial::sets::SignedSets;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Creases.
pub(super) struct Creases {
    /// Their pieces.
    pub pieces: Vec<Piece>,
    /// Which crease each belongs to.
    pub chain: Vec<u32>,
    /// Where each is believed, and a tree over that.
    pub bounds: Vec<Aabb>,
    pub tree: Bvh,
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
pub(super) fn chains(pieces: Vec<Piece>, ctx: &Context<'_>) -> Result<Option<Creases>> {
    let mut sets = SignedSets::new(pieces.len());
    let links = links(&pieces, ctx)?;
    links.iter().for_each(|&(a, b, turned)| sets.join(a, b, turned));
    // A crease that comes back turned has no sides: what closes it is left out.
    let mut odd = vec![false; pieces.len()];
    for &(a, b, turned) in &links {
        let (a_turned, b_turned) = (sets.find(a).1, sets.find(b).1);
        if a_turned ^ b_turned != turned {
            (odd[a as usize], odd[b as usize]) = (true, true);
        }
    }
    let own = (0..pieces.len() as u32).map(|k| [sets.find(k).0]).collect::<Vec<_>>();
    let of = Lists::new(pieces.len(), &own, ctx)?;
    let mut creases =
        Creases { pieces: Vec::new(), bounds: Vec::new(), chain: Vec::new(), tree: Bvh::default() };
    for (k, piece) in pieces.iter().enumerate() {
        ctx.check_at(k)?;
        let (chain, turned) = sets.find(k as u32);
        if chain as usize == k && !is_long(&pieces, of.of(chain)) {
            of.of(chain).iter().for_each(|&m| odd[m as usize] = true);
        }
        if !odd[k] {
            creases.pieces.push(if turned { piece.clone().turned() } else { piece.clone() });
            creases.chain.push(chain);
        }
    }
    creases.bounds = creases.pieces.iter().map(Piece::bounds).collect();
    creases.tree = Bvh::build(&creases.bounds, ctx)?;
    Ok(Some(creases).filter(|c| !c.pieces.is_empty()))
}

/// Pairs of pieces of which one goes on from the other, and whether it is turned.
fn links(pieces: &[Piece], ctx: &Context<'_>) -> Result<Vec<(u32, u32, bool)>> {
    let bounds: Vec<Aabb> = pieces.iter().map(Piece::bounds).collect();
    let tree = Bvh::build(&bounds, ctx)?;
    let found = pieces
        .par_iter()
        .enumerate()
        .map(|(b, piece)| {
            ctx.check()?;
            let mut own = Vec::new();
            let middle = piece.middle();
            let _: ControlFlow<()> = tree.meeting(&Aabb::of(&[middle]), |a| {
                let on = if a as usize == b { None } else { goes_on(&pieces[a as usize], piece) };
                own.extend(on.map(|turned| (a, b as u32, turned)));
                ControlFlow::Continue(())
            });
            Ok(own)
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(found.concat())
}

/// Whether the pieces reach farther than the first is believed.
fn is_long(pieces: &[Piece], own: &[u32]) -> bool {
    let Some(first) = own.first().map(|&k| &pieces[k as usize]) else { return false };
    let at = first.middle();
    let farthest = |from: Vec3| {
        own.iter()
            .map(|&k| pieces[k as usize].middle())
            .max_by(|a, b| a.dist2(from).total_cmp(&b.dist2(from)))
    };
    let Some(one) = farthest(at) else { return false };
    let other = farthest(one).unwrap_or(one);
    let longest = CREASE.longest_alone * first.longest() * first.unit;
    one.dist2(other) >= longest * longest
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::model::Model;
    use super::*;
    use crate::run::Run;

    /// A piece along an axis (0 or 1) of the plane z = 0, which is the ridge of a roof.
    pub fn piece(at: [f64; 3], axis: usize, reach: f64) -> Piece {
        let [x, y, z] = [0, 1, 2].map(|k| Vec3::from_fn(|i| f64::from(u8::from(i == k))));
        let frame = if axis == 1 { [x, y, z] } else { [-y, x, z] };
        Piece { at: Vec3(at), frame, unit: 1.0, across: 3.0, along: [reach; 2], model: Model::roof() }
    }

    pub fn creases(pieces: Vec<Piece>) -> Option<Creases> {
        Run::default().execute(|ctx| chains(pieces, ctx)).expect("nothing stops it")
    }

    #[test]
    fn pieces_are_one_crease_in_any_order_where_only_one_reaches_the_other() {
        let row = [piece([0.0; 3], 1, 1.5), piece([0.0, 2.0, 0.0], 1, 4.0), piece([0.0, 5.5, 0.0], 1, 1.5)];
        for order in [[0, 1, 2], [2, 0, 1], [2, 1, 0], [0, 2, 1]] {
            let found = creases(order.map(|k| row[k].clone()).to_vec()).expect("a crease");
            assert!(found.chain.len() == 3 && found.chain.iter().all(|&c| c == found.chain[0]), "{order:?}");
        }
    }

    #[test]
    fn a_crease_has_one_direction() {
        let row = (0..6).map(|k| piece([0.0, f64::from(k), 0.0], 1, 3.0));
        let mixed = row.enumerate().map(|(k, p)| if k % 2 == 0 { p } else { p.turned() });
        let found = creases(mixed.collect()).expect("a crease");
        assert!(found.pieces.iter().all(|p| p.frame[1][1] == found.pieces[0].frame[1][1]));
    }

    #[test]
    fn what_is_no_longer_than_a_piece_is_no_crease() {
        assert!(creases(vec![piece([0.0; 3], 1, 3.0), piece([0.0, 1.0, 0.0], 1, 3.0)]).is_none());
    }
}
