//! One sweep of edge collapses over a block.
//!
//! In: a block, what a collapse may cost. Out: the block with fewer triangles. A sweep takes edges only that
//! share no triangle, so that their order hardly matters.

use super::block::{Around, Block, plane, shape2};
use super::constants::SIMPLIFY;
use super::data::{Level, Role};
use super::hand_over::{Change, NewTriangle};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::quadric::Quadric;
use crate::spatial::triangle::area_vector;

/// Triangles between two looks at the run: a collapse takes some microseconds.
pub(super) const CHECK: usize = 512;

/// An edge that is to become one vertex.
struct Edge {
    ends: [u32; 2],
    to: Vec3,
    /// Whether each end is on the boundary.
    rim: [bool; 2],
    /// The UV there, if there are any.
    uv: Option<[f64; 2]>,
}

/// Buffers of a sweep.
#[derive(Default)]
pub(super) struct Scratch {
    pub(super) ring: Vec<u32>,
    /// The vertices that the last collapse has moved or taken away.
    pub(super) moved: Vec<u32>,
    pub(super) change: Change,
    /// Of the copies on the other side of a seam.
    pub(super) beyond: Change,
}

impl Block<'_> {
    /// Collapses edges until `surplus` triangles are gone; returns how many are.
    pub(super) fn sweep(&mut self, level: &Level, surplus: usize, ctx: &Context<'_>) -> Result<usize> {
        let mut around = self.around(ctx)?;
        let mut scratch = Scratch::default();
        let mut gone = 0;
        for f in 0..self.triangles.len() {
            if f.is_multiple_of(CHECK) {
                ctx.check()?;
            }
            for k in 0..3 {
                let t = self.triangles[f];
                let (a, b) = (t[k], t[(k + 1) % 3]);
                let [i, j] = [a as usize, b as usize];
                // Both triangles of an inner edge come by.
                let turn = a < b || (self.rim[i] && self.rim[j]);
                let can = self.free[i] && self.free[j] && (self.active[i] || self.active[j]);
                if turn && can && gone < surplus && t[0] != t[1] {
                    gone += self.collapse([a, b], level, &mut around, &mut scratch);
                }
            }
        }
        self.renumber();
        for (v, changed) in around.changed.iter().enumerate() {
            self.active[v] = *changed;
            self.open[v] |= *changed;
        }
        ctx.check()?;
        Ok(gone)
    }

    /// Collapses an edge if nothing speaks against it; returns how many triangles are gone.
    pub(super) fn collapse(
        &mut self,
        ends: [u32; 2],
        level: &Level,
        around: &mut Around,
        scratch: &mut Scratch,
    ) -> usize {
        if ends.iter().any(|&v| around.stale[v as usize]) {
            return 0;
        }
        let stays = ends.map(|v| self.role[v as usize] != Role::Free);
        if stays == [true; 2] {
            return self.collapse_seam(ends, level, around, scratch);
        }
        // What stays is the first.
        let ends = if stays[1] { [ends[1], ends[0]] } else { ends };
        let stays = stays[0] || stays[1];
        let [a, b] = ends;
        let [i, j] = ends.map(|v| v as usize);
        let [p, q] = [self.positions[i], self.positions[j]];
        let length2 = p.dist2(q);
        let longest = self.longest(a).min(self.longest(b));
        if length2 > (level.length * longest).powi(2) {
            return 0;
        }
        let rim = ends.map(|v| self.rim[v as usize]);
        let quadric = self.quadrics[i] + self.quadrics[j];
        let to = self.place_of(ends, stays, &quadric);
        let most = level.error * self.error(a).min(self.error(b));
        if quadric.mean(to) > most * most {
            return 0;
        }
        let gone = self.collapse_to(to, ends, [stays, false], around, scratch);
        if gone > 0 {
            // Without memory within the surface; a boundary's planes stand on edges that are gone.
            self.quadrics[i] = match rim {
                [false, false] if self.ranked => {
                    let corners = scratch.change.new.iter().map(|n| n.corners);
                    corners.fold(Quadric::default(), |sum, c| sum + plane(c))
                }
                _ => quadric,
            };
        }
        gone
    }

    /// Collapses an edge to a place if the surface stays one, near enough and well shaped; returns how many
    /// triangles are gone. The first end `stays` where it is, or none does. Who is `wary` asks this of the
    /// middles of the triangles too.
    pub(super) fn collapse_to(
        &mut self,
        to: Vec3,
        ends: [u32; 2],
        [stays, wary]: [bool; 2],
        around: &mut Around,
        scratch: &mut Scratch,
    ) -> usize {
        let [a, b] = ends;
        let [i, j] = ends.map(|v| v as usize);
        let [p, q] = [self.positions[i], self.positions[j]];
        let longest = self.longest(a).min(self.longest(b));
        let rim = ends.map(|v| self.rim[v as usize]);
        let uv = if stays { self.uv.get(i).copied() } else { self.uv_at(to, ends, around) };
        let edge = Edge { ends, to, rim, uv };
        let Some(gone) = self.after(&edge, longest, around, scratch) else { return 0 };
        if !self.fits(&mut scratch.change, to) || (wary && !self.middles_fit(&scratch.change)) {
            return 0;
        }
        self.make(&scratch.change);
        around.star.put(a, scratch.change.new.iter().map(|n| n.triangle));
        around.star.put(b, std::iter::empty());
        scratch.moved.clear();
        scratch.moved.extend(ends);
        let share = ((to - p).dot(q - p) / p.dist2(q).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let near = if share <= 0.5 { i } else { j };
        let [m, n] = [self.normals[i], self.normals[j]];
        // Over a crease there is no normal between.
        let smooth = m.dot(n) >= SIMPLIFY.smooth;
        self.normals[i] =
            if smooth { (m * (1.0 - share) + n * share).normalized() } else { self.normals[near] };
        self.from[i] = self.source(to, ends, scratch.change.nearest);
        self.rim[i] |= self.rim[j];
        self.positions[i] = to;
        if let Some(uv) = edge.uv {
            self.uv[i] = uv;
        }
        scratch.ring.iter().chain(&ends).for_each(|&v| around.changed[v as usize] = true);
        self.spoil(scratch.ring.iter().chain(&ends), around);
        gone
    }

    /// The vertex of the first mesh nearest to a place, of those known there: those of an edge's ends, and
    /// that of a point. The nearer end's alone would drift away over many collapses.
    fn source(&self, place: Vec3, ends: [u32; 2], point: Option<u32>) -> u32 {
        let of_ends = ends.map(|v| self.from[v as usize]);
        let of_point = point.map(|n| self.first.points.vertex[n as usize]);
        let far = |v: u32| self.first.dense.positions[v as usize].dist2(place);
        let all = of_ends.into_iter().chain(of_point);
        all.min_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap_or(of_ends[0])
    }

    /// Where an edge's vertex is to be, by the planes about both ends; the first of them where it stays.
    pub(super) fn place_of(&self, ends: [u32; 2], stays: bool, planes: &Quadric) -> Vec3 {
        let [i, j] = [ends[0] as usize, ends[1] as usize];
        let (p, q) = (self.positions[i], self.positions[j]);
        let middle = (p + q) * 0.5;
        match [self.rim[i], self.rim[j]] {
            _ if stays => p,
            [true, false] => p,
            [false, true] => q,
            // Along the surface the planes hardly decide: no vertex leaves its edge's neighbourhood.
            _ => Some(planes.least(middle, SIMPLIFY.middle))
                .filter(|x| x.dist2(middle) <= p.dist2(q))
                .unwrap_or(middle),
        }
    }

    /// Marks the vertices whose edges wait for the next sweep: all whose triangles have changed; none where
    /// the cheapest edges come first.
    pub(super) fn spoil<'v>(&self, changed: impl Iterator<Item = &'v u32>, around: &mut Around) {
        if !self.ranked {
            changed.for_each(|&v| around.stale[v as usize] = true);
        }
    }

    /// The triangles about an edge after its collapse, into `scratch`; returns how many go, or nothing where
    /// the surface would not be a surface, would fold, or its triangles would be needles.
    fn after(&self, edge: &Edge, longest: f64, around: &Around, scratch: &mut Scratch) -> Option<usize> {
        let Scratch { ring, change, .. } = scratch;
        change.clear();
        let ([a, b], to) = (edge.ends, edge.to);
        let (of_a, of_b) = (self.star(a, around), self.star(b, around));
        let shared = self.link(edge, around, ring)?;
        let dist2 = |v: u32, from: Vec3| self.positions[v as usize].dist2(from);
        let [p, q] = edge.ends.map(|v| self.positions[v as usize]);
        let farthest = ring.iter().map(|&v| dist2(v, to)).fold(0.0, f64::max);
        if farthest > longest * longest && ring.iter().all(|&v| dist2(v, p).min(dist2(v, q)) < farthest) {
            return None;
        }
        let least = SIMPLIFY.shape * SIMPLIFY.shape;
        let (mut worst_before, mut worst) = (least, least);
        for (f, again) in of_a.map(|f| (f, false)).chain(of_b.map(|f| (f, true))) {
            let t = self.triangles[f as usize];
            let (has_a, has_b) = (t.contains(&a), t.contains(&b));
            // Triangles with both ends stand in both stars.
            if has_a && has_b && again {
                continue;
            }
            change.old.push(f);
            let before = self.corners(&t);
            let m = area_vector(before);
            if has_a && has_b {
                worst_before = worst_before.min(shape2(&before, m));
                continue;
            }
            let corner = |v: u32| if v == a || v == b { to } else { self.positions[v as usize] };
            let corners = [corner(t[0]), corner(t[1]), corner(t[2])];
            let n = area_vector(corners);
            let cosine = m.dot(n);
            if cosine <= 0.0 || cosine * cosine < SIMPLIFY.turn * SIMPLIFY.turn * m.norm2() * n.norm2() {
                return None;
            }
            let after = shape2(&corners, n);
            if after < least {
                worst_before = worst_before.min(shape2(&before, m));
                worst = worst.min(after);
            }
            if !self.keeps_side(t, |v| if v == a || v == b { edge.uv } else { None }) {
                return None;
            }
            let vertex = |v: u32| if v == b { a } else { v };
            let vertices = [vertex(t[0]), vertex(t[1]), vertex(t[2])];
            change.new.push(NewTriangle { triangle: f, vertices, corners });
        }
        // At least three triangles stay about an inner vertex.
        let enough = change.new.len() >= if edge.rim == [false; 2] { 3 } else { 1 };
        (enough && (worst >= least || worst >= SIMPLIFY.worse.powi(2) * worst_before)).then_some(shared)
    }

    /// The vertices about an edge, into `ring`; returns how many triangles the edge has, or nothing where the
    /// surface would not be a surface without it.
    fn link(&self, edge: &Edge, around: &Around, ring: &mut Vec<u32>) -> Option<usize> {
        ring.clear();
        let ([a, b], rim) = (edge.ends, edge.rim);
        let shared = self.star(a, around).filter(|&f| self.triangles[f as usize].contains(&b)).count();
        // An inner edge between two places of the boundary holds the surface together.
        if shared == 0 || shared > 2 || (rim == [true; 2]) != (shared == 1) {
            return None;
        }
        let mut common = 0;
        for (end, of_b) in [(a, false), (b, true)] {
            let from = ring.len();
            for f in self.star(end, around) {
                for v in self.triangles[f as usize] {
                    if v == a || v == b || ring[from..].contains(&v) {
                        continue;
                    }
                    common += usize::from(of_b && ring[..from].iter().any(|&w| self.same_place(v, w)));
                    ring.push(v);
                }
            }
        }
        // The link condition (Dey et al. 1999).
        (common == shared && ring.len() - shared <= SIMPLIFY.valence).then_some(shared)
    }
}
