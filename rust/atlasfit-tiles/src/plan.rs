//! The plan: what there is, how it is cut, and the tasks that lead to the result.
//!
//! Plain data, as `plan.json` has them. A task is one command; its inputs, outputs and the tasks that come
//! before it stand in the plan, for any engine to run.

use crate::cut::Tree;
use crate::error::{Error, Result};
use crate::folder::Folder;
use atlasfit::DenoiseOptions;
use atlasfit::pipeline::survey::Survey;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A file of the scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// The file.
    pub file: PathBuf,
    /// Its bytes.
    pub bytes: u64,
    /// When it was changed, in nanoseconds since 1970.
    pub changed: u64,
    /// Its points.
    pub points: u64,
    /// The denoised points' file.
    pub denoised: Option<PathBuf>,
}

/// A tile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tile {
    /// Its own points.
    pub own: u64,
    /// Those and the ones about it that it is computed with.
    pub with_halo: u64,
    /// The files that its own points are of.
    pub files: Vec<u32>,
}

/// How to denoise, as the plan says it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the names are those of DenoiseOptions")]
pub struct Options {
    pub noise: Option<f64>,
    pub strength: f64,
    pub detail: f64,
    pub fill_holes: f64,
    pub min_part: f64,
    pub largest: bool,
    pub max_error: Option<f64>,
    pub viewpoint: Option<[f64; 3]>,
    pub uv: bool,
    pub seed: u64,
}

impl Options {
    /// As the core takes them.
    #[must_use]
    pub fn of_core(&self) -> DenoiseOptions {
        DenoiseOptions::default()
            .with_noise(self.noise)
            .with_strength(self.strength)
            .with_detail(self.detail)
            .with_fill_holes(self.fill_holes)
            .with_max_error(self.max_error)
            .with_viewpoint(self.viewpoint)
    }
}

/// A task: one command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// Its name.
    pub name: String,
    /// Arguments of the program.
    pub command: Vec<String>,
    /// What it reads.
    pub inputs: Vec<PathBuf>,
    /// What it writes.
    pub outputs: Vec<PathBuf>,
    /// The tasks that must be done before.
    pub after: Vec<String>,
    /// Points that it works on: what its time and memory grow with.
    pub points: u64,
    /// Bytes of memory that it needs.
    pub memory: u64,
}

/// The plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Which plans these are: 2.
    pub version: u32,
    /// The scan.
    pub scans: Vec<Scan>,
    /// How to denoise.
    pub options: Options,
    /// What is known of the whole scan.
    pub known: Survey,
    /// Width of what a tile is computed with about it, in the scan's unit.
    pub halo: f64,
    /// Points with a coordinate that is not finite.
    pub not_finite: u64,
    /// Whether the scan has colours.
    pub colors: bool,
    /// How space is cut.
    pub tree: Tree,
    /// The tiles.
    pub tiles: Vec<Tile>,
    /// Points of a tile at the most, as far as space can be cut so.
    pub tile_points: u64,
    /// Folder of the denoised points.
    pub points: Option<PathBuf>,
    /// The surface as one file.
    pub surface: Option<PathBuf>,
    /// The surface in tiles.
    pub tileset: Option<PathBuf>,
    /// What the user should know.
    pub notes: Vec<String>,
    /// The tasks, each after those that must be done before.
    pub tasks: Vec<Task>,
}

impl Plan {
    /// Reads a work folder's plan.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be read; [`Error::Refused`] where there is none, or one of another
    /// version.
    pub fn read(folder: &Path) -> Result<Self> {
        let file = Folder(folder).plan();
        if !file.exists() {
            let what = format!("{}: there is no plan", file.display());
            return Err(Error::refused(what, "Give the work folder of `atlasfit tiles plan`"));
        }
        let text = std::fs::read_to_string(&file).map_err(|e| Error::io(&file, "read it", e))?;
        let plan: Self = serde_json::from_str(&text)
            .map_err(|e| Error::refused(format!("{}: {e}", file.display()), "Make the plan again"))?;
        if plan.version != VERSION {
            let what = format!("{}: a plan of version {}", file.display(), plan.version);
            return Err(Error::refused(what, "Make the plan again with this program"));
        }
        Ok(plan)
    }

    /// Fails where a file of the scan is not what it was.
    ///
    /// # Errors
    /// [`Error`].
    pub fn check_scans(&self) -> Result<()> {
        self.scans.iter().try_for_each(Scan::check)
    }
}

/// Which plans this program makes and reads.
pub(crate) const VERSION: u32 = 2;

impl Scan {
    /// The file as it is now, with so many points.
    pub(crate) fn of(file: &Path, points: u64) -> Result<Self> {
        let file = absolute(file)?;
        let about = std::fs::metadata(&file).map_err(|e| Error::io(&file, "read it", e))?;
        let changed = (about.modified().ok())
            .and_then(|t| t.duration_since(std::time::UNIX_EPOCH).ok())
            .map_or(0, |d| d.as_nanos() as u64);
        Ok(Self { bytes: about.len(), changed, points, denoised: None, file })
    }

    /// Fails where the file is not what it was.
    pub(crate) fn check(&self) -> Result<()> {
        let now = Self::of(&self.file, self.points)?;
        if (now.bytes, now.changed) != (self.bytes, self.changed) {
            return Err(Error::refused(
                format!("{}: the file was changed since the plan was made", self.file.display()),
                "Make the plan again, in an empty folder",
            ));
        }
        Ok(())
    }
}

/// A path that means the same from every folder.
pub(crate) fn absolute(path: &Path) -> Result<PathBuf> {
    std::path::absolute(path).map_err(|e| Error::io(path, "find it", e))
}
