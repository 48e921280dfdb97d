//! Point clouds and meshes in and out of files.
//!
//! In: a path or bytes. Out: [`Loaded`], which holds the points with all their attributes, the triangles if
//! there are any, and a [`LoadReport`] that counts every repair in words. The content decides the format, the
//! file's name only breaks ties. A header's claim never allocates memory before bytes exist to back it.
//! [`save_cloud`] and [`save_mesh`] write beside the output and rename, so that a failed run never touches
//! what was there, and say what the format could not hold.
//!
//! ```no_run
//! use atlasfit_io::{LoadOptions, SaveMesh, load, save_mesh};
//! # fn main() -> atlasfit_io::Result<()> {
//! let loaded = load("scan.e57".as_ref(), &LoadOptions { max_memory_bytes: Some(8 << 30) })?;
//! for note in &loaded.report.notes {
//!     eprintln!("{note}"); // "12 points marked as invalid by the scanner, left out"
//! }
//! let saved = save_mesh("out.glb".as_ref(), &loaded.into_mesh(), &SaveMesh::default())?;
//! for lost in &saved.lost {
//!     eprintln!("not kept: {lost}");
//! }
//! # Ok(())
//! # }
//! ```
//!
//! One file (or folder) per format; [`Format`] names them all.

mod bytes;
mod e57;
mod error;
mod faces;
mod foreign;
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
pub use faces::Polygons;
pub use foreign::panics_become_errors;
pub use format::Format;
pub use load::{LoadOptions, LoadReport, Loaded, Note, load, load_bytes, load_reader};
pub use save::{SaveCloud, SaveMesh, Saved, Texture, save_cloud, save_mesh};
