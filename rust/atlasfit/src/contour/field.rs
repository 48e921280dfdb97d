//! Contouring the blended charts.
//!
//! In: charts with signs, voxel size. Out: a quadrilateral mesh, one vertex per surface piece in a voxel, one quad per
//! voxel edge that the surface crosses (dual marching cubes; Nielson 2004). The band is cut into blocks of voxels that are independent
//! of each other; a block's orientation is local, so one-sided surfaces need no special care.

use crate::atlas::Relation;
use crate::atlas::{BlendSite, SITE_CHARTS};
use crate::atlas::{Chart, View};
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::numeric::vec3::Vec3;
use crate::run::Context;
use rayon::prelude::*;

/// Voxels along one side of a block. Small blocks follow the surface closely, large ones share more corners.
const BLOCK: i32 = 4;
/// Corners that a block owns.
const CORNERS: usize = (BLOCK as usize).pow(3);
/// Charts are evaluated up to this many voxels from their surface: the corners of every crossed voxel lie within sqrt(3).
const BAND: f64 = 2.2;
/// Least blended mask at which a place knows its distance from the surface by its charts.
const MIN_SUPPORT: f64 = 0.25;
/// Blended mask at the edge of the surface.
pub const EDGE: f32 = 0.5;
/// Stands for the blended mask of a vertex of a voxel that reaches beyond the band where charts are known: what is filled in there says nothing.
pub const TORN: f32 = -1.0;
/// Rounds of filling: each extends the field by one voxel into places where no chart has data, so that gaps of up to twice as many voxels
/// close (volumetric diffusion; Davis et al. 2002).
const FILL_ROUNDS: u8 = 4;
/// Sweeps that smooth the filled values.
const RELAX: usize = 8;
/// An edge whose ends differ by more than this many voxels joins two different sheets: no surface passes between.
const MAX_JUMP: f64 = 1.9;
/// The same where the field is filled in: values two voxels apart across the surface differ by two.
const FILL_JUMP: f64 = 2.2;

/// A sheet this many voxels away counts half as much as one at the place itself when charts disagree which sheet a place belongs to.
const NEAR: f64 = 0.5;
/// Charts whose distances differ by less than so many voxels plus so many standard deviations of the noise see the same sheet.
const SAME_SHEET: (f64, f64) = (1.0, 1.0);
/// So do charts whose normals differ by less than this (cosine).
const SAME_WAY: f64 = 0.5;

/// A crossing keeps this share of an edge away from its ends: where the surface passes through a corner of the grid the vertices of the voxels about it
/// would meet there.
const SHORT_OF: f64 = 0.01;

/// Voxels from the origin that the keys of blocks can name.
const RANGE: f64 = 4e6;
/// Pairs of a block and a point handled at a time: bounds the memory, costs a look at all points each time.
const PAIRS: usize = 1 << 22;
/// One in so many pairs takes part in the choice of what is handled at a time.
const PAIR_SAMPLE: usize = 64;
/// Blocks, points that one worker handles between two checks.
const CHUNK: usize = 64;
/// Memory for one block: its corners, the blocks around it, its charts; and the vertices and quads in it (measured).
const BYTES_PER_BLOCK: u64 = 1560;
/// Memory for one chart, and for one point at this stage (measured).
const BYTES_PER_CHART: u64 = 900;
const BYTES_PER_POINT: u64 = 300;

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
    /// Blended mask at the vertex, in [0, 1], or [`TORN`]: below [`EDGE`] it is beyond the edge of the data.
    pub support: Vec<f32>,
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

/// Reach of a point's influence, in point spacings. Gaps between random points are seldom wider than twice this.
const REACH: f64 = 2.4;

/// Influence of a point at squared distance `q`, in units of its spacing: the nearest points decide, smoothly.
#[inline]
fn influence(q: f64) -> f64 {
    let t = 1.0 - q * (1.0 / (REACH * REACH));
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
    /// Position of each block, as a key; ascending.
    keys: Vec<u64>,
    /// Where the charts of each block start, one more than there are blocks.
    start: Vec<u32>,
    /// The charts of each block, ascending, and whether each faces the other way in the block's gauge.
    lists: Vec<u32>,
    turned: Vec<bool>,
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
    /// Blended mask, 0 to 255.
    support: [u8; CORNERS],
}

#[inline]
fn corner_index(i: [i32; 3]) -> usize {
    ((i[2] * BLOCK + i[1]) * BLOCK + i[0]) as usize
}

impl Grid<'_> {
    /// Charts of a block, and whether each is turned in the block's gauge.
    fn list(&self, block: usize) -> (&[u32], &[bool]) {
        let range = self.start[block] as usize..self.start[block + 1] as usize;
        (&self.lists[range.clone()], &self.turned[range])
    }
    /// Sign of a chart in a block's gauge.
    fn sign(&self, block: usize, chart: u32) -> f64 {
        let sign = self.charts[chart as usize].sign;
        if self.local[block] {
            let (list, turned) = self.list(block);
            if let Ok(k) = list.binary_search(&chart) {
                return if turned[k] { -sign } else { sign };
            }
        }
        sign
    }
    /// The block and the place in it of corner `i`, counted from `block`, whose neighbour it may be in.
    #[inline]
    fn owner(&self, block: usize, mut i: [i32; 3]) -> (u32, usize) {
        let mut n = 13usize;
        for (k, stride) in [(0, 1usize), (1, 3), (2, 9)] {
            if i[k] < 0 {
                i[k] += BLOCK;
                n -= stride;
            } else if i[k] >= BLOCK {
                i[k] -= BLOCK;
                n += stride;
            }
        }
        (if n == 13 { block as u32 } else { self.around[block][n] }, corner_index(i))
    }
    /// Value, level and chart at corner `i` of `block` in that block's gauge; `i` may reach into the blocks around it.
    #[inline]
    fn fetch(&self, block: usize, i: [i32; 3]) -> (f64, u8, u32) {
        let (other, c) = self.owner(block, i);
        if other == u32::MAX {
            return (0.0, 0, u32::MAX);
        }
        let other = other as usize;
        let b = &self.cells[other];
        let (mut value, level, chart) = (f64::from(b.value[c]), b.level[c], b.chart[c]);
        if other != block && level > 0 && (self.local[block] || self.local[other]) {
            value *= self.sign(block, chart) * self.sign(other, chart);
        }
        (value, level, chart)
    }
    /// Blended mask at corner `i`, in [0, 1].
    fn support(&self, block: usize, i: [i32; 3]) -> f64 {
        let (other, c) = self.owner(block, i);
        self.cells.get(other as usize).map_or(0.0, |b| f64::from(b.support[c]) / 255.0)
    }
    /// Blended mask at `p` in the voxel of `block` with lowest corner `at`, trilinear.
    fn support_at(&self, block: usize, at: [i32; 3], p: Vec3) -> f32 {
        let first = unkey(self.keys[block]);
        let t = [0, 1, 2].map(|k| p[k] / self.h - f64::from(first[k] * BLOCK + at[k]));
        let weight = |o: [i32; 3]| (0..3).map(|k| if o[k] == 1 { t[k] } else { 1.0 - t[k] }).product::<f64>();
        let corners = (0..8).map(corner);
        corners.map(|o| weight(o) * self.support(block, [0, 1, 2].map(|k| at[k] + o[k]))).sum::<f64>() as f32
    }
}

/// A cell at an edge that the surface crosses: the edge (owner of its low corner, corner, axis), the cell's slot around it and whether the field
/// rises along it, in bits from high to low; and the vertex in the cell.
type Record = (u64, u32);
/// Bits below the edge.
const EDGE_SHIFT: u32 = 3;

/// What some blocks contribute.
#[derive(Default)]
struct BlockOut {
    contour: Contour,
    records: Vec<Record>,
}

/// Whether voxels of size `h` at `p` can be named.
#[must_use]
pub fn within_range(p: Vec3, h: f64) -> bool {
    p.iter().all(|x| x.abs() < RANGE * h)
}

/// Contours the atlas at voxel size `h`. Anchors out of range ([`within_range`]) are left out.
///
/// # Errors
/// Cancelled, out of time or memory.
pub fn contour(
    charts: &[Chart],
    mut anchors: Vec<BlendSite>,
    relations: &[Relation],
    conflicts: &[(u32, u32)],
    h: f64,
    ctx: &Context<'_>,
) -> Result<Contour> {
    anchors.retain(|a| within_range(a.position, h));
    let (mut grid, pairs) = sample(charts, &anchors, relations, conflicts, h, ctx)?;
    drop(anchors);
    fill(&mut grid, ctx)?;
    let blocks = grid.keys.len();
    let outs: Vec<BlockOut> = (0..blocks.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            ctx.check()?;
            let mut out = BlockOut::default();
            let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(blocks);
            ctx.advance(pairs / blocks * range.len());
            for b in range {
                for k in 0..CORNERS as i32 {
                    cell(&grid, b, [k % BLOCK, k / BLOCK % BLOCK, k / BLOCK / BLOCK], &mut out);
                }
            }
            Ok(out)
        })
        .collect::<Result<_>>()?;
    drop(grid);
    let mut contour = Contour::default();
    let vertices = outs.iter().map(|o| o.contour.positions.len()).sum();
    let mut records: Vec<Record> = Vec::with_capacity(outs.iter().map(|o| o.records.len()).sum());
    contour.positions.reserve_exact(vertices);
    contour.normals.reserve_exact(vertices);
    contour.chart.reserve_exact(vertices);
    contour.filled.reserve_exact(vertices);
    contour.support.reserve_exact(vertices);
    for (k, o) in outs.into_iter().enumerate() {
        if k % CHUNK == 0 {
            ctx.check()?;
        }
        let base = contour.positions.len() as u32;
        records.extend(o.records.into_iter().map(|(key, v)| (key, v + base)));
        contour.positions.extend(o.contour.positions);
        contour.normals.extend(o.contour.normals);
        contour.chart.extend(o.contour.chart);
        contour.filled.extend(o.contour.filled);
        contour.support.extend(o.contour.support);
    }
    sort(&mut records, ctx)?;
    contour.quads.reserve_exact(records.len() / 4);
    let mut i = 0;
    while i + 3 < records.len() {
        if i % 65536 < 4 {
            ctx.check()?;
        }
        let r = &records[i..i + 4];
        let edge = r[0].0 >> EDGE_SHIFT;
        if (0..4).all(|k| r[k].0 >> 1 == edge << 2 | k as u64) {
            let q = [r[0].1, r[1].1, r[2].1, r[3].1];
            contour.quads.push(if r[0].0 & 1 == 1 { q } else { [q[3], q[2], q[1], q[0]] });
            i += 4;
        } else {
            i += 1;
        }
    }
    Ok(contour)
}

/// Names the blocks that an anchor influences: those that its reach touches near its tangent plane.
fn touched(a: &BlendSite, h: f64, mut visit: impl FnMut(u64)) {
    let size = h * f64::from(BLOCK);
    let reach = REACH * a.spacing;
    let lo = a.position.0.map(|x| ((x - reach) / size).floor() as i32);
    let hi = a.position.0.map(|x| ((x + reach) / size).floor() as i32);
    // Half a block's diagonal, the band, and what a curved surface leaves its tangent plane by within reach.
    let slab = 0.87 * size + BAND * h + 0.5 * reach;
    let far = reach + 0.87 * size;
    // Columns of blocks along the axis that the anchor faces most.
    let n = a.normal;
    let k = (0..3).fold(0, |k, i| if n[i].abs() > n[k].abs() { i } else { k });
    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
    let centre = |b: i32, axis: usize| (f64::from(b) + 0.5) * size - a.position[axis];
    for x in lo[i]..=hi[i] {
        for y in lo[j]..=hi[j] {
            let (dx, dy) = (centre(x, i), centre(y, j));
            let ball = far * far - dx * dx - dy * dy;
            if ball < 0.0 {
                continue;
            }
            let middle = -(n[i] * dx + n[j] * dy) / n[k];
            let (half, ball) = ((slab / n[k]).abs(), ball.sqrt());
            let from = (a.position[k] + (middle - half).max(-ball)) / size - 0.5;
            let to = (a.position[k] + (middle + half).min(ball)) / size - 0.5;
            for z in (from.ceil() as i32).max(lo[k])..=(to.floor() as i32).min(hi[k]) {
                let mut b = [0; 3];
                (b[i], b[j], b[k]) = (x, y, z);
                visit(block_key(b));
            }
        }
    }
}

/// Evaluates the charts at the corners of the band. Gives the grid and the number of pairs of a block and an anchor.
fn sample<'c>(
    charts: &'c [Chart],
    anchors: &[BlendSite],
    relations: &[Relation],
    conflicts: &[(u32, u32)],
    h: f64,
    ctx: &Context<'_>,
) -> Result<(Grid<'c>, usize)> {
    // How many pairs there are, and keys that cut them into shares of equal size.
    let counts: Vec<(usize, Vec<u64>)> = anchors
        .par_chunks(CHUNK)
        .map(|chunk| {
            ctx.check()?;
            let (mut count, mut some) = (0, Vec::new());
            for a in chunk {
                touched(a, h, |key| {
                    if count % PAIR_SAMPLE == 0 {
                        some.push(key);
                    }
                    count += 1;
                });
            }
            Ok((count, some))
        })
        .collect::<Result<_>>()?;
    let total: usize = counts.iter().map(|c| c.0).sum();
    ctx.stage(crate::run::Stage::Surface, 2 * total);
    let mut cuts: Vec<u64> = counts.into_iter().flat_map(|c| c.1).collect();
    sort(&mut cuts, ctx)?;
    let shares = total.div_ceil(PAIRS);
    let mut cuts: Vec<u64> = (1..shares).map(|k| cuts[k * cuts.len() / shares]).collect();
    cuts.dedup();
    cuts.push(u64::MAX);

    let mut conflict = vec![false; charts.len()];
    for &(a, b) in conflicts {
        conflict[a as usize] = true;
        conflict[b as usize] = true;
    }
    let mut grid = Grid {
        charts,
        h,
        keys: vec![],
        start: vec![0],
        lists: vec![],
        turned: vec![],
        local: vec![],
        around: vec![],
        cells: vec![],
    };
    let fixed = BYTES_PER_CHART * charts.len() as u64 + BYTES_PER_POINT * anchors.len() as u64;
    let size = h * f64::from(BLOCK);
    let (mut from, mut seen) = (0, 0);
    for to in cuts {
        let (low, high) = (unkey(from)[2], unkey(to - 1)[2]);
        let found: Vec<Vec<(u64, u32)>> = anchors
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(c, chunk)| {
                ctx.check()?;
                let mut out = Vec::new();
                for (i, a) in chunk.iter().enumerate() {
                    let [z0, z1] = [-1.0, 1.0].map(|s| (a.position[2] + s * REACH * a.spacing) / size);
                    if (z1.floor() as i32) < low || (z0.floor() as i32) > high {
                        continue;
                    }
                    touched(a, h, |key| {
                        if (from..to).contains(&key) {
                            out.push((key, (c * CHUNK + i) as u32));
                        }
                    });
                }
                Ok(out)
            })
            .collect::<Result<_>>()?;
        let mut pairs: Vec<(u64, u32)> = Vec::with_capacity(found.iter().map(Vec::len).sum());
        found.into_iter().for_each(|f| pairs.extend(f));
        sort(&mut pairs, ctx)?;
        let groups: Vec<&[(u64, u32)]> = pairs.chunk_by(|a, b| a.0 == b.0).collect();
        // Stopping early beats running out of memory late.
        seen += pairs.len();
        let blocks = (grid.keys.len() + groups.len()) as f64 * total as f64 / seen.max(1) as f64;
        ctx.reserve(fixed + BYTES_PER_BLOCK * blocks as u64)?;
        let made: Vec<Vec<Made>> = groups
            .par_chunks(CHUNK)
            .map(|groups| {
                let mut out = Vec::new();
                for near in groups {
                    ctx.check()?;
                    ctx.advance(near.len());
                    out.extend(make(charts, anchors, relations, &conflict, near, h));
                }
                Ok(out)
            })
            .collect::<Result<_>>()?;
        for (i, m) in made.into_iter().flatten().enumerate() {
            ctx.check_at(i)?;
            grid.keys.push(m.key);
            grid.lists.extend(m.list);
            grid.turned.extend(m.turned);
            grid.start.push(grid.lists.len() as u32);
            grid.local.push(m.local);
            grid.cells.push(m.corners);
        }
        from = to;
    }
    let keys = &grid.keys;
    let find = |b: [i32; 3]| keys.binary_search(&block_key(b)).map_or(u32::MAX, |i| i as u32);
    grid.around = keys
        .par_chunks(1024)
        .map(|chunk| {
            ctx.check()?;
            let around = |&key: &u64| {
                let at = unkey(key);
                std::array::from_fn(|n| {
                    let n = n as i32;
                    find([at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1])
                })
            };
            Ok(chunk.iter().map(around).collect::<Vec<[u32; 27]>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    Ok((grid, total))
}

/// A block on its way into the grid.
struct Made {
    key: u64,
    list: Vec<u32>,
    turned: Vec<bool>,
    local: bool,
    corners: Corners,
}

/// Evaluates the charts at the corners of one block.
fn make(
    charts: &[Chart],
    anchors: &[BlendSite],
    relations: &[Relation],
    conflict: &[bool],
    near: &[(u64, u32)],
    h: f64,
) -> Option<Made> {
    let key = near[0].0;
    let mut list: Vec<u32> = near
        .iter()
        .flat_map(|&(_, a)| anchors[a as usize].charts.iter().map(|c| c.0).filter(|&c| c != u32::MAX))
        .collect();
    list.sort_unstable();
    list.dedup();
    if list.is_empty() {
        return None;
    }
    let local = list.iter().any(|&c| conflict[c as usize]);
    let signs = gauge(charts, relations, local, &list);
    let corners = corners(charts, anchors, near, &list, &signs, unkey(key), h)?;
    let turned = list.iter().zip(&signs).map(|(&c, s)| s * charts[c as usize].sign < 0.0).collect();
    Some(Made { key, list, turned, local, corners })
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
        let blocks = grid.cells.len();
        let changes: Vec<Vec<(u32, f32, u32)>> = (0..blocks.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                ctx.check()?;
                let mut changes = Vec::new();
                for b in chunk * CHUNK..((chunk + 1) * CHUNK).min(blocks) {
                    for (c, &level) in grid.cells[b].level.iter().enumerate() {
                        let k = c as i32;
                        if (if growing { level == 0 } else { level > 1 })
                            && let Some((value, chart)) =
                                average(grid, b, [k % BLOCK, k / BLOCK % BLOCK, k / BLOCK / BLOCK])
                        {
                            changes.push(((b % CHUNK * CORNERS + c) as u32, value, chart));
                        }
                    }
                }
                Ok(changes)
            })
            .collect::<Result<_>>()?;
        grid.cells.par_chunks_mut(CHUNK).zip(changes).try_for_each(|(cells, changes)| {
            ctx.check()?;
            for (at, value, chart) in changes {
                let (cell, c) = (&mut cells[at as usize / CORNERS], at as usize % CORNERS);
                cell.value[c] = if value == 0.0 { f32::MIN_POSITIVE } else { value };
                if growing {
                    cell.chart[c] = chart;
                    cell.level[c] = 2 + round as u8;
                }
            }
            Ok(())
        })?;
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

/// An anchor as a block sees it.
struct Near {
    position: Vec3,
    /// One over its spacing squared.
    density: f64,
    /// Its charts, as places in the block's list; those that are unused have no weight.
    charts: [(u32, f32); SITE_CHARTS],
}

impl Near {
    fn new(anchor: &BlendSite, list: &[u32]) -> Self {
        Self {
            position: anchor.position,
            density: 1.0 / (anchor.spacing * anchor.spacing),
            charts: anchor.charts.map(|(c, w)| match list.binary_search(&c) {
                Ok(i) => (i as u32, w),
                Err(_) => (0, 0.0),
            }),
        }
    }
}

/// Sums the weights that the points nearby give a block's charts at `p`.
fn gather(near: &[Near], p: Vec3, weights: &mut [f64]) -> f64 {
    weights.fill(0.0);
    let mut total = 0.0;
    for a in near {
        let k = influence(p.dist2(a.position) * a.density);
        if k <= 0.0 {
            continue;
        }
        for &(c, w) in &a.charts {
            weights[c as usize] += k * f64::from(w);
            total += k * f64::from(w);
        }
    }
    total
}

fn corners(
    charts: &[Chart],
    anchors: &[BlendSite],
    near: &[(u64, u32)],
    list: &[u32],
    signs: &[f64],
    at: [i32; 3],
    h: f64,
) -> Option<Corners> {
    let origin = at.map(|b| b * BLOCK);
    let mut out = Corners {
        value: [0.0; CORNERS],
        chart: [u32::MAX; CORNERS],
        level: [0; CORNERS],
        support: [0; CORNERS],
    };
    let near: Vec<Near> = near.iter().map(|&(_, a)| Near::new(&anchors[a as usize], list)).collect();
    let mut weights = vec![0.0; list.len()];
    let mut seen: Vec<(u32, f64, f64, f64, Vec3)> = Vec::new();
    let mut any = false;
    for n in 0..CORNERS {
        let k = n as i32;
        let i = [k % BLOCK, k / BLOCK % BLOCK, k / BLOCK / BLOCK];
        let p = Vec3::from_fn(|k| f64::from(origin[k] + i[k]) * h);
        let total = gather(&near, p, &mut weights);
        if total <= 0.0 {
            continue;
        }
        seen.clear();
        for ((&c, &sign), &w) in list.iter().zip(signs).zip(&weights) {
            if w < 1e-3 * total {
                continue;
            }
            let Some(View { distance, mask, normal, .. }) = charts[c as usize].view(p) else { continue };
            seen.push((c, w, distance * sign, mask, normal * sign));
        }
        // Charts of another sheet nearby have no say here: the sheet that is near and well known decides which charts are of the same opinion.
        let score = |x: &(u32, f64, f64, f64, Vec3)| x.1 * (x.3 + 0.02) / (x.2.abs() + NEAR * h);
        let Some(&(_, _, lead, _, facing)) = seen.iter().max_by(|a, b| score(a).total_cmp(&score(b))) else {
            continue;
        };
        let mut s = Sample::default();
        for &(c, w, f, mask, normal) in &seen {
            let limit = SAME_SHEET.0 * h + SAME_SHEET.1 * charts[c as usize].sigma;
            let t = (1.0 - ((f - lead) / limit).powi(2)).max(0.0);
            // Charts that face the same way are one sheet's, however noisy.
            let w = if normal.dot(facing) > SAME_WAY { w } else { w * t * t };
            if w <= 0.0 {
                continue;
            }
            s.weight += w;
            s.value += w * f;
            s.support += w * mask;
            if w > s.top {
                (s.top, s.chart) = (w, c);
            }
        }
        if s.weight <= 0.0 {
            continue;
        }
        let support = s.support / s.weight;
        // Rounded down: below the least support stays below it.
        out.support[n] = (255.0 * support) as u8;
        if support < MIN_SUPPORT {
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
    let origin = unkey(grid.keys[block]).map(|b| b * BLOCK);
    let mut f = [0.0; 8];
    let (mut filled, mut torn) = (false, false);
    for (c, v) in f.iter_mut().enumerate() {
        let o = corner(c);
        let (value, level, _) = grid.fetch(block, [at[0] + o[0], at[1] + o[1], at[2] + o[2]]);
        if level == 0 {
            return;
        }
        filled |= level > 1;
        torn |= level > 1 && grid.support(block, [at[0] + o[0], at[1] + o[1], at[2] + o[2]]) >= MIN_SUPPORT;
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
        Vec3::from_fn(|k| f64::from(origin[k] + at[k] + o[k]) * h)
    };
    let mut done = [false; 12];
    for start in 0..12 {
        if done[start] || next[start][0] == usize::MAX || next[start][1] == usize::MAX {
            continue;
        }
        let (mut sum, mut count, mut e, mut from) = (Vec3::ZERO, 0.0, start, usize::MAX);
        let vertex = out.contour.positions.len() as u32;
        let first = out.records.len();
        loop {
            done[e] = true;
            let (a, b) = EDGES[e];
            let t = (f[a] / (f[a] - f[b])).clamp(SHORT_OF, 1.0 - SHORT_OF);
            sum += place(a) + (place(b) - place(a)) * t;
            count += 1.0;
            if (f[a] - f[b]).abs() <= if filled { FILL_JUMP } else { MAX_JUMP } * h {
                let o = corner(a);
                let (owner, c) = grid.owner(block, [0, 1, 2].map(|k| at[k] + o[k]));
                let edge = u64::from(owner) * CORNERS as u64 + c as u64;
                let edge = (edge << 2 | (e / 4) as u64) << EDGE_SHIFT;
                out.records.push((edge | u64::from(slot(e)) << 1 | u64::from(f[b] > f[a]), vertex));
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
        let middle = sum * (1.0 / count);
        let (normal, chart) = settle(grid, block, middle);
        let support = if torn { TORN } else { grid.support_at(block, at, middle) };
        let out = &mut out.contour;
        out.positions.push(middle);
        out.normals.push(normal);
        out.chart.push(chart);
        out.filled.push(filled);
        out.support.push(support);
    }
}

/// The normal at a vertex, from the charts of its block that pass nearest, and the nearest of them.
fn settle(grid: &Grid<'_>, block: usize, p: Vec3) -> (Vec3, u32) {
    let (mut n, mut best) = (Vec3::ZERO, (0.0, u32::MAX));
    let (list, turned) = grid.list(block);
    for (&c, &turned) in list.iter().zip(turned) {
        let chart = &grid.charts[c as usize];
        if let Some(v) = chart.view(p) {
            let w = v.weight * v.mask / (v.distance * v.distance + 0.01 * grid.h * grid.h);
            n += v.normal * (if turned { -w * chart.sign } else { w * chart.sign });
            if w > best.0 {
                best = (w, c);
            }
        }
    }
    let l = n.norm();
    (if l > 0.0 { n * (1.0 / l) } else { Vec3::ZERO }, best.1)
}
