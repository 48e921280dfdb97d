//! What creases ask of a place beside them.
//!
//! In: creases, places with normals. Out: for each the likeliest crease about it, where on its sides the
//! place should be, and how much that is believed.

use super::chains::Creases;
use super::constants::CREASE;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::Neighbour;
use rayon::prelude::*;

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
}

/// What the likeliest crease about a place with this normal asks of it.
pub(super) fn pull(creases: &Creases, p: Vec3, normal: Vec3, near: &mut Vec<Neighbour>) -> Option<Pull> {
    creases.tree.within(p, creases.reach, near);
    // One crease after another: their sums.
    let mut sums: Vec<Pull> = Vec::new();
    for found in near.iter() {
        let piece = &creases.pieces[found.index as usize];
        let [x, y, z] = piece.local(p);
        let far2 = piece.far2(x, y);
        if far2 >= 1.0 {
            continue;
        }
        if !piece.has_side(normal, y) {
            continue;
        }
        let height = piece.model.height(x, y);
        if (z - height).abs() > CREASE.deepest {
            continue;
        }
        let weight = (1.0 - far2 * far2).powi(2);
        let one = Pull {
            chain: creases.chain[found.index as usize],
            weight,
            to: piece.place([x, y, height]) * weight,
            on_line: piece.on_line(y) * weight,
            across: (x - piece.model.line(y)) * piece.unit * weight,
            normal: piece.normal(x, y) * weight,
            ridge: piece.frame[2] * weight,
        };
        match sums.iter_mut().find(|s| s.chain == one.chain) {
            None => sums.push(one),
            Some(s) => {
                s.weight += one.weight;
                s.to += one.to;
                s.on_line += one.on_line;
                s.across += one.across;
                s.normal += one.normal;
                s.ridge += one.ridge;
            }
        }
    }
    let best = sums.into_iter().max_by(|a, b| a.weight.total_cmp(&b.weight).then(b.chain.cmp(&a.chain)))?;
    let part = 1.0 / best.weight;
    Some(Pull {
        chain: best.chain,
        weight: best.weight.min(1.0),
        to: best.to * part,
        on_line: best.on_line * part,
        across: best.across * part,
        normal: best.normal.normalized(),
        ridge: best.ridge.normalized(),
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
            .map_init(Vec::new, |near, (k, chunk)| {
                ctx.check()?;
                let own = chunk.into_iter().enumerate().filter_map(|(i, (p, n))| {
                    pull(creases, p, n, near).map(|pull| (k * CREASE.check + i, pull))
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
    /// The same, to be changed.
    pub fn of_mut(&mut self, place: u32) -> Option<&mut Pull> {
        self.all.get_mut(self.index[place as usize] as usize)
    }
    /// Says anew what is asked of a place that was asked something before.
    pub fn set(&mut self, place: u32, pull: Option<Pull>) {
        match (pull, self.of_mut(place)) {
            (Some(new), Some(old)) => *old = new,
            _ => self.index[place as usize] = u32::MAX,
        }
    }
    /// The places of which something is asked, ascending.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &Pull)> {
        self.index.iter().enumerate().filter_map(|(i, &k)| self.all.get(k as usize).map(|p| (i, p)))
    }
}
