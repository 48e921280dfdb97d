//! Keeps a chart's border off itself: a barrier between border vertices and border edges that come near.
//!
//! In: border edges and positions. Out: contacts with their energy, slope and curvature (a smooth barrier
//! after Li et al. 2020, "Incremental potential contact").

use super::constants::FLATTEN;
use crate::error::Result;
use crate::numeric::plane::corners;
use crate::run::Context;
use crate::spatial::inject::segments_touch;
use rustc_hash::FxHashMap;

/// The border of a chart.
pub(crate) struct Border {
    /// Ends of its edges.
    segments: Vec<[u32; 2]>,
}

/// A border vertex near a border edge that does not end there.
pub(super) struct Contact {
    /// The vertex, and the two ends of the edge.
    pub at: [u32; 3],
    pub distance: f64,
    /// Barrier energy, and its first and second derivative by the distance.
    pub energy: f64,
    pub slope: f64,
    pub curvature: f64,
    /// Derivative of the distance at the three points.
    pub gradient: [[f64; 2]; 3],
}

impl Border {
    /// From the two ends of each edge.
    pub(crate) fn of(segments: Vec<[u32; 2]>) -> Self {
        Self { segments }
    }

    /// From the free edges (triangle, slot) of some triangles.
    pub(super) fn new(tris: &[[u32; 3]], border: &[(u32, u8)]) -> Self {
        let ends = |&(i, k): &(u32, u8)| {
            let (t, k) = (tris[i as usize], usize::from(k));
            [t[k], t[(k + 1) % 3]]
        };
        Self { segments: border.iter().map(ends).collect() }
    }

    /// Whether it touches or crosses itself.
    pub(crate) fn touches(&self, uv: &[[f64; 2]], ctx: &Context<'_>) -> Result<bool> {
        Ok(segments_touch(&self.segments, uv, ctx)?.is_some())
    }

    /// All contacts, in the order of their edges, but those of held vertices alone.
    pub(super) fn contacts(&self, uv: &[[f64; 2]], held: &[[bool; 2]]) -> Vec<Contact> {
        let moves = |v: u32| held.get(v as usize).is_none_or(|&h| h != [true; 2]);
        let n = self.segments.len();
        if n == 0 {
            return Vec::new();
        }
        let reach = FLATTEN.reach;
        let (mut lo, mut hi, mut total) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], 0.0);
        for s in &self.segments {
            let [a, b] = s.map(|v| uv[v as usize]);
            for k in 0..2 {
                lo[k] = lo[k].min(a[k]).min(b[k]);
                hi[k] = hi[k].max(a[k]).max(b[k]);
            }
            total += (a[0] - b[0]).abs() + (a[1] - b[1]).abs();
        }
        let size = [hi[0] - lo[0], hi[1] - lo[1]];
        let cell = (total / n as f64)
            .max((size[0] * size[1] / (4.0 * n as f64)).sqrt())
            .max(2.0 * reach)
            .max((size[0] + size[1]) / (8.0 * n as f64));
        let dims = size.map(|s| (s / cell) as usize + 1);
        let place = |x: f64, k: usize| (((x - lo[k]) / cell).max(0.0) as usize).min(dims[k] - 1);
        // The border vertices by cells: each starts one edge.
        let of = |v: u32| {
            let p = uv[v as usize];
            place(p[1], 1) * dims[0] + place(p[0], 0)
        };
        let mut start = vec![0u32; dims[0] * dims[1] + 1];
        self.segments.iter().for_each(|s| start[of(s[0]) + 1] += 1);
        (0..dims[0] * dims[1]).for_each(|c| start[c + 1] += start[c]);
        let (mut fill, mut item) = (start.clone(), vec![0u32; n]);
        for s in &self.segments {
            let f = &mut fill[of(s[0])];
            item[*f as usize] = s[0];
            *f += 1;
        }
        let mut out = Vec::new();
        for &[a, b] in &self.segments {
            let [p, q] = [a, b].map(|v| uv[v as usize]);
            let range = |k: usize| (place(p[k].min(q[k]) - reach, k), place(p[k].max(q[k]) + reach, k));
            let (x, y) = (range(0), range(1));
            for row in y.0..=y.1 {
                let own = start[row * dims[0] + x.0] as usize..start[row * dims[0] + x.1 + 1] as usize;
                let near = item[own].iter().filter(|&&v| [v, a, b].into_iter().any(moves));
                out.extend(near.filter_map(|&v| contact([v, a, b], uv)));
            }
        }
        out
    }
}

/// Whether no distance has come down by more than a share of what it was: what comes nearer in one step
/// presses so hard that later ones hardly move. Contacts that are new were at least as far apart as the
/// barrier reaches.
pub(super) fn gentle(before: &[Contact], after: &[Contact]) -> bool {
    let was: FxHashMap<[u32; 3], f64> = before.iter().map(|c| (c.at, c.distance)).collect();
    let share = |c: &Contact| c.distance / was.get(&c.at).copied().unwrap_or(FLATTEN.reach);
    after.iter().all(|c| share(c) > FLATTEN.nearer)
}

/// The contact of a vertex with an edge, if they are near.
fn contact(at: [u32; 3], uv: &[[f64; 2]]) -> Option<Contact> {
    if at[0] == at[1] || at[0] == at[2] {
        return None;
    }
    let [p, a, b] = corners(at, uv);
    let (ab, ap) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let l2 = (ab[0] * ab[0] + ab[1] * ab[1]).max(1e-300);
    let t = ((ab[0] * ap[0] + ab[1] * ap[1]) / l2).clamp(0.0, 1.0);
    let away = [ap[0] - t * ab[0], ap[1] - t * ab[1]];
    let d = away[0].hypot(away[1]).max(1e-12);
    let x = d / FLATTEN.reach;
    if x >= 1.0 {
        return None;
    }
    let n = away.map(|y| y / d);
    let (less, log) = (x - 1.0, x.ln());
    let (weight, unit) = (FLATTEN.barrier, FLATTEN.reach.recip());
    Some(Contact {
        at,
        distance: d,
        energy: -weight * less * less * log,
        slope: -weight * unit * (2.0 * less * log + less * less / x),
        curvature: weight * unit * unit * (-2.0 * log - 4.0 * less / x + (less / x).powi(2)),
        gradient: [n, n.map(|y| -(1.0 - t) * y), n.map(|y| -t * y)],
    })
}
