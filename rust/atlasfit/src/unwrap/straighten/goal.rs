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

    /// The mean energy that a chart may have: where the stretch is bounded, that of a chart whose every face
    /// is stretched by the bound. The share of the area beyond it does not see slivers that nearly vanish.
    fn most_energy(&self) -> f64 {
        self.energy.unwrap_or(2.0 * (self.bound.powi(2) + self.bound.powi(-2)))
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
        let rest = c.rest(s);
        if mean_energy(&new.tris, &rest, &new.uv) > self.most_energy().max(mean_energy(&c.tris, &rest, &c.uv))
        {
            return None;
        }
        if new.over > self.allowed(c) || !injective(&new.tris, &new.uv, &new.border, ctx).ok()? {
            return None;
        }
        new.waste = new.wasted(s.page);
        Some(new)
    }
}
