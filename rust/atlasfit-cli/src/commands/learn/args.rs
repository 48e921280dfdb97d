//! The command lines of `learn`.

use crate::console::RunArgs;
use crate::files::InputArgs;
use crate::output::OutputArgs;
use std::path::PathBuf;

/// Which recipe.
#[derive(Debug, Clone, clap::Args)]
pub struct RecipeArgs {
    /// quick, quick-conv, atlasnet, convatlas, or a TOML file
    #[arg(long, default_value = "quick", value_name = "NAME|FILE")]
    pub recipe: String,
}

/// What computes.
#[derive(Debug, Clone, clap::Args)]
pub struct DeviceArgs {
    /// What computes; cuda and metal where the program was built with that feature
    #[arg(long, default_value = "cpu", value_parser = ["cpu", "cuda", "metal"], help_heading = "Run")]
    pub device: String,
}

/// Options of `learn make-data`.
#[derive(Debug, clap::Args)]
pub struct MakeData {
    /// Folder of the collection
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    #[command(flatten)]
    pub recipe: RecipeArgs,
    /// ShapeNet's folder of categories, in place of made-up shapes
    #[arg(long, value_name = "DIR")]
    pub shapenet: Option<PathBuf>,
    /// AtlasNet's folder ShapeNetRendering; without it we draw
    #[arg(long, value_name = "DIR", requires = "shapenet")]
    pub renderings: Option<PathBuf>,
    /// ShapeNet's all.csv; without it the first 8 of 10 models train
    #[arg(long, value_name = "CSV", requires = "shapenet")]
    pub split: Option<PathBuf>,
    #[command(flatten)]
    pub run: RunArgs,
}

/// Options of `learn train`.
#[derive(Debug, clap::Args)]
pub struct Train {
    /// Folder of the model: checkpoints, log, curves, and the data where none are given
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    #[command(flatten)]
    pub recipe: RecipeArgs,
    /// A collection that `learn make-data` made
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// Go on from the folder's last checkpoint
    #[arg(long)]
    pub resume: bool,
    #[command(flatten)]
    pub device: DeviceArgs,
    #[command(flatten)]
    pub run: RunArgs,
}

/// Options of `learn eval`.
#[derive(Debug, clap::Args)]
pub struct Eval {
    /// Models
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<PathBuf>,
    /// A collection that `learn make-data` made
    #[arg(long, value_name = "DIR")]
    pub data: PathBuf,
    /// Samples of each answer, about
    #[arg(long, default_value_t = 4096, value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u32).range(16..=200_000))]
    pub samples: u32,
    /// Pairs of shapes of each family whose correspondences are measured
    #[arg(long, default_value_t = 20, value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=10_000))]
    pub pairs: u32,
    #[command(flatten)]
    pub device: DeviceArgs,
    #[command(flatten)]
    pub run: RunArgs,
}

/// Options of `learn reconstruct`.
#[derive(Debug, clap::Args)]
pub struct Reconstruct {
    /// A picture (PNG or JPEG) of one object on a plain or transparent background, or a scan of one with y up
    /// and its front at +z
    pub input: PathBuf,
    /// The mesh to write; its extension decides the format
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// The model; without it, the small one that comes with the program
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// Samples of the charts that the surface is made of, about
    #[arg(long, default_value_t = 12_000, value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u32).range(500..=500_000))]
    pub samples: u32,
    /// Write the charts as they are, each a grid with its square as UVs, instead of one surface
    #[arg(long)]
    pub charts: bool,
    #[command(flatten)]
    pub read: InputArgs,
    #[command(flatten)]
    pub write: OutputArgs,
    #[command(flatten)]
    pub device: DeviceArgs,
    #[command(flatten)]
    pub run: RunArgs,
}

/// Options of `learn correspond`.
#[derive(Debug, clap::Args)]
pub struct Correspond {
    /// Two pictures or scans
    #[arg(num_args = 2, required = true, value_name = "A B")]
    pub inputs: Vec<PathBuf>,
    /// The picture (PNG) of both answers in the colours of the first one
    #[arg(short, long, value_name = "PNG")]
    pub output: PathBuf,
    /// The model; without it, the small one that comes with the program
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// front, back, left, right, top, bottom, or AZIMUTH,ELEVATION in degrees
    #[arg(long, default_value = "30,20", allow_hyphen_values = true)]
    pub view: crate::render::camera::View,
    #[command(flatten)]
    pub read: InputArgs,
    #[command(flatten)]
    pub device: DeviceArgs,
    #[command(flatten)]
    pub run: RunArgs,
}
