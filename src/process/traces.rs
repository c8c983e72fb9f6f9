//! Traces of requests, sent to a collector that takes OTLP over HTTP. Off unless one is named.
//!
//! Spans wait in a bounded queue for a thread of their own: no request waits for the collector, and what does not
//! fit while it is slow or away is dropped.

use crate::config::HttpUrl;
use opentelemetry::KeyValue;
use opentelemetry::trace::TracerProvider as _;
use opentelemetry_otlp::{
    ExporterBuildError, Protocol, SpanExporter, WithExportConfig as _, WithHttpConfig as _,
};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{
    BatchConfigBuilder, BatchSpanProcessor, Sampler, SdkTracer, SdkTracerProvider,
};
use std::time::Duration;
use thiserror::Error;

/// Spans that wait for the collector; further ones are dropped.
const QUEUE_SPANS_MAX: usize = 4096;
/// Spans in one request to the collector.
const BATCH_SPANS_MAX: usize = 512;
/// How often spans are sent.
const SEND_EVERY: Duration = Duration::from_secs(1);
/// How long the collector may take to answer.
const COLLECTOR_WITHIN: Duration = Duration::from_secs(2);
/// How long the end of a process waits for the last spans.
const END_WITHIN: Duration = Duration::from_secs(2);

/// Where traces go, and of whom.
#[derive(Clone, Debug)]
pub struct TracesConfig {
    /// The collector, as `http://127.0.0.1:4318/v1/traces`.
    pub endpoint: String,
    /// The part of the requests that is traced where the client does not decide.
    pub share: f64,
    /// The name of the daemon.
    pub service: &'static str,
}

impl TracesConfig {
    /// The traces of a daemon; none where no collector is named.
    pub fn of(service: &'static str, endpoint: Option<&HttpUrl>, share: f64) -> Option<Self> {
        endpoint.map(|endpoint| Self {
            endpoint: endpoint.as_str().to_owned(),
            share,
            service,
        })
    }
}

/// Why there are no traces.
#[derive(Debug, Error)]
pub enum TracesError {
    /// The collector cannot be spoken to.
    #[error(transparent)]
    Client(#[from] reqwest::Error),
    /// It cannot be reached under this name.
    #[error(transparent)]
    Endpoint(#[from] ExporterBuildError),
}

/// The traces of this process.
#[derive(Debug)]
pub(super) struct Traces(SdkTracerProvider);

impl Traces {
    /// Has to be called outside of the runtime, as the client of the collector has one of its own.
    pub(super) fn start(config: &TracesConfig) -> Result<Self, TracesError> {
        // Nothing is encrypted, so that no authority is asked for: a machine may have none.
        let client = reqwest::blocking::Client::builder()
            .no_proxy()
            .tls_certs_only([])
            .timeout(COLLECTOR_WITHIN)
            .build()?;
        let exporter = SpanExporter::builder()
            .with_http()
            .with_http_client(client)
            .with_endpoint(&config.endpoint)
            .with_protocol(Protocol::HttpBinary)
            .with_timeout(COLLECTOR_WITHIN)
            .build()?;
        let batches = BatchConfigBuilder::default()
            .with_max_queue_size(QUEUE_SPANS_MAX)
            .with_max_export_batch_size(BATCH_SPANS_MAX)
            .with_scheduled_delay(SEND_EVERY)
            .build();
        let processor = BatchSpanProcessor::builder(exporter)
            .with_batch_config(batches)
            .build();
        let resource = Resource::builder()
            .with_service_name(config.service)
            .with_attribute(KeyValue::new("service.version", env!("CARGO_PKG_VERSION")))
            .build();
        // A client that traces decides for its requests; else chance does.
        let sampler = Sampler::ParentBased(Box::new(Sampler::TraceIdRatioBased(config.share)));
        let provider = SdkTracerProvider::builder()
            .with_span_processor(processor)
            .with_sampler(sampler)
            .with_resource(resource)
            .build();
        Ok(Self(provider))
    }

    pub(super) fn tracer(&self) -> SdkTracer {
        self.0.tracer("skyway")
    }

    /// Sends what still waits, within a bound.
    pub(super) fn end(&self) {
        if let Err(error) = self.0.shutdown_with_timeout(END_WITHIN) {
            tracing::debug!(%error, "the last traces were not taken");
        }
    }
}
