//! The span of a request, for those who trace: nothing, and at no cost, where tracing is off.

use super::request::RequestId;
use crate::api::metrics::Dialect;
use crate::api::operations::Operation;
use crate::edge::TRACES_TARGET;
use http::HeaderMap;
use opentelemetry::propagation::{Extractor, TextMapPropagator as _};
use opentelemetry::trace::{TraceContextExt as _, TraceId};
use opentelemetry_sdk::propagation::TraceContextPropagator;
use tracing::Span;
use tracing::field::Empty;
use tracing_opentelemetry::OpenTelemetrySpanExt as _;

/// Begins the span of a request, as a part of what its client traces (W3C Trace Context, `traceparent`).
pub(super) fn of_request(
    operation: Operation,
    dialect: Dialect,
    request_id: &RequestId,
    headers: &HeaderMap,
) -> Span {
    let name = operation.row().name;
    let span = tracing::trace_span!(
        target: TRACES_TARGET,
        "request",
        otel.name = name,
        otel.kind = "server",
        otel.status_code = Empty,
        dialect = dialect.name(),
        request_id = Empty,
        code = Empty,
    );
    if !span.is_disabled() {
        span.record("request_id", tracing::field::display(request_id));
        let context = TraceContextPropagator::new().extract(&Headers(headers));
        // A parent is refused only to spans that have begun, which this one has not.
        let _is_set = span.set_parent(context);
    }
    span
}

/// The trace that a request is a part of, where that is one that is sent.
pub(super) fn sampled_trace(span: &Span) -> Option<TraceId> {
    if span.is_disabled() {
        return None;
    }
    let context = span.context();
    let span = context.span();
    let known = span.span_context();
    known.is_sampled().then(|| known.trace_id())
}

struct Headers<'a>(&'a HeaderMap);

impl Extractor for Headers<'_> {
    fn get(&self, key: &str) -> Option<&str> {
        self.0.get(key)?.to_str().ok()
    }

    fn keys(&self) -> Vec<&str> {
        self.0.keys().map(http::HeaderName::as_str).collect()
    }
}
