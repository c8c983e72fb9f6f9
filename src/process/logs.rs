//! What a process tells of itself: log lines on standard error, for people or one JSON object to a line, and
//! traces of requests for a collector.

use super::traces::{Traces, TracesConfig, TracesError};
use crate::config::{LogFilter, LogFormat};
use crate::edge::TRACES_TARGET;
use std::io;
use thiserror::Error;
use tracing_subscriber::Layer;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::{SubscriberInitExt, TryInitError};

/// Why a process cannot tell of itself.
#[derive(Debug, Error)]
pub enum LogsError {
    /// Logs were started before in this process.
    #[error("cannot start the logs: {0}")]
    Started(#[from] TryInitError),
    /// There are no traces.
    #[error(
        "cannot send traces: {0}; traces.endpoint is an address such as http://127.0.0.1:4318/v1/traces"
    )]
    Traces(#[from] TracesError),
}

/// The logs and traces of this process, until they end.
#[derive(Debug)]
#[must_use = "the last traces are sent when it ends"]
pub struct Logs(Option<Traces>);

/// Starts the logs of this process, and its traces where a collector is named. To be called outside of the runtime.
///
/// # Errors
/// When they were started before, or the collector's address is none.
pub fn start(
    filter: &LogFilter,
    format: LogFormat,
    traces: Option<&TracesConfig>,
) -> Result<Logs, LogsError> {
    let lines = tracing_subscriber::fmt::layer()
        .with_ansi(false)
        .with_writer(standard_error);
    let lines = match format {
        LogFormat::Text => lines.boxed(),
        LogFormat::Json => lines.json().flatten_event(true).boxed(),
    };
    let traces = traces.map(Traces::start).transpose()?;
    let spans = traces.as_ref().map(|traces| {
        let only_requests = Targets::new().with_target(TRACES_TARGET, LevelFilter::TRACE);
        tracing_opentelemetry::layer()
            .with_tracer(traces.tracer())
            .with_location(false)
            .with_threads(false)
            .with_filter(only_requests)
    });
    tracing_subscriber::registry()
        .with(lines.with_filter(filter.targets()))
        .with(spans)
        .try_init()?;
    Ok(Logs(traces))
}

impl Logs {
    /// Sends the traces that still wait, within two seconds. To be called outside of the runtime.
    pub fn end(self) {
        if let Some(traces) = self.0 {
            traces.end();
        }
    }
}

#[expect(
    clippy::disallowed_methods,
    reason = "the door to standard error, for logs"
)]
fn standard_error() -> io::Stderr {
    io::stderr()
}
