//! What the machine does beside the load and its servers: the more of it, the less the times say.

use crate::cores;
use std::time::Duration;

/// How long all processes have run that are neither this one nor its children: daemons, threads of the kernel. None
/// where the system does not tell.
pub(crate) fn processor_time() -> Option<Duration> {
    let own = std::process::id();
    let mut sum = Duration::ZERO;
    for entry in std::fs::read_dir("/proc").ok()? {
        let name = entry.ok()?.file_name();
        let Some(pid) = name.to_str().and_then(|name| name.parse::<u32>().ok()) else {
            continue;
        };
        let parent = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok();
        if pid == own || parent.as_deref().and_then(parent_of) == Some(own) {
            continue;
        }
        // It may have ended meanwhile.
        sum += cores::processor_time(&pid.to_string()).unwrap_or_default();
    }
    Some(sum)
}

/// The parent in a line of `/proc/PID/stat`: after the name, which may have spaces and brackets, and the state.
fn parent_of(stat: &str) -> Option<u32> {
    let (_, after_name) = stat.rsplit_once(')')?;
    after_name.split_whitespace().nth(1)?.parse().ok()
}
