//! One edge to a store: the one that holds the lock file beside it.
//!
//! The store itself fences off an edge whose file another one has taken over; with the lock the other does not
//! even begin. The system lets go of it when the process ends, however it ends. A store is what it is and not what it
//! is called: symbolic links are followed, and a file with a second name is refused, since SQLite keeps the log of a
//! file beside the name by which it was opened.

use crate::edge::StoreFault;
use std::ffi::OsString;
use std::fs::TryLockError;
use std::io;
use std::path::{Path, PathBuf};

/// Symbolic links that may follow each other, as on Linux.
const LINKS_MAX: usize = 40;

/// That no other process uses a store, as long as this is there.
#[derive(Debug)]
pub(super) struct StoreLock {
    #[expect(
        clippy::disallowed_types,
        reason = "the door to the lock file; the lock is held as long as it is open"
    )]
    _file: std::fs::File,
}

impl StoreLock {
    /// Takes the store of this name.
    ///
    /// # Errors
    /// [`StoreFault::Taken`] when another process has it, [`StoreFault::Unusable`] when there can be no lock file.
    #[expect(clippy::disallowed_types, reason = "the door to the lock file")]
    pub(super) fn take(store: &Path) -> Result<Self, StoreFault> {
        let unusable = |path: &Path, message: String| StoreFault::Unusable {
            name: path.display().to_string(),
            message,
        };
        let real = real_path(store).map_err(|error| unusable(store, error.to_string()))?;
        let names = names_of(&real);
        if names > 1 {
            let message = format!(
                "it has {names} names (hard links), each of which would have a log of its own; keep one of them"
            );
            return Err(unusable(store, message));
        }
        let path = lock_path(&real);
        let unusable = |error: &io::Error| unusable(&path, error.to_string());
        let file = std::fs::OpenOptions::new()
            .create(true)
            .truncate(false)
            .write(true)
            .open(&path)
            .map_err(|error| unusable(&error))?;
        match file.try_lock() {
            Ok(()) => Ok(Self { _file: file }),
            Err(TryLockError::WouldBlock) => Err(StoreFault::Taken),
            Err(TryLockError::Error(error)) => Err(unusable(&error)),
        }
    }
}

/// Where a file is, or will be, by its one path without links.
#[expect(clippy::disallowed_methods, reason = "the door to the lock file")]
fn real_path(store: &Path) -> io::Result<PathBuf> {
    let mut path = store.to_owned();
    for _ in 0..LINKS_MAX {
        let folder = path.parent().unwrap_or(Path::new(""));
        // A name alone is of the folder that the process is in.
        let folder = match folder.as_os_str().is_empty() {
            true => Path::new("."),
            false => folder,
        };
        let folder = folder.canonicalize()?;
        let Some(name) = path.file_name() else {
            return path.canonicalize();
        };
        let real = folder.join(name);
        match std::fs::read_link(&real) {
            // It may lead to a file that is not there yet.
            Ok(target) => path = folder.join(target),
            Err(_) => return Ok(real),
        }
    }
    Err(io::Error::other(format!(
        "more than {LINKS_MAX} links follow each other"
    )))
}

/// How many names a file has; one where there is none yet, or the system does not tell.
#[cfg(unix)]
#[expect(clippy::disallowed_methods, reason = "the door to the lock file")]
fn names_of(path: &Path) -> u64 {
    use std::os::unix::fs::MetadataExt;
    path.metadata().map_or(1, |metadata| metadata.nlink())
}

/// Other systems do not tell.
#[cfg(not(unix))]
fn names_of(_: &Path) -> u64 {
    1
}

fn lock_path(store: &Path) -> PathBuf {
    let mut name = OsString::from(store);
    name.push(".lock");
    PathBuf::from(name)
}
