//! Small handles that the points do not ask for, cut.
//!
//! In: the surface, the scan's points and where the charts put them. Out: the same surface, cut along a loop
//! of each such handle, and closed on both sides. Noise, and sweeps that disagree, make charts that cross,
//! and what is contoured there has tunnels (Guskov and Wood 2001).
//!
//! Where to look is found by Euler characteristics ([`cells`], [`piece`]), where to cut by the shortest loops
//! ([`loops`], [`open`]), whether to cut by the points ([`judge`]).

mod cells;
pub(crate) mod constants;
mod judge;
mod loops;
mod open;
mod piece;
mod region;
mod units;

use crate::atlas::{KnownScan, ProjectedPoint};
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::run::Context;
use crate::spatial::lists::Lists;
use constants::HANDLES;
use judge::Points;
use piece::Piece;
use rayon::prelude::*;
use region::{Mesh, Region, put};
use rustc_hash::FxHashSet;
use units::Units;

/// Cuts the handles.
///
/// # Errors
/// Cancelled or out of time.
pub(crate) fn cut(
    s: &mut Surface,
    projected: &[ProjectedPoint],
    known: &KnownScan<'_>,
    ctx: &Context<'_>,
) -> Result<()> {
    let units = Units::new(projected, known);
    let mesh = Mesh::new(s, ctx)?;
    let suspects = cells::suspects(s, &mesh, &units, ctx)?;
    if suspects.is_empty() {
        return Ok(());
    }
    let points = Points::new(projected, known, ctx)?;
    let mut region = Region::about(s, &mesh, suspects.concat(), ctx)?;
    drop((mesh, suspects));
    let part = &mut region.part;
    let mut look = ctx.filled(true, part.positions.len())?;
    for _ in 0..HANDLES.rounds {
        let pieces = pieces(part, &units, &look, ctx)?;
        let cuts = pieces.par_iter().map(|(piece, unit)| points.cut(part, piece, *unit, ctx));
        let cuts: Vec<Option<Surface>> = cuts.collect::<Result<_>>()?;
        for ((piece, _), cut) in pieces.iter().zip(&cuts) {
            // Where a handle was cut there may be another one; one that stays need not be looked at again.
            piece.vertices.iter().for_each(|&v| look[v as usize] = cut.is_some());
            if let Some(cut) = cut {
                put(part, &piece.vertices, &piece.faces, cut);
            }
        }
        look.resize(part.positions.len(), true);
        if cuts.iter().all(Option::is_none) {
            break;
        }
    }
    put(s, &region.vertices, &region.faces, &region.part);
    Ok(())
}

/// Pieces about the vertices to look at that have handles, with the unit of length there. No two share a
/// vertex: the smaller ones come first.
fn pieces(s: &Surface, units: &Units, look: &[bool], ctx: &Context<'_>) -> Result<Vec<(Piece, f64)>> {
    let mesh = Mesh::new(s, ctx)?;
    let suspects = cells::suspects(s, &mesh, units, ctx)?;
    let around = Lists::new(s.positions.len(), &s.triangles, ctx)?;
    let find = |vertices: &Vec<u32>| {
        let mut places: Vec<u32> = Vec::new();
        let mut done: FxHashSet<u32> = FxHashSet::default();
        let mut found = Vec::new();
        for &v in vertices.iter().filter(|&&v| look[v as usize]) {
            ctx.check()?;
            let (at, unit) = (s.positions[v as usize], units.at(s, v));
            let near = |&w: &u32| s.positions[w as usize].dist2(at) < (HANDLES.apart * unit).powi(2);
            if done.contains(&v) || places.iter().any(near) {
                continue;
            }
            places.push(v);
            let about = |radius: f64| {
                let piece = Piece::about(s, &around, &piece::ball(s, &mesh.neighbours, v, radius * unit));
                piece.filter(|piece| piece.handles > 0)
            };
            if let Some(piece) = HANDLES.radii.into_iter().find_map(about) {
                done.extend(&piece.vertices);
                found.push((piece, unit));
            }
        }
        Ok(found)
    };
    let found = suspects.par_iter().map(find).collect::<Result<Vec<_>>>()?;
    let mut found: Vec<(Piece, f64)> = found.into_iter().flatten().collect();
    found.sort_by_key(|(piece, _)| piece.faces.len());
    let mut taken = ctx.filled(false, s.positions.len())?;
    found.retain(|(piece, _)| {
        let free = !piece.vertices.iter().any(|&v| taken[v as usize]);
        piece.vertices.iter().filter(|_| free).for_each(|&v| taken[v as usize] = true);
        free
    });
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;
    use crate::numeric::vec3::Vec3;
    use crate::spatial::edges::Edges;
    use rustc_hash::FxHashMap;

    type Voxel = [i32; 3];

    /// The boundary of some cubes, two triangles for each side of a cube that faces none.
    fn boundary(solid: &dyn Fn(Voxel) -> bool) -> Surface {
        let mut names: FxHashMap<Voxel, u32> = FxHashMap::default();
        let mut s = Surface { positions: vec![], normals: vec![], chart: vec![], triangles: vec![] };
        for_each_side(solid, |cube, axis, side| {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            let quad = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[du, dv]| {
                let mut at = cube;
                (at[axis], at[u], at[v]) = (cube[axis] + side, cube[u] + du, cube[v] + dv);
                *names.entry(at).or_insert_with(|| {
                    s.positions.push(Vec3(at.map(f64::from)));
                    s.positions.len() as u32 - 1
                })
            });
            let [a, b, c, d] = if side == 1 { quad } else { [quad[3], quad[2], quad[1], quad[0]] };
            s.triangles.extend([[a, b, c], [a, c, d]]);
        });
        (s.normals, s.chart) = (vec![Vec3::ZERO; s.positions.len()], vec![0; s.positions.len()]);
        s
    }

    fn for_each_side(solid: &dyn Fn(Voxel) -> bool, mut found: impl FnMut(Voxel, usize, i32)) {
        for cube in (0..14 * 14 * 14).map(|i| [i % 14, i / 14 % 14, i / 196]).filter(|&cube| solid(cube)) {
            for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
                let mut beyond = cube;
                beyond[axis] += 2 * side - 1;
                if !solid(beyond) {
                    found(cube, axis, side);
                }
            }
        }
    }

    /// A point in the middle of each side of some cubes.
    fn middles(solid: &dyn Fn(Voxel) -> bool) -> Vec<Vec3> {
        let mut points = Vec::new();
        for_each_side(solid, |cube, axis, side| {
            let mut at = cube.map(|x| f64::from(x) + 0.5);
            at[axis] = f64::from(cube[axis] + side);
            points.push(Vec3(at));
        });
        points
    }

    fn within(cube: Voxel, low: Voxel, high: Voxel) -> bool {
        (0..3).all(|k| (low[k]..high[k]).contains(&cube[k]))
    }

    /// A slab of three layers.
    fn slab(cube: Voxel) -> bool {
        within(cube, [1, 1, 1], [13, 13, 4])
    }

    /// The surface of some cubes with its handles cut, where the points are those of the `scanned` ones.
    fn after_cutting(solid: &dyn Fn(Voxel) -> bool, scanned: &dyn Fn(Voxel) -> bool, noise: f64) -> Surface {
        let points = middles(scanned);
        let on = |&position: &Vec3| ProjectedPoint { position, normal: Vec3::ZERO, chart: 0 };
        let projected: Vec<ProjectedPoint> = points.iter().map(on).collect();
        let spacing = vec![1.0; points.len()];
        let known = KnownScan { points: &points, spacing: &spacing, noise, relative_noise: &[], charts: &[] };
        let mut s = boundary(solid);
        Run::default().execute(|ctx| cut(&mut s, &projected, &known, ctx)).unwrap();
        s
    }

    /// Handles of a closed connected surface.
    fn handles(s: &Surface) -> i64 {
        let edges = Run::default().execute(|ctx| Edges::new(&s.triangles, ctx)).unwrap();
        for edge in edges.iter() {
            assert_eq!(edge.len(), 2, "closed");
            assert!(!edge[0].runs_as(edge[1], &s.triangles), "faces one way");
        }
        let count = [s.positions.len(), edges.iter().count(), s.triangles.len()].map(|n| n as i64);
        (2 - count[0] + count[1] - count[2]) / 2
    }

    /// A tunnel from the top of the slab to its top.
    fn burrow(cube: Voxel, x: i32, y: i32) -> bool {
        within(cube, [x, y, 2], [x + 3, y + 1, 3])
            || within(cube, [x, y, 3], [x + 1, y + 1, 4])
            || within(cube, [x + 2, y, 3], [x + 3, y + 1, 4])
    }

    #[test]
    fn tunnels_that_no_point_asks_for_are_closed() {
        for places in [&[[6, 7]][..], &[[5, 6], [6, 8]], &[[3, 3], [8, 9], [3, 9]]] {
            let burrowed = |cube| slab(cube) && !places.iter().any(|&[x, y]| burrow(cube, x, y));
            assert_eq!(handles(&boundary(&burrowed)), places.len() as i64);
            let s = after_cutting(&burrowed, &slab, 0.1);
            assert_eq!(handles(&s), 0, "{places:?}");
            assert_eq!((s.normals.len(), s.chart.len()), (s.positions.len(), s.positions.len()));
        }
    }

    #[test]
    fn a_bridge_that_no_point_asks_for_is_cut() {
        let arch = |cube| {
            slab(cube)
                || within(cube, [5, 6, 4], [6, 7, 6])
                || within(cube, [7, 6, 4], [8, 7, 6])
                || within(cube, [5, 6, 6], [8, 7, 7])
        };
        assert_eq!(handles(&boundary(&arch)), 1);
        assert_eq!(handles(&after_cutting(&arch, &slab, 0.1)), 0);
        // With its own points it stays.
        assert_eq!(handles(&after_cutting(&arch, &arch, 0.1)), 1);
    }

    #[test]
    fn a_wide_opening_stays() {
        let frame = |cube| slab(cube) && !within(cube, [4, 4, 0], [10, 10, 9]);
        assert_eq!(handles(&after_cutting(&frame, &frame, 0.1)), 1);
    }

    #[test]
    fn a_surface_without_handles_keeps_its_bytes() {
        let (before, after) = (boundary(&slab), after_cutting(&slab, &slab, 0.1));
        assert_eq!((before.positions, before.triangles), (after.positions, after.triangles));
    }
}
