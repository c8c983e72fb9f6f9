//! Who has how many requests in flight, so that none takes all slots of a class: not by sending more than others, and not by
//! bodies that never come.

use crate::access::{Caller, Role};
use crate::api::operations::Class;
use rustc_hash::FxHashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Whose requests of which class.
type Key = (Class, Role, Arc<str>);

/// The requests in flight of each caller, by class.
#[derive(Debug, Default)]
pub(super) struct Callers {
    in_flight: Mutex<FxHashMap<Key, i64>>,
}

/// A request of a caller, until it is dropped.
#[derive(Debug)]
pub(crate) struct OfCaller {
    callers: Arc<Callers>,
    key: Key,
}

impl Callers {
    /// Counts a request of a caller.
    ///
    /// # Errors
    /// How many it may have in flight where it has as many already: half of the slots of the class.
    pub(super) fn count(
        self: &Arc<Self>,
        class: Class,
        caller: &Caller,
        slots: i64,
    ) -> Result<OfCaller, i64> {
        let most = slots - slots / 2;
        let key = (class, caller.role, Arc::clone(&caller.subject));
        let mut in_flight = self.lock();
        let of_caller = in_flight.entry(key.clone()).or_default();
        if *of_caller >= most {
            return Err(most);
        }
        *of_caller += 1;
        drop(in_flight);
        let callers = Arc::clone(self);
        Ok(OfCaller { callers, key })
    }

    // Counts are whole after every call, so a panic elsewhere cannot spoil them.
    fn lock(&self) -> MutexGuard<'_, FxHashMap<Key, i64>> {
        self.in_flight
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for OfCaller {
    fn drop(&mut self) {
        let mut in_flight = self.callers.lock();
        if let Some(of_caller) = in_flight.get_mut(&self.key) {
            *of_caller -= 1;
            if *of_caller == 0 {
                in_flight.remove(&self.key);
            }
        }
    }
}
