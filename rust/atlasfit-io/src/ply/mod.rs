//! PLY (Turk 1994): ASCII and both binary encodings.
//!
//! Read: vertices with colours (any number type), normals, texture coordinates and every other scalar
//! property kept as an attribute; faces as lists of polygons, triangle strips, texture coordinates per
//! corner; range grids and other elements are passed over (their points are the vertices). Written: the same,
//! binary unless asked otherwise, positions as `float` where that loses nothing and `double` where it would.

mod body;
mod columns;
mod faces;
mod header;
mod read;
mod rows;
mod vertices;
mod write;

pub(crate) use read::{is_rows, read};
pub(crate) use rows::row_layout;
pub(crate) use write::write;
