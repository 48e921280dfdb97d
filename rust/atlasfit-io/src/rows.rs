//! Points read block by block, and written again with other positions: scans larger than memory.
//!
//! In: a file. Out: its points, a block at a time, with their rows as the file has them; a file of the same
//! kind whose rows differ in the positions only. LAS, LAZ (COPC too) and binary PLY without faces are read
//! so; other formats are held as a whole, and written as PLY.

use crate::bytes::{ColumnLayout, put};
use crate::error::{Error, Result};
use crate::format::Format;
use crate::input::Input;
use crate::load::{LoadOptions, load};
use crate::row_layout::RowLayout;
use crate::save::{SaveCloud, save_cloud};
use crate::staged::Staged;
use crate::stopping::{READING, WRITING};
use crate::{las, ply};
use atlasfit::Stop;
use atlasfit::geometry::PointCloud;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Rows of a file.
#[derive(Debug, Clone, Default)]
pub struct RowBlock {
    /// Positions in the file's unit.
    pub positions: Vec<[f64; 3]>,
    /// Red, green and blue, 65535 = full; empty where the file has no colours.
    pub colors: Vec<[u16; 3]>,
    /// The rows as the file has them; empty of a file that is held as a whole.
    bytes: Vec<u8>,
}

/// A file of points that is read block by block.
pub struct Rows {
    path: PathBuf,
    format: Format,
    count: u64,
    crs: Option<Vec<u8>>,
    done: u64,
    source: Source,
}

enum Source {
    /// Rows as they are.
    Plain { file: BufReader<File>, layout: Box<RowLayout> },
    /// Rows that are packed.
    #[cfg(feature = "laz")]
    Packed { unpacker: Box<las::Unpacker>, layout: Box<RowLayout> },
    /// All of them.
    Held(Box<PointCloud>),
}

impl Rows {
    /// Opens a file.
    ///
    /// # Errors
    /// As [`load`].
    pub fn open(path: &Path, stop: &Stop) -> Result<Self> {
        let io = |source| Error::io(path, "read it", source);
        let mut file = File::open(path).map_err(|e| Error::io(path, "open it", e))?;
        let length = file.metadata().map_err(io)?.len();
        let head = head(&mut file, length).map_err(io)?;
        let input = Input::whole(path, &head, None).until(stop);
        let format = Format::detect(&head, path);
        let layout = match format {
            Some(Format::Las) => Some(las::row_layout(&input)?),
            Some(Format::Ply) => ply::row_layout(&input)?,
            _ => None,
        };
        let Some(layout) = layout else { return Self::held(path, stop) };
        let format = format.unwrap_or(Format::Ply);
        file.seek(SeekFrom::Start(layout.start)).map_err(io)?;
        let (count, crs) = (layout.count, layout.crs.clone());
        let source = match &layout.packing {
            None => {
                if length.saturating_sub(layout.start) / (layout.stride as u64) < layout.count {
                    return Err(cut_off(path));
                }
                Source::Plain { file: BufReader::with_capacity(BUFFER, file), layout: Box::new(layout) }
            }
            #[cfg(feature = "laz")]
            Some(packing) => {
                let unpacker = las::unpacker(file, packing, layout.stride).ok_or_else(|| damaged(path))?;
                Source::Packed { unpacker: Box::new(unpacker), layout: Box::new(layout) }
            }
            #[cfg(not(feature = "laz"))]
            Some(_) => return Self::held(path, stop),
        };
        Ok(Self { path: path.to_owned(), format, count, crs, done: 0, source })
    }

    fn held(path: &Path, stop: &Stop) -> Result<Self> {
        let loaded = load(path, &LoadOptions::default().with_stop(stop.clone()))?;
        let (count, format) = (loaded.cloud.len() as u64, loaded.format);
        let source = Source::Held(Box::new(loaded.cloud));
        Ok(Self { path: path.to_owned(), format, count, crs: None, done: 0, source })
    }

    /// How many points the file has.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// What the file says of its coordinate system, as it stands there (the bodies of the LAS projection
    /// records); nothing where it says nothing.
    #[must_use]
    pub fn crs(&self) -> Option<&[u8]> {
        self.crs.as_deref()
    }

    /// The extension that the file has when it is written again.
    #[must_use]
    pub fn extension(&self) -> &'static str {
        match &self.source {
            #[cfg(feature = "laz")]
            Source::Packed { .. } => "laz",
            Source::Plain { .. } if self.format == Format::Las => "las",
            _ => "ply",
        }
    }

    /// Whether the file is held in memory as a whole.
    #[must_use]
    pub fn is_held(&self) -> bool {
        matches!(self.source, Source::Held(_))
    }

    /// Reads the next points, `most` at the most, into `block`; false where there are none.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Malformed`] where the file ends before its last row or does not unpack, and
    /// where `stop` ends the reading.
    pub fn next(&mut self, most: usize, block: &mut RowBlock, stop: &Stop) -> Result<bool> {
        stop.check(READING).map_err(Error::Stopped)?;
        let n = (self.count - self.done).min(most as u64) as usize;
        block.positions.clear();
        block.colors.clear();
        block.bytes.clear();
        if n == 0 {
            return Ok(false);
        }
        let first = self.done as usize;
        self.done += n as u64;
        let layout = match &mut self.source {
            Source::Held(cloud) => {
                block.positions.extend_from_slice(&cloud.positions[first..first + n]);
                if let Some(colors) = &cloud.colors {
                    let full = |c: f32| (c.clamp(0.0, 1.0) * 65535.0).round() as u16;
                    block
                        .colors
                        .extend(colors[first..first + n].iter().map(|c| [c[0], c[1], c[2]].map(full)));
                }
                return Ok(true);
            }
            Source::Plain { file, layout } => {
                block.bytes.resize(n * layout.stride, 0);
                file.read_exact(&mut block.bytes).map_err(|e| match e.kind() {
                    std::io::ErrorKind::UnexpectedEof => cut_off(&self.path),
                    _ => Error::io(&self.path, "read it", e),
                })?;
                layout
            }
            #[cfg(feature = "laz")]
            Source::Packed { unpacker, layout } => {
                block.bytes.resize(n * layout.stride, 0);
                let unpacked = crate::foreign::guarded(|| unpacker.decompress_many(&mut block.bytes));
                if !matches!(unpacked, Some(Ok(()))) {
                    return Err(damaged(&self.path));
                }
                layout
            }
        };
        let RowBlock { positions, colors, bytes } = block;
        layout.read(n, bytes, positions, colors);
        Ok(true)
    }
}

/// Bytes that are read or written at once.
const BUFFER: usize = 1 << 20;

/// Writes the rows of a file with other positions.
pub struct RowsWriter {
    path: PathBuf,
    staged: Staged,
    out: Out,
    /// Extent of what was written.
    extent: [[f64; 3]; 2],
    written: u64,
}

enum Out {
    Plain(BufWriter<File>),
    #[cfg(feature = "laz")]
    Packed(Box<las::Packer>),
    Held(Vec<[f64; 3]>),
}

impl RowsWriter {
    /// Begins the file that `rows` becomes, which must have been opened anew.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(rows: &Rows, path: &Path) -> Result<Self> {
        let io = |source| Error::io(path, "write it", source);
        let mut staged = Staged::default();
        let out = match &rows.source {
            Source::Held(cloud) => Out::Held(Vec::with_capacity(cloud.len())),
            Source::Plain { layout, .. } => {
                let mut file = BufWriter::with_capacity(BUFFER, staged.create(path).map_err(io)?);
                file.write_all(&rows.head(layout)?).map_err(io)?;
                Out::Plain(file)
            }
            #[cfg(feature = "laz")]
            Source::Packed { layout, .. } => {
                let mut file = BufWriter::with_capacity(BUFFER, staged.create(path).map_err(io)?);
                let mut head = rows.head(layout)?;
                let packing = layout.packing.as_deref().unwrap_or_default();
                las::fixed_chunks(&mut head);
                file.write_all(&head).map_err(io)?;
                Out::Packed(Box::new(las::packer(file, packing).ok_or_else(|| damaged(&rows.path))?))
            }
        };
        let extent = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        Ok(Self { path: path.to_owned(), staged, out, extent, written: 0 })
    }

    /// Writes the rows of a block that `rows` gave, at `positions`.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Unsupported`] where a position is beyond what the file's numbers hold, and
    /// where `stop` ends the writing.
    pub fn put(
        &mut self,
        rows: &Rows,
        block: &mut RowBlock,
        positions: &[[f64; 3]],
        stop: &Stop,
    ) -> Result<()> {
        stop.check(WRITING).map_err(Error::Stopped)?;
        let io = |source| Error::io(&self.path, "write it", source);
        let layout = match (&rows.source, &mut self.out) {
            (Source::Held(_), Out::Held(all)) => {
                all.extend_from_slice(positions);
                return Ok(());
            }
            (Source::Plain { layout, .. }, _) => layout,
            #[cfg(feature = "laz")]
            (Source::Packed { layout, .. }, _) => layout,
            _ => return Ok(()),
        };
        for (row, p) in block.bytes.chunks_exact_mut(layout.stride).zip(positions) {
            for (k, &x) in p.iter().enumerate() {
                let ColumnLayout { offset, kind, big_endian, .. } = layout.axes[k];
                let value = (x - layout.offset[k]) / layout.scale[k];
                // Coordinates that are not finite stay as they are.
                if !value.is_finite() {
                    continue;
                }
                let Some(held) = put(&mut row[offset..], kind, big_endian, value) else {
                    return Err(Error::Unsupported {
                        file: self.path.display().to_string(),
                        what: format!("the coordinate {x} is beyond what its numbers hold"),
                        advice: "Write the scan with a coarser scale or another offset".into(),
                    });
                };
                let held = held * layout.scale[k] + layout.offset[k];
                self.extent[0][k] = self.extent[0][k].min(held);
                self.extent[1][k] = self.extent[1][k].max(held);
            }
        }
        self.written += positions.len() as u64;
        match &mut self.out {
            Out::Plain(file) => file.write_all(&block.bytes).map_err(io),
            #[cfg(feature = "laz")]
            Out::Packed(packer) => {
                packer.compress_many(&block.bytes).map_err(|e| io(std::io::Error::other(e)))
            }
            Out::Held(_) => Ok(()),
        }
    }

    /// Ends the file: it is there as a whole from now on.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(self, rows: Rows, stop: &Stop) -> Result<()> {
        let Self { path, staged, out, extent, .. } = self;
        let io = |source| Error::io(&path, "write it", source);
        let mut file = match out {
            Out::Held(positions) => {
                drop(staged);
                let Source::Held(cloud) = rows.source else { return Ok(()) };
                let cloud = PointCloud { positions, ..*cloud };
                let how = SaveCloud { format: Some(Format::Ply), stop: stop.clone(), ..SaveCloud::default() };
                return save_cloud(&path, &cloud, &how).map(drop);
            }
            Out::Plain(file) => file,
            #[cfg(feature = "laz")]
            Out::Packed(mut packer) => {
                packer.done().map_err(|e| io(std::io::Error::other(e)))?;
                packer.into_inner()
            }
        };
        if rows.format == Format::Las {
            las::finish(&rows.path, &mut file, extent).map_err(io)?;
        }
        let file = file.into_inner().map_err(|e| io(e.into_error()))?;
        file.sync_all().map_err(io)?;
        drop(file);
        staged.commit().map_err(io)?;
        Ok(())
    }
}

impl Rows {
    /// The bytes before the rows.
    fn head(&self, layout: &RowLayout) -> Result<Vec<u8>> {
        let io = |source| Error::io(&self.path, "read it", source);
        let mut head = vec![0; layout.start as usize];
        File::open(&self.path).and_then(|mut f| f.read_exact(&mut head)).map_err(io)?;
        Ok(head)
    }
}

/// The first bytes of a file: of LAS, all before the points.
fn head(file: &mut File, length: u64) -> std::io::Result<Vec<u8>> {
    const HEAD: u64 = 1 << 16;
    let mut head = vec![0; length.min(HEAD) as usize];
    file.read_exact(&mut head)?;
    if let Some(start) = las::start_of_points(&head).filter(|s| *s > head.len() as u64 && *s <= length) {
        let more = head.len();
        head.resize(start as usize, 0);
        file.read_exact(&mut head[more..])?;
    }
    Ok(head)
}

fn cut_off(path: &Path) -> Error {
    Error::Unsupported {
        file: path.display().to_string(),
        what: "it ends before the last point that its header announces".into(),
        advice: "The file is cut off, or was changed while it was read: get it again".into(),
    }
}

#[cfg(feature = "laz")]
fn damaged(path: &Path) -> Error {
    Error::Unsupported {
        file: path.display().to_string(),
        what: "LAZ data that do not unpack".into(),
        advice: "The file is cut off or damaged, or was changed while it was read: get it again".into(),
    }
}
