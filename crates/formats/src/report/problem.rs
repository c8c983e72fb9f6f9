//! What is wrong with a failure report: warnings, which help is given in spite of, and problems, which prevent it.

use serde_json::Value;
use thiserror::Error;

/// The warnings of what would have located the drone.
const LOCATING: [&str; 3] = ["remaining_path_ignored", "unknown_plan", "unknown_leg"];
/// Text from a report is shown up to this many characters.
const MAX_SHOWN: usize = 64;
/// A message has up to this many characters.
const MAX_MESSAGE: usize = 400;
/// The most warnings told of a report.
const MAX_WARNINGS: usize = 50;

/// Something in the report that was passed over or assumed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadWarning {
    /// Stable code.
    pub code: &'static str,
    /// What was found and what is assumed instead.
    pub message: String,
}

impl ReadWarning {
    /// About how many bytes it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.message.len()
    }

    /// The same, whose message is cut where it is long: no answer outgrows its question.
    #[must_use]
    pub fn bounded(mut self) -> Self {
        if let Some((end, _)) = self.message.char_indices().nth(MAX_MESSAGE) {
            self.message.truncate(end);
            self.message.push_str("...");
        }
        self
    }

    /// A warning of a code.
    pub fn new(code: &'static str, message: impl Into<String>) -> Self {
        let message = message.into();
        Self { code, message }
    }
}

/// Warnings as they are told: not more than a reader can use, and each cut where it is long.
pub fn bounded(warnings: Vec<ReadWarning>) -> Vec<ReadWarning> {
    let told = warnings.into_iter().take(MAX_WARNINGS);
    told.map(ReadWarning::bounded).collect()
}

/// A value from a report as a message shows it: long ones are cut, so that no answer outgrows its question.
pub(crate) fn shown(value: &Value) -> String {
    cut(&value.to_string())
}

/// Text from a report as a message shows it.
pub(crate) fn cut(text: &str) -> String {
    match text.char_indices().nth(MAX_SHOWN) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

/// The warnings that say why a place, a plan or a path does not count.
pub(crate) fn reasons(warnings: &[ReadWarning]) -> Vec<String> {
    let locating = warnings.iter().filter(|warning| {
        let of_location =
            warning.code == "location_ignored" && warning.message.contains("'location'");
        of_location || LOCATING.contains(&warning.code)
    });
    // Where nothing else locates the drone, nothing is answered from what else there is.
    let why = |message: &str| message.split("; it is answered").next().map(str::to_owned);
    locating
        .filter_map(|warning| why(&warning.message))
        .collect()
}

fn because(why: &[String]) -> String {
    if why.is_empty() {
        return String::new();
    }
    format!(": {}", why.join(", and "))
}

/// A body that cannot be taken for a failure report.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ReportProblem {
    /// Not JSON; a number beyond what a double holds is none either.
    #[error("is not JSON at line {line}, column {column}: {reason}")]
    NotJson {
        /// Line of the place, from 1.
        line: usize,
        /// Column of the place, from 1; 0 at the very start of a line.
        column: usize,
        /// What was expected, and the remedy where there is one.
        reason: String,
    },
    /// Not an object.
    #[error("a failure report is a JSON object")]
    NotAnObject,
    /// Names nothing that locates the drone.
    #[error(
        "names nothing that locates the drone{}; give 'service' with the nodes 'from' and 'to', a 'remaining_path', or a 'location'",
        because(why)
    )]
    NotLocated {
        /// Why what it names does not count.
        why: Vec<String>,
    },
    /// Names a node that the network does not have, and nothing else that locates the drone.
    #[error(
        "names the node '{id}' at {pointer}, which the network does not have, and nothing else that locates the drone{}; give a 'location' or a 'remaining_path'",
        because(why)
    )]
    UnknownNode {
        /// JSON Pointer of the name.
        pointer: String,
        /// The id.
        id: String,
        /// Why what else it names does not count.
        why: Vec<String>,
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
    /// What a JSON reader says of a body.
    pub fn not_json(error: &serde_json::Error) -> Self {
        let told = error.to_string();
        let reason = told
            .rsplit_once(" at line ")
            .map_or(&*told, |(reason, _)| reason);
        let remedy = match reason {
            "number out of range" => "; write a number below 1.8e308, or leave the field out",
            _ => "",
        };
        Self::NotJson {
            line: error.line(),
            column: error.column(),
            reason: format!("{reason}{remedy}"),
        }
    }

    /// Stable code.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NotJson { .. } => "report_not_json",
            Self::NotAnObject => "report_not_an_object",
            Self::NotLocated { .. } => "report_not_located",
            Self::UnknownNode { .. } => "report_unknown_node",
            Self::CannotClose { .. } => "report_cannot_close",
        }
    }

    /// JSON Pointer of the place; empty for the body as a whole.
    pub fn pointer(&self) -> &str {
        match self {
            Self::NotJson { .. } | Self::NotAnObject | Self::NotLocated { .. } => "",
            Self::UnknownNode { pointer, .. } | Self::CannotClose { pointer } => pointer,
        }
    }
}
