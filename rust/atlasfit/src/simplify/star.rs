//! Which of many things belong to each of some others: the triangles about each vertex, the points of each
//! triangle.
//!
//! In: pairs. Out: for each owner the list of its own, ascending.

/// Lists one after another.
#[derive(Default)]
pub(super) struct Lists {
    start: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// Sorts items, `0..`, by their owners; an item may have several, as `owners` says.
    pub(super) fn new<const N: usize>(count: usize, owners: &[[u32; N]]) -> Self {
        let mut start = vec![0u32; count + 1];
        owners.iter().flatten().for_each(|&o| start[o as usize + 1] += 1);
        for k in 0..count {
            start[k + 1] += start[k];
        }
        let mut next = start.clone();
        let mut items = vec![0; N * owners.len()];
        for (item, of) in (0..).zip(owners) {
            for &o in of {
                items[next[o as usize] as usize] = item;
                next[o as usize] += 1;
            }
        }
        Self { start, items }
    }
    /// The items of an owner.
    pub(super) fn of(&self, owner: u32) -> &[u32] {
        &self.items[self.start[owner as usize] as usize..self.start[owner as usize + 1] as usize]
    }
}
