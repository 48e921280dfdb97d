//! The whole mesh, cut into blocks of a grid and put together again.
//!
//! In: a mesh. Out: the same after its blocks were worked on.

use super::block::{Block, Done, plane};
use super::constants::SIMPLIFY;
use super::costs::Costs;
use super::data::{First, Mesh, Piece, Place, Seams, Simplified, Spot, Whole, Work};
use crate::error::Result;
use crate::run::Context;
use crate::spatial::lists::Lists;
use crate::spatial::quadric::Quadric;
use rayon::prelude::*;

/// Cells of the grid along each axis, as bits of their number.
const BITS: u32 = 21;
/// Blocks for each thread that are worked on before they are put back: what they hold is there twice.
const BATCH: usize = 8;

impl Mesh {
    pub(super) fn new(first: &First<'_>, ctx: &Context<'_>) -> Result<Self> {
        Ok(Self {
            positions: first.dense.positions.to_vec(),
            normals: first.dense.normals.to_vec(),
            uv: first.dense.seams.map(|s| s.uv.clone()).unwrap_or_default(),
            from: (0..first.dense.positions.len() as u32).collect(),
            open: ctx.filled(true, first.dense.positions.len())?,
            triangles: first.dense.triangles.to_vec(),
            owner: first.points.owner.clone(),
            side: 0.0,
        })
    }

    /// Mean length of the triangles' sides.
    pub(super) fn mean_edge(&self) -> f64 {
        let sides = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| self.positions[v as usize]);
            (a - b).norm() + (b - c).norm() + (c - a).norm()
        };
        self.triangles.iter().map(sides).sum::<f64>() / (3 * self.triangles.len().max(1)) as f64
    }

    /// What edges cost, without regard to boundaries: of one for each triangle.
    pub(super) fn costs(&self, first: &First<'_>, ctx: &Context<'_>) -> Result<Costs> {
        let mut planes = ctx.filled(Quadric::default(), self.positions.len())?;
        for (i, t) in self.triangles.iter().enumerate() {
            ctx.check_at(i)?;
            let plane = plane(t.map(|v| self.positions[v as usize]));
            t.iter().for_each(|&v| planes[v as usize] = planes[v as usize] + plane);
        }
        let mut costs = Costs::default();
        for (i, t) in self.triangles.iter().enumerate() {
            ctx.check_at(i)?;
            // In turn, so that no direction is preferred.
            let [a, b] = [t[i % 3] as usize, t[(i + 1) % 3] as usize];
            let planes = planes[a] + planes[b];
            let middle = (self.positions[a] + self.positions[b]) * 0.5;
            let error = |v: usize| f64::from(first.goal.error[self.from[v] as usize]);
            let most = error(a).min(error(b));
            costs.count(planes.mean(planes.least(middle, SIMPLIFY.middle)) / (most * most));
        }
        Ok(costs)
    }

    /// Works on all blocks once; every other round on a grid that is shifted by half a cell. Gives what edges
    /// cost, if they were ranked.
    pub(super) fn round(
        &mut self,
        first: &First<'_>,
        work: &Work<'_>,
        round: usize,
        ctx: &Context<'_>,
    ) -> Result<Costs> {
        let odd = round % 2 == 1;
        // The second of two rounds is on the grid of the first, shifted: no seam is where one was.
        if !odd {
            self.side = SIMPLIFY.block * self.mean_edge();
        }
        let places = self.places(if odd { 0.5 } else { 0.0 }, ctx)?;
        let blocks: Vec<&[Place]> = places.chunk_by(|x, y| x.cell == y.cell).collect();
        let mut at = ctx.filled(Spot::default(), self.triangles.len())?;
        for (block, places) in blocks.iter().enumerate() {
            ctx.check_at(block)?;
            for (local, place) in places.iter().enumerate() {
                at[place.triangle as usize] = Spot { block: block as u32, local: local as u32 };
            }
        }
        let block_of: Vec<[u32; 1]> = self.owner.iter().map(|o| [at[o[0] as usize].block]).collect();
        let points = Lists::new(blocks.len(), &block_of, ctx)?;
        drop(block_of);
        let mut valence = ctx.filled(0u32, self.positions.len())?;
        self.triangles.iter().flatten().for_each(|&v| valence[v as usize] += 1);
        let surplus = shares(&blocks, work.surplus);
        let mut numbers = vec![Vec::new(); ctx.threads()];
        let mut triangles = Vec::with_capacity(self.triangles.len());
        let mut costs = Costs::default();
        for start in (0..blocks.len()).step_by(BATCH * ctx.threads()) {
            let batch = start..(start + BATCH * ctx.threads()).min(blocks.len());
            let ids: Vec<usize> = batch.collect();
            let whole = Whole { mesh: self, valence: &valence, at: &at };
            let make = |&b: &usize, number: &mut Vec<u32>| {
                let piece = Piece { places: blocks[b], points: points.of(b as u32) };
                let mut block = Block::new(first, &whole, &piece, number);
                block.work(work, surplus[b], ctx)?;
                Ok(block.done())
            };
            let each = ids.len().div_ceil(numbers.len());
            let done: Vec<Result<Vec<Done>>> = (ids.par_chunks(each))
                .zip(numbers.par_iter_mut())
                .map(|(ids, number)| {
                    number.resize(valence.len(), u32::MAX);
                    ids.iter().map(|b| make(b, number)).collect()
                })
                .collect();
            for block in done.into_iter().collect::<Result<Vec<_>>>()?.into_iter().flatten() {
                costs.add(&block.costs);
                self.put_back(block, &mut triangles);
            }
        }
        self.triangles = triangles;
        ctx.check()?;
        Ok(costs)
    }

    /// The triangles by the cells that they are in, of a grid that is `shift` of a cell off.
    fn places(&self, shift: f64, ctx: &Context<'_>) -> Result<Vec<Place>> {
        let side = self.side;
        let one = |x: f64| {
            ((x / side + shift).floor() + f64::from(1 << (BITS - 1))).clamp(0.0, f64::from((1 << BITS) - 1))
                as u64
        };
        let place = |(i, t): (usize, &[u32; 3])| {
            let [a, b, c] = t.map(|v| self.positions[v as usize]);
            let cell = ((a + b + c) * (1.0 / 3.0)).0.iter().fold(0, |cell, &x| cell << BITS | one(x));
            Place { cell, triangle: i as u32 }
        };
        let mut places: Vec<Place> = self.triangles.par_iter().enumerate().map(place).collect();
        ctx.check()?;
        places.par_sort_unstable();
        ctx.check()?;
        Ok(places)
    }

    /// Takes over what was done in a block; its triangles come after the others.
    fn put_back(&mut self, done: Done, triangles: &mut Vec<[u32; 3]>) {
        let Done { vertices, owned, triangles: new, .. } = done;
        for v in vertices {
            let i = v.vertex as usize;
            (self.positions[i], self.normals[i], self.from[i], self.open[i]) =
                (v.position, v.normal, v.from, v.open);
            if let Some(uv) = self.uv.get_mut(i) {
                *uv = v.uv;
            }
        }
        let start = triangles.len() as u32;
        owned.iter().for_each(|o| self.owner[o.point as usize] = [start + o.triangle]);
        triangles.extend(new);
    }

    /// The mesh, without the vertices that are gone.
    pub(super) fn finished(self, seams: Option<&Seams>) -> Simplified {
        let mut number = vec![u32::MAX; self.positions.len()];
        self.triangles.iter().flatten().for_each(|&v| number[v as usize] = 0);
        let kept: Vec<usize> = (0..number.len()).filter(|&v| number[v] == 0).collect();
        (0..).zip(&kept).for_each(|(k, &v)| number[v] = k);
        Simplified {
            positions: kept.iter().map(|&v| self.positions[v]).collect(),
            normals: kept.iter().map(|&v| self.normals[v]).collect(),
            triangles: self.triangles.iter().map(|t| t.map(|v| number[v as usize])).collect(),
            from: kept.iter().map(|&v| self.from[v]).collect(),
            uv: if self.uv.is_empty() { Vec::new() } else { kept.iter().map(|&v| self.uv[v]).collect() },
            place: seams.map_or(Vec::new(), |s| kept.iter().map(|&v| s.place[v]).collect()),
        }
    }
}

/// Each block's part of the triangles that may go: by its triangles, in pairs, as collapses take them.
fn shares(blocks: &[&[Place]], surplus: Option<usize>) -> Vec<usize> {
    let Some(surplus) = surplus else { return vec![usize::MAX; blocks.len()] };
    let all = blocks.iter().map(|b| b.len()).sum::<usize>().max(1) as f64;
    let pairs = |triangles: usize| (0.5 * surplus as f64 * triangles as f64 / all).ceil() as usize;
    let mut before = 0;
    let share = |b: &&[Place]| {
        let from = pairs(before);
        before += b.len();
        2 * (pairs(before) - from)
    };
    blocks.iter().map(share).collect()
}
