//! Other programs that the benchmarks compare with, started through the Python scripts of `tests/peers`.

use anyhow::{Context as _, Result, bail};
use atlasfit::geometry::TriMesh;
use serde_json::Value;
use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

/// The scripts, and the Python that runs them.
#[derive(Clone, Copy)]
pub struct Scripts<'a> {
    /// The Python program.
    pub python: &'a Path,
    /// The folder of the scripts.
    pub folder: &'a Path,
}

/// What MeshLab is asked for.
pub struct MeshlabJob<'a> {
    /// The file of the scan.
    pub scan: &'a Path,
    /// Where it may write.
    pub folder: &'a Path,
    /// Runs per setting; the median time counts.
    pub repeat: u32,
    /// The settings, as meshlab.py reads them.
    pub settings: &'a [&'a str],
}

/// A peer's surface of a scan.
pub struct PeerSurface {
    /// The setting it was made with.
    pub setting: String,
    /// The surface.
    pub mesh: TriMesh,
    /// Wall time of making it.
    pub seconds: f64,
}

impl Scripts<'_> {
    /// What a script of the folder says on its standard output.
    pub fn run(&self, script: &str, arguments: &[&dyn AsRef<OsStr>]) -> Result<String> {
        python(self.python, &self.folder.join(script), arguments)
    }

    /// MeshLab's surfaces of a scan, by meshlab.py. Its files are removed once `load` has read them.
    pub fn meshlab(
        &self,
        job: &MeshlabJob<'_>,
        load: &dyn Fn(&Path) -> Result<TriMesh>,
    ) -> Result<Vec<PeerSurface>> {
        let repeat = job.repeat.to_string();
        let mut command: Vec<&dyn AsRef<OsStr>> = vec![&job.scan, &job.folder, &repeat];
        command.extend(job.settings.iter().map(|s| s as &dyn AsRef<OsStr>));
        let out = self.run("meshlab.py", &command)?;
        let mut made = Vec::new();
        for line in out.lines().filter(|l| l.starts_with('{')) {
            let said: Value =
                serde_json::from_str(line).context("meshlab.py said something that is no JSON")?;
            let (Some(setting), Some(file), Some(seconds)) =
                (said["setting"].as_str(), said["file"].as_str(), said["seconds"].as_f64())
            else {
                bail!("meshlab.py said {line}: setting, file and seconds were expected");
            };
            made.push(PeerSurface { setting: setting.to_owned(), mesh: load(Path::new(file))?, seconds });
            let _ = std::fs::remove_file(file);
        }
        Ok(made)
    }
}

/// What a script says on its standard output.
pub fn python(program: &Path, script: &Path, arguments: &[&dyn AsRef<OsStr>]) -> Result<String> {
    let out = Command::new(program)
        .arg(script)
        .args(arguments.iter().map(|a| a.as_ref()))
        .output()
        .with_context(|| format!("cannot start {}. Give --python PROGRAM", program.display()))?;
    if !out.status.success() {
        let said = String::from_utf8_lossy(&out.stderr);
        let last = said.lines().rev().find(|l| !l.trim().is_empty()).unwrap_or("no message");
        bail!(
            "{} failed: {last}. It needs the packages of tests/requirements.txt; \
             run from the repository's root or give --scripts",
            script.display()
        );
    }
    Ok(String::from_utf8_lossy(&out.stdout).into_owned())
}
