//! Why a command ends early, and with which exit code.

use std::fmt::Display;
use std::io;

/// At most this many errors are shown; a file with more has one cause, not a thousand.
const MAX_SHOWN: usize = 100;
const EXIT_SUCCESS: u8 = 0;
const EXIT_FAILURE: u8 = 1;
const EXIT_USAGE: u8 = 2;
#[cfg(feature = "edge")]
const EXIT_UNREACHABLE: u8 = 4;
/// `EX_CONFIG` of sysexits.h, by which supervisors know that starting again does not help.
#[cfg(feature = "edge")]
const EXIT_CONFIGURATION: u8 = 78;

/// How a command that ran to its end turned out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It did what it was asked to.
    Done,
    /// It ran, and the answer is no: something is not proved, or a line was not a request.
    Negative,
}

impl Verdict {
    pub(super) fn exit_code(self) -> u8 {
        match self {
            Self::Done => EXIT_SUCCESS,
            Self::Negative => EXIT_FAILURE,
        }
    }
}

/// Why a command ends before its end.
#[derive(Debug)]
pub(super) enum Stop {
    /// The arguments do not fit the network, or each other.
    Usage(String),
    /// Something outside failed: each entry is one error.
    Failed(Vec<String>),
    /// The configuration of an edge is not valid: each entry is one fault.
    #[cfg(feature = "edge")]
    Misconfigured(Vec<String>),
    /// An edge cannot be reached.
    #[cfg(feature = "edge")]
    Unreachable(String),
    /// The reader of the output has had enough of it.
    OutputClosed,
}

impl Stop {
    /// One error, as text.
    pub(super) fn failed(error: impl Display) -> Self {
        Self::Failed(vec![error.to_string()])
    }

    /// Several errors of one source, such as a file; each names it.
    pub(super) fn all_of<E: Display>(source: &str, errors: &[E]) -> Self {
        let named = errors.iter().map(|error| format!("{source}: {error}"));
        Self::Failed(named.collect())
    }

    /// An error while standard output was written.
    pub(super) fn of_output(error: &io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::OutputClosed,
            _ => Self::failed(format!("cannot write to standard output: {error}")),
        }
    }

    /// The errors to show, as many as anyone would read.
    pub(super) fn messages(&self) -> Vec<String> {
        let errors = match self {
            Self::OutputClosed => return Vec::new(),
            Self::Usage(message) => return vec![message.clone()],
            #[cfg(feature = "edge")]
            Self::Unreachable(message) => return vec![message.clone()],
            Self::Failed(errors) => errors,
            #[cfg(feature = "edge")]
            Self::Misconfigured(faults) => faults,
        };
        let mut shown: Vec<String> = errors.iter().take(MAX_SHOWN).cloned().collect();
        if errors.len() > MAX_SHOWN {
            shown.push(format!("{} more errors", errors.len() - MAX_SHOWN));
        }
        shown
    }

    pub(super) fn exit_code(&self) -> u8 {
        match self {
            Self::OutputClosed => EXIT_SUCCESS,
            Self::Usage(_) => EXIT_USAGE,
            Self::Failed(_) => EXIT_FAILURE,
            #[cfg(feature = "edge")]
            Self::Misconfigured(_) => EXIT_CONFIGURATION,
            #[cfg(feature = "edge")]
            Self::Unreachable(_) => EXIT_UNREACHABLE,
        }
    }
}
