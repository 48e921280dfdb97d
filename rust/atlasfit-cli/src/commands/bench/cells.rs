//! The cells of `bench denoise`, `bench uncertainty` and `bench compare`: a shape with a noise or a kind of
//! scan, and the files that are made of it.
//!
//! In: what was asked for. Out: the list of cells; for each its scan, the true surface and, of a simulated
//! scan, the part of it that was seen. `tests/peers/shapes.py` and `tests/peers/scanner.py` make them.

use super::peers::Scripts;
use super::shared::cancelled;
use crate::console::{Console, RunArgs};
use crate::files;
use anyhow::{Context as _, Result, bail};
use atlasfit::DenoiseOptions;
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

/// Which cells, and what makes them.
#[derive(Debug, Clone, clap::Args)]
pub struct CellArgs {
    /// Simulated scans instead, of these kinds: views, outliers, misregistered, quantised, frames, uneven,
    /// varied, merged, lidar, stations, depth, rows, sheets; a number chooses one of several (outliers20,
    /// rows5)
    /// [default: all]
    #[arg(long, value_delimiter = ',', value_name = "KINDS", num_args = 0..=1, default_missing_value = "")]
    pub scanner: Option<Vec<String>>,
    /// Shapes: ring, spiral, mobius, bumps, knot, room, box, rack, spikes, or names of PLY meshes in the data
    /// folder [default: bunny,dragon,car,cup,mobius,chair,spiral,ring; with --scanner
    /// bumps,knot,ring,spiral and all meshes of the data folder]
    #[arg(long, value_delimiter = ',')]
    pub shapes: Option<Vec<String>>,
    /// Standard deviations of the noise, for a shape of size 1 [default: 0.002,0.005,0.01,0.02; with
    /// --scanner 0.004]
    #[arg(long, value_delimiter = ',')]
    pub sigmas: Option<Vec<f64>>,
    /// The folder of meshes [default: ../shared/data/denoise beside the repository, where it is]
    #[arg(long, value_name = "DIR")]
    pub data: Option<PathBuf>,
    /// The attribute that numbers the sweeps of the scans: they are moved together first (view, of
    /// misregistered ones)
    #[arg(long, value_name = "NAME")]
    pub sweeps: Option<String>,
    /// Points per scan
    #[arg(long, default_value_t = 16_000, value_name = "N")]
    pub count: usize,
    /// The Python that has numpy, and pymeshlab for the peers
    #[arg(long, default_value = "python3", value_name = "PROGRAM")]
    pub python: PathBuf,
    /// The folder of shapes.py, scanner.py and meshlab.py
    #[arg(long, default_value = "tests/peers", value_name = "DIR")]
    pub scripts: PathBuf,
    #[command(flatten)]
    pub run: RunArgs,
}

impl CellArgs {
    /// How the scans are denoised.
    pub fn options(&self) -> DenoiseOptions {
        DenoiseOptions::default().with_sweeps(self.sweeps.clone())
    }

    /// The scripts that make cells.
    pub fn scripts(&self) -> Scripts<'_> {
        Scripts { python: &self.python, folder: &self.scripts }
    }
}

/// What a scan is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Spec {
    pub shape: String,
    /// [`GAUSSIAN`], or a kind of scanner.py.
    pub kind: String,
    pub sigma: f64,
    /// Which noise of that size.
    pub seed: u64,
}

impl Spec {
    /// The shape, with the kind of its scan where it is simulated.
    pub fn scene(&self) -> String {
        if self.kind == GAUSSIAN { self.shape.clone() } else { format!("{} {}", self.shape, self.kind) }
    }

    /// The same as the beginning of a file's name.
    pub fn stem(&self) -> String {
        let scene = self.scene().replace(' ', "-");
        if self.seed == 0 { scene } else { format!("{scene}-{}", self.seed) }
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
pub fn specs(args: &CellArgs) -> Result<Vec<Spec>> {
    let given = |default: &[f64]| args.sigmas.clone().unwrap_or_else(|| default.to_vec());
    let Some(kinds) = &args.scanner else {
        let shapes = args.shapes.clone().unwrap_or_else(|| SHAPES.map(String::from).to_vec());
        let cell =
            |shape: &String, sigma| Spec { shape: shape.clone(), kind: GAUSSIAN.into(), sigma, seed: 0 };
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
    let listed = args.scripts().run("scanner.py", &asked)?;
    let mut specs = Vec::new();
    for sigma in given(&[SCANNER_SIGMA]) {
        for line in listed.lines() {
            let said = parsed(line)?;
            let (Some(shape), Some(kind)) = (said["shape"].as_str(), said["kind"].as_str()) else {
                bail!("scanner.py said {line}: shape and kind were expected");
            };
            specs.push(Spec { shape: shape.into(), kind: kind.into(), sigma, seed: 0 });
        }
    }
    Ok(specs)
}

fn parsed(line: &str) -> Result<Value> {
    serde_json::from_str(line).with_context(|| format!("scanner.py said {line}, which is no JSON"))
}

impl Cell {
    /// Makes the scan of a cell in a folder.
    pub fn make(spec: Spec, args: &CellArgs, folder: &Path, console: &Console) -> Result<Self> {
        let scripts = args.scripts();
        let load =
            |file: &Path| -> Result<TriMesh> { Ok(files::load(file, &args.run, console)?.into_mesh()) };
        let [sigma, count, seed] = [spec.sigma.to_string(), args.count.to_string(), spec.seed.to_string()];
        let scan = folder.join(format!("{}-{sigma}.ply", spec.stem()));
        let mut last: Vec<&dyn AsRef<OsStr>> = vec![&"--count", &count, &"--seed", &seed];
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

/// The rows of all cells that were asked for, each told as a line when it is there, and what failed. Without
/// `sigmas` of their own, scans that are not simulated get those.
pub fn rows<R>(
    args: &CellArgs,
    sigmas: &[f64],
    console: &Console,
    line: fn(&R) -> String,
    measure: impl Fn(Spec, &CellArgs) -> Result<R>,
) -> Result<(Vec<R>, Vec<String>)> {
    let mut which = args.clone();
    if which.scanner.is_none() {
        which.sigmas.get_or_insert_with(|| sigmas.to_vec());
    }
    let (mut rows, mut failed) = (Vec::new(), Vec::new());
    for spec in specs(&which)? {
        console.check(&which.run, "measuring")?;
        let name = spec.to_string();
        match measure(spec, &which) {
            Ok(row) => {
                console.note(line(&row));
                rows.push(row);
            }
            Err(e) if cancelled(&e) => return Err(e),
            Err(e) => failed.push(format!("{name}: {e:#}")),
        }
    }
    Ok((rows, failed))
}

/// An error where cells failed, beside so many that did not.
pub fn ended(rows: usize, failed: usize) -> Result<()> {
    if failed == 0 { Ok(()) } else { bail!("{failed} of {} cells failed", rows + failed) }
}
