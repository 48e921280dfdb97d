//! Edges on seams: both copies of an end go to both copies of the other, so that no gap opens.
//!
//! In: a block, an edge whose ends both lie on seams. Out: the block without one of them, where nothing
//! speaks against it.

use super::block::{Around, Block, shape2};
use super::collapse::Scratch;
use super::constants::SIMPLIFY;
use super::data::{Level, Role};
use super::hand_over::{Change, NewTriangle};
use crate::spatial::triangle::area_vector;

/// A vertex that goes, and the one it goes to.
#[derive(Clone, Copy)]
struct Pair {
    gone: u32,
    stays: u32,
}

impl Block<'_> {
    /// Takes one end of an edge of a seam away; returns how many triangles are gone.
    pub(super) fn collapse_seam(
        &mut self,
        ends: [u32; 2],
        level: &Level,
        around: &mut Around,
        scratch: &mut Scratch,
    ) -> usize {
        for [gone, stays] in [ends, [ends[1], ends[0]]] {
            let Some(pairs) = self.across(Pair { gone, stays }, around) else { continue };
            if !self.may_go(&pairs, level, around) {
                continue;
            }
            let Scratch { change, beyond, moved, ring } = scratch;
            let ready = self.without(pairs[0], around, change) && self.without(pairs[1], around, beyond);
            let place = self.positions[stays as usize];
            if !ready || !self.fits(change, place) || !self.fits(beyond, place) {
                continue;
            }
            let old = change.old.iter().chain(&beyond.old).flat_map(|f| self.triangles[*f as usize]);
            let old: Vec<u32> = old.collect();
            old.iter().for_each(|&v| around.changed[v as usize] = true);
            let ends = pairs.map(|p| [p.gone, p.stays]);
            self.spoil(old.iter().chain(ends.as_flattened()), around);
            self.make(change);
            self.make(beyond);
            moved.clear();
            moved.extend(ends.as_flattened());
            for (p, change) in pairs.iter().zip([change, beyond]) {
                ring.clear();
                ring.extend(self.star(p.stays, around).chain(change.new.iter().map(|n| n.triangle)));
                around.star.put(p.stays, ring.drain(..));
                around.star.put(p.gone, std::iter::empty());
                let planes = self.quadrics[p.gone as usize];
                self.quadrics[p.stays as usize] = self.quadrics[p.stays as usize] + planes;
                around.changed[p.stays as usize] = true;
            }
            return 2;
        }
        0
    }

    /// The edge and its copy on the other side of the seam; nothing where it is no edge of a seam, or its end
    /// cannot go.
    fn across(&self, pair: Pair, around: &Around) -> Option<[Pair; 2]> {
        let Role::Seam(copy) = self.role[pair.gone as usize] else { return None };
        let meets = |f: u32| {
            let t = self.triangles[f as usize];
            t.into_iter().find(|&v| v != copy && self.same_place(v, pair.stays))
        };
        let mut others = self.star(copy, around).filter_map(meets);
        // On the boundary there is one triangle.
        let (Some(stays), None) = (others.next(), others.next()) else { return None };
        Some([pair, Pair { gone: copy, stays }])
    }

    /// Whether all that changes is here and has not changed, the surface stays a surface, and near enough.
    fn may_go(&self, pairs: &[Pair; 2], level: &Level, around: &Around) -> bool {
        let all = pairs.iter().flat_map(|p| [p.gone, p.stays]);
        if all.clone().any(|v| !self.free[v as usize] || around.stale[v as usize]) {
            return false;
        }
        let near = |p: &Pair| {
            let planes = self.quadrics[p.gone as usize] + self.quadrics[p.stays as usize];
            let most = level.error * self.error(p.gone).min(self.error(p.stays));
            planes.mean(self.positions[p.stays as usize]) <= most * most
        };
        pairs.iter().all(near) && self.seam_link(pairs, around)
    }

    /// The link condition (Dey et al. 1999) of the edge that both copies are: only the two corners opposite
    /// to it neighbour both of its ends.
    fn seam_link(&self, pairs: &[Pair; 2], around: &Around) -> bool {
        // Every copy of the end that stays must be here. Those of a corner are looked for.
        let stays = pairs[0].stays;
        let mut copies = vec![stays];
        match self.role[stays as usize] {
            Role::Seam(copy) => copies.push(copy),
            Role::Corner(n) => {
                copies = (0..self.place.len() as u32).filter(|&v| self.same_place(v, stays)).collect();
                if copies.len() != n as usize {
                    return false;
                }
            }
            Role::Free | Role::Pinned => return false,
        }
        if copies.iter().any(|&v| around.stale[v as usize]) {
            return false;
        }
        let places = |of: &mut dyn Iterator<Item = u32>| {
            let mut all: Vec<u32> = of
                .flat_map(|v| self.star(v, around).flat_map(|f| self.triangles[f as usize]))
                .map(|v| self.place[v as usize])
                .collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        let of_gone = places(&mut pairs.iter().map(|p| p.gone));
        let of_stays = places(&mut copies.into_iter());
        // The ends themselves, and two corners.
        let common = of_gone.iter().filter(|p| of_stays.binary_search(p).is_ok()).count();
        common == 4 && of_gone.len() + of_stays.len() - 4 <= SIMPLIFY.valence + 4
    }

    /// The triangles of a vertex once it has gone, into `change`; false where they would fold, turn over in
    /// UV space or be needles.
    fn without(&self, p: Pair, around: &Around, change: &mut Change) -> bool {
        change.clear();
        let least = SIMPLIFY.shape * SIMPLIFY.shape;
        let (mut worst_before, mut worst) = (least, least);
        let [at, uv] = [p.stays as usize; 2];
        let (to, uv) = (self.positions[at], self.uv.get(uv).copied());
        for f in self.star(p.gone, around) {
            let t = self.triangles[f as usize];
            change.old.push(f);
            let before = self.corners(&t);
            let m = area_vector(before);
            worst_before = worst_before.min(shape2(&before, m));
            if t.contains(&p.stays) {
                continue;
            }
            let corners = t.map(|v| if v == p.gone { to } else { self.positions[v as usize] });
            let n = area_vector(corners);
            let cosine = m.dot(n);
            let turned = cosine * cosine < SIMPLIFY.turn * SIMPLIFY.turn * m.norm2() * n.norm2();
            if cosine <= 0.0 || turned || !self.keeps_side(t, |v| if v == p.gone { uv } else { None }) {
                return false;
            }
            worst = worst.min(shape2(&corners, n));
            let vertices = t.map(|v| if v == p.gone { p.stays } else { v });
            change.new.push(NewTriangle { triangle: f, vertices, corners });
        }
        let shaped = worst >= least || worst >= SIMPLIFY.worse.powi(2) * worst_before;
        change.old.len() == change.new.len() + 1 && !change.new.is_empty() && shaped
    }
}
