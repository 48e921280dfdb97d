//! Normals at the corners of triangles: one for each side of a crease.
//!
//! In: a surface and its creases. Out: a unit normal per corner, where some vertex has more than one. At a
//! vertex the triangles between two creases share one: the mean of theirs, weighted by the angle at the
//! vertex (Thürmer and Wüthrich 1998). Elsewhere it is the vertex's.

use super::chains::Creases;
use super::constants::CREASE;
use super::pull::{about, pull};
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::edges::{Edges, HalfEdge};
use crate::spatial::sets::Sets;
use crate::spatial::triangle::area_vector;
use rayon::prelude::*;

/// Normals at the corners of the triangles; none where no vertex has more than one.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn of_corners(
    s: &Surface,
    creases: &Creases,
    ctx: &Context<'_>,
) -> Result<Option<Vec<[[f32; 3]; 3]>>> {
    let edges = Edges::new(&s.triangles, ctx)?;
    let inner: Vec<[HalfEdge; 2]> = edges.iter().filter_map(|e| <[HalfEdge; 2]>::try_from(e).ok()).collect();
    drop(edges);
    let creased = inner
        .par_iter()
        .map(|e| {
            ctx.check()?;
            Ok(is_crease(s, creases, e))
        })
        .collect::<Result<Vec<bool>>>()?;
    if !creased.contains(&true) {
        return Ok(None);
    }
    let mut split = ctx.filled(false, s.positions.len())?;
    // A set holds corners, 3 for each triangle, that share their vertex's normal.
    let mut sets = Sets::new(3 * s.triangles.len());
    for (i, (e, creased)) in inner.iter().zip(creased).enumerate() {
        ctx.check_at(i)?;
        for v in e[0].ends() {
            if creased {
                split[v as usize] = true;
            } else {
                let [a, b] = e.map(|half| corner_at(s, half, v));
                sets.join(a, b);
            }
        }
    }
    let mut sum = ctx.filled(Vec3::ZERO, 3 * s.triangles.len())?;
    for (f, t) in s.triangles.iter().enumerate() {
        ctx.check_at(f)?;
        for k in (0..3).filter(|&k| split[t[k] as usize]) {
            sum[sets.find((3 * f + k) as u32) as usize] += weighted_normal(s, t, k);
        }
    }
    let mut normal = |f: usize, t: &[u32; 3], k: usize| {
        let own = s.normals[t[k] as usize];
        if !split[t[k] as usize] {
            return own;
        }
        let of_side = sum[sets.find((3 * f + k) as u32) as usize].normalized();
        if of_side == Vec3::ZERO { own } else { of_side }
    };
    let mut out = Vec::with_capacity(s.triangles.len());
    for (f, t) in s.triangles.iter().enumerate() {
        ctx.check_at(f)?;
        out.push([0, 1, 2].map(|k| normal(f, t, k).to_f32()));
    }
    Ok(Some(out))
}

/// Whether an edge of two triangles lies along a crease, and the triangles on its two sides.
fn is_crease(s: &Surface, creases: &Creases, edge: &[HalfEdge; 2]) -> bool {
    let at = |v: u32| s.positions[v as usize];
    let ends = edge[0].ends().map(at);
    let middle = (ends[0] + ends[1]) * 0.5;
    let chains = about(creases, middle);
    if chains.is_empty() {
        return false;
    }
    let corners = edge.map(|half| s.triangles[half.face()].map(at));
    let facing = corners.map(|c| area_vector(c).normalized());
    let mean = (facing[0] + facing[1]).normalized();
    // It runs along the line, not across it.
    let near = CREASE.along * (ends[1] - ends[0]).norm();
    chains.into_iter().any(|chain| {
        let asked = |p: Vec3| pull(creases, p, mean, Some(chain));
        let Some(crease) = asked(middle) else { return false };
        let [one, other] = crease.sides;
        let fits = facing.map(|n| n.dot(one) - n.dot(other));
        fits[0] * fits[1] < 0.0
            && facing.iter().all(|n| n.dot(one).max(n.dot(other)) > CREASE.same_side)
            && ends.iter().all(|&p| asked(p).is_none_or(|end| end.across.abs() < near))
    })
}

/// The number of a face's corner at a vertex.
fn corner_at(s: &Surface, half: HalfEdge, v: u32) -> u32 {
    let next = u32::from(half.start(&s.triangles) != v);
    (3 * half.face()) as u32 + (half.side() as u32 + next) % 3
}

/// A triangle's unit normal times its angle at a corner.
fn weighted_normal(s: &Surface, t: &[u32; 3], k: usize) -> Vec3 {
    let [p, q, r] = [0, 1, 2].map(|i| s.positions[t[(k + i) % 3] as usize]);
    let (a, b) = (q - p, r - p);
    let cross = a.cross(b);
    cross.normalized() * cross.norm().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use super::super::chains::tests::{creases, piece};
    use super::*;
    use crate::run::Run;

    /// A roof over [-2, 2] x [-2, 2], its ridge along y; `moved` moves the vertices.
    fn roof(moved: impl Fn(Vec3) -> Vec3) -> Surface {
        let n = 9u32;
        let place = |i: u32| [i % n, i / n].map(|k| 0.5 * (f64::from(k) - 4.0));
        let positions: Vec<Vec3> =
            (0..n * n).map(place).map(|[x, y]| moved(Vec3([x, y, -x.abs()]))).collect();
        let normals = vec![Vec3([0.0, 0.0, 1.0]); positions.len()];
        let cells = (0..(n - 1) * (n - 1)).map(|i| i / (n - 1) * n + i % (n - 1));
        let triangles = cells.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]).collect();
        Surface { chart: vec![0; positions.len()], positions, normals, triangles }
    }

    fn of(s: &Surface) -> Option<Vec<[[f32; 3]; 3]>> {
        let ridge = creases((-2..=2).map(|k| piece([0.0, f64::from(k), 0.0], 1, 2.0)).collect());
        let ridge = ridge.expect("a crease");
        Run::default().execute(|ctx| of_corners(s, &ridge, ctx)).expect("nothing stops it")
    }

    #[test]
    fn on_a_ridge_each_side_has_its_own_normal_and_elsewhere_the_vertex() {
        let s = roof(|p| p);
        let found = of(&s).expect("a ridge");
        for (t, normals) in s.triangles.iter().zip(&found) {
            let corners = t.map(|v| s.positions[v as usize]);
            let side = area_vector(corners).normalized();
            for (p, n) in corners.iter().zip(normals) {
                let want = if p[0] == 0.0 { side } else { Vec3([0.0, 0.0, 1.0]) };
                // The ridge ends at the rim: there, too, the two sides are apart.
                assert!((Vec3(n.map(f64::from)) - want).norm() < 1e-6, "{p:?}: {n:?}");
            }
        }
    }

    #[test]
    fn a_flat_surface_under_a_crease_has_none() {
        assert_eq!(of(&roof(|p| Vec3([p[0], p[1], 0.0]))), None);
    }
}
