//! `atlasfit bench paper`: the tables and pictures of *Deep Manifold Prior*, its figures beside ours and the default prior's.
//!
//! Every cell is one fit; its figures go to results.jsonl in the output folder as soon as they are known, and a later run takes them from there.
//! Shapes come from `tests/peers/shapes.py`, RIMLS and screened Poisson from `tests/peers/meshlab.py`; `--quick` makes its own shapes and leaves these
//! two out.

use super::{STYLE, cancelled, meshlab, python};
use crate::commands::render::write_png;
use crate::console::{Console, RunArgs};
use crate::files;
use crate::render::camera::View;
use crate::render::{Mode, Style, chart_color, render};
use anyhow::{Context as _, Result, bail};
use atlasfit::geometry::{PointCloud, TriMesh};
use atlasfit::measure::{self, sample};
use atlasfit::numeric::rng::Rng;
use atlasfit::numeric::vec3::{self, Vec3};
use atlasfit::spatial::spacing::{Sampling, spacing};
use atlasfit::{Context, DenoiseOptions};
use atlasfit_net::explicit::{self, Dim, Network, NetworkAtlas, NetworkOptions, Recipe, Trainer};
use atlasfit_net::level_set::{self, LevelSetOptions};
use atlasfit_net::loss::{Chamfer, Sample};
use atlasfit_net::{net, trim};
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Options of `bench paper`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the report, the pictures, and the results of each fit; fits that are there already are not done again
    #[arg(short, long, default_value = "bench-paper", value_name = "DIR")]
    output: PathBuf,
    /// Made-up shapes, few points, few steps: for tests
    #[arg(long)]
    quick: bool,
    /// How networks are trained
    #[arg(long, value_enum, default_value = "fast")]
    recipe: Training,
    /// Steps of the paper's recipe, at most; with --speed, of the reference
    #[arg(long, default_value_t = NetworkOptions::default().iterations, value_name = "N")]
    steps: usize,
    /// Weight of the stretch term where there is one, beside Chamfer distances that are sums, as the paper writes them. Where they are means, as in
    /// much code, a weight of 1 is one of about 30,000 here
    #[arg(long, default_value_t = NetworkOptions::default().stretch_weight, value_name = "LAMBDA")]
    stretch: f64,
    /// Shapes
    #[arg(long, value_delimiter = ',', default_value = "bunny,dragon,car,cup,mobius,chair,spiral,ring")]
    shapes: Vec<String>,
    /// Experiments: any of table1, table2, conv, interpolation, lambda, dots
    #[arg(long, value_delimiter = ',', default_value = "table1,conv,lambda,dots,interpolation,table2")]
    only: Vec<String>,
    /// The Python that has numpy, and pymeshlab for RIMLS and screened Poisson
    #[arg(long, default_value = "python3", value_name = "PROGRAM")]
    python: PathBuf,
    /// Instead of the tables: on the first shape, the time of a step of the paper's recipe beside that of this script in PyTorch (SHAPE SIGMA
    /// STEPS), and the fast recipe's time beside what the script needs for its Chamfer distance
    #[arg(long, value_name = "SCRIPT")]
    speed: Option<PathBuf>,
    /// The folder of shapes.py and meshlab.py
    #[arg(long, default_value = "tests/peers", value_name = "DIR")]
    scripts: PathBuf,
    #[command(flatten)]
    run: RunArgs,
}

/// How networks are trained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Training {
    /// From coarse to fine
    Fast,
    /// As in the paper
    Paper,
}

/// The paper's noise, and its points per scan and per evaluation.
const SIGMA: f64 = 0.002;
const COUNT: usize = 16_000;
/// Points of the interpolation experiment.
const FEW: usize = 1000;
/// Triangles farther than this many point spacings from the scan are trimmed.
const TRIM: f64 = 2.5;
/// Up to what the paper's 1 would be if its Chamfer distances were means.
const LAMBDAS: [f64; 6] = [0.0, 1.0, 100.0, 1000.0, 10_000.0, 30_000.0];
/// The two peers of table 1, as settings of meshlab.py: the paper says 30 neighbours for the normals of RIMLS, 20 for screened Poisson of depth 7.
const PEERS: [(&str, &str); 2] = [("rimls", "rimls"), ("spsr", "7,20,4")];
/// Columns of our table 1: title, cell, and which of the cell's figures is the seconds of the fit. The first are the paper's, in its order.
const METHODS: [(&str, &str, &str); 7] = [
    ("Surface", "S8R", "seconds"),
    ("Contour", "C8R", "seconds"),
    ("Implicit", "implicit", "seconds"),
    ("RIMLS", "rimls", "fit_seconds"),
    ("SPSR", "spsr", "fit_seconds"),
    ("Conv", "conv", "seconds"),
    ("default prior", "default", "fit_seconds"),
];

/// Table 1 of the paper: Surface (S8R), Contour (C8R), Implicit, RIMLS, SPSR.
const TABLE1: [(&str, [f64; 5]); 8] = [
    ("bunny", [2.71e-4, 6.64e-4, 5.52e-4, 1.43e-3, 3.96e-4]),
    ("dragon", [4.18e-4, 6.12e-4, 1.20e-3, 1.65e-3, 1.46e-2]),
    ("car", [2.73e-4, 4.57e-4, 6.83e-2, 1.50e-3, 2.10e-3]),
    ("cup", [2.59e-4, 5.80e-4, 2.64e-2, 1.74e-3, 1.00e-2]),
    ("mobius", [3.51e-4, 4.95e-4, 3.26e-3, 1.96e-3, 1.89e-2]),
    ("chair", [3.95e-4, 4.22e-4, 7.32e-3, 2.09e-3, 2.58e-2]),
    ("spiral", [1.05e-3, 7.31e-4, 1.64e-2, 2.98e-3, 7.90e-2]),
    ("ring", [5.69e-4, 5.54e-4, 4.81e-2, 2.46e-3, 3.76e-2]),
];
/// Table 2 of the paper: averages over the shapes.
const TABLE2: [(&str, f64); 8] = [
    ("S1R", 4.48e-3),
    ("S8R", 4.48e-4),
    ("S1", 2.75e-3),
    ("S8", 1.35e-3),
    ("C1R", 1.08e-3),
    ("C8R", 5.77e-4),
    ("C1", 1.00e-3),
    ("C8", 5.82e-4),
];
/// The supplement's average of the convolutional prior.
const CONV: f64 = 4.58e-4;

/// A true surface and its noisy scan.
struct Shape {
    truth: TriMesh,
    scan: Vec<Vec3>,
}

/// The bench at work.
struct Bench<'a> {
    args: &'a Args,
    console: &'a Console,
    done: Map<String, Value>,
    failed: Vec<String>,
}

/// Runs the experiments and writes report.md, report.csv and the pictures.
pub fn run(args: &Args, console: &Console) -> Result<()> {
    const EXPERIMENTS: [&str; 6] = ["table1", "table2", "conv", "interpolation", "lambda", "dots"];
    if let Some(unknown) = args.only.iter().find(|o| !EXPERIMENTS.contains(&o.as_str())) {
        return Err(crate::console::Usage(format!(
            "no experiment {unknown}. Give any of {}",
            EXPERIMENTS.join(", ")
        ))
        .into());
    }
    std::fs::create_dir_all(&args.output)
        .with_context(|| format!("cannot make {}", args.output.display()))?;
    let mut bench = Bench { args, console, done: Map::new(), failed: Vec::new() };
    if let Some(reference) = &args.speed {
        return bench.speed(reference);
    }
    bench.read()?;
    let has = |what: &str| args.only.iter().any(|o| o == what);
    let shapes: Vec<String> =
        if args.quick { vec!["sphere".into(), "ring".into()] } else { args.shapes.clone() };
    if has("table1") {
        for name in &shapes {
            let shape = bench.shape(name)?;
            for variant in ["S8R", "C8R"] {
                bench.explicit(name, &shape, variant)?;
            }
            bench.default_prior(name, &shape)?;
            if !bench.args.quick {
                bench.peers(name, &shape)?;
            }
        }
    }
    if has("lambda") {
        bench.lambda()?;
    }
    if has("dots") {
        bench.dots()?;
    }
    if has("interpolation") {
        for name in shapes.iter().take(2) {
            bench.interpolation(name)?;
        }
    }
    if has("table2") {
        for name in &shapes {
            let shape = bench.shape(name)?;
            for (variant, _) in TABLE2 {
                bench.explicit(name, &shape, variant)?;
            }
        }
    }
    // The slowest last: a run that is stopped has the rest.
    for name in &shapes {
        let shape = bench.shape(name)?;
        if has("table1") {
            bench.implicit(name, &shape)?;
        }
        if has("conv") {
            bench.explicit(name, &shape, "conv")?;
        }
    }
    let report = bench.report(&shapes);
    std::fs::write(args.output.join("report.md"), &report)?;
    std::fs::write(args.output.join("report.csv"), bench.csv())?;
    console.report(&report, &json!({ "results": bench.done, "failed": bench.failed }));
    if bench.failed.is_empty() { Ok(()) } else { bail!("{} fits failed", bench.failed.len()) }
}

impl Bench<'_> {
    fn read(&mut self) -> Result<()> {
        let path = self.args.output.join("results.jsonl");
        let Ok(content) = std::fs::read_to_string(&path) else { return Ok(()) };
        for line in content.lines() {
            // The last line of a run that was killed may be cut: that fit is done again.
            let Ok(v) = serde_json::from_str::<Value>(line) else { continue };
            let Some(key) = v["key"].as_str() else {
                bail!("{} is no file of results. Remove it", path.display())
            };
            self.done.insert(key.to_owned(), v["figures"].clone());
        }
        Ok(())
    }

    /// A cell's name in the results: those of another size or recipe are other cells.
    fn full_key(&self, key: &str) -> String {
        let size = if self.args.quick { "quick" } else { "full" };
        let stretch = self.args.stretch;
        let weight = if stretch == NetworkOptions::default().stretch_weight {
            String::new()
        } else {
            format!(" stretch {stretch}")
        };
        match self.args.recipe {
            Training::Fast => format!("{key} {size} fast{weight}"),
            Training::Paper => format!("{key} {size} paper {}{weight}", self.args.steps),
        }
    }

    /// Runs work that may fail in more ways than the core.
    fn run<T: Send>(&self, work: impl FnOnce(&Context<'_>) -> Result<T> + Send) -> Result<T> {
        self.console.start_silent(&self.args.run).execute(|ctx| Ok(work(ctx)))?
    }

    /// Does a fit unless its figures are known. One fit that fails must not cost the others.
    fn cell(&mut self, key: &str, work: impl FnOnce(&Context<'_>) -> Result<Value> + Send) -> Result<()> {
        let key = self.full_key(key);
        if self.done.contains_key(&key) {
            return Ok(());
        }
        let started = Instant::now();
        match self.run(work) {
            Ok(mut figures) => {
                figures["seconds"] = json!(started.elapsed().as_secs_f64());
                self.console.note(format_args!("{key}: {figures}"));
                let line = json!({ "key": key, "figures": figures });
                std::fs::OpenOptions::new()
                    .create(true)
                    .append(true)
                    .open(self.args.output.join("results.jsonl"))
                    .and_then(|mut f| writeln!(f, "{line}"))
                    .context("cannot write results.jsonl")?;
                self.done.insert(key, figures);
                Ok(())
            }
            Err(e) if cancelled(&e) => Err(e),
            Err(e) => {
                self.console.note(format_args!("failed: {key}: {e:#}"));
                self.failed.push(format!("{key}: {e:#}"));
                Ok(())
            }
        }
    }

    /// A figure of a cell, where it is known.
    fn figure(&self, key: &str, figure: &str) -> Option<f64> {
        self.done.get(&self.full_key(key))?[figure].as_f64()
    }

    fn count(&self) -> usize {
        if self.args.quick { 1500 } else { COUNT }
    }

    fn shape(&self, name: &str) -> Result<Shape> {
        if self.args.quick {
            return self.made(name);
        }
        let folder = self.args.output.join("shapes");
        std::fs::create_dir_all(&folder)?;
        let [truth, noisy] = [folder.join(format!("{name}.ply")), folder.join(format!("{name}-noisy.ply"))];
        if !noisy.exists() {
            let script = self.args.scripts.join("shapes.py");
            python(&self.args.python, &script, &[&name, &SIGMA.to_string(), &truth, &noisy])?;
        }
        let load = |path| files::load(path, &self.args.run, self.console);
        Ok(Shape {
            truth: load(&truth)?.into_mesh(),
            scan: vec3::of(&load(&noisy)?.cloud.positions).to_vec(),
        })
    }

    /// A ring for what is thin, a sphere for all else.
    fn made(&self, name: &str) -> Result<Shape> {
        let truth =
            if matches!(name, "ring" | "spiral") { torus(0.5 - 0.5 * 0.03, 0.5 * 0.03) } else { sphere(0.5) };
        let count = self.count();
        let scan = self.run(|ctx| {
            let mut rng = Rng::stream(ctx.seed, 7);
            let clean = sample::uniform(&truth, count, ctx.seed, ctx)?;
            Ok(clean.iter().map(|s| s.point.map(|x| x + SIGMA * rng.normal())).collect())
        })?;
        Ok(Shape { truth, scan })
    }

    /// A name of the paper's Table 2, or conv.
    fn options(&self, variant: &str) -> NetworkOptions {
        NetworkOptions {
            network: if variant == "conv" { Network::Conv } else { Network::Dense },
            charts: if variant.contains('1') { 1 } else { 8 },
            dim: if variant.starts_with('C') { Dim::Contour } else { Dim::Surface },
            stretch_weight: if variant.ends_with('R') || variant == "conv" { self.args.stretch } else { 0.0 },
            recipe: if self.args.recipe == Training::Paper || self.args.quick {
                Recipe::Paper
            } else {
                Recipe::Fast
            },
            iterations: if self.args.quick { 3 } else { self.args.steps },
            ..NetworkOptions::default()
        }
    }

    fn explicit(&mut self, name: &str, shape: &Shape, variant: &str) -> Result<()> {
        let (how, args) = (self.options(variant), self.args);
        let picture = format!("{name}-{variant}");
        self.cell(&format!("{variant} {name}"), |ctx| drawn_fit(args, &picture, shape, &how, ctx))
    }

    fn implicit(&mut self, name: &str, shape: &Shape) -> Result<()> {
        let args = self.args;
        let mut how = LevelSetOptions { epsilon: Some(level_set::EPSILON), ..LevelSetOptions::default() };
        if args.quick {
            (how.iterations, how.resolution) = (3, 24);
        }
        self.cell(&format!("implicit {name}"), |ctx| {
            let mesh = level_set::fit(&shape.scan, SIGMA, &how, ctx)?;
            draw_mesh(args, &format!("{name}-implicit"), &mesh, Mode::Shaded, ctx)?;
            let trimmed = trimmed(&mesh, &shape.scan, ctx)?;
            Ok(json!({ "cd": surface_cd(&mesh, shape, ctx)?, "trimmed": trimmed_cd(&trimmed, shape, ctx)? }))
        })
    }

    fn default_prior(&mut self, name: &str, shape: &Shape) -> Result<()> {
        let (args, console) = (self.args, self.console);
        // The main job starts a run of its own.
        let key = format!("default {name}");
        if self.figure(&key, "cd").is_some() {
            return Ok(());
        }
        let cloud = PointCloud::from_positions(vec3::plain(shape.scan.clone()));
        let how = DenoiseOptions::default().with_uv(false);
        let started = Instant::now();
        let outcome = atlasfit::denoise(&cloud, &how, &mut console.start_silent(&args.run));
        let seconds = started.elapsed().as_secs_f64();
        self.cell(&key, |ctx| {
            let mesh = outcome?.surface;
            draw_mesh(args, &format!("{name}-default"), &mesh, Mode::Shaded, ctx)?;
            Ok(json!({ "cd": surface_cd(&mesh, shape, ctx)?, "fit_seconds": seconds }))
        })
    }

    /// RIMLS and screened Poisson. Where pymeshlab is missing, their columns stay empty.
    fn peers(&mut self, name: &str, shape: &Shape) -> Result<()> {
        let (args, console) = (self.args, self.console);
        let folder = args.output.join("shapes");
        let scan = folder.join(format!("{name}-noisy.ply"));
        for (peer, setting) in PEERS {
            let key = format!("{peer} {name}");
            if self.figure(&key, "cd").is_some() {
                continue;
            }
            let load = |file: &Path| Ok(files::load(file, &args.run, console)?.into_mesh());
            let made = meshlab(&args.python, &args.scripts, &scan, &folder, 1, &[&setting.to_owned()], &load);
            let (mesh, seconds) = match made.map(|m| m.into_iter().next()) {
                Ok(Some((_, mesh, seconds))) => (mesh, seconds),
                Ok(None) => bail!("meshlab.py said nothing of {setting}"),
                Err(e) => {
                    console.note(format_args!("left out: {key}: {e:#}"));
                    continue;
                }
            };
            self.cell(&key, |ctx| {
                draw_mesh(args, &format!("{name}-{peer}"), &mesh, Mode::Shaded, ctx)?;
                Ok(json!({ "cd": surface_cd(&mesh, shape, ctx)?, "fit_seconds": seconds }))
            })?;
        }
        Ok(())
    }

    /// 1,000 of the points without noise, one chart, with and without stretch.
    fn interpolation(&mut self, name: &str) -> Result<()> {
        let truth = self.shape(name)?.truth;
        let args = self.args;
        for variant in ["S1R", "S1"] {
            let how = self.options(variant);
            self.cell(&format!("interpolation {variant} {name}"), |ctx| {
                let scan: Vec<Vec3> =
                    sample::uniform(&truth, FEW, ctx.seed ^ 5, ctx)?.iter().map(|s| s.point).collect();
                let shape = Shape { truth: truth.clone(), scan };
                drawn_fit(args, &format!("{name}-interpolation-{variant}"), &shape, &how, ctx)
            })?;
        }
        Ok(())
    }

    /// A sphere with 8 charts: what the stretch's weight does to overlap and distortion.
    fn lambda(&mut self) -> Result<()> {
        let shape = self.made("sphere")?;
        let args = self.args;
        for lambda in LAMBDAS {
            let how = NetworkOptions { stretch_weight: lambda, ..self.options("S8R") };
            self.cell(&format!("lambda {lambda}"), |ctx| {
                drawn_fit(args, &format!("sphere-lambda-{lambda}"), &shape, &how, ctx)
            })?;
        }
        Ok(())
    }

    /// A dotted drawing: a curve through the dots, beside a convolutional network that is fitted to the picture (the deep image prior's idea).
    fn dots(&mut self) -> Result<()> {
        let args = self.args;
        let how = NetworkOptions { flat: true, ..self.options("C1R") };
        self.cell("dots", |ctx| {
            let line: Vec<Vec3> = (0..2000).map(|i| heart(f64::from(i) / 2000.0)).collect();
            let dots: Vec<Vec3> = line.iter().copied().step_by(50).collect();
            // Each dot is a little disc of pixels, as in a drawing.
            let mut rng = Rng::stream(ctx.seed, 9);
            let scan: Vec<Vec3> = dots
                .iter()
                .flat_map(|d| {
                    (0..12)
                        .map(|_| Vec3([d[0] + 0.004 * rng.normal(), d[1] + 0.004 * rng.normal(), 0.0]))
                        .collect::<Vec<_>>()
                })
                .collect();
            let atlas = explicit::fit(&scan, &how, ctx)?;
            let gap = |curve: &[Vec3]| -> f64 {
                let far =
                    |p: &Vec3| curve.iter().map(|q| (*p).dist2(*q)).fold(f64::INFINITY, f64::min).sqrt();
                line.iter().map(far).sum::<f64>() / line.len() as f64
            };
            let ink = image_prior(&dots, if args.quick { 3 } else { 300 }, ctx)?;
            draw_points(args, "dots-given", &scan, ctx)?;
            draw_points(args, "dots-curve", &atlas.samples, ctx)?;
            draw_points(args, "dots-image-prior", &ink, ctx)?;
            Ok(json!({
                "curve": gap(&atlas.samples), "dots": gap(&dots),
                "image": if ink.is_empty() { f64::NAN } else { gap(&ink) },
            }))
        })
    }

    /// Full steps (8 charts of 4,096 samples) of ours before and after the reference's, so that other load falls on both; then the fast recipe.
    fn speed(&self, reference: &Path) -> Result<()> {
        let name = self.args.shapes.first().map_or("bunny", String::as_str);
        let shape = self.shape(name)?;
        let before = self.step_seconds(&shape)?;
        let (sigma, steps) = (SIGMA.to_string(), self.args.steps.to_string());
        let said = python(&self.args.python, reference, &[&name, &sigma, &steps])?;
        // A line of JSON now and then, and one of the surface's figures.
        let lines: Vec<Value> = said.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
        let last = |key: &str| lines.iter().rev().find_map(|l| l[key].as_f64());
        let (Some(theirs), Some(seconds), Some(chamfer)) =
            (last("per_iteration"), last("seconds"), last("chamfer_sum"))
        else {
            bail!("{} said no per_iteration, seconds and chamfer_sum", reference.display())
        };
        let ours = (before + self.step_seconds(&shape)?) / 2.0;
        let how = NetworkOptions { recipe: Recipe::Fast, ..NetworkOptions::default() };
        let started = Instant::now();
        let atlas = self.run(|ctx| Ok(explicit::fit(&shape.scan, &how, ctx)?))?;
        let fast = started.elapsed().as_secs_f64();
        let (reached, cd) = self.run(|ctx| {
            let samples: Vec<Sample> = atlas.samples.iter().map(|s| s.to_f32()).collect();
            let mut chamfer = Chamfer::new(&shape.scan, ctx)?;
            let mut gradient = vec![[0.0; 3]; samples.len()];
            let reached = chamfer.value_gradient(&samples, [0, 1], [1.0; 2], &mut gradient, ctx)?;
            Ok((reached, surface_cd(&atlas.surface(), &shape, ctx)?))
        })?;
        let mut text = format!(
            "seconds a step, wall: ours {ours:.4}, PyTorch {theirs:.4}, ratio {:.1}\n",
            theirs / ours
        );
        let _ = writeln!(
            text,
            "Chamfer distance (sums): PyTorch {chamfer:.2} after {seconds:.1} s, {steps} steps; ours {reached:.2} after {fast:.1} s, ratio {:.1}{}",
            seconds / fast,
            if reached <= chamfer { "" } else { ", but not as near" }
        );
        if let Some(theirs) = last("cd") {
            let _ = writeln!(
                text,
                "Chamfer distance of the surfaces to the truth: PyTorch {theirs:.2e}, ours {cd:.2e}"
            );
        }
        let torch = json!({ "step": theirs, "seconds": seconds, "chamfer": chamfer, "cd": last("cd") });
        let ours = json!({ "step": ours, "seconds": fast, "chamfer": reached, "cd": cd });
        self.console.report(&text, &json!({ "ours": ours, "torch": torch }));
        Ok(())
    }

    /// Mean time of the first steps of the paper's recipe.
    fn step_seconds(&self, shape: &Shape) -> Result<f64> {
        const STEPS: u32 = 50;
        let how = NetworkOptions { recipe: Recipe::Paper, ..NetworkOptions::default() };
        self.run(|ctx| {
            let mut trainer = Trainer::new(&shape.scan, &how, ctx)?;
            let started = Instant::now();
            for _ in 0..STEPS {
                trainer.step(how.learning_rate, ctx)?;
            }
            Ok(started.elapsed().as_secs_f64() / f64::from(STEPS))
        })
    }

    /// Mean of a figure over shapes, where all have it.
    fn mean<'s>(&self, variant: &str, figure: &str, shapes: impl Iterator<Item = &'s String>) -> Option<f64> {
        let all: Option<Vec<f64>> = shapes.map(|s| self.figure(&format!("{variant} {s}"), figure)).collect();
        all.filter(|v| !v.is_empty()).map(|v| v.iter().sum::<f64>() / v.len() as f64)
    }

    /// What the paper concludes from its tables, and whether our figures say so.
    fn conclusions(&self, shapes: &[String]) -> String {
        let of = |variant: &str, some: &[&String]| self.mean(variant, "cd", some.iter().copied());
        let (thin, wide): (Vec<&String>, Vec<&String>) =
            shapes.iter().partition(|s| ["ring", "spiral"].contains(&s.as_str()));
        let all: Vec<&String> = shapes.iter().collect();
        let mut out = String::from(
            "\n## Conclusions of the paper\n\n| claim | better | worse | ours agree |\n|---|---|---|---|\n",
        );
        for (claim, better, worse, some) in [
            ("stretch helps 8 surfaces: S8R < S8", "S8R", "S8", &all),
            ("8 surfaces are better than 1: S8R < S1R", "S8R", "S1R", &all),
            ("8 curves are better than 1: C8R < C1R", "C8R", "C1R", &all),
            ("surfaces for surfaces: S8R < C8R", "S8R", "C8R", &wide),
            ("curves for ring and spiral: C8R < S8R", "C8R", "S8R", &thin),
        ] {
            if let (Some(better), Some(worse)) = (of(better, some), of(worse, some)) {
                let agree = if better < worse { "yes" } else { "no" };
                let _ = writeln!(out, "| {claim} | {better:.2e} | {worse:.2e} | {agree} |");
            }
        }
        out
    }

    fn report(&self, shapes: &[String]) -> String {
        let mut out = String::new();
        let recipe = match self.args.recipe {
            _ if self.args.quick => "3 steps, to see that everything runs".to_owned(),
            Training::Fast => "fast (coarse to fine)".to_owned(),
            Training::Paper => format!("paper, at most {} steps", self.args.steps),
        };
        let _ = writeln!(
            out,
            "# Deep Manifold Prior, reproduced\n\nChamfer distance as in the paper (16,000 samples, mean squared distance, both directions added). Recipe: {recipe}; weight of the stretch term {}. In brackets the paper's figure.\n",
            self.args.stretch
        );
        let number = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.2e}"));
        let both = |ours: Option<f64>, paper: Option<f64>| match paper {
            Some(p) => format!("{} ({p:.2e})", number(ours)),
            None => number(ours),
        };
        let mean = |variant: &str, figure: &str| self.mean(variant, figure, shapes.iter());
        let table =
            |out: &mut String, columns: &[(&str, &str, &str)], paper: &dyn Fn(&str, usize) -> Option<f64>| {
                let _ = write!(out, "| shape |");
                for (title, ..) in columns {
                    let _ = write!(out, " {title} |");
                }
                let _ = writeln!(out, "\n|{}", "---|".repeat(columns.len() + 1));
                for name in shapes {
                    let _ = write!(out, "| {name} |");
                    for (column, (_, variant, figure)) in columns.iter().enumerate() {
                        let ours = self.figure(&format!("{variant} {name}"), figure);
                        let _ = write!(out, " {} |", both(ours, paper(name, column)));
                    }
                    out.push('\n');
                }
                out.push_str("| mean |");
                for (column, (_, variant, figure)) in columns.iter().enumerate() {
                    let _ = write!(out, " {} |", both(mean(variant, figure), paper("mean", column)));
                }
                out.push('\n');
            };
        out.push_str("## Table 1\n\n");
        let columns = METHODS.map(|(title, variant, _)| (title, variant, "cd"));
        table(&mut out, &columns, &|name, column| match (name, column) {
            ("mean", 5) => Some(CONV),
            (_, 5..) => None,
            ("mean", _) => Some(TABLE1.iter().map(|t| t.1[column]).sum::<f64>() / TABLE1.len() as f64),
            _ => TABLE1.iter().find(|t| t.0 == name).map(|t| t.1[column]),
        });
        out.push_str("\n## Trimmed to what the scan supports\n\n");
        let columns = [
            ("Surface", "S8R", "trimmed"),
            ("Implicit", "implicit", "trimmed"),
            ("Conv", "conv", "trimmed"),
            ("default prior", "default", "cd"),
        ];
        table(&mut out, &columns, &|_, _| None);
        out.push_str("\n## Seconds\n\n");
        table(&mut out, &METHODS, &|_, _| None);
        out.push_str(
            "\n## Table 2\n\n| variant | mean over the shapes | steps | seconds |\n|---|---|---|---|\n",
        );
        for (variant, paper) in TABLE2 {
            let short = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.0}"));
            let _ = writeln!(
                out,
                "| {variant} | {} | {} | {} |",
                both(mean(variant, "cd"), Some(paper)),
                short(mean(variant, "steps")),
                short(mean(variant, "seconds"))
            );
        }
        out.push_str(&self.conclusions(shapes));
        out.push_str(
            "\n## Interpolation from 1,000 points, one chart\n\n| shape | S1R | S1 |\n|---|---|---|\n",
        );
        for name in shapes.iter().take(2) {
            let of = |v: &str| number(self.figure(&format!("interpolation {v} {name}"), "cd"));
            let _ = writeln!(out, "| {name} | {} | {} |", of("S1R"), of("S1"));
        }
        out.push_str("\n## Stretch: a sphere with 8 charts\n\nOverlap: share of samples nearer to another chart's than to their own chart's. Distortion: mean ratio of the longer to the shorter diagonal direction of a grid cell's map.\n\n| lambda | overlap | distortion | Chamfer |\n|---|---|---|---|\n");
        for lambda in LAMBDAS {
            let of = |f: &str| self.figure(&format!("lambda {lambda}"), f);
            let three = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:.3}"));
            let _ = writeln!(
                out,
                "| {lambda} | {} | {} | {} |",
                three(of("overlap")),
                three(of("distortion")),
                number(of("cd"))
            );
        }
        let _ = writeln!(
            out,
            "\n## A dotted drawing\n\nMean distance of the drawing's true line to what was made of its dots: the dots themselves {}, a curve prior {}, a convolutional network fitted to the picture {}.",
            number(self.figure("dots", "dots")),
            number(self.figure("dots", "curve")),
            number(self.figure("dots", "image"))
        );
        for failed in &self.failed {
            let _ = writeln!(out, "\nFailed: {failed}");
        }
        out
    }

    fn csv(&self) -> String {
        let mut out = String::from("cell,figure,value\n");
        for (key, figures) in &self.done {
            for (figure, value) in figures.as_object().into_iter().flatten() {
                let _ = writeln!(out, "{key},{figure},{value}");
            }
        }
        out
    }
}

/// The figures of one fit, with its number of steps and last loss, and its picture.
fn drawn_fit(
    args: &Args,
    picture: &str,
    shape: &Shape,
    how: &NetworkOptions,
    ctx: &Context<'_>,
) -> Result<Value> {
    let (mut steps, mut last) = (0, f64::NAN);
    let atlas = explicit::fit_watched(&shape.scan, how, ctx, &mut |step, loss| {
        (steps, last) = (step, loss.chamfer);
        true
    })?;
    let mut figures = figures_of(&atlas, how.dim, shape, ctx)?;
    figures["steps"] = json!(steps);
    figures["loss"] = json!(last);
    draw(args, picture, &atlas, ctx)?;
    Ok(figures)
}

fn figures_of(atlas: &NetworkAtlas, dim: Dim, shape: &Shape, ctx: &Context<'_>) -> Result<Value> {
    let mut figures = json!({ "overlap": atlas.overlap(ctx)? });
    let mesh = atlas.surface();
    if dim == Dim::Contour {
        figures["cd"] = json!(cd(&on_curves(atlas, ctx), shape, ctx)?);
        return Ok(figures);
    }
    figures["cd"] = json!(surface_cd(&mesh, shape, ctx)?);
    figures["distortion"] = json!(distortion(atlas));
    let trimmed = trimmed(&mesh, &shape.scan, ctx)?;
    figures["trimmed"] = trimmed_cd(&trimmed, shape, ctx)?;
    Ok(figures)
}

/// The mesh where the scan supports it.
fn trimmed(mesh: &TriMesh, scan: &[Vec3], ctx: &Context<'_>) -> Result<TriMesh> {
    let tree = atlasfit::spatial::neighbours::Neighbours::build(scan, ctx)?;
    let spacing = Sampling::new(spacing(scan, &tree, ctx)?).median;
    Ok(trim(mesh, scan, TRIM * spacing, ctx)?)
}

fn trimmed_cd(mesh: &TriMesh, shape: &Shape, ctx: &Context<'_>) -> Result<Value> {
    // A network that is hardly trained may have nothing near the scan.
    if mesh.triangles.is_empty() { Ok(Value::Null) } else { Ok(json!(surface_cd(mesh, shape, ctx)?)) }
}

/// [`cd`] of samples uniform by area.
fn surface_cd(mesh: &TriMesh, shape: &Shape, ctx: &Context<'_>) -> Result<f64> {
    let samples: Vec<Vec3> =
        sample::uniform(mesh, COUNT, ctx.seed ^ 3, ctx)?.iter().map(|s| s.point).collect();
    cd(&samples, shape, ctx)
}

/// Uniform by length.
fn on_curves(atlas: &NetworkAtlas, ctx: &Context<'_>) -> Vec<Vec3> {
    let side = atlas.grid[1];
    let mut total = 0.0;
    let ends: Vec<(f64, Vec3, Vec3)> = atlas
        .samples
        .chunks_exact(side)
        .flat_map(|chart| chart.windows(2))
        .map(|w| {
            total += w[0].dist2(w[1]).sqrt();
            (total, w[0], w[1])
        })
        .collect();
    let mut rng = Rng::stream(ctx.seed, 11);
    (0..COUNT)
        .filter_map(|_| {
            let at = rng.uniform() * total;
            let (_, a, b) = ends.get(ends.partition_point(|e| e.0 <= at))?;
            Some(*a + (*b - *a) * rng.uniform())
        })
        .collect()
}

/// The paper's Chamfer distance to the true surface.
fn cd(samples: &[Vec3], shape: &Shape, ctx: &Context<'_>) -> Result<f64> {
    let truth: Vec<Vec3> =
        sample::uniform(&shape.truth, COUNT, ctx.seed ^ 4, ctx)?.iter().map(|s| s.point).collect();
    Ok(measure::chamfer(samples, &truth, ctx)?)
}

/// Mean over the grid's cells of the ratio of singular values of the map's derivative: 1 where angles and proportions are kept.
fn distortion(atlas: &NetworkAtlas) -> f64 {
    let [lines, side] = atlas.grid;
    let (mut sum, mut n) = (0.0, 0usize);
    for chart in atlas.samples.chunks_exact(lines * side) {
        for i in 0..lines - 1 {
            for j in 0..side - 1 {
                let p = chart[i * side + j];
                let (a, b) = (chart[(i + 1) * side + j] - p, chart[i * side + j + 1] - p);
                let (e, g) = (a.norm().powi(2), b.norm().powi(2));
                let f: f64 = (0..3).map(|k| a[k] * b[k]).sum();
                let root = ((e - g).powi(2) + 4.0 * f * f).sqrt();
                // Folded cells count as badly as any.
                sum += ((e + g + root) / (e + g - root).max(1e-12)).sqrt().min(100.0);
                n += 1;
            }
        }
    }
    sum / n.max(1) as f64
}

/// A curve to be dotted.
fn heart(t: f64) -> Vec3 {
    let a = std::f64::consts::TAU * t;
    let x = 16.0 * a.sin().powi(3);
    let y = 13.0 * a.cos() - 5.0 * (2.0 * a).cos() - 2.0 * (3.0 * a).cos() - (4.0 * a).cos();
    Vec3([x / 36.0, y / 36.0, 0.0])
}

/// Centres of the dark pixels of a picture that a convolutional network gives after it was fitted to the dots' picture.
fn image_prior(dots: &[Vec3], steps: usize, ctx: &Context<'_>) -> Result<Vec<Vec3>> {
    let [lines, side] = net::conv::GRID;
    let centre = |i: usize| {
        let at = |k: usize, n: usize| (k as f64 + 0.5) / n as f64 - 0.5;
        [at(i % side, side), at(i / side, lines), 0.0]
    };
    let ink: Vec<f32> = (0..lines * side)
        .map(|i| {
            let near = dots.iter().any(|d| (0..2).all(|k| (d[k] - centre(i)[k]).abs() <= 0.5 / side as f64));
            if near { 0.9 } else { -0.9 }
        })
        .collect();
    let mut net = net::Conv::new(&mut Rng::stream(ctx.seed, 13));
    let mut out = vec![[0f32; 3]; ink.len()];
    for _ in 0..steps {
        net.forward(&mut out, ctx)?;
        let gradient: Vec<[f32; 3]> =
            out.iter().zip(&ink).map(|(y, ink)| [2.0 * (y[0] - ink), 0.0, 0.0]).collect();
        net.backward(&gradient, ctx)?;
        net.step(1e-3);
    }
    net.forward(&mut out, ctx)?;
    Ok((0..ink.len()).filter(|&i| out[i][0] > 0.0).map(|i| Vec3(centre(i))).collect())
}

/// A picture of the charts, each in its colour.
fn draw(args: &Args, name: &str, atlas: &NetworkAtlas, ctx: &Context<'_>) -> Result<()> {
    let mut mesh = atlas.surface();
    if atlas.grid[0] == 1 {
        return draw_points(args, name, vec3::of(&mesh.positions), ctx);
    }
    let batch = atlas.grid[0] * atlas.grid[1];
    let color = |i: usize| {
        let [r, g, b] = chart_color((i / batch) as u32);
        [r, g, b, 1.0]
    };
    mesh.colors = Some((0..mesh.positions.len()).map(color).collect());
    draw_mesh(args, name, &mesh, Mode::Shaded, ctx)
}

fn draw_points(args: &Args, name: &str, points: &[Vec3], ctx: &Context<'_>) -> Result<()> {
    if points.is_empty() {
        Ok(())
    } else {
        draw_mesh(args, name, &TriMesh::new(vec3::plain(points.to_vec()), Vec::new()), Mode::Points, ctx)
    }
}

fn draw_mesh(args: &Args, name: &str, mesh: &TriMesh, mode: Mode, ctx: &Context<'_>) -> Result<()> {
    let flat = mesh.positions.iter().all(|p| p[2] == 0.0);
    let view = if flat { View { azimuth: 0.0, elevation: 0.0 } } else { STYLE.view };
    let picture = render(mesh, None, &Style { mode, view, ..STYLE }, ctx)?;
    write_png(&args.output.join(format!("{name}.png")), &picture)
}

fn sphere(radius: f64) -> TriMesh {
    grid(64, 128, |u, v| {
        let (t, a) = (std::f64::consts::PI * u, std::f64::consts::TAU * v);
        Vec3([t.sin() * a.cos(), t.sin() * a.sin(), t.cos()]).normalized() * radius
    })
}

fn torus(large: f64, small: f64) -> TriMesh {
    grid(256, 48, |u, v| {
        let (a, b) = (std::f64::consts::TAU * u, std::f64::consts::TAU * v);
        let r = large + small * b.cos();
        Vec3([r * a.cos(), r * a.sin(), small * b.sin()])
    })
}

/// Triangles of a grid of parameters in the unit square.
fn grid(n: u32, m: u32, at: impl Fn(f64, f64) -> Vec3) -> TriMesh {
    let index = |i: u32, j: u32| i * (m + 1) + j;
    let place = |i: u32, n: u32| f64::from(i) / f64::from(n);
    let positions = (0..=n)
        .flat_map(|i| (0..=m).map(move |j| (i, j)))
        .map(|(i, j)| at(place(i, n), place(j, m)).0)
        .collect();
    let triangles = (0..n)
        .flat_map(|i| (0..m).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    TriMesh::new(positions, triangles)
}
