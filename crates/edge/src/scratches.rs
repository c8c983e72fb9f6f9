//! Scratch memory for searches, one for each that runs at the same time, used again and again.

use skyway_engine::network::Topology;
use skyway_engine::recompose::Scratch;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The most that are kept unused.
const KEPT_MAX: usize = 64;

/// In a box, as a scratch is large and is handed around for every request.
type Boxed = Box<Scratch>;

/// A pool of scratch memories.
#[derive(Debug, Default)]
pub(super) struct Scratches {
    idle: Mutex<Vec<Boxed>>,
}

impl Scratches {
    pub(super) fn take(&self, topology: &Topology) -> Boxed {
        let idle = self.lock().pop();
        idle.unwrap_or_else(|| Box::new(Scratch::new(topology)))
    }

    pub(super) fn give_back(&self, scratch: Boxed) {
        let mut idle = self.lock();
        if idle.len() < KEPT_MAX {
            idle.push(scratch);
        }
    }

    // A search resets what it finds, so a panic elsewhere cannot spoil it.
    fn lock(&self) -> MutexGuard<'_, Vec<Boxed>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
