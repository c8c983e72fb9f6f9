//! A store that was there and is empty: a copy that failed, a disk that was full, a file that was touched. Taken for a
//! new one, it would forget every zone in silence.

use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{Connection, SqliteConnection};
use std::path::Path;

/// What to do about it.
pub(crate) const EMPTY_STORE: &str = "it is empty, which a store never is, so that what it kept may be lost; restore it from a \
     backup, or remove the file to begin with a new one";

/// True for a file that is there and has nothing in it. What cannot be looked at is for the opening to judge.
pub(crate) async fn is_empty_file(path: &Path) -> bool {
    let options = SqliteConnectOptions::new()
        .filename(path)
        .create_if_missing(false)
        .read_only(true);
    let Ok(mut connection) = SqliteConnection::connect_with(&options).await else {
        return false;
    };
    let pages: Result<i64, _> = sqlx::query_scalar("PRAGMA page_count")
        .fetch_one(&mut connection)
        .await;
    // What is told of the file is known; that it is closed badly changes nothing.
    let _ = connection.close().await;
    matches!(pages, Ok(0))
}
