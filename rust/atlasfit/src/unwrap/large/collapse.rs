//! Half-edge collapses on a surface with labelled patches.
//!
//! A vertex inside a patch may move to any neighbour, a vertex between two patches only along their border.

use super::constants::LARGE;
use super::patches::{Patches, simple};
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::prices::coarse_prices;
use crate::unwrap::surface::{NONE, Surface};

/// A surface of fewer faces.
pub(crate) struct Level {
    /// Its vertices keep the numbers that they have on the full surface.
    pub surface: Surface,
    /// Patch per face.
    pub label: Vec<u32>,
    /// Border path per half-edge slot; [`NONE`] inside patches.
    pub path: Vec<[u32; 3]>,
}

/// A surface in the course of being decimated.
pub(super) struct Mesh<'a> {
    pub s: &'a Surface,
    /// Vertices per face; [`NONE`] for faces that are gone.
    tri: Vec<[u32; 3]>,
    /// Twin and border path per half-edge slot.
    twin: Vec<[u32; 3]>,
    path: Vec<[u32; 3]>,
    /// A half-edge that starts at each movable vertex; [`NONE`] for fixed and removed ones.
    pub out: Vec<u32>,
}

impl<'a> Mesh<'a> {
    /// The full surface. Vertices are movable that have one closed fan and at most two runs of patches in it.
    pub(super) fn new(s: &'a Surface, patches: &Patches, ctx: &Context<'_>) -> Result<Self> {
        let n = s.pos.len();
        let mut mesh = Self {
            s,
            tri: s.tri.clone(),
            twin: s.twin.clone(),
            path: patches.path.clone(),
            out: vec![NONE; n],
        };
        let mut corners = vec![0u32; n];
        let mut first = vec![NONE; n];
        for f in (0..s.faces()).filter(|&f| s.usable[f]) {
            ctx.check_at(f)?;
            for k in 0..3 {
                let v = s.tri[f][k] as usize;
                corners[v] += 1;
                if first[v] == NONE {
                    first[v] = (3 * f + k) as u32;
                }
            }
        }
        let mut fan = Vec::new();
        for v in 0..n {
            ctx.check_at(v)?;
            if first[v] != NONE && simple(s, &patches.label, first[v] as usize / 3, first[v] as usize % 3) {
                mesh.fan(first[v], &mut fan);
                if fan.len() == corners[v] as usize {
                    mesh.out[v] = first[v];
                }
            }
        }
        Ok(mesh)
    }

    /// The faces that are left.
    pub(super) fn level(&self, label: &[u32], ctx: &Context<'_>) -> Result<Level> {
        let mut name = vec![NONE; self.tri.len()];
        let mut kept = Vec::new();
        for f in 0..self.tri.len() {
            if self.s.usable[f] && self.tri[f][0] != NONE {
                name[f] = kept.len() as u32;
                kept.push(f);
            }
        }
        let tri: Vec<[u32; 3]> = kept.iter().map(|&f| self.tri[f]).collect();
        let price = coarse_prices(self.s, &tri, ctx)?;
        let renamed = |h: u32| if h == NONE { NONE } else { 3 * name[h as usize / 3] + h % 3 };
        let twin = kept.iter().map(|&f| self.twin[f].map(renamed)).collect();
        Ok(Level {
            surface: Surface {
                price,
                page: self.s.page,
                ..Surface::from_parts(self.s.pos.clone(), tri, twin, ctx)?
            },
            label: kept.iter().map(|&f| label[f]).collect(),
            path: kept.iter().map(|&f| self.path[f]).collect(),
        })
    }

    /// Collects the half-edges that start at the vertex where `h` starts, in order.
    pub(super) fn fan(&self, h: u32, into: &mut Vec<u32>) {
        into.clear();
        let mut e = h;
        loop {
            into.push(e);
            // The edge before, seen from its other side, starts here too.
            let before = e / 3 * 3 + (e + 2 - e / 3 * 3) % 3;
            e = self.twin[before as usize / 3][before as usize % 3];
            if e == NONE || e == h || into.len() > LARGE.largest_fan {
                return;
            }
        }
    }
    /// The vertex where a half-edge ends.
    pub(super) fn end(&self, h: u32) -> u32 {
        self.tri[h as usize / 3][(h as usize % 3 + 1) % 3]
    }
    /// The border path of a half-edge.
    pub(super) fn path_of(&self, h: u32) -> u32 {
        self.path[h as usize / 3][h as usize % 3]
    }
}

/// Whether the start of `h` may move to its end: the surface stays a surface and no triangle turns over.
pub(super) fn may_collapse(mesh: &Mesh<'_>, h: u32, fan: &[u32]) -> bool {
    let back = mesh.twin[h as usize / 3][h as usize % 3];
    let u = mesh.tri[h as usize / 3][h as usize % 3];
    let v = mesh.end(h);
    if fan.len() < 4 || back == NONE {
        return false;
    }
    // The link of the edge must be its two opposite corners: no other neighbour of u may neighbour v.
    let apex = |h: u32| mesh.tri[h as usize / 3][(h as usize % 3 + 2) % 3];
    let (a, b) = (apex(h), apex(back));
    if a == b {
        return false;
    }
    // Round v over whatever is connected, both ways where it is open.
    for forward in [true, false] {
        let mut e = h / 3 * 3 + (h % 3 + 1) % 3;
        for _ in 0..LARGE.largest_fan {
            // e starts at v when turning forward.
            let other = mesh.end(e);
            if other != a && other != b && other != u && fan.iter().any(|&x| mesh.end(x) == other) {
                return false;
            }
            let step = if forward {
                let before = e / 3 * 3 + (e % 3 + 2) % 3;
                let start = mesh.tri[before as usize / 3][before as usize % 3];
                if start != a && start != b && start != u && fan.iter().any(|&x| mesh.end(x) == start) {
                    return false;
                }
                mesh.twin[before as usize / 3][before as usize % 3]
            } else {
                let m = mesh.twin[e as usize / 3][e as usize % 3];
                if m == NONE { NONE } else { m / 3 * 3 + (m % 3 + 1) % 3 }
            };
            if step == NONE || step == h / 3 * 3 + (h % 3 + 1) % 3 {
                break;
            }
            e = step;
        }
    }
    let q = mesh.s.pos[v as usize];
    fan.iter().all(|&e| {
        let t = mesh.tri[e as usize / 3];
        if t.contains(&v) {
            return true;
        }
        let k = e as usize % 3;
        let (p, x, y) = (
            mesh.s.pos[u as usize],
            mesh.s.pos[t[(k + 1) % 3] as usize],
            mesh.s.pos[t[(k + 2) % 3] as usize],
        );
        let old = (x - p).cross(y - p);
        let new = (x - q).cross(y - q);
        let longest = x.dist2(y).max(x.dist2(q)).max(y.dist2(q));
        // No sliver, and not turned far.
        new.norm() > LARGE.least_height * longest && old.dot(new) > LARGE.turn_cos * old.norm() * new.norm()
    })
}

/// Moves the start of `h` to its end; two faces vanish.
pub(super) fn collapse(mesh: &mut Mesh<'_>, h: u32, fan: &[u32]) {
    let u = mesh.tri[h as usize / 3][h as usize % 3];
    let v = mesh.end(h);
    for &e in fan {
        mesh.tri[e as usize / 3][e as usize % 3] = v;
    }
    let back = mesh.twin[h as usize / 3][h as usize % 3];
    for e in [h, back] {
        let f = e as usize / 3;
        let k = e as usize % 3;
        let (x, y) = ((k + 1) % 3, (k + 2) % 3);
        let (p, q) = (mesh.twin[f][x], mesh.twin[f][y]);
        let mut path = mesh.path[f][x].min(mesh.path[f][y]);
        for o in [p, q] {
            if o != NONE {
                path = path.min(mesh.path_of(o));
            }
        }
        for (o, other) in [(p, q), (q, p)] {
            if o != NONE {
                mesh.twin[o as usize / 3][o as usize % 3] = other;
                mesh.path[o as usize / 3][o as usize % 3] = path;
            }
        }
        // Faces that vanish must not be anyone's way in.
        let apex = mesh.tri[f][y] as usize;
        if mesh.out[apex] != NONE && mesh.out[apex] as usize / 3 == f {
            mesh.out[apex] =
                way_in(mesh, apex as u32, p).or_else(|| way_in(mesh, apex as u32, q)).unwrap_or(NONE);
        }
        mesh.tri[f] = [NONE; 3];
        mesh.twin[f] = [NONE; 3];
    }
    mesh.out[u as usize] = NONE;
    // What is left of the moved fan starts at v now: a sure way in.
    if mesh.out[v as usize] != NONE
        && let Some(&e) = fan.iter().find(|&&e| mesh.tri[e as usize / 3][0] != NONE)
    {
        mesh.out[v as usize] = e;
    }
}

/// A half-edge of `h`'s face that starts at `w`.
fn way_in(mesh: &Mesh<'_>, w: u32, h: u32) -> Option<u32> {
    if h == NONE {
        return None;
    }
    let f = h / 3;
    (0..3).find(|&k| mesh.tri[f as usize][k] == w).map(|k| 3 * f + k as u32)
}
