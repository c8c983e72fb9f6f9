//! One connection: both HTTP versions on it, its deadlines, and its part in the drain.

use super::ServerConfig;
use super::admission::Admission;
use super::bodies::AnswerBody;
use super::drain::{Drain, Phase};
use super::places::Place;
use super::watch::{ConnectionActivity, Deadlines, InFlight, Verdict, Watch, WatchedStream};
use crate::api::metrics::CloseReason;
use http::{Request, Response};
use hyper::body::Incoming;
use hyper::service::service_fn;
use hyper_util::rt::{TokioExecutor, TokioIo, TokioTimer};
use hyper_util::server::conn::auto;
use std::convert::Infallible;
use std::future::poll_fn;
use std::pin::pin;
use std::sync::Arc;
use std::task::{Poll, Waker};
use tokio::net::TcpStream;
use tokio::time::{Instant, sleep_until};

/// Streams reset before they were taken up, beyond which a connection is closed ("rapid reset", CVE-2023-44487).
const PENDING_RESETS_MAX: usize = 20;

/// Streams reset for errors of the client, beyond which a connection is closed (RUSTSEC-2024-0003).
const ERROR_RESETS_MAX: usize = 256;

/// What all connections of a listener share.
pub(crate) struct Connections {
    builder: auto::Builder<TokioExecutor>,
    deadlines: Deadlines,
    pub(crate) gate: Arc<Admission>,
    pub(crate) drain: Drain,
}

/// What wakes the watch of a connection.
enum Wake {
    Done,
    Phase(Phase),
    Look,
}

impl Connections {
    pub(crate) fn new(config: &ServerConfig, gate: Arc<Admission>, drain: Drain) -> Self {
        Self {
            builder: builder(config),
            deadlines: Deadlines {
                preface: config.preface_deadline,
                header: config.header_deadline,
                idle: config.idle_deadline,
                write: config.write_deadline,
            },
            gate,
            drain,
        }
    }

    /// Serves one connection to its end; answers why it was cut, if it was.
    pub(crate) async fn serve(
        self: Arc<Self>,
        stream: TcpStream,
        place: Arc<Place>,
    ) -> Option<CloseReason> {
        let pulse = Arc::new(ConnectionActivity::default());
        let io = TokioIo::new(WatchedStream::new(stream, Arc::clone(&pulse)));
        let gate = Arc::clone(&self.gate);
        let visited = Arc::clone(&pulse);
        let service = service_fn(move |request: Request<Incoming>| {
            let visit = InFlight::begin(&visited);
            let answered = gate.enter(request, &place);
            // In a box: hyper moves the future several times before it runs, and it holds all of a request.
            Box::pin(async move {
                let answer = answered.await;
                Ok::<Response<AnswerBody>, Infallible>(answer.map(|body| body.with_visit(visit)))
            })
        });
        let mut connection = pin!(self.builder.serve_connection(io, service));
        let mut watch = Watch::new(self.deadlines, Instant::now());
        let mut alarm = pin!(sleep_until(watch.first_look()));
        let mut seen = Phase::Open;
        let mut phase_past = pin!(self.drain.past(seen));
        // A signal that was polled by this task wakes it without being polled again.
        let mut signalled: Option<Waker> = None;
        loop {
            let wake = poll_fn(|context| {
                // How a connection ended is its client's affair: there is nothing to do about an error.
                if connection.as_mut().poll(context).is_ready() {
                    return Poll::Ready(Wake::Done);
                }
                let is_known = signalled
                    .as_ref()
                    .is_some_and(|waker| waker.will_wake(context.waker()));
                if !is_known {
                    signalled = Some(context.waker().clone());
                    // Its news is in the phase, which is looked at next.
                    let _ = phase_past.as_mut().poll(context);
                }
                let phase = self.drain.phase();
                if phase != seen {
                    return Poll::Ready(Wake::Phase(phase));
                }
                alarm.as_mut().poll(context).map(|()| Wake::Look)
            })
            .await;
            let now = Instant::now();
            match wake {
                Wake::Done => return None,
                Wake::Phase(Phase::Forced) => return Some(CloseReason::Forced),
                Wake::Phase(phase) => {
                    seen = phase;
                    phase_past.set(self.drain.past(seen));
                    signalled = None;
                    watch.leave(now);
                    connection.as_mut().graceful_shutdown();
                }
                Wake::Look => match watch.look(&pulse, now) {
                    Verdict::LookAt(next) => alarm.as_mut().reset(next),
                    Verdict::Cut(reason) => return Some(reason),
                    Verdict::AskToLeave => {
                        watch.leave(now);
                        connection.as_mut().graceful_shutdown();
                    }
                },
            }
        }
    }
}

fn builder(config: &ServerConfig) -> auto::Builder<TokioExecutor> {
    let mut builder = auto::Builder::new(TokioExecutor::new());
    let header_bytes_max = config.header_bytes_max.max(8192);
    builder
        .http1()
        // The watch has the deadline of heads.
        .header_read_timeout(None)
        // Answers are short: copied behind their heads they leave in one piece, which costs the kernel less than two.
        .writev(false)
        // A head must fit in the buffer: a larger one is answered with 431.
        .max_buf_size(header_bytes_max as usize);
    builder
        .http2()
        .timer(TokioTimer::new())
        .keep_alive_interval(config.ping_interval)
        .keep_alive_timeout(config.ping_timeout)
        .max_concurrent_streams(config.streams_per_connection)
        .max_header_list_size(header_bytes_max)
        .max_pending_accept_reset_streams(PENDING_RESETS_MAX)
        .max_local_error_reset_streams(ERROR_RESETS_MAX);
    builder
}
