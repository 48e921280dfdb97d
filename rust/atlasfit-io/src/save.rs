//! Writing, the door: checks the data, calls the format's writer.
//!
//! In: a mesh or a cloud. Out: a file, written whole or not at all (`staged`), or the same bytes in a stream;
//! what the format could not hold, in words.

use crate::content::Polygons;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::job::{Job, Texture, Written};
use crate::staged::{Staged, is_special};
use crate::stopping::{WRITING, Watched};
use crate::{gltf, obj, off, ply, stl, xyz};
use atlasfit::Stop;
use atlasfit::geometry::{PointCloud, TriMesh};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// How to write a mesh.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
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
    /// What ends the writing early: a cancel, a deadline. Nothing is written then.
    pub stop: Stop,
}

impl<'a> SaveMesh<'a> {
    /// These options with another [`texture`](Self::texture).
    #[must_use]
    pub fn with_texture(self, texture: Option<Texture<'a>>) -> Self {
        Self { texture, ..self }
    }
    /// These options with other [`polygons`](Self::polygons).
    #[must_use]
    pub fn with_polygons(self, polygons: Option<&'a Polygons>) -> Self {
        Self { polygons, ..self }
    }
}

atlasfit::setters! {
    SaveMesh<'_> {
        with_format: format: Option<Format>,
        with_ascii: ascii: bool,
        with_stop: stop: Stop,
    }
}

/// How to write a cloud.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct SaveCloud {
    /// The format; `None` = what the file name says.
    pub format: Option<Format>,
    /// Text instead of binary where a format has both.
    pub ascii: bool,
    /// What ends the writing early: a cancel, a deadline. Nothing is written then.
    pub stop: Stop,
}

atlasfit::setters!(SaveCloud {
    with_format: format: Option<Format>,
    with_ascii: ascii: bool,
    with_stop: stop: Stop,
});

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
/// [`Error::Unsupported`] for an unknown extension, [`Error::Io`], [`Error::Stopped`].
pub fn save_cloud(path: &Path, cloud: &PointCloud, options: &SaveCloud) -> Result<Saved> {
    save(path, options.format, &cloud_job(path, cloud, options), &options.stop)
}

/// Writes a point cloud to a stream, which holds one file: `options.format` says which, and what belongs
/// beside it is among what was lost, which is returned.
///
/// # Errors
/// As [`save_cloud`].
pub fn write_cloud(out: impl Write, cloud: &PointCloud, options: &SaveCloud) -> Result<Vec<String>> {
    stream(out, options.format, &cloud_job(STREAM.as_ref(), cloud, options), &options.stop)
}

/// What a stream is called in messages.
const STREAM: &str = "the output stream";

fn cloud_job<'j>(path: &Path, cloud: &'j PointCloud, options: &'j SaveCloud) -> Job<'j> {
    Job {
        positions: &cloud.positions,
        normals: cloud.normals.as_deref(),
        colors: cloud.colors.as_deref(),
        attributes: &cloud.attributes,
        triangles: &[],
        corner_uv: None,
        corner_normals: None,
        face_chart: None,
        texture: None,
        polygons: None,
        ascii: options.ascii,
        stem: stem(path),
        extension: extension(path, options.format),
        stop: &options.stop,
    }
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
    save(path, options.format, &mesh_job(path, mesh, options), &options.stop)
}

/// Writes a mesh to a stream; as [`write_cloud`].
///
/// # Errors
/// As [`save_mesh`].
pub fn write_mesh(out: impl Write, mesh: &TriMesh, options: &SaveMesh<'_>) -> Result<Vec<String>> {
    stream(out, options.format, &mesh_job(STREAM.as_ref(), mesh, options), &options.stop)
}

pub(crate) fn mesh_job<'j>(path: &Path, mesh: &'j TriMesh, options: &'j SaveMesh<'j>) -> Job<'j> {
    Job {
        positions: &mesh.positions,
        normals: mesh.normals.as_deref(),
        colors: mesh.colors.as_deref(),
        attributes: &mesh.attributes,
        triangles: &mesh.triangles,
        corner_uv: mesh.corner_uv.as_deref(),
        corner_normals: mesh.corner_normals.as_deref(),
        face_chart: mesh.face_chart.as_deref(),
        texture: options.texture,
        polygons: options.polygons,
        ascii: options.ascii,
        stem: stem(path),
        extension: extension(path, options.format),
        stop: &options.stop,
    }
}

/// The extension of a file name, lower case; of a name without one that of the format.
fn extension(path: &Path, format: Option<Format>) -> String {
    match path.extension() {
        Some(e) => e.to_string_lossy().to_lowercase(),
        None => format.map_or("", Format::extension).into(),
    }
}

/// The file name without folder and extension; what a URI or an MTL cannot hold becomes an underscore.
fn stem(path: &Path) -> String {
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let safe = |c: char| if c.is_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '_' };
    let name: String = name.chars().map(safe).collect();
    if name.is_empty() { "out".into() } else { name }
}

/// The format to write `job` in, once nothing is wrong with either.
pub(crate) fn checked(path: &Path, format: Option<Format>, job: &Job<'_>) -> Result<Format> {
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
    Ok(format)
}

fn save(path: &Path, format: Option<Format>, job: &Job<'_>, stop: &Stop) -> Result<Saved> {
    let format = checked(path, format, job)?;
    save_by(path, stop, |out| write(format, job, out))
}

/// Writes the files of an output, whole or not at all; `write` writes the output itself.
pub(crate) fn save_by(
    path: &Path,
    stop: &Stop,
    write: impl FnOnce(Watched<'_, File>) -> std::io::Result<Written>,
) -> Result<Saved> {
    let failed = |action: &'static str| {
        move |source| match stop.check(WRITING) {
            Err(stopped) => Error::Stopped(stopped),
            Ok(()) => Error::io(path, action, source),
        }
    };
    if is_special(path) {
        let out = File::create(path).map_err(failed("open it"))?;
        let written = write(Watched { out, stop }).map_err(failed("write it"))?;
        return Ok(Saved { files: vec![path.into()], lost: alone(written) });
    }
    let mut staged = Staged::default();
    let out = staged.create(path).map_err(failed("write beside it"))?;
    let written = write(Watched { out, stop }).map_err(failed("write beside it"))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    for file in &written.beside {
        let out = staged.create(&folder.join(&file.name)).map_err(failed("write beside it"))?;
        let mut out = Watched { out, stop };
        out.write_all(&file.bytes).and_then(|()| out.flush()).map_err(failed("write beside it"))?;
    }
    stop.check(WRITING).map_err(Error::Stopped)?;
    let files = staged.commit().map_err(failed("rename the finished file to it"))?;
    Ok(Saved { files, lost: written.lost })
}

/// Writes to a stream; gives what was lost.
fn stream(out: impl Write, format: Option<Format>, job: &Job<'_>, stop: &Stop) -> Result<Vec<String>> {
    let format = checked(STREAM.as_ref(), format, job)?;
    let written = write(format, job, Watched { out, stop }).map_err(|source| match stop.check(WRITING) {
        Err(stopped) => Error::Stopped(stopped),
        Ok(()) => Error::Io { file: STREAM.into(), action: "write to it", source },
    })?;
    Ok(alone(written))
}

/// What is lost where nothing can be written beside the output.
fn alone(written: Written) -> Vec<String> {
    let beside = written.beside.iter().map(|f| format!("{}, which belongs beside it", f.name));
    written.lost.into_iter().chain(beside).collect()
}

fn write(format: Format, job: &Job<'_>, out: impl Write) -> std::io::Result<Written> {
    // Writers write single numbers.
    let mut out = BufWriter::with_capacity(1 << 16, out);
    let written = write_as(format, job, &mut out)?;
    out.flush()?;
    Ok(written)
}

fn write_as(format: Format, job: &Job<'_>, out: &mut impl Write) -> std::io::Result<Written> {
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
    column("corner_normals", job.corner_normals.map(<[_]>::len), job.triangles.len())?;
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
