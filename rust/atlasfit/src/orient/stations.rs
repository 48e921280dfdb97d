//! Where several scanners stood that measured a scan from within, if they did: the stations of a survey.
//!
//! In: points on the atlas and their spacing. Out: the stations, or none. As for one scanner
//! ([`find_scanner`](super::find_scanner)), a point at distance r, where the surface leans by an angle whose
//! cosine is c, is measured c / r² as densely; of several stations the densities add up, those of the ones
//! that the point faces. A scan is densest about the feet of its stations, so that these are where the search
//! begins, on one side of the surface and on the other. Which side they were on is decided by likelihood.

use super::constants::ORIENT;
use super::scanner::{Seen, compass, deviation, falling};
use crate::atlas::{ProjectedPoint, Vote};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;
use std::collections::BTreeMap;

/// What stations on one side of the surface explain.
struct Explained {
    stations: Vec<Vec3>,
    /// The logarithm of how much likelier the scan is with them than with a density that only falls along
    /// some direction, less what each of them costs.
    gain: f64,
    /// Share of the spacings' variance that they explain.
    share: f64,
    /// Share of the points that face the station that saw them best.
    facing: f64,
}

/// The stations, in the normalised frame; none where the scan does not ask for them. `part` names the
/// connected part of the surface that each chart is of. The largest part decides.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn find_stations(
    projected: &[ProjectedPoint],
    spacing: &[f32],
    part: &[u32],
    ctx: &Context<'_>,
) -> Result<Vec<Vec3>> {
    let (seen, points) = of_largest_part(projected, spacing, part, ctx)?;
    let even = deviation(seen.iter().map(|s| s.log_area).collect());
    if seen.len() < ORIENT.station_points || even < ORIENT.station_uneven {
        return Ok(Vec::new());
    }
    let feet = feet(&seen, ctx)?;
    let measured = (points as f64 / ORIENT.shared).min(seen.len() as f64);
    let turned =
        |side: f64| -> Vec<Seen> { seen.iter().map(|s| Seen { normal: s.normal * side, ..*s }).collect() };
    let on = |side: f64| explained(&turned(side), &feet, measured, even, ctx);
    let (one, other) = rayon::join(|| on(1.0), || on(-1.0));
    let (one, other) = (one?, other?);
    let (better, worse) = if one.gain > other.gain { (one, other) } else { (other, one) };
    let sure = better.gain > worse.gain.max(0.0) + ORIENT.station_margin
        && better.share > ORIENT.station_explained
        && better.facing > 1.0 - ORIENT.turned_away;
    Ok(if sure { better.stations } else { Vec::new() })
}

/// How the points, as they face now, vote on each chart's side when scanners stood at these stations: for the
/// side that faces those that saw most of them.
pub(crate) fn votes_toward(stations: &[Vec3], projected: &[ProjectedPoint], charts: usize) -> Vec<Vote> {
    let mut votes = vec![Vote::default(); charts];
    for p in projected {
        if let Some(vote) = votes.get_mut(p.chart as usize) {
            let (mut sum, mut all) = (0.0, 0.0);
            for &v in stations {
                let ray = v - p.position;
                let cosine = ray.normalized().dot(p.normal);
                let seen = cosine.abs() / ray.dot(ray).max(1e-12);
                sum += seen * cosine;
                all += seen;
            }
            vote.add(if all > 0.0 { sum / all } else { 0.0 });
        }
    }
    votes
}

/// A sample of the points of the part that has most of them, and how many it has.
fn of_largest_part(
    projected: &[ProjectedPoint],
    spacing: &[f32],
    part: &[u32],
    ctx: &Context<'_>,
) -> Result<(Vec<Seen>, usize)> {
    let part_of = |p: &ProjectedPoint| part.get(p.chart as usize).copied();
    let mut count = BTreeMap::<u32, usize>::new();
    for (i, p) in projected.iter().enumerate() {
        ctx.check_at(i)?;
        if let Some(part) = part_of(p) {
            *count.entry(part).or_default() += 1;
        }
    }
    let Some((&largest, &points)) = count.iter().max_by_key(|(part, n)| (**n, std::cmp::Reverse(**part)))
    else {
        return Ok((Vec::new(), 0));
    };
    let stride = points.div_ceil(ORIENT.scanner_sample).max(1);
    let on = (projected.iter().zip(spacing)).filter(|(p, _)| part_of(p) == Some(largest));
    let seen = on.step_by(stride).map(|(p, &s)| Seen {
        position: p.position,
        normal: p.normal,
        log_area: 2.0 * f64::from(s).ln(),
    });
    Ok((seen.collect(), points))
}

/// The places where the points are densest, one for each some way about it.
fn feet(seen: &[Seen], ctx: &Context<'_>) -> Result<Vec<usize>> {
    let at: Vec<Vec3> = seen.iter().map(|s| s.position).collect();
    let tree = Neighbours::build(&at, ctx)?;
    let mut near = Vec::new();
    let mut area: Vec<(f64, usize)> = Vec::with_capacity(seen.len());
    for (i, &p) in at.iter().enumerate() {
        ctx.check_at(i)?;
        tree.nearest(p, ORIENT.foot_points, &mut near);
        let sum: f64 = near.iter().map(|n| seen[n.index as usize].log_area).sum();
        area.push((sum / near.len() as f64, i));
    }
    area.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut feet: Vec<usize> = Vec::new();
    for &(_, i) in &area[..area.len() / 2] {
        if feet.iter().all(|&f| at[f].dist2(at[i]) > ORIENT.feet_apart.powi(2)) {
            feet.push(i);
            if feet.len() == ORIENT.most_stations {
                break;
            }
        }
    }
    Ok(feet)
}

/// How densely a station at `v` measures a point that faces this way: 1 at a distance of 1, head-on.
fn density(s: &Seen, v: Vec3) -> f64 {
    let ray = v - s.position;
    let r2 = ray.dot(ray).max(1e-9);
    (ray.dot(s.normal) / r2.sqrt()).max(ORIENT.away) / r2
}

/// The misfit of stations that measure the points so densely in all.
fn misfit(seen: &[Seen], density: &[f64]) -> f64 {
    deviation(seen.iter().zip(density).map(|(s, d)| s.log_area + d.ln()).collect())
}

/// A set of stations, and how densely each measures each point.
struct Fit<'a> {
    seen: &'a [Seen],
    stations: Vec<Vec3>,
    of_each: Vec<Vec<f64>>,
    sum: Vec<f64>,
}

impl<'a> Fit<'a> {
    fn new(seen: &'a [Seen], stations: Vec<Vec3>) -> Self {
        let of_each: Vec<Vec<f64>> =
            stations.iter().map(|&v| seen.iter().map(|s| density(s, v)).collect()).collect();
        let mut fit = Self { seen, stations, of_each, sum: Vec::new() };
        fit.add_up();
        fit
    }

    fn add_up(&mut self) {
        self.sum = (0..self.seen.len()).map(|i| self.of_each.iter().map(|d| d[i]).sum()).collect();
    }

    /// The misfit with station `k` elsewhere, or without it.
    fn with(&self, k: usize, to: Option<Vec3>) -> f64 {
        let changed = self.seen.iter().zip(&self.sum).zip(&self.of_each[k]).map(|((s, sum), own)| {
            let others = (sum - own).max(0.0);
            (others + to.map_or(0.0, |v| density(s, v))).max(1e-12)
        });
        misfit(self.seen, &changed.collect::<Vec<_>>())
    }

    /// Takes stations out as long as the scan is likelier without one, each costing three numbers (Schwarz
    /// 1978).
    fn thin_out(&mut self, measured: f64, ctx: &Context<'_>) -> Result<()> {
        while self.stations.len() > 1 {
            ctx.check()?;
            let without = (0..self.stations.len()).map(|k| (self.with(k, None), k));
            let Some((least, k)) = without.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
            if measured * (least / misfit(self.seen, &self.sum)).ln() >= cost(measured) {
                break;
            }
            self.stations.remove(k);
            self.of_each.remove(k);
            self.add_up();
        }
        Ok(())
    }

    /// Compass search, station by station.
    fn descend(&mut self, step: f64, rounds: usize, ctx: &Context<'_>) -> Result<()> {
        let mut steps = vec![step; self.stations.len()];
        let mut least = misfit(self.seen, &self.sum);
        for _ in 0..rounds {
            for (k, step) in steps.iter_mut().enumerate() {
                ctx.check()?;
                let from = self.stations[k];
                let next = compass(from, *step)
                    .map(|v| (self.with(k, Some(v)), v))
                    .min_by(|a, b| a.0.total_cmp(&b.0));
                match next {
                    Some((misfit, v)) if misfit < least => {
                        least = misfit;
                        let own: Vec<f64> = self.seen.iter().map(|s| density(s, v)).collect();
                        let old = std::mem::replace(&mut self.of_each[k], own);
                        for ((sum, old), new) in self.sum.iter_mut().zip(old).zip(&self.of_each[k]) {
                            *sum = (*sum - old + new).max(1e-12);
                        }
                        self.stations[k] = v;
                    }
                    _ => *step *= 0.5,
                }
            }
        }
        Ok(())
    }
}

/// What a station costs, in nats: three numbers known from so many measurements.
fn cost(measured: f64) -> f64 {
    1.5 * measured.max(1.0).ln()
}

/// The stations on the side that the points face which explain their density best.
fn explained(
    seen: &[Seen],
    feet: &[usize],
    measured: f64,
    even: f64,
    ctx: &Context<'_>,
) -> Result<Explained> {
    let mut stations = Vec::new();
    for &f in feet {
        let foot = seen[f];
        let about = |s: &&Seen| s.position.dist2(foot.position) < ORIENT.foot_reach.powi(2);
        let near: Vec<Seen> = seen.iter().filter(about).copied().collect();
        let starts = ORIENT.station_heights.iter().map(|h| {
            let v = foot.position + foot.normal * *h;
            (misfit(&near, &near.iter().map(|s| density(s, v)).collect::<Vec<_>>()), *h, v)
        });
        let Some((_, height, v)) = starts.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        let mut fit = Fit::new(&near, vec![v]);
        fit.descend(0.5 * height, ORIENT.station_rounds, ctx)?;
        stations.append(&mut fit.stations);
    }
    let mut fit = Fit::new(seen, stations);
    fit.thin_out(measured, ctx)?;
    fit.descend(ORIENT.station_step, ORIENT.station_rounds, ctx)?;
    fit.thin_out(measured, ctx)?;
    let spread = misfit(seen, &fit.sum);
    let faces = |(i, s): (usize, &Seen)| {
        let best = (0..fit.stations.len()).max_by(|&a, &b| fit.of_each[a][i].total_cmp(&fit.of_each[b][i]));
        best.is_some_and(|k| (fit.stations[k] - s.position).dot(s.normal) > 0.0)
    };
    let facing = seen.iter().enumerate().filter(|&s| faces(s)).count() as f64 / seen.len() as f64;
    let gain =
        measured * (falling(seen) / spread.max(1e-12)).ln() - cost(measured) * fit.stations.len() as f64;
    Ok(Explained { gain, share: 1.0 - (spread / even).powi(2), facing, stations: fit.stations })
}

#[cfg(test)]
mod tests {
    use super::super::scanner::tests::wall;
    use super::*;
    use crate::Run;
    use crate::numeric::Rng;

    /// Points of a long room that faces out, as stations in it see it, or evenly by area; with their spacing.
    fn hall(stations: &[Vec3], each: usize) -> (Vec<ProjectedPoint>, Vec<f32>) {
        let mut rng = Rng::new(5);
        let mut on = Vec::new();
        let from = if stations.is_empty() { &[Vec3::ZERO][..] } else { stations };
        for &v in from {
            for _ in 0..each {
                on.push(wall(v, Vec3::from_fn(|_| rng.normal()).normalized()));
            }
        }
        let spacing = on.iter().map(|&(position, normal)| {
            let seen = Seen { position, normal: -normal, log_area: 0.0 };
            let sum: f64 = stations.iter().map(|&v| density(&seen, v)).sum();
            let area = if stations.is_empty() { 1.0 } else { 1.0 / sum };
            (0.02 * area.sqrt() * (0.2 * rng.normal()).exp()) as f32
        });
        let spacing = spacing.collect();
        (
            on.into_iter().map(|(position, normal)| ProjectedPoint { position, normal, chart: 0 }).collect(),
            spacing,
        )
    }

    fn found(points: &[ProjectedPoint], spacing: &[f32]) -> Vec<Vec3> {
        Run::default().execute(|ctx| find_stations(points, spacing, &[0], ctx)).unwrap()
    }

    #[test]
    fn a_hall_faces_the_stations_within_it() {
        let at = [[-0.35, 0.1, -0.12], [0.05, -0.1, -0.12], [0.35, 0.15, -0.12]].map(Vec3);
        let (points, spacing) = hall(&at, 2000);
        let found = found(&points, &spacing);
        assert!(!found.is_empty());
        let inside = |v: &Vec3| v[0].abs() < 0.5 && v[1].abs() < 0.4 && v[2].abs() < 0.25;
        assert!(at.iter().all(|v| found.iter().any(|f| f.dist2(*v) < 0.1f64.powi(2))), "{found:?}");
        assert!(found.iter().filter(|f| inside(f)).count() * 2 > found.len(), "{found:?}");
        let vote = votes_toward(&found, &points, 1)[0];
        assert!(vote.sum < -0.9 * points.len() as f64 * 0.5, "{vote:?}");
    }

    #[test]
    fn an_even_scan_has_no_stations() {
        let (points, spacing) = hall(&[], 4000);
        assert!(found(&points, &spacing).is_empty());
    }
}
