//! The smooth sides of a sheet about a place.
//!
//! In: points of the sheet, with the normals of the charts there. Out: planes about which they lie, and for
//! each point the plane that explains it best. Charts round off what is narrow, so that normals only say
//! where to begin: the points themselves say where they belong, and how many planes they ask for.

use super::constants::CREASE;
use crate::numeric::dense::{eigen3, principal};
use crate::numeric::robust::{TUKEY, cost, tukey};
use crate::numeric::vec3::{Frame, Vec3};

/// Factors of a likelihood that are multiplied before their logarithm is taken. Source: derived, none is
/// beyond exp(16), by the limit of Tukey's weights.
const PRODUCTS: usize = 16;

/// A plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    /// A place on it.
    pub at: Vec3,
    /// Its unit normal.
    pub normal: Vec3,
}

impl Side {
    /// The plane of weighted points, with its normal towards `facing`; none without weight.
    pub fn of(points: impl Iterator<Item = (Vec3, f64)> + Clone, facing: Vec3) -> Option<Self> {
        let found = principal(points)?;
        let normal = found.axes[0];
        Some(Self { at: found.mean, normal: if normal.dot(facing) < 0.0 { -normal } else { normal } })
    }
    /// Signed distance of a place.
    pub fn off(&self, p: Vec3) -> f64 {
        self.normal.dot(p - self.at)
    }
}

/// The frame in which two sides are heights of opposite slopes (across the line in which they meet, along it,
/// up), and where across it the line is, from a place; none where they hardly bend or face each other.
pub(super) fn meeting([a, b]: [Side; 2], at: Vec3) -> Option<(Frame, f64)> {
    let up = (a.normal + b.normal).normalized();
    if a.normal.dot(b.normal) > CREASE.bend || a.normal.dot(up) < CREASE.steep {
        return None;
    }
    let along = a.normal.cross(b.normal).normalized();
    let across = along.cross(up);
    // With height h over the place, across x and -x of the normals: n_x x + n_z h = -off for both.
    let (nx, nz) = (a.normal.dot(across), a.normal.dot(up));
    (nx != 0.0 && nz != 0.0).then(|| ([across, along, up], (b.off(at) - a.off(at)) / (2.0 * nx)))
}

/// A point and the unit normal of its chart.
pub(super) type Point = (Vec3, Vec3);

/// How far, in nats, a point is from a side: by its place, and by the normal of its chart.
fn misfit(side: &Side, &(p, normal): &Point, sigma: f64) -> [f64; 2] {
    let turned = (1.0 - side.normal.dot(normal)) / (1.0 - CREASE.turned);
    [cost(side.off(p) / sigma), 0.5 * turned.clamp(0.0, TUKEY * TUKEY)]
}

/// The sides, and which each point lies on; none where no more than `few` sides are to begin with.
pub(super) fn split(points: &[Point], sigma: f64, few: usize) -> Option<(Vec<Side>, Vec<usize>)> {
    let mut sides = begin(points);
    if sides.len() <= few {
        return None;
    }
    let mut label = settle(&mut sides, points, sigma);
    // What a plane costs: half the logarithm of the number of points for each of its numbers (Schwarz 1978).
    let charge = 1.5 * (points.len() as f64).ln();
    while sides.len() > 1 {
        let saves = savings(&sides, points, sigma);
        let least = (0..sides.len()).min_by(|&a, &b| saves[a].total_cmp(&saves[b]));
        let Some(least) = least.filter(|&k| saves[k] < charge) else { break };
        sides.remove(least);
        label = settle(&mut sides, points, sigma);
    }
    (sides.len() > few).then_some((sides, label))
}

/// How much likelier the points are for each of the sides, in nats. The points are a mixture of them, in
/// which normals say beforehand how likely each side is: of two planes in one place neither is of use.
fn savings(sides: &[Side], points: &[Point], sigma: f64) -> Vec<f64> {
    let mut saves = vec![0.0; sides.len()];
    let mut likely = vec![[0.0; 2]; sides.len()];
    for points in points.chunks(PRODUCTS) {
        let mut times = vec![1.0; sides.len()];
        for p in points {
            let [mut prior, mut joint] = [0.0; 2];
            for (side, likely) in sides.iter().zip(&mut likely) {
                let [off, turned] = misfit(side, p, sigma);
                let own = (-turned).exp();
                *likely = [own, own * (-off).exp()];
                prior += likely[0];
                joint += likely[1];
            }
            for (times, own) in times.iter_mut().zip(&likely) {
                *times *= (joint / prior) / ((joint - own[1]) / (prior - own[0]));
            }
        }
        saves.iter_mut().zip(times).for_each(|(saves, times)| *saves += times.ln());
    }
    saves
}

/// Sides whose normals are as different as the points have them.
fn begin(points: &[Point]) -> Vec<Side> {
    let mean = points.iter().map(|p| p.1).sum::<Vec3>().normalized();
    let mut chosen: Vec<Side> = Vec::new();
    let mut nearest: Vec<f64> = points.iter().map(|p| mean.dot(p.1)).collect();
    while chosen.len() < CREASE.most_sides {
        let farthest = (0..points.len()).min_by(|&a, &b| nearest[a].total_cmp(&nearest[b]));
        let Some(farthest) = farthest else { break };
        if !chosen.is_empty() && nearest[farthest] > CREASE.bend {
            break;
        }
        let normal = points[farthest].1;
        let alike = points.iter().filter(|p| p.1.dot(normal) > CREASE.turned);
        let (sum, count) = alike.fold((Vec3::ZERO, 0.0), |(sum, n), p| (sum + p.0, n + 1.0));
        for (nearest, p) in nearest.iter_mut().zip(points) {
            let cosine = normal.dot(p.1);
            *nearest = if chosen.is_empty() { cosine } else { nearest.max(cosine) };
        }
        chosen.push(Side { at: sum * (1.0 / f64::max(count, 1.0)), normal });
    }
    chosen
}

/// Sums over the points of a side, from a place on it as it was.
#[derive(Clone, Copy, Default)]
struct Sums {
    points: usize,
    weight: f64,
    place: Vec3,
    /// Products of coordinates: xx, xy, xz, yy, yz, zz.
    moments: [f64; 6],
    normals: Vec3,
}

impl Sums {
    #[inline]
    fn add(&mut self, d: Vec3, weight: f64, normal: Vec3) {
        let [x, y, z] = d.0;
        self.points += 1;
        self.weight += weight;
        self.place += d * weight;
        let products = [x * x, x * y, x * z, y * y, y * z, z * z];
        self.moments.iter_mut().zip(products).for_each(|(m, p)| *m += weight * p);
        self.normals += normal;
    }
    /// The plane of the points, by their weights.
    fn plane(&self, from: Vec3) -> Side {
        let mean = self.place * (1.0 / self.weight);
        let [x, y, z] = mean.0;
        let products = [x * x, x * y, x * z, y * y, y * z, z * z];
        let mut about = self.moments.map(|m| m / self.weight);
        about.iter_mut().zip(products).for_each(|(m, p)| *m -= p);
        let normal = eigen3(about).1[0];
        let faces = normal.dot(self.normals) >= 0.0;
        Side { at: from + mean, normal: if faces { normal } else { -normal } }
    }
}

/// The side that explains each point best.
fn nearest(sides: &[Side], points: &[Point], sigma: f64) -> Vec<usize> {
    let of = |p: &Point| {
        let mut best = (f64::INFINITY, 0);
        for (k, side) in sides.iter().enumerate() {
            let [off, turned] = misfit(side, p, sigma);
            if off + turned < best.0 {
                best = (off + turned, k);
            }
        }
        best.1
    };
    points.iter().map(of).collect()
}

/// Fits the sides to the points that lie on them, a few times; says which each point lies on.
fn settle(sides: &mut [Side], points: &[Point], sigma: f64) -> Vec<usize> {
    let mut label = nearest(sides, points, sigma);
    for _ in 0..CREASE.settlings {
        let mut sums = vec![Sums::default(); sides.len()];
        for (&(p, normal), &l) in points.iter().zip(&label) {
            let weight = tukey(sides[l].off(p) / sigma, TUKEY).max(CREASE.least_weight);
            sums[l].add(p - sides[l].at, weight, normal);
        }
        for (side, sums) in sides.iter_mut().zip(&sums).filter(|(_, s)| s.points >= CREASE.least_on_side) {
            *side = sums.plane(side.at);
        }
        label = nearest(sides, points, sigma);
    }
    label
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Rng;
    use std::f64::consts::FRAC_1_SQRT_2;

    const SIGMA: f64 = 0.2;

    /// Points of a plate's end, one for each unit of area, with noise: walls at x = -1.5 and 1.5 below z = 0
    /// and a rim between them. Charts round it off: normals turn from one wall to the other over a circle.
    fn rim(seed: u64) -> Vec<(Point, usize)> {
        let mut rng = Rng::new(seed);
        (0..180)
            .map(|_| {
                let [s, y] = [15.0 * rng.uniform() - 7.5, 12.0 * rng.uniform() - 6.0];
                let side = if s.abs() < 1.5 { 1 } else { usize::from(s > 0.0) * 2 };
                let p = match side {
                    1 => Vec3([s, y, SIGMA * rng.normal()]),
                    _ => Vec3([s.signum() * 1.5 + SIGMA * rng.normal(), y, 1.5 - s.abs()]),
                };
                let turn = (s / 3.0).clamp(-1.0, 1.0) * std::f64::consts::FRAC_PI_2;
                ((p, Vec3([turn.sin(), 0.0, turn.cos()])), side)
            })
            .collect()
    }

    #[test]
    fn a_rim_three_spacings_wide_is_a_side_between_two_walls() {
        for seed in 0..10 {
            let (points, of): (Vec<Point>, Vec<usize>) = rim(seed).into_iter().unzip();
            let (sides, label) = split(&points, SIGMA, 1).expect("sides");
            assert_eq!(sides.len(), 3, "seed {seed}");
            let up = sides.iter().position(|s| s.normal[2] > 0.95).expect("the rim");
            // Points on an edge belong to two sides.
            let inside = |p: &Vec3| p[0].abs() < 0.9 || p[2] < -0.6;
            let right = points.iter().zip(&of).zip(&label).filter(|((p, _), _)| inside(&p.0));
            let (mut wrong, mut all) = (0, 0);
            for ((_, of), l) in right {
                wrong += usize::from((*of == 1) != (*l == up));
                all += 1;
            }
            assert!(50 * wrong <= all, "seed {seed}: {wrong} of {all}");
        }
    }

    #[test]
    fn a_plane_is_one_side_however_uneven_its_normals() {
        let mut rng = Rng::new(1);
        let mut flat = || {
            let [x, y, a, b] = [0; 4].map(|_| 2.0 * rng.uniform() - 1.0);
            let p = Vec3([6.0 * x, 6.0 * y, SIGMA * rng.normal()]);
            (p, Vec3([0.5 * a, 0.5 * b, 1.0]).normalized())
        };
        let points: Vec<Point> = (0..100).map(|_| flat()).collect();
        assert!(split(&points, SIGMA, 1).is_none() && split(&[], SIGMA, 1).is_none());
    }

    #[test]
    fn two_sides_meet_in_a_line_that_is_found() {
        let normal = |x: f64| Vec3([x, 0.0, FRAC_1_SQRT_2]);
        // A roof whose ridge is x = 2, z = 5.
        let at = Vec3([2.0, 7.0, 5.0]);
        let roof = [-FRAC_1_SQRT_2, FRAC_1_SQRT_2].map(|x| Side { at, normal: normal(x) });
        let (frame, start) = meeting(roof, Vec3([1.0, 0.0, 4.0])).expect("a line");
        assert!((frame[2][2] - 1.0).abs() < 1e-12 && frame[1][1].abs() > 1.0 - 1e-12);
        assert!((start * frame[0][0] - 1.0).abs() < 1e-12, "{start} {frame:?}");
        assert!(meeting([roof[0], roof[0]], at).is_none());
    }
}
