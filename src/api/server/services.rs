//! Where requests go behind the gate: to the handler of their operation, or to a router.
//!
//! The gate has found the operation already, so that what has a handler of its own needs no second look at its
//! path: all of gRPC, and of REST what is asked so often that a router's part of the time counts.

use crate::api::metrics::Dialect;
use crate::api::operations::{Operation, TABLE};
use axum::Router;
use axum::body::Body as RouterBody;
use axum::routing::future::RouteFuture;
use bytes::Bytes;
use http::{Request, Response};
use http_body::{Body, Frame, SizeHint};
use std::convert::Infallible;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use tonic::body::Body as GrpcBody;
use tower::Service;

/// An answer of gRPC in the making.
pub type Answering = Pin<Box<dyn Future<Output = Result<Response<GrpcBody>, Infallible>> + Send>>;

/// What answers a gRPC operation.
pub type GrpcHandler = Arc<dyn Fn(Request<GrpcBody>) -> Answering + Send + Sync>;

/// An answer of REST in the making.
pub type RestAnswering = Pin<Box<dyn Future<Output = Response<RouterBody>> + Send>>;

/// What answers a REST operation without the router.
pub type RestHandler = Arc<dyn Fn(Request<RouterBody>) -> RestAnswering + Send + Sync>;

/// What a listener serves.
#[derive(Clone)]
pub struct Services {
    router: Router,
    /// By the number of the operation.
    handlers: Vec<Handlers>,
}

#[derive(Clone, Default)]
struct Handlers {
    rest: Option<RestHandler>,
    grpc: Option<GrpcHandler>,
}

impl From<Router> for Services {
    /// All through the router.
    fn from(router: Router) -> Self {
        let handlers = vec![Handlers::default(); TABLE.len()];
        Self { router, handlers }
    }
}

impl Services {
    /// With handlers of gRPC operations; those without one stay with the router.
    #[must_use]
    pub fn with_grpc(mut self, handlers: Vec<(Operation, GrpcHandler)>) -> Self {
        for (operation, handler) in handlers {
            self.handlers[operation as usize].grpc = Some(handler);
        }
        self
    }

    /// With handlers of REST operations that have one path and one method.
    #[must_use]
    pub fn with_rest(mut self, handlers: Vec<(Operation, RestHandler)>) -> Self {
        for (operation, handler) in handlers {
            self.handlers[operation as usize].rest = Some(handler);
        }
        self
    }

    /// Hands a request to what answers it.
    pub(crate) fn call<B>(&self, request: Request<B>, place: (Operation, Dialect)) -> Answer
    where
        B: Body<Data = Bytes> + Send + 'static,
        B::Error: Into<Box<dyn std::error::Error + Send + Sync>>,
    {
        let (operation, dialect) = place;
        let handlers = &self.handlers[operation as usize];
        match (dialect, &handlers.rest, &handlers.grpc) {
            (Dialect::Rest, Some(handler), _) => {
                Answer::Rest(handler(request.map(RouterBody::new)))
            }
            (Dialect::Grpc, _, Some(handler)) => Answer::Grpc(handler(request.map(GrpcBody::new))),
            _ => {
                let mut router = self.router.clone();
                Answer::Routed(router.call(request.map(RouterBody::new)))
            }
        }
    }
}

/// An answer on its way.
#[expect(
    clippy::large_enum_variant,
    reason = "it lies in the boxed future of its request; a box of its own would be one more"
)]
pub(crate) enum Answer {
    Rest(RestAnswering),
    Routed(RouteFuture<Infallible>),
    Grpc(Answering),
}

impl Future for Answer {
    type Output = Response<Content>;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        match &mut *self {
            Self::Rest(answering) => {
                let polled = answering.as_mut().poll(context);
                polled.map(|response| response.map(Content::Routed))
            }
            Self::Routed(answering) => Pin::new(answering).poll(context).map(|answer| {
                let Ok(response) = answer;
                response.map(Content::Routed)
            }),
            Self::Grpc(answering) => answering.as_mut().poll(context).map(|answer| {
                let Ok(response) = answer;
                response.map(Content::Grpc)
            }),
        }
    }
}

/// The body of an answer, of either kind: putting one into the other would cost a box.
#[derive(Debug)]
pub(crate) enum Content {
    Routed(RouterBody),
    Grpc(GrpcBody),
}

impl Body for Content {
    type Data = Bytes;
    type Error = Box<dyn std::error::Error + Send + Sync>;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
        match &mut *self {
            Self::Routed(body) => {
                let polled = Pin::new(body).poll_frame(context);
                polled.map(|frame| frame.map(|frame| frame.map_err(Into::into)))
            }
            Self::Grpc(body) => {
                let polled = Pin::new(body).poll_frame(context);
                polled.map(|frame| frame.map(|frame| frame.map_err(Into::into)))
            }
        }
    }

    fn is_end_stream(&self) -> bool {
        match self {
            Self::Routed(body) => body.is_end_stream(),
            Self::Grpc(body) => body.is_end_stream(),
        }
    }

    fn size_hint(&self) -> SizeHint {
        match self {
            Self::Routed(body) => body.size_hint(),
            Self::Grpc(body) => body.size_hint(),
        }
    }
}
