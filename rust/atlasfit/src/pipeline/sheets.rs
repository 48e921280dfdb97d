//! Which points lie on which sheet: charts oriented, points projected, and charts near another sheet fitted
//! anew.
//!
//! In: the first atlas. Out: an oriented atlas, each point of the scan on it. These rounds stand above
//! partition, fit, orient and blend, as they need all four.

use super::constants::PIPELINE;
use super::facing::{self, Known, Viewers};
use super::fit_atlas::{FirstAtlas, cut, drop_clumps, drop_strays, drop_strays_from};
use super::prepare::Scan;
use super::warnings;
use crate::atlas::{FittedChart, Membership, Pair, ProjectedPoint, Relation, Vote};
use crate::blend::{membership, project, trim};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::{Context, Stage};
use crate::{fit, orient, partition};

/// Charts that know of each other, and the points on them.
pub(super) struct OrientedAtlas {
    /// The charts, with their signs.
    pub fitted: Vec<FittedChart>,
    /// Which charts each point belongs to.
    pub members: Membership,
    /// How overlapping charts face each other.
    pub relations: Vec<Relation>,
    /// How opposing sheets face each other.
    pub opposing: Vec<Relation>,
    /// Pairs that the signs contradict, where the surface is one-sided.
    pub conflicts: Vec<Pair>,
    /// How the points vote on each chart's side, as the chart now faces: by the scan's known directions, or
    /// by who saw it, if they tell; else none.
    pub votes: Vec<Vote>,
    /// The points on the blended charts.
    pub projected: Vec<ProjectedPoint>,
    /// What the user should know.
    pub warning: Option<String>,
}

/// Orients the charts; twice, those near another sheet are dropped, cut and fitted anew from points of their
/// own side only. Where that fails they come back, but not through strays: an uncertain surface is better
/// than none. Parts that are clumps go in the end. `known` says where the points face, as far as that is
/// known. If not, and the points tell of one scanner, the charts face it in the end.
pub(super) fn separate(
    scan: &Scan,
    first: FirstAtlas,
    known: Option<&Known>,
    ctx: &Context<'_>,
) -> Result<OrientedAtlas> {
    let FirstAtlas { fitted, on_tubes, size } = first;
    let cut = cut(scan, size);
    let mut atlas = oriented(scan, fitted, known, ctx)?;
    for _ in 0..PIPELINE.sheet_rounds {
        let projected = &atlas.projected;
        let Some(refit) = partition::keep(&cut, &mut atlas.fitted, &on_tubes, projected, ctx)? else { break };
        let patches = partition::partition(&cut, &refit.covered, Some(projected), false, ctx)?;
        ctx.stage(Stage::Fit, patches.len());
        let mut fitted = atlas.fitted;
        fitted.extend(fit::fit(&scan.points, &patches, ctx)?);
        drop_strays(&cut, &mut fitted, ctx)?;
        // What comes back is judged anew: where strays lie, no other came because of them.
        let others = fitted.len();
        partition::restore(&mut fitted, refit.left_out, scan.points.len());
        drop_strays_from(others, &cut, &mut fitted, ctx)?;
        atlas = oriented(scan, fitted, known, ctx)?;
    }
    if drop_clumps(&cut, &mut atlas.fitted, &atlas.members, ctx)? {
        atlas = oriented(scan, atlas.fitted, known, ctx)?;
    }
    if known.is_none() {
        let part = &orient::connected(atlas.fitted.len(), &atlas.relations);
        let (projected, count) = (&atlas.projected[..], &scan.input.count[..]);
        let (sampling, cameras) = (&scan.sampling, &scan.cameras[..]);
        let looked = facing::Looked { projected, sampling, count, part, cameras };
        match facing::viewers(looked, scan.noise.sigma, scan.frame, ctx)? {
            Viewers::Cameras(known) => atlas = oriented(scan, atlas.fitted, Some(&known), ctx)?,
            // A tile may see another one than the whole does.
            Viewers::Scanners(of) if of.len() == 1 && scan.told.is_none() => {
                let toward: Vec<Vec3> = scan.points.iter().map(|p| (of[0] - *p).normalized()).collect();
                let known = Known { toward, viewpoint: None };
                atlas = oriented(scan, atlas.fitted, Some(&known), ctx)?;
            }
            // Of several it is not known which one saw a point: the two sides of a wall between two rooms,
            // say.
            Viewers::Scanners(of) => atlas.votes = orient::votes_toward(&of, projected, part.len()),
            Viewers::Above(at) => atlas.votes = orient::votes_toward(&[at], projected, part.len()),
            Viewers::Below => atlas.warning = Some(warnings::upside_down()),
            Viewers::None => {}
        }
    }
    trim::trim(&mut atlas.fitted, &atlas.projected, &scan.tree, &scan.sampling, ctx)?;
    Ok(atlas)
}

/// Turns the charts so that they agree, and projects the points onto them.
fn oriented(
    scan: &Scan,
    mut fitted: Vec<FittedChart>,
    known: Option<&Known>,
    ctx: &Context<'_>,
) -> Result<OrientedAtlas> {
    let (points, spacing) = (&scan.points, scan.sampling.median);
    let members = membership::of_points(&scan.rows, &fitted, ctx)?;
    let relations = orient::relations(points, &fitted, &members, spacing, ctx)?;
    let centers = orient::Centers::of(&fitted, ctx)?;
    let opposing = orient::opposing_sheets(points, &fitted, spacing, &centers, ctx)?;
    let beside = orient::beside(&centers, ctx)?;
    let Asked { mut votes, one_by_one } = asked(scan, known, &fitted, &members, ctx)?;
    let sheets =
        orient::Sheets { points, spacing: &scan.sampling.spacing, fitted: &fitted, members: &members };
    let found = orient::Relations { shared: &relations, opposing: &opposing, beside: &beside };
    let of_charts = if one_by_one { &votes[..] } else { &[] };
    let mut signs = orient::orient(&found, of_charts, &sheets, ctx)?;
    if !one_by_one {
        let side: Vec<f64> = votes.iter().zip(&signs.of_chart).map(|(v, sign)| v.sum * sign).collect();
        let turned = orient::to_turn(fitted.len(), &relations, &side);
        signs.of_chart.iter_mut().zip(turned).filter(|s| s.1).for_each(|(sign, _)| *sign = -*sign);
    }
    for (f, sign) in fitted.iter_mut().zip(&signs.of_chart) {
        f.chart.sign = *sign;
    }
    votes.iter_mut().zip(&signs.of_chart).for_each(|(v, sign)| v.sum *= sign);
    let projected = project::project_members(points, &fitted, &members, ctx)?;
    let (conflicts, warning) = (signs.conflicts, None);
    Ok(OrientedAtlas { fitted, members, relations, opposing, conflicts, votes, projected, warning })
}

/// How the points vote on the charts' sides.
struct Asked {
    votes: Vec<Vote>,
    /// Whether each chart goes by its own votes, not whole connected parts by all of theirs: not where much
    /// of the scan cannot have been seen from the place that is said to have seen it.
    one_by_one: bool,
}

fn asked(
    scan: &Scan,
    known: Option<&Known>,
    fitted: &[FittedChart],
    members: &Membership,
    ctx: &Context<'_>,
) -> Result<Asked> {
    let Some(Known { toward, viewpoint }) = known else {
        return Ok(Asked { votes: Vec::new(), one_by_one: true });
    };
    let thick = |i: usize| {
        let noise = scan.noise.sigma * scan.relative_noise.get(i).map_or(1.0, |r| f64::from(*r));
        PIPELINE.hidden_behind * noise.max(f64::from(scan.sampling.spacing[i]))
    };
    let points = &scan.points;
    let mut hidden = match viewpoint {
        Some(v) => orient::hidden(points, fitted, members, *v, thick, ctx)?,
        None => Vec::new(),
    };
    let count = hidden.iter().filter(|h| **h).count();
    let one_by_one = count as f64 <= PIPELINE.most_hidden * points.len() as f64;
    if one_by_one {
        hidden.clear();
    }
    Ok(Asked { votes: orient::votes(points, fitted, members, toward, &hidden, ctx)?, one_by_one })
}
