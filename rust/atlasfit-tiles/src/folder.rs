//! The work folder: what lies where, and the rows of points in it.
//!
//! ```text
//! plan.json              the plan
//! points/000012          the points of a tile and those about it
//! tiles/000012.moved     where its own points go      .mesh: its part of the surface
//! tiles/000012.seam      where that ends              seams/: what was decided for all
//! light/000012.mesh      the lighter surface          log/NAME.json: how long a task took, once it is done
//! ```

use crate::error::{Error, Result};
use crate::store::Number;
use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::path::{Path, PathBuf};

/// Bytes on disk for one point of a tile or its surroundings.
pub(crate) const ROW_BYTES: u64 = 40;

/// A point on disk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Row {
    /// Which of the scan's points it is.
    pub row: u64,
    pub position: [f64; 3],
    pub color: [u16; 3],
    /// The file that it is of.
    pub file: u16,
}

impl Row {
    pub fn put(&self, to: &mut Vec<u8>) {
        self.row.put(to);
        self.position.iter().for_each(|x| x.put(to));
        self.color.iter().for_each(|x| x.put(to));
        self.file.put(to);
    }
    fn get(from: &[u8]) -> Self {
        Self {
            row: u64::get(from),
            position: [8, 16, 24].map(|at| f64::get(&from[at..])),
            color: [32, 34, 36].map(|at| u16::get(&from[at..])),
            file: u16::get(&from[38..]),
        }
    }
}

/// A work folder.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Folder<'a>(pub &'a Path);

/// Keeps others from planning in the same folder.
pub(crate) struct Lock(#[allow(dead_code, reason = "held, not read")] File);

impl Folder<'_> {
    pub fn plan(self) -> PathBuf {
        self.0.join("plan.json")
    }
    pub fn raw(self) -> PathBuf {
        self.0.join("raw")
    }
    pub fn points(self, tile: usize) -> PathBuf {
        self.0.join("points").join(format!("{tile:06}"))
    }
    pub fn moved(self, tile: usize) -> PathBuf {
        self.0.join("tiles").join(format!("{tile:06}.moved"))
    }
    pub fn mesh(self, tile: usize) -> PathBuf {
        self.0.join("tiles").join(format!("{tile:06}.mesh"))
    }
    pub fn seam(self, tile: usize) -> PathBuf {
        self.0.join("tiles").join(format!("{tile:06}.seam"))
    }
    pub fn decided(self, tile: usize) -> PathBuf {
        self.0.join("seams").join(format!("{tile:06}"))
    }
    pub fn summary(self) -> PathBuf {
        self.0.join("seams").join("summary.json")
    }
    pub fn light(self, tile: usize) -> PathBuf {
        self.0.join("light").join(format!("{tile:06}.mesh"))
    }
    pub fn log(self, task: &str) -> PathBuf {
        self.0.join("log").join(format!("{task}.json"))
    }

    /// Why a task failed, the last time.
    pub fn failed(self, task: &str) -> PathBuf {
        self.0.join("log").join(format!("{task}.failed.json"))
    }

    /// Takes the folder for planning, and makes it where it is not there. Fails where it holds anything that
    /// no plan has put there: all in it is cleared away.
    pub fn take(self) -> Result<Lock> {
        let path = self.0.join(".atlasfit-work");
        std::fs::create_dir_all(self.0).map_err(|e| Error::io(self.0, "make it", e))?;
        let mut entries = std::fs::read_dir(self.0).map_err(|e| Error::io(self.0, "read it", e))?;
        if !path.exists() && entries.next().is_some() {
            return Err(Error::refused(
                format!("{}: the folder is not empty, and no work folder", self.0.display()),
                "Give the work a folder of its own (--work)",
            ));
        }
        let file = File::create(&path).map_err(|e| Error::io(&path, "write it", e))?;
        match file.try_lock() {
            Ok(()) => Ok(Lock(file)),
            Err(_) => Err(Error::refused(
                format!("{}: another process plans in this folder", self.0.display()),
                "Wait until it is done, or give another folder",
            )),
        }
    }

    /// Removes what an earlier plan has left. Only what the program itself names is touched.
    pub fn clear(self) -> Result<()> {
        let _ = std::fs::remove_file(self.plan());
        for name in ["points", "tiles", "seams", "light", "log"] {
            let folder = self.0.join(name);
            if folder.is_dir() {
                std::fs::remove_dir_all(&folder).map_err(|e| Error::io(&folder, "remove it", e))?;
            }
        }
        let _ = std::fs::remove_file(self.raw());
        Ok(())
    }

    /// Fails where the disk has less room than this.
    pub fn check_room(self, bytes: u64) -> Result<()> {
        match room(self.0) {
            Some(there) if there < bytes => Err(Error::refused(
                format!(
                    "{}: the work needs about {:.1} GB on the disk, which has {:.1} GB free",
                    self.0.display(),
                    bytes as f64 / 1e9,
                    there as f64 / 1e9
                ),
                "Make room, or give another folder (--work)",
            )),
            _ => Ok(()),
        }
    }

    /// Calls `each` with blocks of all points in the scan's order.
    pub fn each_raw(self, each: impl FnMut(&[Row]) -> Result<()>) -> Result<()> {
        each_row(&self.raw(), each)
    }

    /// The points of a tile and those about it, in the scan's order.
    pub fn rows(self, tile: usize) -> Result<Vec<Row>> {
        let mut all = Vec::new();
        each_row(&self.points(tile), |rows| {
            all.extend_from_slice(rows);
            Ok(())
        })?;
        Ok(all)
    }

    /// Makes the files of so many tiles, empty.
    pub fn make_tiles(self, tiles: usize) -> Result<()> {
        let folder = self.0.join("points");
        std::fs::create_dir_all(&folder).map_err(|e| Error::io(&folder, "make it", e))?;
        for tile in 0..tiles {
            let path = self.points(tile);
            File::create(&path).map_err(|e| Error::io(&path, "write it", e))?;
        }
        Ok(())
    }

    /// Appends rows to a tile's file.
    pub fn append_tile(self, tile: usize, bytes: &[u8]) -> Result<()> {
        let path = self.points(tile);
        let io = |e| Error::io(&path, "write it", e);
        File::options().append(true).open(&path).and_then(|mut f| f.write_all(bytes)).map_err(io)
    }
}

/// Calls `each` with blocks of a file's rows.
fn each_row(path: &Path, mut each: impl FnMut(&[Row]) -> Result<()>) -> Result<()> {
    const BLOCK: usize = 4096;
    let io = |e| Error::io(path, "read it", e);
    let row = ROW_BYTES as usize;
    let mut file = BufReader::with_capacity(row * BLOCK, File::open(path).map_err(io)?);
    let mut bytes = vec![0; row * BLOCK];
    let mut rows = Vec::with_capacity(BLOCK);
    loop {
        let mut there = 0;
        while there < bytes.len() {
            match file.read(&mut bytes[there..]).map_err(io)? {
                0 => break,
                n => there += n,
            }
        }
        if there % row != 0 {
            return Err(Error::damaged(path));
        }
        if there == 0 {
            return Ok(());
        }
        rows.clear();
        rows.extend(bytes[..there].chunks_exact(row).map(Row::get));
        each(&rows)?;
    }
}

/// Bytes that the disk of a folder has free; nothing where the system does not say.
#[cfg(unix)]
fn room(folder: &Path) -> Option<u64> {
    let disk = rustix::fs::statvfs(folder).ok()?;
    Some(disk.f_bavail.saturating_mul(disk.f_frsize))
}

/// Bytes that the disk of a folder has free; nothing where the system does not say.
#[cfg(not(unix))]
fn room(_: &Path) -> Option<u64> {
    None
}
