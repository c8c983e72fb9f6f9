//! Locks that a panic elsewhere cannot spoil.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// What a mutex holds, also where a thread has panicked that held it: what lies in one is whole after every
/// call that takes it.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
