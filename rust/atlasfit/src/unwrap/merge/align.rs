//! The edges that two charts share, and the rigid motion that lays one chart against the other.

use crate::spatial::sets::Sets;
use crate::unwrap::chart::Chart;

/// A border edge that two charts share.
#[derive(Clone, Copy)]
pub(super) struct Shared {
    /// Chart-local end points in the first chart, and the same points in the second.
    pub a: [u32; 2],
    pub b: [u32; 2],
    /// Its length on the surface.
    pub length: f64,
    /// What it costs as a seam.
    pub cost: f64,
}

/// Connected runs of shared edges.
pub(super) fn paths(shared: &[Shared]) -> Vec<Vec<Shared>> {
    let mut ends: Vec<((u32, u32), u32)> = Vec::with_capacity(shared.len() * 2);
    for (i, e) in shared.iter().enumerate() {
        ends.push(((e.a[0], e.b[0]), i as u32));
        ends.push(((e.a[1], e.b[1]), i as u32));
    }
    ends.sort_unstable();
    let mut sets = Sets::new(shared.len());
    for w in ends.windows(2) {
        if w[0].0 == w[1].0 {
            sets.join(w[0].1, w[1].1);
        }
    }
    let mut out: Vec<Vec<Shared>> = Vec::new();
    // Which run each set is.
    let mut run = vec![usize::MAX; shared.len()];
    for (i, e) in shared.iter().enumerate() {
        let run = &mut run[sets.find(i as u32) as usize];
        if *run == usize::MAX {
            *run = out.len();
            out.push(Vec::new());
        }
        out[*run].push(*e);
    }
    out
}

/// A planar rigid motion: rotation (c, s), then translation.
pub(super) type Motion = [f64; 4];

/// The point after the motion.
pub(super) fn moved(m: Motion, p: [f64; 2]) -> [f64; 2] {
    [m[0] * p[0] - m[1] * p[1] + m[2], m[1] * p[0] + m[0] * p[1] + m[3]]
}

/// The rigid motion that lays b's side of the shared edges on a's, and the root mean square distance left.
pub(super) fn align(a: &Chart, b: &Chart, shared: &[Shared]) -> (Motion, f64) {
    let points = || {
        shared
            .iter()
            .flat_map(|e| [0, 1].map(|k| (a.uv[e.a[k] as usize], b.uv[e.b[k] as usize], e.length.max(1e-12))))
    };
    let (mut ca, mut cb, mut w) = ([0.0; 2], [0.0; 2], 0.0);
    for (p, q, l) in points() {
        for k in 0..2 {
            ca[k] += l * p[k];
            cb[k] += l * q[k];
        }
        w += l;
    }
    let (ca, cb) = (ca.map(|x| x / w), cb.map(|x| x / w));
    let (mut c, mut d) = (0.0, 0.0);
    for (p, q, l) in points() {
        let (p, q) = ([p[0] - ca[0], p[1] - ca[1]], [q[0] - cb[0], q[1] - cb[1]]);
        c += l * (q[0] * p[0] + q[1] * p[1]);
        d += l * (q[0] * p[1] - q[1] * p[0]);
    }
    let n = (c * c + d * d).sqrt();
    let (c, d) = if n > 0.0 { (c / n, d / n) } else { (1.0, 0.0) };
    let m = [c, d, ca[0] - c * cb[0] + d * cb[1], ca[1] - d * cb[0] - c * cb[1]];
    let rest: f64 = points()
        .map(|(p, q, l)| {
            let q = moved(m, q);
            l * ((p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2))
        })
        .sum();
    (m, (rest / w).sqrt())
}
