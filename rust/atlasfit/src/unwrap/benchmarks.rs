//! Steps of [`super::unwrap`] one by one, for `benches/`. No part of the public API: it may change in any
//! version.
//!
//! In: a mesh that is small enough to be unwrapped without a coarse stand-in. Out: for each step, how many
//! patches or charts there are after it.

use super::chart::Chart;
use super::checked::pack_checked;
use super::constants::UNWRAP;
use super::first::first_charts;
use super::merge::{self, Charts};
use super::options::UnwrapOptions;
use super::pack::Packing;
use super::segment::{self, FirstCut};
use super::surface::Surface;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::run::Run;

/// What is cut first.
const CUT: FirstCut = FirstCut { flatness: UNWRAP.flatness, blocks: false };

/// A mesh, and what each step starts from.
pub struct Steps {
    options: UnwrapOptions,
    surface: Surface,
    first: Vec<Chart>,
    merged: Vec<Chart>,
}

/// What merging starts from: it takes it apart.
pub struct First(Charts);

/// What packing starts from: it takes it apart.
pub struct Merged(Vec<Chart>);

impl Steps {
    /// Runs all steps once, with default options, and keeps what each starts from.
    ///
    /// # Errors
    /// Those of [`super::unwrap`].
    pub fn new(mesh: &TriMesh) -> Result<Self> {
        let options = UnwrapOptions::default();
        let bound = options.max_stretch;
        Run::default().execute(|ctx| {
            let surface = Surface::new(mesh, &options, ctx)?;
            let patches = segment::patches(&surface, CUT, ctx)?;
            let first = first_charts(&surface, &patches.label, patches.count, Some(bound), ctx)?;
            let mut charts = Charts::new(surface.faces(), first.clone());
            merge::merge(&surface, &mut charts, bound, ctx)?;
            let merged = charts.list.into_iter().flatten().collect();
            Ok(Self { options, surface, first, merged })
        })
    }

    /// Cuts the mesh into nearly flat patches; how many.
    ///
    /// # Errors
    /// None but those of a limited run.
    pub fn segment(&self) -> Result<usize> {
        Run::default().execute(|ctx| Ok(segment::patches(&self.surface, CUT, ctx)?.count))
    }

    /// The charts that are merged.
    #[must_use]
    pub fn first(&self) -> First {
        First(Charts::new(self.surface.faces(), self.first.clone()))
    }

    /// Merges charts; how many are left.
    ///
    /// # Errors
    /// None but those of a limited run.
    pub fn merge(&self, first: First) -> Result<usize> {
        let First(mut charts) = first;
        Run::default().execute(|ctx| {
            merge::merge(&self.surface, &mut charts, self.options.max_stretch, ctx)?;
            Ok(charts.list.iter().flatten().count())
        })
    }

    /// The charts that are packed.
    #[must_use]
    pub fn merged(&self) -> Merged {
        Merged(self.merged.clone())
    }

    /// Packs charts by their shapes; how many.
    ///
    /// # Errors
    /// None but those of a limited run.
    pub fn pack(&self, merged: Merged) -> Result<usize> {
        let packing = Packing::Own(self.options.packer);
        Run::default().execute(|ctx| {
            Ok(pack_checked(&self.surface, merged.0, &self.options, packing, ctx)?.charts.len())
        })
    }
}
