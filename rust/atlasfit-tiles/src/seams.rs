//! What is decided for all tiles at once: how their surfaces join, which way parts face, which stay.
//!
//! In: where each tile's triangles end. Out: for each tile which of its parts are turned and which are left
//! out, and triangles that close what does not fit; a summary: parts, boundaries, cracks.
//!
//! Tiles compute the same where they see the same, so nearly all edges at which two tiles meet are equal bit
//! by bit. Where two tiles have come to different surfaces the edges that fit nothing make rings, which are
//! closed by triangles. Part by part, edges that fit say whether both face alike (parity, the parts with the
//! most common edges first); what hangs together then faces out where it is closed, else as most of it does.

use crate::error::Result;
use crate::folder::Folder;
use crate::job::{End, Key, Seam, Sums, key};
use crate::plan::Plan;
use crate::rings::{Placed, ordered, placed, rings};
use crate::store;
use atlasfit::pipeline::tile::close_ring;
use atlasfit::{Run, Stop};
use rustc_hash::{FxHashMap, FxHashSet};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Ends of borders that two tiles put to different places are one up to this distance, in spacings.
const SAME_END: f64 = 4.0;
/// What an error calls this work where it was stopped.
const SEAMS: &str = "joining tiles";

/// What was decided, in numbers.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Connected parts of the surface.
    pub parts: usize,
    /// Parts that were not wanted.
    pub dropped_parts: usize,
    /// Boundaries of the surface.
    pub boundary_loops: usize,
    /// Edges at which two tiles meet.
    pub seam_edges: usize,
    /// Rings closed where two tiles did not agree, and triangles in them.
    pub closed_rings: usize,
    /// Triangles of these.
    pub closing_triangles: usize,
    /// Edges that fit nothing and could not be closed: cracks.
    pub cracks: usize,
    /// Whether some part faces two ways at a seam: it is one-sided.
    pub one_sided: bool,
}

/// What was decided for a tile.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Decided {
    /// For each part of the tile: 0 it stays, 1 it stays turned, 2 it is left out.
    pub parts: Vec<u8>,
    /// Places of triangles that the tile gets besides, three each, with the part.
    pub closing: Vec<([[f64; 3]; 3], u32)>,
}

impl Decided {
    fn write(&self, folder: Folder<'_>, tile: usize) -> Result<()> {
        store::whole(&folder.decided(tile), |out| {
            out.list(&self.parts)?;
            out.column(&self.closing.iter().flat_map(|c| c.0).collect::<Vec<_>>())?;
            out.list(&self.closing.iter().map(|c| c.1).collect::<Vec<_>>())
        })
    }
    pub fn read(folder: Folder<'_>, tile: usize) -> Result<Self> {
        let mut from = store::Reader::open(&folder.decided(tile))?;
        let (parts, at, of) = (from.list()?, from.column::<3, f64>()?, from.list()?);
        let closing = at.as_chunks::<3>().0.iter().copied().zip(of).collect();
        Ok(Self { parts, closing })
    }
}

/// Sets with signs: whether two of one set are opposite.
struct Sets(Vec<(u32, bool)>);

impl Sets {
    fn new(n: usize) -> Self {
        Self((0..n as u32).map(|i| (i, false)).collect())
    }
    fn find(&mut self, i: u32) -> (u32, bool) {
        let (mut at, mut turned) = (i, false);
        while self.0[at as usize].0 != at {
            let (up, turn) = self.0[at as usize];
            at = up;
            turned ^= turn;
        }
        // What was passed points to the root from now on.
        let (mut here, mut left) = (i, turned);
        while self.0[here as usize].0 != at && here != at {
            let (up, turn) = self.0[here as usize];
            self.0[here as usize] = (at, left);
            here = up;
            left ^= turn;
        }
        (at, turned)
    }
    fn join(&mut self, a: u32, b: u32, opposite: bool) {
        let ((a, x), (b, y)) = (self.find(a), self.find(b));
        if a != b {
            self.0[a.max(b) as usize] = (a.min(b), opposite ^ x ^ y);
        }
    }
}

/// What all tiles have written of where they end.
struct Ends {
    /// The number of each tile's first part among those of all tiles; at last, how many there are.
    first: Vec<u32>,
    /// Of each part of all tiles.
    sums: Vec<Sums>,
    /// How much two parts agree: edges along which they face alike, less those along which they do not.
    agree: BTreeMap<[u32; 2], f64>,
    /// Edges at which two tiles meet.
    seam_edges: usize,
    /// Edges that fit no other, in an order that is always the same.
    loose: Vec<Placed>,
    /// Edges of the surface's boundaries, with their tiles.
    borders: Vec<(u32, End)>,
    /// Edges that triangles have already, between places where tiles end.
    across: FxHashSet<[Key; 2]>,
}

impl Ends {
    fn read(tiles: usize, folder: Folder<'_>, stop: &Stop) -> Result<Self> {
        let (mut first, mut sums, mut borders) = (vec![0], Vec::new(), Vec::new());
        let mut edges: FxHashMap<[Key; 2], Vec<Placed>> = FxHashMap::default();
        let mut across = FxHashSet::default();
        for tile in 0..tiles as u32 {
            stop.check(SEAMS)?;
            let seam = Seam::read(folder, tile as usize)?;
            sums.extend(&seam.parts);
            first.push(sums.len() as u32);
            for end in seam.cut {
                edges.entry(placed(&end).0).or_default().push(Placed { tile, end });
            }
            across.extend(seam.across.into_iter().map(|e| ordered(e.map(key))));
            borders.extend(seam.border.into_iter().map(|e| (tile, e)));
        }
        let (agree, loose) = (BTreeMap::new(), Vec::new());
        let mut ends = Self { first, sums, agree, seam_edges: 0, loose, borders, across };
        for of in edges.into_values() {
            let [a, b] = &of[..] else {
                ends.loose.extend(of);
                continue;
            };
            let (edge, along) = placed(&a.end);
            ends.across.insert(edge);
            ends.seam_edges += 1;
            let [x, y] = [a, b].map(|e| ends.part(e));
            let alike = if along != placed(&b.end).1 { 1.0 } else { -1.0 };
            *ends.agree.entry([x.min(y), x.max(y)]).or_default() += alike;
        }
        ends.loose.sort_unstable_by_key(|e| (e.tile, e.end.at.map(key)));
        Ok(ends)
    }

    /// The number of an edge's part among those of all tiles.
    fn part(&self, e: &Placed) -> u32 {
        self.first[e.tile as usize] + e.end.part
    }

    /// Which parts hang together, and whether two of them face opposite ways; whether something is
    /// one-sided.
    fn facing(&self) -> (Sets, bool) {
        let mut strongest: Vec<([u32; 2], f64)> = self.agree.iter().map(|(p, s)| (*p, *s)).collect();
        strongest.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()).then(a.0.cmp(&b.0)));
        let mut sets = Sets::new(self.sums.len());
        let mut one_sided = false;
        for ([a, b], sum) in strongest {
            let ((x, s), (y, t)) = (sets.find(a), sets.find(b));
            if x == y {
                one_sided |= (s ^ t) != (sum < 0.0);
            } else {
                sets.join(a, b, sum < 0.0);
            }
        }
        (sets, one_sided)
    }
}

/// Rings closed with triangles.
#[derive(Default)]
struct Closed {
    /// For each triangle its tile, its places, and the part of the tile.
    triangles: Vec<(u32, [[f64; 3]; 3], u32)>,
    /// Edges that the closing triangles add to the boundaries.
    borders: Vec<[Key; 2]>,
    /// Parts, of all tiles, at rings that could not be closed.
    open_parts: Vec<u32>,
    rings: usize,
    cracks: usize,
}

/// Closes the rings of edges that fit nothing, and joins the parts about each.
fn close(ends: &mut Ends, sets: &mut Sets, spacing: f64, run: &mut Run<'_>) -> Result<Closed> {
    let mut closed = Closed::default();
    for mut ring in rings(&ends.loose, SAME_END * spacing) {
        let Some(&(lead, forward)) = ring.edges.iter().flatten().next() else { continue };
        // An edge between two ends of a border is border itself.
        if ring.corners.len() == 2 && ring.edges.contains(&None) {
            closed.borders.push([ring.corners[0], ring.corners[1]]);
            continue;
        }
        // The closing triangles run against the tile's own edge.
        if forward {
            ring.places.reverse();
        }
        let mut taken: Vec<[u32; 2]> = Vec::new();
        for (i, a) in ring.places.iter().enumerate() {
            for (k, b) in ring.places[..i].iter().enumerate() {
                if ends.across.contains(&ordered([key(*a), key(*b)])) {
                    taken.push([k as u32, i as u32]);
                }
            }
        }
        let triangles = run.execute(|ctx| close_ring(&ring.places, &taken, ctx))?;
        let lead = &ends.loose[lead];
        let of = ends.part(lead);
        // A part that is held by nothing else faces as the ring says.
        for &(e, along) in ring.edges.iter().flatten() {
            sets.join(of, ends.part(&ends.loose[e]), along != forward);
        }
        let Some(triangles) = triangles else {
            closed.cracks += ring.edges.iter().flatten().count();
            closed.open_parts.push(of);
            continue;
        };
        closed.rings += 1;
        let at = |v: u32| ring.places[v as usize];
        closed.triangles.extend(triangles.iter().map(|t| (lead.tile, t.map(at), lead.end.part)));
        let edges = triangles.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
        ends.across.extend(edges.map(|e| ordered(e.map(|v| key(at(v))))));
        let n = ring.edges.len();
        let none = (0..n).filter(|&k| ring.edges[k].is_none());
        closed.borders.extend(none.map(|k| [ring.corners[k], ring.corners[(k + 1) % n]]));
    }
    Ok(closed)
}

/// Which way parts of all tiles face, and which stay.
struct Fate {
    /// For each part its set's first, and whether it faces the other way than that.
    roots: Vec<(u32, bool)>,
    /// Of each set, by its first part: its area, and whether it faces inwards and is turned.
    area: Vec<f64>,
    inward: Vec<bool>,
    stays: Vec<bool>,
}

impl Fate {
    fn new(plan: &Plan, ends: &Ends, closed: &Closed, mut sets: Sets) -> Self {
        let n = ends.sums.len();
        let roots: Vec<(u32, bool)> = (0..n as u32).map(|i| sets.find(i)).collect();
        let root = |part: u32| roots[part as usize].0 as usize;
        let mut open = vec![false; n];
        ends.borders.iter().for_each(|(t, e)| open[root(ends.first[*t as usize] + e.part)] = true);
        closed.open_parts.iter().for_each(|&p| open[root(p)] = true);
        let (mut area, mut volume, mut face) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for (sums, &(root, turned)) in ends.sums.iter().zip(&roots) {
            let sign = if turned { -1.0 } else { 1.0 };
            area[root as usize] += sums.area;
            volume[root as usize] += sign * sums.volume;
            face[root as usize] += sign * sums.area;
        }
        let least = plan.options.min_part * area.iter().sum::<f64>();
        let largest = (0..n).max_by(|&a, &b| area[a].total_cmp(&area[b]).then(b.cmp(&a)));
        let stays = |r| area[r] >= least && (!plan.options.largest || Some(r) == largest);
        Self {
            inward: (0..n).map(|r| if open[r] { face[r] < 0.0 } else { volume[r] < 0.0 }).collect(),
            stays: (0..n).map(stays).collect(),
            roots,
            area,
        }
    }

    /// Whether a part stays.
    fn stays(&self, part: u32) -> bool {
        self.stays[self.roots[part as usize].0 as usize]
    }

    /// As in [`Decided::parts`].
    fn decided(&self, part: u32) -> u8 {
        let (root, turned) = self.roots[part as usize];
        if self.stays(part) { u8::from(turned != self.inward[root as usize]) } else { 2 }
    }

    /// How many sets stay, and how many do not.
    fn counts(&self) -> [usize; 2] {
        let sets = (0..self.roots.len()).filter(|&i| self.roots[i].0 as usize == i && self.area[i] > 0.0);
        let (stay, go): (Vec<usize>, Vec<usize>) = sets.partition(|&i| self.stays[i]);
        [stay.len(), go.len()]
    }
}

/// Decides, and writes it.
pub(crate) fn run(plan: &Plan, folder: Folder<'_>, run: &mut Run<'_>, stop: &Stop) -> Result<()> {
    let tiles = plan.tiles.len();
    let mut ends = Ends::read(tiles, folder, stop)?;
    let (mut sets, one_sided) = ends.facing();
    let closed = close(&mut ends, &mut sets, plan.known.spacing, run)?;
    let fate = Fate::new(plan, &ends, &closed, sets);
    let mut decided: Vec<Decided> = (ends.first.windows(2))
        .map(|w| Decided { parts: (w[0]..w[1]).map(|p| fate.decided(p)).collect(), closing: Vec::new() })
        .collect();
    let stays = |tile: u32, part: u32| fate.stays(ends.first[tile as usize] + part);
    for &(tile, places, part) in closed.triangles.iter().filter(|(tile, _, part)| stays(*tile, *part)) {
        decided[tile as usize].closing.push((places, part));
    }
    for (tile, decided) in decided.iter().enumerate() {
        stop.check(SEAMS)?;
        decided.write(folder, tile)?;
    }
    let [parts, dropped_parts] = fate.counts();
    let kept = ends.borders.iter().filter(|(tile, e)| stays(*tile, e.part)).map(|(_, e)| placed(e).0);
    let summary = Summary {
        parts,
        dropped_parts,
        boundary_loops: loops(kept.chain(closed.borders)),
        seam_edges: ends.seam_edges,
        closed_rings: closed.rings,
        closing_triangles: closed.triangles.len(),
        cracks: closed.cracks,
        one_sided,
    };
    store::text(&folder.summary(), &serde_json::to_string_pretty(&summary).unwrap_or_default())
}

/// How many loops these edges make.
fn loops(edges: impl Iterator<Item = [Key; 2]>) -> usize {
    let mut number: FxHashMap<Key, u32> = FxHashMap::default();
    let mut sets = Sets::new(0);
    for ends in edges {
        let [a, b] = ends.map(|k| {
            let next = number.len() as u32;
            *number.entry(k).or_insert_with(|| {
                sets.0.push((next, false));
                next
            })
        });
        sets.join(a, b, false);
    }
    (0..number.len() as u32).filter(|&i| sets.find(i).0 == i).count()
}
