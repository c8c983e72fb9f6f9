//! What every file of an edge has to do, whatever is behind it.

use crate::memory_disk::{Breakage, MemoryDisk};
use skyway::edge::{Row, SqliteFile, StoreFault, StoreFile, Table, Transaction};
use std::path::PathBuf;
use tempfile::TempDir;

/// Something that keeps a file.
pub(crate) enum Medium {
    Memory(MemoryDisk),
    Sqlite(TempDir),
}

impl Medium {
    pub(crate) fn both() -> [Self; 2] {
        let folder = tempfile::tempdir().expect("a folder");
        [Self::Memory(MemoryDisk::default()), Self::Sqlite(folder)]
    }

    fn path(folder: &TempDir) -> PathBuf {
        folder.path().join("edge.db")
    }

    pub(crate) async fn open(&self) -> Box<dyn StoreFile> {
        match self {
            Self::Memory(disk) => disk.open(),
            Self::Sqlite(folder) => {
                let file = SqliteFile::open(&Self::path(folder)).await;
                Box::new(file.expect("a file"))
            }
        }
    }
}

fn put(key: &str, body: &str) -> Row {
    Row::put(Table::Zones, key, body.to_owned())
}

fn pairs(rows: &[(&str, &str)]) -> Vec<(String, String)> {
    let owned = |(key, body): &(&str, &str)| ((*key).to_owned(), (*body).to_owned());
    rows.iter().map(owned).collect()
}

#[tokio::test]
async fn what_is_committed_is_there_and_nothing_else() {
    for medium in Medium::both() {
        let mut file = medium.open().await;
        assert_eq!(file.number().await, Ok(0));
        assert_eq!(file.load(Table::Zones).await, Ok(Vec::new()));
        let rows = vec![
            put("b", "2"),
            put("a", "1"),
            Row::put(Table::Plans, "a", "ä\u{0}".into()),
        ];
        file.commit(&Transaction {
            number: 1,
            writer: 7,
            rows,
        })
        .await
        .expect("committed");
        let rows = vec![
            put("c", "3"),
            Row::remove(Table::Zones, "b"),
            put("a", "4"),
            Row::remove(Table::Holds, "z"),
            // Of rows with the same key the last one counts.
            put("d", "5"),
            Row::remove(Table::Zones, "d"),
            Row::remove(Table::Zones, "e"),
            put("e", "6"),
        ];
        file.commit(&Transaction {
            number: 2,
            writer: 7,
            rows,
        })
        .await
        .expect("committed");
        file.close().await;

        let mut file = medium.open().await;
        assert_eq!(file.number().await, Ok(2));
        let zones = file.load(Table::Zones).await;
        assert_eq!(zones, Ok(pairs(&[("a", "4"), ("c", "3"), ("e", "6")])));
        assert_eq!(
            file.read(Table::Plans, "a").await,
            Ok(Some("ä\u{0}".to_owned()))
        );
        assert_eq!(file.read(Table::Zones, "b").await, Ok(None));
        file.close().await;
    }
}

#[tokio::test]
async fn a_transaction_out_of_turn_changes_nothing() {
    for medium in Medium::both() {
        let mut file = medium.open().await;
        let rows = vec![put("a", "1")];
        let early = Transaction {
            number: 2,
            writer: 7,
            rows: rows.clone(),
        };
        assert_eq!(file.commit(&early).await, Err(StoreFault::Taken));
        assert_eq!(file.reopen().await, Ok((0, 0)));
        assert_eq!(file.load(Table::Zones).await, Ok(Vec::new()));
        file.commit(&Transaction {
            number: 1,
            writer: 7,
            rows,
        })
        .await
        .expect("its turn");
        assert_eq!(file.number().await, Ok(1));
        file.close().await;
    }
}

#[tokio::test]
async fn two_edges_on_one_file_get_in_each_others_way_and_say_so() {
    let medium = &Medium::both()[1];
    let (mut one, mut other) = (medium.open().await, medium.open().await);
    let transaction = Transaction {
        number: 1,
        writer: 7,
        rows: vec![put("a", "1")],
    };
    one.commit(&transaction).await.expect("the first");
    assert_eq!(other.commit(&transaction).await, Err(StoreFault::Taken));
}

#[tokio::test]
async fn a_disk_in_memory_breaks_as_it_is_told() {
    let disk = MemoryDisk::default();
    let mut file = disk.open();
    let transaction = |number| Transaction {
        number,
        writer: 7,
        rows: vec![put("a", &number.to_string())],
    };
    disk.set(Breakage::Full);
    file.commit(&transaction(1)).await.expect_err("no space");
    assert_eq!(file.reopen().await, Ok((0, 0)));
    disk.set(Breakage::Doubtful);
    file.commit(&transaction(1)).await.expect_err("who knows");
    assert_eq!(file.reopen().await, Ok((1, 7)));
    disk.set(Breakage::None);
    file.commit(&transaction(2)).await.expect("it works again");
    disk.crash();
    file.commit(&transaction(3))
        .await
        .expect_err("this file is gone");
    assert_eq!(
        disk.open().load(Table::Zones).await,
        Ok(pairs(&[("a", "2")]))
    );
}

#[tokio::test]
#[expect(
    clippy::disallowed_methods,
    reason = "the test writes what is no store"
)]
async fn what_was_bent_on_the_disk_is_an_error() {
    use sqlx::Connection;
    let folder = tempfile::tempdir().expect("a folder");
    let path = Medium::path(&folder);
    let mut file = SqliteFile::open(&path).await.expect("a file");
    let rows = vec![put("a", "1"), put("b", "2")];
    file.commit(&Transaction {
        number: 1,
        writer: 7,
        rows,
    })
    .await
    .expect("committed");
    let bend = async |statement: &'static str| {
        let url = format!("sqlite://{}", path.display());
        let mut connection = sqlx::SqliteConnection::connect(&url)
            .await
            .expect("a database");
        sqlx::query(statement)
            .execute(&mut connection)
            .await
            .expect("bent");
        connection.close().await.expect("closed");
    };
    bend("UPDATE entries SET body = '3' WHERE key = 'b'").await;
    assert_eq!(file.read(Table::Zones, "a").await, Ok(Some("1".to_owned())));
    let bent = file.load(Table::Zones).await.expect_err("bent");
    assert!(
        matches!(&bent, StoreFault::Damaged { message } if message.contains("'b'")),
        "{bent}"
    );
    Box::new(file).close().await;
    bend("UPDATE meta SET number = 99 WHERE name = 'schema'").await;
    let newer = SqliteFile::open(&path).await.expect_err("a later version");
    assert_eq!(
        newer,
        StoreFault::Newer {
            found: 99,
            known: 1
        }
    );
    std::fs::write(
        &path,
        "not a database at all, but long enough to be taken for one, if one is careless",
    )
    .expect("written");
    let foreign = SqliteFile::open(&path).await.expect_err("no store");
    assert!(foreign.to_string().contains("no store"), "{foreign}");
}
