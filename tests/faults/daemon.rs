//! The daemons as they ship: child processes that are killed, stopped, held to bounds and started again.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of faults start processes and end them"
)]

use serde_json::Value;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Longer than anything takes, so that a test that hangs fails.
pub(crate) const WAIT_AT_MOST: Duration = Duration::from_secs(60);

/// What an edge logs of an answer that the checker did not let pass.
const REFUSED_ANSWER: &str = "the checker did not let an answer pass";

/// Where a daemon is reached at the moment; none while it is not there.
#[derive(Clone, Debug, Default)]
pub(crate) struct Address(Arc<Mutex<Option<SocketAddr>>>);

impl Address {
    pub(crate) fn get(&self) -> Option<SocketAddr> {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Of what is always there.
    pub(crate) fn at(address: SocketAddr) -> Self {
        Self(Arc::new(Mutex::new(Some(address))))
    }

    fn set(&self, address: Option<SocketAddr>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = address;
    }
}

/// How a daemon is started, again and again.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    arguments: Vec<String>,
    /// What it is started under: a program and its arguments.
    under: Vec<String>,
    folder: PathBuf,
    name: String,
    bug: Option<&'static str>,
    /// Where the public listener is reached, and the admin listener.
    pub(crate) address: Address,
    pub(crate) admin: Address,
}

impl Plan {
    /// `what` is the command and its arguments; the daemon writes its ports and its log in the folder.
    pub(crate) fn new(name: &str, folder: &Path, what: &[&str]) -> Self {
        let mut arguments: Vec<String> = what.iter().map(|text| (*text).to_owned()).collect();
        let ports = folder.join(format!("{name}.ports")).display().to_string();
        arguments.extend(
            [
                "--listen",
                "127.0.0.1:0",
                "--admin-listen",
                "127.0.0.1:0",
                "--log",
                "warn",
                "--ports-file",
                &ports,
            ]
            .map(str::to_owned),
        );
        Self {
            arguments,
            under: Vec::new(),
            folder: folder.to_owned(),
            name: name.to_owned(),
            bug: None,
            address: Address::default(),
            admin: Address::default(),
        }
    }

    /// A registry over a store.
    pub(crate) fn registry(folder: &Path, store: &str, more: &[&str]) -> Self {
        let mut what = vec!["registry", "--store", store];
        what.extend(more);
        Self::new("registry", folder, &what)
    }

    /// With a bug, where the build has any.
    pub(crate) fn with_bug(mut self, bug: Option<&'static str>) -> Self {
        self.bug = bug;
        self
    }

    /// Under another program, which starts it in its own place.
    pub(crate) fn under(mut self, program: Vec<String>) -> Self {
        self.under = program;
        self
    }

    /// From now on where it was, so that clients find it again.
    pub(crate) fn at(mut self, address: SocketAddr) -> Self {
        let flag = self.arguments.iter().position(|word| word == "--listen");
        self.arguments[flag.expect("every daemon has it") + 1] = address.to_string();
        self
    }

    fn ports_file(&self) -> PathBuf {
        self.folder.join(format!("{}.ports", self.name))
    }

    fn log_file(&self) -> PathBuf {
        self.folder.join(format!("{}.log", self.name))
    }

    /// What it has logged, for messages.
    pub(crate) fn log(&self) -> String {
        std::fs::read_to_string(self.log_file()).unwrap_or_default()
    }

    fn spawn(&self) -> Child {
        let log = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(self.log_file())
            .expect("a log");
        let mut words = self.under.clone();
        words.push(program());
        words.extend(self.arguments.iter().cloned());
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]).stdin(Stdio::null());
        command
            .env_clear()
            .env("PATH", "/usr/sbin:/usr/bin:/sbin:/bin");
        if let Some(bug) = self.bug {
            command.env("SKYWAY_PLANTED_BUG", bug);
            // The checker would mend what this one makes: the history has to find it without its help.
            if bug == "stale-answer" {
                command.env("SKYWAY_PLANTED_UNCHECKED", "1");
            }
        }
        command.stdout(Stdio::null()).stderr(log);
        command.spawn().expect("the program starts")
    }

    /// Starts it and waits until it is ready.
    pub(crate) async fn start(&self) -> Daemon {
        match self.try_start().await {
            Ok(daemon) => daemon,
            Err(says) => panic!("{} does not start: {says}", self.name),
        }
    }

    /// Starts it; when it ends by itself, what it said.
    pub(crate) async fn try_start(&self) -> Result<Daemon, String> {
        let _ = std::fs::remove_file(self.ports_file());
        let begun = Instant::now();
        let mut daemon = Daemon {
            child: self.spawn(),
            plan: self.clone(),
            ready_after: Duration::ZERO,
        };
        let (listen, admin) = daemon.ports().await?;
        self.admin.set(Some(admin));
        let client = reqwest::Client::builder()
            .no_proxy()
            .build()
            .expect("a client");
        while begun.elapsed() < WAIT_AT_MOST {
            let asked = client.get(format!("http://{listen}/readyz")).send().await;
            if asked.is_ok_and(|answer| answer.status() == 200) {
                daemon.ready_after = begun.elapsed();
                self.address.set(Some(listen));
                return Ok(daemon);
            }
            daemon.check_alive()?;
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
        Err(format!("not ready: {}", self.log()))
    }
}

/// A daemon that runs. It is killed when it is dropped.
#[derive(Debug)]
pub(crate) struct Daemon {
    child: Child,
    plan: Plan,
    /// From the start of the process to the first answer that it is ready.
    pub(crate) ready_after: Duration,
}

impl Daemon {
    async fn ports(&mut self) -> Result<(SocketAddr, SocketAddr), String> {
        let begun = Instant::now();
        while begun.elapsed() < WAIT_AT_MOST {
            let text = std::fs::read_to_string(self.plan.ports_file()).unwrap_or_default();
            if let Some(ports) = ports_of(&text) {
                return Ok(ports);
            }
            self.check_alive()?;
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
        Err(format!("no ports: {}", self.plan.log()))
    }

    fn check_alive(&mut self) -> Result<(), String> {
        match self.child.try_wait().expect("a process") {
            None => Ok(()),
            Some(status) => Err(format!("{status}: {}", self.plan.log())),
        }
    }

    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// `kill -9`: nothing of it gets to do anything more.
    pub(crate) fn kill(mut self) {
        self.end();
    }

    fn end(&mut self) {
        self.plan.address.set(None);
        self.plan.admin.set(None);
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Sends a signal by its name, as `STOP`.
    pub(crate) fn signal(&self, name: &str) {
        run("kill", &[&format!("-{name}"), &self.pid().to_string()]);
    }

    /// Ends it in order, with SIGTERM.
    pub(crate) fn stop(mut self) {
        self.plan.address.set(None);
        self.plan.admin.set(None);
        self.signal("TERM");
        let status = self.child.wait().expect("a process");
        assert!(status.success(), "{status}: {}", self.plan.log());
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        self.end();
        // Without a planted bug every answer has passed the checker, which logs what does not.
        let may_be_wrong = self.plan.bug.is_some() || std::thread::panicking();
        let log = self.plan.log();
        assert!(may_be_wrong || !log.contains(REFUSED_ANSWER), "{log}");
    }
}

/// Writes a file that a daemon is started with.
pub(crate) fn write(file: &str, text: &str) {
    std::fs::write(file, text).expect("written");
}

/// The program that is tried.
pub(crate) fn program() -> String {
    let other = std::env::var("SKYWAY_FAULT_BINARY");
    other.unwrap_or_else(|_| env!("CARGO_BIN_EXE_skyway").to_owned())
}

fn ports_of(text: &str) -> Option<(SocketAddr, SocketAddr)> {
    let ports: Value = serde_json::from_str(text).ok()?;
    let port = |name: &str| {
        let port = u16::try_from(ports[name].as_u64()?).ok()?;
        Some(SocketAddr::from(([127, 0, 0, 1], port)))
    };
    Some((port("listen")?, port("admin_listen")?))
}

/// Runs a program that has to succeed, and gives what it wrote.
#[track_caller]
pub(crate) fn run(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).output();
    let output = output.unwrap_or_else(|error| panic!("{program}: {error}"));
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program} {arguments:?}: {text}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}
