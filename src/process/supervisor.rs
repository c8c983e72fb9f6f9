//! What the service manager is told, where one started this process and wants to know (systemd's `Type=notify`): that
//! the daemon serves, that it still turns, and that it is ending.
//!
//! It serves as soon as its listeners answer. Whether drones should be sent to it is another question, which `/readyz`
//! answers: an edge that waits for its registry is no reason to start it again.

/// The service manager, of a daemon that serves. Dropped, it hears nothing more.
#[derive(Debug)]
pub struct Supervisor {
    #[cfg(target_os = "linux")]
    watched: Option<tokio::task::AbortHandle>,
}

#[cfg(target_os = "linux")]
impl Supervisor {
    /// Tells that the daemon serves, and from now on that it turns, as often as the service manager wants to hear it.
    /// `status` is what it shows of the service.
    ///
    /// # Panics
    /// Outside a runtime.
    pub fn serving(status: &str) -> Self {
        use sd_notify::NotifyState::{Ready, Status};
        tell(&[Ready, Status(status)]);
        let watched = sd_notify::watchdog_enabled().map(|period| tokio::spawn(watch(period)));
        Self {
            watched: watched.map(|task| task.abort_handle()),
        }
    }

    /// Tells that the daemon is ending; while it does it still tells that it turns.
    pub fn ending(&self) {
        use sd_notify::NotifyState::{Status, Stopping};
        tell(&[Stopping, Status("ending: answers under way are finished")]);
    }
}

#[cfg(target_os = "linux")]
impl Drop for Supervisor {
    fn drop(&mut self) {
        if let Some(watched) = &self.watched {
            watched.abort();
        }
    }
}

/// Tells twice in a period that the runtime turns: that it wakes tasks in time, and begins new ones.
#[cfg(target_os = "linux")]
async fn watch(period: std::time::Duration) {
    let mut ticks = tokio::time::interval(period / 2);
    loop {
        ticks.tick().await;
        // A task of its own waits in the queue behind all others.
        if tokio::spawn(std::future::ready(())).await.is_ok() {
            tell(&[sd_notify::NotifyState::Watchdog]);
        }
    }
}

#[cfg(target_os = "linux")]
fn tell(states: &[sd_notify::NotifyState<'_>]) {
    if let Err(error) = sd_notify::notify(states) {
        tracing::warn!(%error, "the service manager cannot be told how the daemon stands");
    }
}

#[cfg(not(target_os = "linux"))]
impl Supervisor {
    /// Tells no one: no service manager listens.
    pub fn serving(_status: &str) -> Self {
        Self {}
    }

    /// Tells no one.
    pub fn ending(&self) {}
}
