//! Ways along the edges of the surface's polygons.
//!
//! In: a half-edge, `3 * face + slot`. Out: others about it. Edges inside a polygon are none of its edges;
//! where there are no polygons every face is one.

use super::constants::SURFACE;
use super::{NONE, Surface};

/// The half-edge that follows round a face.
fn after(h: u32) -> u32 {
    h - h % 3 + (h + 1) % 3
}

impl Surface {
    /// The half-edge on the other side of one; [`NONE`] at borders.
    pub(crate) fn beyond(&self, h: u32) -> u32 {
        self.twin[h as usize / 3][h as usize % 3]
    }

    /// What a half-edge costs as a seam.
    pub(crate) fn cost_of(&self, h: u32) -> f64 {
        self.cost(h as usize / 3, h as usize % 3)
    }

    /// The edge that follows round the polygon.
    pub(crate) fn next_edge(&self, h: u32) -> u32 {
        let mut h = after(h);
        for _ in 0..SURFACE.most_corners {
            let t = self.beyond(h);
            if t == NONE || self.cell(t / 3) != self.cell(h / 3) {
                break;
            }
            h = after(t);
        }
        h
    }

    /// The four edges of a polygon that has four.
    pub(crate) fn quad(&self, cell: u32) -> Option<[u32; 4]> {
        let [f, _] = *self.cells.as_ref()?.faces(cell) else { return None };
        let inside = |h: u32| self.beyond(h) != NONE && self.cell(self.beyond(h) / 3) == cell;
        let first = (3 * f..3 * f + 3).find(|&h| !inside(h))?;
        let mut edges = [first; 4];
        for k in 1..4 {
            edges[k] = self.next_edge(edges[k - 1]);
        }
        (self.next_edge(edges[3]) == first).then_some(edges)
    }

    /// The edges that leave the end of an edge where four polygons meet: the one that follows it round its
    /// own polygon, the one straight on, the third, and its own other side.
    pub(crate) fn crossing(&self, h: u32) -> Option<[u32; 4]> {
        let mut edges = [NONE; 4];
        let mut at = h;
        for edge in &mut edges {
            *edge = self.next_edge(at);
            at = self.beyond(*edge);
            if at == NONE {
                return None;
            }
        }
        (at == h).then_some(edges)
    }
}
