//! The signals that ask a process to end.

use std::future::Future;
use std::io;

/// Listens for the signals that ask this process to end, from now on, and waits for the first: SIGTERM or
/// SIGINT, whose name it tells. Before the call they end the process at once.
///
/// # Errors
/// When the system does not let the process listen.
#[cfg(unix)]
pub fn termination() -> io::Result<impl Future<Output = &'static str>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    Ok(async move {
        tokio::select! {
            _ = terminate.recv() => "SIGTERM",
            _ = interrupt.recv() => "SIGINT",
        }
    })
}

/// Listens for Ctrl-C and waits for it.
///
/// # Errors
/// Never here.
#[cfg(not(unix))]
pub fn termination() -> io::Result<impl Future<Output = &'static str>> {
    Ok(async {
        // Who cannot listen is ended by the system.
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
        "Ctrl-C"
    })
}
