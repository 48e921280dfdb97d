//! First positions: a chart projected to a plane.

use super::shape::all_positive;
use crate::numeric::vec3::Vec3;
use crate::unwrap::chart::Chart;
use crate::unwrap::surface::Surface;

/// The mean normal of some faces, by area.
pub(crate) fn mean_normal(s: &Surface, faces: &[u32]) -> Vec3 {
    let mut n = Vec3::ZERO;
    for &f in faces {
        for k in 0..3 {
            n[k] += s.normal[f as usize][k] * s.area[f as usize];
        }
    }
    let l = n.norm();
    if l > 0.0 { n.map(|x| x / l) } else { Vec3([0.0, 0.0, 1.0]) }
}

/// Projects a chart to the plane across its mean normal.
pub(crate) fn project(s: &Surface, chart: &mut Chart, n: Vec3) {
    let (e1, e2) = n.tangents();
    let mut origin = None;
    for (f, t) in chart.faces.iter().zip(&chart.tris) {
        for k in 0..3 {
            let p = s.pos[s.tri[*f as usize][k] as usize];
            let o = *origin.get_or_insert(p);
            let d = p - o;
            chart.uv[t[k] as usize] = [d.dot(e1), d.dot(e2)];
        }
    }
}

/// Moves from `from` towards `to` as far as no triangle flips; returns whether anything moved.
pub(crate) fn blend_without_flips(tris: &[[u32; 3]], from: &mut [[f64; 2]], to: &[[f64; 2]]) -> bool {
    let mut t = 1.0;
    for _ in 0..6 {
        let mixed: Vec<[f64; 2]> =
            from.iter().zip(to).map(|(a, b)| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]).collect();
        if all_positive(tris, &mixed) {
            from.copy_from_slice(&mixed);
            return true;
        }
        t *= 0.5;
    }
    false
}
