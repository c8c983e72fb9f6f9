//! `strace`, attached to a daemon that runs: to see what it asks of the system, and to let the system fail.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of faults start processes and read what they wrote"
)]

use crate::daemon::{Daemon, run};
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use tempfile::TempDir;

/// A tracer that is attached. It lets go when it is dropped.
pub(crate) struct Tracer {
    child: Child,
    folder: TempDir,
}

/// Whether this machine has it, and lets it look.
pub(crate) fn is_there() -> bool {
    let tried = Command::new("strace")
        .args(["-o", "/dev/null", "true"])
        .output();
    tried.is_ok_and(|tried| tried.status.success())
}

impl Tracer {
    /// Attaches to all threads of a daemon; `what` says which calls, and what becomes of them.
    pub(crate) fn attach(daemon: &Daemon, what: &[&str]) -> Self {
        let folder = TempDir::new().expect("a folder");
        let mut command = Command::new("strace");
        command.args(["-f", "-s", "32", "-p", &daemon.pid().to_string(), "-o"]);
        command.arg(Self::file(&folder)).args(what);
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("strace starts");
        let told = child.stderr.take().expect("what it says");
        let mut lines = BufReader::new(told).lines();
        let is_attached = lines.any(|line| line.is_ok_and(|line| line.contains("attached")));
        assert!(is_attached, "strace does not attach to {}", daemon.pid());
        // What else it says has to go somewhere.
        std::thread::spawn(move || lines.for_each(drop));
        Self { child, folder }
    }

    /// From now on no file gets to the disk.
    pub(crate) fn failing_syncs(daemon: &Daemon) -> Self {
        let calls = "fdatasync,fsync";
        let trace = format!("trace={calls}");
        let inject = format!("inject={calls}:error=EIO");
        Self::attach(daemon, &["-e", &trace, "-e", &inject])
    }

    /// What goes to the disk and what is answered, in their order.
    pub(crate) fn of_syncs_and_answers(daemon: &Daemon) -> Self {
        let calls = "trace=fdatasync,fsync,write,writev,sendto,sendmsg";
        Self::attach(daemon, &["-e", calls])
    }

    fn file(folder: &TempDir) -> PathBuf {
        folder.path().join("trace")
    }

    fn let_go(&mut self) {
        run("kill", &["-INT", &self.child.id().to_string()]);
        let _ = self.child.wait();
    }

    /// Lets go, and counts the answers that made something, and those of them before which nothing had got to the disk
    /// since the one before: these first.
    pub(crate) fn unsynced(self) -> (usize, usize) {
        let (mut synced, mut unsynced, mut answers) = (0, 0, 0);
        for call in self.calls() {
            if call.contains("sync") && call.ends_with("= 0") {
                synced += 1;
            }
            if call.contains("HTTP/1.1 201") {
                answers += 1;
                unsynced += usize::from(synced == 0);
                synced = 0;
            }
        }
        (unsynced, answers)
    }

    fn calls(mut self) -> Vec<String> {
        self.let_go();
        let text = std::fs::read_to_string(Self::file(&self.folder)).expect("a trace");
        text.lines().map(str::to_owned).collect()
    }
}

impl Drop for Tracer {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            self.let_go();
        }
    }
}
