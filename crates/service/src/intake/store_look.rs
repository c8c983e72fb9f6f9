//! What is in a store's file before anything is made in it.
//!
//! An empty one was there before: a copy that failed, a disk that was full, a file that was touched. Taken for a new one
//! it would forget every zone in silence. One with other tables is somebody else's, who would find ours in it.

use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{Connection, SqliteConnection};
use std::path::Path;

/// What to do about an empty file.
pub const EMPTY_STORE: &str = "it is empty, which a store never is, so that what it kept may be lost; restore it from a \
     backup, or remove the file to begin with a new one";

/// What to do about a file of something else.
pub const FOREIGN_STORE: &str =
    "it has tables of something else; name another file, or remove this one";

/// What is in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreLook {
    /// A store, or what the opening has to judge: no file, or one that cannot be looked at.
    Openable,
    /// Nothing.
    Empty,
    /// Pages without tables: a store that was begun and not made, which the opening goes on with.
    Bare,
    /// Tables, and not the one that every store of this kind has.
    Foreign,
}

/// Looks into a file, for the table that every store of its kind has.
pub async fn look_at_store(path: &Path, own_table: &str) -> StoreLook {
    let options = SqliteConnectOptions::new()
        .filename(path)
        .create_if_missing(false)
        .read_only(true);
    let Ok(mut connection) = SqliteConnection::connect_with(&options).await else {
        return StoreLook::Openable;
    };
    let pages: Result<i64, _> = sqlx::query_scalar("PRAGMA page_count")
        .fetch_one(&mut connection)
        .await;
    let tables: Result<(i64, i64), _> = sqlx::query_as(
        "SELECT COUNT(*), COUNT(*) FILTER (WHERE name = ?) FROM sqlite_master WHERE type = 'table'",
    )
    .bind(own_table)
    .fetch_one(&mut connection)
    .await;
    // What is told of the file is known; that it is closed badly changes nothing.
    let _ = connection.close().await;
    match (pages, tables) {
        (Ok(0), _) => StoreLook::Empty,
        (_, Ok((0, _))) => StoreLook::Bare,
        (_, Ok((1.., 0))) => StoreLook::Foreign,
        _ => StoreLook::Openable,
    }
}
