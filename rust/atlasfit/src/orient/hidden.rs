//! What a viewer cannot have seen, since the surface lies before it.
//!
//! In: points with their charts, and where the viewer stood. Out: for each point whether it is hidden. Of a
//! scan from a moving platform, or of several rooms, one viewpoint tells the sides of what is seen from there
//! only: both sides of a wall between two rooms would else be told to face the same way.
//!
//! The points are sorted by direction into the squares of a cube about the viewer. The plane of the nearest
//! one of a square stands for what is seen there.

use super::constants::ORIENT;
use super::relations::charts_at;
use crate::atlas::{FittedChart, Membership};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// A point on its strongest chart, as the viewer sees it.
#[derive(Clone, Copy)]
struct Sight {
    /// Direction to it, and how far it is.
    toward: Vec3,
    far: f64,
    normal: Vec3,
    /// Surfaces that are nearer by less are taken for its own.
    thick: f64,
}

/// Whether a viewer at `viewer` cannot see each point; `thick` says of each how far behind another surface it
/// must lie at least to be told from that.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn hidden(
    points: &[Vec3],
    fitted: &[FittedChart],
    members: &Membership,
    viewer: Vec3,
    thick: impl Fn(usize) -> f64 + Sync,
    ctx: &Context<'_>,
) -> Result<Vec<bool>> {
    let sight = |i: usize| {
        let at = charts_at(points[i], members.of(i), fitted).into_iter().next()?;
        let ray = points[i] - at.offset - viewer;
        Some(Sight { toward: ray.normalized(), far: ray.norm(), normal: at.normal, thick: thick(i) })
            .filter(|s| s.far > 0.0)
    };
    let mut sights: Vec<Option<Sight>> = vec![None; points.len()];
    sights.par_chunks_mut(1024).enumerate().try_for_each(|(k, chunk)| {
        ctx.check()?;
        chunk.iter_mut().enumerate().for_each(|(i, s)| *s = sight(1024 * k + i));
        Ok(())
    })?;
    let across = squares_across(&sights, ctx)?;
    let mut nearest: Vec<Option<Sight>> = vec![None; 6 * (across * across) as usize];
    for (i, s) in sights.iter().enumerate() {
        ctx.check_at(i)?;
        if let Some(s) = s {
            let first = &mut nearest[square(s.toward, across)];
            if first.is_none_or(|f| s.far < f.far) {
                *first = Some(*s);
            }
        }
    }
    let behind = |s: &Sight, first: &Sight| {
        let lean = first.normal.dot(s.toward);
        // Where the viewer's ray meets the plane of the nearest point.
        let plane = first.far * first.normal.dot(first.toward) / lean;
        lean.abs() > ORIENT.view_cosine && first.far.max(plane) < s.far - s.thick
    };
    let is_hidden = |s: &Sight| nearest[square(s.toward, across)].is_some_and(|first| behind(s, &first));
    let mut out = vec![false; points.len()];
    for (i, (out, s)) in out.iter_mut().zip(&sights).enumerate() {
        ctx.check_at(i)?;
        *out = s.is_some_and(|s| is_hidden(&s));
    }
    Ok(out)
}

/// How many squares a side of the cube has across, so that those in which anything is seen hold so many
/// points.
fn squares_across(sights: &[Option<Sight>], ctx: &Context<'_>) -> Result<u32> {
    let mut across = 1;
    for _ in 0..ORIENT.square_rounds {
        let mut taken = vec![false; 6 * (across * across) as usize];
        for (i, s) in sights.iter().flatten().enumerate() {
            ctx.check_at(i)?;
            taken[square(s.toward, across)] = true;
        }
        let each = sights.len() as f64 / taken.iter().filter(|t| **t).count().max(1) as f64;
        let finer = f64::from(across) * (each / ORIENT.sights_a_square).sqrt();
        across = (finer as u32).clamp(1, ORIENT.most_squares);
    }
    Ok(across)
}

/// Which square of a cube of `across` by `across` squares a side a direction leads to.
fn square(toward: Vec3, across: u32) -> usize {
    let axis = (0..3).max_by(|&a, &b| toward[a].abs().total_cmp(&toward[b].abs())).unwrap_or(0);
    let place = |k: usize| {
        let x = toward[(axis + k) % 3] / toward[axis].abs();
        ((0.5 * (x + 1.0) * f64::from(across)) as u32).min(across - 1)
    };
    let side = 2 * axis as u32 + u32::from(toward[axis] < 0.0);
    ((side * across + place(1)) * across + place(2)) as usize
}
