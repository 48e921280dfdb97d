//! The points of all sweeps, and the surface that other sweeps show beside a point of one.
//!
//! In: points in a frame in which the scan's longest side is 1, their sweeps, the motions so far. Out: pairs
//! of a point and the surface beside it.

use super::constants::REGISTER;
use super::solve::{Pair, Part};
use crate::error::Result;
use crate::geometry::Motion;
use crate::numeric::dense::{Principal, cholesky, cholesky_solve, principal};
use crate::numeric::stats::median;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::{Neighbour, Neighbours};
use rayon::prelude::*;

/// The sweeps that are moved together. Columns have an entry for each point.
pub(super) struct Scan {
    pub points: Vec<Vec3>,
    /// The place of its sweep among the motions.
    pub sweep_of: Vec<u32>,
    /// The side that it faces, zero where that is not known; empty where none is known.
    pub toward: Vec<Vec3>,
    /// The points that are matched.
    pub samples: Vec<u32>,
}

/// The scan as motions take it.
struct Moved<'a> {
    scan: &'a Scan,
    points: Vec<Vec3>,
    toward: Vec<Vec3>,
    tree: Neighbours,
    /// The farthest that a point may be from the others' nearest.
    reach: f64,
}

/// The tangent plane of a quadric through neighbours, beside a place.
struct Tangent {
    /// The height of the place over it, along the normal.
    height: f64,
    normal: Vec3,
    /// What each neighbour's place counts for the plane's. They add up to 1.
    weights: Vec<f64>,
    /// What is not known of the normal: two directions along the plane, as long as the standard deviation of
    /// its slope.
    slopes: [Vec3; 2],
    /// Standard deviation of what the quadric leaves, over the width of the neighbours.
    flatness: f64,
}

/// The fewest neighbours whose quadrics are flat in the median, or the most that are tried.
pub(super) fn surround(scan: &Scan, motions: &[Motion], ctx: &Context<'_>) -> Result<usize> {
    let moved = Moved::new(scan, motions, ctx)?;
    for k in REGISTER.surround {
        let looks = scan.samples.par_iter().map(|&i| {
            ctx.check()?;
            let beside = moved.beside(i, k, &mut Vec::new());
            Ok(moved.tangent(i, &beside, k).map(|t| t.flatness))
        });
        let mut flat: Vec<f64> = looks.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect();
        if !flat.is_empty() && median(&mut flat) < REGISTER.flat {
            return Ok(k);
        }
    }
    Ok(REGISTER.surround[REGISTER.surround.len() - 1])
}

/// All pairs of a sampled point and the surface that `k` points of other sweeps show beside it.
pub(super) fn matched(scan: &Scan, motions: &[Motion], k: usize, ctx: &Context<'_>) -> Result<Vec<Pair>> {
    let moved = Moved::new(scan, motions, ctx)?;
    let chunks = scan.samples.par_chunks(64).map(|chunk| {
        ctx.check()?;
        let mut found = Vec::new();
        Ok(chunk.iter().filter_map(|&i| moved.pair(i, k, &mut found)).collect::<Vec<_>>())
    });
    chunks.collect::<Result<Vec<_>>>().map(|v| v.into_iter().flatten().collect())
}

impl<'a> Moved<'a> {
    fn new(scan: &'a Scan, motions: &[Motion], ctx: &Context<'_>) -> Result<Self> {
        let by_sweep = |all: &[Vec3], how: fn(&Motion, Vec3) -> Vec3| -> Vec<Vec3> {
            all.iter().zip(&scan.sweep_of).map(|(p, &s)| how(&motions[s as usize], *p)).collect()
        };
        let points = by_sweep(&scan.points, |m, p| m.of(p));
        let toward = by_sweep(&scan.toward, |m, d| m.turned(d));
        let tree = Neighbours::build(&points, ctx)?;
        let mut found = Vec::new();
        let mut spacing = Vec::with_capacity(scan.samples.len());
        for (at, &i) in scan.samples.iter().enumerate() {
            ctx.check_at(at)?;
            tree.nearest(points[i as usize], 2, &mut found);
            spacing.push(found.last().map_or(0.0, |f| f.dist2.sqrt()));
        }
        let reach = REGISTER.reach.max(REGISTER.reach_spacings * median(&mut spacing));
        Ok(Self { scan, points, toward, tree, reach })
    }

    /// The nearest `k` points of other sweeps that do not face the other way, nearest first; fewer where they
    /// are not among the next few.
    fn beside(&self, i: u32, k: usize, found: &mut Vec<Neighbour>) -> Vec<u32> {
        let own = self.scan.sweep_of[i as usize];
        self.tree.nearest(self.points[i as usize], REGISTER.look_through * k, found);
        let other = |f: &&Neighbour| self.scan.sweep_of[f.index as usize] != own && self.alike(i, f.index);
        found.iter().filter(other).take(k).map(|f| f.index).collect()
    }

    /// Whether two points do not face opposite ways, as far as that is known.
    fn alike(&self, i: u32, j: u32) -> bool {
        self.toward.is_empty() || self.toward[i as usize].dot(self.toward[j as usize]) >= 0.0
    }

    /// A point and the surface that others show beside it; `None` where there is none, or it is another part
    /// of the surface.
    fn pair(&self, i: u32, k: usize, found: &mut Vec<Neighbour>) -> Option<Pair> {
        let beside = self.beside(i, k, found);
        let tangent = self.tangent(i, &beside, k)?;
        // Its own sweep counts for the direction of the surface where it is: beyond an edge is another part.
        // Sweeps farther apart than their spacing show no direction together.
        let around: Vec<u32> = found.iter().map(|f| f.index).filter(|&j| self.alike(i, j)).take(k).collect();
        let own = self.tangent(i, &around, k).filter(|t| t.flatness < REGISTER.flat);
        let near = self.points[*beside.first()? as usize].dist2(self.points[i as usize]);
        let one = near <= self.reach * self.reach
            && tangent.flatness < REGISTER.flat
            && own.is_none_or(|own| tangent.normal.dot(own.normal).abs() > REGISTER.alike);
        if !one {
            return None;
        }
        let mut parts: Vec<Part> = Vec::new();
        for (&j, &weight) in beside.iter().zip(&tangent.weights) {
            let (sweep, at) = (self.scan.sweep_of[j as usize], self.points[j as usize] * weight);
            match parts.iter_mut().find(|p| p.sweep == sweep) {
                Some(part) => {
                    part.weight += weight;
                    part.at += at;
                }
                None => parts.push(Part { sweep, weight, at }),
            }
        }
        Some(Pair {
            sweep: self.scan.sweep_of[i as usize],
            at: self.points[i as usize],
            parts,
            residual: tangent.height,
            normal: tangent.normal,
            slopes: tangent.slopes,
        })
    }

    /// The tangent plane beside a point; `None` where the neighbours are fewer than `k`, or the point lies
    /// beside them: beyond its rim a sweep says nothing of the surface.
    fn tangent(&self, i: u32, neighbours: &[u32], k: usize) -> Option<Tangent> {
        let p = self.points[i as usize];
        let near = || neighbours.iter().map(|&j| self.points[j as usize]);
        if neighbours.len() < k {
            return None;
        }
        let Principal { mean, variances, axes } = principal(near().map(|q| (q, 1.0)))?;
        let off = p - mean;
        let along = off - axes[0] * off.dot(axes[0]);
        let width = variances[1].max(0.0).sqrt();
        if width == 0.0 || along.norm() > REGISTER.within * width {
            return None;
        }
        quadric(near(), p, axes, width)
    }
}

/// Numbers of a quadric.
const TERMS: usize = 6;

/// The tangent plane of the quadric through points, a height along `axes[0]` over the plane of the other two,
/// beside `p`. `width` is how wide the points spread.
fn quadric(
    points: impl Iterator<Item = Vec3> + Clone,
    p: Vec3,
    [normal, v, u]: [Vec3; 3],
    width: f64,
) -> Option<Tangent> {
    let terms = |q: Vec3| {
        let d = (q - p) * (1.0 / width);
        let (x, y) = (d.dot(u), d.dot(v));
        ([1.0, x, y, x * x, x * y, y * y], d.dot(normal))
    };
    let (mut matrix, mut right) = ([0.0; TERMS * TERMS], [0.0; TERMS]);
    for (row, height) in points.clone().map(terms) {
        for i in 0..TERMS {
            right[i] += row[i] * height;
            (i..TERMS).for_each(|j| matrix[TERMS * i + j] += row[i] * row[j]);
        }
    }
    if !cholesky(&mut matrix, TERMS) {
        return None;
    }
    cholesky_solve(&matrix, TERMS, &mut right);
    let times = |row: &[f64; TERMS], x: &[f64; TERMS]| row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
    let (mut squares, mut count) = (0.0, 0usize);
    for (row, height) in points.clone().map(terms) {
        squares += (height - times(&row, &right)).powi(2);
        count += 1;
    }
    let variance = squares / count.saturating_sub(TERMS).max(1) as f64;
    // Columns of the inverse: what each point counts for a term, and on the diagonal the term's variance.
    let column = |term: usize| {
        let mut unit = [0.0; TERMS];
        unit[term] = 1.0;
        cholesky_solve(&matrix, TERMS, &mut unit);
        unit
    };
    let value = column(0);
    let unsure = |term: usize| (variance * column(term)[term]).sqrt();
    let tilted = (normal - u * right[1] - v * right[2]).normalized();
    Some(Tangent {
        // The height along the axis, times the cosine of the tilt.
        height: -right[0] * width * tilted.dot(normal),
        normal: tilted,
        weights: points.map(|q| times(&terms(q).0, &value)).collect(),
        slopes: [u * unsure(1), v * unsure(2)],
        flatness: variance.sqrt(),
    })
}
