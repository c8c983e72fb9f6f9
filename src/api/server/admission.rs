//! What happens to every request before and after its handler: one pass, because each layer costs on the hot path.
//!
//! Before: id, operation, whether requests wait too long for a worker, host, caller, role, body limit, a place in its
//! class. All this happens when the request arrives and not when its task runs, so that requests that wait for a
//! processor count as in flight.
//! After: deadline, panics, metrics, the dialect of refusals, headers.

use super::authentication::Lease;
use super::bodies::{AnswerBody, BoundedBody, Permit};
use super::callers::{Callers, OfCaller};
use super::date::date;
use super::drain::Drain;
use super::gate_config::GateConfig;
use super::hosts::Hosts;
use super::places::Place;
use super::refuse::{self, Finding};
use super::request::{RequestContext, RequestId, X_REQUEST_ID, dialect, grpc_timeout};
use super::services::{Content, Services};
use super::spans;
use crate::access::{Caller, Role};
use crate::api::metrics::{Dialect, RequestMetrics, ShedReason};
use crate::api::operations::{Class, Operation, Unresolved};
use crate::api::problem;
use crate::clock::machine_now;
use crate::edge::{Code, Refusal};
use http::request::Parts;
use http::{HeaderValue, Request, Response, Version, header};
use http_body::Body as _;
use hyper::body::Incoming;
use std::future::poll_fn;
use std::io;
use std::net::SocketAddr;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::task::Poll;
use tokio::time::{Instant, Sleep, sleep_until};
use tracing::Span;

/// The prefix of a gRPC message: one byte of flags, four of length.
const GRPC_PREFIX_BYTES: usize = 5;

/// When to try again after a request was shed, in seconds.
const RETRY_AFTER_S: u32 = 1;

/// The gate of one listener.
pub(crate) struct Admission {
    config: GateConfig,
    services: Services,
    hosts: Hosts,
    callers: Arc<Callers>,
    process: u32,
    number: AtomicU64,
    metrics: Arc<RequestMetrics>,
    drain: Drain,
    opened: Instant,
    /// The second of the last warning, so that a flood of refusals is not one of log lines.
    warned_s: AtomicU64,
}

/// A request that may be handled.
struct Admitted {
    request: Request<BoundedBody>,
    operation: Operation,
    deadline: Instant,
    permit: Permit,
    lease: Option<Lease>,
    /// Set when the body turned out too long.
    exceeded: Option<Arc<AtomicBool>>,
}

/// What is known of a request, whether it passes or not.
struct Known {
    dialect: Dialect,
    operation: Option<Operation>,
    request_id: RequestId,
    arrived: Instant,
    /// For those who trace.
    span: Span,
}

enum Outcome {
    Answered(Response<Content>),
    Panicked,
    Expired,
}

impl Admission {
    pub(crate) fn new(
        config: GateConfig,
        services: Services,
        address: SocketAddr,
        metrics: Arc<RequestMetrics>,
        drain: Drain,
    ) -> io::Result<Self> {
        Ok(Self {
            config,
            services,
            hosts: Hosts::of(address),
            callers: Arc::default(),
            process: getrandom::u32().map_err(io::Error::other)?,
            number: AtomicU64::new(0),
            metrics,
            drain,
            opened: Instant::now(),
            warned_s: AtomicU64::new(u64::MAX),
        })
    }

    /// Takes a request in; the future answers it.
    pub(crate) fn enter(
        self: &Arc<Self>,
        request: Request<Incoming>,
        place: &Place,
    ) -> impl Future<Output = Response<AnswerBody>> + Send + use<> {
        let (head, body) = request.into_parts();
        let mut known = Known {
            dialect: dialect(&head),
            operation: None,
            request_id: self.request_id(&head),
            arrived: Instant::now(),
            span: Span::none(),
        };
        let checked = self.check(head, body, place, &mut known);
        let gate = Arc::clone(self);
        let is_last = place.is_for_probes() && known.dialect == Dialect::Rest;
        async move {
            let mut answer = match checked {
                Ok(passed) => gate.answer(passed, known).await,
                Err(refused) => gate.finish(refused, &known).map(AnswerBody::whole),
            };
            if is_last && answer.version() <= Version::HTTP_11 {
                let close = HeaderValue::from_static("close");
                answer.headers_mut().insert(header::CONNECTION, close);
            }
            answer
        }
    }

    fn request_id(&self, head: &Parts) -> RequestId {
        RequestId::of_client(&head.headers).unwrap_or_else(|| {
            RequestId::counted(self.process, self.number.fetch_add(1, Ordering::Relaxed))
        })
    }

    #[expect(
        clippy::result_large_err,
        reason = "a refusal is an answer, and is passed on once"
    )]
    fn check(
        &self,
        head: Parts,
        body: Incoming,
        place: &Place,
        known: &mut Known,
    ) -> Result<Admitted, Response<Content>> {
        let operation = self.resolve(&head, known.dialect).map_err(|unresolved| {
            refuse::unresolved(
                &unresolved,
                head.uri.path(),
                known.dialect,
                &known.request_id.to_string(),
            )
        })?;
        known.operation = Some(operation);
        known.span = spans::of_request(operation, known.dialect, &known.request_id, &head.headers);
        let admitted = self.admit(head, body, (operation, place), known);
        admitted.map_err(|refusal| {
            refuse::answer(&refusal, known.dialect, &known.request_id.to_string())
        })
    }

    fn resolve(&self, head: &Parts, dialect: Dialect) -> Result<Operation, Unresolved> {
        let path = head.uri.path();
        let daemon = self.config.daemon;
        let operation = match dialect {
            Dialect::Grpc => Operation::of_grpc(daemon, path).ok_or(Unresolved::Path)?,
            Dialect::Rest => Operation::of_rest(daemon, &head.method, path)?,
        };
        let served_here = operation
            .row()
            .listener
            .is_none_or(|listener| listener == self.config.listener);
        served_here.then_some(operation).ok_or(Unresolved::Path)
    }

    fn admit(
        &self,
        mut head: Parts,
        body: Incoming,
        (operation, place): (Operation, &Place),
        known: &Known,
    ) -> Result<Admitted, Refusal> {
        let class = operation.row().class;
        self.queue(class, known.arrived)?;
        let authentication = &self.config.authentication;
        let (caller, lease) = authentication.caller(&head, operation, &self.hosts)?;
        self.may_come_over(place, &caller, class)?;
        let body_bytes_max = self.body_bytes_max(operation);
        let (body, exceeded) = bounded(&head, body, known.dialect, operation, body_bytes_max)?;
        let of_caller = self.share(class, &caller)?;
        let permit = self.place(class, of_caller)?;
        let timeout = match known.dialect {
            Dialect::Rest => None,
            Dialect::Grpc => grpc_timeout(&head.headers),
        };
        let most = match class {
            Class::Follow => self.config.deadline.saturating_add(self.config.follow_wait),
            _ => self.config.deadline,
        };
        let allowed = timeout.map_or(most, |asked| asked.min(most));
        let deadline = known.arrived + allowed;
        head.extensions.insert(RequestContext {
            caller,
            operation,
            request_id: known.request_id.clone(),
            deadline,
        });
        Ok(Admitted {
            request: Request::from_parts(head, body),
            operation,
            deadline,
            permit,
            lease,
            exceeded,
        })
    }

    fn body_bytes_max(&self, operation: Operation) -> usize {
        match operation.row().class {
            // Its messages are bounded one by one.
            Class::Session => usize::MAX,
            _ if operation.takes_file() => self.config.file_bytes_max,
            _ => self.config.body_bytes_max,
        }
    }

    /// Refuses first of all, as long as others wait too long for a worker: whatever else is done here makes them wait longer.
    fn queue(&self, class: Class, arrived: Instant) -> Result<(), Refusal> {
        let queue = &self.config.queue_wait;
        if !queue.sheds(class, arrived) {
            return Ok(());
        }
        self.metrics.shed(class, ShedReason::Wait);
        let detail = format!(
            "requests wait {} ms for a worker",
            queue.wait(arrived).as_millis()
        );
        Err(Refusal::new(Code::Overloaded, detail).retry_after_s(RETRY_AFTER_S))
    }

    /// Refuses who holds as many connections as it may; on the last ones all but probes.
    fn may_come_over(&self, place: &Place, caller: &Caller, class: Class) -> Result<(), Refusal> {
        if place.is_for_probes() && class != Class::Health {
            self.metrics.shed(class, ShedReason::Connections);
            let detail = "as many connections are open as may be; only probes are answered on more";
            return Err(Refusal::new(Code::Overloaded, detail).retry_after_s(RETRY_AFTER_S));
        }
        // Where there are no tokens the caller is unknown.
        if caller.role == Role::Anyone {
            return Ok(());
        }
        place.belongs_to(caller).map_err(|limit| {
            self.metrics.shed(class, ShedReason::Connections);
            let detail = format!(
                "'{}' has {limit} connections open, as many as may be; use those",
                caller.subject
            );
            Refusal::new(Code::LimitReached, detail).retry_after_s(RETRY_AFTER_S)
        })
    }

    /// Refuses who holds half of the slots of a class. Each edge and each session is one of many that a token may have.
    fn share(&self, class: Class, caller: &Caller) -> Result<Option<OfCaller>, Refusal> {
        // Where there are no tokens the caller is unknown.
        let is_shared = !matches!(
            class,
            Class::Follow | Class::Session | Class::Watch | Class::Health
        );
        if caller.role == Role::Anyone || !is_shared {
            return Ok(None);
        }
        let counted = self
            .callers
            .count(class, caller, self.config.slots.of(class));
        counted.map(Some).map_err(|limit| {
            self.metrics.shed(class, ShedReason::Subject);
            let detail = format!(
                "'{}' has {limit} requests of the class '{}' in flight, as many as one may have",
                caller.subject,
                class.name()
            );
            Refusal::new(Code::LimitReached, detail).retry_after_s(RETRY_AFTER_S)
        })
    }

    fn place(&self, class: Class, of_caller: Option<OfCaller>) -> Result<Permit, Refusal> {
        let limit = self.config.slots.of(class);
        if let Some(permit) = Permit::take(self.metrics.in_flight(class), limit, of_caller) {
            return Ok(permit);
        }
        let (code, reason) = match class {
            Class::Stream | Class::Session | Class::Watch | Class::Follow => {
                (Code::LimitReached, ShedReason::Streams)
            }
            _ => (Code::Overloaded, ShedReason::Slots),
        };
        self.metrics.shed(class, reason);
        let detail = format!(
            "{limit} requests of the class '{}' are in flight",
            class.name()
        );
        Err(Refusal::new(code, detail).retry_after_s(RETRY_AFTER_S))
    }

    async fn answer(self: Arc<Self>, passed: Admitted, known: Known) -> Response<AnswerBody> {
        let Admitted {
            request,
            operation,
            deadline,
            permit,
            lease,
            exceeded,
        } = passed;
        let outcome = self.handle(request, operation, &known, deadline).await;
        let was_exceeded = exceeded.is_some_and(|flag| flag.load(Ordering::Relaxed));
        let refusal = match outcome {
            Outcome::Answered(_) if was_exceeded => too_large(self.body_bytes_max(operation)),
            Outcome::Answered(response) => {
                let response = self.finish(response, &known);
                if operation.row().class.is_stream() {
                    let held = (permit, lease);
                    return response
                        .map(|body| AnswerBody::stream(body, held, known.dialect, &self.drain));
                }
                return response.map(AnswerBody::whole);
            }
            Outcome::Expired => Refusal::new(
                Code::DeadlineExceeded,
                "there was no answer before the deadline",
            ),
            Outcome::Panicked => {
                self.metrics.panicked();
                Refusal::new(Code::Internal, "the request met a defect of the daemon")
            }
        };
        drop(permit);
        let refused = refuse::answer(&refusal, known.dialect, &known.request_id.to_string());
        self.finish(refused, &known).map(AnswerBody::whole)
    }

    /// Runs the handler until it answers, panics or the deadline passes; then it is dropped.
    async fn handle(
        &self,
        request: Request<BoundedBody>,
        operation: Operation,
        known: &Known,
        deadline: Instant,
    ) -> Outcome {
        let place = (operation, known.dialect);
        let mut handler = pin!(self.services.call(request, place));
        // Most handlers answer when first polled and never need the timer.
        let mut timer = pin!(None::<Sleep>);
        poll_fn(|context| {
            // What a handler shares outlives its panic, and is made of locks that know it and of snapshots.
            let polled = || known.span.in_scope(|| handler.as_mut().poll(context));
            match catch_unwind(AssertUnwindSafe(polled)) {
                Ok(Poll::Ready(response)) => return Poll::Ready(Outcome::Answered(response)),
                Ok(Poll::Pending) => {}
                Err(_) => return Poll::Ready(Outcome::Panicked),
            }
            if timer.is_none() {
                timer.set(Some(sleep_until(deadline)));
            }
            match timer.as_mut().as_pin_mut() {
                Some(timer) => timer.poll(context).map(|()| Outcome::Expired),
                None => Poll::Pending,
            }
        })
        .await
    }

    /// Counts an answer, tells a library's refusal anew, and adds the headers.
    fn finish(&self, response: Response<Content>, known: &Known) -> Response<Content> {
        let (mut response, code) = match refuse::find(&response, known.dialect) {
            Finding::Fine => (response, None),
            Finding::Told(code) => (response, Some(code)),
            Finding::Foreign(refusal) => {
                let told = refuse::answer(&refusal, known.dialect, &known.request_id.to_string());
                (told, Some(refusal.code))
            }
        };
        let status = match (known.dialect, code) {
            (Dialect::Rest, _) => response.status().as_u16(),
            (Dialect::Grpc, None) => 0,
            (Dialect::Grpc, Some(code)) => problem::row(code).grpc as u16,
        };
        let took = known.arrived.elapsed();
        match known.operation {
            Some(operation) => {
                self.config.queue_wait.leaves(operation.row().class);
                let trace = spans::sampled_trace(&known.span);
                self.metrics
                    .answered(operation, known.dialect, status, took, trace);
            }
            None => self.metrics.answered_nothing(known.dialect, status),
        }
        if let Some(code) = code {
            self.metrics.refused(code);
            known.span.record("code", problem::row(code).name);
            if problem::row(code).status.is_server_error() {
                known.span.record("otel.status_code", "ERROR");
            }
            self.log(code, known);
        }
        let headers = response.headers_mut();
        let mut request_id = known.request_id.header();
        // Never the same twice: without this HTTP/2 would remember each in its table of headers.
        request_id.set_sensitive(true);
        headers.insert(X_REQUEST_ID, request_id);
        headers.extend(date(machine_now()).map(|date| (header::DATE, date)));
        if known.dialect == Dialect::Rest {
            headers.insert(
                header::X_CONTENT_TYPE_OPTIONS,
                HeaderValue::from_static("nosniff"),
            );
            // What is true now may be false in a second; what has a version may be kept and asked about.
            let caching = match headers.contains_key(header::ETAG) {
                true => HeaderValue::from_static("no-cache"),
                false => HeaderValue::from_static("no-store"),
            };
            headers.entry(header::CACHE_CONTROL).or_insert(caching);
        }
        response
    }

    /// One line for a refusal: a warning where the edge could not do what it should, at most one a second.
    fn log(&self, code: Code, known: &Known) {
        let row = problem::row(code);
        let operation = known
            .operation
            .map_or("none", |operation| operation.row().name);
        let request_id = &known.request_id;
        let second = self.opened.elapsed().as_secs();
        if row.status.is_server_error() && self.warned_s.swap(second, Ordering::Relaxed) != second {
            tracing::warn!(code = row.name, operation, %request_id, "request refused");
        } else {
            tracing::debug!(code = row.name, operation, %request_id, "request refused");
        }
    }
}

/// The body of a request, held to a limit.
fn bounded(
    head: &Parts,
    body: Incoming,
    dialect: Dialect,
    operation: Operation,
    body_bytes_max: usize,
) -> Result<(BoundedBody, Option<Arc<AtomicBool>>), Refusal> {
    let is_read = |encoding: &[u8]| {
        encoding.eq_ignore_ascii_case(b"identity")
            || (operation.takes_gzip() && encoding.eq_ignore_ascii_case(b"gzip"))
    };
    let encoding = head.headers.get(header::CONTENT_ENCODING);
    if encoding.is_some_and(|encoding| !is_read(encoding.as_bytes())) {
        return Err(Refusal::new(
            Code::MediaTypeUnsupported,
            "the body has a content encoding that is not read here; send it plain",
        ));
    }
    let limit_bytes = match dialect {
        Dialect::Rest => body_bytes_max,
        Dialect::Grpc => body_bytes_max.saturating_add(GRPC_PREFIX_BYTES),
    };
    let hint = body.size_hint();
    if hint.lower() > limit_bytes as u64 {
        return Err(too_large(body_bytes_max));
    }
    // hyper holds a body to the length that it announced.
    if hint.exact().is_some() {
        return Ok((BoundedBody::announced(body), None));
    }
    let (body, exceeded) = BoundedBody::new(body, limit_bytes);
    Ok((body, Some(exceeded)))
}

fn too_large(limit_bytes: usize) -> Refusal {
    Refusal::new(
        Code::BodyTooLarge,
        format!("the body is larger than {limit_bytes} bytes"),
    )
}
