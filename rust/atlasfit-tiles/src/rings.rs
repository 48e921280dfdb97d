//! Rings of edges at which a tile ends and that fit no other tile's.
//!
//! In: the edges that fit nothing. Out: rings of them, which triangles close where two tiles have come to
//! different surfaces; and walks that lead nowhere, which stay cracks.

use crate::job::{End, Key, dot, key, sub};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;

/// An edge at which a tile ends.
pub(crate) struct Placed {
    pub tile: u32,
    pub end: End,
}

/// An edge without its direction.
pub(crate) fn ordered([a, b]: [Key; 2]) -> [Key; 2] {
    if a <= b { [a, b] } else { [b, a] }
}

/// An edge by where it is, without its direction, and whether the tile has it in this order.
pub(crate) fn placed(end: &End) -> ([Key; 2], bool) {
    let [a, b] = end.at.map(key);
    if a <= b { ([a, b], true) } else { ([b, a], false) }
}

/// A ring of edges that fit nothing.
pub(crate) struct Ring {
    /// Its places, in order; none where it leads nowhere.
    pub places: Vec<[f64; 3]>,
    /// The same as keys.
    pub corners: Vec<Key>,
    /// From each place to the next: the loose edge, and whether its tile has it in this direction; nothing
    /// where the ends of two borders were joined.
    pub edges: Vec<Option<(usize, bool)>>,
}

/// Rings of loose edges. Borders that two tiles end at different places are joined there, up to `same` apart.
pub(crate) fn rings(loose: &[Placed], same: f64) -> Vec<Ring> {
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
