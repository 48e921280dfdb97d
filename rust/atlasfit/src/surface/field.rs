//! Contouring the blended charts.
//!
//! In: charts with signs, voxel size. Out: a quadrilateral mesh, one vertex per surface piece in a voxel, one quad per
//! voxel edge that the surface crosses (dual marching cubes; Nielson 2004). The band is cut into blocks of voxels that are independent
//! of each other; a block's orientation is local, so one-sided surfaces need no special care.

use crate::atlas::{Chart, View};
use crate::error::Result;
use crate::geometry::vec3::{Vec3, add, dist2, dot, mul_add, norm, scale, sub};
use crate::orient::Relation;
use crate::run::Context;
use rayon::prelude::*;

/// Voxels along one side of a block. Small blocks follow the surface closely, large ones share more corners.
const BLOCK: i32 = 4;
/// Corners that a block owns.
const CORNERS: usize = (BLOCK as usize).pow(3);
/// Charts are evaluated up to this many voxels from their surface: the corners of every crossed voxel lie within sqrt(3).
const BAND: f64 = 2.2;
/// Least blended mask at which the surface is taken to exist.
pub const MIN_SUPPORT: f64 = 0.25;
/// Rounds of filling: each extends the field by one voxel into places where no chart has data, so that gaps of up to twice as many voxels
/// close (volumetric diffusion; Davis et al. 2002).
pub const FILL_ROUNDS: u8 = 4;
/// Sweeps that smooth the filled values.
const RELAX: usize = 8;
/// An edge whose ends differ by more than this many voxels joins two different sheets: no surface passes between.
const MAX_JUMP: f64 = 1.9;
/// The same where the field is filled in: values two voxels apart across the surface differ by two.
const FILL_JUMP: f64 = 2.2;

/// Voxels from the origin that the keys of blocks and edges can name.
const KEY_RANGE: f64 = 500_000.0;

/// A contoured surface before cleaning.
#[derive(Debug, Clone, Default)]
pub struct Contour {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Vertex normals from the charts, in the gauge of the vertex's block.
    pub normals: Vec<Vec3>,
    /// The chart that weighs most at each vertex.
    pub chart: Vec<u32>,
    /// Whether the vertex lies where the field was filled in rather than known from charts.
    pub filled: Vec<bool>,
    /// Quads.
    pub quads: Vec<[u32; 4]>,
}

#[inline]
fn block_key(b: [i32; 3]) -> u64 {
    const OFFSET: i64 = 1 << 20;
    let f = |x: i32| (i64::from(x) + OFFSET) as u64 & 0x1F_FFFF;
    f(b[2]) << 42 | f(b[1]) << 21 | f(b[0])
}

#[inline]
fn unkey(k: u64) -> [i32; 3] {
    const OFFSET: i64 = 1 << 20;
    let f = |s: u32| ((k >> s & 0x1F_FFFF) as i64 - OFFSET) as i32;
    [f(0), f(21), f(42)]
}

/// A denoised point: where it lies and which charts vouch for it there.
#[derive(Debug, Clone, Copy)]
pub struct Anchor {
    /// Position on the atlas.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Point spacing there.
    pub spacing: f64,
    /// Its strongest charts with their blend weights; `u32::MAX` marks unused places.
    pub charts: [(u32, f32); ANCHOR_CHARTS],
}

/// Charts kept per point. More overlap averages more, at the cost of evaluating more charts per corner.
pub const ANCHOR_CHARTS: usize = 5;

/// Reach of a point's influence, in point spacings. Gaps between random points are seldom wider than twice this.
const REACH: f64 = 2.4;

/// Influence of a point at squared distance `d2`, in units of its spacing: the nearest points decide, smoothly.
#[inline]
fn influence(d2: f64, spacing: f64) -> f64 {
    let q = d2 / (spacing * spacing);
    let t = 1.0 - q / (REACH * REACH);
    if t <= 0.0 {
        return 0.0;
    }
    let e = q + 0.3;
    t * t / (e * e)
}

/// The band of voxels: blocks of corner values, each in its own gauge.
struct Grid<'c> {
    charts: &'c [Chart],
    h: f64,
    /// Integer position of each block, in blocks.
    at: Vec<[i32; 3]>,
    /// The charts of each block, ascending, and their signs in the block's gauge.
    lists: Vec<(Vec<u32>, Vec<f64>)>,
    /// Whether the block's gauge may differ from the global signs.
    local: Vec<bool>,
    /// Indices of the 27 blocks around each block, itself in the middle; `u32::MAX` where there is none.
    around: Vec<[u32; 27]>,
    cells: Vec<Corners>,
}

/// The corner values of one block.
#[derive(Clone)]
struct Corners {
    value: [f32; CORNERS],
    /// The chart that weighs most there (or did where the value was filled in from).
    chart: [u32; CORNERS],
    /// 0 = unknown, 1 = from charts, more = filled in that round minus one.
    level: [u8; CORNERS],
}

#[inline]
fn corner_index(i: [i32; 3]) -> usize {
    ((i[2] * BLOCK + i[1]) * BLOCK + i[0]) as usize
}

impl Grid<'_> {
    /// Sign of a chart in a block's gauge.
    fn sign(&self, block: usize, chart: u32) -> f64 {
        if self.local[block] {
            let (list, signs) = &self.lists[block];
            if let Ok(k) = list.binary_search(&chart) {
                return signs[k];
            }
        }
        self.charts[chart as usize].sign
    }
    /// Value, level and chart at corner `i` of `block` in that block's gauge; `i` may reach into the blocks around it.
    #[inline]
    fn fetch(&self, block: usize, mut i: [i32; 3]) -> (f64, u8, u32) {
        let mut n = 13usize;
        let mut inside = true;
        for (k, stride) in [(0, 1usize), (1, 3), (2, 9)] {
            if i[k] < 0 {
                i[k] += BLOCK;
                n -= stride;
                inside = false;
            } else if i[k] >= BLOCK {
                i[k] -= BLOCK;
                n += stride;
                inside = false;
            }
        }
        let c = corner_index(i);
        if inside {
            let b = &self.cells[block];
            return (f64::from(b.value[c]), b.level[c], b.chart[c]);
        }
        let other = self.around[block][n];
        if other == u32::MAX {
            return (0.0, 0, u32::MAX);
        }
        let other = other as usize;
        let b = &self.cells[other];
        let (mut value, level, chart) = (f64::from(b.value[c]), b.level[c], b.chart[c]);
        if level > 0 && (self.local[block] || self.local[other]) {
            value *= self.sign(block, chart) * self.sign(other, chart);
        }
        (value, level, chart)
    }
}

struct BlockOut {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    chart: Vec<u32>,
    filled: Vec<bool>,
    /// Edge key, slot of the cell around the edge, local vertex, whether the field rises along the edge.
    records: Vec<(u64, u8, u32, bool)>,
}

/// Contours the atlas at voxel size `h`.
///
/// # Errors
/// Cancelled, out of time or memory.
pub fn contour(
    charts: &[Chart],
    anchors: &[Anchor],
    relations: &[Relation],
    conflicts: &[(u32, u32)],
    h: f64,
    ctx: &Context<'_>,
) -> Result<Contour> {
    let mut grid = sample(charts, anchors, relations, conflicts, h, ctx)?;
    fill(&mut grid, ctx)?;
    let outs: Vec<BlockOut> = (0..grid.at.len())
        .into_par_iter()
        .map(|b| {
            if b % 16 == 0 {
                ctx.check()?;
            }
            let mut out = BlockOut {
                positions: vec![],
                normals: vec![],
                chart: vec![],
                filled: vec![],
                records: vec![],
            };
            for z in 0..BLOCK {
                for y in 0..BLOCK {
                    for x in 0..BLOCK {
                        cell(&grid, b, [x, y, z], &mut out);
                    }
                }
            }
            ctx.advance(1);
            Ok(out)
        })
        .collect::<Result<_>>()?;
    let mut contour = Contour::default();
    let mut records: Vec<(u64, u8, u32, bool)> = Vec::new();
    for o in outs {
        let base = contour.positions.len() as u32;
        records.extend(o.records.into_iter().map(|(k, s, v, up)| (k, s, v + base, up)));
        contour.positions.extend(o.positions);
        contour.normals.extend(o.normals);
        contour.chart.extend(o.chart);
        contour.filled.extend(o.filled);
    }
    records.par_sort_unstable_by_key(|r| (r.0, r.1));
    let mut i = 0;
    while i + 3 < records.len() {
        let r = &records[i..i + 4];
        if r[3].0 == r[0].0 && (0..4).all(|k| usize::from(r[k].1) == k) {
            let q = [r[0].2, r[1].2, r[2].2, r[3].2];
            contour.quads.push(if r[0].3 { q } else { [q[3], q[2], q[1], q[0]] });
            i += 4;
        } else {
            i += 1;
        }
    }
    Ok(contour)
}

/// Evaluates the charts at the corners of the band.
fn sample<'c>(
    charts: &'c [Chart],
    anchors: &[Anchor],
    relations: &[Relation],
    conflicts: &[(u32, u32)],
    h: f64,
    ctx: &Context<'_>,
) -> Result<Grid<'c>> {
    let size = h * f64::from(BLOCK);
    // Blocks that each anchor influences: those that its reach touches near its tangent plane.
    let mut pairs: Vec<(u64, u32)> = anchors
        .par_iter()
        .enumerate()
        // Beyond the range of the keys there can only be strays: scans are a few hundred thousand voxels wide at the most.
        .filter(|(_, a)| a.position.iter().all(|x| x.abs() < KEY_RANGE * h))
        .flat_map_iter(|(i, a)| {
            let reach = REACH * a.spacing;
            let lo = a.position.map(|x| ((x - reach) / size).floor() as i32);
            let hi = a.position.map(|x| ((x + reach) / size).floor() as i32);
            // Half a block's diagonal, the band, and what a curved surface leaves its tangent plane by within reach.
            let slab = 0.87 * size + BAND * h + 0.5 * reach;
            let far = reach + 0.87 * size;
            (lo[2]..=hi[2]).flat_map(move |z| {
                (lo[1]..=hi[1]).flat_map(move |y| {
                    (lo[0]..=hi[0]).filter_map(move |x| {
                        let d = sub([x, y, z].map(|b| (f64::from(b) + 0.5) * size), a.position);
                        (dot(d, a.normal).abs() <= slab && norm(d) <= far)
                            .then(|| (block_key([x, y, z]), i as u32))
                    })
                })
            })
        })
        .collect();
    pairs.par_sort_unstable();
    let wanted: Vec<(u64, Vec<u32>)> =
        pairs.chunk_by(|a, b| a.0 == b.0).map(|g| (g[0].0, g.iter().map(|p| p.1).collect())).collect();
    drop(pairs);
    ctx.stage(crate::run::Stage::Surface, 2 * wanted.len());
    let mut conflict = vec![false; charts.len()];
    for &(a, b) in conflicts {
        conflict[a as usize] = true;
        conflict[b as usize] = true;
    }
    let blocks: Vec<_> = wanted
        .into_par_iter()
        .map(|(key, near)| {
            ctx.check()?;
            ctx.advance(1);
            let at = unkey(key);
            let mut list: Vec<u32> = near
                .iter()
                .flat_map(|&a| anchors[a as usize].charts.iter().map(|c| c.0).filter(|&c| c != u32::MAX))
                .collect();
            list.sort_unstable();
            list.dedup();
            let local = list.iter().any(|&c| conflict[c as usize]);
            let signs = gauge(charts, relations, local, &list);
            let corners = corners(charts, anchors, &near, &list, &signs, at, h);
            Ok(corners.map(|c| (key, (at, (list, signs), local, c))))
        })
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .flatten()
        .collect();
    let keys: Vec<u64> = blocks.iter().map(|b| b.0).collect();
    let find = |b: [i32; 3]| keys.binary_search(&block_key(b)).map_or(u32::MAX, |i| i as u32);
    let mut grid =
        Grid { charts, h, at: vec![], lists: vec![], local: vec![], around: vec![], cells: vec![] };
    for (_, (at, list, local, corners)) in blocks {
        grid.around.push(std::array::from_fn(|n| {
            let n = n as i32;
            find([at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1])
        }));
        grid.at.push(at);
        grid.lists.push(list);
        grid.local.push(local);
        grid.cells.push(corners);
    }
    Ok(grid)
}

/// Extends the field into corners that no chart reaches, and smooths what was filled in.
fn fill(grid: &mut Grid<'_>, ctx: &Context<'_>) -> Result<()> {
    const NEIGHBOURS: [[i32; 3]; 6] = [[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]];
    let average = |grid: &Grid<'_>, b: usize, i: [i32; 3]| {
        let (mut sum, mut count, mut from) = (0.0, 0.0, u32::MAX);
        let (own, known, _) = grid.fetch(b, i);
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for o in NEIGHBOURS {
            let (value, level, chart) = grid.fetch(b, [i[0] + o[0], i[1] + o[1], i[2] + o[2]]);
            if level > 0 && (known == 0 || (value - own).abs() <= FILL_JUMP * grid.h) {
                lo = lo.min(value);
                hi = hi.max(value);
                // A chart of another gauge cannot be averaged: the first one found sets the gauge, which is the block's own.
                sum += value;
                count += 1.0;
                if from == u32::MAX {
                    from = chart;
                }
            }
        }
        // Between two sheets that face the same way the field jumps: no surface passes there.
        (count > 0.0 && (known > 0 || hi - lo <= FILL_JUMP * grid.h)).then(|| ((sum / count) as f32, from))
    };
    for round in 0..usize::from(FILL_ROUNDS) + RELAX {
        let growing = round < usize::from(FILL_ROUNDS);
        let next: Vec<Option<Corners>> = (0..grid.cells.len())
            .into_par_iter()
            .map(|b| {
                if b % 64 == 0 {
                    ctx.check()?;
                }
                let old = &grid.cells[b];
                let wanted = |level: u8| if growing { level == 0 } else { level > 1 };
                if !old.level.iter().any(|&l| wanted(l)) {
                    return Ok(None);
                }
                let mut new = old.clone();
                let mut changed = false;
                for z in 0..BLOCK {
                    for y in 0..BLOCK {
                        for x in 0..BLOCK {
                            let c = corner_index([x, y, z]);
                            if wanted(old.level[c])
                                && let Some((value, chart)) = average(grid, b, [x, y, z])
                            {
                                new.value[c] = if value == 0.0 { f32::MIN_POSITIVE } else { value };
                                if growing {
                                    new.chart[c] = chart;
                                    new.level[c] = 2 + round as u8;
                                }
                                changed = true;
                            }
                        }
                    }
                }
                Ok(changed.then_some(new))
            })
            .collect::<Result<_>>()?;
        for (cell, new) in grid.cells.iter_mut().zip(next) {
            if let Some(new) = new {
                *cell = new;
            }
        }
    }
    Ok(())
}

/// Signs of a block's charts: the global ones, unless some of its charts contradict each other; then they are spread from the first
/// chart over the relations within the block.
fn gauge(charts: &[Chart], relations: &[Relation], local: bool, list: &[u32]) -> Vec<f64> {
    let mut signs: Vec<f64> = list.iter().map(|&c| charts[c as usize].sign).collect();
    if !local {
        return signs;
    }
    let mut links: Vec<(f64, usize, usize)> = Vec::new();
    for (i, &a) in list.iter().enumerate() {
        let from = relations.partition_point(|r| r.a < a);
        for r in relations[from..].iter().take_while(|r| r.a == a) {
            if let Ok(j) = list.binary_search(&r.b) {
                links.push((r.agreement, i, j));
            }
        }
    }
    links.sort_by(|x, y| y.0.abs().total_cmp(&x.0.abs()).then((x.1, x.2).cmp(&(y.1, y.2))));
    // Kruskal on a few dozen charts: merge groups, flipping the later one where needed.
    let mut group: Vec<usize> = (0..list.len()).collect();
    for (agree, i, j) in links {
        let (gi, gj) = (group[i], group[j]);
        if gi == gj {
            continue;
        }
        let flip = agree * signs[i] * signs[j] < 0.0;
        for k in 0..list.len() {
            if group[k] == gj {
                group[k] = gi;
                if flip {
                    signs[k] = -signs[k];
                }
            }
        }
    }
    signs
}

/// Corner offsets of a voxel: bit 0 is x, bit 1 y, bit 2 z.
const fn corner(c: usize) -> [i32; 3] {
    [(c & 1) as i32, (c >> 1 & 1) as i32, (c >> 2 & 1) as i32]
}

/// The 12 edges of a voxel as corner pairs (low, high); edges 0-3 along x, 4-7 along y, 8-11 along z.
const EDGES: [(usize, usize); 12] =
    [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)];
/// The faces of a voxel: four corners in cyclic order.
const FACES: [[usize; 4]; 6] =
    [[0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6], [0, 1, 3, 2], [4, 5, 7, 6]];

fn edge_between(a: usize, b: usize) -> usize {
    let (lo, hi) = (a.min(b), a.max(b));
    EDGES.iter().position(|&e| e == (lo, hi)).unwrap_or(0)
}

/// Which of the four cells around an edge this cell is: the cells in cyclic order about the edge's direction.
fn slot(e: usize) -> u8 {
    let (lo, _) = EDGES[e];
    let axis = e / 4;
    let o = corner(lo);
    let (a, b) = (o[(axis + 1) % 3], o[(axis + 2) % 3]);
    // The edge lies at offset (a, b) inside this cell, so the cell lies at (-a, -b) from the edge.
    match (a, b) {
        (1, 1) => 0,
        (0, 1) => 1,
        (0, 0) => 2,
        _ => 3,
    }
}

/// The blend at one corner.
struct Sample {
    weight: f64,
    value: f64,
    support: f64,
    top: f64,
    chart: u32,
}

impl Default for Sample {
    fn default() -> Self {
        Self { weight: 0.0, value: 0.0, support: 0.0, top: 0.0, chart: u32::MAX }
    }
}

/// Charts known at one place, with the weight that the points nearby give them.
struct Blend {
    weights: Vec<f64>,
}

impl Blend {
    /// Sums the weights of charts at `p`.
    fn gather(&mut self, anchors: &[Anchor], near: &[u32], list: &[u32], p: Vec3) -> f64 {
        self.weights.clear();
        self.weights.resize(list.len(), 0.0);
        let mut total = 0.0;
        for &a in near {
            let anchor = &anchors[a as usize];
            let k = influence(dist2(p, anchor.position), anchor.spacing);
            if k <= 0.0 {
                continue;
            }
            for &(c, w) in &anchor.charts {
                if let Ok(i) = list.binary_search(&c) {
                    self.weights[i] += k * f64::from(w);
                    total += k * f64::from(w);
                }
            }
        }
        total
    }
}

fn corners(
    charts: &[Chart],
    anchors: &[Anchor],
    near: &[u32],
    list: &[u32],
    signs: &[f64],
    at: [i32; 3],
    h: f64,
) -> Option<Corners> {
    let origin = at.map(|b| b * BLOCK);
    let mut out = Corners { value: [0.0; CORNERS], chart: [u32::MAX; CORNERS], level: [0; CORNERS] };
    let mut blend = Blend { weights: Vec::new() };
    let mut any = false;
    for n in 0..CORNERS {
        let k = n as i32;
        let i = [k % BLOCK, k / BLOCK % BLOCK, k / BLOCK / BLOCK];
        let p = [0, 1, 2].map(|k| f64::from(origin[k] + i[k]) * h);
        let total = blend.gather(anchors, near, list, p);
        if total <= 0.0 {
            continue;
        }
        let mut s = Sample::default();
        for ((&c, &sign), &w) in list.iter().zip(signs).zip(&blend.weights) {
            if w < 1e-3 * total {
                continue;
            }
            let Some(View { distance: f, mask, .. }) = charts[c as usize].view(p) else { continue };
            s.weight += w;
            s.value += w * f * sign;
            s.support += w * mask;
            if w > s.top {
                (s.top, s.chart) = (w, c);
            }
        }
        if s.weight <= 0.0 || s.support < MIN_SUPPORT * s.weight {
            continue;
        }
        let f = s.value / s.weight;
        if f.abs() > BAND * h {
            continue;
        }
        // An exact zero would make an edge end on the surface; the sign of a tiny value decides instead.
        out.value[n] = if f == 0.0 { f32::MIN_POSITIVE } else { f as f32 };
        out.chart[n] = s.chart;
        out.level[n] = 1;
        any = true;
    }
    any.then_some(out)
}

fn cell(grid: &Grid<'_>, block: usize, at: [i32; 3], out: &mut BlockOut) {
    let h = grid.h;
    let origin = grid.at[block].map(|b| b * BLOCK);
    let mut f = [0.0; 8];
    let mut filled = false;
    for (c, v) in f.iter_mut().enumerate() {
        let o = corner(c);
        let (value, level, _) = grid.fetch(block, [at[0] + o[0], at[1] + o[1], at[2] + o[2]]);
        if level == 0 {
            return;
        }
        filled |= level > 1;
        *v = value;
    }
    let inside = |c: usize| f[c] < 0.0;
    let mask = (0..8).filter(|&c| inside(c)).count();
    if mask == 0 || mask == 8 {
        return;
    }
    // Pair up the crossed edges face by face; a face with four crossings is decided by the bilinear saddle, which does not
    // depend on the gauge and is the same for both voxels that share the face (Nielson and Hamann 1991).
    let mut next = [[usize::MAX; 2]; 12];
    let mut link = |a: usize, b: usize| {
        for (p, q) in [(a, b), (b, a)] {
            let slot = usize::from(next[p][0] != usize::MAX);
            next[p][slot] = q;
        }
    };
    for face in FACES {
        let crossed: Vec<usize> = (0..4).filter(|&k| inside(face[k]) != inside(face[(k + 1) % 4])).collect();
        let e = |k: usize| edge_between(face[k], face[(k + 1) % 4]);
        if crossed.len() == 2 {
            link(e(crossed[0]), e(crossed[1]));
        } else if crossed.len() == 4 {
            let saddle = f[face[0]] * f[face[2]] - f[face[1]] * f[face[3]];
            // Positive: corners 0 and 2 are joined through the face, so 1 and 3 are cut off.
            if saddle > 0.0 {
                link(e(0), e(1));
                link(e(2), e(3));
            } else {
                link(e(3), e(0));
                link(e(1), e(2));
            }
        }
    }
    let place = |c: usize| {
        let o = corner(c);
        [0, 1, 2].map(|k| f64::from(origin[k] + at[k] + o[k]) * h)
    };
    let mut done = [false; 12];
    for start in 0..12 {
        if done[start] || next[start][0] == usize::MAX || next[start][1] == usize::MAX {
            continue;
        }
        let (mut sum, mut count, mut e, mut from) = ([0.0; 3], 0.0, start, usize::MAX);
        let vertex = out.positions.len() as u32;
        let first = out.records.len();
        loop {
            done[e] = true;
            let (a, b) = EDGES[e];
            let t = f[a] / (f[a] - f[b]);
            sum = add(sum, mul_add(place(a), sub(place(b), place(a)), t));
            count += 1.0;
            if (f[a] - f[b]).abs() <= if filled { FILL_JUMP } else { MAX_JUMP } * h {
                let o = corner(a);
                let k =
                    [0, 1, 2].map(|k| (i64::from(origin[k] + at[k] + o[k]) + (1 << 19)) as u64 & 0xF_FFFF);
                let key = (k[2] << 40 | k[1] << 20 | k[0]) << 2 | (e / 4) as u64;
                out.records.push((key, slot(e), vertex, f[b] > f[a]));
            }
            let [p, q] = next[e];
            let to = if p != from { p } else { q };
            from = e;
            e = to;
            if e == start {
                break;
            }
        }
        if out.records.len() == first {
            continue;
        }
        let middle = scale(sum, 1.0 / count);
        let (list, signs) = &grid.lists[block];
        let (position, normal, chart) = settle(grid.charts, list, signs, middle, h);
        out.positions.push(position);
        out.normals.push(normal);
        out.chart.push(chart);
        out.filled.push(filled);
    }
}

/// The normal at a vertex, from the charts of its block that pass nearest, and the nearest of them.
fn settle(charts: &[Chart], list: &[u32], signs: &[f64], p: Vec3, h: f64) -> (Vec3, Vec3, u32) {
    let (mut n, mut best) = ([0.0; 3], (0.0, u32::MAX));
    for (&c, sign) in list.iter().zip(signs) {
        if let Some(v) = charts[c as usize].view(p) {
            let w = v.taper * v.mask / (v.distance * v.distance + 0.01 * h * h);
            n = mul_add(n, v.normal, w * sign);
            if w > best.0 {
                best = (w, c);
            }
        }
    }
    let l = norm(n);
    (p, if l > 0.0 { scale(n, 1.0 / l) } else { [0.0; 3] }, best.1)
}
