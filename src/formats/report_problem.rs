//! What is wrong with a failure report: warnings, which help is given in spite of, and problems, which prevent it.

use thiserror::Error;

/// Something in the report that was passed over or assumed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadWarning {
    /// Stable code.
    pub code: &'static str,
    /// What was found and what is assumed instead.
    pub message: String,
}

/// Warnings as they arise.
#[derive(Debug, Default)]
pub(super) struct Warnings(pub(super) Vec<ReadWarning>);

impl Warnings {
    pub(super) fn add(&mut self, code: &'static str, message: impl Into<String>) {
        let message = message.into();
        self.0.push(ReadWarning { code, message });
    }
}

/// A body that cannot be taken for a failure report.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ReportProblem {
    /// Not an object.
    #[error("a failure report is a JSON object")]
    NotAnObject,
    /// Names nothing that locates the drone.
    #[error(
        "names nothing that locates the drone; give 'service' with the nodes 'from' and 'to', or a 'remaining_path' of at least two nodes"
    )]
    NotLocated,
    /// Names a node that the network does not have.
    #[error("names the node '{id}' at {pointer}, which the network does not have")]
    UnknownNode {
        /// JSON Pointer of the name.
        pointer: String,
        /// The id.
        id: String,
    },
    /// An entry of `close` that names neither a node nor a segment.
    #[error(
        "names nothing that can be closed at {pointer}; give a node id, or [A, B] for the segment between two nodes"
    )]
    CannotClose {
        /// JSON Pointer of the entry.
        pointer: String,
    },
}

impl ReportProblem {
    /// Stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NotAnObject => "report_not_an_object",
            Self::NotLocated => "report_not_located",
            Self::UnknownNode { .. } => "report_unknown_node",
            Self::CannotClose { .. } => "report_cannot_close",
        }
    }

    /// JSON Pointer of the place; empty for the body as a whole.
    pub fn pointer(&self) -> &str {
        match self {
            Self::NotAnObject | Self::NotLocated => "",
            Self::UnknownNode { pointer, .. } | Self::CannotClose { pointer } => pointer,
        }
    }
}
