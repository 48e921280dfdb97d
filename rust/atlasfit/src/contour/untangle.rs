//! Triangles that meet, moved apart.
//!
//! In: a surface. Out: the same with those vertices moved whose triangles met others elsewhere than at shared
//! vertices and edges, where that helps. Two sheets that cross stay as they are.

use super::constants::CONTOUR;
use super::smooth::{self, Link};
use super::surface::{Surface, corners};
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::bvh::Aabb;
use crate::spatial::edges::Edges;
use crate::spatial::faces::{self, Faces};
use crate::spatial::sets::Sets;

/// A step to the mean of the neighbours, as a share of the way: the whole way would let a strip of two rows
/// swing.
const HALFWAY: f64 = 0.5;

/// Moves the vertices of triangles that meet, and those next to them, to the means of their neighbours, in
/// wider and wider rings, until none meet; those of the boundary along the boundary. Where that does not help
/// they are put back. Gives the number of triangles that this leaves.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn untangle(s: &mut Surface, ctx: &Context<'_>) -> Result<usize> {
    let all: Vec<u32> = (0..s.triangles.len() as u32).collect();
    let mut met = Faces::new(&s.positions, &s.triangles, ctx)?.meeting(&all, ctx)?;
    if met.is_empty() {
        return Ok(0);
    }
    let mut moved = ctx.filled(false, s.positions.len())?;
    let before = s.positions.clone();
    for round in 0..CONTOUR.untangle {
        let free = around(&met, s, round / CONTOUR.widen, ctx)?;
        let at: Vec<u32> = with_any(&s.triangles, &free);
        let links = links(&s.triangles, &at, &free, ctx)?;
        smooth::sweep(&mut s.positions, &links, HALFWAY, ctx)?;
        moved.iter_mut().zip(&free).for_each(|(m, f)| *m |= f);
        met = meeting(s, &at, ctx)?;
        if met.is_empty() {
            break;
        }
    }
    put_back(s, &before, &mut moved, &met, ctx)?;
    smooth::mend_normals(s, &moved, ctx)?;
    Ok(met.len())
}

/// Those of the triangles `of` that meet any.
fn meeting(s: &Surface, of: &[u32], ctx: &Context<'_>) -> Result<Vec<u32>> {
    let boxes: Vec<Aabb> =
        of.iter().map(|&t| Aabb::of(&corners(&s.positions, &s.triangles[t as usize]))).collect();
    let near = faces::near(&s.positions, &s.triangles, &boxes, ctx)?;
    let triangles: Vec<[u32; 3]> = near.iter().map(|&t| s.triangles[t as usize]).collect();
    let numbers: Vec<u32> = of.iter().filter_map(|t| near.binary_search(t).ok()).map(|t| t as u32).collect();
    let met = Faces::new(&s.positions, &triangles, ctx)?.meeting(&numbers, ctx)?;
    Ok(met.into_iter().map(|t| near[t as usize]).collect())
}

/// The vertices of triangles, and some rings of vertices about them.
fn around(of: &[u32], s: &Surface, rings: usize, ctx: &Context<'_>) -> Result<Vec<bool>> {
    let mut all = vec![false; s.positions.len()];
    of.iter().flat_map(|&t| s.triangles[t as usize]).for_each(|v| all[v as usize] = true);
    for _ in 0..rings {
        ctx.check()?;
        for t in with_any(&s.triangles, &all) {
            s.triangles[t as usize].iter().for_each(|&v| all[v as usize] = true);
        }
    }
    Ok(all)
}

/// The triangles at any vertex that is marked.
fn with_any(triangles: &[[u32; 3]], marked: &[bool]) -> Vec<u32> {
    let any = |t: &u32| triangles[*t as usize].iter().any(|&v| marked[v as usize]);
    (0..triangles.len() as u32).filter(any).collect()
}

/// The links that free vertices move along; `at` are the triangles at any of them.
fn links(triangles: &[[u32; 3]], at: &[u32], free: &[bool], ctx: &Context<'_>) -> Result<Vec<Link>> {
    let at: Vec<[u32; 3]> = at.iter().map(|&t| triangles[t as usize]).collect();
    let edges = Edges::new(&at, ctx)?;
    let is_free = |v: u32| free[v as usize];
    let mut rim = vec![false; free.len()];
    for edge in edges.iter().filter(|e| e.len() == 1) {
        let ends = edge[0].ends();
        // All triangles at a free vertex are there; at an edge of others one may not be.
        if ends.iter().any(|&v| is_free(v)) {
            ends.iter().for_each(|&v| rim[v as usize] = true);
        }
    }
    let mut links = Vec::new();
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b] = edge[0].ends();
        let may_move = |v: u32| is_free(v) && (!rim[v as usize] || edge.len() == 1);
        let both = [Link { from: a, to: b }, Link { from: b, to: a }];
        links.extend(both.into_iter().filter(|link| may_move(link.from)));
    }
    Ok(links)
}

/// Puts the vertices back that moved together with those of triangles that meet yet.
fn put_back(
    s: &mut Surface,
    before: &[Vec3],
    moved: &mut [bool],
    met: &[u32],
    ctx: &Context<'_>,
) -> Result<()> {
    if met.is_empty() {
        return Ok(());
    }
    let mut sets = Sets::new(moved.len());
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            if moved[a as usize] && moved[b as usize] {
                sets.join(a, b);
            }
        }
    }
    let mut failed: Vec<u32> =
        met.iter().flat_map(|&t| s.triangles[t as usize]).map(|v| sets.find(v)).collect();
    failed.sort_unstable();
    for (v, moved) in moved.iter_mut().enumerate().filter(|(_, moved)| **moved) {
        if failed.binary_search(&sets.find(v as u32)).is_ok() {
            s.positions[v] = before[v];
            *moved = false;
        }
    }
    ctx.check()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    /// A flat sheet of so many squares of side 1 along both ways.
    fn sheet(n: u32) -> Surface {
        let at = |i: u32| Vec3([f64::from(i % (n + 1)), f64::from(i / (n + 1)), 0.0]);
        let positions: Vec<Vec3> = (0..(n + 1) * (n + 1)).map(at).collect();
        let square = |i: u32| {
            let a = i / n * (n + 1) + i % n;
            [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]
        };
        let count = positions.len();
        let normals = vec![Vec3([0.0, 0.0, 1.0]); count];
        Surface {
            normals,
            chart: vec![0; count],
            positions,
            triangles: (0..n * n).flat_map(square).collect(),
        }
    }

    fn untangled(s: &mut Surface) -> usize {
        Run::default().execute(|ctx| untangle(s, ctx)).unwrap()
    }

    #[test]
    fn what_does_not_meet_stays() {
        let mut s = sheet(6);
        let before = s.positions.clone();
        assert_eq!(untangled(&mut s), 0);
        assert_eq!(s.positions, before);
    }

    #[test]
    fn a_fold_is_moved_apart_and_what_is_far_from_it_stays() {
        let n = 20;
        let mut s = sheet(n);
        let flat = s.positions.clone();
        // A vertex drawn below the sheet, over its neighbours and up again.
        let pulled = (n / 2 * (n + 1) + n / 2) as usize;
        s.positions[pulled] += Vec3([1.6, 0.3, -0.2]);
        s.positions[pulled + 1] += Vec3([0.0, 0.0, -0.4]);
        let before = s.positions[pulled];
        assert_eq!(untangled(&mut s), 0);
        assert!(s.positions[pulled] != before);
        for (v, was) in flat.iter().enumerate().filter(|(_, was)| was.dist2(flat[pulled]) > 49.0) {
            assert_eq!(s.positions[v], *was);
        }
    }

    #[test]
    fn sheets_that_cross_stay_where_they_are() {
        let (mut s, other) = (sheet(8), sheet(8));
        let n = s.positions.len() as u32;
        let turned = other.positions.iter().map(|p| Vec3([p[0] + 0.3, 4.1, p[1] - 3.7]));
        s.positions.extend(turned);
        s.normals.extend(other.normals);
        s.chart.extend(other.chart);
        s.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + n)));
        let before = s.positions.clone();
        assert!(untangled(&mut s) > 0);
        assert_eq!(s.positions, before);
    }
}
