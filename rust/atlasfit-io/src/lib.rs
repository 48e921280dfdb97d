//! Point clouds and meshes in and out of files.
//!
//! In: a path or bytes. Out: [`Loaded`], which holds the points with all their attributes, the triangles if
//! there are any, and a [`LoadReport`] that counts every repair in words. The content decides the format, the
//! file's name only breaks ties. A header's claim never allocates memory before bytes exist to back it.
//! [`save_cloud`] and [`save_mesh`] write beside the output and rename, so that a failed run never touches
//! what was there, and say what the format could not hold.
//!
//! One file (or folder) per format; [`Format`] names them all.

mod bytes;
mod e57;
mod error;
mod faces;
mod format;
mod gltf;
mod las;
mod load;
mod obj;
mod off;
mod pcd;
mod ply;
mod save;
mod stl;
mod text;
mod weld;
mod xyz;

pub use error::{Error, Place, Result};
pub use format::Format;
pub use load::{LoadOptions, LoadReport, Loaded, Note, load, load_bytes, load_reader};
pub use save::{SaveCloud, SaveMesh, Saved, Texture, save_cloud, save_mesh};
