//! How both engines ask: each question by itself, several statements of it in a transaction, writes one after the other, and tried again where
//! others got in between.

use super::Trouble;
use crate::store::StoreError;
use std::time::Duration;

/// How often a write is tried while others get in between.
pub(crate) const ATTEMPTS: u32 = 12;
/// How long a write waits for its turn. One that comes too late is refused, so that none is done long after its
/// sender has given up.
pub(crate) const TURN: Duration = Duration::from_secs(5);
/// How long the database may take over a question.
pub(crate) const READ_PATIENCE: Duration = Duration::from_secs(5);
/// How long the database may take over a write. What becomes of one that takes longer is not known.
pub(crate) const PATIENCE: Duration = Duration::from_secs(10);
/// The first pause before a write is tried again; each further one is twice as long.
const FIRST_PAUSE: Duration = Duration::from_millis(2);

/// How long to wait before a write is tried again.
pub(crate) fn pause(attempt: u32) -> Duration {
    FIRST_PAUSE * 2_u32.pow(attempt.min(8))
}

/// What took longer than it may.
pub(crate) fn too_long(what: &str) -> StoreError {
    StoreError::Unavailable {
        message: format!("{what} takes too long"),
    }
}

/// What a question that failed comes to.
pub(crate) fn settled(trouble: Trouble) -> StoreError {
    match trouble {
        Trouble::Lasting(error) => error,
        Trouble::Contended => StoreError::Contended,
    }
}

// Macros and not functions that take closures: what is asked borrows from the caller, and a closure whose future
// borrows both that and the connection has no type that can be written down.

/// Does something in a transaction that sees one state of the database.
macro_rules! reading {
    ($store:expr, |$connection:ident| $work:expr) => {{
        let read = async {
            let mut transaction = $store.begin_read().await?;
            let $connection: &mut Connection = &mut transaction;
            let done = $work.await?;
            // Nothing was written; that it ends badly changes nothing.
            let _ = transaction.rollback().await;
            Ok::<_, $crate::sql::Trouble>(done)
        };
        $crate::sql::transactions::in_time!($store, read)
    }};
}

/// Asks something in a single statement, which sees one state of the database by itself.
macro_rules! asking {
    ($store:expr, |$connection:ident| $work:expr) => {{
        let read = async {
            let mut reader = $store.reader().await?;
            let $connection: &mut Connection = &mut reader;
            $work.await
        };
        $crate::sql::transactions::in_time!($store, read)
    }};
}

/// What was asked, or why there is no answer in time.
macro_rules! in_time {
    ($store:expr, $read:expr) => {{
        use $crate::sql::{Trouble, transactions};
        let read = match tokio::time::timeout(transactions::READ_PATIENCE, $read).await {
            Ok(read) => read,
            Err(_) => Err(Trouble::Lasting(transactions::too_long("a question"))),
        };
        read.map_err(|trouble| {
            if matches!(trouble, Trouble::Lasting(_)) {
                $store.distrust();
            }
            transactions::settled(trouble)
        })
    }};
}

/// Does something in a transaction that writes, again where others got in between.
macro_rules! writing {
    ($store:expr, |$connection:ident| $work:expr) => {{
        use skyway_planted as planted;
        use $crate::sql::{Trouble, transactions};
        use $crate::store::StoreError;
        // Writes of this process one after the other: they would only get in each other's way.
        let turn = tokio::time::timeout(transactions::TURN, $store.writing.lock()).await;
        let _turn = turn.map_err(|_| transactions::too_long("the write before"))?;
        let mut attempt = 0;
        loop {
            let write = async {
                let mut transaction = $store.begin_write().await?;
                let $connection: &mut Connection = &mut transaction;
                let done = $work.await?;
                let committed = transaction.commit().await;
                if !planted::is(planted::Bug::IgnoreFailedCommit) {
                    committed.map_err(super::trouble)?;
                }
                Ok::<_, Trouble>(done)
            };
            let written = match tokio::time::timeout(transactions::PATIENCE, write).await {
                Ok(written) => written,
                Err(_) => Err(Trouble::Lasting(transactions::too_long("a write"))),
            };
            match written {
                Ok(done) => break Ok(done),
                Err(Trouble::Lasting(error)) => {
                    $store.distrust();
                    break Err(error);
                }
                Err(Trouble::Contended) if attempt + 1 == transactions::ATTEMPTS => {
                    break Err(StoreError::Contended);
                }
                Err(Trouble::Contended) => {
                    tokio::time::sleep(transactions::pause(attempt)).await;
                    attempt += 1;
                }
            }
        }
    }};
}

pub(crate) use {asking, in_time, reading, writing};
