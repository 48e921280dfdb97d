//! The charts over planes, found by their centres.
//!
//! In: charts. Out: each with its centre, and relations looked for among those near by.

use crate::atlas::{FittedChart, Foot, Map, Monge, Relation};
use crate::error::Result;
use crate::run::Context;
use crate::spatial::{Neighbour, Neighbours};
use rayon::prelude::*;

/// A chart over a plane.
pub(super) struct Center<'a> {
    pub(super) chart: u32,
    pub(super) map: &'a Monge,
    /// Its point in the middle of the domain.
    pub(super) foot: Foot,
}

/// All of them.
pub(crate) struct Centers<'a> {
    list: Vec<Center<'a>>,
    /// None without charts.
    tree: Option<Neighbours>,
}

/// The centres about one of them.
pub(super) struct About<'a> {
    all: &'a Centers<'a>,
    tree: &'a Neighbours,
    found: Vec<Neighbour>,
}

impl<'a> Centers<'a> {
    /// The centres of the charts.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(crate) fn of(fitted: &'a [FittedChart], ctx: &Context<'_>) -> Result<Self> {
        let list: Vec<Center<'a>> = (0..)
            .zip(fitted)
            .filter_map(|(chart, f)| match &f.chart.map {
                Map::Monge(map) => Some(Center { chart, map, foot: map.at([0.0; 2]) }),
                Map::Tube(_) => None,
            })
            .collect();
        let at: Vec<_> = list.iter().map(|c| c.foot.position).collect();
        let tree = if at.is_empty() { None } else { Some(Neighbours::build(&at, ctx)?) };
        Ok(Self { list, tree })
    }

    /// The relations that `look` finds from each centre.
    ///
    /// # Errors
    /// Cancelled or out of time.
    pub(super) fn relations(
        &self,
        look: impl Fn(&Center<'_>, &mut About<'_>, &mut Vec<Relation>) + Sync,
        ctx: &Context<'_>,
    ) -> Result<Vec<Relation>> {
        let Some(tree) = &self.tree else { return Ok(Vec::new()) };
        let chunks = self
            .list
            .par_chunks(64)
            .map(|chunk| {
                ctx.check()?;
                let (mut about, mut out) = (About { all: self, tree, found: Vec::new() }, Vec::new());
                chunk.iter().for_each(|center| look(center, &mut about, &mut out));
                Ok(out)
            })
            .collect::<Result<Vec<_>>>()?;
        Ok(chunks.concat())
    }
}

impl About<'_> {
    /// The centres within `radius` of `center`, itself among them, in no order.
    pub(super) fn within(&mut self, center: &Center<'_>, radius: f64) -> impl Iterator<Item = &Center<'_>> {
        self.tree.within(center.foot.position, radius, &mut self.found);
        self.found.iter().map(|f| &self.all.list[f.index as usize])
    }

    /// The `count` nearest centres, itself first.
    pub(super) fn nearest(&mut self, center: &Center<'_>, count: usize) -> impl Iterator<Item = &Center<'_>> {
        self.tree.nearest(center.foot.position, count, &mut self.found);
        self.found.iter().map(|f| &self.all.list[f.index as usize])
    }
}
