//! A block of a mesh, with numbers of its own.
//!
//! In: triangles of the whole mesh. Out: what has become of them. Vertices that triangles of other blocks
//! share stay as they are.

use super::constants::SIMPLIFY;
use super::costs::Costs;
use super::data::{First, Level, Piece, Role, Whole, Work};
use super::stars::Stars;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::quadric::Quadric;
use crate::spatial::triangle::area_vector;

/// The end of a list of points.
const END: u32 = u32::MAX;

/// A block that is being worked on.
pub(super) struct Block<'a> {
    pub(super) first: &'a First<'a>,
    /// The number of each vertex in the whole mesh.
    vertices: Vec<u32>,
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    pub(super) from: Vec<u32>,
    /// UVs, if there are any.
    pub(super) uv: Vec<[f64; 2]>,
    /// The place of each vertex: copies have the same.
    pub(super) place: Vec<u32>,
    /// How each vertex may move; copies are counted within the block.
    pub(super) role: Vec<Role>,
    /// Whether all triangles of a vertex are here.
    pub(super) free: Vec<bool>,
    /// Whether each free vertex is on the boundary.
    pub(super) rim: Vec<bool>,
    /// Whether something may be left to do about each vertex.
    pub(super) open: Vec<bool>,
    /// Which vertices the next sweep looks at.
    pub(super) active: Vec<bool>,
    /// The planes that each vertex stands for.
    pub(super) quadrics: Vec<Quadric>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// The points of each triangle: the first one's place in `points`, and from each the next.
    pub(super) head: Vec<u32>,
    pub(super) next: Vec<u32>,
    /// The points of the first mesh that belong to the triangles.
    pub(super) points: Vec<u32>,
    /// Share of the error within which these stay.
    pub(super) share: f64,
    /// Whether the cheapest edges come first.
    pub(super) ranked: bool,
    /// Whether bad triangles are mended as far as the error allows, not only where the surface is smooth.
    pub(super) mends: bool,
    /// What edges cost, if they are ranked.
    pub(super) costs: Costs,
}

/// What has become of a vertex.
pub(super) struct Moved {
    pub(super) vertex: u32,
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    pub(super) from: u32,
    pub(super) open: bool,
    pub(super) uv: [f64; 2],
}

/// The triangle, counted within the block, that a point belongs to.
pub(super) struct Owned {
    pub(super) point: u32,
    pub(super) triangle: u32,
}

/// What has become of a block.
pub(super) struct Done {
    pub(super) vertices: Vec<Moved>,
    pub(super) owned: Vec<Owned>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) costs: Costs,
}

/// What a sweep knows of the block besides.
pub(super) struct Around {
    /// The triangles of each vertex.
    pub(super) star: Stars,
    /// Whether a triangle of the vertex has changed in this sweep.
    pub(super) changed: Vec<bool>,
    /// Whether the edges of the vertex wait for the next sweep.
    pub(super) stale: Vec<bool>,
}

/// The square of a triangle's shape: 1 for equal sides, 0 without area (Bhatia and Lawrence 1990). Takes
/// twice its area as a vector.
#[inline]
pub(super) fn shape2([a, b, c]: &[Vec3; 3], area: Vec3) -> f64 {
    let sides = a.dist2(*b) + b.dist2(*c) + c.dist2(*a);
    12.0 * area.norm2() / (sides * sides).max(f64::MIN_POSITIVE)
}

/// Whether a triangle with this square of its shape is to be mended.
#[inline]
pub(super) fn is_bad(shape2: f64) -> bool {
    shape2 < SIMPLIFY.shape.powi(2)
}

/// The plane of a triangle, by its area.
#[inline]
pub(super) fn plane(corners: [Vec3; 3]) -> Quadric {
    let n = area_vector(corners);
    Quadric::of_plane(corners[0], n.normalized().0, n.norm())
}

/// Which of so many vertices are on the boundary: each neighbour of one within is a corner of two triangles
/// about it, so that marks of all corners cancel out.
fn on_boundary(vertices: usize, triangles: &[[u32; 3]]) -> Vec<bool> {
    // Steele, Lea and Flood 2014: no sum of a few marks is 0 by chance.
    let mark = |v: u32| {
        let x = (u64::from(v) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    let mut sum = vec![0; vertices];
    for t in triangles {
        let [a, b, c] = t.map(mark);
        for (v, others) in t.iter().zip([b ^ c, c ^ a, a ^ b]) {
            sum[*v as usize] ^= others;
        }
    }
    sum.iter().map(|s| *s != 0).collect()
}

impl<'a> Block<'a> {
    /// Cuts a block out. `number` has an entry for each vertex of the whole mesh, `u32::MAX` before and
    /// after.
    pub(super) fn new(
        first: &'a First<'a>,
        whole: &Whole<'_>,
        piece: &Piece<'_>,
        number: &mut [u32],
    ) -> Self {
        let mesh = whole.mesh;
        let mut vertices: Vec<u32> = Vec::new();
        let mut count: Vec<u32> = Vec::new();
        let mut local = |v: u32| {
            let n = &mut number[v as usize];
            if *n == u32::MAX {
                *n = vertices.len() as u32;
                vertices.push(v);
                count.push(0);
            }
            count[*n as usize] += 1;
            *n
        };
        let triangles: Vec<[u32; 3]> =
            piece.places.iter().map(|p| mesh.triangles[p.triangle as usize].map(&mut local)).collect();
        let (place, role) = match first.dense.seams {
            Some(s) => (
                vertices.iter().map(|&v| s.place[v as usize]).collect(),
                vertices.iter().map(|&v| s.role[v as usize].within(number)).collect(),
            ),
            None => ((0..vertices.len() as u32).collect(), vec![Role::Free; vertices.len()]),
        };
        vertices.iter().for_each(|&v| number[v as usize] = u32::MAX);
        let mut head = vec![END; triangles.len()];
        let mut next = Vec::with_capacity(piece.points.len());
        for (k, &p) in piece.points.iter().enumerate() {
            let of = &mut head[whole.at[mesh.owner[p as usize][0] as usize].local as usize];
            next.push(std::mem::replace(of, k as u32));
        }
        let rim = on_boundary(vertices.len(), &triangles);
        let of = |v: &u32| *v as usize;
        let open: Vec<bool> = vertices.iter().map(|v| mesh.open[of(v)]).collect();
        Self {
            first,
            positions: vertices.iter().map(|v| mesh.positions[of(v)]).collect(),
            normals: vertices.iter().map(|v| mesh.normals[of(v)]).collect(),
            from: vertices.iter().map(|v| mesh.from[of(v)]).collect(),
            uv: vertices.iter().filter_map(|v| mesh.uv.get(of(v)).copied()).collect(),
            free: (vertices.iter().zip(&count).zip(&role))
                .map(|((v, &n), role)| n == whole.valence[of(v)] && *role != Role::Pinned)
                .collect(),
            place,
            role,
            rim,
            active: open.clone(),
            open,
            quadrics: Vec::new(),
            vertices,
            triangles,
            head,
            next,
            share: 1.0,
            ranked: false,
            mends: false,
            costs: Costs::default(),
            points: piece.points.to_vec(),
        }
    }

    /// Does what is to be done.
    pub(super) fn work(&mut self, work: &Work<'_>, surplus: usize, ctx: &Context<'_>) -> Result<()> {
        if !self.open.contains(&true) {
            return Ok(());
        }
        let mut surplus = surplus;
        self.share = work.share;
        self.ranked = work.surplus.is_some();
        // Where a number of triangles was asked for, none may go for its shape, and what they may move is
        // spent already: mending costs up to a tenth more error there.
        self.mends = work.shape && !work.levels.is_empty();
        if !work.levels.is_empty() {
            self.gather_planes(ctx)?;
        }
        for level in work.levels {
            if self.ranked {
                self.cheapest(level, &mut surplus, ctx)?;
            } else {
                self.collapse_at(level, &mut surplus, ctx)?;
            }
        }
        self.quadrics = Vec::new();
        for _ in 0..if work.shape { SIMPLIFY.shapings } else { 0 } {
            if self.mends {
                self.mend(ctx)?;
            }
            self.active.copy_from_slice(&self.open);
            self.flip(ctx)?;
            self.smooth(ctx)?;
        }
        // Free vertices are done with.
        self.open.iter_mut().zip(&self.free).for_each(|(open, free)| *open &= !free);
        Ok(())
    }

    /// Collapses edges of one level.
    fn collapse_at(&mut self, level: &Level, surplus: &mut usize, ctx: &Context<'_>) -> Result<()> {
        self.active.copy_from_slice(&self.open);
        for _ in 0..SIMPLIFY.sweeps {
            let before = self.triangles.len();
            let gone = self.sweep(level, *surplus, ctx)?;
            *surplus -= gone.min(*surplus);
            if (gone as f64) < SIMPLIFY.few * before as f64 {
                break;
            }
        }
        Ok(())
    }

    /// The planes about each vertex.
    fn gather_planes(&mut self, ctx: &Context<'_>) -> Result<()> {
        let around = self.around(ctx)?;
        self.quadrics = vec![Quadric::default(); self.positions.len()];
        for t in &self.triangles {
            let corners = self.corners(t);
            let plane = plane(corners);
            for k in 0..3 {
                let (a, b) = (t[k] as usize, t[(k + 1) % 3] as usize);
                self.quadrics[a] = self.quadrics[a] + plane;
                let rim = self.rim[a] && self.rim[b];
                let holds_b = |f: &&u32| self.triangles[**f as usize].contains(&t[(k + 1) % 3]);
                if rim && around.star.of(t[k]).iter().filter(holds_b).count() == 1 {
                    // The plane on the boundary's edge, at a right angle to the triangle.
                    let along = self.positions[b] - self.positions[a];
                    let across = area_vector(corners).cross(along).normalized();
                    let wall = Quadric::of_plane(self.positions[a], across.0, SIMPLIFY.rim * along.norm2());
                    self.quadrics[a] = self.quadrics[a] + wall;
                    self.quadrics[b] = self.quadrics[b] + wall;
                }
            }
        }
        Ok(())
    }

    /// What a sweep starts with.
    pub(super) fn around(&self, ctx: &Context<'_>) -> Result<Around> {
        let star = Stars::new(self.positions.len(), &self.triangles, ctx)?;
        let none = vec![false; self.positions.len()];
        Ok(Around { star, changed: none.clone(), stale: none })
    }

    /// The triangles of a vertex, without those that are gone.
    #[inline]
    pub(super) fn star<'s>(&'s self, v: u32, around: &'s Around) -> impl Iterator<Item = u32> + Clone {
        around.star.of(v).iter().copied().filter(|&f| {
            let t = self.triangles[f as usize];
            t[0] != t[1]
        })
    }

    #[inline]
    pub(super) fn corners(&self, t: &[u32; 3]) -> [Vec3; 3] {
        // Written out: `map` is not always inlined.
        [self.positions[t[0] as usize], self.positions[t[1] as usize], self.positions[t[2] as usize]]
    }

    /// Greatest length of edges about a vertex.
    #[inline]
    pub(super) fn longest(&self, v: u32) -> f64 {
        f64::from(self.first.goal.longest[self.from[v as usize] as usize])
    }

    /// How far the surface may move about a vertex.
    #[inline]
    pub(super) fn error(&self, v: u32) -> f64 {
        f64::from(self.first.goal.error[self.from[v as usize] as usize])
    }

    /// Closes the gaps that triangles have left: those with equal corners.
    pub(super) fn renumber(&mut self) {
        let stays = |t: &[u32; 3]| t[0] != t[1];
        let mut kept = self.triangles.iter();
        self.head.retain(|_| kept.next().is_some_and(stays));
        self.triangles.retain(stays);
    }

    /// What has become of the block.
    pub(super) fn done(self) -> Done {
        let mut owned = Vec::with_capacity(self.points.len());
        for (triangle, &head) in (0..).zip(&self.head) {
            let mut k = head;
            while k != END {
                owned.push(Owned { point: self.points[k as usize], triangle });
                k = self.next[k as usize];
            }
        }
        let mut used = vec![false; self.vertices.len()];
        self.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        let vertices = (0..used.len()).filter(|&v| used[v] && self.free[v]);
        Done {
            vertices: vertices
                .map(|v| Moved {
                    vertex: self.vertices[v],
                    position: self.positions[v],
                    normal: self.normals[v],
                    from: self.from[v],
                    open: self.open[v],
                    uv: self.uv.get(v).copied().unwrap_or_default(),
                })
                .collect(),
            owned,
            triangles: self.triangles.iter().map(|t| t.map(|v| self.vertices[v as usize])).collect(),
            costs: self.costs,
        }
    }
}
