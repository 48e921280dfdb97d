//! Filling small holes.
//!
//! In: an oriented triangle surface, the longest boundary to fill, the widest slit. Out: the same surface with those holes triangulated. Slits are holes
//! of any length whose sides run close to each other: where the two sides of a thin part fail to meet at its rim. Each hole gets the
//! triangulation of its boundary with the least area, which bends least for the small holes that are meant (dynamic programming; Barequet
//! and Sharir 1995, Liepa 2003). A triangle that would repeat an edge of the surface is never used, so the result stays manifold.

use super::clean::{edges, groups, runs_down, split_bowties};
use super::surface::Surface;
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::neighbours::Neighbours;
use rayon::prelude::*;

/// Holes of more edges are cut in two where their sides come close, or left open: the triangulation costs the cube of it.
const MAX_EDGES: usize = 400;
/// A cut is at most this many times as long as the widest slit.
const CUT: f64 = 1.5;
/// A cut leaves at least this many times its greatest length of boundary on either side: else it would cut a corner of the outline, not across a slit.
const BEHIND: f64 = 2.0;
/// A slit is nowhere wider than this many times the widest mean.
const ACROSS: f64 = 4.0;
/// A slit's filling may have at most this share of the area of the surface around it: else the surface is a ribbon, and the filling its back.
const RIBBON: f64 = 0.2;

/// Boundary loops as vertices in the order in which new triangles run along them. Vertices where boundaries touch make no loop.
fn loops(s: &Surface, ctx: &Context<'_>) -> Result<Vec<Vec<u32>>> {
    let list = edges(&s.triangles, ctx)?;
    // The missing triangle runs against the one that is there.
    let mut next: Vec<(u32, u32)> = groups(&list)
        .filter(|g| g.len() == 1)
        .map(|g| if runs_down(&g[0]) { (g[0].0, g[0].1) } else { (g[0].1, g[0].0) })
        .collect();
    drop(list);
    sort(&mut next, ctx)?;
    let successor = |v: u32| {
        let i = next.partition_point(|e| e.0 < v);
        match next.get(i) {
            Some(e) if e.0 == v && next.get(i + 1).is_none_or(|f| f.0 != v) => Some((i, e.1)),
            _ => None,
        }
    };
    let mut seen = vec![false; next.len()];
    let mut out = Vec::new();
    for start in 0..next.len() {
        if seen[start] {
            continue;
        }
        let (first, mut v) = next[start];
        let mut ring = vec![first];
        seen[start] = true;
        let closed = loop {
            if v == first {
                break true;
            }
            let Some((i, to)) = successor(v) else { break false };
            if seen[i] {
                break false;
            }
            seen[i] = true;
            ring.push(v);
            v = to;
        };
        if closed && ring.len() >= 3 {
            out.push(ring);
        }
    }
    Ok(out)
}

/// Fills every hole whose boundary is at most `longest` long, and every slit that is at most `widest` wide in the mean. Returns how many were
/// filled, and which vertices lie about them.
///
/// # Errors
/// Cancelled or out of time.
pub fn fill(s: &mut Surface, longest: f64, widest: f64, ctx: &Context<'_>) -> Result<(usize, Vec<bool>)> {
    let length = |r: &[u32]| {
        (0..r.len())
            .map(|i| s.positions[r[i] as usize].dist2(s.positions[r[(i + 1) % r.len()] as usize]).sqrt())
            .sum::<f64>()
    };
    let holes = loops(s, ctx)?;
    let mut touched = vec![false; s.positions.len()];
    if holes.is_empty() {
        return Ok((0, touched));
    }
    // Edges among the holes' vertices: a filling must not use them again.
    let mut of_hole = vec![false; s.positions.len()];
    for &v in holes.iter().flatten() {
        of_hole[v as usize] = true;
    }
    let mut taken: Vec<(u32, u32)> = Vec::new();
    for t in &s.triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            if of_hole[a as usize] && of_hole[b as usize] {
                taken.push((a.min(b), a.max(b)));
            }
        }
    }
    sort(&mut taken, ctx)?;
    let was_cut = holes.iter().any(|r| r.len() > MAX_EDGES);
    let holes = cut(&s.positions, holes, &taken, CUT * widest, ctx)?;
    let positions = &s.positions;
    let whole: f64 = s.triangles.iter().map(|t| area(t.map(|v| positions[v as usize]))).sum();
    let patches: Vec<Option<Vec<[u32; 3]>>> = holes
        .par_iter()
        .map(|ring| {
            ctx.check()?;
            let length = length(ring);
            // A long one can only be a slit: nothing but short edges lead across.
            let across = if length <= longest { f64::INFINITY } else { ACROSS * widest };
            let Some((patch, area)) = triangulate(positions, ring, across, &taken, ctx)? else {
                return Ok(None);
            };
            let slit = area <= 0.5 * length * widest && area <= RIBBON * whole;
            Ok((length <= longest || slit).then_some(patch))
        })
        .collect::<Result<_>>()?;
    let mut filled = 0;
    for patch in patches.into_iter().flatten() {
        for &v in patch.iter().flatten() {
            touched[v as usize] = true;
        }
        s.triangles.extend(patch);
        filled += 1;
    }
    // A piece between two cuts that end in one vertex may be filled while those beside it stay open.
    if was_cut && filled > 0 {
        split_bowties(s, ctx)?;
        touched.resize(s.positions.len(), true);
    }
    Ok((filled, touched))
}

/// Cuts rings of too many edges in two, and those again, by edges at most `longest` long that are not taken. Rings that cannot be cut are left out.
fn cut(
    positions: &[Vec3],
    rings: Vec<Vec<u32>>,
    taken: &[(u32, u32)],
    longest: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Vec<u32>>> {
    let (mut todo, mut out) = (Vec::new(), Vec::new());
    for ring in rings {
        let pairs =
            if ring.len() > MAX_EDGES { close(positions, &ring, taken, longest, ctx)? } else { vec![] };
        todo.push((ring, pairs));
    }
    while let Some((ring, pairs)) = todo.pop() {
        ctx.check()?;
        let n = ring.len() as u32;
        if ring.len() <= MAX_EDGES {
            out.push(ring);
            continue;
        }
        // The most even cut; the shortest of several.
        let even = |p: &Pair| (p.j - p.i).min(n - (p.j - p.i));
        let better = |p: &&Pair, q: &&Pair| even(p).cmp(&even(q)).then(q.dist2.total_cmp(&p.dist2));
        let Some(&Pair { i, j, .. }) = pairs.iter().max_by(better) else { continue };
        let inner = ring[i as usize..=j as usize].to_vec();
        let outer = ring[j as usize..].iter().chain(&ring[..=i as usize]).copied().collect();
        let (mut within, mut beyond) = (Vec::new(), Vec::new());
        let turned = |k: u32| if k >= j { k - j } else { n - j + k };
        for p in pairs.into_iter().filter(|p| (p.i, p.j) != (i, j)) {
            if p.i >= i && p.j <= j {
                within.push(Pair { i: p.i - i, j: p.j - i, ..p });
            } else if [p.i, p.j].iter().all(|&k| k <= i || k >= j) {
                let (a, b) = (turned(p.i), turned(p.j));
                beyond.push(Pair { i: a.min(b), j: a.max(b), ..p });
            }
        }
        todo.push((inner, within));
        todo.push((outer, beyond));
    }
    Ok(out)
}

/// Two places of a ring that lie close together, i < j.
struct Pair {
    i: u32,
    j: u32,
    dist2: f64,
}

/// The pairs of a ring's vertices that are at most `longest` apart but [`BEHIND`] times as far along the ring, and have no edge between them yet.
fn close(
    positions: &[Vec3],
    ring: &[u32],
    taken: &[(u32, u32)],
    longest: f64,
    ctx: &Context<'_>,
) -> Result<Vec<Pair>> {
    let at: Vec<Vec3> = ring.iter().map(|&v| positions[v as usize]).collect();
    let tree = Neighbours::build(&at, ctx)?;
    // How far along the ring each vertex is.
    let mut along = Vec::with_capacity(at.len());
    let mut whole = 0.0;
    for (i, p) in at.iter().enumerate() {
        along.push(whole);
        whole += (*p).dist2(at[(i + 1) % at.len()]).sqrt();
    }
    let (mut found, mut out) = (Vec::new(), Vec::new());
    for (i, &p) in at.iter().enumerate() {
        if i % 256 == 0 {
            ctx.check()?;
        }
        tree.within(p, longest, &mut found);
        for f in &found {
            let j = f.index as usize;
            let edge = (ring[i].min(ring[j]), ring[i].max(ring[j]));
            let apart = (along[j] - along[i]).abs();
            let far = apart.min(whole - apart) > BEHIND * longest;
            if j > i + 1 && far && taken.binary_search(&edge).is_err() {
                out.push(Pair { i: i as u32, j: j as u32, dist2: f.dist2 });
            }
        }
    }
    Ok(out)
}

fn area([a, b, c]: [Vec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).norm()
}

/// The triangulation of a closed polygon with the least area, by edges at most `longest` long, and that area; `None` where every one would use a
/// longer or a taken edge.
fn triangulate(
    positions: &[Vec3],
    ring: &[u32],
    longest: f64,
    taken: &[(u32, u32)],
    ctx: &Context<'_>,
) -> Result<Option<(Vec<[u32; 3]>, f64)>> {
    let n = ring.len();
    let at = |i: usize| positions[ring[i] as usize];
    let free = |i: usize, j: usize| {
        let neighbours = j == i + 1 || (i == 0 && j == n - 1);
        let (a, b) = (ring[i].min(ring[j]), ring[i].max(ring[j]));
        neighbours || (at(i).dist2(at(j)) <= longest * longest && taken.binary_search(&(a, b)).is_err())
    };
    let mut cost = vec![f64::INFINITY; n * n];
    let mut split = vec![0u32; n * n];
    for i in 0..n - 1 {
        cost[i * n + i + 1] = 0.0;
    }
    for span in 2..n {
        ctx.check()?;
        for i in 0..n - span {
            let j = i + span;
            if !free(i, j) {
                continue;
            }
            for k in i + 1..j {
                // The second is far away in memory.
                if cost[i * n + k] >= cost[i * n + j] {
                    continue;
                }
                let below = cost[i * n + k] + cost[k * n + j];
                if below >= cost[i * n + j] {
                    continue;
                }
                let c = below + area([at(i), at(k), at(j)]);
                if c < cost[i * n + j] {
                    cost[i * n + j] = c;
                    split[i * n + j] = k as u32;
                }
            }
        }
    }
    if !cost[n - 1].is_finite() {
        return Ok(None);
    }
    let mut out = Vec::with_capacity(n - 2);
    let mut stack = vec![(0, n - 1)];
    while let Some((i, j)) = stack.pop() {
        if j < i + 2 {
            continue;
        }
        let k = split[i * n + j] as usize;
        out.push([ring[i], ring[k], ring[j]]);
        stack.push((i, k));
        stack.push((k, j));
    }
    Ok(Some((out, cost[n - 1])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Run;

    /// An open box: four walls and a floor.
    fn open_box() -> Surface {
        let positions: Vec<Vec3> =
            (0..8).map(|i| Vec3([f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)])).collect();
        let quads = [[0, 2, 3, 1], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]];
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        Surface { normals: vec![Vec3::ZERO; 8], chart: vec![0; 8], positions, triangles }
    }

    fn boundary(s: &Surface) -> usize {
        Run::default().execute(|ctx| loops(s, ctx)).unwrap().iter().map(Vec::len).sum()
    }

    #[test]
    fn an_open_box_is_closed_by_two_triangles_that_face_out() {
        let mut s = open_box();
        assert_eq!(boundary(&s), 4);
        let (filled, _) = Run::default().execute(|ctx| fill(&mut s, 4.5, 0.0, ctx)).unwrap();
        assert_eq!((filled, s.triangles.len(), boundary(&s)), (1, 12, 0));
        let volume: f64 = s
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| s.positions[v as usize]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!((volume.abs() - 1.0).abs() < 1e-12);
    }

    /// A flat strip of squares of side 1 along a closed curve in the plane, on its outer side, `n` squares long.
    fn rim_of(n: usize, at: impl Fn(f64) -> [f64; 2]) -> Surface {
        let (mut positions, mut triangles) = (vec![], vec![]);
        for k in 0..n as u32 {
            let [x, y] = at(f64::from(k) / n as f64);
            positions.push(Vec3([x, y, 0.0]));
            positions.push(Vec3([x, y, 1.0]));
            let [a, b] = [2 * k, (2 * k + 2) % (2 * n as u32)];
            triangles.push([a, b, b + 1]);
            triangles.push([a, b + 1, a + 1]);
        }
        Surface { normals: vec![Vec3::ZERO; 2 * n], chart: vec![0; 2 * n], positions, triangles }
    }

    #[test]
    fn the_outline_of_a_large_sheet_is_left_as_it_is() {
        // Two rims of 2,000 edges, round and with corners.
        let round = rim_of(2000, |t| {
            [318.0 * (t * std::f64::consts::TAU).cos(), 318.0 * (t * std::f64::consts::TAU).sin()]
        });
        let square = rim_of(2000, |t| {
            let (side, along) = ((4.0 * t) as usize, 500.0 * (4.0 * t).fract());
            [[along, 0.0], [500.0, along], [500.0 - along, 500.0], [0.0, 500.0 - along]][side]
        });
        for mut s in [round, square] {
            let (filled, _) = Run::default().execute(|ctx| fill(&mut s, 20.0, 4.0, ctx)).unwrap();
            assert_eq!((filled, boundary(&s)), (0, 4000));
        }
    }

    #[test]
    fn a_slit_into_a_long_outline_is_closed_and_the_outline_stays() {
        // A square of side 500 with a slit 3 wide and 300 deep from the middle of its first side: 2,000 edges of outline and 600 of slit.
        let corners: [[f64; 2]; 8] = [
            [0.0, 0.0],
            [248.5, 0.0],
            [248.5, 300.0],
            [251.5, 300.0],
            [251.5, 0.0],
            [500.0, 0.0],
            [500.0, 500.0],
            [0.0, 500.0],
        ];
        let mut points: Vec<[f64; 2]> = vec![];
        for (k, a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let steps = ((b[0] - a[0]).abs() + (b[1] - a[1]).abs()).round() as usize;
            points.extend((0..steps).map(|i| [0, 1].map(|c| a[c] + (b[c] - a[c]) * i as f64 / steps as f64)));
        }
        let n = points.len();
        let mut s = rim_of(n, |t| points[(t * n as f64).round() as usize]);
        let (filled, _) = Run::default().execute(|ctx| fill(&mut s, 20.0, 4.0, ctx)).unwrap();
        // Both ends of the strip have the slit; what stays is the outline, across the slits' mouths.
        let left = boundary(&s);
        assert!(
            filled >= 2 && (3990..=4010).contains(&left),
            "{filled} filled, {left} edges left of {}",
            2 * n
        );
    }

    #[test]
    fn a_hole_longer_than_asked_stays() {
        let mut s = open_box();
        let (filled, _) = Run::default().execute(|ctx| fill(&mut s, 3.9, 0.0, ctx)).unwrap();
        assert_eq!((filled, boundary(&s)), (0, 4));
    }
}
