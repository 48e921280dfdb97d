//! Joins vertices that are exactly equal: formats that repeat a vertex per triangle become connected meshes.

use std::collections::HashMap;
use std::hash::Hash;

/// Gives each distinct key a number in order of first appearance. Returns the number of every entry and the
/// entry that each number came from.
pub fn weld<K: Hash + Eq>(keys: impl Iterator<Item = K>) -> (Vec<u32>, Vec<u32>) {
    let mut seen: HashMap<K, u32> = HashMap::new();
    let mut ids = Vec::new();
    let mut first = Vec::new();
    for (i, key) in keys.enumerate() {
        let id = *seen.entry(key).or_insert_with(|| {
            first.push(i as u32);
            first.len() as u32 - 1
        });
        ids.push(id);
    }
    (ids, first)
}

/// A position as a key: equal positions have equal bits (0 and -0 are equal).
pub fn bits(p: [f64; 3]) -> [u64; 3] {
    p.map(|c| (c + 0.0).to_bits())
}
