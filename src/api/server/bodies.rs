//! Bodies under watch: of requests, which may not grow beyond the limit, and of answers, which end with the drain.

use super::authentication::Lease;
use super::callers::OfCaller;
use super::drain::{Drain, Phase};
use super::services::Content;
use super::watch::InFlight;
use crate::api::metrics::Dialect;
use crate::api::problem;
use crate::edge::{Code, Refusal};
use bytes::Bytes;
use http_body::{Frame, SizeHint};
use http_body_util::{LengthLimitError, Limited};
use hyper::body::Incoming;
use prometheus_client::metrics::gauge::Gauge;
use std::error::Error;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll};
use tokio_util::sync::WaitForCancellationFutureOwned;

/// A place among the requests of a class and of a caller, given back when dropped.
#[derive(Debug)]
pub(crate) struct Permit {
    in_flight: Gauge,
    _of_caller: Option<OfCaller>,
}

impl Permit {
    /// A place, where fewer than the limit are taken.
    pub(crate) fn take(in_flight: &Gauge, limit: i64, of_caller: Option<OfCaller>) -> Option<Self> {
        let taken_before = in_flight.inc();
        let permit = Self {
            in_flight: in_flight.clone(),
            _of_caller: of_caller,
        };
        (taken_before < limit).then_some(permit)
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        self.in_flight.dec();
    }
}

/// The body of a request, which is not longer than its limit.
pub(crate) struct BoundedBody {
    inner: Limited<Incoming>,
    exceeded: Option<Arc<AtomicBool>>,
}

impl BoundedBody {
    /// A body that said how long it is, and was found short enough: hyper holds it to that.
    pub(crate) fn announced(body: Incoming) -> Self {
        Self {
            inner: Limited::new(body, usize::MAX),
            exceeded: None,
        }
    }

    /// A body that did not say how long it is, and a flag that says that it was longer than the limit: handlers tell that in many words, and
    /// the gate in one.
    pub(crate) fn new(body: Incoming, limit_bytes: usize) -> (Self, Arc<AtomicBool>) {
        let exceeded = Arc::new(AtomicBool::new(false));
        let bounded = Self {
            inner: Limited::new(body, limit_bytes),
            exceeded: Some(Arc::clone(&exceeded)),
        };
        (bounded, exceeded)
    }
}

impl http_body::Body for BoundedBody {
    type Data = Bytes;
    type Error = Box<dyn Error + Send + Sync>;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
        let polled = Pin::new(&mut self.inner).poll_frame(context);
        if let Poll::Ready(Some(Err(error))) = &polled
            && error.is::<LengthLimitError>()
            && let Some(exceeded) = &self.exceeded
        {
            exceeded.store(true, Ordering::Relaxed);
        }
        polled
    }

    fn is_end_stream(&self) -> bool {
        self.inner.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.inner.size_hint()
    }
}

/// The body of an answer. While it lasts, its connection is in use.
pub(crate) struct AnswerBody {
    inner: Content,
    visit: Option<InFlight>,
    stream: Option<Box<OpenStream>>,
}

/// What an answer without an end holds on to.
struct OpenStream {
    dialect: Dialect,
    closing: Pin<Box<WaitForCancellationFutureOwned>>,
    lease: Option<Lease>,
    has_ended: bool,
    _permit: Permit,
}

impl AnswerBody {
    pub(crate) fn whole(inner: Content) -> Self {
        Self {
            inner,
            visit: None,
            stream: None,
        }
    }

    /// A body without an end: it keeps its place until it is dropped, and ends when connections close, or its token.
    pub(crate) fn stream(
        inner: Content,
        (permit, lease): (Permit, Option<Lease>),
        dialect: Dialect,
        drain: &Drain,
    ) -> Self {
        let stream = OpenStream {
            dialect,
            closing: Box::pin(drain.past(Phase::Open)),
            lease,
            has_ended: false,
            _permit: permit,
        };
        Self {
            inner,
            visit: None,
            stream: Some(Box::new(stream)),
        }
    }

    pub(crate) fn with_visit(mut self, visit: InFlight) -> Self {
        self.visit = Some(visit);
        self
    }
}

impl OpenStream {
    /// Why it ends now, if it does.
    fn poll_end(&mut self, context: &mut Context<'_>) -> Poll<Refusal> {
        if self.closing.as_mut().poll(context).is_ready() {
            let detail = "the server stops; watch another, or this one when it is back";
            return Poll::Ready(Refusal::new(Code::ShuttingDown, detail));
        }
        let lease = self.lease.as_mut();
        if lease.is_some_and(|lease| lease.poll_ended(context).is_ready()) {
            let detail = "the bearer token has ended, or was revoked; come back with another one";
            return Poll::Ready(Refusal::new(Code::Unauthenticated, detail));
        }
        Poll::Pending
    }

    /// The end of a stream: gRPC says why in trailers, server-sent events just end.
    fn end(&mut self, refusal: &Refusal) -> Option<Frame<Bytes>> {
        self.has_ended = true;
        if self.dialect == Dialect::Rest {
            return None;
        }
        let mut trailers = http::HeaderMap::new();
        problem::grpc_status(refusal)
            .add_header(&mut trailers)
            .ok()?;
        Some(Frame::trailers(trailers))
    }
}

impl http_body::Body for AnswerBody {
    type Data = Bytes;
    type Error = Box<dyn Error + Send + Sync>;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
        if let Some(stream) = &mut self.stream {
            if stream.has_ended {
                return Poll::Ready(None);
            }
            if let Poll::Ready(refusal) = stream.poll_end(context) {
                return Poll::Ready(stream.end(&refusal).map(Ok));
            }
        }
        Pin::new(&mut self.inner).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.stream.as_ref().is_some_and(|stream| stream.has_ended) || self.inner.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.inner.size_hint()
    }
}
