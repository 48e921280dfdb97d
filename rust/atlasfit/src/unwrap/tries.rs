//! Several layouts of a small surface, of which the best is kept.
//!
//! In: a surface and a bound on the stretch. Out: charts within it. Merging is greedy: which patches it
//! begins with decides a fifth of the seam, in ways that nothing tells beforehand. Where there are few faces
//! it is begun several times, with patches of other sizes, and of quads with `blocks` too.

use super::chart::{Chart, Seams};
use super::constants::UNWRAP;
use super::first::first_charts;
use super::merge::{self, Charts};
use super::segment::{self, FirstCut, Segmentation};
use super::surface::Surface;
use crate::error::Result;
use crate::run::{Context, Stage};
use rayon::prelude::*;

/// Charts that are stretched by `bound` at most, the best of as many tries as `UNWRAP.faces_tried` allows:
/// see [`rank`].
pub(super) fn best_charts(
    s: &Surface,
    bound: f64,
    most: Option<usize>,
    ctx: &Context<'_>,
) -> Result<Vec<Chart>> {
    let mut patches: Vec<Segmentation> = (first_cuts(s, bound).into_par_iter())
        .map(|cut| segment::patches(s, cut, ctx))
        .collect::<Result<_>>()?;
    // The same patches again would give the same charts.
    let mut i = 0;
    while i < patches.len() {
        if patches[..i].iter().any(|p| p.label == patches[i].label) {
            patches.remove(i);
        } else {
            i += 1;
        }
    }
    ctx.stage(Stage::Parametrize, patches.iter().map(|p| p.count).sum());
    let made: Vec<Charts> = patches.par_iter().map(|p| merged(s, p, bound, ctx)).collect::<Result<_>>()?;
    let ranked = made.into_iter().map(|charts| (rank(s, &charts, bound, most), charts));
    let best = ranked.min_by(|(x, _), (y, _)| x.0.cmp(&y.0).then(x.1.total_cmp(&y.1)));
    let Some((_, mut charts)) = best else { return Ok(Vec::new()) };
    merge::run_straight(s, &mut charts, bound, ctx)?;
    Ok(charts.list.into_iter().flatten().collect())
}

/// What counts of a layout, the less the better: how many charts it has more than `most`, if that is given;
/// then what seams, their turns, and the page that charts waste cost.
fn rank(s: &Surface, charts: &Charts, bound: f64, most: Option<usize>) -> (usize, f64) {
    let list = || charts.list.iter().flatten();
    let seams = list().fold(Seams::default(), |sum, c| sum.with(c.seams(s)));
    let waste = merge::price_of_waste(bound) * list().map(|c| c.waste).sum::<f64>();
    let cost = 0.5 * seams.cost + merge::turns(s, charts) + waste;
    (most.map_or(0, |most| list().count().saturating_sub(most)), cost)
}

/// The first cuts that are tried, the usual one first.
fn first_cuts(s: &Surface, bound: f64) -> Vec<FirstCut> {
    let usual = usual_flatness(bound);
    // A quad is two faces.
    let polygons = s.cells.as_ref().map_or(s.faces(), |cells| cells.count().max(s.faces() / 2));
    let tries = (UNWRAP.faces_tried / polygons.max(1)).max(1);
    let kinds: &[bool] = if s.cells.is_some() { &[false, true] } else { &[false] };
    (UNWRAP.flatnesses.iter())
        .flat_map(|&of| kinds.iter().map(move |&blocks| FirstCut { flatness: usual * of, blocks }))
        .take(tries)
        .collect()
}

/// Bound on 1 - |mean normal| of a patch for a bound on the stretch.
pub(super) fn usual_flatness(bound: f64) -> f64 {
    UNWRAP.flatness * ((bound - 1.0) / 0.1).clamp(UNWRAP.least_flatness, UNWRAP.most_flatness)
}

/// The charts that patches are merged into.
fn merged(s: &Surface, patches: &Segmentation, bound: f64, ctx: &Context<'_>) -> Result<Charts> {
    let first = first_charts(s, &patches.label, patches.count, Some(bound), ctx)?;
    let mut charts = Charts::new(s.faces(), first);
    merge::merge(s, &mut charts, bound, ctx)?;
    merge::shorten_borders(s, &mut charts, bound, ctx)?;
    merge::spend(s, &mut charts, bound, ctx)?;
    Ok(charts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::geometry::TriMesh;
    use crate::unwrap::options::UnwrapOptions;
    use std::f64::consts::TAU;

    #[test]
    fn the_charts_of_a_torus_of_quads_are_no_worse_than_those_of_the_usual_cut() {
        let (n, m) = (40, 12);
        let point = |k: usize| {
            let ((s, c), (t, d)) =
                ((TAU * (k / m) as f64 / n as f64).sin_cos(), (TAU * (k % m) as f64 / m as f64).sin_cos());
            [(1.0 + 0.3 * d) * c, (1.0 + 0.3 * d) * s, 0.3 * t]
        };
        let quad = |k: usize| {
            let at = |i: usize, j: usize| ((i % n) * m + j % m) as u32;
            let (i, j) = (k / m, k % m);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        let mesh = TriMesh::new((0..n * m).map(point).collect(), (0..n * m).flat_map(quad).collect());
        let options = UnwrapOptions {
            face_polygon: Some((0..2 * n * m).map(|f| f as u32 / 2).collect()),
            ..UnwrapOptions::default()
        };
        let seam = |charts: Vec<Chart>, s: &Surface| charts.iter().map(|c| c.seams(s).length).sum::<f64>();
        let [usual, best] = Run::default()
            .execute(|ctx| {
                let s = Surface::new(&mesh, &options, ctx)?;
                let cuts = first_cuts(&s, 1.1);
                assert_eq!(cuts.len(), 10);
                let usual = merged(&s, &segment::patches(&s, cuts[0], ctx)?, 1.1, ctx)?;
                let usual = usual.list.into_iter().flatten().collect();
                Ok([seam(usual, &s), seam(best_charts(&s, 1.1, None, ctx)?, &s)])
            })
            .unwrap();
        assert!(best < usual, "{best} after {usual}");
    }
}
