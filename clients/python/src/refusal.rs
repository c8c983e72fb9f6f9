//! Refusals as exceptions of Python: a class of `skyway.errors`, with a stable code, the place and the remedy.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use skyway_formats::{FormatError, LoadError, ZoneProblem};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Which exception a refusal becomes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    /// A network that cannot be loaded or generated.
    Network,
    /// A report or a request that cannot be read.
    Request,
    /// A zone or a closure that cannot be read.
    Airspace,
    /// A drone, a battery, a wind that cannot be flown with.
    Flight,
    /// A fault of the engine.
    Internal,
}

impl Kind {
    fn class(self) -> &'static str {
        match self {
            Self::Network => "NetworkError",
            Self::Request => "RequestError",
            Self::Airspace => "AirspaceError",
            Self::Flight => "FlightError",
            Self::Internal => "InternalError",
        }
    }
}

/// What is refused, where, why, and what would set it right.
#[derive(Clone, Debug)]
pub(crate) struct Refusal {
    kind: Kind,
    code: &'static str,
    message: String,
    place: String,
    hint: Option<String>,
}

impl Refusal {
    pub(crate) fn new(
        kind: Kind,
        code: &'static str,
        place: impl Into<String>,
        message: impl Into<String>,
    ) -> Self {
        Self {
            kind,
            code,
            message: message.into(),
            place: place.into(),
            hint: None,
        }
    }

    pub(crate) fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// The first of several, which says how many more there are.
    fn first_of<T>(errors: &[T], first: impl Fn(&T) -> Self, empty: Self) -> Self {
        let Some(error) = errors.first() else {
            return empty;
        };
        let mut refusal = first(error);
        if errors.len() > 1 {
            let more = errors.len() - 1;
            refusal.message.push_str(&format!(" (and {more} more)"));
        }
        refusal
    }

    pub(crate) fn of_load(error: &LoadError) -> Self {
        let unreadable = || Self::new(Kind::Network, "network_unreadable", "", error.to_string());
        match error {
            LoadError::Format(errors) => Self::first_of(errors, Self::of_format, unreadable()),
            LoadError::Network(errors) => Self::first_of(
                errors,
                |error| {
                    let place = error.feature.to_string();
                    Self::new(
                        Kind::Network,
                        "network_invalid",
                        place,
                        error.fault.to_string(),
                    )
                },
                unreadable(),
            ),
        }
    }

    fn of_format(error: &FormatError) -> Self {
        let place = match &error.feature {
            Some(feature) => format!("{} ({feature})", error.pointer),
            None => error.pointer.clone(),
        };
        let refusal = Self::new(Kind::Network, "network_unreadable", place, &error.message);
        match &error.hint {
            Some(hint) => refusal.hint(hint),
            None => refusal,
        }
    }

    pub(crate) fn of_zones(errors: &[ZoneProblem]) -> Self {
        let unreadable = Self::new(
            Kind::Airspace,
            "zone_unreadable",
            "",
            "the zones cannot be read",
        );
        Self::first_of(errors, Self::of_zone, unreadable)
    }

    pub(crate) fn of_zone(error: &ZoneProblem) -> Self {
        let refusal = Self::new(Kind::Airspace, error.code, &error.pointer, &error.message);
        match &error.hint {
            Some(hint) => refusal.hint(hint),
            None => refusal,
        }
    }
}

/// Does a piece of work of the engine; a panic of it becomes a refusal, which a caller can catch as any other.
pub(crate) fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, Refusal> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|_| {
        let message = "the engine ended this piece of work";
        let refusal = Refusal::new(Kind::Internal, "engine_fault", "", message);
        refusal.hint(
            "report it with what was asked; the message on standard error says where it happened",
        )
    })
}

/// The same while other threads of Python run.
pub(crate) fn without_lock<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send,
) -> Result<T, Refusal> {
    py.detach(|| guarded(work))
}

static ERRORS: PyOnceLock<Py<PyModule>> = PyOnceLock::new();

impl From<Refusal> for PyErr {
    fn from(refusal: Refusal) -> Self {
        Python::attach(|py| {
            let module =
                ERRORS.get_or_try_init(py, || py.import("skyway.errors").map(Bound::unbind));
            let made = module.and_then(|module| {
                let class = module.bind(py).getattr(refusal.kind.class())?;
                class.call1((refusal.message, refusal.code, refusal.place, refusal.hint))
            });
            match made {
                Ok(exception) => PyErr::from_value(exception),
                Err(failed) => failed,
            }
        })
    }
}
