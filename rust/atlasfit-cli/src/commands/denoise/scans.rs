//! The scans that are denoised: one file, or several that are one scan in parts.
//!
//! In: paths. Out: the points of all of them, and the triangles.

use crate::console::{Console, RunArgs};
use crate::files::{self, InputArgs};
use anyhow::Result;
use atlasfit::geometry::PointCloud;
use atlasfit::geometry::join::join;
use std::path::{Path, PathBuf};

/// What the files hold.
pub struct Scans {
    /// The points; those of several files with the attribute "file".
    pub cloud: PointCloud,
    /// Triangles between them, where they are a mesh's vertices.
    pub faces: Vec<[u32; 3]>,
}

/// Reads all files.
pub fn load(paths: &[PathBuf], read: InputArgs, run: &RunArgs, console: &Console) -> Result<Scans> {
    let (mut clouds, mut faces, mut before) = (Vec::new(), Vec::new(), 0u32);
    for path in paths {
        let mut loaded = files::load_as(path, read.input_format, run, console)?;
        loaded.normals_from_faces();
        faces.extend(loaded.faces.iter().map(|f| f.map(|v| v + before)));
        before = before.saturating_add(u32::try_from(loaded.cloud.len()).unwrap_or(u32::MAX));
        clouds.push(loaded.cloud);
    }
    if clouds.len() == 1 {
        return Ok(Scans { cloud: clouds.remove(0), faces });
    }
    let (cloud, left_out) = join(clouds);
    if !left_out.is_empty() {
        console.note(format_args!("left out, since not all files have it alike: {}", left_out.join(", ")));
    }
    Ok(Scans { cloud, faces })
}

/// The files, as text.
pub fn named(paths: &[PathBuf]) -> String {
    let first = paths.first().map_or(Path::new(""), PathBuf::as_path).display();
    match paths.len() {
        0 | 1 => first.to_string(),
        n => format!("{first} and {} more", n - 1),
    }
}
