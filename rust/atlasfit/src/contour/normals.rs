//! The surface's normal at a place, from the charts there.
//!
//! In: the charts of a block and a place. Out: their normal, or that of one side of a crease, and the chart
//! that weighs most; how far from its charts it was contoured.

use super::constants::CONTOUR;
use crate::blend::blocks::{BlockChart, Grid};
use crate::blend::corners::thickening;
use crate::numeric::vec3::Vec3;

/// A chart as it looks at a place, in the gauge of a block.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    weight: f64,
    normal: Vec3,
    /// The way to it from where it was contoured.
    put_back: Vec3,
    pub(super) index: u32,
}

/// The charts of a block at a place. Those that pass nearest weigh most.
#[derive(Default)]
pub(super) struct Charts(Vec<Seen>);

impl Charts {
    /// Looks at them from `p`.
    pub(super) fn at(&mut self, grid: &Grid<'_>, block: usize, p: Vec3) -> &[Seen] {
        let h = grid.side(block);
        let near2 = CONTOUR.near2 * h * h;
        self.0.clear();
        self.0.extend(grid.charts_of(block).filter_map(|BlockChart { index, chart, sign }| {
            let v = chart.view(p)?;
            let weight = v.weight * v.mask / (v.distance * v.distance + near2);
            let put_back = v.normal * -thickening(v.radius, h);
            Some(Seen { weight, normal: v.normal * sign, put_back, index })
        }));
        &self.0
    }
}

/// The one that weighs most; none where none has a weight.
pub(super) fn heaviest(charts: &[Seen]) -> Option<&Seen> {
    charts.iter().filter(|c| c.weight > 0.0).reduce(|best, c| if c.weight > best.weight { c } else { best })
}

/// The way from where the surface was contoured to where it is.
pub(super) fn put_back(charts: &[Seen]) -> Vec3 {
    let total: f64 = charts.iter().map(|c| c.weight).sum();
    let sum = charts.iter().fold(Vec3::ZERO, |sum, c| sum + c.put_back * c.weight);
    if total > 0.0 { sum * (1.0 / total) } else { Vec3::ZERO }
}

/// Their unit normal; zero without charts.
pub(super) fn normal(charts: &[Seen]) -> Vec3 {
    charts.iter().fold(Vec3::ZERO, |sum, c| sum + c.normal * c.weight).normalized()
}

/// The unit normal of those that look like the heaviest; zero without charts.
pub(super) fn normal_of_side(charts: &[Seen]) -> Vec3 {
    let lead = heaviest(charts).map_or(Vec3::ZERO, |c| c.normal);
    let share = |n: Vec3| ((n.dot(lead) - CONTOUR.one_side) / (1.0 - CONTOUR.one_side)).max(0.0).powi(2);
    charts.iter().fold(Vec3::ZERO, |sum, c| sum + c.normal * (c.weight * share(c.normal))).normalized()
}
