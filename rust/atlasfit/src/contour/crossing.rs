//! Fillings of holes that pass through the surface, put elsewhere.
//!
//! In: a surface, the rings of its holes, a filling of each. Out: fillings that meet neither the surface nor
//! themselves, where there are such.

use super::constants::CONTOUR;
use super::patch::Barred;
use super::surface::{Surface, corners};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::Aabb;
use crate::spatial::faces::{self, Faces, meet};
use rayon::prelude::*;
use std::cell::RefCell;
use std::collections::HashMap;

/// Triangles of a hole's filling.
type Filling = Vec<[u32; 3]>;

/// Replaces the fillings that pass through the surface or themselves by others, which `fill` finds for a ring
/// without some triangles. Where it finds none the first stays.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn avoid(
    s: &Surface,
    rings: &[Vec<u32>],
    fillings: &mut [Option<Filling>],
    fill: impl Fn(&[u32], &Barred<'_>) -> Result<Option<Filling>> + Sync,
    ctx: &Context<'_>,
) -> Result<()> {
    let of = |t: &[u32; 3]| Aabb::of(&corners(&s.positions, t));
    // No filling of a ring leaves its box.
    let around = |f: &Filling| f.iter().fold(Aabb::EMPTY, |a, t| a.join(&of(t)));
    let boxes: Vec<Aabb> = fillings.iter().flatten().map(around).collect();
    let near = faces::near(&s.positions, &s.triangles, &boxes, ctx)?;
    let near: Vec<[u32; 3]> = near.into_iter().map(|t| s.triangles[t as usize]).collect();
    let faces = Faces::new(&s.positions, &near, ctx)?;
    fillings.par_iter_mut().zip(rings).try_for_each(|(filling, ring)| {
        let Some(first) = filling else { return Ok(()) };
        if let Some(other) = without_meeting(&faces, first, |barred| fill(ring, barred), ctx)? {
            *first = other;
        }
        Ok(())
    })
}

/// Another filling that meets neither the faces nor itself; none where the first does not either, or no other
/// is found.
fn without_meeting(
    faces: &Faces<'_>,
    first: &Filling,
    fill: impl Fn(&Barred<'_>) -> Result<Option<Filling>>,
    ctx: &Context<'_>,
) -> Result<Option<Filling>> {
    let (mut met_before, mut found) = (Vec::new(), None::<Filling>);
    let looked_at = RefCell::new(HashMap::new());
    let edge =
        |a: u32, b: u32| *looked_at.borrow_mut().entry((a, b)).or_insert_with(|| faces.meets_edge(a, b));
    for _ in 0..CONTOUR.fillings {
        ctx.check()?;
        let met = meeting(faces, found.as_ref().unwrap_or(first));
        if met.is_empty() {
            return Ok(found);
        }
        met_before.extend(met);
        met_before.sort_unstable();
        let triangle = |t: [u32; 3]| met_before.binary_search(&t).is_ok();
        found = fill(&Barred { edge: &edge, triangle: &triangle })?;
        if found.is_none() {
            break;
        }
    }
    Ok(None)
}

/// The triangles of a filling that meet the surface, or of two that meet each other the first.
fn meeting(faces: &Faces<'_>, filling: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let corners: Vec<[Vec3; 3]> = filling.iter().map(|t| t.map(|v| faces.positions[v as usize])).collect();
    let meets_later = |i: usize| {
        let mut later = filling.iter().zip(&corners).skip(i + 1);
        later.any(|(u, q)| meet((filling[i], &corners[i]), (*u, q)))
    };
    let met = |&(i, t): &(usize, &[u32; 3])| faces.meets(*t, None) || meets_later(i);
    filling.iter().enumerate().filter(met).map(|(_, t)| *t).collect()
}
