//! Triangles of a block with more equal sides, as many as there were.
//!
//! In: a block. Out: the same with edges flipped and vertices moved along the surface where that makes the
//! worst triangle better; within the error, and over creases only to mend a bad triangle.

use super::block::{Around, Block, is_bad, shape2};
use super::collapse::CHECK;
use super::constants::SIMPLIFY;
use super::hand_over::{Change, NewTriangle};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::triangle::area_vector;

impl Block<'_> {
    /// Flips edges.
    pub(super) fn flip(&mut self, ctx: &Context<'_>) -> Result<()> {
        let mut around = self.around(ctx)?;
        let mut change = Change::default();
        for f in 0..self.triangles.len() {
            if f.is_multiple_of(CHECK) {
                ctx.check()?;
            }
            for k in 0..3 {
                let t = self.triangles[f];
                let [a, b, c] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
                let can = a < b && t.iter().any(|&v| self.active[v as usize]);
                if can && !t.iter().any(|&v| around.changed[v as usize]) {
                    self.flip_edge(f as u32, [a, b, c], &mut around, &mut change);
                }
            }
        }
        for (v, changed) in around.changed.iter().enumerate() {
            self.active[v] |= *changed;
            self.open[v] |= *changed;
        }
        ctx.check()
    }

    /// Flips the edge from a to b of the triangle f if that is better.
    fn flip_edge(&mut self, f: u32, [a, b, c]: [u32; 3], around: &mut Around, change: &mut Change) {
        let holds = |g: &&u32| **g != f && self.triangles[**g as usize].contains(&b);
        let mut across = around.star.of(a).iter().filter(holds);
        let (Some(&g), None) = (across.next(), across.next()) else { return };
        let t = self.triangles[g as usize];
        // Its triangles run along it in opposite directions, unless the surface is one-sided there.
        let Some(k) = (0..3).find(|&k| t[k] == b && t[(k + 1) % 3] == a) else { return };
        let d = t[(k + 2) % 3];
        if around.changed[d as usize] || c == d {
            return;
        }
        let old = [self.corners(&[a, b, c]), self.corners(&t)];
        let new = [[c, a, d], [d, b, c]];
        let corners = new.map(|t| self.corners(&t));
        let shape2 = |t: &[Vec3; 3]| shape2(t, area_vector(*t));
        let worst = |t: &[[Vec3; 3]; 2]| shape2(&t[0]).min(shape2(&t[1]));
        let (before, after) = (worst(&old), worst(&corners));
        if after <= before * SIMPLIFY.better {
            return;
        }
        let [m, n] = old.map(|t| area_vector(t).normalized());
        let mean = (m + n).normalized();
        let flat = |t: &[Vec3; 3]| area_vector(*t).normalized().dot(mean) >= SIMPLIFY.smooth;
        let [p, q, r, s] = [a, b, c, d].map(|v| self.positions[v as usize]);
        if r.dist2(s) > p.dist2(q).max(self.longest(c).min(self.longest(d)).powi(2)) {
            return;
        }
        let smooth = m.dot(n) >= SIMPLIFY.smooth && corners.iter().all(flat);
        // A bad triangle at a crease or a bend may go where the surface is no less smooth without it.
        let [x, y] = corners.map(|t| area_vector(t).normalized());
        let flatter = self.mends && is_bad(before) && x.dot(y) >= m.dot(n).max(0.0);
        if !(smooth || flatter) || !self.may_link([a, b], [c, d], around) {
            return;
        }
        if !self.flip_keeps_sides([[a, b, c], t], new) {
            return;
        }
        change.clear();
        change.old.extend([f, g]);
        for (triangle, (vertices, corners)) in [f, g].into_iter().zip(new.into_iter().zip(corners)) {
            change.new.push(NewTriangle { triangle, vertices, corners });
        }
        if self.fits(change, (r + s) * 0.5) {
            self.make(change);
            [a, b, c, d].iter().for_each(|&v| around.changed[v as usize] = true);
        }
    }

    /// Whether the edge between `ends` may become one between two others.
    fn may_link(&self, ends: [u32; 2], [c, d]: [u32; 2], around: &Around) -> bool {
        let many = |v: &u32| around.star.of(*v).len();
        let rim = |v: &u32| self.free[*v as usize] && self.rim[*v as usize];
        // At least three triangles stay about an inner vertex.
        if ends.iter().any(|v| many(v) < if rim(v) { 2 } else { 4 }) {
            return false;
        }
        // All edges of a free vertex are known.
        let (from, to) = if self.free[c as usize] { (c, d) } else { (d, c) };
        let linked = around.star.of(from).iter().any(|&h| self.triangles[h as usize].contains(&to));
        self.free[from as usize] && !linked && [c, d].iter().all(|v| many(v) < SIMPLIFY.valence)
    }

    /// Moves vertices along the surface.
    pub(super) fn smooth(&mut self, ctx: &Context<'_>) -> Result<()> {
        let around = self.around(ctx)?;
        let mut change = Change::default();
        for v in 0..self.positions.len() as u32 {
            if (v as usize).is_multiple_of(CHECK) {
                ctx.check()?;
            }
            let i = v as usize;
            if self.free[i] && self.active[i] && !self.rim[i] {
                self.move_along(v, &around, &mut change);
            }
        }
        ctx.check()
    }

    /// Moves a vertex towards the middle of its triangles if that is better.
    fn move_along(&mut self, v: u32, around: &Around, change: &mut Change) {
        let i = v as usize;
        let of = around.star.of(v);
        let (mut worst, mut area, mut middle, mut normal) = (1.0f64, 0.0, Vec3::ZERO, Vec3::ZERO);
        for &f in of {
            let corners = self.corners(&self.triangles[f as usize]);
            let n = area_vector(corners);
            worst = worst.min(shape2(&corners, n));
            area += n.norm();
            middle += (corners[0] + corners[1] + corners[2]) * (n.norm() / 3.0);
            normal += n;
        }
        if worst >= SIMPLIFY.well * SIMPLIFY.well || area <= 0.0 {
            return;
        }
        let normal = normal.normalized();
        let Some(near) = self.near(of, middle * (1.0 / area)) else { return };
        let to = near.place;
        let uv = self.uv_at(to, [v, v], around);
        change.clear();
        let longest = self.longest(v);
        let smooth = if self.mends && is_bad(worst) { SIMPLIFY.bent } else { SIMPLIFY.smooth };
        let mut after = 1.0f64;
        for &f in of {
            let vertices = self.triangles[f as usize];
            let before = area_vector(self.corners(&vertices));
            let corners = vertices.map(|w| if w == v { to } else { self.positions[w as usize] });
            let n = area_vector(corners);
            let flat = |m: Vec3| m.normalized().dot(normal) >= smooth;
            if !self.keeps_side(vertices, |w| if w == v { uv } else { None }) {
                return;
            }
            let far = |w: &u32| self.positions[*w as usize].dist2(to) > longest * longest;
            if !flat(before) || !flat(n) || vertices.iter().any(|w| *w != v && far(w)) {
                return;
            }
            after = after.min(shape2(&corners, n));
            change.old.push(f);
            change.new.push(NewTriangle { triangle: f, vertices, corners });
        }
        if after <= worst * SIMPLIFY.better || !self.fits(change, to) {
            return;
        }
        self.make(change);
        self.positions[i] = to;
        if let Some(uv) = uv {
            self.uv[i] = uv;
        }
        self.normals[i] = if near.normal.dot(self.normals[i]) < 0.0 { -near.normal } else { near.normal };
        self.from[i] = near.vertex;
    }

    /// The place on the first mesh next to another, by the points of some triangles; nothing where they have
    /// none.
    fn near(&self, triangles: &[u32], place: Vec3) -> Option<Near> {
        let places = self.first.points;
        let points = || triangles.iter().flat_map(|&f| self.points_of(f)).map(|x| x.1);
        let dist2 = |point: u32| places.positions[point as usize].dist2(place);
        let point = points().min_by(|&x, &y| dist2(x).total_cmp(&dist2(y)))?;
        let n = places.normals[point as usize];
        // Next to a vertex that vertex decides.
        let [a, b, _] = self.corners(&self.triangles[triangles[0] as usize]);
        let soft = (0.1 * dist2(point)).max(SIMPLIFY.at_vertex * a.dist2(b)) + f64::MIN_POSITIVE.sqrt();
        let mut normal = Vec3::ZERO;
        for other in points() {
            let m = places.normals[other as usize];
            // Nothing from beyond a crease.
            if m.dot(n) >= SIMPLIFY.smooth {
                normal += m * (1.0 / (dist2(other) + soft)).powi(2);
            }
        }
        let place = place - n * n.dot(place - places.positions[point as usize]);
        Some(Near { vertex: places.vertex[point as usize], place, normal: normal.normalized() })
    }
}

/// A place on the first mesh.
struct Near {
    /// A vertex of the first mesh at the nearest point.
    vertex: u32,
    place: Vec3,
    normal: Vec3,
}
