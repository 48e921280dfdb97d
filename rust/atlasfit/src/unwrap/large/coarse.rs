//! A coarse stand-in for a large surface, on which charts are merged cheaply.
//!
//! In: a surface and its patches. Out: surfaces with ever fewer faces and the same patches, whose patch
//! borders run through the same junctions; and the way back. Half-edge collapses, shortest edges first (after
//! Hoppe 1996; no quadrics: patches are nearly flat, and even triangles serve the flattening best). On the
//! way from the full surface to the last one a few are kept: a flattening that is taken back level by level
//! has its large features right before the small ones come (a cascade, after Bornemann and Deuflhard 1996).

use super::collapse::{Level, Mesh, collapse, may_collapse};
use super::constants::LARGE;
use super::patches::Patches;
use crate::error::Result;
use crate::run::Context;
use crate::unwrap::surface::{NONE, Surface};

/// The coarse surfaces and how they came about.
pub(crate) struct Coarse {
    /// From fine to coarse; at least one.
    pub levels: Vec<Level>,
    /// The vertex that each vertex was moved to; itself where it never was.
    parent: Vec<u32>,
    /// The first level that is without the vertex.
    gone: Vec<u8>,
}

impl Coarse {
    /// The level on which charts are merged.
    pub(crate) fn last(&self) -> &Level {
        &self.levels[self.levels.len() - 1]
    }

    /// The vertex of a level that a vertex of a finer one ended up in.
    pub(crate) fn home(&self, mut v: u32, level: usize) -> u32 {
        while usize::from(self.gone[v as usize]) <= level {
            v = self.parent[v as usize];
        }
        v
    }
}

/// Bound on the squared length of edges that are collapsed, per patch.
fn limits(s: &Surface, patches: &Patches, target: usize) -> Vec<f64> {
    let mut patch_area = vec![0f64; patches.count];
    for (&p, area) in patches.label.iter().zip(&s.area).filter(|p| *p.0 != NONE) {
        patch_area[p as usize] += area;
    }
    let wanted = LARGE.side / (target as f64).sqrt();
    patch_area.iter().map(|a| wanted.min(LARGE.side * (a / LARGE.per_patch).sqrt()).powi(2)).collect()
}

/// A surface that gets coarser.
struct Sweeps<'a> {
    mesh: Mesh<'a>,
    label: &'a [u32],
    /// Per patch; see [`limits`].
    limit: Vec<f64>,
    /// As in [`Coarse`].
    parent: Vec<u32>,
    gone: Vec<u8>,
    /// Faces that are left.
    left: usize,
}

impl Sweeps<'_> {
    /// Collapses edges of a squared length up to `length`, vertex by vertex, as far as the patches allow;
    /// those that go do so after `level` levels. Returns whether that was as long as any patch allows.
    fn sweep(&mut self, length: f64, level: u8, ctx: &Context<'_>) -> Result<bool> {
        let pos = &self.mesh.s.pos;
        let (mut fan, mut near) = (Vec::new(), Vec::new());
        let mut over = true;
        for u in 0..pos.len() {
            ctx.check_at(u)?;
            if self.mesh.out[u] == NONE {
                continue;
            }
            let mesh = &self.mesh;
            mesh.fan(mesh.out[u], &mut fan);
            let crossing = fan.iter().filter(|&&h| mesh.path_of(h) != NONE).count();
            let own = (fan.iter())
                .map(|&h| self.limit[self.label[h as usize / 3] as usize])
                .fold(f64::INFINITY, f64::min);
            if length < own {
                over = false;
            }
            let bound = own.min(length);
            near.clear();
            near.extend(
                fan.iter()
                    .filter(|&&h| crossing == 0 || mesh.path_of(h) != NONE)
                    .map(|&h| (pos[u].dist2(pos[mesh.end(h) as usize]), h))
                    .filter(|x| x.0 < bound),
            );
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            if let Some(&(_, h)) = near.iter().take(LARGE.nearest).find(|x| may_collapse(mesh, x.1, &fan)) {
                self.parent[u] = mesh.end(h);
                self.gone[u] = level;
                collapse(&mut self.mesh, h, &fan);
                self.left -= 2;
            }
        }
        Ok(over)
    }
}

/// Decimates the surface to about `target` faces, in steps.
pub(crate) fn coarsen(s: &Surface, patches: &Patches, target: usize, ctx: &Context<'_>) -> Result<Coarse> {
    let (m, n) = (s.faces(), s.pos.len());
    ctx.check()?;
    let mut sweeps = Sweeps {
        mesh: Mesh::new(s, patches, ctx)?,
        label: &patches.label,
        limit: limits(s, patches, target),
        parent: (0..n as u32).collect(),
        gone: vec![u8::MAX; n],
        left: m,
    };
    let mut levels: Vec<Level> = Vec::new();
    let mut kept = m;
    let mut length = {
        let mean = (0..m).filter(|&f| s.usable[f]).map(|f| f64::from(s.length[f][0]).powi(2)).sum::<f64>()
            / m as f64;
        mean * 0.5
    };
    while !sweeps.sweep(length, levels.len() as u8, ctx)? {
        if sweeps.left * LARGE.thinning <= kept && sweeps.left > LARGE.thinning * target {
            levels.push(sweeps.mesh.level(&patches.label, ctx)?);
            kept = sweeps.left;
        }
        length *= LARGE.growth * LARGE.growth;
    }
    levels.push(sweeps.mesh.level(&patches.label, ctx)?);
    Ok(Coarse { levels, parent: sweeps.parent, gone: sweeps.gone })
}
