//! What stands for the surface where only the points are wanted: nothing is contoured.
//!
//! In: the atlas and its points. Out: charts and points that face as the scan says, or as what the charts
//! enclose did; no triangles.

use super::options::DenoiseOptions;
use super::parts::LeftOut;
use super::prepare::Scan;
use super::sheets::OrientedAtlas;
use super::surface::Built;
use super::voxels;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::orient;
use crate::run::{Context, Stage};

/// Takes the points as they are on the charts.
pub(super) fn build(
    scan: Scan,
    atlas: OrientedAtlas,
    options: &DenoiseOptions,
    ctx: &Context<'_>,
) -> Result<Built> {
    let Scan { sampling, frame, noise, input, .. } = scan;
    let OrientedAtlas { fitted, relations, conflicts, votes, mut projected, .. } = atlas;
    ctx.stage(Stage::Project, 1);
    let mut charts: Vec<_> = fitted.into_iter().map(|f| f.chart).collect();
    let side: Vec<f64> = votes.iter().map(|v| v.sum).collect();
    let turned = orient::face(&mut charts, &relations, &side);
    for p in projected.iter_mut().filter(|p| turned.get(p.chart as usize).is_some_and(|t| *t)) {
        p.normal = -p.normal;
    }
    Ok(Built {
        surface: Surface::default(),
        corner_normals: None,
        extrapolated: None,
        charts,
        projected,
        voxel: voxels::graded(&sampling, noise.for_charts(), options.detail).finest,
        sampling,
        left_out: LeftOut::default(),
        filled_holes: 0,
        one_sided: !conflicts.is_empty(),
        goal: None,
        frame,
        input,
    })
}
