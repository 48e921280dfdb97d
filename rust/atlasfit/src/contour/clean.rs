//! From contoured quads to a clean triangle mesh.
//!
//! In: quads. Out: triangles with every edge in at most two of them, consistently oriented where that is possible, without
//! specks.

use super::field::{Contour, EDGE, TORN};
use super::surface::Surface;
use crate::error::{Error, Result};
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use crate::spatial::sets::Sets;
use rayon::prelude::*;

/// A surface is an open sheet when its mean normal is longer than the first (1 = flat, 0.5 = a hemisphere, 0 = closed) and the volume it spans
/// with its centroid, relative to a sphere of its area, is less than the second.
const OPEN_SHEET: (f64, f64) = (0.3, 0.3);
/// Share of the way to its fan's centroid that a split vertex moves: visible to no one, but not equal.
const STEP_APART: f64 = 0.05;

/// Share of an edge that a vertex at the boundary moves along it at the most: at its end it would meet its neighbour.
const FARTHEST: f64 = 0.9;
/// Triangles, vertices handled between two checks.
const CHECK: usize = 1 << 15;

/// An edge of a triangle: its lower and its higher vertex, and twice the triangle, plus one where the triangle runs from high to low. Sorted, the
/// triangles at an edge stand together.
pub(super) type Edge = (u32, u32, u32);

/// The triangle of an edge.
pub(super) fn triangle(e: &Edge) -> usize {
    e.2 as usize / 2
}
/// Whether the triangle runs from the edge's higher vertex to the lower.
pub(super) fn runs_down(e: &Edge) -> bool {
    e.2 % 2 == 1
}
/// The groups of equal edges.
pub(super) fn groups(edges: &[Edge]) -> impl Iterator<Item = &[Edge]> {
    edges.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1))
}

/// The edges of all triangles, sorted.
pub(super) fn edges(triangles: &[[u32; 3]], ctx: &Context<'_>) -> Result<Vec<Edge>> {
    let mut out = Vec::with_capacity(triangles.len() * 3);
    for (t, tri) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (tri[k], tri[(k + 1) % 3]);
            out.push((a.min(b), a.max(b), 2 * t as u32 + u32::from(a > b)));
        }
    }
    sort(&mut out, ctx)?;
    Ok(out)
}

/// The neighbours of a triangle across its edges.
#[derive(Clone, Copy, Default)]
struct Beside {
    count: u8,
    triangle: [u32; 3],
    opposed: [bool; 3],
}

impl Beside {
    /// Each neighbour, and whether it faces the other way.
    fn neighbours(&self) -> impl Iterator<Item = (u32, bool)> {
        self.triangle.into_iter().zip(self.opposed).take(usize::from(self.count))
    }
}

/// The neighbours of every triangle, across edges of two triangles.
fn beside(triangles: &[[u32; 3]], ctx: &Context<'_>) -> Result<Vec<Beside>> {
    let mut out = vec![Beside::default(); triangles.len()];
    for (i, g) in groups(&edges(triangles, ctx)?).enumerate() {
        ctx.check_at(i)?;
        if let [x, y] = g {
            for (a, b) in [(x, y), (y, x)] {
                let Beside { count, triangle: of, opposed } = &mut out[triangle(a)];
                of[usize::from(*count)] = triangle(b) as u32;
                opposed[usize::from(*count)] = runs_down(a) == runs_down(b);
                *count += 1;
            }
        }
    }
    Ok(out)
}

/// Splits the quads, drops what is not manifold, orients, removes specks smaller than `min_triangles`.
///
/// # Errors
/// Cancelled or out of time; [`Error::InvalidArgument`] above 2^30 quads.
pub fn triangulate(
    contour: Contour,
    one_sided: bool,
    min_triangles: usize,
    ctx: &Context<'_>,
) -> Result<Surface> {
    let Contour { mut positions, normals, chart, filled, support, quads } = contour;
    if quads.len() > 1 << 30 {
        return Err(Error::invalid(format!("the surface has {} quads", quads.len()), "Lower the detail"));
    }
    let p = &positions;
    let mut triangles = Vec::with_capacity(quads.len() * 2);
    for (i, &[a, b, c, d]) in quads.iter().enumerate() {
        ctx.check_at(i)?;
        if a == b || b == c || c == d || d == a || a == c || b == d {
            continue;
        }
        let at = |i: u32| p[i as usize];
        if at(a).dist2(at(c)) <= at(b).dist2(at(d)) {
            triangles.push([a, b, c]);
            triangles.push([a, c, d]);
        } else {
            triangles.push([a, b, d]);
            triangles.push([b, c, d]);
        }
    }
    drop(quads);
    // Edges in more than two triangles: all their triangles go; the hole is closed later if it is small. So do neighbours that face opposite ways where
    // the surface has two sides: there a stray chart joins one side to the other.
    let torn =
        |g: &[Edge]| g.len() > 2 || (!one_sided && g.len() == 2 && runs_down(&g[0]) == runs_down(&g[1]));
    let list = edges(&triangles, ctx)?;
    let mut bad = vec![false; triangles.len()];
    for group in groups(&list).filter(|g| torn(g)) {
        group.iter().for_each(|e| bad[triangle(e)] = true);
    }
    drop(list);
    ctx.check()?;
    let mut keep = bad.iter().map(|b| !b);
    triangles.retain(|_| keep.next().unwrap_or(true));
    peel(&mut triangles, &support, ctx)?;
    trim(&mut positions, &triangles, &support, ctx)?;
    let mut surface = Surface { positions, normals, chart, triangles };
    orient(&mut surface, one_sided, min_triangles, ctx)?;
    smooth(&mut surface, filled, ctx)?;
    drop_flaps(&mut surface, ctx)?;
    split_bowties(&mut surface, ctx)?;
    compact(&mut surface, ctx)?;
    Ok(surface)
}

/// Removes parts of the surface that fewer than `least` points lie on. `points` says for each chart how many points are its own; they are shared out evenly
/// over the chart's vertices.
///
/// # Errors
/// Cancelled or out of time.
pub fn remove_unsupported(s: &mut Surface, points: &[u32], least: f64, ctx: &Context<'_>) -> Result<()> {
    let mut sets = Sets::new(s.positions.len());
    for (i, &[a, b, c]) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        sets.join(a, b);
        sets.join(b, c);
    }
    let mut vertices = vec![0u32; points.len()];
    for &c in &s.chart {
        if let Some(n) = vertices.get_mut(c as usize) {
            *n += 1;
        }
    }
    let mut support = vec![0.0; s.positions.len()];
    for (v, &c) in s.chart.iter().enumerate() {
        ctx.check_at(v)?;
        if let Some(&n) = points.get(c as usize) {
            support[sets.find(v as u32) as usize] += f64::from(n) / f64::from(vertices[c as usize]);
        }
    }
    s.triangles.retain(|t| support[sets.find(t[0]) as usize] >= least);
    compact(s, ctx)
}

/// Takes away what lies beyond the edge of the data. The field reaches a few voxels farther everywhere; where that closed a gap the
/// triangles there have no boundary edge and stay, elsewhere they are peeled off from the boundary inwards, up to those that the edge crosses.
fn peel(triangles: &mut Vec<[u32; 3]>, support: &[f32], ctx: &Context<'_>) -> Result<()> {
    let beyond = |t: &[u32; 3]| {
        let s = t.map(|v| support[v as usize]);
        s.contains(&TORN) || s.iter().all(|s| *s < EDGE)
    };
    let beyond: Vec<bool> = triangles.iter().map(beyond).collect();
    let mut gone = vec![false; triangles.len()];
    let beside = beside(triangles, ctx)?;
    // A missing neighbour is a boundary.
    let mut front: Vec<u32> =
        (0..triangles.len() as u32).filter(|&t| beyond[t as usize] && beside[t as usize].count < 3).collect();
    while !front.is_empty() {
        ctx.check()?;
        let mut next = Vec::new();
        for &t in &front {
            gone[t as usize] = true;
        }
        for &t in &front {
            let open = |u: &u32| beyond[*u as usize] && !gone[*u as usize];
            next.extend(beside[t as usize].neighbours().map(|(u, _)| u).filter(open));
        }
        next.sort_unstable();
        next.dedup();
        front = next;
    }
    let mut g = gone.iter();
    triangles.retain(|_| !g.next().unwrap_or(&false));
    Ok(())
}

/// Moves the vertices of open boundaries that lie beyond the edge of the data onto it, along the triangles' edges: the boundary follows the data
/// instead of the voxels.
fn trim(positions: &mut [Vec3], triangles: &[[u32; 3]], support: &[f32], ctx: &Context<'_>) -> Result<()> {
    let list = edges(triangles, ctx)?;
    let mut boundary = vec![false; positions.len()];
    for e in groups(&list).filter(|g| g.len() == 1) {
        boundary[e[0].0 as usize] = true;
        boundary[e[0].1 as usize] = true;
    }
    // Where the edge crosses the triangles' edges, summed.
    let mut met = vec![(Vec3::ZERO, 0u32); positions.len()];
    for (i, g) in groups(&list).enumerate() {
        ctx.check_at(i)?;
        let (a, b) = (g[0].0 as usize, g[0].1 as usize);
        for (out, inside) in [(a, b), (b, a)] {
            let (low, high) = (support[out], support[inside]);
            if boundary[out] && low < EDGE && high >= EDGE {
                let t = f64::from((EDGE - low) / (high - low)).min(FARTHEST);
                let step = (positions[inside] - positions[out]) * t;
                met[out] = (met[out].0 + step, met[out].1 + 1);
            }
        }
    }
    let mut old: Vec<Option<Vec3>> = vec![None; positions.len()];
    for ((p, old), (step, n)) in positions.iter_mut().zip(&mut old).zip(met) {
        if n > 0 {
            *old = Some(*p);
            *p += step * (1.0 / f64::from(n));
        }
    }
    // No triangle may turn over: the vertices of one that would stay where they were.
    let near: Vec<&[u32; 3]> =
        triangles.iter().filter(|t| t.iter().any(|&v| old[v as usize].is_some())).collect();
    let normal = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a);
    let was: Vec<Vec3> =
        near.iter().map(|t| normal(t.map(|v| old[v as usize].unwrap_or(positions[v as usize])))).collect();
    loop {
        ctx.check()?;
        let mut back = Vec::new();
        for (t, was) in near.iter().zip(&was) {
            if normal(t.map(|v| positions[v as usize])).dot(*was) <= 0.0 {
                back.extend(t.iter().filter_map(|&v| old[v as usize].take().map(|p| (v, p))));
            }
        }
        if back.is_empty() {
            return Ok(());
        }
        for (v, p) in back {
            positions[v as usize] = p;
        }
    }
}

/// Takes away triangles that hang on one neighbour only and stand off it as a spike does, or have turned over onto it.
fn drop_flaps(s: &mut Surface, ctx: &Context<'_>) -> Result<()> {
    let normal = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| s.positions[v as usize]);
        (b - a).cross(c - a).normalized()
    };
    let flap = |(t, beside): (&[u32; 3], &Beside)| {
        let mut neighbours = beside.neighbours();
        let (Some((u, opposed)), None) = (neighbours.next(), neighbours.next()) else { return false };
        let facing = normal(t).dot(normal(&s.triangles[u as usize]));
        (if opposed { -facing } else { facing }) < SPIKE
    };
    let flaps: Vec<bool> = s.triangles.iter().zip(&beside(&s.triangles, ctx)?).map(flap).collect();
    let mut f = flaps.iter();
    s.triangles.retain(|_| !f.next().unwrap_or(&false));
    Ok(())
}

/// A connected part of the surface.
struct Component {
    triangles: Vec<u32>,
    volume: f64,
    mean_normal: Vec3,
    /// Whether it is an open sheet rather than a body.
    open: bool,
}

/// Orients each component consistently (breadth first where the field's orientation is only local), outward by its signed volume; drops components of fewer than
/// `min_triangles`. One-sided components keep a seam of disagreeing neighbours.
fn orient(s: &mut Surface, one_sided: bool, min_triangles: usize, ctx: &Context<'_>) -> Result<()> {
    let beside = beside(&s.triangles, ctx)?;
    let n = s.triangles.len();
    let mut state = vec![0u8; n]; // 0 unseen, 1 as is, 2 flipped
    let mut keep = vec![true; n];
    let mut component = Vec::new();
    let mut found: Vec<Component> = Vec::new();
    for start in 0..n {
        if state[start] != 0 {
            continue;
        }
        component.clear();
        component.push(start as u32);
        state[start] = 1;
        let mut head = 0;
        while head < component.len() {
            ctx.check_at(head)?;
            let t = component[head] as usize;
            head += 1;
            for (u, opposed) in beside[t].neighbours() {
                if state[u as usize] == 0 {
                    // Two-sided surfaces come consistently oriented from the field.
                    state[u as usize] = if one_sided && opposed { 3 - state[t] } else { state[t] };
                    component.push(u);
                }
            }
        }
        if component.len() < min_triangles {
            for &t in &component {
                keep[t as usize] = false;
            }
            continue;
        }
        let centre = {
            let t = s.triangles[component[component.len() / 2] as usize];
            s.positions[t[0] as usize]
        };
        let mut mean = Vec3::ZERO;
        for (i, &t) in component.iter().enumerate() {
            ctx.check_at(i)?;
            mean += s.positions[s.triangles[t as usize][0] as usize] - centre;
        }
        let centre = centre + (mean * (1.0 / component.len() as f64));
        let (mut volume, mut area, mut mean_normal) = (0.0, 0.0, Vec3::ZERO);
        for (i, &t) in component.iter().enumerate() {
            ctx.check_at(i)?;
            let [a, b, c] = s.triangles[t as usize].map(|v| s.positions[v as usize] - centre);
            let sign = if state[t as usize] == 2 { -0.5 } else { 0.5 };
            let n = (b - a).cross(c - a) * sign;
            mean_normal += n;
            area += n.norm();
            volume += a.dot(n) / 3.0;
        }
        let facing = mean_normal.norm() / area.max(1e-300);
        let roundness = 6.0 * std::f64::consts::PI.sqrt() * volume.abs() / area.max(1e-300).powf(1.5);
        let open = facing > OPEN_SHEET.0 && roundness < OPEN_SHEET.1;
        found.push(Component { triangles: component.clone(), volume, mean_normal, open });
    }
    // A closed surface faces outward. Open sheets, such as parts of a terrain, face along the one axis that they face most, upward.
    let faced =
        [0, 1, 2].map(|k| found.iter().filter(|c| c.open).map(|c| c.mean_normal[k].abs()).sum::<f64>());
    let up = (0..3).max_by(|&i, &j| faced[i].total_cmp(&faced[j])).unwrap_or(2);
    for c in &found {
        let invert = if c.open { c.mean_normal[up] } else { c.volume } < 0.0;
        for &t in &c.triangles {
            if (state[t as usize] == 2) != invert {
                s.triangles[t as usize].swap(1, 2);
            }
        }
    }
    let mut k = keep.iter();
    s.triangles.retain(|_| *k.next().unwrap_or(&true));
    ctx.check()
}

/// Double sweeps of the smoothing, and the steps of each: out again by most of it, so that tips keep most of their length (after Taubin 1995).
const SMOOTH: usize = 6;
const TAUBIN: [f64; 2] = [0.5, -0.43];
/// A normal that is off its triangles by more than this (cosine) is not the surface's.
const ASTRAY: f64 = 0.5;
/// Rings about these vertices that are smoothed too.
const SPREAD: usize = 1;
/// Neighbouring triangles whose normals differ by more than this (cosine; 65 degrees) make a spike at the scale of a voxel: no data carries it.
const SPIKE: f64 = 0.42;

/// Smooths vertices that no data carries: filled in, or part of spikes, and those next to them. The others stay where the charts put them.
///
/// # Errors
/// Cancelled or out of time.
pub fn smooth(s: &mut Surface, mut free: Vec<bool>, ctx: &Context<'_>) -> Result<()> {
    let normal: Vec<Vec3> = s
        .triangles
        .par_chunks(CHECK)
        .map(|chunk| {
            ctx.check()?;
            let normal = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|v| s.positions[v as usize]);
                (b - a).cross(c - a).normalized()
            };
            Ok(chunk.iter().map(normal).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    let list = edges(&s.triangles, ctx)?;
    let mut rim = vec![false; s.positions.len()];
    for (i, g) in groups(&list).enumerate() {
        ctx.check_at(i)?;
        match g {
            [x, y]
                if normal[triangle(x)].dot(normal[triangle(y)]) < SPIKE && runs_down(x) != runs_down(y) =>
            {
                free[x.0 as usize] = true;
                free[x.1 as usize] = true;
            }
            [x] => {
                rim[x.0 as usize] = true;
                rim[x.1 as usize] = true;
            }
            _ => {}
        }
    }
    for _ in 0..SPREAD {
        let core = free.clone();
        for (i, g) in groups(&list).enumerate() {
            ctx.check_at(i)?;
            let (a, b) = (g[0].0 as usize, g[0].1 as usize);
            free[a] |= core[b];
            free[b] |= core[a];
        }
    }
    let mut links: Vec<(u32, u32)> = Vec::new();
    for (i, g) in groups(&list).enumerate() {
        ctx.check_at(i)?;
        links.extend(
            [(g[0].0, g[0].1), (g[0].1, g[0].0)]
                .iter()
                .filter(|l| free[l.0 as usize] && (!rim[l.0 as usize] || rim[l.1 as usize])),
        );
    }
    drop(list);
    for step in TAUBIN.into_iter().cycle().take(2 * SMOOTH) {
        let mut sum = vec![(Vec3::ZERO, 0.0); s.positions.len()];
        for (i, &(v, w)) in links.iter().enumerate() {
            ctx.check_at(i)?;
            let t = &mut sum[v as usize];
            t.0 += s.positions[w as usize];
            t.1 += 1.0;
        }
        for (p, (total, count)) in s.positions.iter_mut().zip(&sum) {
            if *count > 1.0 {
                *p = *p * (1.0 - step) + *total * (step / count);
            }
        }
        ctx.check()?;
    }
    // Charts and triangles are both witnesses of the normals here; charts are none where the surface has left them.
    let mut sum = vec![Vec3::ZERO; s.positions.len()];
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        if t.iter().any(|&v| free[v as usize]) {
            let [a, b, c] = t.map(|v| s.positions[v as usize]);
            let n = (b - a).cross(c - a);
            for &v in t {
                sum[v as usize] += n;
            }
        }
    }
    for ((n, sum), _) in s.normals.iter_mut().zip(&sum).zip(&free).filter(|x| *x.1) {
        if (*sum).norm() > 0.0 {
            let seen = (*sum).normalized();
            *n = if (*n).dot(seen) < ASTRAY { seen } else { (*n + seen).normalized() };
        }
    }
    Ok(())
}

/// Gives each fan of triangles around a vertex its own vertex, so that every vertex has one fan (no bow ties).
pub(super) fn split_bowties(s: &mut Surface, ctx: &Context<'_>) -> Result<()> {
    let n = s.positions.len();
    let mut start = vec![0u32; n + 1];
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        for &v in t {
            start[v as usize + 1] += 1;
        }
    }
    for i in 0..n {
        start[i + 1] += start[i];
    }
    let mut fill = start.clone();
    let mut around = vec![0u32; s.triangles.len() * 3];
    for (t, tri) in s.triangles.iter().enumerate() {
        ctx.check_at(t)?;
        for &v in tri {
            around[fill[v as usize] as usize] = t as u32;
            fill[v as usize] += 1;
        }
    }
    let mut fan = Vec::new();
    for v in 0..n {
        ctx.check_at(v)?;
        let tris = &around[start[v] as usize..start[v + 1] as usize];
        if tris.len() < 2 {
            continue;
        }
        fan.clear();
        fan.extend(0..tris.len());
        // Join triangles of the star that share an edge at v.
        let root = |fan: &Vec<usize>, mut i: usize| {
            while fan[i] != i {
                i = fan[i];
            }
            i
        };
        for i in 0..tris.len() {
            for j in 0..i {
                let (a, b) = (s.triangles[tris[i] as usize], s.triangles[tris[j] as usize]);
                if a.iter().any(|x| *x != v as u32 && b.contains(x)) {
                    let (ri, rj) = (root(&fan, i), root(&fan, j));
                    fan[ri.max(rj)] = ri.min(rj);
                }
            }
        }
        if (1..tris.len()).all(|i| root(&fan, i) != i) {
            continue;
        }
        // Each fan's copy steps a little into its fan: two vertices in one place would be one again for whoever merges by position.
        let apart = |s: &Surface, i: usize| {
            let mut sum = Vec3::ZERO;
            let mut count = 0.0;
            for j in (0..tris.len()).filter(|&j| root(&fan, j) == i) {
                for &x in &s.triangles[tris[j] as usize] {
                    sum += s.positions[x as usize];
                    count += 1.0;
                }
            }
            let p = s.positions[v];
            p + (sum * (1.0 / count) - p) * STEP_APART
        };
        let moved: Vec<Vec3> =
            (0..tris.len()).map(|i| if root(&fan, i) == i { apart(s, i) } else { Vec3::ZERO }).collect();
        s.positions[v] = moved[0];
        for (i, &position) in moved.iter().enumerate().skip(1) {
            if root(&fan, i) == i {
                let copy = s.positions.len() as u32;
                s.positions.push(position);
                s.normals.push(s.normals[v]);
                s.chart.push(s.chart[v]);
                for (j, &t) in tris.iter().enumerate().skip(i) {
                    if root(&fan, j) == i {
                        for x in &mut s.triangles[t as usize] {
                            if *x == v as u32 {
                                *x = copy;
                            }
                        }
                    }
                }
            }
        }
    }
    Ok(())
}

/// Drops unused vertices and turns vertex normals to the triangles' side.
fn compact(s: &mut Surface, ctx: &Context<'_>) -> Result<()> {
    let mut sum = vec![Vec3::ZERO; s.positions.len()];
    let mut used = vec![false; s.positions.len()];
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b, c] = t.map(|v| s.positions[v as usize]);
        let n = (b - a).cross(c - a);
        for &v in t {
            sum[v as usize] += n;
            used[v as usize] = true;
        }
    }
    let mut map = vec![u32::MAX; s.positions.len()];
    let mut at = 0usize;
    for v in 0..s.positions.len() {
        ctx.check_at(v)?;
        if !used[v] {
            continue;
        }
        map[v] = at as u32;
        s.positions[at] = s.positions[v];
        s.chart[at] = s.chart[v];
        let n = if s.normals[v].dot(sum[v]) < 0.0 { -s.normals[v] } else { s.normals[v] };
        s.normals[at] = if n.norm() > 0.5 { n } else { sum[v].normalized() };
        at += 1;
    }
    s.positions.truncate(at);
    s.chart.truncate(at);
    s.normals.truncate(at);
    for t in &mut s.triangles {
        *t = t.map(|v| map[v as usize]);
    }
    ctx.check()
}
