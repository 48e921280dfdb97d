//! Whether the points of some charts are a clump of strays, or two.
//!
//! In: charts that lie together, and their points. Out: the logarithm of the ratio of two likelihoods, in
//! nats: on these charts, and in clumps. On a chart points spread evenly along its sheet and scatter across
//! it by its noise; a clump scatters alike in all directions, no less than by the noise. A window on one
//! chart hardly knows them apart, as a clump is as flat there as a chart cuts it.

use super::charted::Charted;
use super::constants::STRAYS;
use super::evidence::cost_of_a_quadric;
use super::odds::Group;
use super::shares::Shares;
use crate::atlas::{FittedChart, Map, Monge};
use crate::error::Result;
use crate::numeric::dense::principal;
use crate::numeric::vec3::Vec3;
use crate::partition::constants::PARTITION;
use crate::run::Context;
use crate::spatial::neighbours::Neighbour;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Rounds in which two clumps are found (expectation and maximisation; Dempster, Laird and Rubin 1977).
/// Source: chosen, clumps that lie apart settle in a few.
const ROUNDS: usize = 20;
/// How much a point is at first that clump's on whose side it lies. In (0.5, 1). Source: chosen.
const FIRST: f64 = 0.95;
/// The least variance, so that nothing is divided by 0: in the normalised frame a millionth along an axis.
const LEAST: f64 = 1e-12;

/// Lowers the evidence for groups to what they are likelier than clumps, where that is less. `lone`, if
/// given, says which points lie on no chart: where they lie about a group its charts leave them over, a clump
/// need not.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn judge(
    charted: &Charted<'_>,
    groups: &mut [Group],
    shares: &Shares,
    lone: Option<&(dyn Fn(u32) -> bool + Sync)>,
    ctx: &Context<'_>,
) -> Result<()> {
    groups.par_iter_mut().try_for_each_init(Vec::new, |found, group| {
        ctx.check()?;
        let gain = charts_beside_clumps(charted, group, shares, lone, found, ctx)?;
        group.evidence = group.evidence.min(gain);
        Ok(())
    })
}

/// How much likelier the points are on the charts than in one clump or two, in nats. Tubes were told from
/// clumps when they were found.
fn charts_beside_clumps(
    charted: &Charted<'_>,
    group: &Group,
    shares: &Shares,
    lone: Option<&(dyn Fn(u32) -> bool + Sync)>,
    found: &mut Vec<Neighbour>,
    ctx: &Context<'_>,
) -> Result<f64> {
    let charts = group.charts.iter().map(|&k| (k as usize, &charted.fitted[k as usize]));
    let noise = charts.clone().map(|(_, f)| charted.noise_of(f)).fold(f64::INFINITY, f64::min);
    let Some(ball) = Ball::about(charted, &group.points, noise, lone, found) else {
        return Ok(f64::INFINITY);
    };
    let clumps = ball.clumps();
    let (mut own, mut area, mut across, mut cost) = (0.0, 0.0, 0.0, 0.0);
    for (k, f) in charts {
        ctx.check()?;
        let Map::Monge(map) = &f.chart.map else { return Ok(f64::INFINITY) };
        let sheet = OnSheet::new(charted, f, map);
        own += shares.points[k];
        area += shares.of(k, f) * sheet.area;
        across += shares.points[k] * sheet.across;
        cost += shares.of(k, f) * sheet.cost(f, map, ball.width);
    }
    if own <= 0.0 {
        return Ok(f64::INFINITY);
    }
    Ok(ball.on_sheets(across / own - area.ln()) - cost - clumps)
}

/// The points of a group and the lone ones about it, in the ball that reaches twice as far as the group's.
struct Ball {
    /// Some of the group's points, and some of the lone ones; of all there are so many times as many.
    own: Vec<Vec3>,
    lone: Vec<Vec3>,
    times: f64,
    volume: f64,
    /// How far the group's points scatter, standard deviation along an axis.
    width: f64,
    /// Their middle, and the direction in which they scatter most.
    middle: Vec3,
    along: Vec3,
    /// The least variance of a clump: that of the noise.
    least: f64,
}

impl Ball {
    fn about(
        charted: &Charted<'_>,
        points: &[u32],
        noise: f64,
        lone: Option<&(dyn Fn(u32) -> bool + Sync)>,
        found: &mut Vec<Neighbour>,
    ) -> Option<Self> {
        let at = |i: u32| charted.cut.points[i as usize];
        let spread = principal(points.iter().map(|&i| (at(i), 1.0)))?;
        let least = (noise * noise).max(LEAST);
        let variance = (spread.variances.iter().sum::<f64>() / 3.0).max(least);
        let radius = 2.0 * (3.0 * variance).sqrt();
        found.clear();
        if let Some(lone) = lone {
            charted.cut.tree.within(spread.mean, radius, found);
            found.retain(|f| lone(f.index));
        }
        let step = (points.len() + found.len()).div_ceil(STRAYS.most).max(1);
        Some(Self {
            own: points.iter().step_by(step).map(|&i| at(i)).collect(),
            lone: found.iter().step_by(step).map(|f| at(f.index)).collect(),
            times: step as f64,
            volume: 2.0 / 3.0 * TAU * radius.powi(3),
            width: variance.sqrt(),
            middle: spread.mean,
            along: spread.axes[2],
            least,
        })
    }
    /// The logarithm of the likelihood of all, the group's on sheets, where that of one has this mean, and
    /// the lone ones anywhere.
    fn on_sheets(&self, mean: f64) -> f64 {
        let [own, lone] = [&self.own, &self.lone].map(|v| v.len() as f64);
        let some = |n: f64, of_one: f64| if n > 0.0 { n * ((n / (own + lone)).ln() + of_one) } else { 0.0 };
        self.times * (some(own, mean) + some(lone, -self.volume.ln()))
    }
    /// That of all in one clump or two, and the others anywhere. Each number that is chosen to suit them
    /// costs half the logarithm of how many they are (Schwarz 1978): four for a clump, one for the shares of
    /// two.
    fn clumps(&self) -> f64 {
        let cost = 0.5 * (self.times * (self.own.len() + self.lone.len()) as f64).ln();
        let side = |p: Vec3| if (p - self.middle).dot(self.along) > 0.0 { FIRST } else { 1.0 - FIRST };
        let one = self.mixture(|_| [1.0]);
        let two = self.mixture(|p| [side(p), 1.0 - side(p)]);
        (self.times * one - 4.0 * cost).max(self.times * two - 9.0 * cost)
    }
    /// The logarithm of the likelihood in N clumps and anywhere. At first the group's points are the clumps',
    /// as `first` shares them out, the lone ones half.
    fn mixture<const N: usize>(&self, first: impl Fn(Vec3) -> [f64; N]) -> f64 {
        let all: Vec<Vec3> = self.own.iter().chain(&self.lone).copied().collect();
        let none_alone = if self.lone.is_empty() { 1.0 } else { FIRST };
        let mut weights: Vec<[f64; N]> = all
            .iter()
            .enumerate()
            .map(|(k, &p)| {
                let clumped = if k < self.own.len() { none_alone } else { 0.5 };
                first(p).map(|w| w * clumped)
            })
            .collect();
        let mut sum = 0.0;
        for _ in 0..ROUNDS {
            let clumps: [Clump; N] = std::array::from_fn(|c| Clump::new(&all, |k| weights[k][c], self.least));
            let even = (1.0 - clumps.iter().map(|c| c.share).sum::<f64>()).max(0.0) / self.volume;
            sum = 0.0;
            for (w, &p) in weights.iter_mut().zip(&all) {
                *w = std::array::from_fn(|c| clumps[c].density(p));
                let density = (even + w.iter().sum::<f64>()).max(f64::MIN_POSITIVE);
                w.iter_mut().for_each(|w| *w /= density);
                sum += density.ln();
            }
        }
        sum
    }
}

/// How a chart's points lie on it.
struct OnSheet {
    /// The ellipse over which they spread.
    area: f64,
    /// Mean logarithm of how likely they are as far off the sheet as they are.
    across: f64,
}

impl OnSheet {
    fn new(charted: &Charted<'_>, f: &FittedChart, map: &Monge) -> Self {
        let step = f.members.len().div_ceil(STRAYS.most).max(1);
        let sigma = f.chart.sigma.max(f64::MIN_POSITIVE);
        let members = f.members.iter().step_by(step);
        let local = members.map(|m| map.local(charted.cut.points[m.0 as usize]));
        let along = local.clone().map(|l| (Vec3([l.u * map.radii[0], l.v * map.radii[1], 0.0]), 1.0));
        // On an ellipse the variances along its half axes are a quarter of their squares.
        let area = principal(along).map_or(0.0, |spread| {
            let [_, short, long] = spread.variances.map(|v| v.max(0.0));
            4.0 * PI * (short * long).sqrt()
        });
        let n = local.len() as f64;
        let off = local.map(|l| {
            let surface = map.height_normal(l.u, l.v);
            ((l.z - surface.height) * surface.cos / sigma).powi(2)
        });
        Self { area, across: -0.5 * ((TAU * sigma * sigma).ln() + off.sum::<f64>() / n) }
    }
    /// What it costs that the chart follows its points, which may lie as far off it as a clump of this
    /// `width` reaches, and lies where they do.
    fn cost(&self, f: &FittedChart, map: &Monge, width: f64) -> f64 {
        let sigma = f.chart.sigma.max(f64::MIN_POSITIVE);
        let n = f.members.len() as f64;
        // What is even within a half width has its variance, a third of the square.
        let half = 3f64.sqrt() * width / sigma;
        let curved = PARTITION.curved * map.radii[0].min(map.radii[1]) / sigma;
        // Two numbers say where along the sheet (Schwarz 1978).
        cost_of_a_quadric(n, half, curved) + n.ln()
    }
}

/// A clump with its share of the points.
struct Clump {
    share: f64,
    middle: Vec3,
    variance: f64,
}

impl Clump {
    fn new(points: &[Vec3], weight: impl Fn(usize) -> f64, least: f64) -> Self {
        let weights = || (0..points.len()).map(&weight);
        let total = weights().sum::<f64>().max(f64::MIN_POSITIVE);
        let middle = points.iter().zip(weights()).fold(Vec3::ZERO, |s, (&p, w)| s + p * w) * (1.0 / total);
        let square: f64 = points.iter().zip(weights()).map(|(&p, w)| w * (p - middle).norm2()).sum();
        Self { share: total / points.len() as f64, middle, variance: (square / (3.0 * total)).max(least) }
    }
    /// How dense its points are, of all.
    fn density(&self, at: Vec3) -> f64 {
        let off = (at - self.middle).norm2() / self.variance;
        self.share * (-0.5 * off).exp() / (TAU * self.variance).powf(1.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blend::membership;
    use crate::numeric::Rng;
    use crate::partition::Cut;
    use crate::run::Run;
    use crate::spatial::Neighbours;
    use crate::spatial::spacing::Sampling;

    const SIGMA: f64 = 1.0;
    /// Between charts that lie one over the other.
    const APART: f64 = 4.0;

    /// How much likelier points are on flat charts one over the other, one where any are, than in clumps.
    fn layers(points: &[Vec3]) -> f64 {
        some_layers(points, |_| true)
    }

    /// The same of the charts that are `there`; points on others are lone.
    fn some_layers(points: &[Vec3], there: impl Fn(i32) -> bool + Sync) -> f64 {
        let layer = |p: &Vec3| (p[2] / APART).round() as i32;
        let all = 0..points.len() as u32;
        let first = points.iter().map(layer).min().unwrap_or(0);
        let last = points.iter().map(layer).max().unwrap_or(0);
        let mut fitted = Vec::new();
        for k in (first..=last).filter(|&k| there(k)) {
            let mut chart = FittedChart::flat(10.0, SIGMA, 0..0);
            if let Map::Monge(map) = &mut chart.chart.map {
                map.center = Vec3([0.0, 0.0, APART * f64::from(k)]);
            }
            chart.members =
                all.clone().filter(|&i| layer(&points[i as usize]) == k).map(|i| (i, 1.0)).collect();
            if !chart.members.is_empty() {
                fitted.push(chart);
            }
        }
        let run = |ctx: &Context<'_>| {
            let members =
                membership::of_points(&all.clone().map(u64::from).collect::<Vec<_>>(), &fitted, ctx)?;
            let tree = Neighbours::build(points, ctx)?;
            let sampling = Sampling::new(vec![1.0; points.len()]);
            let cut = Cut::whole(points, &tree, &sampling, SIGMA);
            let charted = Charted { cut, fitted: &fitted, members: &members };
            let shares = Shares::new(&charted, &vec![true; fitted.len()], &vec![true; points.len()]);
            let charts = (0..fitted.len() as u32).collect();
            let lone = |i: u32| !there(layer(&points[i as usize]));
            let on_charts = all.clone().filter(|&i| !lone(i)).collect();
            let group = Group { evidence: 0.0, charts, points: on_charts };
            charts_beside_clumps(&charted, &group, &shares, Some(&lone), &mut Vec::new(), ctx)
        };
        Run::default().execute(run).unwrap()
    }

    fn clump(rng: &mut Rng, n: usize, middle: Vec3, width: f64) -> impl Iterator<Item = Vec3> + '_ {
        (0..n).map(move |_| middle + Vec3::from_fn(|_| width * rng.normal()))
    }

    #[test]
    fn charts_through_one_clump_or_two_are_told_from_it() {
        let mut rng = Rng::new(1);
        for width in [2.0, 3.5] {
            let one: Vec<Vec3> = clump(&mut rng, 200, Vec3::ZERO, width).collect();
            let mut two = one.clone();
            two.extend(clump(&mut rng, 100, Vec3([5.0 * width, 0.0, 0.0]), width));
            let odds = [layers(&one), layers(&two)];
            assert!(odds.iter().all(|o| *o < -20.0), "{width}: {odds:?}");
        }
    }

    #[test]
    fn one_chart_through_a_clump_is_told_by_what_it_leaves_over() {
        let points: Vec<Vec3> = clump(&mut Rng::new(1), 200, Vec3::ZERO, 3.5).collect();
        let cut = some_layers(&points, |k| k == 0);
        let mut strays = points.clone();
        strays.retain(|p| (p[2] / APART).round() == 0.0);
        let alone = layers(&strays);
        assert!(alone > 10.0 && cut < -20.0, "{alone} {cut}");
    }

    #[test]
    fn sheets_are_no_clumps_be_they_narrow_or_one_over_the_other() {
        let mut rng = Rng::new(1);
        let mut sheet = |n: usize, radius: f64, layers: i32| -> Vec<Vec3> {
            let mut points = Vec::new();
            while points.len() < n {
                let [x, y] = [0, 1].map(|_| radius * (2.0 * rng.uniform() - 1.0));
                let z = APART * f64::from(points.len() as i32 % layers) + 0.9 * rng.normal().clamp(-2.0, 2.0);
                if x.hypot(y) < radius {
                    points.push(Vec3([x, y, z]));
                }
            }
            points
        };
        let [narrow, wide, three] = [(100, 5.0, 1), (300, 30.0, 1), (300, 20.0, 3)]
            .map(|(n, radius, count)| layers(&sheet(n, radius, count)));
        assert!(narrow > 10.0 && wide > 300.0 && three > 200.0, "{narrow} {wide} {three}");
    }

    #[test]
    fn a_few_points_or_equal_ones_give_a_number() {
        for points in [vec![Vec3::ZERO; 3], vec![Vec3::ZERO], vec![Vec3::ZERO, Vec3([1.0, 0.0, 0.0])]] {
            assert!(!layers(&points).is_nan());
        }
    }
}
