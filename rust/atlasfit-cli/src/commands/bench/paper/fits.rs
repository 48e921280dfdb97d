//! The fits of the paper's tables, one cell each: the networks, the level set, the default prior, two peers.

use super::args::{Args, Beginning, Training};
use super::cells::{Bench, Trial};
use super::figures::{figures_of, surface_cd, trimmed, trimmed_cd};
use super::pictures::{draw, draw_mesh};
use super::shapes::{SIGMA, Shape, made, shape};
use crate::commands::bench::peers::{MeshlabJob, Scripts};
use crate::files;
use crate::render::Mode;
use anyhow::{Result, bail};
use atlasfit::geometry::PointCloud;
use atlasfit::measure::sample;
use atlasfit::numeric::vec3::{self, Vec3};
use atlasfit::{Context, DenoiseOptions};
use atlasfit_net::explicit::{self, Dim, Network, NetworkOptions, Recipe};
use atlasfit_net::level_set::{self, LevelSetOptions};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Instant;

/// Points of the interpolation experiment.
const FEW: usize = 1000;
/// Weights of the stretch term. The largest is what the paper's weight of 1 is here if its Chamfer distances
/// are means.
pub const LAMBDAS: [f64; 6] = [0.0, 1.0, 100.0, 1000.0, 10_000.0, 30_000.0];
/// The two peers of table 1 and their settings for meshlab.py. From the paper: 30 neighbours for the normals
/// of RIMLS; depth 7, and 20 neighbours for the normals, for screened Poisson.
const PEERS: [(&str, &str); 2] = [("rimls", "rimls"), ("spsr", "7,20,4")];
impl Bench<'_> {
    /// The options of a variant: a name of the paper's table 2, or conv.
    pub fn options(&self, variant: &str) -> NetworkOptions {
        NetworkOptions::default()
            .with_network(if variant == "conv" { Network::Conv } else { Network::Dense })
            .with_charts(if variant.contains('1') { 1 } else { 8 })
            .with_dim(if variant.starts_with('C') { Dim::Contour } else { Dim::Surface })
            .with_stretch_weight(if variant.ends_with('R') || variant == "conv" {
                self.args.stretch
            } else {
                0.0
            })
            .with_start(self.trial.start.start())
            .with_recipe(if self.args.recipe == Training::Paper || self.args.quick {
                Recipe::Paper
            } else {
                Recipe::Fast
            })
            .with_iterations(if self.args.quick { 3 } else { self.args.steps })
    }

    /// Fits charts that are networks.
    pub fn explicit(&mut self, name: &str, shape: &Shape, variant: &str) -> Result<()> {
        let (how, args) = (self.options(variant), self.args);
        let Trial { start, seed } = self.trial;
        let picture = format!("{name}-{variant}-{}-{seed}", start.name());
        self.cell(&format!("{variant} {name}"), |ctx| drawn_fit(args, &picture, shape, &how, ctx))
    }

    /// Fits S8R from each start with each seed.
    pub fn starts(&mut self, shapes: &[String]) -> Result<()> {
        let before = self.trial;
        for trial in self.trials() {
            self.trial = trial;
            for name in shapes {
                let shape = shape(name, self.args, self.console)?;
                self.explicit(name, &shape, "S8R")?;
            }
        }
        self.trial = before;
        Ok(())
    }

    /// The trials of the experiment "starts": our start first.
    pub fn trials(&self) -> Vec<Trial> {
        let first = self.args.run.seed;
        [Beginning::Patches, Beginning::Torch]
            .into_iter()
            .flat_map(|start| (0..self.args.seeds).map(move |k| Trial { start, seed: first + k }))
            .collect()
    }

    /// Fits the level set.
    pub fn implicit(&mut self, name: &str, shape: &Shape) -> Result<()> {
        let args = self.args;
        let mut how = LevelSetOptions::default().with_epsilon(Some(level_set::EPSILON));
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

    /// Denoises with the default prior.
    pub fn default_prior(&mut self, name: &str, shape: &Shape) -> Result<()> {
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
    pub fn peers(&mut self, name: &str, shape: &Shape) -> Result<()> {
        let (args, console) = (self.args, self.console);
        let folder = args.output.join("shapes");
        let scan = folder.join(format!("{name}-noisy.ply"));
        for (peer, setting) in PEERS {
            let key = format!("{peer} {name}");
            if self.figure(&key, "cd").is_some() {
                continue;
            }
            let load = |file: &Path| Ok(files::load(file, &args.run, console)?.into_mesh());
            let job = MeshlabJob { scan: &scan, folder: &folder, repeat: 1, settings: &[setting] };
            let scripts = Scripts { python: &args.python, folder: &args.scripts };
            let made = match scripts.meshlab(&job, &load).map(|m| m.into_iter().next()) {
                Ok(Some(made)) => made,
                Ok(None) => bail!("meshlab.py said nothing of {setting}"),
                Err(e) => {
                    console.note(format_args!("left out: {key}: {e:#}"));
                    continue;
                }
            };
            self.cell(&key, |ctx| {
                draw_mesh(args, &format!("{name}-{peer}"), &made.mesh, Mode::Shaded, ctx)?;
                let cd = surface_cd(&made.mesh, shape, ctx)?;
                Ok(json!({ "cd": cd, "fit_seconds": made.seconds }))
            })?;
        }
        Ok(())
    }

    /// Fits one chart to 1,000 points without noise, with and without the stretch term.
    pub fn interpolation(&mut self, name: &str) -> Result<()> {
        let truth = shape(name, self.args, self.console)?.truth;
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

    /// Fits 8 charts to a sphere: what the weight of the stretch term does to overlap and distortion.
    pub fn lambda(&mut self) -> Result<()> {
        let shape = made("sphere", self.args, self.console)?;
        let args = self.args;
        for lambda in LAMBDAS {
            let how = self.options("S8R").with_stretch_weight(lambda);
            self.cell(&format!("lambda {lambda}"), |ctx| {
                drawn_fit(args, &format!("sphere-lambda-{lambda}"), &shape, &how, ctx)
            })?;
        }
        Ok(())
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
