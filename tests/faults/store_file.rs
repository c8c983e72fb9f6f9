//! The file of a registry's store, looked at while no process has it open.

#![expect(
    clippy::disallowed_methods,
    reason = "tests of faults copy and damage the files of stores"
)]

use crate::registry_client::All;
use skyway::wire::{ChangeOperation, LoggedChange, ObjectKind};
use sqlx::sqlite::{SqliteConnectOptions, SqliteRow};
use sqlx::{ConnectOptions, Connection, Row, SqliteConnection};
use std::path::Path;
use tempfile::TempDir;

/// A store in a folder: its name, and what SQLite keeps beside it.
const PARTS: [&str; 2] = ["registry.db", "registry.db-wal"];

/// Copies a store as it is on the disk.
pub(crate) fn copy(from: &Path, to: &Path) {
    for part in PARTS {
        let _ = std::fs::remove_file(to.join(part));
        let _ = std::fs::remove_file(to.join(format!("{part}-shm")));
        if from.join(part).is_file() {
            std::fs::copy(from.join(part), to.join(part)).expect("copied");
        }
    }
    let _ = std::fs::remove_file(to.join("registry.db-shm"));
}

/// Copies a file of SQLite with its log, in place of what is there.
pub(crate) fn copy_file(from: &Path, to: &Path) {
    for suffix in ["", "-wal", "-shm"] {
        let [from, to] = [from, to].map(|path| format!("{}{suffix}", path.display()));
        let _ = std::fs::remove_file(&to);
        // What SQLite shares between processes is made anew.
        if suffix != "-shm" && std::fs::exists(&from).unwrap_or(false) {
            std::fs::copy(from, to).expect("copied");
        }
    }
}

/// What is wrong with a copy of a store: pages that do not fit together, half a write, numbers that are not right.
pub(crate) async fn faults(folder: &Path) -> Vec<String> {
    let copied = TempDir::new().expect("a folder");
    copy(folder, copied.path());
    let file = copied.path().join(PARTS[0]);
    let options = SqliteConnectOptions::new().filename(file);
    let mut connection = match options.connect().await {
        Ok(connection) => connection,
        Err(error) => return vec![format!("it does not open: {error}")],
    };
    let mut faults = check_pages(&mut connection).await;
    for (wrong, query) in HALVES {
        match sqlx::query(query).fetch_one(&mut connection).await {
            Ok(row) => match row.get::<i64, _>(0) {
                0 => {}
                count => faults.push(format!("{wrong}: {count}")),
            },
            Err(error) => faults.push(format!("{wrong}: {error}")),
        }
    }
    let _ = close(connection).await;
    faults
}

/// Pages that do not fit together.
pub(crate) async fn check_pages(connection: &mut SqliteConnection) -> Vec<String> {
    let rows = sqlx::query("PRAGMA integrity_check").fetch_all(connection);
    match rows.await {
        Ok(rows) => {
            let told = rows.iter().map(|row| row.get::<String, _>(0));
            told.filter(|told| told != "ok").collect()
        }
        Err(error) => vec![format!("it cannot be checked: {error}")],
    }
}

/// The log as it stands in a copy of a store.
pub(crate) async fn log(folder: &Path) -> All {
    let copied = TempDir::new().expect("a folder");
    copy(folder, copied.path());
    let options = SqliteConnectOptions::new().filename(copied.path().join(PARTS[0]));
    let mut connection = options.connect().await.expect("a store");
    let query = "SELECT revision, epoch, kind, id, body FROM changes ORDER BY revision, position";
    let rows = sqlx::query(query).fetch_all(&mut connection).await;
    let changes = rows.expect("changes").into_iter().map(|row| {
        let body: Option<String> = row.get(4);
        let kind: String = row.get(2);
        let kinds = ObjectKind::ALL;
        let operation = match &body {
            Some(_) => ChangeOperation::Put,
            None => ChangeOperation::Delete,
        };
        LoggedChange {
            revision: number(&row, 0),
            epoch: number(&row, 1),
            at: String::new(),
            subject: String::new(),
            kind: kinds
                .into_iter()
                .find(|it| it.name() == kind)
                .expect("a kind"),
            id: row.get(3),
            operation,
            body,
            sha256: String::new(),
        }
    });
    let changes: Vec<LoggedChange> = changes.collect();
    let _ = close(connection).await;
    All {
        head: changes.last().map_or(0, |change| change.revision),
        changes,
    }
}

fn number(row: &SqliteRow, column: usize) -> u64 {
    u64::try_from(row.get::<i64, _>(column)).expect("no number is negative")
}

async fn close(connection: SqliteConnection) -> Result<(), sqlx::Error> {
    connection.close().await
}

/// What half a write would leave behind.
const HALVES: [(&str, &str); 4] = [
    (
        "changes beyond the last revision of their network",
        "SELECT COUNT(*) FROM changes c WHERE NOT EXISTS \
         (SELECT 1 FROM networks n WHERE n.network = c.network AND n.head >= c.revision)",
    ),
    (
        "revisions without a change",
        "SELECT COALESCE(SUM(n.head - n.oldest - (SELECT COUNT(DISTINCT c.revision) FROM changes c \
         WHERE c.network = n.network AND c.revision > n.oldest)), 0) FROM networks n",
    ),
    (
        "networks with another number of zones",
        "SELECT COUNT(*) FROM networks n WHERE n.zones <> (SELECT COUNT(*) FROM changes c WHERE c.network = n.network \
         AND c.kind = 'zone' AND c.operation = 'put' AND NOT EXISTS (SELECT 1 FROM changes l WHERE l.network = c.network \
         AND l.kind = 'zone' AND l.id = c.id AND l.revision > c.revision))",
    ),
    (
        "answers to writes that are not there",
        "SELECT COUNT(*) FROM replies r WHERE NOT EXISTS (SELECT 1 FROM changes c WHERE c.kind = 'zone' \
         AND c.id = r.object_id)",
    ),
];
