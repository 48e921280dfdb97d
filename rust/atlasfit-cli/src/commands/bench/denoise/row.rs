//! The figures of one surface: as JSON, as CSV, and kept in a file for peers, which take long.

use super::super::cells::{GAUSSIAN, Spec};
use crate::number::short;
use anyhow::{Context as _, Result};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// What is known of one surface.
#[derive(Debug, Clone)]
pub struct Row {
    pub spec: Spec,
    /// ours, or the peer's setting.
    pub method: String,
    pub seconds: f64,
    /// From the cache: the time is from another run.
    pub cached: bool,
    /// By name: [`FIGURES`] and, for ours, [`POINT_FIGURES`] and [`UV_FIGURES`].
    pub figures: Value,
}

/// Numbers measured of each surface, in the order of the CSV.
pub const FIGURES: [&str; 18] = [
    "acc",
    "acc_med",
    "acc_p99",
    "com",
    "com_med",
    "com_p99",
    "cd",
    "floor",
    "f1",
    "normal",
    "orientation",
    "flipped",
    "seen",
    "faces",
    "parts",
    "boundary",
    "loops",
    "nonmanifold",
];
/// The points' own figures, which peers do not have.
pub const POINT_FIGURES: [&str; 3] = ["points_rms", "points_med", "points_p99"];
/// Figures of our UVs.
pub const UV_FIGURES: [&str; 5] = ["uv_charts", "uv_p95", "uv_flips", "uv_overlaps", "uv_coverage"];

impl Row {
    /// A figure; not a number where it is not known.
    pub fn get(&self, key: &str) -> f64 {
        self.figures[key].as_f64().unwrap_or(f64::NAN)
    }

    /// All figures in one object.
    pub fn json(&self) -> Value {
        let mut out = json!({
            "shape": self.spec.shape, "kind": self.spec.kind, "sigma": self.spec.sigma,
            "method": self.method, "seconds": self.seconds, "cached": self.cached,
        });
        if let (Some(all), Some(figures)) = (out.as_object_mut(), self.figures.as_object()) {
            all.extend(figures.clone());
        }
        out
    }

    /// One line for people.
    pub fn summary(&self) -> String {
        format!(
            "{} {}: acc {} com {} flipped {} in {} s",
            self.spec,
            self.method,
            short(self.get("acc")),
            short(self.get("com")),
            short(self.get("flipped")),
            short(self.seconds)
        )
    }
}

/// Rows of peers, kept in a file of JSON lines where one is given.
pub struct Cache<'a> {
    path: Option<&'a Path>,
    /// Points per scan: scans of another size are other cells.
    count: usize,
    rows: Vec<Row>,
}

impl<'a> Cache<'a> {
    /// Reads the file, if there is one.
    pub fn read(path: Option<&'a Path>, count: usize) -> Result<Self> {
        let mut out = Self { path, count, rows: Vec::new() };
        let Some(path) = path.filter(|p| p.exists()) else { return Ok(out) };
        let content =
            std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        out.rows = content
            .lines()
            .filter_map(|line| out.row(line).transpose())
            .collect::<Result<_>>()
            .with_context(|| format!("{} is no cache of peers. Remove it", path.display()))?;
        Ok(out)
    }

    /// The row of a line, unless it is of another size.
    fn row(&self, line: &str) -> Result<Option<Row>> {
        let v: Value = serde_json::from_str(line)?;
        let word = |k: &str| v[k].as_str().map(ToString::to_string).context("a word is missing");
        let number = |k: &str| v[k].as_f64().context("a number is missing");
        let row = Row {
            spec: Spec {
                shape: word("shape")?,
                kind: v["kind"].as_str().unwrap_or(GAUSSIAN).into(),
                sigma: number("sigma")?,
                seed: 0,
            },
            method: word("method")?,
            seconds: number("seconds")?,
            cached: true,
            figures: v.clone(),
        };
        Ok((v["count"].as_u64() == Some(self.count as u64)).then_some(row))
    }

    /// The rows of one cell.
    pub fn cell<'s>(&'s self, spec: &'s Spec) -> impl Iterator<Item = &'s Row> {
        self.rows.iter().filter(move |r| r.spec == *spec)
    }

    /// Adds rows, also to the file.
    pub fn add(&mut self, rows: Vec<Row>) -> Result<()> {
        self.append(&rows)?;
        self.rows.extend(rows);
        Ok(())
    }

    fn append(&self, rows: &[Row]) -> Result<()> {
        use std::io::Write as _;
        let Some(path) = self.path else { return Ok(()) };
        let mut lines = String::new();
        for row in rows {
            let mut v = row.json();
            v["count"] = json!(self.count);
            let _ = writeln!(lines, "{v}");
        }
        std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(path)
            .and_then(|mut f| f.write_all(lines.as_bytes()))
            .with_context(|| format!("cannot write {}", path.display()))
    }
}

/// All figures as CSV.
pub fn csv(rows: &[Row]) -> String {
    let mut out = format!(
        "shape,kind,sigma,method,seconds,cached,{},{},{}\n",
        FIGURES.join(","),
        POINT_FIGURES.join(","),
        UV_FIGURES.join(",")
    );
    for row in rows {
        let Spec { shape, kind, sigma, .. } = &row.spec;
        let _ = write!(out, "{shape},{kind},{sigma},\"{}\",{:.4},{}", row.method, row.seconds, row.cached);
        for key in FIGURES.iter().chain(&POINT_FIGURES).chain(&UV_FIGURES) {
            let value = row.get(key);
            let _ = if value.is_nan() { write!(out, ",") } else { write!(out, ",{value}") };
        }
        out.push('\n');
    }
    out
}
