//! The part of a merge that is solved, and the merged chart made of it.
//!
//! In: two flattened charts, their shared edges, a rigid motion. Out: triangles and first positions; later
//! the chart.

use super::align::{Motion, Shared, moved};
use super::constants::MERGE;
use super::limits::MergeLimits;
use crate::spatial::sets::Sets;
use crate::unwrap::chart::{Chart, Seams};
use crate::unwrap::surface::{NONE, Surface};

/// Two charts that may become one.
pub(super) struct Pair<'a> {
    pub s: &'a Surface,
    /// The one of more faces.
    pub a: &'a Chart,
    pub b: &'a Chart,
    /// Which of the two a face belongs to, the second if so, and its place there. Asked of faces at their
    /// borders only.
    pub place: &'a dyn Fn(usize) -> Option<(bool, u32)>,
    pub limits: MergeLimits,
    pub worth: Worth,
}

/// Whether a merged chart is worth what it wastes of the page.
#[derive(Clone, Copy)]
pub(super) struct Worth {
    /// The borders of what the chart replaces, and their waste.
    pub seams: Seams,
    pub waste: f64,
    /// Lengths of seam that an area of the page is worth, see `glue::price_of_waste`.
    pub price: f64,
    /// Least cost of seams that must be saved.
    pub least: f64,
}

impl Worth {
    /// Whether a chart of this border and waste is. A seam that is gone is worth its length at least: where
    /// seams are cheap there shall not be many.
    pub(super) fn has(&self, border: Seams, waste: f64) -> bool {
        let Seams { length, cost } = self.seams.without(border);
        0.5 * cost >= self.least && self.price * (waste - self.waste) <= 0.5 * cost.max(length)
    }
}

/// The part of a merge that is solved: all of b, and what of a lies near the shared edges. Vertices of a
/// further away are pinned. A small chart is so tested at its own cost, not at the large one's.
pub(super) struct Patch {
    /// Faces of a that take part, then all of b, as places in the charts.
    pub near: Vec<u32>,
    pub tris: Vec<[u32; 3]>,
    pub rest: Vec<[f64; 3]>,
    pub area: Vec<f64>,
    pub uv: Vec<[f64; 2]>,
    pub pinned: Vec<bool>,
    /// Patch vertex of each vertex of a ([`NONE`] if not taking part) and of b.
    pub of_a: Vec<u32>,
    pub of_b: Vec<u32>,
}

/// Lays out the patch: b moved onto a, glued vertices averaged. `None` if a triangle would collapse.
pub(super) fn patch(pair: &Pair<'_>, shared: &[Shared], motion: Motion) -> Option<Patch> {
    let &Pair { s, a, b, .. } = pair;
    let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for v in shared.iter().flat_map(|e| e.a) {
        for k in 0..2 {
            lo[k] = lo[k].min(a.uv[v as usize][k]);
            hi[k] = hi[k].max(a.uv[v as usize][k]);
        }
    }
    let margin = MERGE.reach * b.area.sqrt() + MERGE.reach_of_seam * (hi[0] - lo[0] + hi[1] - lo[1]);
    let inside: Vec<bool> =
        a.uv.iter().map(|p| (0..2).all(|k| p[k] >= lo[k] - margin && p[k] <= hi[k] + margin)).collect();
    let mut near: Vec<u32> = (0..a.tris.len() as u32)
        .filter(|&i| a.tris[i as usize].iter().any(|&v| inside[v as usize]))
        .collect();
    let whole = near.len() * 10 > a.tris.len() * MERGE.whole_tenths;
    if whole {
        near = (0..a.tris.len() as u32).collect();
    }
    // Number the vertices: first of a, then of b, then unite what is glued.
    let mut of_a = vec![NONE; a.vertices()];
    let mut uv = Vec::with_capacity(near.len() + b.vertices());
    let mut pinned = Vec::with_capacity(near.len() + b.vertices());
    for &i in &near {
        for &v in &a.tris[i as usize] {
            if of_a[v as usize] == NONE {
                of_a[v as usize] = uv.len() as u32;
                uv.push(a.uv[v as usize]);
                pinned.push(!whole && !inside[v as usize]);
            }
        }
    }
    let na = uv.len() as u32;
    uv.extend(b.uv.iter().map(|&p| moved(motion, p)));
    let glued = shared.iter().flat_map(|e| [0, 1].map(|k| [of_a[e.a[k] as usize], e.b[k] + na]));
    let Welded { name, uv: merged, first } = welded(&uv, glued);
    let pins = first.iter().map(|&i| i < na && pinned[i as usize]).collect();
    for v in of_a.iter_mut().filter(|v| **v != NONE) {
        *v = name[*v as usize];
    }
    let of_b: Vec<u32> = (0..b.vertices()).map(|v| name[v + na as usize]).collect();
    let tris: Vec<[u32; 3]> = near
        .iter()
        .map(|&i| a.tris[i as usize].map(|v| of_a[v as usize]))
        .chain(b.tris.iter().map(|t| t.map(|v| of_b[v as usize])))
        .collect();
    if tris.iter().any(|t| t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
        return None;
    }
    let faces = || near.iter().map(|&i| a.faces[i as usize]).chain(b.faces.iter().copied());
    Some(Patch {
        rest: faces().map(|f| s.rest[f as usize]).collect(),
        area: faces().map(|f| s.area[f as usize]).collect(),
        near,
        tris,
        uv: merged,
        pinned: pins,
        of_a,
        of_b,
    })
}

/// Points with glued ones made one.
struct Welded {
    /// New point of each old one.
    name: Vec<u32>,
    /// Mean position of the points that each new one is made of.
    uv: Vec<[f64; 2]>,
    /// The first of them.
    first: Vec<u32>,
}

/// Makes pairs of points one.
fn welded(uv: &[[f64; 2]], glued: impl Iterator<Item = [u32; 2]>) -> Welded {
    let mut sets = Sets::new(uv.len());
    glued.for_each(|[x, y]| sets.join(x, y));
    let mut out = Welded { name: vec![NONE; uv.len()], uv: Vec::new(), first: Vec::new() };
    let mut members: Vec<f64> = Vec::with_capacity(uv.len());
    for i in 0..uv.len() as u32 {
        let r = sets.find(i) as usize;
        if out.name[r] == NONE {
            out.name[r] = out.uv.len() as u32;
            out.uv.push([0.0; 2]);
            members.push(0.0);
            out.first.push(i);
        }
        let q = out.name[r] as usize;
        out.name[i as usize] = q as u32;
        out.uv[q] = [out.uv[q][0] + uv[i as usize][0], out.uv[q][1] + uv[i as usize][1]];
        members[q] += 1.0;
    }
    for (p, m) in out.uv.iter_mut().zip(&members) {
        *p = p.map(|x| x / m);
    }
    out
}

/// The merged chart, with the patch's positions.
pub(super) fn assemble(pair: &Pair<'_>, p: &Patch) -> Option<Chart> {
    let &Pair { s, a, b, place, .. } = pair;
    let mut of_patch = vec![NONE; p.uv.len()];
    let mut uv = Vec::with_capacity(a.vertices() + b.vertices());
    let mut name = |q: u32, alone: [f64; 2]| {
        if q == NONE {
            uv.push(alone);
            return uv.len() as u32 - 1;
        }
        if of_patch[q as usize] == NONE {
            of_patch[q as usize] = uv.len() as u32;
            uv.push(p.uv[q as usize]);
        }
        of_patch[q as usize]
    };
    let of_a: Vec<u32> = p.of_a.iter().zip(&a.uv).map(|(&q, &u)| name(q, u)).collect();
    let of_b: Vec<u32> = p.of_b.iter().map(|&q| name(q, [0.0; 2])).collect();
    let offset = a.faces.len() as u32;
    let mut c = Chart {
        faces: a.faces.iter().chain(&b.faces).copied().collect(),
        tris: (a.tris.iter().map(|t| t.map(|v| of_a[v as usize])))
            .chain(b.tris.iter().map(|t| t.map(|v| of_b[v as usize])))
            .collect(),
        uv,
        border: Vec::new(),
        area: a.area + b.area,
        over: 0.0,
        waste: 0.0,
        straight: false,
    };
    c.border = a.border.iter().copied().chain(b.border.iter().map(|&(i, k)| (i + offset, k))).collect();
    c.zip(s, |f| place(f).map(|(of_b, i)| if of_b { i + offset } else { i }));
    (!c.border.is_empty()).then_some(c)
}
