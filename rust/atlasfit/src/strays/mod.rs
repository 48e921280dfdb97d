//! Which charts lie on surface, and which were laid through strays.
//!
//! In: points and fitted charts. Out: the charts that stand. A chart stands when its points speak for a sheet
//! beyond doubt (those of a much thinner chart say nothing for a thick one), when it goes on from one that
//! stands, or when what else there is speaks for it: a slab thicker than the noise, or points as dense as the
//! surface about them. What is left are strays.

mod charted;
mod clumps;
pub(crate) mod constants;
mod density;
mod evidence;
mod groups;
mod odds;
mod overlaps;
mod parts;
mod shares;

use crate::atlas::{FittedChart, Map};
use crate::error::Result;
use crate::numeric::dense::principal;
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::partition::Cut;
use crate::partition::constants::PARTITION;
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::neighbours::Neighbour;
pub(crate) use charted::Charted;
use constants::STRAYS;
use evidence::Sheet;
use overlaps::{Overlap, overlaps};
use rayon::prelude::*;

/// Whether each chart stands; all do where none has enough points to stand beyond doubt.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn standing(charted: &Charted<'_>, ctx: &Context<'_>) -> Result<Vec<bool>> {
    let mut evidence = of_charts(charted, ctx)?;
    let enough = STRAYS.beyond_chance + (evidence.len().max(1) as f64).ln();
    look_wider(charted, &mut evidence, enough, ctx)?;
    let mut sure: Vec<bool> = evidence.iter().map(|&e| e > enough).collect();
    judge_thick(charted, &mut evidence, &sure, ctx)?;
    sure.iter_mut().zip(&evidence).for_each(|(s, &e)| *s = e > enough);
    if !sure.contains(&true) {
        return Ok(vec![true; sure.len()]);
    }
    let overlaps = overlaps(charted, &sure, ctx)?;
    let mut stands = go_on(sure, &evidence, &overlaps, ctx)?;
    add_slabs(charted, &mut evidence, &mut stands, enough, ctx)?;
    groups::add_dense(charted, &mut evidence, &mut stands, &overlaps, ctx)?;
    parts::remove_doubtful(charted, &evidence, &mut stands, &overlaps, enough, ctx)?;
    Ok(stands)
}

/// Whether each chart stands, once all of the surface has its charts: not those of parts that are clumps.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn standing_at_last(charted: &Charted<'_>, ctx: &Context<'_>) -> Result<Vec<bool>> {
    let mut stands = vec![true; charted.fitted.len()];
    let overlaps = overlaps(charted, &stands, ctx)?;
    parts::remove_clumps(charted, &mut stands, &overlaps, ctx)?;
    Ok(stands)
}

/// The evidence for each chart, in nats: the least of that from all points and that from its own. Tubes have
/// been judged when they were found.
fn of_charts(charted: &Charted<'_>, ctx: &Context<'_>) -> Result<Vec<f64>> {
    let judge = |found: &mut Vec<Neighbour>, (k, f): (usize, &FittedChart)| -> Result<f64> {
        least_of_both(charted, k, found, |counts, found| of_chart(charted, f, counts, found, ctx))
    };
    charted.fitted.par_iter().enumerate().map_init(Vec::new, judge).collect()
}

/// The least evidence for a chart: that from all points, and that from those that may speak for it. `look`
/// leaves the points that it looked at: where all of them may, both are the same.
fn least_of_both(
    charted: &Charted<'_>,
    chart: usize,
    found: &mut Vec<Neighbour>,
    look: impl Fn(&dyn Fn(u32) -> bool, &mut Vec<Neighbour>) -> Result<f64>,
) -> Result<f64> {
    let row = is_row(charted, chart);
    let speaks = |m: u32| speaks_for(charted, chart, m) && !(row && crosses_it(charted, chart, m));
    let all = look(&|_| true, found)?;
    if found.iter().all(|f| speaks(f.index)) { Ok(all) } else { Ok(all.min(look(&speaks, found)?)) }
}

/// Whether a point may speak for a chart. One that lies on others only does not: a chart through a few strays
/// may cut through the surface, and finds many points beside it there.
fn speaks_for(charted: &Charted<'_>, chart: usize, point: u32) -> bool {
    let on = charted.members.of(point as usize);
    on.is_empty() || on.iter().any(|c| c.0 as usize == chart)
}

/// Whether a chart's points lie in a row, hardly wider than thick: where a scan line or a step of depth cuts
/// a surface. Such a row is flat in many planes.
fn is_row(charted: &Charted<'_>, chart: usize) -> bool {
    let f = &charted.fitted[chart];
    let points = f.members.iter().map(|&(m, w)| (charted.cut.points[m as usize], f64::from(w)));
    principal(points).is_some_and(|p| p.variances[1].sqrt() < STRAYS.row * f.chart.sigma)
}

/// Whether a larger chart that explains the point well crosses this one there.
fn crosses_it(charted: &Charted<'_>, chart: usize, point: u32) -> bool {
    let this = &charted.fitted[chart].chart;
    charted.members.of(point as usize).iter().any(|&(c, weight)| {
        let other = &charted.fitted[c as usize].chart;
        weight > STRAYS.explained && other.support > this.support && cross(&this.map, &other.map)
    })
}

/// Whether two sheets cross rather than go on as one another.
fn cross(a: &Map, b: &Map) -> bool {
    let (Map::Monge(a), Map::Monge(b)) = (a, b) else { return false };
    a.axes[2].dot(b.axes[2]).abs() < STRAYS.crossing
}

/// The evidence for a chart from the points that `counts`.
fn of_chart(
    charted: &Charted<'_>,
    f: &FittedChart,
    counts: impl Fn(u32) -> bool,
    found: &mut Vec<Neighbour>,
    ctx: &Context<'_>,
) -> Result<f64> {
    ctx.check()?;
    let Cut { points, tree, .. } = charted.cut;
    let Some(sheet) = sheet(charted, f) else { return Ok(f64::INFINITY) };
    let data = evidence::of_sheet(points, tree, &sheet, counts, found);
    Ok(data - evidence::cost_of_noise(sheet.sigma, sheet.usual))
}

/// Looks farther about the charts that are not sure: those are that have `enough` evidence there.
fn look_wider(charted: &Charted<'_>, evidence: &mut [f64], enough: f64, ctx: &Context<'_>) -> Result<()> {
    let Cut { points, tree, .. } = charted.cut;
    let look = |found: &mut Vec<Neighbour>, ((k, f), e): ((usize, &FittedChart), &mut f64)| {
        ctx.check()?;
        if let Some(sheet) = sheet(charted, f).filter(|_| *e <= enough) {
            let wide = least_of_both(charted, k, found, |counts, found| {
                Ok(evidence::of_wide_sheet(points, tree, &sheet, counts, found))
            })?;
            let wide = wide - evidence::cost_of_noise(sheet.sigma, sheet.usual);
            if wide > enough {
                *e = wide;
            }
        }
        Ok(())
    };
    let charts = charted.fitted.par_iter().enumerate();
    charts.zip(evidence).map_init(Vec::new, |found, x| look(found, x)).collect()
}

/// A chart as a sheet; none for a tube.
fn sheet<'a>(charted: &Charted<'_>, f: &'a FittedChart) -> Option<Sheet<'a>> {
    let Map::Monge(map) = &f.chart.map else { return None };
    let members = f.members.iter().map(|m| f64::from(charted.cut.sampling.spacing[m.0 as usize]));
    let spacing = median(&mut members.collect::<Vec<_>>());
    Some(Sheet { map, sigma: f.chart.sigma, usual: charted.noise_of(f), spacing })
}

/// Judges those charts again that claim points of much thinner ones: these explain the points better, so
/// that they say nothing for the thick chart. A slab through a rope, or from a stray to the surface beside
/// it, has few others. No chart gains by it: what else speaks against one still does.
fn judge_thick(charted: &Charted<'_>, evidence: &mut [f64], sure: &[bool], ctx: &Context<'_>) -> Result<()> {
    let mut thinnest = vec![f64::INFINITY; charted.cut.points.len()];
    for (f, _) in charted.fitted.iter().zip(sure).filter(|(_, s)| **s) {
        for m in &f.members {
            let least = &mut thinnest[m.0 as usize];
            *least = least.min(f.chart.sigma);
        }
    }
    // Beyond two standard deviations of how noise varies it is not the noise that makes the chart thick.
    let thinner = (-2.0 * STRAYS.noise_varies).exp();
    let judge = |found: &mut Vec<Neighbour>, ((f, sure), e): ((&FittedChart, &bool), &mut f64)| {
        let own = |m: u32| thinnest[m as usize] > thinner * f.chart.sigma;
        if *sure && !f.members.iter().all(|m| own(m.0)) {
            *e = e.min(of_chart(charted, f, own, found, ctx)?);
        }
        Ok(())
    };
    charted.fitted.par_iter().zip(sure).zip(evidence).map_init(Vec::new, judge).collect()
}

/// Adds the charts that go on from those that stand, those that go on from these, and so on, as far as their
/// own points do not speak against them.
fn go_on(
    mut stands: Vec<bool>,
    evidence: &[f64],
    overlaps: &[Overlap],
    ctx: &Context<'_>,
) -> Result<Vec<bool>> {
    let mut open: Vec<&Overlap> = overlaps.iter().collect();
    loop {
        ctx.check()?;
        open.retain(|o| !stands[o.a as usize] || !stands[o.b as usize]);
        let mut votes = vec![[0.0; 2]; stands.len()];
        for o in &open {
            for (from, to) in [(o.a as usize, o.b as usize), (o.b as usize, o.a as usize)] {
                if stands[from] && !stands[to] {
                    votes[to][0] += o.one;
                    votes[to][1] += o.apart;
                }
            }
        }
        let goes_on = |k: usize| {
            let [one, apart] = votes[k];
            !stands[k] && evidence[k] > 0.0 && one >= STRAYS.shared && one > apart
        };
        let more: Vec<usize> = (0..stands.len()).filter(|&k| goes_on(k)).collect();
        if more.is_empty() {
            return Ok(stands);
        }
        more.into_iter().for_each(|k| stands[k] = true);
    }
}

/// Adds the charts about which the points that no other explains lie in a slab.
fn add_slabs(
    charted: &Charted<'_>,
    evidence: &mut [f64],
    stands: &mut [bool],
    enough: f64,
    ctx: &Context<'_>,
) -> Result<()> {
    let explained = charted.explained(stands);
    let left: Vec<Vec3> =
        charted.cut.points.iter().zip(&explained).filter(|(_, e)| !**e).map(|(p, _)| *p).collect();
    if left.len() < PARTITION.min_members {
        return Ok(());
    }
    let tree = Neighbours::build(&left, ctx)?;
    let slabs: Vec<f64> = charted
        .fitted
        .par_iter()
        .zip(&*stands)
        .map_init(Vec::new, |found, (f, stands)| {
            ctx.check()?;
            if *stands || f.members.iter().all(|m| explained[m.0 as usize]) {
                return Ok(f64::NEG_INFINITY);
            }
            let place = f.chart.at([0.0; 2]).position;
            Ok(evidence::of_slab(&left, &tree, place, charted.noise_of(f), found))
        })
        .collect::<Result<_>>()?;
    for ((e, s), slab) in evidence.iter_mut().zip(stands).zip(slabs) {
        if slab > enough {
            *e = slab;
            *s = true;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blend::membership;
    use crate::numeric::Rng;
    use crate::run::Run;
    use crate::spatial::spacing::Sampling;

    #[test]
    fn points_of_another_chart_alone_do_not_speak_for_one_through_strays() {
        let mut rng = Rng::new(1);
        let mut at = |x: f64, y: f64| Vec3([x, y, 0.1 * rng.normal()]);
        let mut points: Vec<Vec3> =
            (0..400).map(|i| at(f64::from(i % 20) - 9.5, f64::from(i / 20) - 9.5)).collect();
        points.extend((0..8).map(|i| at(4.0 * f64::from(i % 3) - 4.2, 4.0 * f64::from(i / 3) - 4.2)));
        let fitted = [0..400, 400..408].map(|points| FittedChart::flat(12.0, 0.1, points));
        let sampling = Sampling::new((0..408).map(|i| if i < 400 { 1.0 } else { 4.0 }).collect());
        let evidence = Run::default().execute(|ctx| {
            let members = membership::of_points(&(0..408).collect::<Vec<_>>(), &fitted, ctx)?;
            let tree = Neighbours::build(&points, ctx)?;
            let cut = Cut::whole(&points, &tree, &sampling, 0.1);
            let charted = Charted { cut, fitted: &fitted, members: &members };
            let all = of_chart(&charted, &fitted[1], |_| true, &mut Vec::new(), ctx)?;
            Ok((of_charts(&charted, ctx)?, all))
        });
        let (own, all) = evidence.unwrap();
        assert!(own[0] > 20.0 && all > 100.0 && own[1] < 10.0, "{own:?} {all}");
    }
}
