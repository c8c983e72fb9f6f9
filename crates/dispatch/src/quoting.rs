//! Places for quotes at edges: one that hangs must not take those of all requests to the registry.

use skyway_service::refusal::{Code, Refusal};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Quotes that an edge composes at once.
const QUOTED_PER_EDGE: usize = 8;

/// The places of each edge that was asked for a quote.
#[derive(Debug, Default)]
pub(super) struct QuotePlaces(Mutex<BTreeMap<String, Arc<Semaphore>>>);

impl QuotePlaces {
    /// A place at an edge, for as long as it is kept.
    ///
    /// # Errors
    /// When all its places are taken: it composes in milliseconds, or hangs.
    pub(super) fn at(&self, edge: &str) -> Result<OwnedSemaphorePermit, Refusal> {
        let places = {
            // Entries are whole after every call, so a panic elsewhere cannot spoil them.
            let mut by_edge = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let places = by_edge.entry(edge.to_owned());
            let places = places.or_insert_with(|| Arc::new(Semaphore::new(QUOTED_PER_EDGE)));
            places.clone()
        };
        places.try_acquire_owned().map_err(|_| {
            let detail =
                format!("the edge '{edge}' has {QUOTED_PER_EDGE} quotes to compose already");
            Refusal::new(Code::EdgeUnavailable, detail).retry_after_s(1)
        })
    }
}
