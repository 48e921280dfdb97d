//! Reading, the door: finds the format, calls its reader, checks what it gives, and hands out the report.

use crate::content::{Content, Polygons};
use crate::error::{Error, Location, Result};
use crate::format::Format;
use crate::input::{Input, can_allocate};
use crate::report::LoadReport;
use crate::stopping::READING;
use crate::{e57, gltf, las, obj, off, pcd, ply, stl, text, xyz};
use atlasfit::Stop;
use atlasfit::geometry::{PointCloud, TriMesh};
use std::io::{Read, Seek};
use std::path::Path;

/// How to read.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct LoadOptions {
    /// Most bytes that reading may hold at a time, the file's own bytes included; `None` = no limit.
    pub max_memory_bytes: Option<u64>,
    /// The format; `None` = what the content says.
    pub format: Option<Format>,
    /// What ends the reading early: a cancel, a deadline. Heard within 100 ms.
    pub stop: Stop,
}

atlasfit::setters!(LoadOptions {
    with_max_memory_bytes: max_memory_bytes: Option<u64>,
    with_format: format: Option<Format>,
    with_stop: stop: Stop,
});

/// A file's content.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Loaded {
    /// The points (of a mesh: its vertices) in file order and in the file's unit, with their attributes.
    /// Points that are not finite are kept as they are and counted in the report: whoever works on the cloud
    /// drops them.
    pub cloud: PointCloud,
    /// Triangles; empty for a cloud.
    pub faces: Vec<[u32; 3]>,
    /// Texture coordinates per corner of each face, v up.
    pub corner_uv: Option<Vec<[[f32; 2]; 3]>>,
    /// Unit normals per corner of each face, where those of a vertex differ between its faces (OBJ, glTF);
    /// those of the cloud are means of them then.
    pub corner_normals: Option<Vec<[[f32; 3]; 3]>>,
    /// UV chart per face where the file names one (PLY face property `chart`).
    pub face_chart: Option<Vec<u32>>,
    /// The faces as the file has them, where some have more than three corners.
    pub polygons: Option<Polygons>,
    /// The bytes of the image file (PNG, JPEG) that colours the faces through `corner_uv`; the first where
    /// there are several. `None` also where the image cannot be read.
    pub texture: Option<Vec<u8>>,
    /// What the file holds besides, which this content has no place for, in words.
    pub left_out: Vec<String>,
    /// The format found.
    pub format: Format,
    /// What was repaired or left out.
    pub report: LoadReport,
}

impl Loaded {
    /// Bytes of memory that writing this content in a format takes: see [`Format::memory_to_write`].
    #[must_use]
    pub fn memory_to_write(&self, format: Format) -> u64 {
        let uv = self.corner_uv.as_ref().map_or(0, |uv| size_of_val(&uv[..]));
        let normals = self.corner_normals.as_ref().map_or(0, |n| size_of_val(&n[..]));
        let corners = self.polygons.as_ref().map_or(0, |p| 4 * (p.sizes.len() + p.corners.len()));
        let texture = self.texture.as_ref().map_or(0, Vec::len);
        let faces = size_of_val(&self.faces[..]) + uv + normals + corners + texture;
        format.memory_to_write(self.cloud.bytes() + faces as u64, (uv + normals) as u64)
    }

    /// Gives the vertices of a mesh without normals those of its faces: then its points say which way they
    /// face.
    pub fn normals_from_faces(&mut self) {
        if self.cloud.normals.is_none() && !self.faces.is_empty() {
            self.cloud.normals =
                Some(atlasfit::geometry::mesh::vertex_normals(&self.cloud.positions, &self.faces));
        }
    }

    /// The content as a mesh (without triangles for a cloud).
    #[must_use]
    pub fn into_mesh(self) -> TriMesh {
        TriMesh {
            positions: self.cloud.positions,
            triangles: self.faces,
            normals: self.cloud.normals,
            colors: self.cloud.colors,
            attributes: self.cloud.attributes,
            corner_uv: self.corner_uv,
            corner_normals: self.corner_normals,
            face_chart: self.face_chart,
        }
    }
}

/// Reads a file.
///
/// ```no_run
/// use atlasfit_io::{LoadOptions, load};
/// # fn main() -> atlasfit_io::Result<()> {
/// let loaded = load("scan.e57".as_ref(), &LoadOptions::default())?;
/// println!("{} points of a {} file", loaded.cloud.len(), loaded.format.name());
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Error`]: unreadable, of no known format, broken beyond repair, over the memory limit, or stopped.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded> {
    let io = |action| move |source| Error::io(path, action, source);
    let mut file = std::fs::File::open(path).map_err(io("open it"))?;
    let about = file.metadata().map_err(io("open it"))?;
    if about.is_dir() {
        return Err(Error::Unsupported {
            file: path.display().to_string(),
            what: "this is a folder".into(),
            advice: "Give a file".into(),
        });
    }
    if about.is_file() && about.len() > HEAD as u64 {
        let mut head = vec![0; HEAD];
        file.read_exact(&mut head).map_err(io("read it"))?;
        let input = Input::whole(path, &head, options.max_memory_bytes).until(&options.stop);
        let input = input.with_rest(&mut file, about.len() as usize);
        if let Some(format) = format_of_rows(&input, options.format) {
            return read(input, format);
        }
        file.rewind().map_err(io("read it"))?;
    }
    // These bytes exist: room for them (and one more, to notice the end) spares copying as the buffer grows.
    let data = read_all(path, file, about.len().saturating_add(1), options)?;
    load_bytes(path, &data, options)
}

/// The first bytes of a file, which show whether the rest is rows that can be read block by block.
const HEAD: usize = 1 << 16;

/// The format of a file that is rows of bytes behind its header, which `input.data` holds as a whole.
fn format_of_rows(input: &Input<'_>, asked: Option<Format>) -> Option<Format> {
    let format = asked.or_else(|| Format::detect(input.data, input.path))?;
    let rows = match format {
        Format::Ply => ply::is_rows(input),
        Format::Pcd => pcd::is_rows(input),
        Format::Las => las::is_rows(input),
        _ => false,
    };
    rows.then_some(format)
}

/// The bytes of a stream, up to one more than the memory limit.
fn read_all(name: &Path, mut reader: impl Read, expected: u64, options: &LoadOptions) -> Result<Vec<u8>> {
    let file = || name.display().to_string();
    // Special files claim any length: beyond this the buffer grows with what is there.
    const AT_ONCE: u64 = 1 << 30;
    // What is read between two looks at what ends the reading: about a millisecond.
    const CHUNK: u64 = 4 << 20;
    let most = options.max_memory_bytes.unwrap_or(u64::MAX).saturating_add(1);
    if expected > most {
        let needed_bytes = expected.saturating_sub(1);
        return Err(Error::OutOfMemory { file: file(), needed_bytes, limit_bytes: most - 1 });
    }
    let at_once = expected.min(AT_ONCE);
    can_allocate(at_once, &file())?;
    let mut data = Vec::with_capacity(at_once as usize);
    let io = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::OutOfMemory => Error::AllocationFailed { file: file(), bytes: expected },
        _ => Error::Io { file: file(), action: "read it", source },
    };
    while (data.len() as u64) < most {
        let chunk = CHUNK.min(most - data.len() as u64);
        let read = reader.by_ref().take(chunk).read_to_end(&mut data).map_err(io)?;
        options.stop.check(READING).map_err(Error::Stopped)?;
        if (read as u64) < chunk {
            break;
        }
    }
    Ok(data)
}

/// Reads from a stream. `name` is used in messages, to break ties between formats, and to find files beside
/// it.
///
/// ```
/// use atlasfit_io::{Format, LoadOptions, load_reader};
/// # fn main() -> atlasfit_io::Result<()> {
/// let stream = std::io::Cursor::new("0 0 0\n1 0 0.5\n");
/// let loaded = load_reader("points.xyz".as_ref(), stream, &LoadOptions::default())?;
/// assert_eq!((loaded.format, loaded.cloud.len()), (Format::Xyz, 2));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// As [`load`].
pub fn load_reader(name: &Path, reader: impl Read, options: &LoadOptions) -> Result<Loaded> {
    load_bytes(name, &read_all(name, reader, 0, options)?, options)
}

/// Reads from memory. `name` as in [`load_reader`].
///
/// ```
/// use atlasfit_io::{LoadOptions, load_bytes};
/// # fn main() -> atlasfit_io::Result<()> {
/// let off = b"OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 7\n";
/// let loaded = load_bytes("two.off".as_ref(), off, &LoadOptions::default())?;
/// assert_eq!(loaded.faces, [[0, 1, 2]]);
/// let note = loaded.report.notes[0].to_string();
/// assert_eq!(note, "faces that name a vertex that is not there, left out: 1 (first: triangle 1)");
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// As [`load`].
pub fn load_bytes(name: &Path, data: &[u8], options: &LoadOptions) -> Result<Loaded> {
    let data = &*text::utf8(data);
    let input = Input::whole(name, data, options.max_memory_bytes).until(&options.stop);
    let empty = data.trim_ascii().is_empty();
    let format = if empty { None } else { options.format.or_else(|| Format::detect(data, name)) };
    match format {
        Some(format) => read(input, format),
        None => Err(unknown(&input)),
    }
}

/// Reads the file with the reader of its format, and checks what that gives.
fn read(mut input: Input<'_>, format: Format) -> Result<Loaded> {
    input.reserve(input.data.len(), 1)?;
    let content = match format {
        Format::Ply => ply::read(&mut input),
        Format::Obj => obj::read(&mut input),
        Format::Off => off::read(&mut input),
        Format::Stl => stl::read(&mut input),
        Format::Xyz => xyz::read(&mut input),
        Format::Pcd => pcd::read(&mut input),
        Format::Las => las::read(&mut input),
        Format::E57 => e57::read(&mut input),
        Format::Gltf => gltf::read(&mut input),
    };
    // A reader that is stopped sees a file that ends early: this is why.
    input.check()?;
    Ok(loaded(input, content?, format))
}

/// Checks what a reader gives, and hands it out.
pub(crate) fn loaded(mut input: Input<'_>, mut content: Content, format: Format) -> Loaded {
    // A column whose length does not fit would make every user of the cloud check it again.
    let n = content.cloud.positions.len();
    debug_assert!(content.cloud.normals.as_ref().is_none_or(|c| c.len() == n));
    debug_assert!(content.cloud.colors.as_ref().is_none_or(|c| c.len() == n));
    debug_assert!(content.cloud.attributes.iter().all(|a| a.values.len() == n * a.width));
    let bad = |p: &&[f64; 3]| !p.iter().all(|c| c.is_finite());
    if let Some(first) = wrong_from(content.cloud.positions.as_flattened(), |c| c.is_finite()).map(|i| i / 3)
    {
        let count = content.cloud.positions[first..].iter().filter(bad).count();
        let what = "points with a coordinate that is not finite, kept in place";
        input.report.add(what, count as u64, Some(format!("point {first}")));
    }
    zero_wrong_numbers(&mut content, &mut input.report);
    let Content { cloud, faces, texture, left_out } = content;
    // Columns of faces mean nothing without faces.
    let is_mesh = !faces.triangles.is_empty();
    Loaded {
        cloud,
        corner_uv: faces.corner_uv.filter(|_| is_mesh),
        corner_normals: faces.corner_normals.filter(|_| is_mesh),
        face_chart: faces.chart.filter(|_| is_mesh),
        polygons: faces.polygons,
        faces: faces.triangles,
        texture,
        left_out,
        format,
        report: input.report,
    }
}

/// The first number that is not right. Block by block without a branch inside: nearly always all are right.
fn wrong_from<T: Copy>(values: &[T], right: impl Fn(T) -> bool) -> Option<usize> {
    const BLOCK: usize = 1024;
    let block = values.chunks(BLOCK).position(|b| !b.iter().fold(true, |all, &v| all & right(v)))?;
    let from = block * BLOCK;
    values[from..].iter().position(|&v| !right(v)).map(|i| from + i)
}

/// Normals, colours and texture coordinates that are not finite become 0 (of a normal: "unknown"), and are
/// counted, so that they do not spread into what is computed from them.
fn zero_wrong_numbers(content: &mut Content, report: &mut LoadReport) {
    fn zero<const N: usize>(rows: &mut [[f32; N]]) -> u64 {
        let Some(first) = wrong_from(rows.as_flattened(), |c| c.is_finite()) else { return 0 };
        let rows = &mut rows[first / N..];
        let wrong = rows.iter_mut().filter(|r| !r.iter().all(|c| c.is_finite()));
        wrong.map(|r| *r = [0.0; N]).count() as u64
    }
    if let Some(normals) = &mut content.cloud.normals {
        report.add("normals that are not finite, set to 0", zero(normals), None);
    }
    if let Some(normals) = &mut content.faces.corner_normals {
        zero(normals.as_flattened_mut());
    }
    if let Some(colors) = &mut content.cloud.colors {
        report.add("colours that are not finite, set to 0", zero(colors), None);
    }
    if let Some(uv) = &mut content.faces.corner_uv {
        report.add("texture coordinates that are not finite, set to 0", zero(uv.as_flattened_mut()), None);
    }
}

/// The error of a file whose format is not known.
fn unknown(input: &Input<'_>) -> Error {
    let known = "PLY, OBJ, OFF, STL, XYZ or other columns of numbers, PCD, LAS, LAZ, E57, glTF";
    let found = match input.data {
        data if data.trim_ascii().is_empty() => "an empty file".into(),
        [0x1F, 0x8B, ..] => return input.unsupported("this is gzip-compressed", "Unpack it first (gunzip)"),
        [b'P', b'K', 3, 4, ..] => return input.unsupported("this is a ZIP archive", "Unpack it first"),
        data => text::quote(&data[..data.len().min(24)]),
    };
    input.malformed(
        Location::Byte(0),
        found,
        format!("the start of one of: {known}"),
        "Check that this is the right file",
    )
}
