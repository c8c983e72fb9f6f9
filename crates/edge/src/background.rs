//! Threads beside those that answer, and how they share a core with them.
//!
//! As equals they would take turns with answers. A background thread steps back: it gets what the others leave
//! and a small share of its own, so that it always ends its work. That alone is not enough: who has the core keeps it until
//! the system's next tick, milliseconds later. So a longer task gives way between its pieces.

use std::cell::Cell;
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::{Handle, RuntimeFlavor};
use tokio::sync::Semaphore;
use tokio::task::{JoinError, block_in_place, spawn_blocking};

/// Who gives way may get the core back a good millisecond later, so it is not done for every piece: where answers never leave
/// the core free, a thread gets about a quarter of it this way.
const TURN: Duration = Duration::from_micros(500);

#[expect(
    clippy::disallowed_types,
    reason = "how long a thread has had its core is real time"
)]
type Moment = std::time::Instant;

thread_local! {
    static TURN_BEGAN: Cell<Option<Moment>> = const { Cell::new(None) };
}

/// From here on this thread may work for long, and gives way where it says so.
pub(super) fn begin_turn() {
    TURN_BEGAN.set(Some(now()));
}

/// Lets the thread that waits for this core go first, if the turn of this thread has lasted long
/// enough; a thread that has begun none, such as one that answers, goes on. What is computed does
/// not depend on it.
pub(super) fn give_way() {
    let Some(began) = TURN_BEGAN.get() else {
        return;
    };
    if now().duration_since(began) >= TURN {
        std::thread::yield_now();
        begin_turn();
    }
}

/// How many threads can work at once.
#[expect(
    clippy::disallowed_methods,
    reason = "what is computed does not depend on how many threads compute it"
)]
pub(super) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Does on this thread what may take long or wait for others; where it has other tasks, another thread takes them over.
pub(super) fn in_place<T>(work: impl FnOnce() -> T) -> T {
    let runtime = Handle::try_current();
    match runtime.map(|runtime| runtime.runtime_flavor()) {
        Ok(RuntimeFlavor::MultiThread) => block_in_place(work),
        _ => work(),
    }
}

/// Turns at the cores, for what takes one for long, such as a search: first come, first served.
///
/// Threads without a bound would take turns with each other, end late together, and keep waiting the thread that reads what
/// comes in.
#[derive(Debug)]
pub(super) struct Turns(Arc<Semaphore>);

impl Turns {
    /// So many at once.
    pub(super) fn new(at_once: usize) -> Self {
        Self(Arc::new(Semaphore::new(at_once)))
    }

    /// Works where blocking is allowed once it is its turn.
    ///
    /// # Errors
    /// The work has panicked.
    pub(super) async fn work<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, JoinError> {
        // It is never closed.
        let turn = self.0.clone().acquire_owned().await;
        let done = spawn_blocking(move || {
            let done = work();
            drop(turn);
            done
        });
        done.await
    }
}

/// Turns for what searches: reports never wait for compositions.
#[derive(Debug)]
pub(super) struct SearchTurns {
    /// One more than there are cores, so that none is idle between two.
    pub(super) reports: Turns,
    pub(super) compositions: Turns,
}

impl Default for SearchTurns {
    fn default() -> Self {
        Self {
            reports: Turns::new(cores() + 1),
            compositions: Turns::new(cores()),
        }
    }
}

#[expect(
    clippy::disallowed_methods,
    reason = "how long a thread has had its core is real time"
)]
fn now() -> Moment {
    Moment::now()
}

/// What a thread does, from the least to the most that can wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Background {
    /// Replanning: drones wait for it, and what has closed is in force already.
    Replanning,
    /// Storing: the writer waits for it where it is behind.
    Storing,
    /// Looking for better plans, which nobody has asked for. It shares locks with those that answer, so it has to go on.
    Offers,
    /// Making tables: without one a search takes longer, and no request waits.
    Tables,
}

impl Background {
    /// How far it steps back, as `nice` counts it: a third of the weight of those that answer, a tenth, and an eightieth.
    #[cfg(target_os = "linux")]
    const fn steps(self) -> i32 {
        match self {
            Self::Replanning => 5,
            Self::Storing | Self::Offers => 10,
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[tokio::test(flavor = "multi_thread")]
    async fn no_more_work_is_done_at_once_than_there_are_turns() {
        let turns = Arc::new(Turns::new(3));
        let at_work = Arc::new(AtomicUsize::new(0));
        let works = (0..64).map(|_| {
            let (turns, at_work) = (turns.clone(), at_work.clone());
            tokio::spawn(async move {
                let work = move || {
                    let mut most = at_work.fetch_add(1, Ordering::SeqCst) + 1;
                    for _ in 0..1_000 {
                        std::thread::yield_now();
                        most = most.max(at_work.load(Ordering::SeqCst));
                    }
                    at_work.fetch_sub(1, Ordering::SeqCst);
                    most
                };
                turns.work(work).await.expect("no panic")
            })
        });
        let works: Vec<_> = works.collect();
        for work in works {
            assert!(work.await.expect("no panic") <= 3);
        }
    }
}
