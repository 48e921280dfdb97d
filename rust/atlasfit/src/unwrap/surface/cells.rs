//! Faces grouped into the polygons that they are cut from.

use super::twins::NONE;

/// Faces grouped into the polygons they are cut from.
pub(crate) struct Cells {
    /// Cell per face.
    pub of_face: Vec<u32>,
    /// Faces of cell c: `faces[start[c]..start[c + 1]]`, ascending.
    start: Vec<u32>,
    faces: Vec<u32>,
}

impl Cells {
    /// Connected runs of equal `polygon`.
    pub(crate) fn new(polygon: &[u32], twin: &[[u32; 3]]) -> Self {
        let m = polygon.len();
        let mut of_face = vec![NONE; m];
        let (mut start, mut faces) = (vec![0u32], Vec::with_capacity(m));
        for f in 0..m {
            if of_face[f] != NONE {
                continue;
            }
            let (from, cell) = (faces.len(), start.len() as u32 - 1);
            of_face[f] = cell;
            faces.push(f as u32);
            let mut next = from;
            while next < faces.len() {
                for &h in &twin[faces[next] as usize] {
                    if h != NONE && of_face[h as usize / 3] == NONE && polygon[h as usize / 3] == polygon[f] {
                        of_face[h as usize / 3] = cell;
                        faces.push(h / 3);
                    }
                }
                next += 1;
            }
            faces[from..].sort_unstable();
            start.push(faces.len() as u32);
        }
        Self { of_face, start, faces }
    }

    /// Number of cells.
    pub(crate) fn count(&self) -> usize {
        self.start.len() - 1
    }

    /// The faces of a cell.
    pub(crate) fn faces(&self, cell: u32) -> &[u32] {
        &self.faces[self.start[cell as usize] as usize..self.start[cell as usize + 1] as usize]
    }
}
