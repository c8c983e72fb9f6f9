//! The accept loop, and the drain of what it accepted.

use super::ServerConfig;
use super::admission::Admission;
use super::connection::Connections;
use super::drain::Drain;
use super::gate_config::GateConfig;
use super::places::{Place, Places};
use super::services::Services;
use crate::api::metrics::{CloseReason, RequestMetrics};
use std::io;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{sleep, timeout};
use tokio_util::task::TaskTracker;

/// How long to wait after an error of the machine, such as too many open files.
const BACK_OFF: Duration = Duration::from_millis(100);

/// How long a connection lives that has a place for probes.
const PROBE_WITHIN: Duration = Duration::from_secs(2);

/// How a drain ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drained {
    /// How many connections were cut because the time was over.
    pub forced: usize,
}

/// Serves a listener until its drain has begun and all its connections are closed.
///
/// # Errors
///
/// The listener has no address, or the system has no random bits for request ids. Errors of single
/// connections never end the loop.
pub async fn serve(
    listener: TcpListener,
    services: impl Into<Services>,
    gate: GateConfig,
    config: ServerConfig,
    metrics: Arc<RequestMetrics>,
    drain: Drain,
) -> io::Result<Drained> {
    let gate = Admission::new(
        gate,
        services.into(),
        listener.local_addr()?,
        Arc::clone(&metrics),
        drain.clone(),
    )?;
    let connections = Arc::new(Connections::new(&config, Arc::new(gate), drain.clone()));
    let tasks = TaskTracker::new();
    let places = Arc::new(Places::new(&config));
    let accepting = accept_all(&listener, &connections, &tasks, &places, &metrics);
    let stop = async {
        drain.begun().await;
        sleep(config.drain_delay).await;
    };
    tokio::select! {
        () = accepting => {}
        () = stop => {}
    }
    // Closed before the rest, so that who comes now is sent elsewhere by the system.
    drop(listener);
    drain.close();
    tasks.close();
    if timeout(config.drain_timeout, tasks.wait()).await.is_ok() {
        return Ok(Drained { forced: 0 });
    }
    let forced = tasks.len();
    drain.force();
    tasks.wait().await;
    Ok(Drained { forced })
}

async fn accept_all(
    listener: &TcpListener,
    connections: &Arc<Connections>,
    tasks: &TaskTracker,
    places: &Arc<Places>,
    metrics: &Arc<RequestMetrics>,
) {
    loop {
        let (stream, address) = match listener.accept().await {
            Ok(accepted) => accepted,
            Err(error) => {
                metrics.accept_failed();
                if let Some(pause) = pause_after(&error) {
                    tracing::warn!(%error, "could not accept a connection");
                    sleep(pause).await;
                }
                continue;
            }
        };
        match places.take(address.ip()) {
            Ok(place) => {
                let (connections, metrics) = (Arc::clone(connections), Arc::clone(metrics));
                tasks.spawn(serve_one(connections, stream, place, metrics));
            }
            Err(reason) => metrics.closed(reason),
        }
    }
}

async fn serve_one(
    connections: Arc<Connections>,
    stream: TcpStream,
    place: Place,
    metrics: Arc<RequestMetrics>,
) {
    // Answers are small and awaited. Where it fails, the connection is gone already, and serving it finds out.
    let _ = stream.set_nodelay(true);
    metrics.connections().inc();
    let is_for_probes = place.is_for_probes();
    let serving = connections.serve(stream, Arc::new(place));
    let cut = match is_for_probes {
        // A slow caller would keep the next probe out.
        true => timeout(PROBE_WITHIN, serving)
            .await
            .unwrap_or(Some(CloseReason::Cap)),
        false => serving.await,
    };
    metrics.connections().dec();
    if let Some(reason) = cut {
        metrics.closed(reason);
        tracing::debug!(reason = reason.name(), "connection closed");
    }
}

/// Nothing where the error was the client's, which went away; a pause where it is the machine's, which would
/// fail again at once.
fn pause_after(error: &io::Error) -> Option<Duration> {
    let is_of_client = matches!(
        error.kind(),
        io::ErrorKind::ConnectionAborted
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::ConnectionRefused
    );
    (!is_of_client).then_some(BACK_OFF)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_many_open_files_make_a_pause_and_a_client_gone_does_not() {
        const EMFILE: i32 = 24;
        const ECONNABORTED: i32 = 103;
        assert_eq!(
            pause_after(&io::Error::from_raw_os_error(EMFILE)),
            Some(BACK_OFF)
        );
        assert_eq!(
            pause_after(&io::Error::from_raw_os_error(ECONNABORTED)),
            None
        );
    }
}
