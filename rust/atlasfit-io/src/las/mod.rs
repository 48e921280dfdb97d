//! LAS 1.0 to 1.4 and LAZ (ASPRS LAS specification R15; LAZ through the `laz` crate, feature `laz`).
//!
//! Positions are the file's integers times scale plus offset, in f64. Colour (16 bit, or 8 bit where a
//! program wrote that), intensity, classification, returns, GPS time, source, user data, scan angle and the
//! extra bytes that the file describes are kept where they are not all zero.

mod header;
#[cfg(feature = "laz")]
mod laz;
mod points;
mod read;
mod rows;

pub(crate) use header::is_las;
pub(crate) use read::{is_rows, read};
#[cfg(feature = "laz")]
pub(crate) use rows::{Packer, Unpacker, fixed_chunks, packer, unpacker};
pub(crate) use rows::{finish, row_layout, start_of_points};
