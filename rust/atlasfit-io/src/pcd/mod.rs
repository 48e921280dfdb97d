//! PCD, the Point Cloud Library's format, version 0.7: ascii, binary, binary_compressed.
//!
//! Positions, normals, packed colours (`rgb`, `rgba`) and every other field as an attribute. Points of
//! organised clouds without a measurement are NaN in the file and stay so. The position of VIEWPOINT is the
//! scanner's; points are not moved by it (nor does PCL).

mod columns;
mod header;
mod lzf;
mod read;

pub(crate) use header::is_pcd;
pub(crate) use read::{is_rows, read};
