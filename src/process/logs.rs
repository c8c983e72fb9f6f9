//! Log lines, on standard error: for people, or one JSON object to a line.

use crate::config::{LogFilter, LogFormat};
use std::io;
use thiserror::Error;
use tracing_subscriber::Layer;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::{SubscriberInitExt, TryInitError};

/// Logs were started before in this process.
#[derive(Debug, Error)]
#[error("cannot start the logs: {0}")]
pub struct LogsError(#[from] TryInitError);

/// Starts the logs of this process.
///
/// # Errors
/// When they were started before.
pub fn start(filter: &LogFilter, format: LogFormat) -> Result<(), LogsError> {
    let lines = tracing_subscriber::fmt::layer()
        .with_ansi(false)
        .with_writer(standard_error);
    let lines = match format {
        LogFormat::Text => lines.boxed(),
        LogFormat::Json => lines.json().flatten_event(true).boxed(),
    };
    tracing_subscriber::registry()
        .with(lines.with_filter(filter.targets()))
        .try_init()?;
    Ok(())
}

#[expect(
    clippy::disallowed_methods,
    reason = "the door to standard error, for logs"
)]
fn standard_error() -> io::Stderr {
    io::stderr()
}
