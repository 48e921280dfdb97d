//! Columns of numbers as text: XYZ, TXT, CSV, PTS, ASC.
//!
//! Read: the separator (blank, comma, semicolon, bar), decimal commas, header and comment lines, and the
//! count line of PTS are detected. Columns get their meaning from a header line if there is one, or else from
//! their values: three whole numbers up to 255 are a colour, three that make unit vectors a normal. Written:
//! `x y z`, then normals, colours and attributes, named in a first line where a reader could not guess them.

mod columns;
mod layout;
mod read;
mod write;

pub(crate) use read::read;
pub(crate) use write::write;
