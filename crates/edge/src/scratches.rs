//! Scratch memory for searches, one for each that runs at the same time, used again and again.

use crate::locks::lock;
use skyway_engine::network::Topology;
use skyway_engine::recompose::Scratch;
use std::sync::Mutex;

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
        let idle = lock(&self.idle).pop();
        idle.unwrap_or_else(|| Box::new(Scratch::new(topology)))
    }

    pub(super) fn give_back(&self, scratch: Boxed) {
        let mut idle = lock(&self.idle);
        if idle.len() < KEPT_MAX {
            idle.push(scratch);
        }
    }
}
