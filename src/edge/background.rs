//! Threads beside those that answer, and how they share a core with them.
//!
//! As equals they would take turns with answers. A thread that nobody waits for steps back: it gets what the others leave
//! and a small share of its own, so that it always ends its work. That alone is not enough: who has the core keeps it until
//! the system's next tick, milliseconds later. So whoever works for longer gives way between its pieces.

/// Lets whoever waits for this core go first, if anyone does.
pub(super) fn give_way() {
    std::thread::yield_now();
}

/// What a thread does, from the least to the most that can wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Background {
    /// Storing: whoever writes waits for it where it is behind.
    Storing,
    /// Making tables: without one a search takes longer, and nobody waits.
    Tables,
}

impl Background {
    /// How far it steps back, as `nice` counts it: a tenth of the weight of those that answer, and an eightieth.
    #[cfg(target_os = "linux")]
    const fn steps(self) -> i32 {
        match self {
            Self::Storing => 10,
            Self::Tables => 19,
        }
    }

    /// The thread that calls this steps back for as long as it lives, with all threads that it starts.
    #[cfg(target_os = "linux")]
    pub fn step_back(self) {
        // To the system a thread is a process of its own here.
        let thread = rustix::thread::gettid();
        if let Err(error) = rustix::process::setpriority_process(Some(thread), self.steps()) {
            tracing::warn!(%error, thread = ?self, "a thread has the priority of those that answer");
        }
    }

    /// Other systems have no priority for a single thread.
    #[cfg(not(target_os = "linux"))]
    pub fn step_back(self) {}
}
