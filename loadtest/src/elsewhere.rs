//! What the machine does beside the load and its servers: the more of it, the less the times say.

use crate::cores;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

/// How long every thread has run of processes that are neither this one nor its children: daemons, the kernel.
#[derive(Debug, Default)]
pub(crate) struct Elsewhere(BTreeMap<String, Duration>);

impl Elsewhere {
    /// As it is now; empty where the system does not tell. Looks at every process, which takes milliseconds.
    pub(crate) fn now() -> Self {
        let own = std::process::id();
        let mut threads = BTreeMap::new();
        for pid in numbers_in("/proc") {
            // A process or a thread may have ended meanwhile.
            let stat = std::fs::read_to_string(format!("/proc/{pid}/stat"));
            let is_ours = |parent| pid == own || parent == own;
            if stat.is_ok_and(|stat| parent_of(&stat).is_none_or(is_ours)) {
                continue;
            }
            for tid in numbers_in(&format!("/proc/{pid}/task")) {
                let thread = format!("/proc/{pid}/task/{tid}");
                if let Ok(worked) = cores::time_of_thread(Path::new(&thread)) {
                    threads.insert(thread, worked);
                }
            }
        }
        Self(threads)
    }

    /// How long threads have run since; of those that have ended meanwhile nothing is known. None where the system does
    /// not tell.
    pub(crate) fn worked_since(&self, before: &Self) -> Option<Duration> {
        let worked = self.0.iter().map(|(thread, &worked)| {
            let earlier = before.0.get(thread).copied().unwrap_or_default();
            worked.saturating_sub(earlier)
        });
        (!before.0.is_empty()).then(|| worked.sum())
    }
}

/// The names of folders that are numbers.
fn numbers_in(folder: &str) -> Vec<u32> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    names.filter_map(|name| name.parse().ok()).collect()
}

/// The parent in a line of `/proc/PID/stat`: after the name, which may have spaces and brackets, and the state.
fn parent_of(stat: &str) -> Option<u32> {
    let (_, after_name) = stat.rsplit_once(')')?;
    after_name.split_whitespace().nth(1)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parent_is_found_whatever_a_process_is_called() {
        assert_eq!(parent_of("12 (a) b (c) S 77 12 12 0"), Some(77));
        assert_eq!(parent_of("12 (cut"), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn others_are_neither_this_process_nor_its_children() {
        let now = Elsewhere::now();
        let own = format!("/proc/{}/", std::process::id());
        assert!(now.0.keys().any(|thread| thread.starts_with("/proc/1/")));
        assert!(!now.0.keys().any(|thread| thread.starts_with(&own)));
        assert_eq!(now.worked_since(&Elsewhere::default()), None);
    }
}
