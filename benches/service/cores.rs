//! Which processor works for whom, and for how long it did. The load test is compiled with this file, too.

use crate::Result;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// The core of the servers.
const OF_SERVERS: &str = "0";
/// The core of the load.
const OF_LOAD: &str = "1";

/// Puts this process on the core of the load; false where that cannot be, and everything shares all cores.
pub(crate) fn take_second() -> bool {
    let pid = std::process::id().to_string();
    let pinning = Command::new("taskset")
        .args(["--all-tasks", "--cpu-list", "--pid", OF_LOAD, &pid])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    pinning.is_ok_and(|status| status.success())
}

/// A command on the core of the servers, if there is one: taskset becomes the program, so that its id is the
/// program's.
pub(crate) fn of_servers(program: &str) -> Command {
    let can_pin = Command::new("taskset")
        .args(["--cpu-list", OF_SERVERS, "true"])
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if !can_pin {
        return Command::new(program);
    }
    let mut command = Command::new("taskset");
    command.args(["--cpu-list", OF_SERVERS, program]);
    command
}

/// How long the threads of a process have run, those that have ended left out.
pub(crate) fn processor_time(pid: &str) -> Result<Duration> {
    let mut sum = Duration::ZERO;
    for task in std::fs::read_dir(format!("/proc/{pid}/task"))? {
        // A thread may have ended since it was listed.
        sum += time_of_thread(&task?.path()).unwrap_or_default();
    }
    Ok(sum)
}

/// How long a thread has run, given its folder below `/proc`.
pub(crate) fn time_of_thread(folder: &Path) -> Result<Duration> {
    let text = std::fs::read_to_string(folder.join("schedstat"))?;
    let on_cpu_ns = text.split(' ').next().unwrap_or_default();
    Ok(Duration::from_nanos(on_cpu_ns.parse()?))
}
