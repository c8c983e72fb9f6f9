//! The thread on which an edge keeps its file, behind those that answer.
//!
//! What was answered is noted at the rate of the answers. On a core that both share, notes would take turns with answers as
//! equals, and drones would wait for a journal that no request needs. So this thread steps back: it
//! gets what answers leave, at least a tenth. Zones are in force before they are stored, so only
//! their acknowledgement waits longer, and only where the machine has nothing to spare.

use crate::edge::Background;
use std::io;
use tokio::runtime::{Builder, Handle, Runtime};

/// A runtime of one thread.
#[derive(Debug)]
pub(super) struct StoreThread {
    handle: Handle,
    /// None only while it is dropped.
    runtime: Option<Runtime>,
}

impl StoreThread {
    /// Starts it.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub(super) fn start() -> io::Result<Self> {
        let mut builder = Builder::new_multi_thread();
        builder.worker_threads(1).thread_name("skyway-store");
        // Threads that are started from it, as that of SQLite is, step back with it.
        builder
            .enable_all()
            .on_thread_start(|| Background::Storing.step_back());
        let runtime = builder.build()?;
        Ok(Self {
            handle: runtime.handle().clone(),
            runtime: Some(runtime),
        })
    }

    /// Where to set tasks to work on it.
    pub(super) fn handle(&self) -> &Handle {
        &self.handle
    }
}

impl Drop for StoreThread {
    fn drop(&mut self) {
        // A runtime may not be waited for on another one, and everything is stored by now.
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}
