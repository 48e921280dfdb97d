//! A coarse stand-in for a large surface, on which charts are merged cheaply.
//!
//! In: a surface and its patches. Out: surfaces with ever fewer faces and the same patches, whose patch borders run
//! through the same junctions; and the way back. Half-edge collapses, shortest edges first, where a vertex inside a
//! patch moves to any neighbour and a vertex between two patches only along their border (after Hoppe 1996; no
//! quadrics: patches are nearly flat, and even triangles serve the flattening best). On the way from the full surface
//! to the last one a few are kept: a flattening that is taken back level by level has its large features right before
//! the small ones come (a cascade, after Bornemann and Deuflhard 1996).

use super::refine::Patches;
use super::surface::{NONE, Surface};
use crate::error::Result;
use crate::run::Context;

/// Coarse triangles per patch at least, so that its shape survives.
const PER_PATCH: f64 = 40.0;
/// Factor between the length bounds of successive sweeps.
const GROWTH: f64 = 1.5;
/// Faces of a level per face of the next coarser one, at least: pins are then two to three edges apart.
const THINNING: usize = 6;

/// A surface of fewer faces.
pub(super) struct Level {
    /// Its vertices keep the numbers that they have on the full surface.
    pub surface: Surface,
    /// Patch per face.
    pub label: Vec<u32>,
    /// Border path per half-edge slot; [`NONE`] inside patches.
    pub path: Vec<[u32; 3]>,
}

/// The coarse surfaces and how they came about.
pub(super) struct Coarse {
    /// From fine to coarse; at least one.
    pub levels: Vec<Level>,
    /// The vertex that each vertex was moved to; itself where it never was.
    parent: Vec<u32>,
    /// The first level that is without the vertex.
    gone: Vec<u8>,
}

impl Coarse {
    /// The level on which charts are merged.
    pub(super) fn last(&self) -> &Level {
        &self.levels[self.levels.len() - 1]
    }

    /// The vertex of a level that a vertex of a finer one ended up in.
    pub(super) fn home(&self, mut v: u32, level: usize) -> u32 {
        while usize::from(self.gone[v as usize]) <= level {
            v = self.parent[v as usize];
        }
        v
    }
}

/// Names the paths of edges between patches: runs of border edges between the same two patches. Returns a path per
/// half-edge slot and the number of paths.
pub(super) fn border_paths(s: &Surface, label: &[u32]) -> (Vec<[u32; 3]>, usize) {
    let m = s.faces();
    let mut path = vec![[NONE; 3]; m];
    let mut count = 0;
    let border = |f: usize, k: usize| {
        let h = s.twin[f][k];
        h != NONE && label[h as usize / 3] != label[f]
    };
    for f in 0..m {
        for k in 0..3 {
            if label[f] == NONE || !border(f, k) || path[f][k] != NONE {
                continue;
            }
            for forward in [true, false] {
                let (mut g, mut c) = (f, k);
                loop {
                    let h = s.twin[g][c] as usize;
                    path[g][c] = count;
                    path[h / 3][h % 3] = count;
                    // Turn about the path's end on this side to its next border edge; it must have the same sides.
                    let other = label[h / 3];
                    let (mut x, mut y) = (g, if forward { (c + 1) % 3 } else { (c + 2) % 3 });
                    let next = loop {
                        let e = s.twin[x][y];
                        if e == NONE {
                            break None;
                        }
                        if label[e as usize / 3] != label[g] {
                            break (label[e as usize / 3] == other).then_some((x, y));
                        }
                        let e = e as usize;
                        (x, y) = (e / 3, if forward { (e % 3 + 1) % 3 } else { (e % 3 + 2) % 3 });
                    };
                    match next {
                        Some((x, y))
                            if path[x][y] == NONE
                                && simple(s, label, x, if forward { y } else { (y + 1) % 3 }) =>
                        {
                            (g, c) = (x, y);
                        }
                        _ => break,
                    }
                }
            }
            count += 1;
        }
    }
    (path, count as usize)
}

/// Whether the vertex at corner `k` of face `f` has a closed fan with at most two runs of labels.
fn simple(s: &Surface, label: &[u32], f: usize, k: usize) -> bool {
    let (mut g, mut c) = (f, k);
    let mut changes = 0;
    loop {
        let h = s.twin[g][c];
        if h == NONE {
            return false;
        }
        let h = h as usize;
        changes += usize::from(label[h / 3] != label[g]);
        (g, c) = (h / 3, (h % 3 + 1) % 3);
        if g == f {
            return changes <= 2;
        }
    }
}

struct Mesh<'a> {
    s: &'a Surface,
    tri: Vec<[u32; 3]>,
    twin: Vec<[u32; 3]>,
    path: Vec<[u32; 3]>,
    /// A half-edge that starts at each movable vertex; [`NONE`] for fixed and removed ones.
    out: Vec<u32>,
}

impl Mesh<'_> {
    /// The faces that are left.
    fn level(&self, label: &[u32]) -> Level {
        let mut name = vec![NONE; self.tri.len()];
        let mut kept = Vec::new();
        for f in 0..self.tri.len() {
            if self.s.usable[f] && self.tri[f][0] != NONE {
                name[f] = kept.len() as u32;
                kept.push(f);
            }
        }
        let tri = kept.iter().map(|&f| self.tri[f]).collect();
        let renamed = |h: u32| if h == NONE { NONE } else { 3 * name[h as usize / 3] + h % 3 };
        let twin = kept.iter().map(|&f| self.twin[f].map(renamed)).collect();
        Level {
            surface: Surface::from_parts(self.s.pos.clone(), tri, twin),
            label: kept.iter().map(|&f| label[f]).collect(),
            path: kept.iter().map(|&f| self.path[f]).collect(),
        }
    }

    /// Collects the half-edges that start at the vertex where `h` starts, in order.
    fn fan(&self, h: u32, into: &mut Vec<u32>) {
        into.clear();
        let mut e = h;
        loop {
            into.push(e);
            // The edge before, seen from its other side, starts here too.
            let before = e / 3 * 3 + (e + 2 - e / 3 * 3) % 3;
            e = self.twin[before as usize / 3][before as usize % 3];
            if e == NONE || e == h || into.len() > 64 {
                return;
            }
        }
    }
    fn end(&self, h: u32) -> u32 {
        self.tri[h as usize / 3][(h as usize % 3 + 1) % 3]
    }
    fn path_of(&self, h: u32) -> u32 {
        self.path[h as usize / 3][h as usize % 3]
    }
}

/// Decimates the surface to about `target` faces, in steps.
pub(super) fn coarsen(s: &Surface, patches: &Patches, target: usize, ctx: &Context<'_>) -> Result<Coarse> {
    let label = &patches.label;
    let (m, n) = (s.faces(), s.pos.len());
    ctx.check()?;
    let mut patch_area = vec![0f64; patches.count];
    for f in 0..m {
        if label[f] != NONE {
            patch_area[label[f] as usize] += s.area[f];
        }
    }
    // Equilateral triangles of area A have sides of 1.52 sqrt(A).
    let wanted = 1.52 / (target as f64).sqrt();
    let limit: Vec<f64> =
        patch_area.iter().map(|a| wanted.min(1.52 * (a / PER_PATCH).sqrt()).powi(2)).collect();
    let mut mesh =
        Mesh { s, tri: s.tri.clone(), twin: s.twin.clone(), path: patches.path.clone(), out: vec![NONE; n] };
    // Movable: one closed fan and at most two label runs.
    let mut corners = vec![0u32; n];
    let mut first = vec![NONE; n];
    for f in (0..m).filter(|&f| s.usable[f]) {
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
        if first[v] != NONE && simple(s, label, first[v] as usize / 3, first[v] as usize % 3) {
            mesh.fan(first[v], &mut fan);
            if fan.len() == corners[v] as usize {
                mesh.out[v] = first[v];
            }
        }
    }
    let mut parent: Vec<u32> = (0..n as u32).collect();
    let mut gone = vec![u8::MAX; n];
    let mut levels: Vec<Level> = Vec::new();
    let (mut left, mut kept) = (m, m);
    let mut length = {
        let mean = (0..m).filter(|&f| s.usable[f]).map(|f| f64::from(s.length[f][0]).powi(2)).sum::<f64>()
            / m as f64;
        mean * 0.5
    };
    let mut near = Vec::new();
    loop {
        let mut over = true;
        for u in 0..n {
            ctx.check_at(u)?;
            if mesh.out[u] == NONE {
                continue;
            }
            mesh.fan(mesh.out[u], &mut fan);
            let crossing = fan.iter().filter(|&&h| mesh.path_of(h) != NONE).count();
            let own =
                fan.iter().map(|&h| limit[label[h as usize / 3] as usize]).fold(f64::INFINITY, f64::min);
            if length < own {
                over = false;
            }
            let bound = own.min(length);
            let p = s.pos[u];
            near.clear();
            near.extend(
                fan.iter()
                    .filter(|&&h| crossing == 0 || mesh.path_of(h) != NONE)
                    .map(|&h| (p.dist2(s.pos[mesh.end(h) as usize]), h))
                    .filter(|x| x.0 < bound),
            );
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            if let Some(&(_, h)) = near.iter().take(3).find(|x| may_collapse(&mesh, x.1, &fan)) {
                parent[u] = mesh.end(h);
                gone[u] = levels.len() as u8;
                collapse(&mut mesh, h, &fan);
                left -= 2;
            }
        }
        if over {
            break;
        }
        if left * THINNING <= kept && left > THINNING * target {
            levels.push(mesh.level(label));
            kept = left;
        }
        length *= GROWTH * GROWTH;
    }
    levels.push(mesh.level(label));
    Ok(Coarse { levels, parent, gone })
}

/// Whether the start of `h` may move to its end: the surface stays a surface and no triangle turns over.
fn may_collapse(mesh: &Mesh<'_>, h: u32, fan: &[u32]) -> bool {
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
        for _ in 0..64 {
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
        // No sliver, and within 45 degrees of before.
        new.norm() > 0.1 * longest && old.dot(new) > 0.7 * old.norm() * new.norm()
    })
}

/// Moves the start of `h` to its end; two faces vanish.
fn collapse(mesh: &mut Mesh<'_>, h: u32, fan: &[u32]) {
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
