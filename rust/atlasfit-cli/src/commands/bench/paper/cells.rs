//! The cells of the paper's tables: each is one fit, whose figures are kept in results.jsonl as soon as they
//! are known.

use super::args::{Args, Beginning, Training};
use crate::commands::bench::shared::cancelled;
use crate::console::Console;
use anyhow::{Context as _, Result, bail};
use atlasfit::{Context, Run};
use atlasfit_net::explicit::NetworkOptions;
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::io::Write as _;
use std::time::Instant;

/// What may change from fit to fit of the same cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Trial {
    /// Where the networks' charts begin.
    pub start: Beginning,
    /// Seed of everything random but the scan.
    pub seed: u64,
}

/// The bench at work.
pub struct Bench<'a> {
    pub args: &'a Args,
    pub console: &'a Console,
    /// What the fits are done with that are asked for next.
    pub trial: Trial,
    /// Figures of each fit that is done, by the cell's full name.
    pub done: Map<String, Value>,
    /// Fits that failed, and why.
    pub failed: Vec<String>,
}

impl<'a> Bench<'a> {
    /// A bench that has done nothing yet.
    pub fn new(args: &'a Args, console: &'a Console) -> Self {
        let trial = Trial { start: args.start, seed: args.run.seed };
        Self { args, console, trial, done: Map::new(), failed: Vec::new() }
    }

    /// Reads the results of earlier runs.
    pub fn read(&mut self) -> Result<()> {
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

    /// A cell's name in the results: those of another size, recipe or trial are other cells.
    fn full_key(&self, key: &str, trial: Trial) -> String {
        let size = if self.args.quick { "quick" } else { "full" };
        let stretch = self.args.stretch;
        let weight = if stretch == NetworkOptions::default().stretch_weight {
            String::new()
        } else {
            format!(" stretch {stretch}")
        };
        let end = format!("{weight} {} seed {}", trial.start.name(), trial.seed);
        match self.args.recipe {
            Training::Fast => format!("{key} {size} fast{end}"),
            Training::Paper => format!("{key} {size} paper {}{end}", self.args.steps),
        }
    }

    /// Runs work that may fail in more ways than the core's.
    pub fn run<T: Send>(&self, work: impl FnOnce(&Context<'_>) -> Result<T> + Send) -> Result<T> {
        Run { seed: self.trial.seed, ..self.console.start_silent(&self.args.run) }
            .execute(|ctx| Ok(work(ctx)))?
    }

    /// Does a fit unless its figures are known. One fit that fails must not cost the others.
    pub fn cell(&mut self, key: &str, work: impl FnOnce(&Context<'_>) -> Result<Value> + Send) -> Result<()> {
        let key = self.full_key(key, self.trial);
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
    pub fn figure(&self, key: &str, figure: &str) -> Option<f64> {
        self.figure_of(key, figure, self.trial)
    }

    /// [`Self::figure`] of another trial.
    pub fn figure_of(&self, key: &str, figure: &str, trial: Trial) -> Option<f64> {
        self.done.get(&self.full_key(key, trial))?[figure].as_f64()
    }

    /// Mean of a figure over shapes, where all have it.
    pub fn mean<'s>(
        &self,
        variant: &str,
        figure: &str,
        shapes: impl Iterator<Item = &'s String>,
    ) -> Option<f64> {
        let all: Option<Vec<f64>> = shapes.map(|s| self.figure(&format!("{variant} {s}"), figure)).collect();
        all.filter(|v| !v.is_empty()).map(|v| v.iter().sum::<f64>() / v.len() as f64)
    }

    /// All figures, one per line.
    pub fn csv(&self) -> String {
        let mut out = String::from("cell,figure,value\n");
        for (key, figures) in &self.done {
            for (figure, value) in figures.as_object().into_iter().flatten() {
                let _ = writeln!(out, "{key},{figure},{value}");
            }
        }
        out
    }
}
