//! A quick proof that no face of a texture overlaps another.
//!
//! In: counter-clockwise faces of the plane, a tree of their boxes. Out: whether they are apart for sure;
//! what is not proven may still be. Faces that share UVs exactly hang together. A part whose borders are
//! simple curves, and whose vertices are wound round once, covers nothing twice (see `spatial::inject`);
//! parts whose borders are apart overlap only where one lies inside the other, and then with all its
//! vertices. This takes n log n where comparing the boxes of faces takes n squared: about the hub of a fan,
//! all boxes meet.

use super::layout::FaceUv;
use crate::error::Result;
use crate::numeric::plane::twice_area;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::{Aabb, Bvh};
use crate::spatial::inject::{border_touches, turns_once};
use crate::spatial::sets::Sets;
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::ops::ControlFlow;

/// Whether the faces are apart for sure.
pub(super) fn surely_apart(faces: &[FaceUv], tree: &Bvh, ctx: &Context<'_>) -> Result<bool> {
    // One vertex for each place.
    let mut name: FxHashMap<[u64; 2], u32> = FxHashMap::default();
    let (mut at, mut tris): (Vec<[f64; 2]>, Vec<[u32; 3]>) = (Vec::new(), Vec::with_capacity(faces.len()));
    for (i, face) in faces.iter().enumerate() {
        ctx.check_at(i)?;
        tris.push(face.map(|p| {
            // Both zeros are one place.
            *name.entry(p.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                at.push(p);
                at.len() as u32 - 1
            })
        }));
    }
    drop(name);
    // The face and slot of each directed edge; a second one says that faces lie on each other.
    let mut edges = FxHashMap::with_capacity_and_hasher(3 * tris.len(), FxBuildHasher);
    for (i, t) in tris.iter().enumerate() {
        ctx.check_at(i)?;
        for k in 0..3 {
            if edges.insert((t[k], t[(k + 1) % 3]), i as u32).is_some() {
                return Ok(false);
            }
        }
    }
    let mut parts = Sets::new(tris.len());
    let mut border: Vec<(u32, u8)> = Vec::new();
    let mut leaves = vec![false; at.len()];
    for (i, t) in tris.iter().enumerate() {
        ctx.check_at(i)?;
        for k in 0..3 {
            if let Some(&j) = edges.get(&(t[(k + 1) % 3], t[k])) {
                parts.join(i as u32, j);
                continue;
            }
            border.push((i as u32, k as u8));
            // Where two borders meet in a vertex, nothing is said.
            if std::mem::replace(&mut leaves[t[k] as usize], true) {
                return Ok(false);
            }
        }
    }
    drop(edges);
    ctx.check()?;
    if !turns_once(&tris, &at, &[], ctx)? {
        return Ok(false);
    }
    if border_touches(&tris, &at, &border, ctx)? {
        return Ok(false);
    }
    // One border vertex of each part must lie in no other.
    let part: Vec<u32> = (0..tris.len() as u32).map(|i| parts.find(i)).collect();
    let mut seen = vec![false; tris.len()];
    for &(i, k) in &border {
        let own = part[i as usize];
        if std::mem::replace(&mut seen[own as usize], true) {
            continue;
        }
        ctx.check()?;
        let p = at[tris[i as usize][k as usize] as usize];
        let inside = |f: &FaceUv| (0..3).all(|k| twice_area(f[k], f[(k + 1) % 3], p) >= 0.0);
        let hit = tree.meeting(&Aabb::of(&[Vec3([p[0], p[1], 0.0])]), |j| {
            if part[j as usize] != own && inside(&faces[j as usize]) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        if hit.is_break() {
            return Ok(false);
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::uv::overlap::counted;
    use crate::run::Run;
    use proptest::prelude::*;

    fn apart(faces: &[FaceUv]) -> bool {
        let boxes: Vec<Aabb> = faces.iter().map(|f| Aabb::of(&f.map(|p| Vec3([p[0], p[1], 0.0])))).collect();
        Run::default()
            .execute(|ctx| surely_apart(faces, &Bvh::build(&boxes, ctx)?, ctx))
            .expect("nothing cancels")
    }

    /// A disc of `n` faces about a point.
    fn fan(n: u32, [x, y]: [f64; 2], size: f64, turns: f64) -> Vec<FaceUv> {
        let rim = |i: u32| {
            let (s, c) = (turns * std::f64::consts::TAU * f64::from(i % n) / f64::from(n)).sin_cos();
            [x + size * c, y + size * s]
        };
        (0..n).map(|i| [[x, y], rim(i), rim(i + 1)]).collect()
    }

    #[test]
    fn fans_are_apart_and_nested_or_wound_ones_are_not() {
        let large = fan(20_000, [0.5, 0.5], 0.4, 1.0);
        assert!(apart(&large));
        let beside: Vec<FaceUv> = large.iter().copied().chain(fan(9, [0.05, 0.05], 0.04, 1.0)).collect();
        assert!(apart(&beside));
        let inside: Vec<FaceUv> = large.iter().copied().chain(fan(9, [0.6, 0.51], 0.001, 1.0)).collect();
        assert!(!apart(&inside));
        assert!(!apart(&fan(9, [0.5, 0.5], 0.4, 2.0)));
    }

    proptest! {
        #[test]
        fn what_is_apart_for_sure_does_not_overlap(
            sheets in prop::collection::vec((prop::array::uniform2(0.0..0.9f64), 0.01..0.3f64, 3..9u32), 1..5)
        ) {
            let faces: Vec<FaceUv> = sheets.iter().flat_map(|&(at, size, n)| fan(n, at, size, 1.0)).collect();
            let boxes: Vec<Aabb> =
                faces.iter().map(|f| Aabb::of(&f.map(|p| Vec3([p[0], p[1], 0.0])))).collect();
            let overlaps = Run::default()
                .execute(|ctx| counted(&faces, &boxes, &Bvh::build(&boxes, ctx)?, ctx))
                .unwrap();
            prop_assert!(!apart(&faces) || overlaps == 0);
        }
    }
}
