//! Joins vertices that are exactly equal: formats that repeat a vertex per triangle become connected meshes.

use std::collections::HashMap;
use std::hash::Hash;

/// Which entries are equal.
pub(crate) struct Welded {
    /// The vertex of each entry.
    pub ids: Vec<u32>,
    /// The first entry of each vertex.
    pub first: Vec<u32>,
}

/// Makes each distinct key a vertex, numbered in order of first appearance.
pub(crate) fn weld<K: Hash + Eq>(keys: impl Iterator<Item = K>) -> Welded {
    let mut known: HashMap<K, u32> = HashMap::new();
    let (mut ids, mut first) = (Vec::new(), Vec::new());
    for (i, key) in keys.enumerate() {
        let id = *known.entry(key).or_insert_with(|| {
            first.push(i as u32);
            first.len() as u32 - 1
        });
        ids.push(id);
    }
    Welded { ids, first }
}

/// A position as a key: equal positions have equal bits (0 and -0 are equal).
pub(crate) fn bits(p: [f64; 3]) -> [u64; 3] {
    p.map(|c| (c + 0.0).to_bits())
}
