//! Runs the binary as a shell would, with an empty environment, and keeps what it said.
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of the command line start it and read the files it writes"
)]

use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// What a run left behind.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Run {
    fn of(output: &Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
        Self {
            code: output.status.code().expect("an exit code"),
            stdout: text(&output.stdout),
            stderr: text(&output.stderr),
        }
    }

    /// The same run, which has to have ended with this code.
    #[track_caller]
    pub(crate) fn exits(self, code: i32) -> Self {
        assert_eq!(self.code, code, "{self:#?}");
        self
    }

    /// Standard output, as JSON.
    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).expect("JSON")
    }

    /// Standard output, as one JSON value to a line.
    #[track_caller]
    pub(crate) fn json_lines(&self) -> Vec<Value> {
        let lines = self.stdout.lines();
        lines
            .map(|line| serde_json::from_str(line).expect("a line of JSON"))
            .collect()
    }
}

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_skyway"));
    command.args(arguments).env_clear();
    command
}

/// Runs `skyway` with arguments and nothing on standard input.
pub(crate) fn skyway(arguments: &[&str]) -> Run {
    skyway_in(arguments, &[])
}

/// The same in an environment.
pub(crate) fn skyway_in(arguments: &[&str], environment: &[(&str, &str)]) -> Run {
    let mut command = command(arguments);
    command
        .envs(environment.iter().copied())
        .stdin(Stdio::null());
    Run::of(&command.output().expect("a binary that starts"))
}

/// The same with something on standard input.
pub(crate) fn skyway_with_input(arguments: &[&str], input: &[u8]) -> Run {
    let mut command = command(arguments);
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().expect("a binary that starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    let input = input.to_vec();
    // From a thread, as the answers may fill their pipe before the input is read.
    let writer = std::thread::spawn(move || stdin.write_all(&input));
    let output = child.wait_with_output().expect("a run that ends");
    let _ = writer.join().expect("a writer that ends");
    Run::of(&output)
}

/// The same where a file can have no more than some kilobytes, as on a disk that is full.
#[cfg(unix)]
pub(crate) fn skyway_on_a_full_disk(arguments: &[&str]) -> Run {
    let mut shell = Command::new("/bin/sh");
    let limited = r#"trap "" XFSZ; ulimit -f 8; exec "$0" "$@""#;
    shell.args(["-c", limited, env!("CARGO_BIN_EXE_skyway")]);
    shell.args(arguments).env_clear().stdin(Stdio::null());
    Run::of(&shell.output().expect("a shell that starts"))
}

/// Runs `skyway` for a reader who closes the pipe before reading anything.
pub(crate) fn skyway_unread(arguments: &[&str]) -> Run {
    let mut command = command(arguments);
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().expect("a binary that starts");
    drop(child.stdout.take());
    Run::of(&child.wait_with_output().expect("a run that ends"))
}

/// A daemon that runs until it is told to end.
#[cfg(all(unix, feature = "edge"))]
pub(crate) struct Server {
    child: std::process::Child,
    pub(crate) address: std::net::SocketAddr,
    pub(crate) admin: std::net::SocketAddr,
}

#[cfg(all(unix, feature = "edge"))]
impl Server {
    /// Starts it on free ports and waits until it serves. Its log is the file `log`.
    pub(crate) fn start(desk: &Workspace, arguments: &[&str]) -> Self {
        let log = std::fs::File::create(desk.path("log")).expect("a file");
        let ports_file = desk.path("ports.json");
        let anywhere = ["--listen", "127.0.0.1:0", "--admin-listen", "127.0.0.1:0"];
        let mut command = command(arguments);
        command.args(anywhere).args(["--ports-file", &ports_file]);
        // Edges plan by distance unless a test says otherwise.
        command.env("SKYWAY_EDGE_FLIGHT_AIRFRAME", "none");
        command.stdin(Stdio::null()).stderr(log);
        let mut child = command.spawn().expect("a binary that starts");
        // It writes its ports once it serves; a daemon that has ended never will.
        let ports: Value = loop {
            let text = std::fs::read_to_string(&ports_file).unwrap_or_default();
            match serde_json::from_str(&text) {
                Ok(ports) => break ports,
                Err(_) => assert!(child.try_wait().expect("a child").is_none(), "it has ended"),
            }
            std::thread::sleep(std::time::Duration::from_millis(2));
        };
        let address = |name: &str| {
            let port = u16::try_from(ports[name].as_u64().expect("a port")).expect("a port");
            (std::net::Ipv4Addr::LOCALHOST, port).into()
        };
        Self {
            child,
            address: address("listen"),
            admin: address("admin_listen"),
        }
    }

    /// Asks over a connection of its own, which has to succeed; gives head and body. Each header ends with a line break.
    #[track_caller]
    pub(crate) fn ask(
        address: std::net::SocketAddr,
        line: &str,
        headers: &str,
        body: &str,
    ) -> String {
        let answer = Self::exchange(address, line, headers, body);
        assert!(answer.starts_with("HTTP/1.1 2"), "{line}: {answer}");
        answer
    }

    /// The same, whatever is answered.
    pub(crate) fn exchange(
        address: std::net::SocketAddr,
        line: &str,
        headers: &str,
        body: &str,
    ) -> String {
        use std::io::Read;
        let mut stream = std::net::TcpStream::connect(address).expect("the daemon");
        let request = format!(
            "{line} HTTP/1.1\r\nhost: {address}\r\ncontent-length: {}\r\nconnection: close\r\n{headers}\r\n{body}",
            body.len()
        );
        stream.write_all(request.as_bytes()).expect("a reader");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("an answer");
        answer
    }

    /// What the system tells of its process under a name, where it does.
    #[cfg(target_os = "linux")]
    pub(crate) fn status(&self, name: &str) -> Option<String> {
        let path = format!("/proc/{}/status", self.child.id());
        let status = std::fs::read_to_string(path).expect("a process");
        let mut lines = status.lines().filter_map(|line| line.split_once(':'));
        let (_, value) = lines.find(|(of, _)| *of == name)?;
        Some(value.trim().to_owned())
    }

    /// Tells it to end; gives its exit code.
    pub(crate) fn end(mut self) -> i32 {
        let id = self.child.id().to_string();
        let told = Command::new("kill").arg(&id).status().expect("kill");
        assert!(told.success());
        self.child
            .wait()
            .expect("it ends")
            .code()
            .expect("no signal")
    }
}

#[cfg(all(unix, feature = "edge"))]
impl Drop for Server {
    fn drop(&mut self) {
        // One that has ended already cannot be killed.
        let _ended = self.child.kill();
        let _code = self.child.wait();
    }
}

/// A directory that goes away with the test.
pub(crate) struct Workspace(TempDir);

/// Starts an edge over a store by one of its names; gives what it says as it ends, or nothing where it serves.
#[cfg(all(unix, feature = "edge"))]
pub(crate) fn starts_over(desk: &Workspace, store: &str) -> Option<(i32, String)> {
    starts_with(desk, &["--store", store])
}

/// Starts an edge with these flags; gives what it says as it ends, or nothing where it serves.
#[cfg(all(unix, feature = "edge"))]
pub(crate) fn starts_with(desk: &Workspace, flags: &[&str]) -> Option<(i32, String)> {
    let ports = desk.path("other-ports.json");
    let log = std::fs::File::create(desk.path("other-log")).expect("a file");
    let anywhere = ["--listen", "127.0.0.1:0", "--admin-listen", "127.0.0.1:0"];
    let mut edge = command(&["edge"]);
    edge.args(flags)
        .args(anywhere)
        .args(["--ports-file", &ports]);
    edge.stdin(Stdio::null()).stderr(log);
    let mut edge = edge.spawn().expect("a binary that starts");
    loop {
        if let Some(status) = edge.try_wait().expect("a child") {
            let code = status.code().expect("no signal");
            return Some((code, desk.read("other-log")));
        }
        if !std::fs::read(&ports).unwrap_or_default().is_empty() {
            edge.kill().expect("a child");
            edge.wait().expect("a child");
            return None;
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
}

impl Workspace {
    pub(crate) fn new() -> Self {
        Self(TempDir::new().expect("a directory"))
    }

    /// The path of a file in it.
    pub(crate) fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().expect("UTF-8").to_owned()
    }

    /// Writes a file in it.
    pub(crate) fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> String {
        let path = self.path(name);
        std::fs::write(&path, contents).expect("a file that can be written");
        path
    }

    /// Sets who may do what with a file in it.
    #[cfg(all(unix, feature = "edge"))]
    pub(crate) fn permit(&self, name: &str, mode: u32) {
        use std::os::unix::fs::PermissionsExt;
        let permissions = std::fs::Permissions::from_mode(mode);
        std::fs::set_permissions(self.path(name), permissions).expect("a file of ours");
    }

    /// Makes a symbolic link in it.
    #[cfg(all(unix, feature = "edge"))]
    pub(crate) fn link(&self, name: &str, target: &str) {
        std::os::unix::fs::symlink(target, self.path(name)).expect("a link");
    }

    /// Gives a file in it a second name.
    #[cfg(feature = "edge")]
    pub(crate) fn twin(&self, name: &str, of: &str) {
        std::fs::hard_link(self.path(of), self.path(name)).expect("a link");
    }

    /// Reads a file in it.
    pub(crate) fn read(&self, name: &str) -> String {
        read(Path::new(&self.path(name)))
    }

    /// True for a file in it that is compressed with gzip.
    pub(crate) fn is_gzip(&self, name: &str) -> bool {
        let bytes = std::fs::read(self.path(name)).expect("a readable file");
        bytes.starts_with(&[0x1f, 0x8b])
    }

    /// The names of the files in a directory in it, sorted.
    pub(crate) fn list(&self, directory: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.path(directory)).expect("a directory");
        let mut names: Vec<String> = entries
            .map(|entry| {
                let name = entry.expect("an entry").file_name();
                name.into_string().expect("UTF-8")
            })
            .collect();
        names.sort();
        names
    }
}

/// The path of a file of the repository.
pub(crate) fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Reads a file as text.
pub(crate) fn read(path: &Path) -> String {
    std::fs::read_to_string(path).expect("a readable file")
}

/// Reads a file as it is.
pub(crate) fn read_bytes(path: &str) -> Vec<u8> {
    std::fs::read(path).expect("a readable file")
}
