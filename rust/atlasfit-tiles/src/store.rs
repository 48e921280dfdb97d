//! Files of numbers in a work folder, whole or not at all.
//!
//! In: values. Out: little-endian bytes under a hidden name, renamed once all is written; and back. Several
//! processes may write the same file, as an engine may run a task twice: each has a name of its own.

use crate::error::{Error, Result};
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

/// Bytes that are read or written at once.
const BUFFER: usize = 1 << 18;

/// Writes a file by `write`; it is there once all of it is. Its folder is made.
///
/// # Errors
/// [`Error::File`], and those of `write`.
pub(crate) fn whole(path: &Path, write: impl FnOnce(&mut Writer) -> Result<()>) -> Result<()> {
    make_folder_of(path)?;
    let written = atlasfit_io::write_with(path, |file| {
        let mut out = Writer { out: BufWriter::with_capacity(BUFFER, file), path: path.to_owned() };
        write(&mut out)?;
        out.out.flush().map_err(|e| Error::io(path, "write it", e))
    });
    match written {
        // Another process was first, and has removed what others had begun.
        Err(Error::File(atlasfit_io::Error::Io { source, .. }))
            if source.kind() == std::io::ErrorKind::NotFound && path.exists() =>
        {
            Ok(())
        }
        written => written,
    }
}

/// Makes the folder that a file lies in.
///
/// # Errors
/// [`Error::File`].
pub(crate) fn make_folder_of(path: &Path) -> Result<()> {
    let Some(folder) = path.parent() else { return Ok(()) };
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "make it", e))
}

/// Writes a text file, whole or not at all.
///
/// # Errors
/// [`Error::File`].
pub(crate) fn text(path: &Path, text: &str) -> Result<()> {
    whole(path, |out| out.bytes(text.as_bytes()))
}

/// A file that is being written.
pub(crate) struct Writer {
    out: BufWriter<File>,
    path: PathBuf,
}

impl Writer {
    pub fn bytes(&mut self, bytes: &[u8]) -> Result<()> {
        self.out.write_all(bytes).map_err(|e| Error::io(&self.path, "write it", e))
    }
    /// Writes how many rows there are, then the rows.
    pub fn column<const N: usize, T: Number>(&mut self, rows: &[[T; N]]) -> Result<()> {
        self.bytes(&(rows.len() as u64).to_le_bytes())?;
        let mut bytes = Vec::with_capacity(N * T::BYTES * 1024);
        for chunk in rows.chunks(1024) {
            bytes.clear();
            chunk.iter().flatten().for_each(|x| x.put(&mut bytes));
            self.bytes(&bytes)?;
        }
        Ok(())
    }
    /// The same for one number a row.
    pub fn list<T: Number>(&mut self, rows: &[T]) -> Result<()> {
        self.bytes(&(rows.len() as u64).to_le_bytes())?;
        let mut bytes = Vec::with_capacity(T::BYTES * 1024);
        for chunk in rows.chunks(1024) {
            bytes.clear();
            chunk.iter().for_each(|x| x.put(&mut bytes));
            self.bytes(&bytes)?;
        }
        Ok(())
    }
}

/// A number as bytes.
pub(crate) trait Number: Copy + Sized {
    const BYTES: usize;
    fn put(self, to: &mut Vec<u8>);
    fn get(from: &[u8]) -> Self;
}

macro_rules! number {
    ($($t:ty),*) => {$(
        impl Number for $t {
            const BYTES: usize = size_of::<$t>();
            fn put(self, to: &mut Vec<u8>) {
                to.extend_from_slice(&self.to_le_bytes());
            }
            fn get(from: &[u8]) -> Self {
                let mut bytes = [0; size_of::<$t>()];
                bytes.copy_from_slice(&from[..size_of::<$t>()]);
                Self::from_le_bytes(bytes)
            }
        }
    )*};
}
number!(u8, u16, u32, u64, f32, f64);

/// A file that is being read.
pub(crate) struct Reader {
    input: BufReader<File>,
    path: PathBuf,
    /// Bytes that are left: no list is longer.
    left: u64,
}

impl Reader {
    pub fn open(path: &Path) -> Result<Self> {
        let io = |source| Error::io(path, "read it", source);
        let file = File::open(path).map_err(io)?;
        let left = file.metadata().map_err(io)?.len();
        Ok(Self { input: BufReader::with_capacity(BUFFER, file), path: path.to_owned(), left })
    }
    pub fn bytes(&mut self, to: &mut [u8]) -> Result<()> {
        self.left = self.left.saturating_sub(to.len() as u64);
        self.input.read_exact(to).map_err(|e| Error::io(&self.path, "read it", e))
    }
    pub fn one<T: Number>(&mut self) -> Result<T> {
        let mut bytes = [0; 8];
        self.bytes(&mut bytes[..T::BYTES])?;
        Ok(T::get(&bytes))
    }
    /// The length of a list of rows of so many bytes.
    fn length(&mut self, row: usize) -> Result<usize> {
        let n: u64 = self.one()?;
        if n.saturating_mul(row as u64) > self.left {
            return Err(Error::damaged(&self.path));
        }
        Ok(n as usize)
    }
    pub fn column<const N: usize, T: Number>(&mut self) -> Result<Vec<[T; N]>> {
        let row = N * T::BYTES;
        let n = self.length(row)?;
        let mut out = Vec::with_capacity(n);
        let mut bytes = vec![0; row * 1024];
        while out.len() < n {
            let chunk = &mut bytes[..row * (n - out.len()).min(1024)];
            self.bytes(chunk)?;
            out.extend(chunk.chunks_exact(row).map(|r| std::array::from_fn(|k| T::get(&r[k * T::BYTES..]))));
        }
        Ok(out)
    }
    pub fn list<T: Number>(&mut self) -> Result<Vec<T>> {
        Ok(self.column::<1, T>()?.into_iter().map(|[x]| x).collect())
    }
}
