//! A chart to be laid anew, in units of its own size, as the solver's numbers are.

use super::constants::STRAIGHT;
use crate::run::Context;
use crate::unwrap::chart::Chart;
use crate::unwrap::flatten::contacts::Border;
use crate::unwrap::flatten::dirichlet::harmonic;
use crate::unwrap::flatten::graph::Graph;
use crate::unwrap::flatten::newton::{Piece, Until, relax_piece};
use crate::unwrap::flatten::shape::cotangents;
use crate::unwrap::surface::Surface;

/// A chart in units of the square root of its area.
pub(super) struct Flat<'a> {
    c: &'a Chart,
    unit: f64,
    /// Rest shapes of its triangles.
    pub rest: Vec<[f64; 3]>,
}

impl<'a> Flat<'a> {
    pub(super) fn new(s: &Surface, c: &'a Chart) -> Self {
        let unit = c.area.sqrt();
        let rest = c.rest(s).into_iter().map(|r| r.map(|x| x / unit)).collect();
        Self { c, unit, rest }
    }

    /// Positions in these units.
    pub(super) fn small(&self, at: &[[f64; 2]]) -> Vec<[f64; 2]> {
        at.iter().map(|p| p.map(|x| x / self.unit)).collect()
    }

    /// Positions in the surface's units.
    pub(super) fn sized(&self, at: &[[f64; 2]]) -> Vec<[f64; 2]> {
        at.iter().map(|p| p.map(|x| x * self.unit)).collect()
    }

    /// Vertices that are not pinned at the mean of their neighbours. `None` when the run is to stop: the
    /// caller checks.
    pub(super) fn harmonic(
        &self,
        order: &[[f64; 2]],
        pinned: &[bool],
        at: &[[f64; 2]],
        ctx: &Context<'_>,
    ) -> Option<Vec<[f64; 2]>> {
        let c = self.c;
        let graph = Graph::from_triangles(c.vertices(), &c.tris, &cotangents(&self.rest), ctx);
        harmonic(&graph, order, pinned, at, ctx)
    }

    /// Newton steps on the symmetric Dirichlet energy, in which held coordinates stay. Returns the energy;
    /// `None` when the run is to stop: the caller checks.
    pub(super) fn relax(&self, uv: &mut Vec<[f64; 2]>, held: &[[bool; 2]], ctx: &Context<'_>) -> Option<f64> {
        let border = Border::of(Vec::new());
        let piece = Piece { tris: &self.c.tris, rest: &self.rest, area: 1.0, border, held };
        relax_piece(&piece, uv, Until { steps: STRAIGHT.steps, least: STRAIGHT.least, wanted: None }, ctx)
    }
}
