//! What is counted about requests and connections. Labels are operations, classes and codes: never an id or a place.

use super::durations::Durations;
use super::operations::{Class, Daemon, Operation, TABLE};
use super::problem;
use crate::edge::Code;
use opentelemetry::trace::TraceId;
use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::Registry;
use std::sync::OnceLock;
use std::time::Duration;

/// The language of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Dialect {
    /// JSON over HTTP.
    Rest,
    /// gRPC.
    Grpc,
}

impl Dialect {
    /// The name in metrics and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Grpc => "grpc",
        }
    }

    /// The status of an answer that is no refusal: HTTP's 200, gRPC's 0.
    fn ok(self) -> u16 {
        match self {
            Self::Rest => 200,
            Self::Grpc => 0,
        }
    }
}

/// Why a request is shed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ShedReason {
    /// All slots of its class are taken.
    Slots,
    /// As many streams are open as may be.
    Streams,
    /// Requests wait too long for a worker.
    Wait,
    /// As many connections are open as may be, of all or of its subject.
    Connections,
    /// The subject has half of the slots of its class.
    Subject,
}

impl ShedReason {
    const ALL: [Self; 5] = [
        Self::Slots,
        Self::Streams,
        Self::Wait,
        Self::Connections,
        Self::Subject,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Slots => "slots",
            Self::Streams => "streams",
            Self::Wait => "wait",
            Self::Connections => "connections",
            Self::Subject => "subject",
        }
    }
}

/// Why a connection is closed by the server.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CloseReason {
    /// There were as many as may be already.
    Cap,
    /// There were as many from its address as may be.
    Address,
    /// It did not say in time which protocol it speaks.
    Preface,
    /// It did not finish the head of a request in time.
    Header,
    /// Nothing was asked for a long time.
    Idle,
    /// It did not read what it asked for.
    Stalled,
    /// The drain took too long.
    Forced,
}

impl CloseReason {
    const ALL: [Self; 7] = [
        Self::Cap,
        Self::Address,
        Self::Preface,
        Self::Header,
        Self::Idle,
        Self::Stalled,
        Self::Forced,
    ];

    /// The name in metrics and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cap => "cap",
            Self::Address => "address",
            Self::Preface => "preface",
            Self::Header => "header",
            Self::Idle => "idle",
            Self::Stalled => "stalled",
            Self::Forced => "forced",
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RequestLabels {
    operation: &'static str,
    dialect: &'static str,
    status: u16,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct DurationLabels {
    operation: &'static str,
    dialect: &'static str,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct ClassLabels {
    class: &'static str,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct ShedLabels {
    class: &'static str,
    reason: &'static str,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct CodeLabels {
    code: &'static str,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, EncodeLabelSet)]
struct ReasonLabels {
    reason: &'static str,
}

type DurationsOfAll = Family<DurationLabels, Durations, fn() -> Durations>;

/// The metrics of one operation in one dialect, looked up once: no hashing on the way of a request.
struct Hot {
    ok: Counter,
    durations: Durations,
}

/// Request metrics. One per process, shared by its listeners.
pub struct RequestMetrics {
    requests: Family<RequestLabels, Counter>,
    durations: DurationsOfAll,
    hot: Vec<[OnceLock<Hot>; 2]>,
    in_flight: [Gauge; Class::ALL.len()],
    shed: Family<ShedLabels, Counter>,
    refusals: Family<CodeLabels, Counter>,
    deadline_exceeded: Counter,
    panics: Counter,
    connections: Gauge,
    closed: Family<ReasonLabels, Counter>,
    accept_errors: Counter,
}

impl RequestMetrics {
    /// Registers the metrics.
    pub fn new(registry: &mut Registry) -> Self {
        Self::with(Durations::plain, registry)
    }

    /// Registers them with exemplars, for daemons that trace requests.
    pub fn traced(registry: &mut Registry) -> Self {
        Self::with(Durations::traced, registry)
    }

    fn with(durations: fn() -> Durations, registry: &mut Registry) -> Self {
        let requests = Family::<RequestLabels, Counter>::default();
        let durations: DurationsOfAll = Family::new_with_constructor(durations);
        let in_flight = Family::<ClassLabels, Gauge>::default();
        let metrics = Self {
            hot: TABLE.iter().map(|_| Default::default()).collect(),
            in_flight: Class::ALL.map(|class| {
                in_flight.get_or_create_owned(&ClassLabels {
                    class: class.name(),
                })
            }),
            requests: requests.clone(),
            durations: durations.clone(),
            shed: Family::default(),
            refusals: Family::default(),
            deadline_exceeded: Counter::default(),
            panics: Counter::default(),
            connections: Gauge::default(),
            closed: Family::default(),
            accept_errors: Counter::default(),
        };
        registry.register(
            "requests",
            "Requests answered, by the status of HTTP or of gRPC",
            requests,
        );
        registry.register(
            "request_duration_seconds",
            "Time to the head of the answer",
            durations,
        );
        registry.register(
            "in_flight",
            "Requests being answered; streams until they end",
            in_flight,
        );
        metrics.register_events(registry);
        metrics
    }

    fn register_events(&self, registry: &mut Registry) {
        registry.register("shed", "Requests refused for load", self.shed.clone());
        registry.register(
            "refusals",
            "Requests refused, by code",
            self.refusals.clone(),
        );
        registry.register(
            "deadline_exceeded",
            "Requests stopped at their deadline",
            self.deadline_exceeded.clone(),
        );
        registry.register(
            "handler_panics",
            "Panics while answering, each told as an internal error",
            self.panics.clone(),
        );
        registry.register("connections", "Open connections", self.connections.clone());
        registry.register(
            "connections_closed",
            "Connections that the server closed",
            self.closed.clone(),
        );
        registry.register(
            "accept_errors",
            "Connections that could not be accepted",
            self.accept_errors.clone(),
        );
    }

    /// Tells of everything that a daemon counts before it happens: a rate sees the first event only where there was a 0.
    pub fn begin_at_zero(&self, daemon: Daemon) {
        for row in TABLE.iter().filter(|row| row.operation.is_of(daemon)) {
            let is_rest = !row.rest.is_empty();
            let rest = is_rest.then_some(Dialect::Rest);
            let grpc = row.grpc.map(|_| Dialect::Grpc);
            for dialect in rest.into_iter().chain(grpc) {
                drop(self.requests.get_or_create(&RequestLabels {
                    operation: row.name,
                    dialect: dialect.name(),
                    status: dialect.ok(),
                }));
            }
        }
        for class in Class::ALL {
            for reason in ShedReason::ALL {
                drop(self.shed.get_or_create(&ShedLabels {
                    class: class.name(),
                    reason: reason.name(),
                }));
            }
        }
        for reason in CloseReason::ALL {
            let reason = reason.name();
            drop(self.closed.get_or_create(&ReasonLabels { reason }));
        }
        for row in problem::TABLE {
            let code = row.name;
            drop(self.refusals.get_or_create(&CodeLabels { code }));
        }
    }

    /// An answer's head is out; its status is that of its dialect. The trace is that of the request, where it is sent.
    pub(crate) fn answered(
        &self,
        operation: Operation,
        dialect: Dialect,
        status: u16,
        took: Duration,
        trace: Option<TraceId>,
    ) {
        let place = &self.hot[operation as usize][dialect as usize];
        let hot = place.get_or_init(|| self.hot(operation, dialect));
        hot.durations.observe(took, trace);
        if status == dialect.ok() {
            hot.ok.inc();
            return;
        }
        self.count(operation.row().name, dialect, status);
    }

    /// A request that led to no operation.
    pub(crate) fn answered_nothing(&self, dialect: Dialect, status: u16) {
        self.count("none", dialect, status);
    }

    fn hot(&self, operation: Operation, dialect: Dialect) -> Hot {
        let operation = operation.row().name;
        let status = dialect.ok();
        let dialect = dialect.name();
        let labels = RequestLabels {
            operation,
            dialect,
            status,
        };
        Hot {
            ok: self.requests.get_or_create_owned(&labels),
            durations: self
                .durations
                .get_or_create_owned(&DurationLabels { operation, dialect }),
        }
    }

    fn count(&self, operation: &'static str, dialect: Dialect, status: u16) {
        let labels = RequestLabels {
            operation,
            dialect: dialect.name(),
            status,
        };
        self.requests.get_or_create(&labels).inc();
    }

    /// How many of a class are in flight; the gate admits by this very gauge.
    pub(crate) fn in_flight(&self, class: Class) -> &Gauge {
        &self.in_flight[class.index()]
    }

    pub(crate) fn shed(&self, class: Class, reason: ShedReason) {
        let labels = ShedLabels {
            class: class.name(),
            reason: reason.name(),
        };
        self.shed.get_or_create(&labels).inc();
    }

    pub(crate) fn refused(&self, code: Code) {
        let labels = CodeLabels {
            code: problem::row(code).name,
        };
        self.refusals.get_or_create(&labels).inc();
        if code == Code::DeadlineExceeded {
            self.deadline_exceeded.inc();
        }
    }

    pub(crate) fn panicked(&self) {
        self.panics.inc();
    }

    pub(crate) fn connections(&self) -> &Gauge {
        &self.connections
    }

    pub(crate) fn closed(&self, reason: CloseReason) {
        let labels = ReasonLabels {
            reason: reason.name(),
        };
        self.closed.get_or_create(&labels).inc();
    }

    pub(crate) fn accept_failed(&self) {
        self.accept_errors.inc();
    }
}
