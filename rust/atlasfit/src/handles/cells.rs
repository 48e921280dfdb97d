//! Where a surface may have small handles.
//!
//! In: a surface, with its edges. Out: places, each with the vertices about it, that are no disk, no tube and
//! no sphere: their Euler characteristic is too low. The surface is dealt out to cells, so that each part of
//! it is counted once.

use super::constants::HANDLES;
use super::region::Mesh;
use super::units::Units;
use crate::contour::surface::Surface;
use crate::error::Result;
use crate::numeric::sort::sort;
use crate::run::Context;
use crate::spatial::edges::Edges;
use crate::spatial::lists::Lists;
use crate::spatial::sets::Sets;

/// A cell for no vertex.
const NONE: u32 = u32::MAX;

/// The cells about which the surface may have handles: for each the vertices of it and of those beside it.
pub(super) fn suspects(
    s: &Surface,
    Mesh { edges, neighbours }: &Mesh,
    units: &Units,
    ctx: &Context<'_>,
) -> Result<Vec<Vec<u32>>> {
    let handles = of_parts_with_handles(s, edges, ctx)?;
    if !handles.contains(&true) {
        return Ok(Vec::new());
    }
    let (cell, count) = cells(s, neighbours, &handles, units, ctx)?;
    let euler = Euler::new(s, edges, &cell, count, ctx)?;
    let vertices: Vec<u32> = (0..cell.len() as u32).filter(|&v| cell[v as usize] != NONE).collect();
    let owners: Vec<[u32; 1]> = vertices.iter().map(|&v| [cell[v as usize]]).collect();
    let of_cell = Lists::new(count, &owners, ctx)?;
    let mut found = Vec::new();
    for c in 0..count as u32 {
        ctx.check_at(c as usize)?;
        let about = euler.beside(c);
        // A disk has 1, a tube 0, a sphere 2.
        if euler.of(&about) < 0 {
            found.push(about.iter().flat_map(|&c| of_cell.of(c)).map(|&i| vertices[i as usize]).collect());
        }
    }
    Ok(found)
}

/// Which vertices belong to a part that has handles, of whatever size.
fn of_parts_with_handles(s: &Surface, edges: &Edges, ctx: &Context<'_>) -> Result<Vec<bool>> {
    let n = s.positions.len();
    let mut parts = Sets::of_triangles(n, &s.triangles, ctx)?;
    let (mut euler, mut used) = (ctx.filled(0i64, n)?, ctx.filled(false, n)?);
    for (i, t) in s.triangles.iter().enumerate() {
        ctx.check_at(i)?;
        euler[parts.find(t[0]) as usize] += 1;
        t.iter().for_each(|&v| used[v as usize] = true);
    }
    // Edges of the boundary join what their rings consist of.
    let mut rims = Sets::new(n);
    let mut on_rim = ctx.filled(false, n)?;
    for (i, edge) in edges.iter().enumerate() {
        ctx.check_at(i)?;
        let [a, b] = edge[0].ends();
        euler[parts.find(a) as usize] -= 1;
        if edge.len() == 1 {
            rims.join(a, b);
            on_rim[a as usize] = true;
            on_rim[b as usize] = true;
        }
    }
    for v in 0..n as u32 {
        ctx.check_at(v as usize)?;
        let closes = on_rim[v as usize] && rims.find(v) == v;
        euler[parts.find(v) as usize] += i64::from(used[v as usize]) + i64::from(closes);
    }
    Ok((0..n as u32).map(|v| used[v as usize] && euler[parts.find(v) as usize] < 2).collect())
}

/// The cell of each vertex that is marked, and how many there are. Cells begin at places that are so far
/// apart, and grow until they meet.
fn cells(
    s: &Surface,
    neighbours: &Lists,
    marked: &[bool],
    units: &Units,
    ctx: &Context<'_>,
) -> Result<(Vec<u32>, usize)> {
    let mut taken = ctx.filled(false, s.positions.len())?;
    let (mut first, mut queue) = (Vec::new(), Vec::new());
    for v in 0..s.positions.len() as u32 {
        ctx.check_at(v as usize)?;
        if !marked[v as usize] || taken[v as usize] {
            continue;
        }
        first.push(v);
        let (at, radius) = (s.positions[v as usize], HANDLES.cell * units.at(s, v));
        taken[v as usize] = true;
        queue.clear();
        queue.push(v);
        while let Some(v) = queue.pop() {
            for &w in neighbours.of(v) {
                if !taken[w as usize] && s.positions[w as usize].dist2(at) < radius * radius {
                    taken[w as usize] = true;
                    queue.push(w);
                }
            }
        }
    }
    let mut cell = ctx.filled(NONE, s.positions.len())?;
    first.iter().zip(0..).for_each(|(&v, c)| cell[v as usize] = c);
    let count = first.len();
    let mut queue = first;
    let mut next = 0;
    while let Some(&v) = queue.get(next) {
        ctx.check_at(next)?;
        next += 1;
        for &w in neighbours.of(v) {
            if cell[w as usize] == NONE {
                cell[w as usize] = cell[v as usize];
                queue.push(w);
            }
        }
    }
    Ok((cell, count))
}

/// Euler characteristics: what lies in one cell, and what lies between some.
struct Euler {
    within: Vec<i32>,
    /// Two or three cells, ascending, the third one none for two; with what lies between them.
    between: Vec<([u32; 3], i32)>,
    /// The cells beside each.
    beside: Lists,
    /// Those pairs.
    pairs: Vec<[u32; 2]>,
}

impl Euler {
    fn new(s: &Surface, edges: &Edges, cell: &[u32], count: usize, ctx: &Context<'_>) -> Result<Self> {
        let of = |v: u32| cell[v as usize];
        let mut within = vec![0; count];
        cell.iter().filter(|&&c| c != NONE).for_each(|&c| within[c as usize] += 1);
        let mut shared: Vec<([u32; 3], i32)> = Vec::new();
        let mut count_in = |mut cells: [u32; 3], one: i32| {
            cells.sort_unstable();
            let [a, b, c] = cells;
            match (a == b, b == c) {
                (true, true) => within[a as usize] += one,
                (true, false) => shared.push(([a, c, NONE], one)),
                (false, true) => shared.push(([a, b, NONE], one)),
                (false, false) => shared.push((cells, one)),
            }
        };
        for (i, t) in s.triangles.iter().enumerate() {
            ctx.check_at(i)?;
            if of(t[0]) != NONE {
                count_in(t.map(of), 1);
            }
        }
        for (i, edge) in edges.iter().enumerate() {
            ctx.check_at(i)?;
            let [a, b] = edge[0].ends().map(of);
            if a != NONE {
                count_in([a, a, b], -1);
            }
        }
        sort(&mut shared, ctx)?;
        let sum = |run: &[([u32; 3], i32)]| (run[0].0, run.iter().map(|r| r.1).sum());
        let between: Vec<([u32; 3], i32)> = shared.chunk_by(|a, b| a.0 == b.0).map(sum).collect();
        let pairs: Vec<[u32; 2]> =
            between.iter().filter(|(cells, _)| cells[2] == NONE).map(|&([a, b, _], _)| [a, b]).collect();
        let beside = Lists::new(count, &pairs, ctx)?;
        Ok(Self { within, between, beside, pairs })
    }
    /// A cell and those beside it, ascending.
    fn beside(&self, cell: u32) -> Vec<u32> {
        let pairs = self.beside.of(cell).iter().map(|&k| self.pairs[k as usize]);
        let mut cells: Vec<u32> = pairs.map(|[a, b]| if a == cell { b } else { a }).collect();
        cells.push(cell);
        cells.sort_unstable();
        cells
    }
    /// The Euler characteristic of some cells together.
    fn of(&self, cells: &[u32]) -> i32 {
        let there = |c: &u32| *c == NONE || cells.binary_search(c).is_ok();
        let mut sum = 0;
        for &c in cells {
            sum += self.within[c as usize];
            let from = self.between.partition_point(|(cells, _)| cells[0] < c);
            let own = self.between[from..].iter().take_while(|(cells, _)| cells[0] == c);
            sum += own.filter(|(cells, _)| cells.iter().all(there)).map(|own| own.1).sum::<i32>();
        }
        sum
    }
}
