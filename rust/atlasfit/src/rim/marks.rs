//! What the points beside boundaries say of them.
//!
//! In: boundaries, the scan's points where the charts put them. Out: for each boundary how far within or
//! beyond it each point lies and at which node, and how dense the points are.

use super::constants::RIM;
use super::curve::{Curve, Node, smooth};
use crate::atlas::{KnownScan, ProjectedPoint};
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::lists::Lists;
use crate::spatial::neighbours::Neighbours;
use crate::spatial::spacing::NAMED;
use rayon::prelude::*;

#[derive(Clone)]
/// What the points say of one boundary. Lengths are in spacings of the points beside it.
pub(super) struct Marks {
    /// For each node how far out the points beside it lie.
    pub out: Vec<Vec<f64>>,
    /// How many points there are about each node on a square of side 1.
    pub density: Vec<f64>,
    /// Standard deviation of the noise.
    pub sigma: f64,
}

/// The spacing of the points about each vertex of the rings.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn spacing(
    s: &Surface,
    rings: &[Vec<u32>],
    projected: &[ProjectedPoint],
    scan: &KnownScan<'_>,
    ctx: &Context<'_>,
) -> Result<Vec<Vec<f64>>> {
    let at: Vec<Vec3> = rings.iter().flatten().map(|&v| s.positions[v as usize]).collect();
    let tree = Neighbours::build(&at, ctx)?;
    let near = |(i, p): (usize, &ProjectedPoint)| {
        let spacing = f64::from(scan.spacing[i]);
        let found = (p.chart != u32::MAX).then(|| tree.nearest_one(p.position));
        found.filter(|f| f.dist2 < (RIM.band * spacing).powi(2)).map(|f| (f.index, spacing))
    };
    let near = each(projected, near, ctx)?;
    let mut sum = vec![(0.0, 0.0); at.len()];
    for (vertex, spacing) in near {
        let (total, count) = &mut sum[vertex as usize];
        *total += spacing;
        *count += 1.0;
    }
    let mut start = 0;
    let of_ring = |ring: &Vec<u32>| {
        let sum = &sum[start..start + ring.len()];
        start += ring.len();
        along(sum, ring.len())
    };
    Ok(rings.iter().map(of_ring).collect())
}

/// Means along a ring, of sums and counts at its places; 1 where there is none.
fn along(sum: &[(f64, f64)], n: usize) -> Vec<f64> {
    let (mut total, mut count): (Vec<f64>, Vec<f64>) = sum.iter().copied().unzip();
    let [all, of] = [&total, &count].map(|x| x.iter().sum::<f64>());
    let mean = if of > 0.0 { all / of } else { 1.0 };
    smooth(&mut total, RIM.wide_smoothings);
    smooth(&mut count, RIM.wide_smoothings);
    // Where points are far, all of the ring has a say.
    (0..n).map(|k| (total[k] + 1e-3 * mean) / (count[k] + 1e-3)).collect()
}

/// What is found at each of the points, in order; the points are looked at side by side.
fn each<T: Send>(
    projected: &[ProjectedPoint],
    find: impl Fn((usize, &ProjectedPoint)) -> Option<T> + Sync,
    ctx: &Context<'_>,
) -> Result<Vec<T>> {
    let found = projected
        .par_chunks(1024)
        .enumerate()
        .map(|(c, chunk)| {
            ctx.check()?;
            Ok((c * 1024..).zip(chunk).filter_map(&find).collect::<Vec<T>>())
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(found.into_iter().flatten().collect())
}

/// A point near a boundary.
struct Near {
    position: Vec3,
    /// The nearest node of all boundaries.
    node: u32,
    /// How far out it lies; nothing where it lies on another sheet.
    out: Option<f64>,
    sigma: f64,
}

/// What the points say of each boundary.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn of_points(
    curves: &[Curve],
    projected: &[ProjectedPoint],
    scan: &KnownScan<'_>,
    ctx: &Context<'_>,
) -> Result<Vec<Marks>> {
    let nodes: Vec<Node> = curves.iter().flat_map(|c| &c.nodes).copied().collect();
    let near = near(&nodes, projected, scan, ctx)?;
    let density = densities(&nodes, &near, ctx)?;
    let mut marks = Vec::with_capacity(curves.len());
    let of_node = {
        let owners: Vec<[u32; 1]> = near.iter().map(|p| [p.node]).collect();
        Lists::new(nodes.len(), &owners, ctx)?
    };
    let mut start = 0;
    for curve in curves {
        ctx.check()?;
        let (mut sigma, mut count) = (0.0, 0.0);
        let mut sums = vec![(0.0, 0.0); curve.nodes.len()];
        let mut out = vec![Vec::new(); curve.nodes.len()];
        for (k, out) in out.iter_mut().enumerate() {
            for &i in of_node.of((start + k) as u32) {
                let p = &near[i as usize];
                let band = RIM.band + RIM.band_sigmas * p.sigma;
                let Some(u) = p.out.filter(|u| u.abs() < band) else { continue };
                out.push(u);
                (sigma, count) = (sigma + p.sigma, count + 1.0);
                if let Some(density) = density[i as usize] {
                    sums[k].0 += density;
                    sums[k].1 += 1.0;
                }
            }
        }
        start += curve.nodes.len();
        marks.push(Marks { out, density: along(&sums, sums.len()), sigma: sigma / f64::max(count, 1.0) });
    }
    Ok(marks)
}

/// The points near boundaries.
fn near(
    nodes: &[Node],
    projected: &[ProjectedPoint],
    scan: &KnownScan<'_>,
    ctx: &Context<'_>,
) -> Result<Vec<Near>> {
    let at: Vec<Vec3> = nodes.iter().map(|n| n.position).collect();
    let tree = Neighbours::build(&at, ctx)?;
    let find = |(i, p): (usize, &ProjectedPoint)| {
        if p.chart == u32::MAX {
            return None;
        }
        let found = tree.nearest_one(p.position);
        let node = &nodes[found.index as usize];
        let unit = 1.0 / node.spacing;
        let off = (p.position - node.position) * unit;
        let sigma = scan.noise_at(i as u32) * unit;
        let far = RIM.band + RIM.neighbours + RIM.band_sigmas * sigma;
        let [out, above] = [node.out, node.normal].map(|axis| axis.dot(off));
        let same = above.abs() < RIM.off && p.normal.dot(node.normal).abs() > RIM.same_way;
        let near = Near { position: p.position, node: found.index, out: same.then_some(out), sigma };
        (off.norm() < far).then_some(near)
    };
    each(projected, find, ctx)
}

/// How many points there are about each on a square of side 1, where it lies far enough within. On the
/// surface, not as they were scanned: noise thins them out.
fn densities(nodes: &[Node], near: &[Near], ctx: &Context<'_>) -> Result<Vec<Option<f64>>> {
    let at: Vec<Vec3> = near.iter().map(|p| p.position).collect();
    if at.is_empty() {
        return Ok(Vec::new());
    }
    let tree = Neighbours::build(&at, ctx)?;
    let chunks = near.par_chunks(1024).map(|chunk| {
        ctx.check()?;
        let mut found = Vec::new();
        let density = |p: &Near| {
            let blurred = RIM.band_sigmas * p.sigma;
            let out = p.out?;
            if !(RIM.within + blurred..RIM.band + blurred).contains(&-out) {
                return None;
            }
            tree.nearest(p.position, NAMED + 1, &mut found);
            let area = found.last().map_or(0.0, |f| f.dist2) * std::f64::consts::PI;
            // With the last of so many at the circle's edge, the mean of one over its area is larger.
            let side = nodes[p.node as usize].spacing;
            (area > 0.0).then(|| (NAMED - 1) as f64 * side * side / area)
        };
        Ok(chunk.iter().map(density).collect::<Vec<_>>())
    });
    Ok(chunks.collect::<Result<Vec<_>>>()?.concat())
}
