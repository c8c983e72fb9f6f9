//! How long requests take. Where requests are traced, each bucket also names the trace of the last one that fell into it
//! (an *exemplar* of `OpenMetrics`), so that who sees slow requests finds one to look at.

use opentelemetry::trace::TraceId;
use prometheus_client::encoding::{EncodeLabelSet, EncodeMetric, MetricEncoder};
use prometheus_client::metrics::exemplar::HistogramWithExemplars;
use prometheus_client::metrics::histogram::{Histogram, exponential_buckets};
use prometheus_client::metrics::{MetricType, TypedMetric};
use std::fmt;
use std::time::Duration;

/// The label of an exemplar, by the name that dashboards look for.
#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
pub(super) struct TraceLabel {
    trace_id: String,
}

/// The durations of the requests of one operation.
#[derive(Clone, Debug)]
pub(super) enum Durations {
    /// Tracing is off: exemplars would cost a lock and find nothing to name.
    Plain(Histogram),
    /// Requests are traced.
    Traced(HistogramWithExemplars<TraceLabel>),
}

/// From 16 us, which one recomposition takes, to 16 s, beyond every deadline.
fn buckets() -> impl Iterator<Item = f64> {
    exponential_buckets(16e-6, 4.0, 11)
}

impl Durations {
    pub(super) fn plain() -> Self {
        Self::Plain(Histogram::new(buckets()))
    }

    pub(super) fn traced() -> Self {
        Self::Traced(HistogramWithExemplars::new(buckets()))
    }

    /// Counts a request, and names its trace where it has one that is sent.
    pub(super) fn observe(&self, took: Duration, trace: Option<TraceId>) {
        let took_s = took.as_secs_f64();
        match self {
            Self::Plain(histogram) => histogram.observe(took_s),
            Self::Traced(histogram) => {
                let label = trace.map(|trace| TraceLabel {
                    trace_id: trace.to_string(),
                });
                histogram.observe(took_s, label, None);
            }
        }
    }
}

impl EncodeMetric for Durations {
    fn encode(&self, encoder: MetricEncoder<'_>) -> Result<(), fmt::Error> {
        match self {
            Self::Plain(histogram) => histogram.encode(encoder),
            Self::Traced(histogram) => histogram.encode(encoder),
        }
    }

    fn metric_type(&self) -> MetricType {
        Self::TYPE
    }
}

impl TypedMetric for Durations {
    const TYPE: MetricType = MetricType::Histogram;
}
