//! Collections of shapes on disk: a folder with a manifest and shards, made by the generator or from
//! ShapeNet.
//!
//! A shard is a safetensors file of up to [`SHARD`] shapes: `points` (shapes, points, 3) f32 in the
//! normalised frame, `pictures` (shapes, views, side, side, 2) u8, `family` (shapes) u8, `id` (shapes) u64.

mod batches;
mod make;
mod pictures;
mod shapenet;
mod shard;
#[cfg(test)]
mod tests;

pub(crate) use batches::{BRIGHTEST, pixels};
pub use batches::{Batch, Batches};
pub use make::{Generated, generate, seed_of};
pub use pictures::{Painter, prepare};
pub use shapenet::{ShapeNet, convert};
pub use shard::Shard;

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Shapes per shard.
pub const SHARD: usize = 128;
/// The manifest's name.
const MANIFEST: &str = "manifest.json";
/// The layout that this version writes.
const VERSION: u32 = 1;

/// Which shapes are for what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Training.
    Train,
    /// Choosing the best epoch.
    Validate,
    /// Figures.
    Test,
}

impl Split {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Train, Self::Validate, Self::Test];

    /// Its name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Validate => "validate",
            Self::Test => "test",
        }
    }
}

/// What a folder holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Of the layout.
    pub version: u32,
    /// Where the shapes come from: `generator` or `shapenet`.
    pub source: String,
    /// Names of the families, by their numbers.
    pub families: Vec<String>,
    /// The recipe that the shapes were made by.
    pub recipe: crate::recipe::DataRecipe,
    /// Shapes to train, to validate, to test.
    pub shapes: [usize; 3],
}

/// A folder of shapes.
#[derive(Debug, Clone)]
pub struct Dataset {
    /// Where it is.
    pub folder: PathBuf,
    /// What it holds.
    pub manifest: Manifest,
}

impl Dataset {
    /// Opens a folder. All shards must be there.
    ///
    /// # Errors
    /// [`Error::BadFile`] for a folder of another layout or with shards missing.
    pub fn open(folder: &Path) -> Result<Self> {
        let file = folder.join(MANIFEST);
        let text = std::fs::read_to_string(&file).map_err(|e| {
            let advice = "Make the data by `atlasfit learn make-data -o DIR`";
            Error::bad_file(folder, format!("this is no folder of shapes ({MANIFEST}: {e})"), advice)
        })?;
        let bad = |what: String| Error::bad_file(&file, what, "Make the data anew");
        let manifest: Manifest =
            serde_json::from_str(&text).map_err(|e| bad(format!("the manifest cannot be read ({e})")))?;
        if manifest.version != VERSION {
            return Err(bad(format!("the layout is version {}, not {VERSION}", manifest.version)));
        }
        let data = Self { folder: folder.to_owned(), manifest };
        for split in Split::ALL {
            for shard in 0..data.shards(split) {
                let path = data.shard(split, shard);
                if !path.is_file() {
                    return Err(bad(format!("{} is missing", path.display())));
                }
            }
        }
        Ok(data)
    }

    /// Shapes of a split.
    #[must_use]
    pub fn len(&self, split: Split) -> usize {
        self.manifest.shapes[split as usize]
    }

    /// Shards of a split.
    #[must_use]
    pub fn shards(&self, split: Split) -> usize {
        self.len(split).div_ceil(SHARD)
    }

    fn shard(&self, split: Split, index: usize) -> PathBuf {
        shard_file(&self.folder, split, index)
    }

    /// Reads a shard.
    ///
    /// # Errors
    /// [`Error::BadFile`] for bytes that are no shard of this manifest.
    pub fn read(&self, split: Split, index: usize) -> Result<Shard> {
        Shard::read(&self.shard(split, index), &self.manifest.recipe)
    }

    /// Reads all shapes of a split.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_all(&self, split: Split) -> Result<Shard> {
        let mut all = Shard::new(&self.manifest.recipe);
        for i in 0..self.shards(split) {
            all.append(self.read(split, i)?);
        }
        Ok(all)
    }
}

fn shard_file(folder: &Path, split: Split, index: usize) -> PathBuf {
    folder.join(format!("{}-{index:04}.safetensors", split.name()))
}

/// Writes the manifest: last, so that a folder without it is known to be unfinished.
fn write_manifest(folder: &Path, manifest: &Manifest, stop: &atlasfit::Stop) -> Result<()> {
    let text = serde_json::to_string_pretty(manifest).map_err(|e| {
        Error::bad_file(folder, format!("the manifest cannot be written ({e})"), "Report this")
    })?;
    Ok(atlasfit_io::write_file(&folder.join(MANIFEST), text.as_bytes(), stop)?)
}

/// Makes the folder of a collection.
fn make_folder(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder)
        .map_err(|e| Error::bad_file(folder, format!("the folder cannot be made ({e})"), "Name another one"))
}
