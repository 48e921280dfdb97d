//! Point clouds and meshes in and out of files.
//!
//! In: a path or bytes. Out: [`Loaded`], which holds the points with all their attributes, the triangles if
//! there are any, and a [`LoadReport`] that counts every repair in words. The content decides the format, the
//! file's name only breaks ties. A header's claim never allocates memory before bytes exist to back it.
//! [`save_cloud`] and [`save_mesh`] write beside the output and rename, so that a failed run never touches
//! what was there, and say what the format could not hold; [`check_output`] tells beforehand whether that can
//! work.
//!
//! ```no_run
//! use atlasfit_io::{LoadOptions, SaveMesh, load, save_mesh};
//! # fn main() -> atlasfit_io::Result<()> {
//! let options = LoadOptions::default().with_max_memory_bytes(Some(8 << 30));
//! let loaded = load("scan.e57".as_ref(), &options)?;
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

// Data: what comes in, what goes out.
mod content;
mod error;
mod input;
mod job;
mod layer;
mod report;
mod stopping;

// Tools that the readers and writers share.
mod bad_lines;
mod bytes;
mod faces;
mod foreign;
mod row_layout;
mod text;
mod weld;

// The formats: each imports data and tools only.
mod e57;
mod gltf;
mod las;
mod obj;
mod off;
mod pcd;
mod ply;
mod stl;
mod xyz;

// The doors, above the formats.
mod asset;
mod format;
mod load;
mod rows;
mod save;
mod staged;

pub use asset::{Asset, load_asset};
pub use content::Polygons;
pub use error::{Error, Location, Result};
pub use foreign::panics_become_errors;
pub use format::Format;
pub use job::Texture;
pub use layer::Layer;
pub use load::{LoadOptions, Loaded, load, load_bytes, load_reader};
pub use report::{LoadReport, Note};
pub use rows::{RowBlock, Rows, RowsWriter};
pub use save::{SaveCloud, SaveMesh, Saved, save_cloud, save_mesh, write_cloud, write_mesh};
pub use staged::{check_output, discard_begun, discard_unfinished, is_same_file, write_file, write_with};
