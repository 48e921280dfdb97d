//! Where output goes: a file is written whole or not at all.
//!
//! In: the path of an output. Out: a file under a hidden name beside it, renamed to it once all is written.
//! The target of a symbolic link is replaced, not the link; a file that is read-only is not replaced; the
//! permissions of the file that is replaced are kept. [`check_output`] tells beforehand whether this can
//! work; [`discard_unfinished`] removes what a process leaves that ends in the middle of it.

use crate::error::{Error, Result};
use crate::stopping::{WRITING, Watched};
use atlasfit::Stop;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Fails where [`save_mesh`](crate::save_mesh) and its like could not write `path`: no such folder, a folder
/// that takes no files, a file that is read-only, a folder of that name. Nothing is left behind.
///
/// # Errors
/// [`Error::Io`], [`Error::Unsupported`].
pub fn check_output(path: &Path) -> Result<()> {
    let unsupported = |what: &str, advice: &str| Error::Unsupported {
        file: path.display().to_string(),
        what: what.into(),
        advice: advice.into(),
    };
    if is_special(path) {
        return Ok(());
    }
    if path.is_dir() || path.file_name().is_none() {
        return Err(unsupported("this is a folder", "Give the name of a file"));
    }
    let io = |source| Error::io(path, "write it", source);
    let target = target(path).map_err(io)?;
    if !folder(&target).is_dir() {
        return Err(unsupported("its folder does not exist", "Make the folder first, or give another"));
    }
    // The surest test is to do it; dropped, the file is gone.
    Staged::default().create(path).map_err(io)?;
    Ok(())
}

/// Whether two paths name one file, there or yet to be written.
#[must_use]
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    let resolved = |path: &Path| {
        let path = target(path).ok()?;
        let folder = folder(&path).canonicalize().ok()?;
        // The system's own spelling of a file that is there, or folder and name.
        path.canonicalize().ok().or_else(|| Some(folder.join(path.file_name()?)))
    };
    !is_special(a) && resolved(a).is_some_and(|a| resolved(b) == Some(a))
}

/// Writes `bytes` to `path`, whole or not at all; a device or a pipe gets what there is until `stop` ends it.
///
/// # Errors
/// [`Error::Io`], [`Error::Stopped`].
pub fn write_file(path: &Path, bytes: &[u8], stop: &Stop) -> Result<()> {
    let failed = |source| match stop.check(WRITING) {
        Err(stopped) => Error::Stopped(stopped),
        Ok(()) => Error::io(path, "write it", source),
    };
    write_with(path, |out| {
        let mut out = Watched { out, stop };
        out.write_all(bytes).and_then(|()| out.flush()).map_err(failed)
    })
}

/// Writes a file by `write`, whole or not at all; a device or a pipe gets what there is until `write` fails.
///
/// # Errors
/// [`Error::Io`], and those of `write`.
pub fn write_with<E: From<Error>>(
    path: &Path,
    write: impl FnOnce(File) -> std::result::Result<(), E>,
) -> std::result::Result<(), E> {
    let failed = |source| Error::io(path, "write it", source);
    if is_special(path) {
        return write(File::create(path).map_err(failed)?);
    }
    let mut staged = Staged::default();
    write(staged.create(path).map_err(failed)?)?;
    staged.commit().map_err(failed)?;
    Ok(())
}

/// Removes what other processes have begun to write to `path` and not finished, because they were killed, or
/// still write.
pub fn discard_begun(path: &Path) {
    let Ok(path) = target(path) else { return };
    let (Some(name), Ok(entries)) = (path.file_name(), std::fs::read_dir(folder(&path))) else { return };
    let begin = format!(".{}.", name.to_string_lossy());
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(&begin) && name.ends_with(".part") {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Whether this is a device or a pipe, which cannot be replaced: it is written to.
pub(crate) fn is_special(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// The folder that a file lies in.
fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The file that a path names: what a symbolic link points to, there or not.
fn target(path: &Path) -> std::io::Result<PathBuf> {
    // As many links as Linux follows.
    const MOST_LINKS: usize = 40;
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        match std::fs::symlink_metadata(&path) {
            Ok(about) if about.is_symlink() => path = folder(&path).join(std::fs::read_link(&path)?),
            _ => return Ok(path),
        }
    }
    Err(std::io::Error::other("its symbolic links lead in a circle"))
}

/// The files that this process has begun and not finished.
struct Unfinished {
    hidden: Vec<PathBuf>,
    /// Whether the process ends: no file is begun or finished any more.
    ending: bool,
}

static UNFINISHED: Mutex<Unfinished> = Mutex::new(Unfinished { hidden: Vec::new(), ending: false });

fn unfinished() -> MutexGuard<'static, Unfinished> {
    // Paths in a list: a panic cannot leave them half changed.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Fails where the process ends.
fn goes_on(unfinished: &Unfinished) -> std::io::Result<()> {
    if unfinished.ending { Err(ErrorKind::Interrupted.into()) } else { Ok(()) }
}

/// Removes the unfinished files of all outputs that this process writes, in whichever thread. From then on
/// every output fails: call it right before the process ends without waiting for its threads.
pub fn discard_unfinished() {
    let mut unfinished = unfinished();
    unfinished.ending = true;
    for file in unfinished.hidden.drain(..) {
        let _ = std::fs::remove_file(file);
    }
}

/// Files written under a hidden name beside their final one. Dropped without [`Staged::commit`], they vanish.
#[derive(Default)]
pub(crate) struct Staged {
    files: Vec<StagedFile>,
}

struct StagedFile {
    hidden: PathBuf,
    /// What the hidden file replaces.
    target: PathBuf,
    /// The output as the caller names it.
    named: PathBuf,
}

impl Staged {
    pub fn create(&mut self, path: &Path) -> std::io::Result<File> {
        let target = target(path)?;
        let name = target.file_name().ok_or_else(|| std::io::Error::other("this is not a file name"))?;
        let before = std::fs::metadata(&target).ok();
        if let Some(before) = &before {
            if before.permissions().readonly() {
                return Err(std::io::Error::new(ErrorKind::PermissionDenied, "the file is read-only"));
            }
            // The folder may allow what the file does not. This changes nothing.
            File::options().append(true).open(&target)?;
        }
        // In a browser there is one process, without a number.
        let process = if cfg!(target_family = "wasm") { 0 } else { std::process::id() };
        for attempt in 0..100 {
            let mut hidden = std::ffi::OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{process}-{attempt}.part"));
            let hidden = target.with_file_name(hidden);
            let mut unfinished = unfinished();
            goes_on(&unfinished)?;
            match File::create_new(&hidden) {
                Ok(file) => {
                    unfinished.hidden.push(hidden.clone());
                    self.files.push(StagedFile { hidden, target, named: path.to_owned() });
                    if let Some(before) = before {
                        file.set_permissions(before.permissions())?;
                    }
                    return Ok(file);
                }
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e),
            }
        }
        Err(std::io::Error::other("a hundred unfinished files lie beside it already: delete *.part"))
    }

    /// Renames all, the output itself last: once it is there, all it needs is there.
    pub fn commit(mut self) -> std::io::Result<Vec<PathBuf>> {
        let done: Vec<PathBuf> = self.files.iter().map(|f| f.named.clone()).collect();
        let mut unfinished = unfinished();
        goes_on(&unfinished)?;
        while let Some(file) = self.files.last() {
            // On failure dropping the rest takes the lock.
            if let Err(e) = std::fs::rename(&file.hidden, &file.target) {
                drop(unfinished);
                return Err(e);
            }
            unfinished.hidden.retain(|h| *h != file.hidden);
            self.files.pop();
        }
        drop(unfinished);
        Ok(done)
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        if self.files.is_empty() {
            return;
        }
        let mut unfinished = unfinished();
        for file in &self.files {
            let _ = std::fs::remove_file(&file.hidden);
            unfinished.hidden.retain(|h| *h != file.hidden);
        }
    }
}
