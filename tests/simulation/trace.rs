//! What happens in a run, as text: one line for each event, in the order in which they happen.

use std::sync::{Mutex, PoisonError};

/// Collects what happens.
#[derive(Debug)]
pub(crate) struct Trace {
    lines: Mutex<Vec<String>>,
    /// Each event is told as it happens.
    is_told: bool,
}

#[expect(
    clippy::disallowed_methods,
    reason = "who looks for the cause of a failure says so in the environment"
)]
fn is_told() -> bool {
    std::env::var("SKYWAY_FAULT_TRACE").is_ok()
}

impl Trace {
    pub(crate) fn new() -> Self {
        Self {
            lines: Mutex::default(),
            is_told: is_told(),
        }
    }

    pub(crate) fn tell(&self, at_ms: u64, who: &str, what: &str) {
        let line = format!("{at_ms:>7} {who:<4} {what}");
        if self.is_told {
            println!("{line}");
        }
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        lines.push(line);
    }

    pub(crate) fn lines(&self) -> Vec<String> {
        let lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        lines.clone()
    }
}
