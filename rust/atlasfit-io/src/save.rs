//! Writing: beside the output first, then renamed, so that a run that fails never touches what was there.

use crate::error::{Error, Result};
use crate::faces::Polygons;
use crate::format::Format;
use crate::{gltf, obj, off, ply, stl, xyz};
use atlasfit::geometry::{Attribute, PointCloud, TriMesh};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// A texture for a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Texture<'a> {
    /// The bytes of a PNG file. GLB holds them inside; for OBJ and PLY they go to a PNG file beside the output,
    /// of the output's name.
    Png(&'a [u8]),
    /// The name of an image file that exists already, relative to the output's folder.
    File(&'a str),
}

/// How to write a mesh.
#[derive(Debug, Clone, Copy, Default)]
pub struct SaveMesh<'a> {
    /// The format; `None` = what the file name says.
    pub format: Option<Format>,
    /// Text instead of binary where a format has both.
    pub ascii: bool,
    /// The texture.
    pub texture: Option<Texture<'a>>,
    /// The polygons that the triangles were cut from: OBJ, PLY and OFF then get those. One whose UVs differ at a corner
    /// between its triangles is written as its triangles.
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
pub struct Saved {
    /// The files, the output itself first.
    pub files: Vec<PathBuf>,
    /// What the format could not hold, in words; empty when reading the file gives the same data back.
    pub lost: Vec<String>,
}

/// What every writer gets: a mesh, or a cloud as a mesh without faces.
pub(crate) struct Job<'a> {
    pub positions: &'a [[f64; 3]],
    pub normals: Option<&'a [[f32; 3]]>,
    pub colors: Option<&'a [[f32; 4]]>,
    pub attributes: &'a [Attribute],
    pub triangles: &'a [[u32; 3]],
    pub corner_uv: Option<&'a [[[f32; 2]; 3]]>,
    pub face_chart: Option<&'a [u32]>,
    pub texture: Option<Texture<'a>>,
    pub polygons: Option<&'a Polygons>,
    pub ascii: bool,
    /// The output's file name without folder and extension, and without what a URI or an MTL cannot hold.
    pub stem: String,
    /// The output's extension, lower case.
    pub extension: String,
}

/// What a writer gives back besides the bytes.
#[derive(Default)]
pub(crate) struct Written {
    pub lost: Vec<String>,
    /// Other files, by name, that belong beside the output.
    pub beside: Vec<(String, Vec<u8>)>,
}

/// A face as it is written.
pub(crate) struct OutFace<'f> {
    /// Its vertices.
    pub corners: &'f [u32],
    /// Texture coordinates per corner; empty where there are none.
    pub uv: &'f [[f32; 2]],
    /// Its first triangle.
    pub triangle: usize,
}

impl Job<'_> {
    /// Calls `each` with every face in order: polygons where they are known and their triangles agree on the UVs.
    pub fn each_face(&self, mut each: impl FnMut(OutFace<'_>) -> std::io::Result<()>) -> std::io::Result<()> {
        let uv_of = |t: usize| self.corner_uv.map_or(&[][..], |uv| &uv[t][..]);
        let Some(polygons) = self.polygons else {
            for (t, corners) in self.triangles.iter().enumerate() {
                each(OutFace { corners, uv: uv_of(t), triangle: t })?;
            }
            return Ok(());
        };
        let (mut t, mut corner) = (0, 0);
        let mut uv = Vec::new();
        for &n in &polygons.sizes {
            let corners = &polygons.corners[corner..corner + n as usize];
            let triangles = t..t + n as usize - 2;
            (t, corner) = (triangles.end, corner + n as usize);
            if n == 3 || self.polygon_uv(corners, triangles.clone(), &mut uv) {
                let uv = if n == 3 { uv_of(triangles.start) } else { &uv };
                let corners = if n == 3 { &self.triangles[triangles.start] } else { corners };
                each(OutFace { corners, uv, triangle: triangles.start })?;
                continue;
            }
            for t in triangles {
                each(OutFace { corners: &self.triangles[t], uv: uv_of(t), triangle: t })?;
            }
        }
        Ok(())
    }

    /// Gathers a polygon's UVs; false where its triangles do not agree on them, or on their chart.
    fn polygon_uv(&self, corners: &[u32], triangles: std::ops::Range<usize>, uv: &mut Vec<[f32; 2]>) -> bool {
        uv.clear();
        if self.face_chart.is_some_and(|c| triangles.clone().any(|t| c[t] != c[triangles.start])) {
            return false;
        }
        let Some(all) = self.corner_uv else { return true };
        for &v in corners {
            let mut found = triangles
                .clone()
                .flat_map(|t| (0..3).map(move |k| (t, k)))
                .filter(|&(t, k)| self.triangles[t][k] == v)
                .map(|(t, k)| all[t][k]);
            let Some(first) = found.next() else { return false };
            if found.any(|other| other != first) {
                return false;
            }
            uv.push(first);
        }
        true
    }

    /// Number of faces that [`Self::each_face`] gives.
    pub fn face_count(&self) -> usize {
        let mut count = 0;
        let _ = self.each_face(|_| {
            count += 1;
            Ok(())
        });
        count
    }

    /// Whether some position needs more than a 32-bit float.
    pub fn needs_f64(&self) -> bool {
        self.positions.iter().flatten().any(|&c| f64::from(c as f32) != c && !c.is_nan())
    }
    /// Whether some point is not opaque.
    pub fn has_alpha(&self) -> bool {
        self.colors.is_some_and(|c| c.iter().any(|c| c[3] != 1.0))
    }
    /// The image's file name, and the image itself if it must be written beside the output.
    pub fn texture_file(&self, written: &mut Written) -> Option<String> {
        match self.texture? {
            Texture::File(name) => Some(name.to_owned()),
            Texture::Png(bytes) => {
                let name = format!("{}.png", self.stem);
                written.beside.push((name.clone(), bytes.to_vec()));
                Some(name)
            }
        }
    }
    /// The names of the attributes, for a message.
    pub fn attribute_names(&self) -> String {
        self.attributes.iter().map(|a| a.name.as_str()).collect::<Vec<_>>().join(", ")
    }
}

/// Rounds a colour channel in [0, 1] to 8 bits.
pub(crate) fn to_u8(v: f32) -> u8 {
    (v * 255.0).round() as u8
}

/// Says if 8 bits per channel do not hold these colours.
pub(crate) fn colors_lost(colors: Option<&[[f32; 4]]>, written: &mut Written) {
    let exact = |v: f32| (f32::from(to_u8(v)) / 255.0 - v).abs() < 1e-6;
    if colors.is_some_and(|c| c.iter().flatten().any(|&v| !exact(v))) {
        written.lost.push("colours rounded to 8 bits".into());
    }
}

/// Writes a point cloud.
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
        extension: path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default(),
    };
    save(path, options.format, &job)
}

/// Writes a mesh.
///
/// # Errors
/// As [`save_cloud`]; also [`Error::Unsupported`] when a column of the mesh has a wrong length or a triangle names
/// a missing vertex.
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
        extension: path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default(),
    };
    save(path, options.format, &job)
}

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
    for (name, bytes) in &written.beside {
        let mut out = staged.create(&folder.join(name)).map_err(io("write beside it"))?;
        out.write_all(bytes).and_then(|()| out.flush()).map_err(io("write beside it"))?;
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

/// Files written beside their final places. Dropped without [`Staged::commit`], they vanish.
#[derive(Default)]
struct Staged {
    files: Vec<(PathBuf, PathBuf)>,
}

impl Staged {
    fn create(&mut self, path: &Path) -> std::io::Result<BufWriter<File>> {
        let name = path.file_name().ok_or_else(|| std::io::Error::other("this is not a file name"))?;
        for attempt in 0..100 {
            let mut hidden = std::ffi::OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{}-{attempt}.part", std::process::id()));
            let beside = path.with_file_name(hidden);
            match File::create_new(&beside) {
                Ok(file) => {
                    self.files.push((beside, path.to_owned()));
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
        let done: Vec<PathBuf> = self.files.iter().map(|f| f.1.clone()).collect();
        while let Some((from, to)) = self.files.last() {
            std::fs::rename(from, to)?;
            self.files.pop();
        }
        Ok(done)
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        for (beside, _) in &self.files {
            let _ = std::fs::remove_file(beside);
        }
    }
}
