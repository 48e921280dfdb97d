//! The time of a step of training, and of a whole fit, beside the same in PyTorch.

use super::cells::Bench;
use super::figures::surface_cd;
use super::shapes::{SIGMA, Shape, shape};
use crate::commands::bench::peers::python;
use anyhow::{Result, bail};
use atlasfit_net::explicit::{self, NetworkOptions, Recipe, Trainer};
use atlasfit_net::loss::{Chamfer, Sample};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

impl Bench<'_> {
    /// Times full steps (8 charts of 4,096 samples): ours, the reference's, ours again, so that other load on
    /// the machine falls on both. Then times the fast recipe.
    pub fn speed(&self, reference: &Path) -> Result<()> {
        let name = self.args.shapes.first().map_or("bunny", String::as_str);
        let shape = shape(name, self.args, self.console)?;
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
        let how = NetworkOptions::default().with_recipe(Recipe::Fast);
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
            "Chamfer distance (sums): PyTorch {chamfer:.2} after {seconds:.1} s, {steps} steps; \
             ours {reached:.2} after {fast:.1} s, ratio {:.1}{}",
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
        self.console.answer(&text, &json!({ "ours": ours, "torch": torch }));
        Ok(())
    }

    /// Mean time of the first steps of the paper's recipe.
    fn step_seconds(&self, shape: &Shape) -> Result<f64> {
        const STEPS: u32 = 50;
        let how = NetworkOptions::default().with_recipe(Recipe::Paper);
        self.run(|ctx| {
            let mut trainer = Trainer::new(&shape.scan, &how, ctx)?;
            let started = Instant::now();
            for _ in 0..STEPS {
                trainer.step(how.learning_rate, ctx)?;
            }
            Ok(started.elapsed().as_secs_f64() / f64::from(STEPS))
        })
    }
}
