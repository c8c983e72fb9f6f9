//! Why a request is refused: one vocabulary, under both dialects. `api::problem` says how each code is told.

use crate::formats::{ReportProblem, ZoneProblem};
use crate::wire::Fault;
use thiserror::Error;

/// What kind of refusal. Stable: clients branch on the code it is told by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Code {
    /// The body is not what it should be: JSON, an object, of the right type.
    BodyInvalid,
    /// A parameter of the query, or a header, is not what it should be.
    ParameterInvalid,
    /// A zone is not valid.
    ZoneInvalid,
    /// A failure report names nothing that locates the drone.
    ReportNotLocated,
    /// A plan's request is not valid.
    PlanInvalid,
    /// A closure is not valid.
    ClosureInvalid,
    /// A network, or a patch of one, is not valid.
    NetworkInvalid,
    /// Weather is not valid.
    WeatherInvalid,
    /// The weather is put at the registry.
    WeatherElsewhere,
    /// Nothing has this id, or the path leads nowhere.
    NotFound,
    /// The resource does not know this method.
    MethodNotAllowed,
    /// The body's media type is not understood.
    MediaTypeUnsupported,
    /// Something has this id already.
    AlreadyExists,
    /// There is no open way for the plan.
    NoRoute,
    /// No service fits what was asked for.
    NoOffer,
    /// The time of the quote is over.
    QuoteExpired,
    /// The delivery stands otherwise than what is asked needs.
    DeliveryStateConflict,
    /// A closure whose cause is a zone: lift the zone.
    ClosureOfZone,
    /// Something that stands names what a change of the network would take away.
    NetworkInUse,
    /// A delivery that is not over, or something else that stands, needs it.
    InUse,
    /// No client moves the clock.
    ClockNotExternal,
    /// The clock is past the instant that it is to be moved to.
    ClockBackwards,
    /// The clock would be moved too far at once.
    ClockTooFar,
    /// The plan has no such version to acknowledge, or is over.
    PlanStateConflict,
    /// A write of an existing version without `If-Match`.
    PreconditionRequired,
    /// `If-Match` names another version than the current one.
    PreconditionFailed,
    /// The idempotency key was used with another body.
    IdempotencyMismatch,
    /// The first request with this idempotency key is still being answered.
    IdempotencyInProgress,
    /// Events before the oldest kept, or of another epoch.
    EventsGone,
    /// Changes before the oldest kept, or of another epoch.
    ChangesGone,
    /// The body is too large.
    BodyTooLarge,
    /// The caller does not say who it is, or the token is unknown.
    Unauthenticated,
    /// The caller's role, or its subject, may not do this.
    Forbidden,
    /// A `Host` or `Origin` that is not this listener's.
    HostRefused,
    /// Too much at once; try again.
    Overloaded,
    /// A bound is reached: of plans, zones, closures or streams.
    LimitReached,
    /// The edge has no network to answer on yet.
    NotReady,
    /// No edge answers that could fly.
    EdgeUnavailable,
    /// The server is draining.
    ShuttingDown,
    /// The store does not answer; try again.
    StoreUnavailable,
    /// The store takes nothing more: its disk is full or failing.
    StoreFull,
    /// It is in force, but the disk has not taken it: a restart may undo it.
    NotDurable,
    /// The deadline passed before there was an answer.
    DeadlineExceeded,
    /// A defect of the server.
    Internal,
}

/// A refusal: its code and what tells the caller how to set it right.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{detail}")]
pub struct Refusal {
    /// What kind.
    pub code: Code,
    /// What happened this time, for people.
    pub detail: String,
    /// Each thing that was wrong, with its place.
    pub faults: Vec<Fault>,
    /// The version that is current, where another was expected.
    pub current_etag: Option<String>,
    /// When to try again, in seconds.
    pub retry_after_s: Option<u32>,
    /// The oldest revision whose successors are kept, where older ones are gone.
    pub oldest_revision: Option<u64>,
    /// Whether what was asked is in force all the same, though it could not be stored.
    pub enforced: bool,
}

impl Refusal {
    /// A refusal of a kind, with what happened.
    pub fn new(code: Code, detail: impl Into<String>) -> Self {
        Self {
            code,
            detail: detail.into(),
            faults: Vec::new(),
            current_etag: None,
            retry_after_s: None,
            oldest_revision: None,
            enforced: false,
        }
    }

    /// A refusal for one thing wrong at one place.
    pub fn at(code: Code, fault: Fault) -> Self {
        Self {
            faults: vec![fault.clone()],
            ..Self::new(code, fault.message)
        }
    }

    /// Nothing of this kind has this id.
    pub fn not_found(what: &str, id: &str) -> Self {
        Self::new(Code::NotFound, format!("there is no {what} '{id}'"))
    }

    /// With the version that is current.
    #[must_use]
    pub fn with_etag(mut self, etag: impl Into<String>) -> Self {
        self.current_etag = Some(etag.into());
        self
    }

    /// With the time after which to try again.
    #[must_use]
    pub fn retry_after_s(mut self, seconds: u32) -> Self {
        self.retry_after_s = Some(seconds);
        self
    }

    /// With the oldest revision whose successors are kept.
    #[must_use]
    pub fn with_oldest_revision(mut self, revision: u64) -> Self {
        self.oldest_revision = Some(revision);
        self
    }

    /// Everything wrong with a zone.
    pub fn of_zone(problems: Vec<ZoneProblem>) -> Self {
        let detail = match problems.as_slice() {
            [only] => only.message.clone(),
            several => format!("the zone has {} faults", several.len()),
        };
        let faults = problems.into_iter().map(|problem| Fault {
            code: problem.code.to_owned(),
            pointer: problem.pointer,
            message: problem.message,
            hint: problem.hint,
        });
        Self {
            faults: faults.collect(),
            ..Self::new(Code::ZoneInvalid, detail)
        }
    }
}

impl From<ReportProblem> for Refusal {
    fn from(problem: ReportProblem) -> Self {
        let code = match problem {
            ReportProblem::NotJson { .. }
            | ReportProblem::NotAnObject
            | ReportProblem::CannotClose { .. } => Code::BodyInvalid,
            ReportProblem::NotLocated { .. } | ReportProblem::UnknownNode { .. } => {
                Code::ReportNotLocated
            }
        };
        let fault = Fault {
            code: problem.code().to_owned(),
            pointer: problem.pointer().to_owned(),
            message: problem.to_string(),
            hint: None,
        };
        Self::at(code, fault)
    }
}
