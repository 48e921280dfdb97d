//! One sweep of edge collapses.
//!
//! In: a mesh, what its triangles stand for, what a collapse may cost. Out: the mesh with fewer triangles.

use super::constants::SIMPLIFY;
use super::quadric::Quadric;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::lists::Lists;
use crate::spatial::triangle::{area_vector, closest_on_triangle};

/// A mesh that is being simplified.
pub(super) struct Mesh<'a> {
    /// The first mesh's vertices.
    first: &'a [Vec3],
    /// Vertex positions.
    positions: Vec<Vec3>,
    /// Triangles.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The vertex of the first mesh that each came from.
    from: Vec<u32>,
    /// The planes that each vertex stands for.
    quadrics: Vec<Quadric>,
    /// The triangle that each vertex of the first mesh belongs to.
    owner: Vec<[u32; 1]>,
    /// Greatest distance of those.
    max_error: f64,
}

/// A simplified mesh.
pub(crate) struct Simplified {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
    /// For each vertex the one of the first mesh that it came from: the nearer one of each edge.
    pub from: Vec<u32>,
}

/// What a sweep knows of the mesh at its start.
struct Around {
    /// The triangles of each vertex.
    star: Lists,
    /// The vertices of the first mesh that belong to each triangle.
    points: Lists,
    /// Whether each vertex is on the boundary.
    rim: Vec<bool>,
    /// Whether a triangle of the vertex has changed in this sweep.
    changed: Vec<bool>,
}

/// Buffers of a sweep.
#[derive(Default)]
struct Scratch {
    ring: Vec<u32>,
    /// The triangles that stay, as they are to be.
    next: Vec<(u32, [u32; 3])>,
    moved: Vec<(u32, u32)>,
}

/// Triangles between two looks at the run: a collapse takes some microseconds.
const CHECK: usize = 512;

/// 1 for equal sides, 0 without area (Bhatia and Lawrence 1990).
fn shape(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let sides = a.dist2(b) + b.dist2(c) + c.dist2(a);
    2.0 * 3f64.sqrt() * area_vector(corners).norm() / sides.max(f64::MIN_POSITIVE)
}

impl<'a> Mesh<'a> {
    pub(super) fn new(
        positions: &'a [Vec3],
        triangles: &[[u32; 3]],
        max_error: f64,
        ctx: &Context<'_>,
    ) -> Result<Self> {
        let mut quadrics = vec![Quadric::default(); positions.len()];
        let mut owner = vec![[0]; positions.len()];
        let star = Lists::new(positions.len(), triangles, ctx)?;
        for (f, t) in triangles.iter().enumerate() {
            ctx.check_at(f)?;
            let corners = t.map(|v| positions[v as usize]);
            let n = area_vector(corners);
            let (area, normal) = (n.norm(), n.normalized());
            let plane = Quadric::of_plane(corners[0], normal.0, area);
            for k in 0..3 {
                let (a, b) = (t[k] as usize, t[(k + 1) % 3] as usize);
                owner[a] = [f as u32];
                quadrics[a] = quadrics[a] + plane;
                let faces =
                    star.of(t[k]).iter().filter(|&&g| triangles[g as usize].contains(&t[(k + 1) % 3]));
                if faces.count() == 1 {
                    // The plane on the boundary's edge, at a right angle to the triangle.
                    let along = positions[b] - positions[a];
                    let across = normal.cross(along).normalized();
                    let wall = Quadric::of_plane(positions[a], across.0, SIMPLIFY.rim * along.norm2());
                    quadrics[a] = quadrics[a] + wall;
                    quadrics[b] = quadrics[b] + wall;
                }
            }
        }
        Ok(Self {
            first: positions,
            positions: positions.to_vec(),
            triangles: triangles.to_vec(),
            from: (0..positions.len() as u32).collect(),
            quadrics,
            owner,
            max_error,
        })
    }

    /// Collapses edges that cost up to `most`, a length, until `surplus` triangles are gone.
    pub(super) fn sweep(&mut self, most: f64, surplus: usize, ctx: &Context<'_>) -> Result<()> {
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
                // Both triangles of an inner edge come by.
                let rim = around.rim[a as usize] && around.rim[b as usize];
                if gone < surplus && t[0] != t[1] && (a < b || rim) {
                    gone += self.collapse([a, b], most, &mut around, &mut scratch);
                }
            }
        }
        self.renumber();
        ctx.check()
    }

    /// Mean length of the triangles' sides.
    pub(super) fn mean_edge(&self) -> f64 {
        let sides = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| self.positions[v as usize]);
            (a - b).norm() + (b - c).norm() + (c - a).norm()
        };
        self.triangles.iter().map(sides).sum::<f64>() / (3 * self.triangles.len().max(1)) as f64
    }

    fn around(&self, ctx: &Context<'_>) -> Result<Around> {
        let star = Lists::new(self.positions.len(), &self.triangles, ctx)?;
        let points = Lists::new(self.triangles.len(), &self.owner, ctx)?;
        let mut rim = vec![false; self.positions.len()];
        for v in 0..self.positions.len() as u32 {
            ctx.check_at(v as usize)?;
            let others = star.of(v).iter().flat_map(|&f| self.triangles[f as usize]).filter(|&w| w != v);
            // Each neighbour within is a corner of two triangles.
            rim[v as usize] = others.clone().any(|w| others.clone().filter(|&x| x == w).count() == 1);
        }
        Ok(Around { star, points, rim, changed: vec![false; self.positions.len()] })
    }

    /// Collapses an edge if nothing speaks against it; returns how many triangles are gone.
    fn collapse(&mut self, [a, b]: [u32; 2], most: f64, around: &mut Around, scratch: &mut Scratch) -> usize {
        let [i, j] = [a as usize, b as usize];
        if around.changed[i] || around.changed[j] {
            return 0;
        }
        let quadric = self.quadrics[i] + self.quadrics[j];
        let [p, q] = [self.positions[i], self.positions[j]];
        let middle = (p + q) * 0.5;
        let to = match [around.rim[i], around.rim[j]] {
            [true, false] => p,
            [false, true] => q,
            // Along the surface the planes hardly decide: no vertex leaves its edge's neighbourhood.
            _ => Some(quadric.least(middle)).filter(|x| x.dist2(middle) <= p.dist2(q)).unwrap_or(middle),
        };
        if quadric.mean(to) > most * most {
            return 0;
        }
        let Some(gone) = self.after([a, b], to, around, scratch) else { return 0 };
        if !self.hand_over([a, b], to, around, scratch) {
            return 0;
        }
        let from = if to.dist2(p) <= to.dist2(q) { i } else { j };
        self.from[i] = self.from[from];
        self.positions[i] = to;
        self.quadrics[i] = quadric;
        for &f in around.star.of(a).iter().chain(around.star.of(b)) {
            self.triangles[f as usize] = [0; 3];
        }
        scratch.next.iter().for_each(|&(f, t)| self.triangles[f as usize] = t);
        scratch.moved.iter().for_each(|&(point, f)| self.owner[point as usize] = [f]);
        scratch.ring.iter().chain(&[a, b]).for_each(|&v| around.changed[v as usize] = true);
        gone
    }

    /// The triangles about an edge after its collapse, into `scratch`; returns how many go, or nothing where
    /// the surface would not be a surface, would fold, or its triangles would be needles.
    fn after(&self, [a, b]: [u32; 2], to: Vec3, around: &Around, scratch: &mut Scratch) -> Option<usize> {
        let Scratch { ring, next, .. } = scratch;
        ring.clear();
        next.clear();
        let (of_a, of_b) = (around.star.of(a), around.star.of(b));
        let shared = of_a.iter().filter(|&&f| self.triangles[f as usize].contains(&b)).count();
        let rim = [a, b].map(|v| around.rim[v as usize]);
        // An inner edge between two places of the boundary holds the surface together.
        if shared == 0 || shared > 2 || (rim == [true; 2]) != (shared == 1) {
            return None;
        }
        let neighbours = |of: &[u32], ring: &mut Vec<u32>| {
            let mut common = 0;
            let from = ring.len();
            for v in of.iter().flat_map(|&f| self.triangles[f as usize]).filter(|&v| v != a && v != b) {
                if ring[from..].contains(&v) {
                    continue;
                }
                common += usize::from(ring[..from].contains(&v));
                ring.push(v);
            }
            common
        };
        neighbours(of_a, ring);
        // The link condition (Dey et al. 1999).
        if neighbours(of_b, ring) != shared || ring.len() - shared > SIMPLIFY.valence {
            return None;
        }
        let (mut worst_before, mut worst) = (1.0f64, 1.0f64);
        for &f in of_a.iter().chain(of_b) {
            let t = self.triangles[f as usize];
            let before = t.map(|v| self.positions[v as usize]);
            worst_before = worst_before.min(shape(before));
            if t.contains(&a) && t.contains(&b) {
                continue;
            }
            let corner = |v: u32| if v == a || v == b { to } else { self.positions[v as usize] };
            let after = t.map(corner);
            let [m, n] = [before, after].map(area_vector);
            if m.dot(n) < SIMPLIFY.turn * m.norm() * n.norm() {
                return None;
            }
            worst = worst.min(shape(after));
            next.push((f, t.map(|v| if v == b { a } else { v })));
        }
        // At least three triangles stay about an inner vertex.
        let enough = next.len() >= if rim == [false; 2] { 3 } else { 1 };
        (enough && worst >= SIMPLIFY.shape.min(worst_before)).then_some(shared)
    }

    /// Hands the points of the edge's triangles over to those that stay, into `scratch`; false where one is
    /// too far from all of them.
    fn hand_over(&self, [a, b]: [u32; 2], to: Vec3, around: &Around, scratch: &mut Scratch) -> bool {
        let Scratch { next, moved, .. } = scratch;
        moved.clear();
        let most = self.max_error * self.max_error;
        let corners = |t: &[u32; 3]| t.map(|v| if v == a { to } else { self.positions[v as usize] });
        // Triangles with both ends stand in both stars.
        let of_b = around.star.of(b).iter().filter(|&&f| !self.triangles[f as usize].contains(&a));
        for &point in around.star.of(a).iter().chain(of_b).flat_map(|&f| around.points.of(f)) {
            let p = self.first[point as usize];
            let nearest = next
                .iter()
                .map(|(f, t)| (p.dist2(closest_on_triangle(p, &corners(t))), *f))
                .min_by(|x, y| x.0.total_cmp(&y.0));
            match nearest {
                Some((d, f)) if d <= most => moved.push((point, f)),
                _ => return false,
            }
        }
        true
    }

    /// Closes the gaps that triangles have left.
    fn renumber(&mut self) {
        let stays = |t: &[u32; 3]| t[0] != t[1];
        let mut count = 0;
        let next = |t| {
            count += u32::from(stays(t));
            count.wrapping_sub(1)
        };
        let number: Vec<u32> = self.triangles.iter().map(next).collect();
        self.triangles.retain(stays);
        self.owner.iter_mut().for_each(|o| o[0] = number[o[0] as usize]);
    }

    /// The mesh, without the vertices that are gone.
    pub(super) fn finished(self) -> Simplified {
        let mut number = vec![u32::MAX; self.positions.len()];
        self.triangles.iter().flatten().for_each(|&v| number[v as usize] = 0);
        let kept: Vec<usize> = (0..number.len()).filter(|&v| number[v] == 0).collect();
        (0..).zip(&kept).for_each(|(k, &v)| number[v] = k);
        Simplified {
            positions: kept.iter().map(|&v| self.positions[v]).collect(),
            triangles: self.triangles.iter().map(|t| t.map(|v| number[v as usize])).collect(),
            from: kept.iter().map(|&v| self.from[v]).collect(),
        }
    }
}
