//! Where charts begin: each as a small flat patch of its own on the scan.
//!
//! In: points in the normalised frame, the number of charts. Out: a rectangle for each. The points are cut
//! into cells about centres far apart (Gonzalez 1985), moved to the middle of their cells in rounds (Lloyd
//! 1982); distances go along the scan. A rectangle lies in the principal plane of the points about its
//! centre. Our choice: the paper starts networks at random and does not say from which distribution.

use super::options::Dim;
use crate::sample::Sample;
use atlasfit::error::Result;
use atlasfit::numeric::dense::principal;
use atlasfit::numeric::vec3::Vec3;
use atlasfit::run::Context;
use atlasfit::spatial::neighbours::Neighbours;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Rounds in which centres move to the middle of their cells. Source: chosen.
const ROUNDS: usize = 8;
/// Neighbours of a point in the graph that distances go along. Source: chosen: enough to connect a uniform
/// sample of a surface.
const NEIGHBOURS: usize = 10;
/// The share of a cell's points, those nearest to its centre, whose plane and extent a patch takes. Source:
/// measured by `atlasfit bench paper --only starts`.
const SHARE: f64 = 0.25;
/// The least half side of a patch, in the normalised frame, so that no chart is a line or a point.
const LEAST: f64 = 1e-3;
/// The farthest coordinate that a patch reaches: tanh is flat at 1.
const REACH: f64 = 0.95;
/// Points per task.
const BLOCK: usize = 512;

/// A rectangle: its centre, and from there to the middles of two of its sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Patch {
    /// The middle.
    pub centre: Vec3,
    /// Half of the longer and of the shorter side.
    pub half: [Vec3; 2],
}

impl Patch {
    /// The samples of a grid on the patch; a curve runs along its longer side.
    pub(super) fn samples(&self, dim: Dim, grid: [usize; 2]) -> Vec<Sample> {
        let place = |i: usize, n: usize| (2 * i + 1) as f64 / n as f64 - 1.0;
        let [lines, side] = grid;
        (0..lines * side)
            .map(|i| {
                let [along, across] = match dim {
                    Dim::Contour => [place(i, side), 0.0],
                    Dim::Surface => [place(i % side, side), place(i / side, lines)],
                };
                let at = self.centre + self.half[0] * along + self.half[1] * across;
                at.map(|x| x.clamp(-REACH, REACH)).to_f32()
            })
            .collect()
    }
}

/// A patch for each of so many charts.
///
/// # Errors
/// [`atlasfit::Error::EmptyInput`] without points; cancelled or out of time.
pub(super) fn patches(points: &[Vec3], charts: usize, ctx: &Context<'_>) -> Result<Vec<Patch>> {
    let graph = Graph::new(points, ctx)?;
    let mut centres = far_apart(&graph, points, charts, ctx)?;
    for _ in 0..ROUNDS {
        let cells = graph.cells(&centres, ctx)?;
        for (centre, cell) in centres.iter_mut().zip(&cells) {
            let Some(whole) = principal(cell.iter().map(|i| (points[*i as usize], 1.0))) else { continue };
            let off = |i: &u32| points[*i as usize].dist2(whole.mean);
            *centre = cell.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(*centre);
        }
    }
    Ok((graph.cells(&centres, ctx)?.iter().zip(&centres))
        .map(|(cell, &centre)| {
            let near = &cell[..((SHARE * cell.len() as f64).ceil() as usize).max(1).min(cell.len())];
            let Some(found) = principal(near.iter().map(|i| (points[*i as usize], 1.0))) else {
                // More charts than points.
                let half = [Vec3([LEAST, 0.0, 0.0]), Vec3([0.0, LEAST, 0.0])];
                return Patch { centre: points[centre as usize], half };
            };
            // A uniform rectangle's variance along a side of half length h is h^2 / 3.
            let half = |k: usize| found.axes[k] * (3.0 * found.variances[k].max(0.0)).sqrt().max(LEAST);
            Patch { centre: found.mean, half: [half(2), half(1)] }
        })
        .collect())
}

/// Each point joined to its nearest ones, both ways.
struct Graph {
    edges: Vec<Vec<(u32, f64)>>,
}

impl Graph {
    fn new(points: &[Vec3], ctx: &Context<'_>) -> Result<Self> {
        let tree = Neighbours::build(points, ctx)?;
        let near = points
            .par_chunks(BLOCK)
            .map(|block| {
                ctx.check()?;
                let mut found = Vec::new();
                Ok(block
                    .iter()
                    .map(|p| {
                        tree.nearest(*p, NEIGHBOURS + 1, &mut found);
                        found.iter().map(|f| (f.index, f.dist2.sqrt())).collect::<Vec<_>>()
                    })
                    .collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>>>()?
            .concat();
        let mut edges = near.clone();
        for (i, near) in near.iter().enumerate() {
            ctx.check_at(i)?;
            for &(j, length) in near {
                edges[j as usize].push((i as u32, length));
            }
        }
        Ok(Self { edges })
    }

    /// Shortens distances by ways from some points, whose own distance is 0, and calls `reached` for each
    /// point in the order of its distance, with the number of the point it was reached from.
    fn spread(
        &self,
        from: &[u32],
        distance: &mut [f64],
        ctx: &Context<'_>,
        mut reached: impl FnMut(u32, u32),
    ) -> Result<()> {
        // Distances of 0 and more are ordered as their bits are.
        let mut open = BinaryHeap::new();
        for (k, &i) in from.iter().enumerate() {
            if distance[i as usize] > 0.0 {
                distance[i as usize] = 0.0;
                open.push(Reverse((0u64, i, k as u32)));
            }
        }
        let mut steps = 0;
        while let Some(Reverse((bits, i, source))) = open.pop() {
            ctx.check_at(steps)?;
            steps += 1;
            let so_far = f64::from_bits(bits);
            if so_far > distance[i as usize] {
                continue;
            }
            reached(i, source);
            for &(j, length) in &self.edges[i as usize] {
                let there = so_far + length;
                if there < distance[j as usize] {
                    distance[j as usize] = there;
                    open.push(Reverse((there.to_bits(), j, source)));
                }
            }
        }
        Ok(())
    }

    /// The points nearest to each centre along the scan, nearest first. Those that no way leads to are in no
    /// cell.
    fn cells(&self, centres: &[u32], ctx: &Context<'_>) -> Result<Vec<Vec<u32>>> {
        let mut distance = vec![f64::INFINITY; self.edges.len()];
        let mut cells = vec![Vec::new(); centres.len()];
        self.spread(centres, &mut distance, ctx, |i, source| cells[source as usize].push(i))?;
        Ok(cells)
    }
}

/// So many of the points, each the farthest along the scan from those before it; the first is the farthest
/// from the middle.
fn far_apart(graph: &Graph, points: &[Vec3], count: usize, ctx: &Context<'_>) -> Result<Vec<u32>> {
    let middle = principal(points.iter().map(|p| (*p, 1.0))).map_or(Vec3::ZERO, |whole| whole.mean);
    let mut distance: Vec<f64> = points.iter().map(|p| p.dist2(middle)).collect();
    let mut centres = Vec::with_capacity(count);
    for chart in 0..count {
        let mut farthest = 0;
        for (i, d) in distance.iter().enumerate() {
            if *d > distance[farthest] {
                farthest = i;
            }
        }
        if chart == 0 {
            distance.fill(f64::INFINITY);
        }
        centres.push(farthest as u32);
        graph.spread(&[farthest as u32], &mut distance, ctx, |_, _| ())?;
    }
    Ok(centres)
}

#[cfg(test)]
mod tests {
    use super::*;
    use atlasfit::run::Run;

    fn made(points: &[Vec3], charts: usize) -> Vec<Patch> {
        Run::default().execute(|ctx| patches(points, charts, ctx)).unwrap()
    }

    /// Three turns of a thin helix, nearer to each other than an eighth of its length.
    fn helix() -> Vec<Vec3> {
        (0..3000)
            .map(|i| {
                let a = f64::from(i) / 3000.0 * 3.0 * std::f64::consts::TAU;
                let across = 0.01 * f64::from(i % 7 - 3) / 3.0;
                Vec3([(0.4 + across) * a.cos(), (0.4 + across) * a.sin(), 0.02 * a])
            })
            .collect()
    }

    #[test]
    fn patches_lie_on_the_scan_apart_from_each_other_and_in_its_plane() {
        let points = helix();
        let found = made(&points, 8);
        for (i, a) in found.iter().enumerate() {
            let near = points.iter().map(|p| p.dist2(a.centre)).fold(f64::INFINITY, f64::min).sqrt();
            assert!(near < 0.04, "patch {i} is {near} from the scan");
            // Along the tube, and thin across it: a cell over several turns would be as wide as they are
            // apart.
            assert!(a.half[0].norm() > 0.06 && a.half[1].norm() < 0.04, "{a:?}");
            for b in &found[..i] {
                assert!(a.centre.dist2(b.centre).sqrt() > 0.1);
            }
        }
    }

    #[test]
    fn samples_fill_the_patch_and_stay_where_networks_reach() {
        let half = [Vec3([0.9, 0.0, 0.0]), Vec3([0.0, 0.1, 0.0])];
        let patch = Patch { centre: Vec3([0.5, 0.0, 0.2]), half };
        let samples = patch.samples(Dim::Surface, [2, 4]);
        assert_eq!(samples.len(), 8);
        assert!(samples.iter().flatten().all(|x| x.abs() <= REACH as f32));
        assert!((samples[0][0] + 0.175).abs() < 1e-6 && (samples[0][1] + 0.05).abs() < 1e-6);
        assert!(patch.samples(Dim::Contour, [1, 4]).iter().all(|s| s[1] == 0.0));
    }

    #[test]
    fn few_points_and_many_charts_still_give_a_patch_each() {
        let one = [Vec3([0.1, 0.2, 0.3])];
        for patch in made(&one, 3) {
            assert_eq!(patch.centre, one[0]);
            assert!(patch.half.iter().all(|h| h.norm() >= LEAST));
        }
    }
}
