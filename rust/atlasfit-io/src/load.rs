//! Reading: finds the format, calls its reader, checks limits, gathers the report.

use crate::error::{Error, Place, Result};
use crate::faces::Polygons;
use crate::format::Format;
use crate::{e57, gltf, las, obj, off, pcd, ply, stl, text, xyz};
use atlasfit::geometry::{PointCloud, TriMesh};
use std::io::{Read, Seek};
use std::path::Path;

/// How to read.
#[derive(Debug, Clone, Default)]
pub struct LoadOptions {
    /// Most bytes that reading may hold at a time, the file's own bytes included; `None` = no limit.
    pub max_memory_bytes: Option<u64>,
}

/// One kind of repair or loss, and how often it was met.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// What was met and what was done about it, in words: "faces that name a missing vertex, left out".
    pub what: String,
    /// How many times.
    pub count: u64,
    /// The first of them, for example "line 12".
    pub first: Option<String>,
}

impl std::fmt::Display for Note {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.count, self.what)?;
        self.first.as_ref().map_or(Ok(()), |at| write!(f, " (first: {at})"))
    }
}

/// What reading had to repair, leave out, or wants known.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LoadReport {
    /// In the order met; each `what` once.
    pub notes: Vec<Note>,
}

impl LoadReport {
    /// Counts `count` more of `what`. Nothing happens for a count of 0.
    pub(crate) fn add(&mut self, what: impl Into<String>, count: u64, first: Option<String>) {
        if count == 0 {
            return;
        }
        let what = what.into();
        match self.notes.iter_mut().find(|n| n.what == what) {
            Some(note) => note.count += count,
            None => self.notes.push(Note { what, count, first }),
        }
    }
}

/// A file's content.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The points (of a mesh: its vertices) in file order, with their attributes. Points that are not finite
    /// are kept as they are and counted in the report: whoever works on the cloud drops them.
    pub cloud: PointCloud,
    /// Triangles; empty for a cloud.
    pub faces: Vec<[u32; 3]>,
    /// Texture coordinates per corner of each face, v up.
    pub corner_uv: Option<Vec<[[f32; 2]; 3]>>,
    /// UV chart per face where the file names one (PLY face property `chart`).
    pub face_chart: Option<Vec<u32>>,
    /// The faces as the file has them, where some have more than three corners.
    pub polygons: Option<Polygons>,
    /// The image file that colours the faces through `corner_uv`, as it is (PNG, JPEG); the first where there are
    /// several. An image that cannot be read is none.
    pub texture: Option<Vec<u8>>,
    /// The format found.
    pub format: Format,
    /// What was repaired or left out.
    pub report: LoadReport,
}

impl Loaded {
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
            face_chart: self.face_chart,
        }
    }
}

/// What a reader gives back.
#[derive(Default)]
pub(crate) struct Content {
    pub cloud: PointCloud,
    pub faces: Vec<[u32; 3]>,
    pub corner_uv: Option<Vec<[[f32; 2]; 3]>>,
    pub face_chart: Option<Vec<u32>>,
    pub polygons: Option<Polygons>,
    pub texture: Option<Vec<u8>>,
}

/// What a reader works on: the bytes, the memory limit, the report.
pub(crate) struct Input<'a> {
    /// The file's name for messages.
    pub file: String,
    /// Where the file lies, for formats that name others beside them.
    pub path: &'a Path,
    /// Its bytes; of a file that is read block by block, the first ones.
    pub data: &'a [u8],
    /// How many bytes the whole file has.
    pub len: usize,
    /// The report so far.
    pub report: LoadReport,
    /// What comes behind `data`.
    rest: Option<&'a mut std::fs::File>,
    limit: Option<u64>,
    used: u64,
}

impl<'a> Input<'a> {
    /// A file that this one names, from its own folder or below: a model has no business anywhere else.
    pub fn beside(&mut self, name: &str) -> Option<Vec<u8>> {
        let name = Path::new(name);
        if !name
            .components()
            .all(|c| matches!(c, std::path::Component::Normal(_) | std::path::Component::CurDir))
        {
            return None;
        }
        let path = self.path.with_file_name("").join(name);
        let about = std::fs::metadata(&path).ok().filter(std::fs::Metadata::is_file)?;
        self.reserve(usize::try_from(about.len()).ok()?, 1).ok()?;
        std::fs::read(path).ok()
    }

    fn new(path: &'a Path, data: &'a [u8], options: &LoadOptions) -> Self {
        Input {
            file: path.display().to_string(),
            path,
            data,
            len: data.len(),
            report: LoadReport::default(),
            rest: None,
            limit: options.max_memory_bytes,
            used: 0,
        }
    }

    /// Calls `each` with `block` bytes after `block` bytes of the `length` from byte `at` on, which the file has. May be called once.
    pub fn blocks(
        &mut self,
        at: usize,
        length: usize,
        block: usize,
        mut each: impl FnMut(&[u8]),
    ) -> Result<()> {
        let Some(rest) = self.rest.take() else {
            self.data[at..at + length].chunks(block.max(1)).for_each(each);
            return Ok(());
        };
        let mut here = &self.data[at..];
        let mut buffer = vec![0; block.min(length)];
        let mut left = length;
        while left > 0 {
            let block = &mut buffer[..block.min(left)];
            let (now, later) = block.split_at_mut(block.len().min(here.len()));
            now.copy_from_slice(&here[..now.len()]);
            here = &here[now.len()..];
            rest.read_exact(later).map_err(|source| Error::Io {
                file: self.file.clone(),
                action: "read it",
                source,
            })?;
            left -= block.len();
            each(block);
        }
        Ok(())
    }

    /// Accounts for `count` more things of `bytes` bytes each.
    pub fn reserve(&mut self, count: usize, bytes: usize) -> Result<()> {
        self.used = self.used.saturating_add((count as u64).saturating_mul(bytes as u64));
        match self.limit {
            Some(limit_bytes) if self.used > limit_bytes => {
                Err(Error::OutOfMemory { file: self.file.clone(), needed_bytes: self.used, limit_bytes })
            }
            _ => Ok(()),
        }
    }
    pub fn malformed(
        &self,
        at: Place,
        found: impl Into<String>,
        expected: impl Into<String>,
        advice: impl Into<String>,
    ) -> Error {
        Error::Malformed {
            file: self.file.clone(),
            at,
            found: found.into(),
            expected: expected.into(),
            advice: advice.into(),
        }
    }
    pub fn unsupported(&self, what: impl Into<String>, advice: impl Into<String>) -> Error {
        Error::Unsupported { file: self.file.clone(), what: what.into(), advice: advice.into() }
    }
}

/// Reads a file.
///
/// # Errors
/// [`Error`]: unreadable, of no known format, broken beyond repair, or over the memory limit.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded> {
    let io = |action| move |source| Error::Io { file: path.display().to_string(), action, source };
    let file = std::fs::File::open(path).map_err(io("open it"))?;
    let about = file.metadata().map_err(io("open it"))?;
    if about.is_dir() {
        return Err(Error::Unsupported {
            file: path.display().to_string(),
            what: "this is a folder".into(),
            advice: "Give a file".into(),
        });
    }
    let mut file = file;
    if about.is_file() && about.len() > HEAD as u64 {
        let mut head = vec![0; HEAD];
        file.read_exact(&mut head).map_err(io("read it"))?;
        let mut input = Input { len: about.len() as usize, ..Input::new(path, &head, options) };
        if let Some(format) = format_of_rows(&input) {
            input.rest = Some(&mut file);
            return read(input, format);
        }
        file.rewind().map_err(io("read it"))?;
    }
    // These bytes exist: room for them (and one more, to see the end) spares copying as the buffer grows.
    let data = read_all(path, file, about.len().saturating_add(1), options)?;
    load_bytes(path, &data, options)
}

/// The first bytes of a file, which show whether the rest is rows that can be read block by block.
const HEAD: usize = 1 << 16;

/// The format of a file that is rows of bytes behind its header, which `input.data` holds whole.
fn format_of_rows(input: &Input<'_>) -> Option<Format> {
    let format = Format::detect(input.data, input.path)?;
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
    // Special files claim any length: beyond this the buffer grows with what is there.
    const AT_ONCE: u64 = 1 << 30;
    let most = options.max_memory_bytes.unwrap_or(u64::MAX).saturating_add(1);
    let mut data = Vec::with_capacity(expected.min(most).min(AT_ONCE) as usize);
    reader.by_ref().take(most).read_to_end(&mut data).map_err(|source| Error::Io {
        file: name.display().to_string(),
        action: "read it",
        source,
    })?;
    Ok(data)
}

/// Reads from a stream. `name` is used in messages, to break ties between formats, and to find files beside it.
///
/// # Errors
/// As [`load`].
pub fn load_reader(name: &Path, reader: impl Read, options: &LoadOptions) -> Result<Loaded> {
    load_bytes(name, &read_all(name, reader, 0, options)?, options)
}

/// Reads from memory. `name` as in [`load_reader`].
///
/// # Errors
/// As [`load`].
pub fn load_bytes(name: &Path, data: &[u8], options: &LoadOptions) -> Result<Loaded> {
    let data = &*text::utf8(data);
    let input = Input::new(name, data, options);
    let format = if data.trim_ascii().is_empty() { None } else { Format::detect(data, name) };
    match format {
        Some(format) => read(input, format),
        None => Err(unknown(&input)),
    }
}

fn read(mut input: Input<'_>, format: Format) -> Result<Loaded> {
    input.reserve(input.data.len(), 1)?;
    let mut content = match format {
        Format::Ply => ply::read(&mut input)?,
        Format::Obj => obj::read(&mut input)?,
        Format::Off => off::read(&mut input)?,
        Format::Stl => stl::read(&mut input)?,
        Format::Xyz => xyz::read(&mut input)?,
        Format::Pcd => pcd::read(&mut input)?,
        Format::Las => las::read(&mut input)?,
        Format::E57 => e57::read(&mut input)?,
        Format::Gltf => gltf::read(&mut input)?,
    };
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
    if content.faces.is_empty() {
        content.corner_uv = None;
        content.face_chart = None;
    }
    Ok(Loaded {
        cloud: content.cloud,
        faces: content.faces,
        corner_uv: content.corner_uv,
        face_chart: content.face_chart,
        polygons: content.polygons,
        texture: content.texture,
        format,
        report: input.report,
    })
}

/// The first number that is not right. Block by block without a branch inside: nearly always all are right.
fn wrong_from<T: Copy>(values: &[T], right: impl Fn(T) -> bool) -> Option<usize> {
    const BLOCK: usize = 1024;
    let block = values.chunks(BLOCK).position(|b| !b.iter().fold(true, |all, &v| all & right(v)))?;
    let from = block * BLOCK;
    values[from..].iter().position(|&v| !right(v)).map(|i| from + i)
}

/// Normals, colours and texture coordinates that are not finite become 0 (of a normal: "unknown"), and are counted,
/// so that they do not spread into what is computed from them.
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
    if let Some(colors) = &mut content.cloud.colors {
        report.add("colours that are not finite, set to 0", zero(colors), None);
    }
    if let Some(uv) = &mut content.corner_uv {
        report.add("texture coordinates that are not finite, set to 0", zero(uv.as_flattened_mut()), None);
    }
}

fn unknown(input: &Input<'_>) -> Error {
    let known = "PLY, OBJ, OFF, STL, XYZ or other columns of numbers, PCD, LAS, LAZ, E57, glTF";
    let found = match input.data {
        data if data.trim_ascii().is_empty() => "an empty file".into(),
        [0x1F, 0x8B, ..] => return input.unsupported("this is gzip-compressed", "Unpack it first (gunzip)"),
        [b'P', b'K', 3, 4, ..] => return input.unsupported("this is a ZIP archive", "Unpack it first"),
        data => text::quote(&data[..data.len().min(24)]),
    };
    input.malformed(
        Place::Byte(0),
        found,
        format!("the start of one of: {known}"),
        "Check that this is the right file",
    )
}
