//! A private cluster of PostgreSQL that a test starts, on a socket of its own, and ends.
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a test starts the database that it tests with"
)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

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
pub(crate) struct Cluster {
    folder: TempDir,
    bin: PathBuf,
}

impl Cluster {
    fn make(bin: PathBuf) -> Self {
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
        cluster.start();
        cluster
    }

    /// Starts it, also after it was killed.
    pub(crate) fn start(&self) {
        let socket = self.folder.path().display();
        let options = format!("-k {socket} -c listen_addresses='' -c max_connections=200");
        let started = self
            .run("pg_ctl")
            .args(["--wait", "--timeout=60", "--options", &options, "--log"])
            .arg(self.folder.path().join("log"))
            .arg("--pgdata")
            .arg(self.data())
            .arg("start")
            .output();
        check(started);
    }

    /// The folder with its data.
    pub(crate) fn data(&self) -> PathBuf {
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
    pub(crate) fn database(&self, name: &str) -> String {
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

/// None where there is no database on this machine, and none is required.
pub(crate) fn cluster() -> Option<Cluster> {
    match programs() {
        Some(bin) => Some(Cluster::make(bin)),
        None if std::env::var_os(REQUIRED).is_some() => {
            panic!("no PostgreSQL in /usr/lib/postgresql; apt-get install postgresql")
        }
        None => {
            let is_ci = std::env::var("CI").is_ok_and(|value| value == "true");
            assert!(
                !is_ci,
                "CI=true, and this machine lacks PostgreSQL: give it that, or leave CI unset"
            );
            None
        }
    }
}
