//! Steps of [`super::denoise`] one by one, for `benches/`. No part of the public API: it may change in any
//! version.
//!
//! In: a scan. Out: for each step, what it made or how much of it.

use super::fit_atlas::{cut, fit_atlas};
use super::prepare::{self, Scan};
use super::sheets::{self, OrientedAtlas};
use super::surface::distance;
use super::voxels;
use crate::atlas::{Chart, Pair, Patch, Relation};
use crate::blend::{blocks::Grid, sites};
use crate::contour::{Facing, clean, quads, surface::Contour};
use crate::error::Result;
use crate::fit;
use crate::geometry::PointCloud;
use crate::numeric::vec3;
use crate::partition::{self, PatchSize};
use crate::run::{Context, Run};

/// A scan, and what each step starts from.
pub struct Steps {
    scan: Scan,
    patches: Vec<Patch>,
    atlas: OrientedAtlas,
    charts: Vec<Chart>,
    contour: Contour,
}

/// What contouring starts from: it takes it apart.
pub struct Distance<'a>(Grid<'a>);

/// What cleaning starts from: it takes it apart.
pub struct Quads(Contour);

impl Steps {
    /// Runs all steps once and keeps what each starts from.
    ///
    /// # Errors
    /// Those of [`super::denoise`].
    pub fn new(cloud: &PointCloud) -> Result<Self> {
        Run::default().execute(|ctx| {
            let distinct = prepare::distinct(vec3::of(&cloud.positions), ctx)?;
            let mut scan = prepare::prepare(distinct, None, ctx)?;
            let first = fit_atlas(&mut scan, None, ctx)?;
            let patches = patches(&scan, ctx)?;
            let atlas = sheets::separate(&scan, first, None, ctx)?;
            let charts = atlas.fitted.iter().map(|f| f.chart.clone()).collect();
            let mut steps = Self { scan, patches, atlas, charts, contour: Contour::default() };
            let contour = quads::contour(steps.grid(ctx)?, ctx)?;
            steps.contour = contour;
            Ok(steps)
        })
    }

    /// Cuts the scan; the number of patches.
    ///
    /// # Errors
    /// None but those of a limited run.
    pub fn partition(&self) -> Result<usize> {
        Run::default().execute(|ctx| Ok(patches(&self.scan, ctx)?.len()))
    }

    /// Fits the patches; the number of charts.
    ///
    /// # Errors
    /// None but those of a limited run.
    pub fn fit(&self) -> Result<usize> {
        Run::default().execute(|ctx| Ok(fit::fit(&self.scan.points, &self.patches, ctx)?.len()))
    }

    /// The signed distance that is contoured.
    ///
    /// # Errors
    /// None but those of a limited run.
    pub fn distance(&self) -> Result<Distance<'_>> {
        Run::default().execute(|ctx| Ok(Distance(self.grid(ctx)?)))
    }

    /// Contours the distance.
    ///
    /// # Errors
    /// None but those of a limited run.
    pub fn contour(distance: Distance<'_>) -> Result<Quads> {
        Run::default().execute(|ctx| Ok(Quads(quads::contour(distance.0, ctx)?)))
    }

    /// The quads that are cleaned.
    #[must_use]
    pub fn quads(&self) -> Quads {
        Quads(self.contour.clone())
    }

    /// Makes a clean surface of the quads; the number of triangles.
    ///
    /// # Errors
    /// None but those of a limited run.
    pub fn clean(&self, quads: Quads) -> Result<usize> {
        let one_sided = !self.atlas.conflicts.is_empty();
        let facing = Facing { one_sided, votes: &[], opposing: &[] };
        Run::default()
            .execute(|ctx| Ok(clean::clean(quads.0, &self.charts, &facing, 0, ctx)?.triangles.len()))
    }

    fn grid<'a>(&'a self, ctx: &Context<'_>) -> Result<Grid<'a>> {
        let Self { scan, atlas, charts, .. } = self;
        let (sampling, sigma) = (&scan.sampling, scan.noise.for_charts());
        let spread = sites::Spread { sampling, sigma, names: &scan.rows };
        let sites =
            sites::of_points(&scan.points, &atlas.projected, &atlas.fitted, &atlas.members, spread, ctx)?;
        let (relations, conflicts): (&[Relation], &[Pair]) = (&atlas.relations, &atlas.conflicts);
        let voxels = voxels::graded(sampling, sigma, 1.0);
        distance(charts, sites, relations, conflicts, voxels, ctx)
    }
}

/// The first cut of a scan.
fn patches(scan: &Scan, ctx: &Context<'_>) -> Result<Vec<Patch>> {
    let done = vec![false; scan.points.len()];
    partition::partition(&cut(scan, PatchSize::default()), &done, None, true, ctx)
}
