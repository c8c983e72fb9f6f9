//! The suite on SQLite, and what only a file can suffer.

use crate::contract::{self, Case};
use crate::documents;
use crate::drafts::{NETWORK, commit, creation, write, zone};
use skyway::registry::SqliteStore;
use skyway::registry::store::{ChangesQuery, Store, StoreError};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection, SqliteConnection};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tempfile::TempDir;

/// A folder with a store in it.
struct Place {
    folder: TempDir,
}

impl Place {
    fn new() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a folder"),
        }
    }

    fn file(&self) -> PathBuf {
        self.folder.path().join("registry.db")
    }

    async fn open(&self) -> Arc<dyn Store> {
        let opened = SqliteStore::open(&self.file(), "0123456789abcdef").await;
        Arc::new(opened.expect("a store"))
    }
}

async fn raw(file: &Path) -> SqliteConnection {
    let options = SqliteConnectOptions::new().filename(file);
    options.connect().await.expect("a connection")
}

#[tokio::test]
async fn the_contract_holds() {
    for Case { name, run } in contract::CASES.iter().chain(documents::CASES) {
        let place = Arc::new(Place::new());
        let open = contract::opener(move || {
            let place = place.clone();
            Box::pin(async move { place.open().await })
        });
        let ran = tokio::spawn(run(open)).await;
        ran.unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

#[tokio::test]
async fn sqlite_has_no_bug_that_loses_commits() {
    let place = Place::new();
    place.open().await.close().await;
    let version: String = sqlx::query_scalar("SELECT sqlite_version()")
        .fetch_one(&mut raw(&place.file()).await)
        .await
        .expect("a version");
    let parts: Vec<u32> = version
        .split('.')
        .map(|part| part.parse().expect("a number"))
        .collect();
    assert!(parts >= vec![3, 51, 3], "{version}");
}

#[tokio::test]
async fn commits_are_on_the_disk_and_readers_are_not_in_the_way() {
    let place = Place::new();
    let store = place.open().await;
    commit(&*store, creation(NETWORK)).await;
    let mut connection = raw(&place.file()).await;
    let mode: String = sqlx::query_scalar("PRAGMA journal_mode")
        .fetch_one(&mut connection)
        .await
        .expect("a mode");
    assert_eq!(mode, "wal");
}

#[tokio::test]
async fn what_was_changed_behind_its_back_is_told_and_not_served() {
    let place = Place::new();
    let store = place.open().await;
    commit(&*store, creation(NETWORK)).await;
    commit(&*store, write(NETWORK, vec![zone("z", "{\"right\":1}")])).await;
    let mut connection = raw(&place.file()).await;
    let bent = sqlx::query("UPDATE changes SET body = '{\"wrong\":1}' WHERE kind = 'zone'");
    bent.execute(&mut connection).await.expect("changed");
    connection.close().await.expect("closed");
    let query = ChangesQuery {
        network: NETWORK.to_owned(),
        after: 1,
        changes: 10,
        bytes: 1 << 20,
    };
    let error = store.changes(&query).await.expect_err("damage");
    assert!(matches!(error, StoreError::Damaged { .. }), "{error:?}");
}

#[tokio::test]
async fn a_store_of_a_later_version_is_refused() {
    let place = Place::new();
    place.open().await.close().await;
    let mut connection = raw(&place.file()).await;
    let later = sqlx::query("UPDATE facts SET value = '99' WHERE name = 'schema'");
    later.execute(&mut connection).await.expect("changed");
    connection.close().await.expect("closed");
    let error = SqliteStore::open(&place.file(), "id")
        .await
        .expect_err("too new");
    assert_eq!(
        error,
        StoreError::Newer {
            found: 99,
            known: 3
        }
    );
}

#[tokio::test]
async fn what_is_no_store_is_refused() {
    let place = Place::new();
    let error = SqliteStore::open(place.folder.path(), "id")
        .await
        .expect_err("a folder");
    assert!(matches!(error, StoreError::Unusable { .. }), "{error:?}");
}
