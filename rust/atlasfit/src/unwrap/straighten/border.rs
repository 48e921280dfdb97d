//! The border of a chart as closed curves.

use crate::unwrap::chart::Chart;
use crate::unwrap::surface::NONE;

/// The vertices of each border curve, in the order in which triangles run along it; the outer one runs
/// counter-clockwise. `None` where a curve meets itself.
pub(super) fn loops(c: &Chart) -> Option<Vec<Vec<u32>>> {
    let mut next = vec![NONE; c.vertices()];
    for &(i, k) in &c.border {
        let (t, k) = (c.tris[i as usize], usize::from(k));
        if std::mem::replace(&mut next[t[k] as usize], t[(k + 1) % 3]) != NONE {
            return None;
        }
    }
    let mut out = Vec::new();
    for first in 0..next.len() {
        let mut curve = Vec::new();
        let mut v = first as u32;
        while next[v as usize] != NONE {
            curve.push(v);
            v = std::mem::replace(&mut next[v as usize], NONE);
        }
        if !curve.is_empty() {
            (v == first as u32).then_some(())?;
            out.push(curve);
        }
    }
    Some(out)
}

/// The distance of two points.
pub(super) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// The sides that both ends of an edge inside the chart are on: triangles would collapse on them. `border`
/// are the chart's curves, `on` the sides of each vertex, [`NONE`] for none.
pub(super) fn chords<'a>(
    c: &'a Chart,
    border: &[Vec<u32>],
    on: &'a [[u32; 2]],
) -> impl Iterator<Item = u32> + 'a {
    let mut after = vec![NONE; c.vertices()];
    for curve in border {
        (0..curve.len()).for_each(|i| after[curve[i] as usize] = curve[(i + 1) % curve.len()]);
    }
    let pairs = c.tris.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
    pairs.filter(move |p| after[p[0] as usize] != p[1]).flat_map(move |[a, b]| {
        on[a as usize].into_iter().filter(move |x| *x != NONE && on[b as usize].contains(x))
    })
}
