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
use crate::job::{End, Key, Seam, Sums, dot, key, sub};
use crate::plan::Plan;
use crate::store;
use atlasfit::Run;
use atlasfit::pipeline::tile::close_ring;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Ends of borders that two tiles put to different places are one up to this distance, in spacings.
const SAME_END: f64 = 4.0;

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

/// An edge of a tile, by where it is: its ends' keys, and whether the tile has them in this order.
struct Placed {
    tile: u32,
    end: End,
}

fn placed(end: &End) -> ([Key; 2], bool) {
    let [a, b] = end.at.map(key);
    if a <= b { ([a, b], true) } else { ([b, a], false) }
}

/// Decides, and writes it.
pub(crate) fn run(plan: &Plan, folder: Folder<'_>, run: &mut Run<'_>) -> Result<()> {
    let tiles = plan.tiles.len();
    let mut first = vec![0u32];
    let mut sums: Vec<Sums> = Vec::new();
    let mut edges: FxHashMap<[Key; 2], Vec<Placed>> = FxHashMap::default();
    let mut borders: Vec<(u32, End)> = Vec::new();
    let mut seam_edges = 0;
    for tile in 0..tiles {
        let seam = Seam::read(folder, tile)?;
        sums.extend(&seam.parts);
        first.push(sums.len() as u32);
        for end in seam.cut {
            edges.entry(placed(&end).0).or_default().push(Placed { tile: tile as u32, end });
        }
        borders.extend(seam.border.into_iter().map(|e| (tile as u32, e)));
    }
    let node = |tile: u32, part: u32| first[tile as usize] + part;
    // Agreement between parts, in edges; what fits nothing.
    let mut agree: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    let mut loose: Vec<Placed> = Vec::new();
    for (_, of) in edges {
        match &of[..] {
            [a, b] => {
                seam_edges += 1;
                let [x, y] = [a, b].map(|e| node(e.tile, e.end.part));
                let alike = placed(&a.end).1 != placed(&b.end).1;
                *agree.entry([x.min(y), x.max(y)]).or_default() += if alike { 1.0 } else { -1.0 };
            }
            _ => loose.extend(of),
        }
    }
    let order = |e: &Placed| (e.tile, e.end.at.map(key));
    loose.sort_unstable_by_key(order);
    let mut strongest: Vec<([u32; 2], f64)> = agree.into_iter().collect();
    strongest.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()).then(a.0.cmp(&b.0)));
    let mut sets = Sets::new(sums.len());
    let mut one_sided = false;
    for ([a, b], sum) in strongest {
        let ((x, s), (y, t)) = (sets.find(a), sets.find(b));
        if x == y {
            one_sided |= (s ^ t) != (sum < 0.0);
        } else {
            sets.join(a, b, sum < 0.0);
        }
    }
    // Rings.
    let spacing = plan.known.spacing;
    let mut rings = rings(&loose, SAME_END * spacing);
    let mut decided: Vec<Decided> = (0..tiles)
        .map(|t| Decided { parts: vec![0; (first[t + 1] - first[t]) as usize], closing: Vec::new() })
        .collect();
    let mut summary = Summary { seam_edges, one_sided, ..Summary::default() };
    let mut new_borders: Vec<[Key; 2]> = Vec::new();
    let mut open_parts: Vec<u32> = Vec::new();
    for ring in &mut rings {
        let Some(&(lead, forward)) = ring.edges.iter().flatten().next() else { continue };
        let lead = &loose[lead];
        // An edge between two ends of a border is border itself.
        if ring.corners.len() == 2 && ring.edges.contains(&None) {
            new_borders.push([ring.corners[0], ring.corners[1]]);
            continue;
        }
        // The closing triangles run against the tile's own edge.
        if forward {
            ring.places.reverse();
        }
        let closed = run.execute(|ctx| close_ring(&ring.places, ctx))?;
        let of = node(lead.tile, lead.end.part);
        for &(e, _) in ring.edges.iter().flatten() {
            let other = node(loose[e].tile, loose[e].end.part);
            // A part that is held by nothing else faces as the ring says.
            let along = ring.edges.iter().flatten().find(|x| x.0 == e).is_some_and(|x| x.1);
            sets.join(of, other, along != forward);
        }
        match closed {
            Some(triangles) => {
                summary.closed_rings += 1;
                summary.closing_triangles += triangles.len();
                let closing = triangles.iter().map(|t| (t.map(|v| ring.places[v as usize]), lead.end.part));
                decided[lead.tile as usize].closing.extend(closing);
                let n = ring.edges.len();
                for k in (0..n).filter(|&k| ring.edges[k].is_none()) {
                    let (a, b) = (ring.corners[k], ring.corners[(k + 1) % n]);
                    new_borders.push([a, b]);
                }
            }
            None => {
                summary.cracks += ring.edges.iter().flatten().count();
                open_parts.push(of);
            }
        }
    }
    // What hangs together.
    let n = sums.len();
    let roots: Vec<(u32, bool)> = (0..n as u32).map(|i| sets.find(i)).collect();
    let mut open = vec![false; n];
    borders.iter().for_each(|(t, e)| open[roots[node(*t, e.part) as usize].0 as usize] = true);
    open_parts.iter().for_each(|&p| open[roots[p as usize].0 as usize] = true);
    let (mut area, mut volume, mut face) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    for (i, s) in sums.iter().enumerate() {
        let (root, turned) = roots[i];
        let sign = if turned { -1.0 } else { 1.0 };
        area[root as usize] += s.area;
        volume[root as usize] += sign * s.volume;
        face[root as usize] += sign * s.area;
    }
    let whole: f64 = area.iter().sum();
    let largest = (0..n).max_by(|&a, &b| area[a].total_cmp(&area[b]).then(b.cmp(&a)));
    let stays = |root: usize| {
        area[root] >= plan.options.min_part * whole && (!plan.options.largest || Some(root) == largest)
    };
    for (tile, decided) in decided.iter_mut().enumerate() {
        for (k, part) in decided.parts.iter_mut().enumerate() {
            let (root, turned) = roots[first[tile] as usize + k];
            let root = root as usize;
            let inward = if open[root] { face[root] < 0.0 } else { volume[root] < 0.0 };
            *part = if stays(root) { u8::from(turned != inward) } else { 2 };
        }
        let parts = &decided.parts;
        decided.closing.retain(|c| parts[c.1 as usize] != 2);
    }
    let is_part = |root: &usize| roots[*root].0 as usize == *root && area[*root] > 0.0;
    summary.parts = (0..n).filter(|r| is_part(r) && stays(*r)).count();
    summary.dropped_parts = (0..n).filter(|r| is_part(r) && !stays(*r)).count();
    let kept = |t: u32, p: u32| stays(roots[node(t, p) as usize].0 as usize);
    let edges = borders.iter().filter(|(t, e)| kept(*t, e.part)).map(|(_, e)| placed(e).0);
    summary.boundary_loops = loops(edges.chain(new_borders));
    for (tile, decided) in decided.iter().enumerate() {
        decided.write(folder, tile)?;
    }
    let text = serde_json::to_string_pretty(&summary).unwrap_or_default();
    store::text(&folder.summary(), &text)
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

/// A ring of edges that fit nothing.
struct Ring {
    /// Its places, in order; none where it leads nowhere.
    places: Vec<[f64; 3]>,
    /// The same as keys.
    corners: Vec<Key>,
    /// From each place to the next: the loose edge, and whether its tile has it in this direction; nothing
    /// where the ends of two borders were joined.
    edges: Vec<Option<(usize, bool)>>,
}

/// Rings of loose edges. Borders that two tiles end at different places are joined there, up to `same` apart.
fn rings(loose: &[Placed], same: f64) -> Vec<Ring> {
    // The edges at each place, with the place at their other end.
    let mut at: BTreeMap<Key, Vec<(Option<usize>, Key)>> = BTreeMap::new();
    let mut place: FxHashMap<Key, [f64; 3]> = FxHashMap::default();
    for (i, e) in loose.iter().enumerate() {
        let [a, b] = e.end.at.map(key);
        at.entry(a).or_default().push((Some(i), b));
        at.entry(b).or_default().push((Some(i), a));
        place.extend([a, b].into_iter().zip(e.end.at));
    }
    let odd: Vec<Key> = at.iter().filter(|(_, of)| of.len() % 2 == 1).map(|(k, _)| *k).collect();
    let mut near: Vec<(f64, Key, Key)> = Vec::new();
    for (i, a) in odd.iter().enumerate() {
        for b in &odd[..i] {
            let d = sub(place[a], place[b]);
            let d = dot(d, d).sqrt();
            if d <= same {
                near.push((d, *a, *b));
            }
        }
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| (a.1, a.2).cmp(&(b.1, b.2))));
    let mut joined = std::collections::BTreeSet::new();
    for (_, a, b) in near {
        if !joined.contains(&a) && !joined.contains(&b) {
            joined.extend([a, b]);
            at.entry(a).or_default().push((None, b));
            at.entry(b).or_default().push((None, a));
        }
    }
    let mut found = Vec::new();
    let starts: Vec<Key> = at.keys().copied().collect();
    for start in starts {
        while at.get(&start).is_some_and(|of| !of.is_empty()) {
            // A walk that comes back to a place that it was at closes a ring there.
            let (mut corners, mut edges) = (vec![start], Vec::new());
            while let Some((edge, next)) = at.get_mut(&corners[corners.len() - 1]).and_then(Vec::pop) {
                let here = corners[corners.len() - 1];
                if let Some(of) = at.get_mut(&next)
                    && let Some(back) = of.iter().position(|e| *e == (edge, here))
                {
                    of.remove(back);
                }
                edges.push(edge.map(|e| (e, key(loose[e].end.at[0]) == here)));
                if let Some(from) = corners.iter().position(|c| *c == next) {
                    let ring: Vec<Key> = corners.drain(from..).collect();
                    let places = ring.iter().map(|k| place[k]).collect();
                    found.push(Ring { places, corners: ring, edges: edges.drain(from..).collect() });
                    corners.push(next);
                } else {
                    corners.push(next);
                }
            }
            // What is left leads nowhere: a crack.
            if !edges.is_empty() {
                found.push(Ring { places: Vec::new(), corners, edges });
            }
        }
    }
    found
}
