//! The cells of `bench denoise`: a shape with a noise or a kind of scan, and the files that are made of it.
//!
//! In: what was asked for. Out: the list of cells; for each its scan, the true surface and, of a simulated
//! scan, the part of it that was seen. `tests/peers/shapes.py` and `tests/peers/scanner.py` make them.

use super::super::peers::Scripts;
use super::args::Args;
use crate::console::Console;
use crate::files;
use anyhow::{Context as _, Result, bail};
use atlasfit::geometry::TriMesh;
use serde_json::Value;
use std::ffi::OsStr;
use std::fmt;
use std::path::{Path, PathBuf};

/// The kind of a scan that samples all of the surface, with the same noise in all directions.
pub const GAUSSIAN: &str = "gaussian";
/// The shapes of such scans, where none are named.
const SHAPES: [&str; 8] = ["bunny", "dragon", "car", "cup", "mobius", "chair", "spiral", "ring"];
/// Their noise, where none is named.
const SIGMAS: [f64; 4] = [0.002, 0.005, 0.01, 0.02];
/// The noise of simulated scans, where none is named.
const SCANNER_SIGMA: f64 = 0.004;

/// What a scan is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Spec {
    pub shape: String,
    /// [`GAUSSIAN`], or a kind of scanner.py.
    pub kind: String,
    pub sigma: f64,
}

impl Spec {
    /// The shape, with the kind of its scan where it is simulated.
    pub fn scene(&self) -> String {
        if self.kind == GAUSSIAN { self.shape.clone() } else { format!("{} {}", self.shape, self.kind) }
    }

    /// The same as the beginning of a file's name.
    pub fn stem(&self) -> String {
        self.scene().replace(' ', "-")
    }
}

impl fmt::Display for Spec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.scene(), self.sigma)
    }
}

/// One scan, and what its surfaces are measured by.
pub struct Cell {
    pub spec: Spec,
    /// The file of the scan.
    pub scan: PathBuf,
    pub truth: TriMesh,
    /// Of a simulated scan, what of the truth was seen.
    pub seen: Option<Seen>,
}

/// The seen part of a surface.
pub struct Seen {
    pub part: TriMesh,
    /// Its share of the area.
    pub share: f64,
}

/// All cells that were asked for.
pub fn specs(args: &Args, scripts: Scripts<'_>) -> Result<Vec<Spec>> {
    let given = |default: &[f64]| args.sigmas.clone().unwrap_or_else(|| default.to_vec());
    let Some(kinds) = &args.scanner else {
        let shapes = args.shapes.clone().unwrap_or_else(|| SHAPES.map(String::from).to_vec());
        let cell = |shape: &String, sigma| Spec { shape: shape.clone(), kind: GAUSSIAN.into(), sigma };
        return Ok(given(&SIGMAS)
            .iter()
            .flat_map(|&sigma| shapes.iter().map(move |shape| cell(shape, sigma)))
            .collect());
    };
    let (kinds, shapes) = (kinds.join(","), args.shapes.as_deref().unwrap_or_default().join(","));
    let mut asked: Vec<&dyn AsRef<OsStr>> = vec![&"cells", &"--kinds", &kinds, &"--shapes", &shapes];
    if let Some(data) = &args.data {
        asked.extend([&"--data" as &dyn AsRef<OsStr>, data]);
    }
    let listed = scripts.run("scanner.py", &asked)?;
    let mut specs = Vec::new();
    for sigma in given(&[SCANNER_SIGMA]) {
        for line in listed.lines() {
            let said = parsed(line)?;
            let (Some(shape), Some(kind)) = (said["shape"].as_str(), said["kind"].as_str()) else {
                bail!("scanner.py said {line}: shape and kind were expected");
            };
            specs.push(Spec { shape: shape.into(), kind: kind.into(), sigma });
        }
    }
    Ok(specs)
}

fn parsed(line: &str) -> Result<Value> {
    serde_json::from_str(line).with_context(|| format!("scanner.py said {line}, which is no JSON"))
}

impl Cell {
    /// Makes the scan of a cell in a folder.
    pub fn make(
        spec: Spec,
        args: &Args,
        scripts: Scripts<'_>,
        folder: &Path,
        console: &Console,
    ) -> Result<Self> {
        let load =
            |file: &Path| -> Result<TriMesh> { Ok(files::load(file, &args.run, console)?.into_mesh()) };
        let (sigma, count) = (spec.sigma.to_string(), args.count.to_string());
        let scan = folder.join(format!("{}-{sigma}.ply", spec.stem()));
        let mut last: Vec<&dyn AsRef<OsStr>> = vec![&"--count", &count];
        if let Some(data) = &args.data {
            last.extend([&"--data" as &dyn AsRef<OsStr>, data]);
        }
        if spec.kind == GAUSSIAN {
            let truth = folder.join(format!("{}.ply", spec.stem()));
            let first: [&dyn AsRef<OsStr>; 4] = [&spec.shape, &sigma, &truth, &scan];
            scripts.run("shapes.py", &[&first[..], &last].concat())?;
            return Ok(Self { scan, truth: load(&truth)?, seen: None, spec });
        }
        let [truth, seen] =
            ["truth", "seen"].map(|what| folder.join(format!("{}-{sigma}-{what}.ply", spec.stem())));
        let first: [&dyn AsRef<OsStr>; 7] = [&"scan", &spec.shape, &spec.kind, &sigma, &truth, &seen, &scan];
        let said = scripts.run("scanner.py", &[&first[..], &last].concat())?;
        let Some(share) = parsed(said.trim())?["seen"].as_f64() else {
            bail!("scanner.py said {said}: the seen share was expected");
        };
        let seen = Some(Seen { part: load(&seen)?, share });
        Ok(Self { scan, truth: load(&truth)?, seen, spec })
    }
}
