//! The servers that are measured: started as processes, found by their file of ports, ended with the bench.

use crate::Result;
use crate::cores;
use crate::load::Dialect;
use std::fs::File;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How long a server may take to start.
const START_WITHIN: Duration = Duration::from_secs(30);
/// Settings in the environment are not the defaults.
const ENVIRONMENT_PREFIX: &str = "SKYWAY_EDGE_";

/// A server in a process of its own, which ends with this value.
pub(crate) struct Server {
    process: Child,
    pub(crate) address: SocketAddr,
}

impl Server {
    /// How long it has worked since it was started.
    pub(crate) fn processor_time(&self) -> Result<Duration> {
        cores::processor_time(&self.process.id().to_string())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself, which is what is wanted.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The edge that plans by distance, with the production configuration else: limits, deadlines, metrics, and logs at
/// `info` to a file.
pub(crate) fn start_edge(folder: &Path) -> Result<Server> {
    let ports_file = folder.join("edge.json");
    let mut command = cores::of_servers(env!("CARGO_BIN_EXE_skyway"));
    for (name, _) in std::env::vars_os() {
        if name.to_string_lossy().starts_with(ENVIRONMENT_PREFIX) {
            command.env_remove(name);
        }
    }
    command
        .args(["edge", "--no-store", "--listen", "127.0.0.1:0"])
        .args(["--set", "flight.airframe=none"])
        .args(["--admin-listen", "127.0.0.1:0", "--ports-file"])
        .arg(&ports_file)
        .stderr(File::create(folder.join("edge.log"))?);
    if cfg!(debug_assertions) {
        // So slow a build lets the load's requests wait for longer than they may, and many would be refused.
        command.args(["--set", "limits.queue_wait=0s"]);
    }
    start(command, &ports_file)
}

/// The echo of a dialect, with answers of the edge to tell.
pub(crate) fn start_echo(folder: &Path, dialect: Dialect, answers: &Path) -> Result<Server> {
    let ports_file = folder.join(format!("echo-{}.json", dialect.name()));
    let program = std::env::current_exe()?;
    let mut command = cores::of_servers(&program.to_string_lossy());
    command
        .args(["--echo", dialect.name()])
        .args([answers, &ports_file])
        .stderr(Stdio::inherit());
    start(command, &ports_file)
}

fn start(mut command: Command, ports_file: &Path) -> Result<Server> {
    let process = command.stdin(Stdio::null()).stdout(Stdio::null()).spawn()?;
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    let mut server = Server { process, address };
    let begun = Instant::now();
    loop {
        if let Some(port) = port(ports_file) {
            server.address.set_port(port);
            return Ok(server);
        }
        if let Some(status) = server.process.try_wait()? {
            return Err(format!("{command:?} ended at its start with {status}").into());
        }
        if begun.elapsed() > START_WITHIN {
            return Err(format!("{command:?} has not started within {START_WITHIN:?}").into());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The port, once the file is there and whole.
fn port(ports_file: &Path) -> Option<u16> {
    let text = std::fs::read_to_string(ports_file).ok()?;
    let ports: serde_json::Value = serde_json::from_str(&text).ok()?;
    u16::try_from(ports["listen"].as_u64()?).ok()
}
