//! What a store says, as a refusal for the caller.

use super::store::StoreError;
use skyway_service::refusal::{Code, Refusal};

/// When to try again after the store did not answer, or others were quicker, in seconds.
const RETRY_AFTER_S: u32 = 1;

impl From<StoreError> for Refusal {
    fn from(error: StoreError) -> Self {
        let code = match error {
            // The store is well: what is too much is the writing.
            StoreError::Contended => Code::Overloaded,
            StoreError::Unavailable { .. } => Code::StoreUnavailable,
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
            Code::Overloaded => Self::new(code, "others wrote the same again and again"),
            Code::StoreFull => Self::new(code, "the disk of the store is full or failing"),
            Code::Internal => Self::new(code, "the store is damaged, or is of another version"),
            _ => Self::new(code, "the store does not answer"),
        };
        match code {
            Code::StoreUnavailable | Code::Overloaded => refusal.retry_after_s(RETRY_AFTER_S),
            _ => refusal,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_store_that_others_write_to_is_not_told_to_be_away() {
        let contended = Refusal::from(StoreError::Contended);
        assert_eq!(contended.code, Code::Overloaded);
        assert_eq!(contended.retry_after_s, Some(RETRY_AFTER_S));
        let message = "no route to host".to_owned();
        let away = Refusal::from(StoreError::Unavailable { message });
        assert_eq!(away.code, Code::StoreUnavailable);
    }
}
