//! Vertices split where the texture coordinates of their corners differ.
//!
//! In: the triangles of the parts that share a block of vertices, with the texture coordinates of their
//! corners. Out: the vertices in their old order with those of their first corner, and behind them a copy for
//! each further one; the corners that name them.

use std::collections::HashMap;

/// The split vertices of a block.
pub(super) struct Split {
    /// Texture coordinates per vertex, `None` for one without corners; those of the copies come last.
    uv: Vec<Option<[f32; 2]>>,
    /// The vertex that each copy was made of.
    pub copies: Vec<u32>,
    /// The copies by vertex and texture coordinates.
    known: HashMap<(u32, [u32; 2]), u32>,
}

impl Split {
    /// No corner is known yet.
    pub fn new(vertices: usize) -> Self {
        Self { uv: vec![None; vertices], copies: Vec::new(), known: HashMap::new() }
    }

    /// The vertex of a corner, which has been `old` so far, an existing vertex.
    pub fn corner(&mut self, old: u32, uv: [f32; 2]) -> u32 {
        let first = self.uv[old as usize].get_or_insert(uv);
        if first.map(f32::to_bits) == uv.map(f32::to_bits) {
            return old;
        }
        let next = self.uv.len() as u32;
        let vertex = *self.known.entry((old, uv.map(f32::to_bits))).or_insert(next);
        if vertex == next {
            self.uv.push(Some(uv));
            self.copies.push(old);
        }
        vertex
    }

    /// The texture coordinates of all vertices as little-endian floats, v down as glTF has it.
    pub fn uv_bytes(&self) -> Vec<u8> {
        let down = self.uv.iter().map(|uv| uv.map_or([0.0; 2], |[u, v]| [u, 1.0 - v]));
        let mut out = Vec::with_capacity(8 * self.uv.len());
        down.flatten().for_each(|c| out.extend_from_slice(&c.to_le_bytes()));
        out
    }

    /// How many vertices there were.
    pub fn old_vertices(&self) -> usize {
        self.uv.len() - self.copies.len()
    }

    pub fn vertices(&self) -> usize {
        self.uv.len()
    }
}
