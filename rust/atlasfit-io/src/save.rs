//! Writing, the door: checks the data, calls the format's writer. The file is written beside the output
//! first, then renamed, so that a run that fails never touches what was there.

use crate::content::Polygons;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::job::{Job, Texture, Written};
use crate::{gltf, obj, off, ply, stl, xyz};
use atlasfit::geometry::{PointCloud, TriMesh};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// How to write a mesh.
#[derive(Debug, Clone, Copy, Default)]
pub struct SaveMesh<'a> {
    /// The format; `None` = what the file name says.
    pub format: Option<Format>,
    /// Text instead of binary where a format has both.
    pub ascii: bool,
    /// The texture.
    pub texture: Option<Texture<'a>>,
    /// The polygons that the triangles were cut from: OBJ, PLY and OFF then get those. One whose UVs differ
    /// at a corner between its triangles is written as its triangles.
    pub polygons: Option<&'a Polygons>,
}

/// How to write a cloud.
#[derive(Debug, Clone, Copy, Default)]
pub struct SaveCloud {
    /// The format; `None` = what the file name says.
    pub format: Option<Format>,
    /// Text instead of binary where a format has both.
    pub ascii: bool,
}

/// What was written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Saved {
    /// The files, the output itself first.
    pub files: Vec<PathBuf>,
    /// What the format could not hold, in words; empty when reading the file gives the same data back.
    pub lost: Vec<String>,
}

/// Writes a point cloud.
///
/// ```
/// use atlasfit::geometry::PointCloud;
/// use atlasfit_io::{SaveCloud, save_cloud};
/// # fn main() -> atlasfit_io::Result<()> {
/// let cloud = PointCloud::from_positions(vec![[0.0; 3], [1.0, 0.5, 0.0]]);
/// let path = std::env::temp_dir().join(format!("save-cloud-{}.ply", std::process::id()));
/// let saved = save_cloud(&path, &cloud, &SaveCloud::default())?;
/// assert_eq!(saved.files, [path.clone()]);
/// assert!(saved.lost.is_empty(), "PLY holds everything");
/// # std::fs::remove_file(path).expect("it was written");
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Error::Unsupported`] for an unknown extension, [`Error::Io`].
pub fn save_cloud(path: &Path, cloud: &PointCloud, options: &SaveCloud) -> Result<Saved> {
    let job = Job {
        positions: &cloud.positions,
        normals: cloud.normals.as_deref(),
        colors: cloud.colors.as_deref(),
        attributes: &cloud.attributes,
        triangles: &[],
        corner_uv: None,
        face_chart: None,
        texture: None,
        polygons: None,
        ascii: options.ascii,
        stem: stem(path),
        extension: extension(path),
    };
    save(path, options.format, &job)
}

/// Writes a mesh.
///
/// ```
/// use atlasfit_io::{LoadOptions, SaveMesh, load, load_bytes, save_mesh};
/// # fn main() -> atlasfit_io::Result<()> {
/// let off = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
/// let mesh = load_bytes("one.off".as_ref(), off, &LoadOptions::default())?.into_mesh();
/// let path = std::env::temp_dir().join(format!("save-mesh-{}.glb", std::process::id()));
/// let saved = save_mesh(&path, &mesh, &SaveMesh::default())?;
/// assert!(saved.lost.is_empty());
/// let again = load(&path, &LoadOptions::default())?;
/// assert_eq!(again.faces, mesh.triangles);
/// # std::fs::remove_file(path).expect("it was written");
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// As [`save_cloud`]; also [`Error::Unsupported`] when a column of the mesh has a wrong length or a triangle
/// names a missing vertex.
pub fn save_mesh(path: &Path, mesh: &TriMesh, options: &SaveMesh<'_>) -> Result<Saved> {
    let job = Job {
        positions: &mesh.positions,
        normals: mesh.normals.as_deref(),
        colors: mesh.colors.as_deref(),
        attributes: &mesh.attributes,
        triangles: &mesh.triangles,
        corner_uv: mesh.corner_uv.as_deref(),
        face_chart: mesh.face_chart.as_deref(),
        texture: options.texture,
        polygons: options.polygons,
        ascii: options.ascii,
        stem: stem(path),
        extension: extension(path),
    };
    save(path, options.format, &job)
}

/// The extension of a file name, lower case.
fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// The file name without folder and extension; what a URI or an MTL cannot hold becomes an underscore.
fn stem(path: &Path) -> String {
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let safe = |c: char| if c.is_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '_' };
    let name: String = name.chars().map(safe).collect();
    if name.is_empty() { "out".into() } else { name }
}

fn save(path: &Path, format: Option<Format>, job: &Job<'_>) -> Result<Saved> {
    let unsupported = |what: String, advice: &str| Error::Unsupported {
        file: path.display().to_string(),
        what,
        advice: advice.into(),
    };
    let format = format.or_else(|| Format::from_path(path)).ok_or_else(|| {
        unsupported("no known format has this extension".into(), "Use .ply, .obj, .glb, .off, .stl or .xyz")
    })?;
    if !format.can_write() {
        let what = format!("{} files are only read, not written", format.name());
        return Err(unsupported(what, "Use .ply, .obj, .glb, .off, .stl or .xyz"));
    }
    check(job).map_err(|what| unsupported(what, "Correct the mesh before it is written"))?;
    let io = |action| move |source| Error::Io { file: path.display().to_string(), action, source };
    // A device or a pipe cannot be replaced: it is written to.
    if std::fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir()) {
        let mut out = BufWriter::new(File::create(path).map_err(io("open it"))?);
        let written =
            write(format, job, &mut out).and_then(|w| out.flush().map(|()| w)).map_err(io("write it"))?;
        return Ok(Saved { files: vec![path.into()], lost: written.lost });
    }
    let mut staged = Staged::default();
    let mut out = staged.create(path).map_err(io("write beside it"))?;
    let written =
        write(format, job, &mut out).and_then(|w| out.flush().map(|()| w)).map_err(io("write beside it"))?;
    drop(out);
    let folder = path.parent().unwrap_or(Path::new(""));
    for file in &written.beside {
        let mut out = staged.create(&folder.join(&file.name)).map_err(io("write beside it"))?;
        out.write_all(&file.bytes).and_then(|()| out.flush()).map_err(io("write beside it"))?;
    }
    let files = staged.commit().map_err(io("rename the finished file to it"))?;
    Ok(Saved { files, lost: written.lost })
}

fn write(format: Format, job: &Job<'_>, out: &mut impl Write) -> std::io::Result<Written> {
    match format {
        Format::Ply => ply::write(job, out),
        Format::Obj => obj::write(job, out),
        Format::Off => off::write(job, out),
        Format::Stl => stl::write(job, out),
        Format::Xyz => xyz::write(job, out),
        Format::Pcd | Format::Las | Format::E57 => Err(std::io::Error::other("this format is only read")),
        Format::Gltf => gltf::write(job, out),
    }
}

/// What is wrong with the data, in words: a column of a wrong length, or an index that is too large.
fn check(job: &Job<'_>) -> std::result::Result<(), String> {
    let n = job.positions.len();
    let column = |name: &str, len: Option<usize>, expected: usize| match len {
        Some(len) if len != expected => Err(format!("{name}: {len} entries where {expected} are needed")),
        _ => Ok(()),
    };
    column("normals", job.normals.map(<[_]>::len), n)?;
    column("colors", job.colors.map(<[_]>::len), n)?;
    for a in job.attributes {
        if a.width == 0 {
            return Err(format!("attribute {} has width 0", a.name));
        }
        column(&a.name, Some(a.values.len()), n.saturating_mul(a.width))?;
    }
    column("corner_uv", job.corner_uv.map(<[_]>::len), job.triangles.len())?;
    column("face_chart", job.face_chart.map(<[_]>::len), job.triangles.len())?;
    if let Some(p) = job.polygons {
        let sum = |less: usize| p.sizes.iter().map(|&s| (s as usize).saturating_sub(less)).sum::<usize>();
        column("polygons", Some(sum(2)), job.triangles.len())?;
        column("corners of the polygons", Some(p.corners.len()), sum(0))?;
        if p.sizes.iter().any(|&s| s < 3) || p.corners.iter().any(|&v| v as usize >= n) {
            return Err("a polygon has fewer than 3 corners or names a vertex that is not there".into());
        }
    }
    match job.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= n)) {
        Some(i) => Err(format!("triangle {i} names a vertex that is not there")),
        None => Ok(()),
    }
}

/// Files written under a hidden name beside their final one. Dropped without [`Staged::commit`], they vanish.
#[derive(Default)]
struct Staged {
    files: Vec<StagedFile>,
}

struct StagedFile {
    hidden: PathBuf,
    target: PathBuf,
}

impl Staged {
    fn create(&mut self, path: &Path) -> std::io::Result<BufWriter<File>> {
        let name = path.file_name().ok_or_else(|| std::io::Error::other("this is not a file name"))?;
        for attempt in 0..100 {
            let mut hidden = std::ffi::OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{}-{attempt}.part", std::process::id()));
            let hidden = path.with_file_name(hidden);
            match File::create_new(&hidden) {
                Ok(file) => {
                    self.files.push(StagedFile { hidden, target: path.to_owned() });
                    return Ok(BufWriter::with_capacity(1 << 16, file));
                }
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e),
            }
        }
        Err(std::io::Error::other("a hundred unfinished files lie beside it already: delete *.part"))
    }
    /// Renames all, the output itself last: once it is there, all it needs is there.
    fn commit(mut self) -> std::io::Result<Vec<PathBuf>> {
        let done: Vec<PathBuf> = self.files.iter().map(|f| f.target.clone()).collect();
        while let Some(file) = self.files.last() {
            std::fs::rename(&file.hidden, &file.target)?;
            self.files.pop();
        }
        Ok(done)
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        for file in &self.files {
            let _ = std::fs::remove_file(&file.hidden);
        }
    }
}
