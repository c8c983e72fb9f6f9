//! SQL for both engines: the schema and the transactions here, and in the other files the code that each of them
//! compiles for its own types.
//!
//! `sqlite` and `postgres` both include those files, each with its own database, connection and ways to begin: the
//! statements are the same text, numbered parameters included, but the types of the driver are not. Positions alone
//! are kept differently: `positions_sqlite`, `positions_postgres`.

pub(crate) mod schema;
pub(crate) mod transactions;

use super::store::StoreError;

/// How many rows a statement puts or asks for at once, at most.
pub(crate) const ROWS_AT_ONCE: usize = 200;

/// What an engine says of an error.
#[derive(Debug)]
pub(crate) enum Trouble {
    /// Others got in between: the same may succeed when tried again.
    Contended,
    /// It will not be better by trying again at once.
    Lasting(StoreError),
}

impl From<StoreError> for Trouble {
    fn from(error: StoreError) -> Self {
        Self::Lasting(error)
    }
}

/// A number of the database that was put there as an unsigned one.
pub(crate) fn unsigned(number: i64, what: &str) -> Result<u64, StoreError> {
    u64::try_from(number).map_err(|_| StoreError::Damaged {
        message: format!("{what} is {number}"),
    })
}

/// A number for the database; beyond what it can hold, its largest.
pub(crate) fn signed(number: u64) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}
