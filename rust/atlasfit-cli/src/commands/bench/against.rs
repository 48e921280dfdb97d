//! The time of this program beside another build of it, in turn on the same input.
//!
//! In: the other program, a command that both know, its input. Out: the median seconds of both for each cell,
//! and their ratio. Both run as processes of their own, so that neither has a warm start; who begins changes
//! from run to run, so that a machine that slows down slows both. What counts is the time that the command
//! itself reports with --json.

use super::shared::median;
use crate::console::Console;
use anyhow::{Context as _, Result, bail};
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

/// The two builds at work, and what has been timed so far.
pub struct Against<'a> {
    /// The other build.
    other: &'a Path,
    /// Runs of each build per cell.
    repeat: u32,
    cells: Vec<Cell>,
}

/// The times of one input.
struct Cell {
    name: String,
    /// Median seconds of this build.
    own: f64,
    /// Median seconds of the other.
    other: f64,
}

impl<'a> Against<'a> {
    /// Times `repeat` runs of each build per cell.
    pub fn new(other: &'a Path, repeat: u32) -> Self {
        Self { other, repeat, cells: Vec::new() }
    }

    /// Runs a command in turn in both builds. `arguments` must make it report to standard output.
    pub fn time(&mut self, name: &str, arguments: &[&OsStr], console: &Console) -> Result<()> {
        let this = std::env::current_exe().context("cannot tell where this program lies")?;
        let (mut own, mut other) = (Vec::new(), Vec::new());
        for turn in 0..self.repeat {
            for own_turn in [turn % 2 == 0, turn % 2 == 1] {
                let program = if own_turn { &this } else { self.other };
                let seconds = seconds(program, arguments)?;
                (if own_turn { &mut own } else { &mut other }).push(seconds);
            }
        }
        let cell = Cell { name: name.to_owned(), own: median(&mut own), other: median(&mut other) };
        console.note(format_args!(
            "{name}: {:.3} s, against {:.3} s: {:.3}",
            cell.own,
            cell.other,
            cell.ratio()
        ));
        self.cells.push(cell);
        Ok(())
    }

    /// Prints the table.
    pub fn report(&self, console: &Console) {
        let mut table = String::from("| cell | s | s, against | ratio of medians |\n|---|---|---|---|\n");
        for c in &self.cells {
            let _ = writeln!(table, "| {} | {:.3} | {:.3} | {:.3} |", c.name, c.own, c.other, c.ratio());
        }
        let (total, middle) = (self.ratio_of_totals(), self.median_ratio());
        let _ = writeln!(
            table,
            "\nAll {} cells: ratio of the sums of medians {total:.3}, median of the ratios {middle:.3}. \
             Below 1 this build is faster.",
            self.cells.len()
        );
        let cells: Vec<Value> = (self.cells.iter())
            .map(|c| {
                json!({ "cell": c.name, "seconds": c.own, "against_seconds": c.other, "ratio": c.ratio() })
            })
            .collect();
        let json = json!({
            "against": self.other.display().to_string(), "cells": cells,
            "ratio_of_totals": total, "median_ratio": middle,
        });
        console.answer(&table, &json);
    }

    fn ratio_of_totals(&self) -> f64 {
        self.cells.iter().map(|c| c.own).sum::<f64>() / self.cells.iter().map(|c| c.other).sum::<f64>()
    }

    fn median_ratio(&self) -> f64 {
        median(&mut self.cells.iter().map(Cell::ratio).collect::<Vec<_>>())
    }
}

impl Cell {
    /// Our time over the other's.
    fn ratio(&self) -> f64 {
        self.own / self.other
    }
}

/// The seconds that one run reports.
fn seconds(program: &Path, arguments: &[&OsStr]) -> Result<f64> {
    let shown = program.display();
    let out = Command::new(program)
        .args(arguments)
        .args(["--json", "--quiet"])
        .output()
        .with_context(|| format!("cannot start {shown}. Give --against another build of atlasfit"))?;
    if !out.status.success() {
        let said = String::from_utf8_lossy(&out.stderr);
        bail!("{shown} failed: {}", said.lines().next_back().unwrap_or("no message"));
    }
    let said: Value = serde_json::from_slice(&out.stdout)
        .with_context(|| format!("{shown} said no JSON. Give --against another build of atlasfit"))?;
    said["seconds"].as_f64().with_context(|| format!("{shown} reported no seconds"))
}
