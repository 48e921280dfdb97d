//! From contoured quads to a clean triangle mesh.
//!
//! In: quads. Out: triangles with every edge in at most two of them, consistently oriented where that is possible, without
//! specks.

use super::field::Contour;
use crate::geometry::vec3::{Vec3, add, cross, dist2, dot, mul_add, norm, normalize, scale, sub};

/// Layers of triangles peeled from open boundaries: two triangles a voxel, for each round of filling, and one round more.
const PEEL: usize = 2 * (super::field::FILL_ROUNDS as usize + 1);

/// Share of the way to its fan's centroid that a split vertex moves: visible to no one, but not equal.
const STEP_APART: f64 = 0.05;

/// A triangle mesh in the making.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals.
    pub normals: Vec<Vec3>,
    /// Chart that weighs most at each vertex.
    pub chart: Vec<u32>,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
}

/// Sorted directed edges: (low, high, triangle, whether the triangle runs from high to low).
fn edges(triangles: &[[u32; 3]]) -> Vec<(u32, u32, u32, bool)> {
    let mut out = Vec::with_capacity(triangles.len() * 3);
    for (t, tri) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (tri[k], tri[(k + 1) % 3]);
            out.push((a.min(b), a.max(b), t as u32, a > b));
        }
    }
    out.sort_unstable();
    out
}

/// Splits the quads, drops what is not manifold, orients, removes specks smaller than `min_triangles`.
#[must_use]
pub fn triangulate(contour: Contour, one_sided: bool, min_triangles: usize) -> Surface {
    let p = &contour.positions;
    let mut triangles = Vec::with_capacity(contour.quads.len() * 2);
    for &[a, b, c, d] in &contour.quads {
        if a == b || b == c || c == d || d == a || a == c || b == d {
            continue;
        }
        let at = |i: u32| p[i as usize];
        if dist2(at(a), at(c)) <= dist2(at(b), at(d)) {
            triangles.push([a, b, c]);
            triangles.push([a, c, d]);
        } else {
            triangles.push([a, b, d]);
            triangles.push([b, c, d]);
        }
    }
    // Edges in more than two triangles: all their triangles go; the hole is closed later if it is small.
    let list = edges(&triangles);
    let mut bad = vec![false; triangles.len()];
    for group in list.chunk_by(|x, y| x.0 == y.0 && x.1 == y.1) {
        if group.len() > 2 {
            for e in group {
                bad[e.2 as usize] = true;
            }
        }
    }
    let mut keep = bad.iter().map(|b| !b);
    triangles.retain(|_| keep.next().unwrap_or(true));
    peel(&mut triangles, &contour.filled);
    let filled = contour.filled;
    let mut surface = Surface { positions: contour.positions, normals: contour.normals, chart: contour.chart, triangles };
    orient(&mut surface, one_sided, min_triangles);
    smooth(&mut surface, filled);
    split_bowties(&mut surface);
    compact(&mut surface);
    surface
}

/// Takes away what was filled in at open boundaries. Filling extends the field by a few voxels everywhere; where that closed a gap the
/// new triangles have no boundary edge and stay, elsewhere they are peeled off from the boundary inwards.
fn peel(triangles: &mut Vec<[u32; 3]>, filled: &[bool]) {
    let new: Vec<bool> = triangles.iter().map(|t| t.iter().any(|&v| filled[v as usize])).collect();
    let list = edges(triangles);
    let mut gone = vec![false; triangles.len()];
    // Per triangle its neighbours; a missing one is a boundary.
    let mut neighbours = vec![[u32::MAX; 3]; triangles.len()];
    let mut count = vec![0u8; triangles.len()];
    for g in list.chunk_by(|x, y| x.0 == y.0 && x.1 == y.1) {
        if let [x, y] = g {
            for (a, b) in [(x.2, y.2), (y.2, x.2)] {
                neighbours[a as usize][count[a as usize] as usize] = b;
                count[a as usize] += 1;
            }
        }
    }
    let mut front: Vec<u32> =
        (0..triangles.len() as u32).filter(|&t| new[t as usize] && count[t as usize] < 3).collect();
    for _ in 0..PEEL {
        let mut next = Vec::new();
        for &t in &front {
            gone[t as usize] = true;
        }
        for &t in &front {
            for &u in &neighbours[t as usize] {
                if u != u32::MAX && new[u as usize] && !gone[u as usize] {
                    next.push(u);
                }
            }
        }
        next.sort_unstable();
        next.dedup();
        front = next;
    }
    let mut g = gone.iter();
    triangles.retain(|_| !g.next().unwrap_or(&false));
}

/// Orients each component consistently (breadth first where the field's orientation is only local), outward by its signed volume; drops components of fewer than
/// `min_triangles`. One-sided components keep a seam of disagreeing neighbours.
fn orient(s: &mut Surface, one_sided: bool, min_triangles: usize) {
    let list = edges(&s.triangles);
    let n = s.triangles.len();
    let mut neighbours = vec![[(u32::MAX, false); 3]; n];
    let mut count = vec![0u8; n];
    for g in list.chunk_by(|x, y| x.0 == y.0 && x.1 == y.1) {
        if let [x, y] = g {
            // Two-sided surfaces come consistently oriented from the field.
            let flip = one_sided && x.3 == y.3;
            for (a, b) in [(x.2, y.2), (y.2, x.2)] {
                neighbours[a as usize][count[a as usize] as usize] = (b, flip);
                count[a as usize] += 1;
            }
        }
    }
    let mut state = vec![0u8; n]; // 0 unseen, 1 as is, 2 flipped
    let mut keep = vec![true; n];
    let mut component = Vec::new();
    for start in 0..n {
        if state[start] != 0 {
            continue;
        }
        component.clear();
        component.push(start as u32);
        state[start] = 1;
        let mut head = 0;
        while head < component.len() {
            let t = component[head] as usize;
            head += 1;
            for &(u, flip) in &neighbours[t][..count[t] as usize] {
                if state[u as usize] == 0 {
                    state[u as usize] = if flip { 3 - state[t] } else { state[t] };
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
        let mut mean = [0.0; 3];
        for &t in &component {
            mean = add(mean, sub(s.positions[s.triangles[t as usize][0] as usize], centre));
        }
        let centre = add(centre, scale(mean, 1.0 / component.len() as f64));
        let mut volume = 0.0;
        for &t in &component {
            let [a, b, c] = s.triangles[t as usize].map(|v| sub(s.positions[v as usize], centre));
            let six = dot(a, cross(b, c));
            volume += if state[t as usize] == 2 { -six } else { six };
        }
        let invert = volume < 0.0;
        for &t in &component {
            if (state[t as usize] == 2) != invert {
                s.triangles[t as usize].swap(1, 2);
            }
        }
    }
    let mut k = keep.iter();
    s.triangles.retain(|_| *k.next().unwrap_or(&true));
}

/// Sweeps of the smoothing.
const SMOOTH: usize = 6;
/// Neighbouring triangles whose normals differ by more than this (cosine; 65 degrees) make a spike at the scale of a voxel: no data carries it.
const SPIKE: f64 = 0.42;

/// Smooths vertices that no data carries: filled in, or part of spikes. The others stay where the charts put them.
fn smooth(s: &mut Surface, mut free: Vec<bool>) {
    let normal: Vec<Vec3> = s
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| s.positions[v as usize]);
            normalize(cross(sub(b, a), sub(c, a)))
        })
        .collect();
    let list = edges(&s.triangles);
    let mut rim = vec![false; s.positions.len()];
    for g in list.chunk_by(|x, y| x.0 == y.0 && x.1 == y.1) {
        match g {
            [x, y] if dot(normal[x.2 as usize], normal[y.2 as usize]) < SPIKE && x.3 != y.3 => {
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
    let links: Vec<(u32, u32)> = list
        .chunk_by(|x, y| x.0 == y.0 && x.1 == y.1)
        .flat_map(|g| [(g[0].0, g[0].1), (g[0].1, g[0].0)])
        .filter(|l| free[l.0 as usize] && (!rim[l.0 as usize] || rim[l.1 as usize]))
        .collect();
    for _ in 0..SMOOTH {
        let mut sum = vec![([0.0; 3], 0.0); s.positions.len()];
        for &(v, w) in &links {
            let t = &mut sum[v as usize];
            t.0 = add(t.0, s.positions[w as usize]);
            t.1 += 1.0;
        }
        for (p, (total, count)) in s.positions.iter_mut().zip(&sum) {
            if *count > 1.0 {
                *p = mul_add(scale(*p, 0.5), *total, 0.5 / count);
            }
        }
    }
}

/// Gives each fan of triangles around a vertex its own vertex, so that every vertex has one fan (no bow ties).
fn split_bowties(s: &mut Surface) {
    let n = s.positions.len();
    let mut start = vec![0u32; n + 1];
    for t in &s.triangles {
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
        for &v in tri {
            around[fill[v as usize] as usize] = t as u32;
            fill[v as usize] += 1;
        }
    }
    let mut fan = Vec::new();
    for v in 0..n {
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
            let mut sum = [0.0; 3];
            let mut count = 0.0;
            for j in (0..tris.len()).filter(|&j| root(&fan, j) == i) {
                for &x in &s.triangles[tris[j] as usize] {
                    sum = add(sum, s.positions[x as usize]);
                    count += 1.0;
                }
            }
            let p = s.positions[v];
            mul_add(p, sub(scale(sum, 1.0 / count), p), STEP_APART)
        };
        let moved: Vec<Vec3> = (0..tris.len()).map(|i| if root(&fan, i) == i { apart(s, i) } else { [0.0; 3] }).collect();
        s.positions[v] = moved[0];
        for i in 1..tris.len() {
            if root(&fan, i) == i {
                let copy = s.positions.len() as u32;
                s.positions.push(moved[i]);
                s.normals.push(s.normals[v]);
                s.chart.push(s.chart[v]);
                for j in i..tris.len() {
                    if root(&fan, j) == i {
                        for x in &mut s.triangles[tris[j] as usize] {
                            if *x == v as u32 {
                                *x = copy;
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Drops unused vertices and turns vertex normals to the triangles' side.
fn compact(s: &mut Surface) {
    let mut sum = vec![[0.0; 3]; s.positions.len()];
    let mut used = vec![false; s.positions.len()];
    for t in &s.triangles {
        let [a, b, c] = t.map(|v| s.positions[v as usize]);
        let n = cross(sub(b, a), sub(c, a));
        for &v in t {
            sum[v as usize] = add(sum[v as usize], n);
            used[v as usize] = true;
        }
    }
    let mut map = vec![u32::MAX; s.positions.len()];
    let mut at = 0usize;
    for v in 0..s.positions.len() {
        if !used[v] {
            continue;
        }
        map[v] = at as u32;
        s.positions[at] = s.positions[v];
        s.chart[at] = s.chart[v];
        let n = if dot(s.normals[v], sum[v]) < 0.0 { scale(s.normals[v], -1.0) } else { s.normals[v] };
        s.normals[at] = if norm(n) > 0.5 { n } else { normalize(sum[v]) };
        at += 1;
    }
    s.positions.truncate(at);
    s.chart.truncate(at);
    s.normals.truncate(at);
    for t in &mut s.triangles {
        *t = t.map(|v| map[v as usize]);
    }
}
