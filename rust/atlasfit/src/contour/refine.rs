//! A filling's triangles made as small as those about it.
//!
//! In: triangles that fill a hole, all between vertices of its boundary. Out: the same place with triangles
//! of about one size, by halving edges and flipping them to be Delaunay (after Liepa 2003). The boundary stays.

use super::constants::CONTOUR;
use super::patch::TakenEdges;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::triangle::area_vector;
use std::collections::BTreeSet;

/// An edge within the filling: its ends, and the two triangles with the places of their corners across it.
struct Inner {
    ends: [u32; 2],
    sides: [(u32, u32); 2],
}

/// Halves edges until none within is longer than `longest`; no edge `taken` is made. New vertices go behind
/// `positions`. Returns for each which older vertex it is made of.
///
/// # Errors
/// Cancelled or out of time.
pub(super) fn refine(
    positions: &mut Vec<Vec3>,
    triangles: &mut Vec<[u32; 3]>,
    longest: f64,
    taken: &TakenEdges,
    ctx: &Context<'_>,
) -> Result<Vec<u32>> {
    let mut made_of = Vec::new();
    for _ in 0..CONTOUR.refinements {
        let length2 = |e: &Inner| positions[e.ends[0] as usize].dist2(positions[e.ends[1] as usize]);
        let mut long: Vec<(f64, Inner)> = inner(triangles).into_iter().map(|e| (length2(&e), e)).collect();
        long.retain(|(length2, _)| *length2 > longest * longest);
        if long.is_empty() {
            break;
        }
        long.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.ends.cmp(&b.1.ends)));
        let mut changed = vec![false; triangles.len()];
        for (_, edge) in long {
            ctx.check()?;
            if edge.sides.iter().any(|&(t, _)| changed[t as usize]) {
                continue;
            }
            let [a, b] = edge.ends;
            let middle = positions.len() as u32;
            positions.push((positions[a as usize] + positions[b as usize]) * 0.5);
            made_of.push(a);
            for (t, k) in edge.sides {
                changed[t as usize] = true;
                let [across, from, to] = turned(triangles[t as usize], k);
                triangles[t as usize] = [across, from, middle];
                triangles.push([across, middle, to]);
            }
        }
        for _ in 0..CONTOUR.flips {
            if !flip(positions, triangles, taken, ctx)? {
                break;
            }
        }
    }
    Ok(made_of)
}

/// A triangle with its corner `k` first.
fn turned(t: [u32; 3], k: u32) -> [u32; 3] {
    [0, 1, 2].map(|i| t[(k as usize + i) % 3])
}

/// All edges between two of the triangles, sorted by their ends.
fn inner(triangles: &[[u32; 3]]) -> Vec<Inner> {
    let mut sides: Vec<([u32; 2], (u32, u32))> = (triangles.iter().zip(0..))
        .flat_map(|(&t, i)| {
            (0..3).map(move |k| {
                let [_, a, b] = turned(t, k);
                ([a.min(b), a.max(b)], (i, k))
            })
        })
        .collect();
    sides.sort_unstable();
    let pairs = sides.windows(2).filter(|w| w[0].0 == w[1].0);
    pairs.map(|w| Inner { ends: w[0].0, sides: [w[0].1, w[1].1] }).collect()
}

/// Flips edges whose angles across are more than 180 degrees together. Returns whether it flipped any.
fn flip(
    positions: &[Vec3],
    triangles: &mut [[u32; 3]],
    taken: &TakenEdges,
    ctx: &Context<'_>,
) -> Result<bool> {
    let at = |v: u32| positions[v as usize];
    let edges = inner(triangles);
    let mut there: BTreeSet<[u32; 2]> = edges.iter().map(|e| e.ends).collect();
    let mut changed = vec![false; triangles.len()];
    for edge in &edges {
        ctx.check()?;
        let [(s, i), (t, j)] = edge.sides;
        let ([c, a, b], [d, b2, a2]) = (turned(triangles[s as usize], i), turned(triangles[t as usize], j));
        let flipped = [c.min(d), c.max(d)];
        let stays = changed[s as usize] || changed[t as usize] || [a, b] != [a2, b2];
        if stays || c == d || there.contains(&flipped) || taken.contains(c, d) {
            continue;
        }
        let cotangent = |p: Vec3, q: Vec3, r: Vec3| {
            let (x, y) = (q - p, r - p);
            x.dot(y) / x.cross(y).norm().max(f64::MIN_POSITIVE)
        };
        if cotangent(at(c), at(a), at(b)) + cotangent(at(d), at(a), at(b)) > -1e-9 {
            continue;
        }
        let new = [[a, d, c], [d, b, c]];
        let normal = |t: [u32; 3]| area_vector(t.map(at));
        let before = normal(triangles[s as usize]) + normal(triangles[t as usize]);
        if new.iter().any(|&t| normal(t).dot(before) <= 0.0) {
            continue;
        }
        [triangles[s as usize], triangles[t as usize]] = new;
        (changed[s as usize], changed[t as usize]) = (true, true);
        there.insert(flipped);
    }
    Ok(changed.contains(&true))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    #[test]
    fn a_fan_over_a_polygon_becomes_triangles_of_one_size_that_cover_the_same_area() {
        let n = 40;
        let angle = |i: u32| f64::from(i) * std::f64::consts::TAU / f64::from(n);
        let mut positions: Vec<Vec3> = (0..n).map(|i| Vec3([angle(i).cos(), angle(i).sin(), 0.0])).collect();
        let mut triangles: Vec<[u32; 3]> = (1..n - 1).map(|i| [0, i, i + 1]).collect();
        let area = |p: &[Vec3], ts: &[[u32; 3]]| -> f64 {
            ts.iter().map(|t| 0.5 * area_vector(t.map(|v| p[v as usize]))[2]).sum()
        };
        let before = area(&positions, &triangles);
        let side = 2.0 * (0.5 * angle(1)).sin();
        Run::default()
            .execute(|ctx| {
                let taken = TakenEdges::among(&[], &[], ctx)?;
                refine(&mut positions, &mut triangles, 1.5 * side, &taken, ctx)
            })
            .unwrap();
        assert!((area(&positions, &triangles) - before).abs() < 1e-12);
        let smallest =
            triangles.iter().map(|t| area_vector(t.map(|v| positions[v as usize]))[2]).fold(1.0, f64::min);
        assert!(smallest > 0.05 * side * side, "{smallest} for sides of {side}");
        assert!(inner(&triangles).iter().all(|e| {
            positions[e.ends[0] as usize].dist2(positions[e.ends[1] as usize]) <= (1.5 * side).powi(2)
        }));
        // A disk: one vertex more than edges less triangles.
        assert_eq!(positions.len() + triangles.len(), inner(&triangles).len() + n as usize + 1);
    }
}
