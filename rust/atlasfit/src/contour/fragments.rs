//! Fragments of sweeps that do not fit: small parts that float close over a larger one.
//!
//! In: a surface, the points on it. Out: the surface without them. Where sweeps of a scan stand apart by more
//! than charts explain, one of them may come out in pieces over the surface of all. Such a piece follows the
//! surface below it at a distance that the sampling cannot tell, and carries fewer points.

use super::compact::compact;
use super::constants::CONTOUR;
use super::surface::{Surface, corners};
use crate::atlas::ProjectedPoint;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::sets::Sets;
use crate::spatial::triangle::area_vector;
use rayon::prelude::*;

/// A part of which each vertex lies close to a larger one.
struct Fragment {
    /// Its set of vertices.
    part: u32,
    /// Vertices of larger parts that are close to it.
    below: Vec<u32>,
}

/// Removes from a surface without unused vertices the fragments that float within `CONTOUR.afloat` times
/// `spacing`, the median of the points', of a larger part.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn remove(
    s: &mut Surface,
    points: &[ProjectedPoint],
    spacing: f64,
    ctx: &Context<'_>,
) -> Result<()> {
    let mut sets = Sets::of_triangles(s.positions.len(), &s.triangles, ctx)?;
    let part: Vec<u32> = (0..s.positions.len()).map(|v| sets.find(v as u32)).collect();
    if s.triangles.windows(2).all(|t| part[t[0][0] as usize] == part[t[1][0] as usize]) {
        return Ok(());
    }
    let mut area = vec![0.0; s.positions.len()];
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        let third = area_vector(corners(&s.positions, t)).norm() / 6.0;
        t.iter().for_each(|&v| area[v as usize] += third);
    }
    let mut of_part = vec![0.0; s.positions.len()];
    part.iter().zip(&area).for_each(|(&p, a)| of_part[p as usize] += a);
    let tree = Neighbours::build(&s.positions, ctx)?;
    let found = fragments(s, &tree, &part, &of_part, CONTOUR.afloat * spacing, ctx)?;
    if found.is_empty() {
        return Ok(());
    }
    // A vertex carries the points that it is nearest to.
    let claimed = points.iter().filter(|p| p.chart != u32::MAX);
    let claimed: Vec<Vec3> = claimed.map(|p| p.position).collect();
    let mut carried = vec![0u32; s.positions.len()];
    tree.nearest_of(&claimed, ctx)?.iter().for_each(|&v| carried[v as usize] += 1);
    let mut gone = vec![false; s.positions.len()];
    let mut on_part = vec![0u32; s.positions.len()];
    part.iter().zip(&carried).for_each(|(&p, n)| on_part[p as usize] += n);
    for Fragment { part, below } in &found {
        let own = f64::from(on_part[*part as usize]);
        let (points, there) =
            below.iter().fold((0, 0.0), |(n, a), &v| (n + carried[v as usize], a + area[v as usize]));
        // As many as its area would carry of the surface below.
        let expected = f64::from(points) * of_part[*part as usize] / there.max(f64::MIN_POSITIVE);
        // The count of points has its root for a standard deviation.
        gone[*part as usize] = own - CONTOUR.chance * own.sqrt() < CONTOUR.sparser * expected;
    }
    s.triangles.retain(|t| !gone[part[t[0] as usize] as usize]);
    compact(s, ctx)
}

/// The parts that float within `reach` of larger ones, and what is below each.
fn fragments(
    s: &Surface,
    tree: &Neighbours,
    part: &[u32],
    area: &[f64],
    reach: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Fragment>> {
    let mut of: Vec<(u32, u32)> = part.iter().copied().zip(0..).collect();
    of.par_sort_unstable();
    let float = |vertices: &[(u32, u32)]| -> Result<Option<Fragment>> {
        let own = vertices[0].0;
        let (mut near, mut below) = (Vec::new(), Vec::new());
        for (k, &(_, v)) in vertices.iter().enumerate() {
            ctx.check_at(k)?;
            tree.within(s.positions[v as usize], reach, &mut near);
            let larger = near
                .iter()
                .map(|f| f.index)
                .filter(|&u| area[part[u as usize] as usize] > area[own as usize]);
            let before = below.len();
            below.extend(larger);
            if below.len() == before {
                return Ok(None);
            }
        }
        below.sort_unstable();
        below.dedup();
        Ok(Some(Fragment { part: own, below }))
    };
    let parts: Vec<&[(u32, u32)]> = of.chunk_by(|a, b| a.0 == b.0).collect();
    let found: Vec<Option<Fragment>> = parts.into_par_iter().map(float).collect::<Result<_>>()?;
    Ok(found.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    /// A flat square of so many by so many squares of side 0.5 at a height, with its middle at 0.
    fn square(s: &mut Surface, side: u32, height: f64) {
        let first = s.positions.len() as u32;
        let at = |i: u32| 0.5 * (f64::from(i) - 0.5 * f64::from(side));
        for i in 0..=side {
            for j in 0..=side {
                s.positions.push(Vec3([at(i), at(j), height]));
                s.normals.push(Vec3([0.0, 0.0, 1.0]));
                s.chart.push(0);
            }
        }
        let corner = |i, j| first + i * (side + 1) + j;
        for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            s.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }

    /// A point in the middle of each so many of the squares that these triangles are.
    fn points(s: &Surface, triangles: std::ops::Range<usize>, each: usize) -> Vec<ProjectedPoint> {
        let normal = Vec3([0.0, 0.0, 1.0]);
        let of = |t: &[u32; 3]| (s.positions[t[0] as usize] + s.positions[t[2] as usize]) * 0.5;
        let middles = s.triangles[triangles].iter().step_by(2 * each).map(of);
        middles.map(|position| ProjectedPoint { position, normal, chart: 0 }).collect()
    }

    /// Whether of a square of 40 by 40 with one of 16 by 16 at a height above it the latter stays, where it
    /// carries a point on each so many of its squares.
    fn stays(height: f64, each: usize) -> bool {
        let mut s = Surface::default();
        square(&mut s, 40, 0.0);
        let first = s.triangles.len();
        square(&mut s, 16, height);
        let mut on = points(&s, 0..first, 1);
        on.extend(points(&s, first..s.triangles.len(), each));
        let before = s.triangles.len();
        Run::default().execute(|ctx| remove(&mut s, &on, 0.5, ctx)).unwrap();
        assert!([first, before].contains(&s.triangles.len()));
        s.triangles.len() == before
    }

    #[test]
    fn a_sparse_part_close_over_a_larger_one_goes() {
        assert!(!stays(1.2, 4));
    }

    #[test]
    fn a_part_that_carries_as_many_points_or_floats_higher_stays() {
        assert!(stays(1.2, 1));
        assert!(stays(2.2, 4));
    }
}
