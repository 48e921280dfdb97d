//! What creases ask of a place beside them.
//!
//! In: creases, places with normals. Out: for each the likeliest crease about it, where on its sides the
//! place should be, and how much that is believed.

use super::chains::Creases;
use super::constants::CREASE;
use super::piece::Piece;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::Aabb;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// What a crease asks of a place beside it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pull {
    /// The crease.
    pub chain: u32,
    /// How much it is believed, in (0, 1].
    pub weight: f64,
    /// Where the place should be.
    pub to: Vec3,
    /// And where on the crease if it is to be on it.
    pub on_line: Vec3,
    /// Signed distance across the crease.
    pub across: f64,
    /// Unit normal of the side.
    pub normal: Vec3,
    /// Unit normal on the crease: halfway between the sides.
    pub ridge: Vec3,
    /// Unit normals of the sides where they meet: of that of negative `across`, and of the other.
    pub sides: [Vec3; 2],
    /// Spacing of the points.
    pub unit: f64,
}

impl Pull {
    /// Whether the place is on the crease.
    pub fn is_on_line(&self) -> bool {
        self.across == 0.0
    }
    /// Where a place and its unit normal go.
    pub fn moved(&self, p: Vec3, normal: Vec3) -> (Vec3, Vec3) {
        let (to, facing) =
            if self.is_on_line() { (self.on_line, self.ridge) } else { (self.to, self.normal) };
        let mixed = |from: Vec3, to: Vec3| from * (1.0 - self.weight) + to * self.weight;
        (mixed(p, to), mixed(normal, facing).normalized())
    }
}

/// What a piece asks of a place with this unit normal; vectors are multiplied with how much it is believed.
fn of_piece(piece: &Piece, chain: u32, p: Vec3, normal: Vec3) -> Option<Pull> {
    let [x, y, z] = piece.local(p);
    let far2 = piece.far2(x, y);
    if far2 >= 1.0 {
        return None;
    }
    let height = piece.model.height(x, y);
    if (z - height).abs() > CREASE.deepest {
        return None;
    }
    let sides = piece.sides(y);
    let ridge = (sides[0] + sides[1]).normalized();
    if sides.iter().chain([&ridge]).all(|n| n.dot(normal) <= CREASE.same_side) {
        return None;
    }
    let weight = (1.0 - far2 * far2).powi(2);
    Some(Pull {
        chain,
        weight,
        to: piece.place([x, y, height]) * weight,
        on_line: piece.on_line(y) * weight,
        across: (x - piece.model.line(y)) * piece.unit * weight,
        normal: piece.normal(x, y) * weight,
        ridge: ridge * weight,
        sides: sides.map(|n| n * weight),
        unit: piece.unit * weight,
    })
}

/// The creases that may be believed at a place.
pub(super) fn about(creases: &Creases, p: Vec3) -> Vec<u32> {
    let mut found = Vec::new();
    let _: ControlFlow<()> = creases.tree.meeting(&Aabb::of(&[p]), |k| {
        if creases.bounds[k as usize].distance2(p) == 0.0 && !found.contains(&creases.chain[k as usize]) {
            found.push(creases.chain[k as usize]);
        }
        ControlFlow::Continue(())
    });
    found
}

/// What the likeliest crease about a place with this unit normal asks of it, or one crease that is `asked`:
/// the mean of its pieces, believed as much as the one that is believed most.
pub(super) fn pull(creases: &Creases, p: Vec3, normal: Vec3, asked: Option<u32>) -> Option<Pull> {
    let mut means: Vec<(f64, Pull)> = Vec::new();
    let _: ControlFlow<()> = creases.tree.meeting(&Aabb::of(&[p]), |k| {
        let (piece, chain) = (&creases.pieces[k as usize], creases.chain[k as usize]);
        let wanted = asked.is_none_or(|asked| asked == chain);
        let inside = wanted && creases.bounds[k as usize].distance2(p) == 0.0;
        let Some(one) = inside.then(|| of_piece(piece, chain, p, normal)).flatten() else {
            return ControlFlow::Continue(());
        };
        match means.iter_mut().find(|(_, m)| m.chain == chain) {
            None => means.push((one.weight, one)),
            Some((total, m)) => {
                *total += one.weight;
                m.weight = m.weight.max(one.weight);
                m.to += one.to;
                m.on_line += one.on_line;
                m.across += one.across;
                m.normal += one.normal;
                m.ridge += one.ridge;
                m.sides = [0, 1].map(|i| m.sides[i] + one.sides[i]);
                m.unit += one.unit;
            }
        }
        ControlFlow::Continue(())
    });
    let likelier = |a: &Pull, b: &Pull| a.weight.total_cmp(&b.weight).then(b.chain.cmp(&a.chain));
    let &(total, best) = means.iter().max_by(|a, b| likelier(&a.1, &b.1))?;
    let part = 1.0 / total;
    // Other creases of the same side say where it is, too.
    let side = best.normal.normalized();
    let alike = means.iter().filter(|(_, m)| m.normal.normalized().dot(side) > CREASE.parallel);
    let (believed, to) = alike.fold((0.0, Vec3::ZERO), |(w, to), (own, m)| (w + own, to + m.to));
    Some(Pull {
        chain: best.chain,
        weight: best.weight,
        to: to * (1.0 / believed),
        on_line: best.on_line * part,
        across: best.across * part,
        normal: best.normal.normalized(),
        ridge: best.ridge.normalized(),
        sides: best.sides.map(Vec3::normalized),
        unit: best.unit * part,
    })
}

/// What creases ask of many places, most of which lie beside none.
pub(super) struct Pulls {
    /// Where a place's is in `all`; `u32::MAX` where no crease is near.
    index: Vec<u32>,
    all: Vec<Pull>,
}

impl Pulls {
    /// Asks for every place, which has a normal.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub fn new(
        creases: &Creases,
        places: impl IndexedParallelIterator<Item = (Vec3, Vec3)>,
        ctx: &Context<'_>,
    ) -> Result<Self> {
        let mut index = ctx.filled(u32::MAX, places.len())?;
        let found = places
            .chunks(CREASE.check)
            .enumerate()
            .map(|(k, chunk)| {
                ctx.check()?;
                let own = chunk.into_iter().enumerate().filter_map(|(i, (p, n))| {
                    pull(creases, p, n, None).map(|pull| (k * CREASE.check + i, pull))
                });
                Ok(own.collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>>>()?;
        let mut all = Vec::new();
        for (i, pull) in found.into_iter().flatten() {
            index[i] = all.len() as u32;
            all.push(pull);
        }
        Ok(Self { index, all })
    }
    /// What is asked of a place.
    pub fn of(&self, place: u32) -> Option<&Pull> {
        self.all.get(self.index[place as usize] as usize)
    }
    /// Says anew what is asked of a place.
    pub fn set(&mut self, place: u32, pull: Option<Pull>) {
        let index = &mut self.index[place as usize];
        match (pull, self.all.get_mut(*index as usize)) {
            (Some(new), Some(old)) => *old = new,
            (Some(new), None) => {
                *index = self.all.len() as u32;
                self.all.push(new);
            }
            (None, _) => *index = u32::MAX,
        }
    }
    /// The places of which something is asked, ascending.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &Pull)> {
        self.index.iter().enumerate().filter_map(|(i, &k)| self.all.get(k as usize).map(|p| (i, p)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::chains::tests::{creases, piece};
    use super::*;

    #[test]
    fn beside_a_corner_a_place_is_asked_by_the_crease_that_it_is_cut_along() {
        // Two ridges that cross at a right angle.
        let row = |axis: usize| {
            (-2..=2).map(move |k| {
                let along = 2.0 * f64::from(k);
                piece(if axis == 1 { [0.0, along, 0.0] } else { [along, 0.0, 0.0] }, axis, 3.0)
            })
        };
        let both = creases(row(1).chain(row(0)).collect()).expect("creases");
        let [one, other] = [both.chain[0], both.chain[5]];
        assert!(one != other);
        let up = Vec3([0.0, 0.0, 1.0]);
        let p = Vec3([0.3, 0.2, -0.2]);
        let asked = |chain| pull(&both, p, up, Some(chain)).expect("a crease").on_line;
        assert!((asked(one) - Vec3([0.0, 0.2, 0.0])).norm() < 1e-12, "{:?}", asked(one));
        assert!((asked(other) - Vec3([0.3, 0.0, 0.0])).norm() < 1e-12, "{:?}", asked(other));
    }

    #[test]
    fn a_place_goes_onto_its_side_and_far_off_it_stays() {
        let ridge = creases((0..6).map(|k| piece([0.0, f64::from(k), 0.0], 1, 3.0)).collect());
        let ridge = ridge.expect("a crease");
        let side = Vec3([1.0, 0.0, 1.0]).normalized();
        let asked = pull(&ridge, Vec3([0.5, 2.5, -0.8]), side, None).expect("a crease");
        assert!((asked.to - Vec3([0.5, 2.5, -0.5])).norm() < 1e-12 && asked.weight > 0.9, "{asked:?}");
        assert!((asked.normal - side).norm() < 1e-12 && (asked.across - 0.5).abs() < 1e-12, "{asked:?}");
        // Another sheet, one that faces away, and beyond the reach.
        assert!(pull(&ridge, Vec3([0.5, 2.5, -2.5]), side, None).is_none());
        assert!(pull(&ridge, Vec3([0.5, 2.5, -0.8]), -side, None).is_none());
        assert!(pull(&ridge, Vec3([3.5, 2.5, -3.5]), side, None).is_none());
    }
}
