//! What a reader works on: the bytes of one file, the memory limit, and the report so far.

use crate::error::{Error, Location, Result};
use crate::report::LoadReport;
use crate::stopping::{READING, is_stopped, watched};
use crate::text::Lines;
use atlasfit::Stop;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path};

/// Bytes below which the system is not asked: any machine has as many.
const SMALL: u64 = 1 << 20;
/// What one is about to read is asked for ahead: this part of what there is already.
const AHEAD: u64 = 4;

pub(crate) struct Input<'a> {
    /// The file's name for messages.
    pub file: String,
    /// The file's path, for formats that name other files beside them.
    pub path: &'a Path,
    /// The file's bytes; of a file that is read block by block, the first ones.
    pub data: &'a [u8],
    /// How many bytes the whole file has.
    pub len: usize,
    /// The report so far.
    pub report: LoadReport,
    /// What comes behind `data`.
    rest: Option<&'a mut File>,
    /// Most bytes that reading may hold; `None` = no limit.
    limit: Option<u64>,
    /// Bytes accounted for so far.
    used: u64,
    /// What ends the reading. A reader that is stopped sees its input end; the door tells it from an end.
    stop: Option<&'a Stop>,
    /// Bytes up to which the system was asked.
    asked: u64,
}

impl<'a> Input<'a> {
    /// A file whose bytes are all in memory.
    pub fn whole(path: &'a Path, data: &'a [u8], limit: Option<u64>) -> Self {
        Input {
            file: path.display().to_string(),
            path,
            data,
            len: data.len(),
            report: LoadReport::default(),
            rest: None,
            limit,
            used: 0,
            stop: None,
            asked: SMALL,
        }
    }

    /// The same input, whose reading `stop` ends.
    pub fn until(self, stop: &'a Stop) -> Self {
        Input { stop: Some(stop), ..self }
    }

    /// Fails when the reading is to end.
    pub fn check(&self) -> Result<()> {
        self.stop.map_or(Ok(()), |s| s.check(READING)).map_err(Error::Stopped)
    }

    /// `items`, which end early when the reading is to end.
    pub fn watched<I: Iterator>(&self, items: I) -> impl Iterator<Item = I::Item> + use<'a, I> {
        watched(self.stop, items)
    }

    /// The lines from byte `at` on, of which `number` were read before.
    pub fn lines(&self, at: usize, number: u64) -> Lines<'a> {
        Lines::from(self.data, at, number).until(self.stop)
    }

    /// The same file of `len` bytes, of which `rest` holds those behind `data`.
    pub fn with_rest(self, rest: &'a mut File, len: usize) -> Self {
        Input { rest: Some(rest), len, ..self }
    }

    /// The bytes of a file that this one names. It must be in this file's folder or below: a model has no
    /// business anywhere else. `None` if it is not, or cannot be read, or is larger than the memory limit.
    pub fn beside(&mut self, name: &str) -> Option<Vec<u8>> {
        let name = Path::new(name);
        if !name.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir)) {
            return None;
        }
        let path = self.path.with_file_name("").join(name);
        let about = std::fs::metadata(&path).ok().filter(std::fs::Metadata::is_file)?;
        self.reserve(usize::try_from(about.len()).ok()?, 1).ok()?;
        std::fs::read(path).ok()
    }

    /// Calls `each` with one block of `block` bytes after the other (the last may be shorter), for `length`
    /// bytes from byte `at` on. The file must have them. May be called once.
    pub fn blocks(
        &mut self,
        at: usize,
        length: usize,
        block: usize,
        mut each: impl FnMut(&[u8]),
    ) -> Result<()> {
        let stop = self.stop;
        let Some(rest) = self.rest.take() else {
            self.data[at..at + length].chunks(block.max(1)).take_while(|_| !is_stopped(stop)).for_each(each);
            return self.check();
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
            self.check()?;
        }
        Ok(())
    }

    /// Accounts for `count` more items of `bytes` bytes each, which are then allocated. Fails over the limit,
    /// and where the system does not have as much: what the program cannot get then ends the reading, not the
    /// process.
    pub fn reserve(&mut self, count: usize, bytes: usize) -> Result<()> {
        let more = (count as u64).saturating_mul(bytes as u64);
        self.used = self.used.saturating_add(more);
        match self.limit {
            Some(limit_bytes) if self.used > limit_bytes => {
                Err(Error::OutOfMemory { file: self.file.clone(), needed_bytes: self.used, limit_bytes })
            }
            _ if self.used > self.asked => {
                let ahead = if more > self.used / AHEAD {
                    self.asked = self.used;
                    more
                } else {
                    // Arrays that grow item by item have room for twice what they hold, and are copied to it.
                    self.asked = self.used + self.used / AHEAD;
                    3 * self.asked - self.used
                };
                can_allocate(ahead, &self.file)
            }
            _ => Ok(()),
        }
    }

    /// The error of a file that breaks its format's rules.
    pub fn malformed(
        &self,
        at: Location,
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

    /// The error of a file of a kind that this build does not read.
    pub fn unsupported(&self, what: impl Into<String>, advice: impl Into<String>) -> Error {
        Error::Unsupported { file: self.file.clone(), what: what.into(), advice: advice.into() }
    }
}

/// Asks the system for so many bytes and gives them back untouched.
pub(crate) fn can_allocate(bytes: u64, file: &str) -> Result<()> {
    let refused = || Error::AllocationFailed { file: file.into(), bytes };
    let room = usize::try_from(bytes).map_err(|_| refused())?;
    Vec::<u8>::new().try_reserve_exact(room).map_err(|_| refused())
}
