//! The suite on PostgreSQL: a private cluster that the test starts on a socket of its own, and ends.
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a test starts the database that it tests with"
)]

use crate::contract::{self, Case};
use crate::drafts::{NETWORK, commit, creation, write, zone};
use skyway::registry::PostgresStore;
use skyway::registry::store::Store;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Arc;
use std::time::Duration;
use tempfile::TempDir;

/// Longer than anything takes, so that a test that hangs fails.
const PATIENCE: Duration = Duration::from_secs(60);
/// Set where the database has to be there, and its absence is a failure.
const REQUIRED: &str = "SKYWAY_TEST_POSTGRES";

/// The folder with the programs of the latest PostgreSQL of this machine, where Debian puts them.
fn programs() -> Option<PathBuf> {
    let versions = std::fs::read_dir("/usr/lib/postgresql").ok()?;
    let folders = versions.filter_map(|entry| Some(entry.ok()?.path().join("bin")));
    let mut usable: Vec<PathBuf> = folders.filter(|bin| bin.join("initdb").is_file()).collect();
    usable.sort();
    usable.pop()
}

/// A cluster in a folder, which ends when it is dropped.
struct Cluster {
    folder: TempDir,
    bin: PathBuf,
}

impl Cluster {
    fn start(bin: PathBuf) -> Self {
        let cluster = Self {
            folder: tempfile::tempdir().expect("a folder"),
            bin,
        };
        let data = cluster.data();
        if is_root() {
            let folder = cluster.folder.path();
            check(Command::new("chown").arg("postgres").arg(folder).output());
        }
        let made = cluster
            .run("initdb")
            .args(["--auth=trust", "--username=postgres", "--encoding=UTF8"])
            .args(["--locale=C", "--pgdata"])
            .arg(&data)
            .output();
        check(made);
        let socket = cluster.folder.path().display();
        let options = format!("-k {socket} -c listen_addresses='' -c max_connections=200");
        let started = cluster
            .run("pg_ctl")
            .args(["--wait", "--timeout=60", "--options", &options, "--log"])
            .arg(cluster.folder.path().join("log"))
            .arg("--pgdata")
            .arg(&data)
            .arg("start")
            .output();
        check(started);
        cluster
    }

    fn data(&self) -> PathBuf {
        self.folder.path().join("data")
    }

    /// A program of the database, which refuses to run as root.
    fn run(&self, program: &str) -> Command {
        let program = self.bin.join(program);
        if !is_root() {
            return Command::new(program);
        }
        let mut command = Command::new("setpriv");
        command.args(["--reuid=postgres", "--regid=postgres", "--clear-groups"]);
        command.arg(program).current_dir(self.folder.path());
        command
    }

    /// Makes an empty database.
    fn database(&self, name: &str) -> String {
        let socket: &Path = self.folder.path();
        let mut make = self.run("createdb");
        make.arg("--host")
            .arg(socket)
            .args(["--username=postgres", name]);
        check(make.output());
        format!(
            "postgres://postgres@localhost/{name}?host={}",
            socket.display()
        )
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        let mut stop = self.run("pg_ctl");
        stop.args(["--mode=immediate", "--pgdata"])
            .arg(self.data())
            .arg("stop");
        // What cannot be ended here ends with the machine of the tests.
        let _ = stop.output();
    }
}

fn is_root() -> bool {
    let told = Command::new("id").arg("-u").output();
    told.is_ok_and(|told| told.stdout.starts_with(b"0"))
}

#[track_caller]
fn check(output: std::io::Result<Output>) {
    let output = output.expect("the program starts");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
}

async fn open(url: &str) -> Arc<dyn Store> {
    let opened = PostgresStore::open(url, "0123456789abcdef").await;
    Arc::new(opened.expect("a store"))
}

/// None where there is no database on this machine, and none is required.
fn cluster() -> Option<Cluster> {
    match programs() {
        Some(bin) => Some(Cluster::start(bin)),
        None if std::env::var_os(REQUIRED).is_some() => {
            panic!("no PostgreSQL in /usr/lib/postgresql; apt-get install postgresql")
        }
        None => None,
    }
}

#[tokio::test]
async fn the_contract_holds() {
    let Some(cluster) = cluster() else {
        return;
    };
    for (number, Case { name, run }) in contract::CASES.iter().enumerate() {
        let url = cluster.database(&format!("case_{number}"));
        let open = contract::opener(move || {
            let url = url.clone();
            Box::pin(async move { open(&url).await })
        });
        let ran = tokio::spawn(run(open)).await;
        ran.unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

/// Two processes over one database: neither gets in the way of the other, and each hears of the other's writes.
#[tokio::test]
async fn two_registries_share_a_database() {
    let Some(cluster) = cluster() else {
        return;
    };
    let url = cluster.database("shared");
    // Both make the tables at once.
    let (first, second) = tokio::join!(open(&url), open(&url));
    commit(&*first, creation(NETWORK)).await;
    let identities = (first.identity().await, second.identity().await);
    assert_eq!(identities.0, identities.1);
    let heard = {
        let second = second.clone();
        tokio::spawn(async move { second.hint().await })
    };
    let writes = [&first, &second].map(|store| {
        let store = store.clone();
        tokio::spawn(async move {
            for number in 0..20 {
                let id = format!("{:p}-{number}", Arc::as_ptr(&store));
                commit(&*store, write(NETWORK, vec![zone(&id, "{}")])).await;
            }
        })
    });
    for write in writes {
        write.await.expect("written");
    }
    let state = first
        .network(NETWORK)
        .await
        .expect("answers")
        .expect("a network");
    assert_eq!((state.head, state.zones), (41, 40));
    let told = tokio::time::timeout(PATIENCE, async {
        let mut number = 0;
        while !heard.is_finished() {
            number += 1;
            let id = format!("again-{number}");
            commit(&*first, write(NETWORK, vec![zone(&id, "{}")])).await;
            tokio::task::yield_now().await;
        }
    });
    told.await.expect("the second hears of the first");
    first.close().await;
    second.close().await;
}
