//! The echo: a bare handler on plain axum or plain tonic, as fast as those libraries are.
//!
//! It decodes the request into the type that the edge reads, and encodes one of the answers that the edge gave:
//! bodies of the same shape and size, without anything in between. The loop around it is that of `axum::serve`,
//! with answers sent at once. No gate, no limits, no deadlines, no metrics, no logs.
//!
//! The load test is compiled with this file, too, so that both mean the same echo.

use crate::Result;
use axum::extract::{Json, State};
use axum::routing::post;
use hyper_util::rt::{TokioExecutor, TokioIo};
use hyper_util::server::conn::auto;
use hyper_util::service::TowerToHyperService;
use serde_json::json;
use skyway::api::grpc::IntoProto;
use skyway::api::grpc::proto::recomposition_server::{self, RecompositionServer};
use skyway::api::grpc::proto::{self, RecompositionAnswer};
use skyway::wire::{FailureReport, Recomposition};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use tokio::net::TcpListener;
use tonic::{Request, Response, Status};

/// Answers that are told in turn.
struct Prepared<T> {
    answers: Vec<T>,
    told: AtomicUsize,
}

impl<T> Prepared<T> {
    fn new(answers: Vec<T>) -> Self {
        let told = AtomicUsize::new(0);
        Self { answers, told }
    }

    fn next(&self) -> &T {
        let number = self.told.fetch_add(1, Ordering::Relaxed);
        &self.answers[number % self.answers.len()]
    }
}

/// Serves a dialect until the process is ended. The answers are lines of JSON, as the edge gave them.
pub(crate) fn serve(dialect: &str, answers: &Path, ports_file: &Path) -> Result<()> {
    let text = std::fs::read_to_string(answers)?;
    let read: serde_json::Result<Vec<Recomposition<'static>>> =
        text.lines().map(serde_json::from_str).collect();
    let router = match dialect {
        "rest" => rest(read?),
        _ => grpc(read?),
    };
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?;
    runtime.block_on(accept_all(router, ports_file))
}

async fn accept_all(router: axum::Router, ports_file: &Path) -> Result<()> {
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    let ports = json!({"listen": listener.local_addr()?.port()});
    std::fs::write(ports_file, ports.to_string())?;
    loop {
        let (stream, _) = listener.accept().await?;
        stream.set_nodelay(true)?;
        let service = TowerToHyperService::new(router.clone());
        tokio::spawn(async move {
            let mut builder = auto::Builder::new(TokioExecutor::new());
            builder.http2().enable_connect_protocol();
            let io = TokioIo::new(stream);
            // How a connection ended is its client's affair.
            let _ = builder.serve_connection_with_upgrades(io, service).await;
        });
    }
}

fn rest(answers: Vec<Recomposition<'static>>) -> axum::Router {
    // For as long as the process lives, so that an answer is written without being copied first.
    let prepared: &'static Prepared<_> = Box::leak(Box::new(Prepared::new(answers)));
    axum::Router::new()
        .route("/v1/failures", post(answered))
        .with_state(prepared)
}

async fn answered(
    State(prepared): State<&'static Prepared<Recomposition<'static>>>,
    Json(report): Json<FailureReport>,
) -> Json<&'static Recomposition<'static>> {
    black_box(report);
    Json(prepared.next())
}

fn grpc(answers: Vec<Recomposition<'static>>) -> axum::Router {
    let answers = answers.into_iter().map(IntoProto::into_proto).collect();
    let echo = Echo {
        prepared: Arc::new(Prepared::new(answers)),
    };
    tonic::service::Routes::new(RecompositionServer::new(echo))
        .prepare()
        .into_axum_router()
}

struct Echo {
    prepared: Arc<Prepared<RecompositionAnswer>>,
}

#[tonic::async_trait]
impl recomposition_server::Recomposition for Echo {
    async fn report_failure(
        &self,
        request: Request<proto::FailureReport>,
    ) -> std::result::Result<Response<RecompositionAnswer>, Status> {
        black_box(request.into_inner());
        // tonic takes messages by value.
        Ok(Response::new(self.prepared.next().clone()))
    }

    async fn report_failures(
        &self,
        _: Request<proto::ReportFailuresRequest>,
    ) -> std::result::Result<Response<proto::ReportFailuresResponse>, Status> {
        Err(Status::unimplemented(
            "the echo answers single failure reports",
        ))
    }
}
