//! What a store says, as a refusal for the caller.

use super::store::StoreError;
use skyway_service::refusal::{Code, Refusal};

/// When to try again after the store did not answer, in seconds.
const RETRY_AFTER_S: u32 = 1;

impl From<StoreError> for Refusal {
    fn from(error: StoreError) -> Self {
        let code = match error {
            StoreError::Unavailable { .. } | StoreError::Contended => Code::StoreUnavailable,
            StoreError::Full { .. } => Code::StoreFull,
            StoreError::Damaged { .. }
            | StoreError::Newer { .. }
            | StoreError::Unusable { .. }
            | StoreError::Empty { .. }
            | StoreError::Foreign { .. } => {
                tracing::error!(%error, "the store");
                Code::Internal
            }
        };
        // What the engine says is for the log of the registry; it may name files and hosts.
        tracing::debug!(%error, "the store refused");
        let refusal = match code {
            Code::StoreFull => Self::new(code, "the disk of the store is full or failing"),
            Code::Internal => Self::new(code, "the store is damaged, or is of another version"),
            _ => Self::new(code, "the store does not answer"),
        };
        match code {
            Code::StoreUnavailable => refusal.retry_after_s(RETRY_AFTER_S),
            _ => refusal,
        }
    }
}
