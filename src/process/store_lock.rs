//! One edge to a store: whoever has the lock file beside it.
//!
//! The store itself fences off an edge whose file another one has taken over; with the lock the other does not
//! even begin. The system lets go of it when the process ends, however it ends.

use crate::edge::StoreFault;
use std::ffi::OsString;
use std::fs::TryLockError;
use std::path::{Path, PathBuf};

/// That nobody else uses a store, as long as this is there.
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
        let path = lock_path(store);
        let unusable = |error: &std::io::Error| StoreFault::Unusable {
            name: path.display().to_string(),
            message: error.to_string(),
        };
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

fn lock_path(store: &Path) -> PathBuf {
    let mut name = OsString::from(store);
    name.push(".lock");
    PathBuf::from(name)
}
