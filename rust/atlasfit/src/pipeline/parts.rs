//! Parts of the surface that the user does not want.
//!
//! In: the surface, the points on the charts. Out: the surface without its small parts, and which points lay
//! on those.

use super::options::DenoiseOptions;
use crate::atlas::ProjectedPoint;
use crate::contour::parts::{self, Dropped};
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::run::Context;
use crate::spatial::neighbours::Neighbours;

/// What was left out.
#[derive(Default)]
pub(super) struct LeftOut {
    /// How many parts.
    pub parts: usize,
    /// For each distinct point whether it lies on one of them; empty where none was left out.
    pub points: Vec<bool>,
}

impl LeftOut {
    /// Adds what was left out later.
    pub fn add(&mut self, later: Self) {
        self.parts += later.parts;
        if self.points.is_empty() {
            self.points = later.points;
        } else {
            self.points.iter_mut().zip(later.points).for_each(|(on, later)| *on |= later);
        }
    }
}

/// Leaves out the parts that the options do not want.
///
/// # Errors
/// [`crate::Error::InvalidArgument`] where no part is large enough; cancelled or out of time.
pub(super) fn leave_out(
    surface: &mut Surface,
    projected: &[ProjectedPoint],
    charts: usize,
    options: &DenoiseOptions,
    ctx: &Context<'_>,
) -> Result<LeftOut> {
    let dropped = parts::drop_small(surface, options.min_part, options.largest, ctx)?;
    if dropped.parts == 0 {
        return Ok(LeftOut::default());
    }
    let points = on_dropped(&dropped, surface, projected, charts, ctx)?;
    Ok(LeftOut { parts: dropped.parts, points })
}

/// Which of so many charts are among those `of` vertices.
pub(super) fn touched(of: &[u32], charts: usize) -> Vec<bool> {
    let mut touched = vec![false; charts];
    for &c in of {
        if let Some(t) = touched.get_mut(c as usize) {
            *t = true;
        }
    }
    touched
}

/// Which points lie on dropped parts: their chart weighed most at some vertex of one, and such a vertex is
/// nearer than any that stays. A chart may reach over more than one part.
fn on_dropped(
    dropped: &Dropped,
    kept: &Surface,
    projected: &[ProjectedPoint],
    charts: usize,
    ctx: &Context<'_>,
) -> Result<Vec<bool>> {
    let touched = touched(&dropped.chart, charts);
    let (gone, stays) =
        (Neighbours::build(&dropped.positions, ctx)?, Neighbours::build(&kept.positions, ctx)?);
    let mut on = Vec::with_capacity(projected.len());
    for (i, p) in projected.iter().enumerate() {
        ctx.check_at(i)?;
        let near = touched.get(p.chart as usize).is_some_and(|t| *t);
        on.push(near && gone.nearest_one(p.position).dist2 < stays.nearest_one(p.position).dist2);
    }
    Ok(on)
}
