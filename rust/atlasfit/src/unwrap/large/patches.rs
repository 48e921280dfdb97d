//! The patches of a surface and the border paths between them.

use crate::unwrap::surface::{NONE, Surface};

/// The patches of a surface and the border paths between them.
pub(crate) struct Patches {
    /// Patch per face; [`NONE`] for unusable faces.
    pub label: Vec<u32>,
    /// Number of patches.
    pub count: usize,
    /// Border path per half-edge slot; [`NONE`] inside patches.
    pub path: Vec<[u32; 3]>,
    /// Number of paths.
    pub paths: usize,
}

impl Patches {
    /// Names the paths between labelled patches.
    pub(crate) fn new(s: &Surface, label: Vec<u32>, count: usize) -> Self {
        let (path, paths) = border_paths(s, &label);
        Self { label, count, path, paths }
    }
}

/// Names the paths of edges between patches: runs of border edges between the same two patches. Returns a
/// path per half-edge slot and the number of paths.
fn border_paths(s: &Surface, label: &[u32]) -> (Vec<[u32; 3]>, usize) {
    let m = s.faces();
    let mut path = vec![[NONE; 3]; m];
    let mut count = 0;
    let border = |f: usize, k: usize| {
        let h = s.twin[f][k];
        h != NONE && label[h as usize / 3] != label[f]
    };
    for f in 0..m {
        for k in 0..3 {
            if label[f] == NONE || !border(f, k) || path[f][k] != NONE {
                continue;
            }
            for forward in [true, false] {
                let (mut g, mut c) = (f, k);
                loop {
                    let h = s.twin[g][c] as usize;
                    path[g][c] = count;
                    path[h / 3][h % 3] = count;
                    // Turn about the path's end on this side to its next border edge; it must have the same
                    // sides.
                    let other = label[h / 3];
                    let (mut x, mut y) = (g, if forward { (c + 1) % 3 } else { (c + 2) % 3 });
                    let next = loop {
                        let e = s.twin[x][y];
                        if e == NONE {
                            break None;
                        }
                        if label[e as usize / 3] != label[g] {
                            break (label[e as usize / 3] == other).then_some((x, y));
                        }
                        let e = e as usize;
                        (x, y) = (e / 3, if forward { (e % 3 + 1) % 3 } else { (e % 3 + 2) % 3 });
                    };
                    match next {
                        Some((x, y))
                            if path[x][y] == NONE
                                && simple(s, label, x, if forward { y } else { (y + 1) % 3 }) =>
                        {
                            (g, c) = (x, y);
                        }
                        _ => break,
                    }
                }
            }
            count += 1;
        }
    }
    (path, count as usize)
}

/// Whether the vertex at corner `k` of face `f` has a closed fan with at most two runs of labels.
pub(super) fn simple(s: &Surface, label: &[u32], f: usize, k: usize) -> bool {
    let (mut g, mut c) = (f, k);
    let mut changes = 0;
    loop {
        let h = s.twin[g][c];
        if h == NONE {
            return false;
        }
        let h = h as usize;
        changes += usize::from(label[h / 3] != label[g]);
        (g, c) = (h / 3, (h % 3 + 1) % 3);
        if g == f {
            return changes <= 2;
        }
    }
}
