//! One chart: faces with their own vertex numbering and planar positions.

use super::surface::{NONE, Surface};

/// A connected piece of the surface, flattened. Units: the surface has area 1.
#[derive(Clone, Default)]
pub(super) struct Chart {
    /// Faces of the surface.
    pub faces: Vec<u32>,
    /// Chart-local vertices per face.
    pub tris: Vec<[u32; 3]>,
    /// Planar position per chart-local vertex.
    pub uv: Vec<[f64; 2]>,
    /// Edges not glued inside the chart: (index into `faces`, slot). Surface borders are among them.
    pub border: Vec<(u32, u8)>,
    /// Area on the surface.
    pub area: f64,
    /// Area whose stretch is beyond the bound.
    pub over: f64,
}

impl Chart {
    /// Number of chart-local vertices.
    pub(super) fn vertices(&self) -> usize {
        self.uv.len()
    }

    /// Builds the local mesh of `faces`, gluing every edge between two of them. `index_of[f]` must hold each
    /// face's place in `faces` and `owner[f] == id` exactly for them. Positions start at zero.
    pub(super) fn glue_all(s: &Surface, faces: Vec<u32>, owner: &[u32], id: u32, index_of: &[u32]) -> Self {
        let mut corner = vec![NONE; faces.len() * 3];
        let mut n = 0;
        let inside = |h: u32| h != NONE && owner[h as usize / 3] == id;
        for i in 0..faces.len() {
            for k in 0..3 {
                if corner[3 * i + k] != NONE {
                    continue;
                }
                // Turn round the vertex through glued edges, both ways, naming every corner met.
                corner[3 * i + k] = n;
                let (mut f, mut c) = (i, k);
                loop {
                    let h = s.mate[faces[f] as usize][c];
                    if !inside(h) {
                        break;
                    }
                    // The mate runs backwards: its end is our vertex.
                    (f, c) = (index_of[h as usize / 3] as usize, (h as usize % 3 + 1) % 3);
                    if corner[3 * f + c] != NONE {
                        break;
                    }
                    corner[3 * f + c] = n;
                }
                let (mut f, mut c) = (i, k);
                loop {
                    let h = s.mate[faces[f] as usize][(c + 2) % 3];
                    if !inside(h) {
                        break;
                    }
                    (f, c) = (index_of[h as usize / 3] as usize, h as usize % 3);
                    if corner[3 * f + c] != NONE {
                        break;
                    }
                    corner[3 * f + c] = n;
                }
                n += 1;
            }
        }
        let tris = corner.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        let mut border = Vec::new();
        for (i, &f) in faces.iter().enumerate() {
            for k in 0..3 {
                if !inside(s.mate[f as usize][k]) {
                    border.push((i as u32, k as u8));
                }
            }
        }
        let area = faces.iter().map(|&f| s.area[f as usize]).sum();
        Self { faces, tris, uv: vec![[0.0; 2]; n as usize], border, area, over: 0.0 }
    }

    /// Rest triangles of the faces.
    pub(super) fn rest(&self, s: &Surface) -> Vec<[f64; 3]> {
        self.faces.iter().map(|&f| s.rest[f as usize]).collect()
    }
}
