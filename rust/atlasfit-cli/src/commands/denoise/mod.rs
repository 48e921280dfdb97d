//! `atlasfit denoise`: points in; clean points, a stitched surface and chart UVs out.

#[cfg(feature = "learn")]
mod init;
mod page;
mod report;
mod scans;

use crate::console::{Console, RunArgs, Usage};
use crate::files::{self, InputArgs};
use crate::output::{self, Holds, Output, OutputArgs, Writer, Written};
use crate::values::{position, share};
use anyhow::Result;
use atlasfit::DenoiseOptions;
use atlasfit::bake::{BakeOptions, Colors, bake, side_for};
use atlasfit::geometry::Attribute;
use atlasfit::pipeline::{self, Denoised};
use atlasfit::unwrap::PAGE_TEXELS;
use atlasfit_net::explicit::{Network, NetworkOptions, Recipe};
use atlasfit_net::level_set::LevelSetOptions;
use report::Done;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Options of `denoise`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The scan, or - for standard input: points, or a mesh whose vertices are taken as points. Several files
    /// are one scan in parts, whose points get the attribute "file"
    #[arg(required = true, value_name = "SCAN")]
    scans: Vec<PathBuf>,
    /// The surface to write, or - for standard output; its extension decides the format
    #[arg(short, long, value_name = "OUT", required_unless_present_any = ["points", "tileset"])]
    output: Option<PathBuf>,
    /// The denoised points to write, in input order
    #[arg(long, value_name = "OUT")]
    points: Option<PathBuf>,
    /// Write an HTML page that shows scan, points and surface to turn with the mouse, noise, warnings, times
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// Standard deviation of the scan's noise in its unit, or auto
    #[arg(
        long,
        default_value = "auto",
        value_name = "auto|LENGTH",
        value_parser = auto_length,
        help_heading = "Fit"
    )]
    noise: Auto<f64>,
    /// How strongly to denoise: 1 = as the scan asks for, 2 = smoother, 0 = leave the points where they are
    #[arg(
        long,
        default_value_t = DenoiseOptions::default().strength,
        value_name = "FACTOR",
        value_parser = not_negative,
        help_heading = "Fit"
    )]
    strength: f64,
    /// Fineness of the surface: 1 = what the data supports, 0.5 = half as fine
    #[arg(
        long,
        default_value_t = DenoiseOptions::default().detail,
        value_name = "FACTOR",
        value_parser = positive,
        help_heading = "Fit"
    )]
    detail: f64,
    /// Number of charts, or auto
    #[arg(
        long,
        default_value = "auto",
        value_name = "auto|N",
        value_parser = auto_count,
        help_heading = "Fit"
    )]
    charts: Auto<usize>,
    /// What smooth means
    #[arg(long, value_enum, default_value = "gp", help_heading = "Fit")]
    prior: Prior,
    /// How networks are trained
    #[arg(long, value_enum, default_value = "fast", help_heading = "Fit")]
    recipe: TrainingRecipe,
    /// Begin the networks of --prior mlp at the answer of a model that `learn train` wrote
    #[cfg(feature = "learn")]
    #[arg(long, value_name = "MODEL", help_heading = "Fit")]
    init: Option<PathBuf>,
    /// Fill holes whose boundary is shorter than this, in the scan's unit; 0 fills gaps of the sampling and
    /// places about which the points thin out
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "LENGTH",
        value_parser = not_negative,
        help_heading = "Fit"
    )]
    fill_holes: f64,
    /// Leave out connected parts of the surface that have less than this share of its area, 0 to 1
    #[arg(
        long,
        default_value_t = DenoiseOptions::default().min_part,
        value_name = "SHARE",
        value_parser = share,
        help_heading = "Fit"
    )]
    min_part: f64,
    /// Keep only the largest connected part of the surface, by area
    #[arg(long, help_heading = "Fit")]
    largest: bool,
    /// Triangles that the surface should have at the most: it gets larger ones where it is flat [default:
    /// about as many as the scan has points]
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u64).range(1..),
        conflicts_with = "watertight",
        help_heading = "Fit"
    )]
    faces: Option<u64>,
    /// How far the surface with fewer triangles may be from the one as it is contoured, in the scan's unit;
    /// alone: as few triangles as that allows; 0: all that it is contoured with [default: a quarter of the
    /// noise or a twentieth of the spacing]
    #[arg(
        long,
        value_name = "LENGTH",
        value_parser = not_negative,
        conflicts_with = "watertight",
        help_heading = "Fit"
    )]
    max_error: Option<f64>,
    /// Make the surface that of a solid, for printing: closed, without self-intersections. The vertex
    /// attribute "extrapolated" is 1 where it was invented
    #[arg(long, help_heading = "Fit")]
    watertight: bool,
    /// Side of the texture in texels, for the padding between UV charts and for --bake [default: 1024; with
    /// --bake about four texels per point]
    #[arg(
        long,
        value_name = "TEXELS",
        value_parser = clap::value_parser!(u32).range(texels()),
        help_heading = "Fit"
    )]
    texture_size: Option<u32>,
    /// Write a texture with the scan's colours, which replaces the colours of the vertices
    #[arg(long, help_heading = "Fit", conflicts_with = "no_uv", requires = "output")]
    bake: bool,
    /// Points that belong to no surface, and those of parts that are left out (--min-part, --largest)
    #[arg(long, value_enum, default_value = "keep", help_heading = "Fit")]
    outliers: Outliers,
    /// Where the scanner stood, in the scan's unit: the surface faces it, as wholes where much of it is
    /// hidden from there [default: what the file says by normals, faces or poses; otherwise looked for]
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_parser = position,
        allow_hyphen_values = true,
        help_heading = "Fit"
    )]
    viewpoint: Option<[f64; 3]>,
    /// Lay out no UVs
    #[arg(long, help_heading = "Fit")]
    no_uv: bool,
    /// What the surface is
    #[arg(long, value_enum, default_value = "smooth", help_heading = "Fit")]
    surface: SurfaceKind,
    /// Say how sure the result is: attributes "uncertainty" (standard deviation along the normal, in the
    /// scan's unit), and of points "noise" and "outlier_probability", of vertices "extrapolated"
    #[arg(long, help_heading = "Fit")]
    uncertainty: bool,
    /// Move the sweeps of the scan together first, each by a small turn and shift. NAME is the attribute that
    /// numbers them: scan_id of E57 files, point_source_id of LAS, file where several files are given
    #[arg(long, value_name = "NAME", help_heading = "Fit")]
    sweeps: Option<String>,
    #[command(flatten)]
    tiles: crate::commands::tiles::InTiles,
    #[command(flatten)]
    read: InputArgs,
    #[command(flatten)]
    write: OutputArgs,
    #[command(flatten)]
    run: RunArgs,
}

/// What the surface is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum SurfaceKind {
    /// As the charts have it: open where the data end
    Smooth,
    /// A watertight shell around that, by CGAL, where the program was built with it
    Wrap,
    /// None: only the points are denoised, in about half the time; beside an edge of the part they stay on
    /// its rounded charts
    None,
}

/// What smooth means.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Prior {
    /// A Gaussian process as smooth as the limit of the paper's networks
    Gp,
    /// The paper's fully connected networks, trained on the scan first: many times slower
    Mlp,
    /// The paper's convolutional networks
    Conv,
    /// The paper's level set: closed surfaces only
    LevelSet,
}

/// How networks are trained.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum TrainingRecipe {
    /// From coarse to fine, learning rates that fall
    Fast,
    /// As in the paper: all samples at every step
    Paper,
}

impl Args {
    fn prior(&self) -> atlasfit_net::Prior {
        let recipe = match self.recipe {
            TrainingRecipe::Fast => Recipe::Fast,
            TrainingRecipe::Paper => Recipe::Paper,
        };
        let network = |network| {
            atlasfit_net::Prior::Network(NetworkOptions::default().with_network(network).with_recipe(recipe))
        };
        match self.prior {
            Prior::Gp => atlasfit_net::Prior::Gp,
            Prior::Mlp => network(Network::Dense),
            Prior::Conv => network(Network::Conv),
            Prior::LevelSet => atlasfit_net::Prior::LevelSet(LevelSetOptions::default()),
        }
    }
}

/// Points that belong to no surface.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Outliers {
    /// Leave them where they are, or where the scan has faces put them between their neighbours (those of
    /// parts that are left out are denoised): points stay in input order
    Keep,
    /// Leave them out of the denoised points
    Drop,
}

/// A value, or `None` for auto.
#[derive(Debug, Clone, Copy)]
struct Auto<T>(Option<T>);

fn auto_length(s: &str) -> Result<Auto<f64>, String> {
    if s == "auto" { Ok(Auto(None)) } else { positive(s).map(|x| Auto(Some(x))) }
}

/// What the side of a texture may be.
fn texels() -> RangeInclusive<i64> {
    i64::from(*PAGE_TEXELS.start())..=i64::from(*PAGE_TEXELS.end())
}

fn auto_count(s: &str) -> Result<Auto<usize>, String> {
    match s.parse::<usize>() {
        _ if s == "auto" => Ok(Auto(None)),
        Ok(n) if n > 0 => Ok(Auto(Some(n))),
        _ => Err("give auto or a positive whole number".into()),
    }
}

fn positive(s: &str) -> Result<f64, String> {
    s.parse::<f64>().ok().filter(|x| *x > 0.0 && x.is_finite()).ok_or_else(|| "give a positive number".into())
}

fn not_negative(s: &str) -> Result<f64, String> {
    s.parse::<f64>()
        .ok()
        .filter(|x| *x >= 0.0 && x.is_finite())
        .ok_or_else(|| "give a number, 0 or more".into())
}

impl Args {
    /// What makes the shell, where one is asked for.
    fn cgal(&self) -> Result<Option<&'static dyn atlasfit_native::Cgal>> {
        let wrong = match self.surface {
            SurfaceKind::Smooth => return Ok(None),
            SurfaceKind::None if self.output.is_none() => return Ok(None),
            SurfaceKind::None => "--surface none leaves nothing for --output. Leave one of them out",
            SurfaceKind::Wrap if self.output.is_none() => "--surface wrap needs --output",
            SurfaceKind::Wrap if self.watertight => "--surface wrap is watertight. Leave out --watertight",
            SurfaceKind::Wrap => match atlasfit_native::cgal() {
                Some(cgal) => return Ok(Some(cgal)),
                None => {
                    "this program was built without CGAL. Build it with \
                     `cargo build --release -p atlasfit-cli --features cgal` (it is under the GPL then), \
                     or use --watertight"
                }
            },
        };
        Err(Usage(wrong.into()).into())
    }

    /// The surface to write.
    fn surface(&self) -> Option<Output<'_>> {
        let holds = if self.bake { Holds::Uvs } else { Holds::Faces };
        self.output.as_deref().map(|path| Output { option: "--output", path, holds })
    }

    /// The points to write.
    fn points(&self) -> Option<Output<'_>> {
        self.points.as_deref().map(|path| Output { option: "--points", path, holds: Holds::Points })
    }

    /// The page to write.
    fn page(&self) -> Option<Output<'_>> {
        self.report.as_deref().map(|path| Output { option: "--report", path, holds: Holds::Page })
    }
}

/// Shares of the command's time, for the bar: until the scan is read, until it is denoised, until the texture
/// is baked. Measured on the scans of `bench denoise`.
const UNTIL: [f64; 3] = [0.02, 0.95, 0.98];

/// Denoises. No output is touched unless everything succeeded.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    if args.tiles.asked() {
        return in_tiles(args, console);
    }
    let outputs: Vec<Output<'_>> =
        args.surface().into_iter().chain(args.points()).chain(args.page()).collect();
    let scans: Vec<&Path> = args.scans.iter().map(PathBuf::as_path).collect();
    output::check(&outputs, &scans, args.write, console)?;
    let cgal = args.cgal()?;
    let prior = args.prior();
    let guide = prior.guide();
    #[cfg(feature = "learn")]
    let start = init::start(args.init.as_deref(), &prior)?;
    #[cfg(feature = "learn")]
    let guide = start.as_ref().map(|s| s as &dyn pipeline::Guide).or(guide);
    let started = Instant::now();
    console.part_to(UNTIL[0]);
    let loaded = scans::load(&args.scans, args.read, &args.run, console)?;
    if args.bake && loaded.cloud.colors.is_none() {
        return Err(Usage(format!("{} has no colours to bake", scans::named(&args.scans))).into());
    }
    let options = options(args, loaded.cloud.len());
    console.part_to(UNTIL[1]);
    let mut outcome = {
        let mut run = console.start(&args.run);
        pipeline::denoise_vertices(&loaded.cloud, &loaded.faces, &options, guide, &mut run)?
    };
    if let Some(cgal) = cgal {
        console.start(&args.run).execute(|ctx| atlasfit_native::wrap(&mut outcome, cgal, &options, ctx))?;
    }
    console.check(&args.run, "denoising")?;
    for warning in &outcome.report.warnings {
        console.warn(warning);
    }
    let seconds = || started.elapsed().as_secs_f64();
    let page = if args.report.is_some() {
        let facts = done(args, &outcome, &options, seconds(), &[]).facts();
        let title = page::title(loaded.cloud.len(), &args.scans);
        let mut run = console.start(&args.run);
        Some(run.execute(|ctx| page::page(&loaded.cloud, &outcome, &facts, title, console, ctx))?)
    } else {
        None
    };
    let written = save(&mut outcome, page.as_deref(), options.texture_size, args, console)?;
    let done = done(args, &outcome, &options, seconds(), &written.files);
    console.report(&done.text(), &done.json());
    Ok(())
}

/// What was done, for the report.
fn done<'a>(
    args: &'a Args,
    outcome: &'a Denoised,
    options: &DenoiseOptions,
    seconds: f64,
    files: &'a [String],
) -> Done<'a> {
    Done {
        scans: &args.scans,
        report: &outcome.report,
        surface: &outcome.surface,
        noise_given: args.noise.0.is_some(),
        uv: options.uv,
        unsure: args.uncertainty.then(|| median_uncertainty(outcome)).flatten(),
        seconds,
        files,
    }
}

/// Denoises in tiles.
fn in_tiles(args: &Args, console: &Console) -> Result<()> {
    let asked = [
        ("--charts", args.charts.0.is_some()),
        ("--prior", !matches!(args.prior, Prior::Gp)),
        ("--faces", args.faces.is_some()),
        ("--watertight", args.watertight),
        ("--texture-size", args.texture_size.is_some()),
        ("--outliers drop", matches!(args.outliers, Outliers::Drop)),
        ("--surface", args.surface != SurfaceKind::Smooth),
        ("--uncertainty", args.uncertainty),
        ("--sweeps", args.sweeps.is_some()),
        ("--input-format", args.read.input_format.is_some()),
        ("--report", args.page().is_some()),
        ("--ascii", args.write.ascii),
    ];
    if let Some((option, _)) = asked.iter().find(|(_, asked)| *asked) {
        return Err(Usage(format!("{option} does not go with --tiles: tiles are computed one by one")).into());
    }
    let outputs = crate::commands::tiles::Outputs {
        surface: args.output.as_deref(),
        points: args.points.as_deref(),
        force: args.write.force,
    };
    let options = options(args, 0).with_uv(!args.no_uv);
    args.tiles.denoise(&args.scans, &outputs, &options, &args.run, console)
}

/// The middle one of the points' uncertainties, where they were asked for.
fn median_uncertainty(outcome: &Denoised) -> Option<f64> {
    let column = Attribute::named(&outcome.points.attributes, pipeline::UNCERTAINTY)?;
    let on = outcome.point_chart.iter().zip(&column.values).filter(|(c, _)| **c != u32::MAX);
    Some(atlasfit::numeric::stats::median(&mut on.map(|(_, &sd)| sd).collect::<Vec<_>>()))
}

/// The core's options for a scan of so many points.
fn options(args: &Args, points: usize) -> DenoiseOptions {
    let texture_size = match args.texture_size {
        Some(size) => size,
        None if args.bake => side_for(points),
        None => DenoiseOptions::default().texture_size,
    };
    DenoiseOptions::default()
        .with_noise(args.noise.0)
        .with_strength(args.strength)
        .with_detail(args.detail)
        .with_charts(args.charts.0)
        .with_fill_holes(args.fill_holes)
        .with_min_part(args.min_part)
        .with_largest(args.largest)
        .with_faces(args.faces.map(|n| usize::try_from(n).unwrap_or(usize::MAX)))
        .with_max_error(args.max_error)
        .with_watertight(args.watertight)
        .with_texture_size(texture_size)
        .with_outliers(match args.outliers {
            Outliers::Keep => pipeline::Outliers::Keep,
            Outliers::Drop => pipeline::Outliers::Drop,
        })
        .with_viewpoint(args.viewpoint)
        .with_uv(!args.no_uv && args.output.is_some())
        .with_surface(args.surface != SurfaceKind::None)
        .with_uncertainty(args.uncertainty)
        .with_sweeps(args.sweeps.clone())
}

/// Writes the surface, with a texture where one is asked for, the points, and the page.
fn save(
    outcome: &mut Denoised,
    page: Option<&[u8]>,
    texture_size: u32,
    args: &Args,
    console: &Console,
) -> Result<Written> {
    let mut writer = Writer::new(args.write, &args.run, console);
    let mut png = None;
    if args.bake {
        let options = BakeOptions::default().with_size([texture_size; 2]);
        let (mesh, points) = (&outcome.surface, Colors::Points(&outcome.points));
        console.part_to(UNTIL[2]);
        let image = console.start(&args.run).execute(|ctx| bake(mesh, points, &options, ctx))?;
        // The vertices' colours would tint the texture.
        outcome.surface.colors = None;
        png = Some(files::png_apart(image, &args.run, console)?);
    }
    console.part_to(1.0);
    if let Some(output) = args.surface() {
        writer.mesh(output, &outcome.surface, None, png.as_deref(), |_| false)?;
    }
    if let Some(output) = args.points() {
        writer.cloud(output, &outcome.points)?;
    }
    if let (Some(output), Some(page)) = (args.page(), page) {
        writer.bytes(output, page)?;
    }
    Ok(writer.written)
}
