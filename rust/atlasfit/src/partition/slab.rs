//! Two sheets so near each other that a patch takes points of both: the sides of a thin wall.
//!
//! In: the points about a seed, the noise, the patch that grew there. Out: the points of each of two parallel
//! sheets, where they explain the points about the seed better than the patch explains its own.
//!
//! Two sheets are a quadric and a distance to either side of it, each point on one of them; the mixture is
//! fitted by expectation maximisation (Dempster et al. 1977). Its rivals are the patch, if it leaves no more
//! than the noise, one sheet that bends more, and points without any sheet. Explanations of different size
//! are compared by their evidence for each point, with half a logarithm of the points for each coefficient
//! (Schwarz 1978).

use super::constants::PARTITION;
use super::grow;
use super::moments::quad;
use crate::atlas::{Monge, Patch};
use crate::numeric::dense::{cholesky, cholesky_solve, principal};
use crate::numeric::vec3::Vec3;
use crate::spatial::neighbours::Neighbour;
use std::f64::consts::TAU;

/// Coefficients of two sheets: a quadric's and those of the distance, which is linear.
const TWO: usize = 9;
/// Coefficients of one sheet that bends more: a polynomial of degree four.
const ONE: usize = 15;

/// The points about a seed in a frame of their own.
struct Around {
    /// Domain coordinates in radii, and the height.
    at: Vec<[f64; 3]>,
    radius: f64,
    sigma: f64,
    /// Density of points that are on no sheet, per length along the normal, times their share.
    astray: f64,
}

/// Two sheets.
#[derive(Clone, Copy)]
struct TwoSheets {
    quadric: [f64; 6],
    /// From the quadric to either sheet, at (u, v): half . (1, u, v).
    half: [f64; 3],
    /// Share of the points on the upper sheet.
    upper: f64,
}

/// Density of a height that is `e` beside a sheet.
fn density(e: f64, sigma: f64) -> f64 {
    (-0.5 * (e / sigma).powi(2)).exp() / (sigma * TAU.sqrt())
}

/// The points of either sheet, the upper first; none where a rival explains the points better. `found`
/// are the points within `radius` of the seed, the nearest first.
pub(super) fn sides(
    points: &[Vec3],
    found: &[Neighbour],
    radius: f64,
    sigma: f64,
    patch: Option<&Patch>,
) -> Option<[Vec<u32>; 2]> {
    let astray = PARTITION.astray / (2.0 * radius);
    let cloud = -(2.0 * radius).ln();
    // A patch that leaves more than the noise is no explanation, however few points it is about.
    let explains = |p: &&Patch| grow::explains(p.residual, p.radii[0].min(p.radii[1]), sigma);
    let rival =
        patch.filter(explains).map_or(cloud, |p| of_patch(points, found, p, sigma, astray).max(cloud));
    let mut best: Option<(f64, [Vec<u32>; 2], Around)> = None;
    let mut reach = radius;
    for _ in 0..PARTITION.slab_sizes {
        let near = &found[..found.partition_point(|f| f.dist2 <= reach * reach)];
        if near.len() < 2 * PARTITION.min_members + TWO {
            break;
        }
        let least = best.as_ref().map_or(rival + PARTITION.slab_gain / near.len() as f64, |b| b.0);
        if let Some(around) = Around::new(points, near, reach, sigma, astray)
            && let Some((evidence, sides)) = around.two_sheets(near)
            && evidence > least
        {
            best = Some((evidence, sides, around));
        }
        reach /= PARTITION.growth;
    }
    let (evidence, sides, around) = best?;
    let bent = around.one_sheet().unwrap_or(f64::NEG_INFINITY);
    (evidence > bent + PARTITION.slab_gain / around.at.len() as f64).then_some(sides)
}

/// Evidence for each point over a patch, in nats.
fn of_patch(points: &[Vec3], found: &[Neighbour], p: &Patch, sigma: f64, astray: f64) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0f64);
    for f in found {
        let d = points[f.index as usize] - p.center;
        let (u, v) = (d.dot(p.axes[0]) / p.radii[0], d.dot(p.axes[1]) / p.radii[1]);
        if u * u + v * v <= 1.0 && d.norm() <= p.radii[0].max(p.radii[1]) {
            let e = d.dot(p.axes[2]) - quad(&p.quadric, u, v);
            sum += ((1.0 - PARTITION.astray) * density(e, sigma) + astray).ln();
            n += 1.0;
        }
    }
    if n < 1.0 { f64::NEG_INFINITY } else { (sum - 3.0 * n.ln()) / n }
}

impl Around {
    fn new(points: &[Vec3], near: &[Neighbour], radius: f64, sigma: f64, astray: f64) -> Option<Self> {
        let weight = |d2: f64| (1.0 - d2 / (radius * radius * 1.5)).max(0.05);
        let flat = principal(near.iter().map(|f| (points[f.index as usize], weight(f.dist2))))?;
        let axes = Monge::frame(flat.axes[0], flat.axes[0].tangents().0);
        let local = |f: &Neighbour| {
            let d = points[f.index as usize] - flat.mean;
            [d.dot(axes[0]) / radius, d.dot(axes[1]) / radius, d.dot(axes[2])]
        };
        Some(Self { at: near.iter().map(local).collect(), radius, sigma, astray })
    }

    /// The evidence of two sheets for each point, and the points of either.
    fn two_sheets(&self, near: &[Neighbour]) -> Option<(f64, [Vec<u32>; 2])> {
        let sheets = self.fit()?;
        let n = near.len() as f64;
        let mut sides = [Vec::new(), Vec::new()];
        let mut sum = 0.0;
        for (f, at) in near.iter().zip(&self.at) {
            let [upper, lower] = self.on(&sheets, at);
            sum += (upper + lower + self.astray).ln();
            if upper > lower.max(self.astray) {
                sides[0].push(f.index);
            } else if lower > self.astray {
                sides[1].push(f.index);
            }
        }
        let enough = sides.iter().all(|s| s.len() >= PARTITION.min_members);
        let gap = 2.0 * sheets.half[0] / self.sigma;
        // TwoSheets farther apart do not disturb a patch.
        let apart = (PARTITION.slab_apart..PARTITION.disturbing_sigmas).contains(&gap);
        (enough && apart).then(|| ((sum - 0.5 * (TWO + 1) as f64 * n.ln()) / n, sides))
    }

    /// The evidence of one sheet that bends more, for each point.
    fn one_sheet(&self) -> Option<f64> {
        let row = |&[u, v, _]: &[f64; 3]| {
            let (uu, uv, vv) = (u * u, u * v, v * v);
            [
                1.0,
                u,
                v,
                uu,
                uv,
                vv,
                uu * u,
                uu * v,
                u * vv,
                vv * v,
                uu * uu,
                uu * uv,
                uu * vv,
                uv * vv,
                vv * vv,
            ]
        };
        let rows: Vec<[f64; ONE]> = self.at.iter().map(row).collect();
        let mut q = [0.0; ONE];
        let mut on = vec![1.0; self.at.len()];
        for _ in 0..PARTITION.bent_steps {
            let (mut a, mut b) = ([0.0; ONE * ONE], [0.0; ONE]);
            for ((at, row), w) in self.at.iter().zip(&rows).zip(&on) {
                for i in 0..ONE {
                    (i..ONE).for_each(|j| a[i * ONE + j] += w * row[i] * row[j]);
                    b[i] += w * at[2] * row[i];
                }
            }
            (0..ONE).for_each(|i| a[i * (ONE + 1)] += 1e-6 * self.at.len() as f64);
            if !cholesky(&mut a, ONE) {
                return None;
            }
            cholesky_solve(&a, ONE, &mut b);
            q = b;
            for ((at, row), on) in self.at.iter().zip(&rows).zip(&mut on) {
                let sheet = self.on_one(row, &q, at[2]);
                *on = sheet / (sheet + self.astray);
            }
        }
        let n = self.at.len() as f64;
        let of = |(at, row): (&[f64; 3], &[f64; ONE])| (self.on_one(row, &q, at[2]) + self.astray).ln();
        let sum: f64 = self.at.iter().zip(&rows).map(of).sum();
        Some((sum - 0.5 * ONE as f64 * n.ln()) / n)
    }

    /// The density of a point on one sheet.
    fn on_one(&self, row: &[f64; ONE], q: &[f64; ONE], height: f64) -> f64 {
        let e = height - row.iter().zip(q).map(|(x, q)| x * q).sum::<f64>();
        (1.0 - PARTITION.astray) * density(e, self.sigma)
    }

    /// The densities of a point on either sheet.
    fn on(&self, s: &TwoSheets, at: &[f64; 3]) -> [f64; 2] {
        let e = at[2] - quad(&s.quadric, at[0], at[1]);
        let share = 1.0 - PARTITION.astray;
        let half = s.half[0] + s.half[1] * at[0] + s.half[2] * at[1];
        [(s.upper, e - half), (1.0 - s.upper, e + half)].map(|(p, e)| share * p * density(e, self.sigma))
    }

    /// The most likely two sheets.
    fn fit(&self) -> Option<TwoSheets> {
        let mut s = TwoSheets { quadric: [0.0; 6], half: [0.0; 3], upper: 0.5 };
        s.quadric = self.solve(|_| [0.5, 0.5])?.quadric;
        let n = self.at.len() as f64;
        let squares = self.at.iter().map(|at| (at[2] - quad(&s.quadric, at[0], at[1])).powi(2)).sum::<f64>();
        // Two sheets add the square of half their distance to the variance: far from what those that are
        // looked for add, what the quadric leaves is something else.
        let added = squares / n - self.sigma.powi(2);
        let [least, most] =
            [PARTITION.slab_apart, PARTITION.disturbing_sigmas].map(|gap| (0.5 * gap * self.sigma).powi(2));
        if added < 0.5 * least || added > 2.0 * most {
            return None;
        }
        s.half[0] = added.sqrt();
        for _ in 0..PARTITION.slab_steps {
            let before = s.half[0];
            s = self.solve(|at| {
                let [upper, lower] = self.on(&s, at);
                let all = upper + lower + self.astray;
                [upper / all, lower / all]
            })?;
            if (s.half[0] - before).abs() < PARTITION.slab_end * self.sigma {
                break;
            }
        }
        Some(s)
    }

    /// Least squares, given how likely each point is on either sheet.
    fn solve(&self, on: impl Fn(&[f64; 3]) -> [f64; 2]) -> Option<TwoSheets> {
        const N: usize = TWO;
        let (mut a, mut b) = ([0.0; N * N], [0.0; N]);
        let (mut uppers, mut all) = (0.0, 0.0);
        for at in &self.at {
            let [upper, lower] = on(at);
            let (w, t) = (upper + lower, upper - lower);
            let [u, v, z] = *at;
            let row = [1.0, u, v, u * u, u * v, v * v];
            let side = [1.0, u, v];
            for i in 0..6 {
                (i..6).for_each(|j| a[i * N + j] += w * row[i] * row[j]);
                (0..3).for_each(|j| a[i * N + 6 + j] += t * row[i] * side[j]);
                b[i] += w * z * row[i];
            }
            for i in 0..3 {
                (i..3).for_each(|j| a[(6 + i) * N + 6 + j] += w * side[i] * side[j]);
                b[6 + i] += t * z * side[i];
            }
            uppers += upper;
            all += w;
        }
        let ridge = (self.sigma / (PARTITION.curved * self.radius)).powi(2);
        for i in 0..N {
            a[i * (N + 1)] += if (3..6).contains(&i) { 1e-4 * all + ridge } else { 1e-9 * all };
        }
        if !cholesky(&mut a, N) {
            return None;
        }
        cholesky_solve(&a, N, &mut b);
        let [q0, q1, q2, q3, q4, q5, half @ ..] = b;
        Some(TwoSheets { quadric: [q0, q1, q2, q3, q4, q5], half, upper: uppers / all.max(1e-300) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::rng::Rng;

    /// The sides of a patch of 200 points whose heights are as `height` says, plus noise of 1; the domain's
    /// radius is 10.
    fn found(height: impl Fn(&mut Rng, f64, f64) -> f64) -> Option<[Vec<u32>; 2]> {
        let mut rng = Rng::new(7);
        let mut points = vec![Vec3::ZERO];
        while points.len() < 200 {
            let [x, y] = [0, 1].map(|_| 20.0 * rng.uniform() - 10.0);
            let z = height(&mut rng, x, y) + rng.normal();
            points.push(Vec3([x, y, z]));
        }
        let near = |p: &Vec3| p.dot(*p);
        let mut found: Vec<Neighbour> =
            points.iter().zip(0..).map(|(p, index)| Neighbour { index, dist2: near(p) }).collect();
        found.retain(|f| f.dist2 <= 100.0);
        found.sort_by(|a, b| a.dist2.total_cmp(&b.dist2));
        sides(&points, &found, 10.0, 1.0, None)
    }

    #[test]
    fn two_sheets_are_told_apart_where_one_does_not_explain_the_points() {
        let side = |rng: &mut Rng| if rng.uniform() < 0.5 { -1.0 } else { 1.0 };
        let [upper, lower] = found(|rng, _, _| 1.75 * side(rng)).expect("two sheets");
        assert!(upper.len().abs_diff(lower.len()) < 40, "{} {}", upper.len(), lower.len());
        assert!(found(|rng, x, _| (3.0 + 0.1 * x) * side(rng) + 0.02 * x * x).is_some(), "a bent wedge");
        assert!(found(|_, _, _| 0.0).is_none(), "one sheet");
        assert!(found(|_, x, y| 0.002 * (x * x * x + y * y * x)).is_none(), "one sheet that bends");
        assert!(found(|rng, _, _| 16.0 * rng.uniform() - 8.0).is_none(), "a cloud");
    }
}
