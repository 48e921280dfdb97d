//! Corners put on the surface and on the points.
//!
//! In: a surface that is cut along its creases, corners; or points. Out: about each corner the triangles give
//! way to a fan about it, whose triangles lie on the sides that meet there; points lie on these sides.

use super::constants::CREASE;
use super::corner::Corner;
use crate::atlas::ProjectedPoint;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::Neighbours;
use crate::spatial::lists::Lists;
use crate::spatial::triangle::area_vector;

/// Puts corners on the surface.
pub(super) fn surface(s: &mut Surface, corners: &[Corner], ctx: &Context<'_>) -> Result<()> {
    if corners.is_empty() {
        return Ok(());
    }
    let around = Lists::new(s.positions.len(), &s.triangles, ctx)?;
    let tree = Neighbours::build(&s.positions, ctx)?;
    let mut state = ctx.filled(State::Whole, s.triangles.len())?;
    let mut fans: Vec<[u32; 3]> = Vec::new();
    for corner in corners {
        ctx.check()?;
        let first = tree.nearest_one(corner.at).index;
        let Some(fan) = best_fan(s, corner, first, &around, &state) else { continue };
        let new = s.positions.len() as u32;
        s.positions.push(corner.at);
        s.normals.push(corner.sides.iter().copied().sum::<Vec3>().normalized());
        s.chart.push(s.chart[first as usize]);
        fan.inside.iter().for_each(|&f| state[f as usize] = State::Gone);
        for &[a, b] in &fan.rim {
            match split(s, corner, [a, b], &around, &mut state) {
                Some(middle) => fans.extend([[a, middle, new], [middle, b, new]]),
                None => fans.push([a, b, new]),
            }
        }
    }
    let mut state = state.into_iter();
    s.triangles.retain(|_| state.next().is_none_or(|state| state != State::Gone));
    s.triangles.extend(fans);
    drop_unused(s, ctx)
}

/// What corners have done to a triangle.
#[derive(Clone, Copy, PartialEq)]
enum State {
    Whole,
    /// One of its edges was split.
    Split,
    /// It gave way to a fan.
    Gone,
}

/// What gives way to a fan.
struct Fan {
    /// The triangles.
    inside: Vec<u32>,
    /// Their outer edges, as they run.
    rim: Vec<[u32; 2]>,
    /// The least cosine of a triangle of the fan with the side that it lies on.
    steady: f64,
}

/// The fan about a corner that lies best on the sides; none where none does.
fn best_fan(s: &Surface, corner: &Corner, first: u32, around: &Lists, state: &[State]) -> Option<Fan> {
    // Creases are cut as far as they are believed by half, which is short of their ends.
    let fans = CREASE
        .caps
        .iter()
        .filter_map(|cap| fan(s, corner, corner.radius + cap * corner.unit, first, around, state));
    fans.max_by(|a, b| a.steady.total_cmp(&b.steady)).filter(|fan| fan.steady > CREASE.same_side)
}

/// The fan within a radius about a corner; none where what gives way is no disk.
fn fan(
    s: &Surface,
    corner: &Corner,
    radius: f64,
    first: u32,
    around: &Lists,
    state: &[State],
) -> Option<Fan> {
    let within = |v: u32| s.positions[v as usize].dist2(corner.at) < radius * radius;
    if !within(first) {
        return None;
    }
    let (mut inside, mut queue) = (Vec::new(), vec![first]);
    let mut seen = std::collections::BTreeSet::from([first]);
    while let Some(v) = queue.pop() {
        for &f in around.of(v) {
            // What another corner has changed is no longer what `around` knows.
            if state[f as usize] != State::Whole {
                return None;
            }
            inside.push(f);
            for w in s.triangles[f as usize] {
                if within(w) && seen.insert(w) {
                    queue.push(w);
                }
            }
        }
    }
    inside.sort_unstable();
    inside.dedup();
    let mut half: Vec<[u32; 2]> = (inside.iter())
        .flat_map(|&f| (0..3).map(move |k| (f, k)))
        .map(|(f, k)| [s.triangles[f as usize][k], s.triangles[f as usize][(k + 1) % 3]])
        .collect();
    half.sort_unstable();
    let rim: Vec<[u32; 2]> =
        half.iter().copied().filter(|&[a, b]| half.binary_search(&[b, a]).is_err()).collect();
    is_loop(&rim).then(|| Fan { steady: steadiness(s, corner, &rim), inside, rim })
}

/// Whether edges are one loop that comes to each vertex once.
fn is_loop(rim: &[[u32; 2]]) -> bool {
    let next = |v: u32| {
        let mut from = rim.iter().filter(|e| e[0] == v);
        from.next().filter(|_| from.next().is_none()).map(|e| e[1])
    };
    let Some(&[start, mut v]) = rim.first() else { return false };
    let mut length = 1;
    while v != start && length <= rim.len() {
        let Some(on) = next(v) else { return false };
        (v, length) = (on, length + 1);
    }
    length == rim.len()
}

/// Splits an edge of a rim where it goes over from one side of a corner to another, and the triangle beyond
/// it; gives the new vertex, which lies on the crease.
fn split(
    s: &mut Surface,
    corner: &Corner,
    [a, b]: [u32; 2],
    around: &Lists,
    state: &mut [State],
) -> Option<u32> {
    let [p, q] = [a, b].map(|v| s.positions[v as usize]);
    let [Some(i), Some(j)] = [p, q].map(|p| corner.one_side(p)) else { return None };
    if i == j {
        return None;
    }
    let f = around.of(a).iter().copied().find(|&f| {
        let t = s.triangles[f as usize];
        state[f as usize] == State::Whole && (0..3).any(|k| t[k] == b && t[(k + 1) % 3] == a)
    })?;
    let [off_p, off_q] = [p, q].map(|p| corner.sides.map(|n| n.dot(p - corner.at)));
    // Where both sides are as far off.
    let (from, to) = (off_p[i] - off_p[j], off_q[i] - off_q[j]);
    let share = (from / (from - to)).clamp(0.0, 1.0);
    let along = corner.sides[i].cross(corner.sides[j]).normalized();
    let at = corner.at + along * along.dot(p + (q - p) * share - corner.at);
    let new = s.positions.len() as u32;
    s.positions.push(at);
    s.normals.push((corner.sides[i] + corner.sides[j]).normalized());
    s.chart.push(s.chart[a as usize]);
    let t = s.triangles[f as usize];
    let with = |old: u32| t.map(|v| if v == old { new } else { v });
    (s.triangles[f as usize], state[f as usize]) = (with(b), State::Split);
    s.triangles.push(with(a));
    Some(new)
}

/// The least cosine of a triangle from an edge to the corner with the side that it is most parallel to.
fn steadiness(s: &Surface, corner: &Corner, rim: &[[u32; 2]]) -> f64 {
    let cosine = |&[a, b]: &[u32; 2]| {
        let n = area_vector([s.positions[a as usize], s.positions[b as usize], corner.at]).normalized();
        corner.sides.iter().map(|side| side.dot(n)).fold(-1.0, f64::max)
    };
    rim.iter().map(cosine).fold(1.0, f64::min)
}

/// Takes out the vertices that no triangle has.
fn drop_unused(s: &mut Surface, ctx: &Context<'_>) -> Result<()> {
    let mut number = ctx.filled(u32::MAX, s.positions.len())?;
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        t.iter().for_each(|&v| number[v as usize] = 0);
    }
    let mut kept = 0;
    for (v, number) in number.iter_mut().enumerate() {
        if *number == 0 {
            (s.positions[kept], s.normals[kept], s.chart[kept]) = (s.positions[v], s.normals[v], s.chart[v]);
            *number = kept as u32;
            kept += 1;
        }
    }
    s.positions.truncate(kept);
    s.normals.truncate(kept);
    s.chart.truncate(kept);
    for (i, t) in s.triangles.iter_mut().enumerate() {
        ctx.check_at(i)?;
        *t = t.map(|v| number[v as usize]);
    }
    Ok(())
}

/// Puts the points about corners on the sides.
pub(super) fn points(projected: &mut [ProjectedPoint], corners: &[Corner], ctx: &Context<'_>) -> Result<()> {
    if corners.is_empty() {
        return Ok(());
    }
    let places: Vec<Vec3> = corners.iter().map(|c| c.at).collect();
    let tree = Neighbours::build(&places, ctx)?;
    for (i, p) in projected.iter_mut().enumerate() {
        ctx.check_at(i)?;
        let corner = &corners[tree.nearest_one(p.position).index as usize];
        let reach = corner.radius + CREASE.strip * corner.unit;
        if p.chart == u32::MAX || p.position.dist2(corner.at) > reach * reach {
            continue;
        }
        let off = corner.signed(p.position);
        if off.abs() < CREASE.deepest * corner.unit {
            let normal = corner.sides[corner.side(p.position)];
            (p.position, p.normal) = (p.position - normal * off, normal);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;
    use crate::spatial::edges::Edges;

    /// A roof with a ridge along y whose mesh is flat on top, with a thorn or a fold.
    fn roof(spoil: impl Fn(&mut Vec<Vec3>)) -> Surface {
        let n = 13u32;
        let place = |i: u32| [i % n, i / n].map(|k| 0.5 * (f64::from(k) - 6.0));
        let mut positions: Vec<Vec3> =
            (0..n * n).map(place).map(|[x, y]| Vec3([x + 0.1, y, -(x + 0.1).abs()])).collect();
        spoil(&mut positions);
        let normals = vec![Vec3([0.0, 0.0, 1.0]); positions.len()];
        let cells = (0..(n - 1) * (n - 1)).map(|i| i / (n - 1) * n + i % (n - 1));
        let triangles = cells.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]).collect();
        Surface { chart: vec![0; positions.len()], positions, normals, triangles }
    }

    #[test]
    fn a_thorn_on_a_ridge_gives_way_to_a_fan_and_the_mesh_stays_whole() {
        // The vertex in the middle sticks out.
        let mut s = roof(|p| p[6 * 13 + 6] = Vec3([0.4, 0.1, 2.0]));
        let sides = [-1.0, 1.0].map(|x| Vec3([x, 0.0, 1.0]).normalized());
        let place = Corner::edge(Vec3::ZERO, sides, true, 0.5);
        let done = Run::default().execute(|ctx| {
            surface(&mut s, &[place], ctx)?;
            Edges::new(&s.triangles, ctx)
        });
        let edges = done.expect("nothing stops it");
        assert_eq!(edges.iter().filter(|e| e.len() == 1).count(), 48, "only the rim is open");
        assert!(edges.iter().all(|e| e.len() < 3 && !(e.len() == 2 && e[0].runs_as(e[1], &s.triangles))));
        for p in &s.positions {
            assert!((p[2] + p[0].abs()).abs() < 1e-9, "{p:?}");
        }
        for t in &s.triangles {
            assert!(area_vector(t.map(|v| s.positions[v as usize]))[2] > 0.0, "{t:?}");
        }
        let mut used = vec![false; s.positions.len()];
        s.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        assert!(!used.contains(&false));
    }
}
