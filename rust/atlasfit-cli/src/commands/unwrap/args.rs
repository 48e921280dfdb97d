//! The options of `unwrap`.

use crate::console::RunArgs;
use crate::files::InputArgs;
use crate::output::{Holds, Output, OutputArgs};
use crate::values::{direction, share};
use atlasfit::unwrap::{PAGE_TEXELS, Preset, UnwrapOptions};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::path::{Path, PathBuf};

/// The names of presets, each with what it stands for.
fn presets() -> impl TypedValueParser<Value = Preset> {
    let values = Preset::ALL.map(|p| {
        let what = match p {
            Preset::FewSeams => "few charts and short seams, also for meshes of few faces",
            Preset::Balanced => "between both",
            Preset::LowStretch => "lengths are kept best; most charts",
        };
        PossibleValue::new(p.name()).help(format!("{what}: a stretch of {}", p.max_stretch()))
    });
    PossibleValuesParser::new(values).map(|name| Preset::from_name(&name).unwrap_or_default())
}

/// Options of `unwrap`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The mesh, or - for standard input
    pub mesh: PathBuf,
    /// The mesh to write, with its UVs, or - for standard output; its extension decides the format
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Write an HTML page that shows checker, charts, stretch and UV layout to turn with the mouse
    #[arg(long, value_name = "HTML")]
    pub report: Option<PathBuf>,
    /// What matters most: a name for a bound on the stretch
    #[arg(
        long,
        default_value = Preset::default().name(),
        value_name = "NAME",
        value_parser = presets(),
        help_heading = "Charts"
    )]
    pub preset: Preset,
    /// Bound on the stretch of 95% of the area: 1.1 = lengths within about 10%. Larger gives fewer charts
    /// [default: that of the preset]
    #[arg(long, value_name = "FACTOR", help_heading = "Charts")]
    pub max_stretch: Option<f64>,
    /// Bound on the mean symmetric Dirichlet energy instead of the stretch, above 4: each part in one chart,
    /// cut open as little as that allows. 4.1 is usual
    #[arg(
        long,
        value_name = "ENERGY",
        help_heading = "Charts",
        conflicts_with_all = ["max_stretch", "preset"]
    )]
    pub max_energy: Option<f64>,
    /// Most charts: those that only the page's shape asks for go first, then the stretch bound is raised as
    /// far as that needs
    #[arg(long, value_name = "N", help_heading = "Charts")]
    pub max_charts: Option<usize>,
    /// Lay strips, tubes, rims and straight sides along the page's sides, as far as the bound on the stretch
    /// allows
    #[arg(long, value_enum, default_value = "off", help_heading = "Charts")]
    pub straighten: Straighten,
    /// How much seams are to lie where the outside hardly sees them: 0 = as short as can be, up to 1
    #[arg(
        long,
        default_value_t = UnwrapOptions::default().seams_hidden,
        value_name = "SHARE",
        value_parser = share,
        help_heading = "Charts"
    )]
    pub seams_hidden: f64,
    /// The direction up: nobody looks from below (with --seams-hidden) [default: they look from all around]
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_parser = direction,
        allow_hyphen_values = true,
        requires = "seams_hidden",
        help_heading = "Charts"
    )]
    pub up: Option<[f64; 3]>,
    /// Vertex attribute that says what seams cost there per unit of length: 1 as usual, less where seams may
    /// be, more where not
    #[arg(long, value_name = "ATTRIBUTE", help_heading = "Charts")]
    pub seam_price: Option<String>,
    /// Keep the seams of the UVs that the mesh has
    #[arg(long, help_heading = "Charts")]
    pub keep_uv_seams: bool,
    /// Cut where faces meet at more than this angle
    #[arg(long, value_name = "DEGREES", help_heading = "Charts")]
    pub hard_edges: Option<f64>,
    /// Text file with one whole number per face of the mesh: no chart spans two
    #[arg(long, value_name = "FILE", help_heading = "Charts")]
    pub groups: Option<PathBuf>,
    /// Text file with two vertex numbers per line, counted from 0: these edges become seams
    #[arg(long, value_name = "FILE", help_heading = "Charts")]
    pub seams: Option<PathBuf>,
    /// Page size in texels [default: 1024; with the mesh's own texture what keeps its density, up to 8192]
    #[arg(long, value_name = "SIZE|WxH", value_parser = size, help_heading = "Pages")]
    pub texture_size: Option<[u32; 2]>,
    /// Keep the charts of the UVs that the mesh has: move, turn, scale and pack them only
    #[arg(
        long,
        help_heading = "Pages",
        conflicts_with_all = ["max_stretch", "max_energy", "max_charts", "preset"]
    )]
    pub pack_only: bool,
    /// Free texels between charts and at the border [default: 2; with the mesh's own texture 24]
    #[arg(long, value_name = "TEXELS", help_heading = "Pages")]
    pub padding: Option<u32>,
    /// Texels per unit of length on the mesh; where it is not given, what fills the pages
    #[arg(long, value_name = "TEXELS", help_heading = "Pages")]
    pub density: Option<f64>,
    /// Most pages; with several, page p lies at u + p (UDIM tiles 1001, 1002, ...)
    #[arg(long, value_name = "N", help_heading = "Pages")]
    pub pages: Option<u32>,
    /// How charts are put on the page
    #[arg(long, value_enum, default_value = "shapes", help_heading = "Pages")]
    pub packer: Packer,
    /// Lay parts of one shape on each other, corner on corner: they share their texels
    #[arg(
        long,
        value_enum,
        default_value = "none",
        help_heading = "Pages",
        conflicts_with_all = ["pack_only", "bake"]
    )]
    pub stack: Stack,
    /// Write a texture with the colours of the mesh's vertices, which it then replaces
    #[arg(long, help_heading = "Texture", conflicts_with_all = ["pages", "bake_from"])]
    pub bake: bool,
    /// Write a texture with these colours: "auto" = the textures that the mesh has, drawn anew for the new
    /// UVs; an image for the mesh's UVs; a scan that lies on the mesh; "none" [default: auto]
    #[arg(long, value_name = "TEXTURE|SCAN|auto|none", help_heading = "Texture")]
    pub bake_from: Option<PathBuf>,
    /// Go on where the output cannot keep what the mesh's file holds: materials, animations, ...
    #[arg(long, help_heading = "Files")]
    pub allow_loss: bool,
    #[command(flatten)]
    pub read: InputArgs,
    #[command(flatten)]
    pub write: OutputArgs,
    #[command(flatten)]
    pub run: RunArgs,
}

/// How charts are put on the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Packer {
    /// By their shapes, in each other's bays and holes
    Shapes,
    /// By their bounding boxes, in rows: fastest
    Boxes,
    /// By xatlas, on square pages, where the program was built with it
    Xatlas,
}

/// Which parts share their texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Stack {
    /// Each part has its own
    None,
    /// Parts that are moved and turned copies of each other
    Identical,
    /// These and mirror images
    Mirrored,
}

/// Whether charts are laid straight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Straighten {
    /// What a person would straighten
    Auto,
    /// Nothing
    Off,
}

fn size(s: &str) -> Result<[u32; 2], String> {
    let side = |t: &str| t.parse::<u32>().ok().filter(|n| PAGE_TEXELS.contains(n));
    match s.split_once('x') {
        None => side(s).map(|n| [n, n]),
        Some((w, h)) => side(w).zip(side(h)).map(|(w, h)| [w, h]),
    }
    .ok_or_else(|| {
        let (least, most) = PAGE_TEXELS.into_inner();
        format!("give SIZE or WIDTHxHEIGHT in texels, each from {least} to {most}")
    })
}

/// What `pack` makes of an option: it packs only, and does not show those that make charts.
pub fn packing(option: clap::Arg) -> clap::Arg {
    match option.get_id().as_str() {
        "pack_only" => option.default_value("true").hide(true),
        "preset" | "max_stretch" | "max_energy" | "max_charts" | "keep_uv_seams" | "stack" | "straighten"
        | "seams_hidden" | "up" | "seam_price" => option.hide(true),
        _ => option,
    }
}

impl Args {
    pub fn output(&self) -> Output<'_> {
        Output { option: "--output", path: &self.output, holds: Holds::Uvs }
    }

    /// The page to write.
    pub fn page(&self) -> Option<Output<'_>> {
        self.report.as_deref().map(|path| Output { option: "--report", path, holds: Holds::Page })
    }

    /// Every file that is read.
    pub fn inputs(&self) -> Vec<&Path> {
        let others = [self.baked_file(), self.groups.as_deref(), self.seams.as_deref()];
        [Some(&*self.mesh)].into_iter().chain(others).flatten().collect()
    }

    /// The file whose colours are baked, where one is named.
    pub fn baked_file(&self) -> Option<&Path> {
        let named = |p: &&Path| *p != Path::new("auto") && *p != Path::new("none");
        self.bake_from.as_deref().filter(named)
    }
}
