//! The servers that are loaded: child processes on a core of their own, which end with the values that stand for them.

use crate::Result;
use crate::cores;
use crate::requests::get;
use crate::scenario::{Dialect, Servers};
use crate::transport::{Connections, Status};
use std::fs::File;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tokio::time::sleep;

/// How long a server may take to start.
const START_WITHIN: Duration = Duration::from_secs(30);
const LOOK_AGAIN: Duration = Duration::from_millis(10);
/// Settings in the environment are not the defaults.
const ENVIRONMENT_PREFIX: &str = "SKYWAY_";
/// The registry gives way to the edge, whose core it shares: where they are deployed it has a machine of its own.
const REGISTRY_NICENESS: &str = "19";

/// Who goes first where both want the core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Niceness {
    Ordinary,
    GivesWay,
}

/// A server in a process of its own, which ends with this value.
pub(crate) struct Server {
    process: Child,
    pub(crate) address: SocketAddr,
}

impl Server {
    pub(crate) fn pid(&self) -> u32 {
        self.process.id()
    }

    /// Ends it with SIGKILL, and waits until it is gone.
    pub(crate) fn kill(&mut self) {
        // It may have ended by itself, which is what is wanted.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.kill();
    }
}

/// The binary that is measured, and where it keeps its files.
pub(crate) struct Installed {
    pub(crate) program: PathBuf,
    pub(crate) folder: PathBuf,
}

impl Installed {
    /// A daemon with these arguments on this port, on all cores; it may not serve yet.
    pub(crate) fn daemon(&self, role: &str, port: u16, arguments: &[String]) -> Result<Server> {
        let mut command = self.with_files(Command::new(&self.program), role)?;
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        command.args(["--listen", &address.to_string()]);
        command.args(arguments);
        Ok(Server {
            process: command.spawn()?,
            address,
        })
    }

    fn command(&self, role: &str, niceness: Niceness) -> Result<Command> {
        let program = self.program.to_string_lossy();
        let command = match niceness {
            Niceness::Ordinary => cores::of_servers(&program),
            Niceness::GivesWay => {
                let mut command = cores::of_servers("nice");
                command.args(["-n", REGISTRY_NICENESS, &program]);
                command
            }
        };
        self.with_files(command, role)
    }

    /// A command with a log, a file for its ports, and no settings of ours.
    fn with_files(&self, mut command: Command, role: &str) -> Result<Command> {
        for (name, _) in std::env::vars_os() {
            if name.to_string_lossy().starts_with(ENVIRONMENT_PREFIX) {
                command.env_remove(name);
            }
        }
        // That of a daemon before it is not this one's.
        let _ = std::fs::remove_file(self.ports_file(role));
        // Logs are part of the production configuration; they go to a file as a service's do.
        let log = File::create(self.folder.join(format!("{role}.log")))?;
        command
            .arg(role)
            .args(["--admin-listen", "127.0.0.1:0", "--ports-file"])
            .arg(self.ports_file(role))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log);
        Ok(command)
    }

    fn ports_file(&self, role: &str) -> PathBuf {
        self.folder.join(format!("{role}.json"))
    }

    /// An edge that is ready.
    pub(crate) async fn edge(
        &self,
        servers: &Servers,
        registry: Option<SocketAddr>,
    ) -> Result<Server> {
        let mut command = self.command("edge", Niceness::Ordinary)?;
        command.args(["--listen", "127.0.0.1:0"]);
        match servers.store {
            true => command.arg("--store").arg(self.folder.join("edge.db")),
            false => command.arg("--no-store"),
        };
        match registry {
            Some(registry) => command.args(["--registry-url", &format!("http://{registry}")]),
            None => command.args(["--network", &servers.network]),
        };
        for setting in &servers.settings {
            command.args(["--set", setting]);
        }
        let server = started(command, &self.ports_file("edge")).await?;
        ready(server.address).await?;
        Ok(server)
    }

    /// A registry that is ready, on a free port.
    pub(crate) async fn registry(&self, niceness: Niceness) -> Result<Server> {
        let server = self.registry_soon(0, niceness)?;
        let server = whose_port(server, &self.ports_file("registry")).await?;
        ready(server.address).await?;
        Ok(server)
    }

    /// A registry on the port that an edge knows, which may not serve yet.
    pub(crate) fn registry_again(&self, port: u16) -> Result<Server> {
        self.registry_soon(port, Niceness::GivesWay)
    }

    fn registry_soon(&self, port: u16, niceness: Niceness) -> Result<Server> {
        let mut command = self.command("registry", niceness)?;
        command
            .args(["--listen", &format!("127.0.0.1:{port}"), "--store"])
            .arg(self.folder.join("registry.db"));
        Ok(Server {
            process: command.spawn()?,
            address: SocketAddr::from((Ipv4Addr::LOCALHOST, port)),
        })
    }

    /// The echo of a dialect: this very program, called again.
    pub(crate) async fn echo(&self, dialect: Dialect, answers: &Path) -> Result<Server> {
        let ports_file = self.ports_file("echo");
        let program = std::env::current_exe()?;
        let mut command = cores::of_servers(&program.to_string_lossy());
        command
            .args(["echo", dialect.name()])
            .args([answers, &ports_file])
            .stdin(Stdio::null())
            .stdout(Stdio::null());
        started(command, &ports_file).await
    }
}

async fn started(mut command: Command, ports_file: &Path) -> Result<Server> {
    let server = Server {
        process: command.spawn()?,
        address: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
    };
    whose_port(server, ports_file).await
}

/// Waits until a server says which port it has taken.
async fn whose_port(mut server: Server, ports_file: &Path) -> Result<Server> {
    let begun = Instant::now();
    loop {
        if let Some(port) = port(ports_file) {
            server.address.set_port(port);
            return Ok(server);
        }
        if let Some(status) = server.process.try_wait()? {
            let log = ports_file.with_extension("log");
            let log = std::fs::read_to_string(log).unwrap_or_default();
            return Err(format!("a server ended at its start with {status}: {log}").into());
        }
        if begun.elapsed() > START_WITHIN {
            return Err(format!("a server has not started within {START_WITHIN:?}").into());
        }
        sleep(LOOK_AGAIN).await;
    }
}

/// The port, once the file is there and whole.
fn port(ports_file: &Path) -> Option<u16> {
    let text = std::fs::read_to_string(ports_file).ok()?;
    let ports: serde_json::Value = serde_json::from_str(&text).ok()?;
    u16::try_from(ports["listen"].as_u64()?).ok()
}

/// Waits until a daemon may be asked.
pub(crate) async fn ready(address: SocketAddr) -> Result<()> {
    let connections = Connections::new(address, 1, 1);
    let begun = Instant::now();
    while begun.elapsed() < START_WITHIN {
        let told = connections.ask(&get("/readyz")).await;
        if told.is_ok_and(|told| told.status == Status::Rest(200)) {
            return Ok(());
        }
        sleep(LOOK_AGAIN).await;
    }
    Err(format!("a server is not ready within {START_WITHIN:?}").into())
}
