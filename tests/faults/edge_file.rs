//! The file of an edge, looked at while no process has it open.

use crate::store_file::{check_pages, copy_file};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection, Row};
use std::path::Path;
use tempfile::TempDir;

/// What half a transaction would leave behind. Of an edge that follows a registry, whose numbers of tables are those of
/// `Table::number`.
const HALVES: [(&str, &str); 2] = [
    (
        "zones that the registry does not know and is not told, and that wait for no operator",
        "SELECT COUNT(*) FROM entries z WHERE z.kind = 2 AND json_extract(z.body, '$.upstream') IS NULL AND NOT EXISTS \
         (SELECT 1 FROM entries o WHERE o.kind = 7 AND json_extract(o.body, '$.id') = z.key) \
         AND NOT EXISTS (SELECT 1 FROM entries h WHERE h.kind = 5 AND instr(h.body, char(34) || z.key || char(34)) > 0)",
    ),
    (
        "closures that the registry does not know and is not told, and that wait for no operator",
        "SELECT COUNT(*) FROM entries c WHERE c.kind = 3 AND json_extract(c.body, '$.upstream') IS NULL AND NOT EXISTS \
         (SELECT 1 FROM entries o WHERE o.kind = 7 AND json_extract(o.body, '$.id') = c.key) \
         AND NOT EXISTS (SELECT 1 FROM entries h WHERE h.kind = 5 AND instr(h.body, char(34) || c.key || char(34)) > 0)",
    ),
];

/// What is wrong with a copy of a file: pages that do not fit together, or half a transaction.
pub(crate) async fn faults(file: &Path) -> Vec<String> {
    let copied = TempDir::new().expect("a folder");
    let copy = copied.path().join("edge.db");
    copy_file(file, &copy);
    let options = SqliteConnectOptions::new().filename(&copy);
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
    let _ = connection.close().await;
    faults
}
