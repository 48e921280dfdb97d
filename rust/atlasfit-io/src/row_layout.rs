//! Where positions and colours stand in rows of bytes: what files of points that are read block by block share.
//!
//! In: rows as a file has them. Out: positions and colours.

use crate::bytes::{ColumnLayout, column};

/// Where things stand in a file of rows.
pub(crate) struct RowLayout {
    /// Where the rows begin: a byte offset.
    pub start: u64,
    /// Rows.
    pub count: u64,
    /// Bytes of a row.
    pub stride: usize,
    /// The coordinates: number times scale plus offset.
    pub axes: [ColumnLayout; 3],
    pub scale: [f64; 3],
    pub offset: [f64; 3],
    /// Red, green and blue, and the value that stands for full.
    pub colors: Option<([ColumnLayout; 3], f64)>,
    /// What the file says of its coordinate system, as it stands there; nothing where it says nothing.
    pub crs: Option<Vec<u8>>,
    /// How rows are packed; none where they are not.
    pub packing: Option<Vec<u8>>,
}

impl RowLayout {
    /// Positions and colours of the rows.
    pub fn read(&self, n: usize, bytes: &[u8], positions: &mut Vec<[f64; 3]>, colors: &mut Vec<[u16; 3]>) {
        positions.resize(n, [0.0; 3]);
        for (k, &axis) in self.axes.iter().enumerate() {
            let (scale, offset) = (self.scale[k], self.offset[k]);
            column(bytes, axis, |i, v| positions[i][k] = v * scale + offset);
        }
        if let Some((layouts, full)) = &self.colors {
            colors.resize(n, [0; 3]);
            for (k, layout) in layouts.iter().enumerate() {
                column(bytes, *layout, |i, v| colors[i][k] = (v / full * 65535.0).clamp(0.0, 65535.0) as u16);
            }
        }
    }
}
