//! Where along a boundary the data end.
//!
//! In: how far out the points beside each node lie, how the curve bends. Out: how far out the data end there.
//!
//! The points are a Poisson process of known density that ends at an offset from the curve, blurred by a
//! Gaussian, besides a few that belong to nothing; the end is a curve whose bends are white noise about their
//! mean. Their likeliest values are found by Newton's method; stiffness and blur by the evidence
//! (Laplace's approximation; MacKay 1992). The points beside a sharp end say only how far out it is at least:
//! there the mean of the offsets is farther out than the likeliest, by the third derivatives (Tierney and
//! Kadane 1986).

use super::constants::RIM;
use super::curve::{Ends, smooth};
use super::marks::Marks;
use crate::error::Result;
use crate::numeric::pentadiagonal::{Factor, Pentadiagonal};
use crate::numeric::special::{normal_density, normal_distribution};
use crate::run::Context;
use rayon::prelude::*;

/// Finds where the data end.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn fit(marks: &Marks, bends: &[f64], ctx: &Context<'_>) -> Result<Ends> {
    let chain = Chain { marks, bends };
    let blur = |share: f64| (share * marks.sigma).max(RIM.sharpest);
    let mut best = Fit { offsets: vec![0.0; chain.len()], evidence: f64::NEG_INFINITY };
    let mut start = best.offsets.clone();
    let mut model = Model { stiffness: RIM.first_stiffness, blur: blur(1.0) };
    for blur in RIM.from_afar.into_iter().filter(|b| *b > model.blur) {
        if let Some(fit) = chain.fit(Model { blur, ..model }, &start, ctx)? {
            start = fit.offsets;
        }
    }
    for stiffness in RIM.stiffness {
        let tried = Model { stiffness, ..model };
        if let Some(fit) = chain.fit(tried, &start, ctx)?
            && fit.evidence > best.evidence
        {
            (best, model) = (fit, tried);
        }
    }
    for share in &RIM.shares[1..] {
        let tried = Model { blur: blur(*share), ..model };
        if tried.blur < model.blur
            && let Some(fit) = chain.fit(tried, &best.offsets, ctx)?
            && fit.evidence > best.evidence
        {
            (best, model) = (fit, tried);
        }
    }
    // Next to the boundary there may be fewer points than within.
    let thinned = chain.thinned(&best.offsets);
    let density = marks.density.iter().zip(&thinned).map(|(d, share)| d * share.max(RIM.least_density));
    let thinner = Marks { density: density.collect(), ..marks.clone() };
    let chain = Chain { marks: &thinner, bends };
    let best = chain.fit(model, &best.offsets, ctx)?.unwrap_or(best);
    let farthest = |x: f64| x.clamp(-RIM.farthest, RIM.farthest);
    let mean = chain.mean(model, &best.offsets).unwrap_or(best.offsets);
    let offsets = mean[RIM.overlap..].iter().take(marks.out.len()).map(|x| farthest(*x)).collect();
    Ok(Ends { offsets, thinned })
}

/// What the offsets are judged by.
#[derive(Clone, Copy)]
struct Model {
    /// How much stiffer than the points are dense the boundary is.
    stiffness: f64,
    /// Standard deviation of the blur.
    blur: f64,
}

/// Likeliest offsets, and the logarithm of their model's evidence.
struct Fit {
    offsets: Vec<f64>,
    evidence: f64,
}

/// The nodes of a boundary one after another, with an overlap at start and end.
struct Chain<'a> {
    marks: &'a Marks,
    bends: &'a [f64],
}

/// What the points say at one node: the logarithm of their likelihood, and its derivatives by the offset.
#[derive(Clone, Copy, Default)]
struct Likelihood {
    value: f64,
    slope: f64,
    /// The second, with its sign changed and never negative.
    bend: f64,
    third: f64,
}

impl Chain<'_> {
    fn len(&self) -> usize {
        self.marks.out.len() + 2 * RIM.overlap
    }
    /// The node at a place of the chain.
    fn node(&self, i: usize) -> usize {
        let n = self.marks.out.len();
        (i + n - RIM.overlap % n) % n
    }
    fn likelihood(&self, i: usize, offset: f64, blur: f64) -> Likelihood {
        let node = self.node(i);
        let mut sum = Likelihood::default();
        let within = 1.0 - RIM.stray;
        for out in &self.marks.out[node] {
            let x = (offset - out) / blur;
            let mass = within * normal_distribution(x) + RIM.stray;
            let ratio = within * normal_density(x) / mass;
            let off = x + ratio;
            sum.value += mass.ln();
            sum.slope += ratio / blur;
            sum.bend += (ratio * off).max(0.0) / (blur * blur);
            sum.third += ratio * (off * (off + ratio) - 1.0) / (blur * blur * blur);
        }
        let expected = self.marks.density[node] * RIM.step;
        sum.value -= expected * offset;
        sum.slope -= expected;
        sum
    }
    /// The matrix of the prior.
    fn prior(&self, stiffness: f64) -> Pentadiagonal {
        let n = self.len();
        let mut rows = vec![[RIM.hold * RIM.step, 0.0, 0.0]; n];
        let k = stiffness / RIM.step.powi(3);
        for i in 0..n - 2 {
            // The square of (1, -2, 1).
            rows[i][0] += k;
            rows[i][1] -= 2.0 * k;
            rows[i][2] += k;
            rows[i + 1][0] += 4.0 * k;
            rows[i + 1][1] -= 2.0 * k;
            rows[i + 2][0] += k;
        }
        Pentadiagonal(rows)
    }
    /// The factor of minus the second derivatives of the logarithm of the posterior.
    fn factor(&self, model: Model, offsets: &[f64], said: &[Likelihood]) -> Option<Factor> {
        let mut matrix = self.prior(model.stiffness);
        for ((row, l), x) in matrix.0.iter_mut().zip(said).zip(offsets) {
            row[0] += l.bend + if x.abs() > RIM.farthest { RIM.wall } else { 0.0 };
        }
        matrix.factor()
    }
    /// How dense the points are just within the boundary, as a share of those farther within.
    fn thinned(&self, offsets: &[f64]) -> Vec<f64> {
        let of_node = |(k, out): (usize, &Vec<f64>)| {
            let end = offsets[k + RIM.overlap];
            out.iter().filter(|u| **u > end - RIM.within).count() as f64 / (RIM.within * RIM.step)
        };
        let mut near: Vec<f64> = self.marks.out.iter().enumerate().map(of_node).collect();
        smooth(&mut near, RIM.long_smoothings);
        near.iter().zip(&self.marks.density).map(|(near, within)| (near / within).min(1.0)).collect()
    }
    /// What the points say at offsets.
    fn said(&self, model: Model, offsets: &[f64]) -> Vec<Likelihood> {
        let nodes = offsets.par_iter().with_min_len(RIM.nodes_at_once).enumerate();
        nodes.map(|(i, x)| self.likelihood(i, *x, model.blur)).collect()
    }
    /// The logarithm of the prior, and its slopes.
    fn held(&self, model: Model, offsets: &[f64]) -> (f64, Vec<f64>) {
        // Beyond the farthest there are no points to say so: those deep within are not looked at.
        let too_far = |x: f64| x - x.clamp(-RIM.farthest, RIM.farthest);
        let hold = |x: &f64| -RIM.hold * RIM.step * x - RIM.wall * too_far(*x);
        let mut slopes: Vec<f64> = offsets.iter().map(hold).collect();
        let of_one = |x: &f64| RIM.hold * RIM.step * x * x + RIM.wall * too_far(*x).powi(2);
        let mut value = -0.5 * offsets.iter().map(of_one).sum::<f64>();
        let k = model.stiffness / RIM.step.powi(3);
        for (i, w) in offsets.windows(3).enumerate() {
            let bend = w[0] - 2.0 * w[1] + w[2] + self.bends[self.node(i + 1)];
            value -= 0.5 * k * bend * bend;
            for (j, factor) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                slopes[i + j] -= k * factor * bend;
            }
        }
        (value, slopes)
    }
    /// The likeliest offsets, from `start` on; nothing where rounding leaves none.
    fn fit(&self, model: Model, start: &[f64], ctx: &Context<'_>) -> Result<Option<Fit>> {
        let judge = |offsets: &[f64]| {
            let (said, held) = (self.said(model, offsets), self.held(model, offsets));
            let value = held.0 + said.iter().map(|l| l.value).sum::<f64>();
            (value, said, held.1)
        };
        let mut offsets = start.to_vec();
        let (mut value, mut said, mut held) = judge(&offsets);
        for _ in 0..RIM.steps {
            ctx.check()?;
            let Some(factor) = self.factor(model, &offsets, &said) else { return Ok(None) };
            let mut step: Vec<f64> = said.iter().zip(&held).map(|(l, p)| l.slope + p).collect();
            factor.solve(&mut step);
            let mut share = 1.0;
            let better = (0..RIM.steps).find_map(|_| {
                let tried: Vec<f64> = offsets.iter().zip(&step).map(|(x, s)| x + share * s).collect();
                share *= 0.5;
                let judged = judge(&tried);
                (judged.0 > value).then_some((tried, judged))
            });
            let Some((tried, judged)) = better else { break };
            let gained = judged.0 - value;
            (offsets, (value, said, held)) = (tried, judged);
            if gained < RIM.settled {
                break;
            }
        }
        let (Some(before), Some(after)) =
            (self.prior(model.stiffness).factor(), self.factor(model, &offsets, &said))
        else {
            return Ok(None);
        };
        let evidence = value + 0.5 * (before.ln_determinant() - after.ln_determinant());
        Ok(Some(Fit { offsets, evidence }))
    }
    /// The mean of the offsets, from the likeliest.
    fn mean(&self, model: Model, likeliest: &[f64]) -> Option<Vec<f64>> {
        let said = self.said(model, likeliest);
        let factor = self.factor(model, likeliest, &said)?;
        let variance = factor.inverse_diagonal();
        let mut shift: Vec<f64> = said.iter().zip(&variance).map(|(l, v)| 0.5 * l.third * v).collect();
        factor.solve(&mut shift);
        // Not farther than the approximation holds.
        let mean = likeliest.iter().zip(shift).zip(variance).map(|((x, s), v)| {
            let deviation = v.sqrt();
            x + s.clamp(-deviation, deviation)
        });
        Some(mean.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Rng;
    use crate::run::Run;
    use std::f64::consts::TAU;

    /// Points of density 1 that end at `end(v)`, moved by Gaussian noise.
    fn marks(nodes: usize, sigma: f64, seed: u64, end: impl Fn(f64) -> f64) -> Marks {
        let mut rng = Rng::new(seed);
        let length = nodes as f64 * RIM.step;
        let mut out = vec![Vec::new(); nodes];
        let deep = RIM.band + RIM.band_sigmas * sigma;
        let room = deep + 5.0 * sigma;
        for _ in 0..(length * (room + 3.0)) as usize {
            let [v, u] = [rng.uniform() * length, rng.uniform() * (room + 3.0) - room];
            if u > end(v) {
                continue;
            }
            let [v, u] = [v + sigma * rng.normal(), u + sigma * rng.normal()];
            if u.abs() < deep {
                out[(v.rem_euclid(length) / RIM.step) as usize % nodes].push(u);
            }
        }
        Marks { out, density: vec![1.0; nodes], sigma }
    }

    /// Root mean square of what the fit is off by, and its mean.
    fn off(nodes: usize, sigma: f64, end: impl Fn(f64) -> f64 + Copy) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for seed in 0..8 {
            let marks = marks(nodes, sigma, seed, end);
            let found =
                Run::default().execute(|ctx| fit(&marks, &vec![0.0; nodes], ctx)).expect("nothing stops it");
            for (k, x) in found.offsets.iter().enumerate() {
                let off = x - end((k as f64 + 0.5) * RIM.step);
                sums[0] += off * off;
                sums[1] += off;
            }
        }
        let n = (8 * nodes) as f64;
        [(sums[0] / n).sqrt(), sums[1] / n]
    }

    #[test]
    fn straight_ends_are_found_within_a_quarter_of_a_spacing_whatever_the_noise() {
        for sigma in [0.0, 0.2, 0.5, 1.0] {
            let [rms, mean] = off(200, sigma, |_| 0.4);
            assert!(rms < 0.25 && mean.abs() < 0.1, "{sigma}: {rms} {mean}");
        }
    }

    #[test]
    fn bent_ends_are_followed() {
        for sigma in [0.0, 0.5] {
            let [rms, mean] = off(200, sigma, |v| (TAU * v / 25.0).sin());
            assert!(rms < 0.35 && mean.abs() < 0.1, "{sigma}: {rms} {mean}");
        }
    }
}
