//! A surface opened along a loop.
//!
//! In: triangles, a loop of their vertices. Out: the corners that lie right of the loop, which then have
//! vertices of their own.

use rustc_hash::FxHashMap;

/// A corner right of a loop.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Corner {
    /// Its triangle.
    pub face: u32,
    /// Which of the triangle's corners it is.
    pub corner: usize,
    /// The place in the loop of its vertex.
    pub place: u32,
}

/// The corners right of a loop. None where the triangles do not surround each of its vertices, once.
pub(super) fn along(triangles: &[[u32; 3]], around: &[u32]) -> Option<Vec<Corner>> {
    let n = around.len();
    let place: FxHashMap<u32, u32> = around.iter().copied().zip(0..).collect();
    if place.len() != n {
        return None;
    }
    // What comes after the next vertex in the triangle that an edge from one on the loop begins.
    let mut after: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    for &[a, b, c] in triangles {
        for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
            if place.contains_key(&a) && after.insert([a, b], c).is_some() {
                return None;
            }
        }
    }
    // From each edge of the loop to the one before it: what lies between is left.
    let mut left: FxHashMap<[u32; 2], ()> = FxHashMap::default();
    for (k, &v) in around.iter().enumerate() {
        let (mut spoke, before) = (around[(k + 1) % n], around[(k + n - 1) % n]);
        while spoke != before {
            if left.insert([v, spoke], ()).is_some() {
                return None;
            }
            spoke = *after.get(&[v, spoke])?;
        }
    }
    let mut right = Vec::new();
    for (t, face) in triangles.iter().zip(0..) {
        for corner in 0..3 {
            let (v, next) = (t[corner], t[(corner + 1) % 3]);
            let at = place.get(&v).filter(|_| !left.contains_key(&[v, next]));
            right.extend(at.map(|&place| Corner { face, corner, place }));
        }
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three rings of four vertices, one above the other, closed by a vertex at each end.
    fn tube() -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        for k in 0..4 {
            let next = (k + 1) % 4;
            for level in [0, 4] {
                let [a, b, c, d] = [level + k, level + next, level + 4 + next, level + 4 + k];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
            triangles.extend([[next, k, 12], [8 + k, 8 + next, 13]]);
        }
        triangles
    }

    #[test]
    fn all_corners_below_the_middle_of_a_tube_lie_right_of_it() {
        let triangles = tube();
        let right = along(&triangles, &[4, 5, 6, 7]).unwrap();
        let mut opened = triangles.clone();
        right.iter().for_each(|c| opened[c.face as usize][c.corner] = 14 + c.place);
        for (t, o) in triangles.iter().zip(&opened) {
            let below = t.iter().any(|&v| v < 4 || v == 12);
            let wanted = t.map(|v| if below && (4..8).contains(&v) { v + 10 } else { v });
            assert_eq!(*o, wanted);
        }
        // The other way round it is those above.
        assert_eq!(along(&triangles, &[7, 6, 5, 4]).unwrap().len(), right.len());
        assert_eq!(along(&triangles[1..], &[0, 1, 2, 3]), None, "a vertex that is not surrounded");
        assert_eq!(along(&triangles, &[4, 5, 4, 7]), None, "a loop that comes to a vertex twice");
    }
}
