//! How far waves are ahead of the store.
//!
//! A plan that is replanned is a row to be written, and its drone is told once it is stored. Waves that run ahead of the store
//! tell no drone sooner: they make its next transaction longer, and the next write waits for that.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A wave begins while fewer waves than this are not stored.
const MOST: usize = 8;

/// Counts the waves that are not stored. What is written on request does not count: however much that is, waves have their
/// turn. Nor do contingencies, which are few at a time: who is met never waits for them to be stored.
#[derive(Clone, Default)]
pub(crate) struct WavesAhead {
    count: Arc<AtomicUsize>,
    /// Told when waves may begin again.
    wake: Option<Arc<dyn Fn() + Send + Sync>>,
}

/// One of them, until this is dropped.
#[derive(Debug, Default)]
pub(crate) struct Ahead(Option<WavesAhead>);

impl Ahead {
    /// Whether it is one, rather than none.
    pub(super) fn is_counted(&self) -> bool {
        self.0.is_some()
    }
}

impl WavesAhead {
    pub(crate) fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            wake: Some(Arc::new(wake)),
            ..Self::default()
        }
    }

    /// One wave more.
    pub(crate) fn one_more(&self) -> Ahead {
        self.count.fetch_add(1, Ordering::AcqRel);
        Ahead(Some(self.clone()))
    }

    /// Whether the store is to come nearer before a wave begins.
    pub(crate) fn are_many(&self) -> bool {
        self.count.load(Ordering::Acquire) >= MOST
    }
}

impl std::fmt::Debug for WavesAhead {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "WavesAhead({:?})", self.count)
    }
}

impl Drop for Ahead {
    fn drop(&mut self) {
        let Some(waves) = &self.0 else { return };
        let is_first_few = waves.count.fetch_sub(1, Ordering::AcqRel) == MOST;
        if let Some(wake) = waves.wake.as_ref().filter(|_| is_first_few) {
            wake();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waves_wait_until_the_store_comes_near_and_are_told_once() {
        let woken = Arc::new(AtomicUsize::new(0));
        let count = woken.clone();
        let waves = WavesAhead::new(move || {
            count.fetch_add(1, Ordering::Relaxed);
        });
        let mut ahead: Vec<Ahead> = (1..MOST).map(|_| waves.one_more()).collect();
        assert!(!waves.are_many());
        ahead.extend([waves.one_more(), waves.one_more()]);
        ahead.pop();
        assert!(waves.are_many());
        assert_eq!(woken.load(Ordering::Relaxed), 0);
        drop(ahead);
        assert!(!waves.are_many());
        assert_eq!(woken.load(Ordering::Relaxed), 1);
    }
}
