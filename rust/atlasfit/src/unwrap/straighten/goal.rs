//! What a straightened chart must hold to be accepted.

use crate::run::Context;
use crate::spatial::inject::injective;
use crate::unwrap::chart::Chart;
use crate::unwrap::constants::UNWRAP;
use crate::unwrap::flatten::newton::mean_energy;
use crate::unwrap::flatten::shape::over_area;
use crate::unwrap::surface::Surface;

/// What a straightened chart must hold.
#[derive(Clone, Copy)]
pub(super) struct Goal {
    /// The stretch bound.
    pub bound: f64,
    /// Instead of it, the bound on the mean energy.
    pub energy: Option<f64>,
}

impl Goal {
    /// The chart's area that may be stretched beyond the bound: as much as merging allows, or as much as
    /// there was.
    pub(super) fn allowed(&self, c: &Chart) -> f64 {
        if self.energy.is_some() { f64::INFINITY } else { c.over.max(UNWRAP.beyond * c.area) }
    }

    /// The chart with new positions, if it is accepted.
    pub(super) fn accepted(
        &self,
        s: &Surface,
        c: &Chart,
        uv: Vec<[f64; 2]>,
        ctx: &Context<'_>,
    ) -> Option<Chart> {
        let mut new = Chart { uv, straight: true, ..c.clone() };
        new.over = over_area(s, &new, self.bound);
        if let Some(most) = self.energy {
            (mean_energy(&new.tris, &new.rest(s), &new.uv) <= most).then_some(())?;
        }
        if new.over > self.allowed(c) || !injective(&new.tris, &new.uv, &new.border, ctx).ok()? {
            return None;
        }
        new.waste = new.wasted();
        Some(new)
    }
}
