//! OFF with its prefixes for texture coordinates, colours and normals (Geomview): OFF, COFF, NOFF, STOFF and
//! their combinations, text only.
//!
//! Read: vertices with what the keyword promises, and colours that it does not; polygons. Colours of faces
//! are left out. Written: OFF, COFF, NOFF or CNOFF.

mod read;
mod write;

pub(crate) use read::{is_off, read};
pub(crate) use write::write;
