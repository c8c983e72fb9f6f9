//! A plan with times and battery as a document: with all that it was made for, so that a checker needs the network alone.

mod read;
mod told;
mod write;
mod written;

pub(super) use read::Reader;
pub use read::read_flight_document;
pub use told::{DifferingPremise, differing_premises, premises_lines};
pub(super) use write::Writer;
pub use write::write_flight_document;
pub(super) use written::{WrittenClosure, WrittenReservation, WrittenRules, WrittenTraffic};

use crate::flight::{Airframe, FlightPlan, FlightRules, FlightStart, Situation, WindField};
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::verify::FlightPremises;
use jiff::Timestamp;
use serde_json::Value;
use std::slice;
use thiserror::Error;

/// What the document says that it is.
const FORMAT: &str = "skyway-flight-plan-1";

/// Why a document is not written or not read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum FlightDocumentFault {
    /// A statement of wind has an area, which the document has no place for.
    #[error("a wind that is stated for an area cannot be written; state it for the network")]
    WindArea,
    /// It is not JSON of this shape.
    #[error("the plan cannot be read: {reason}")]
    Unreadable {
        /// What the reader says.
        reason: String,
    },
    /// More was in the way than is written down with an answer.
    #[error(
        "more closures, pads and legs of other plans were in the way than are written down with an answer"
    )]
    NotRecorded,
    /// It belongs to another network.
    #[error(
        "the plan was made on another network, of SHA-256 {stated}; name that one with --network"
    )]
    OtherNetwork {
        /// The SHA-256 that it states.
        stated: String,
    },
    /// The airframe makes no sense.
    #[error("{reason}")]
    Airframe {
        /// What is wrong.
        reason: String,
    },
    /// The network has no such node.
    #[error("{field} names node {id}, which the network does not have")]
    UnknownNode {
        /// Where.
        field: &'static str,
        /// The id as it is written.
        id: String,
    },
    /// The network has no such segment.
    #[error("{field} names segment '{id}', which the network does not have")]
    UnknownSegment {
        /// Where.
        field: &'static str,
        /// The id.
        id: String,
    },
}

/// A plan and its premises, read.
#[derive(Clone, Debug)]
pub struct FlightDocument {
    /// Second 0 of its times.
    pub zero: Timestamp,
    /// The drone.
    pub airframe: Airframe,
    /// Its payload, in kilograms.
    pub payload_kg: f64,
    /// The wind.
    pub wind: WindField,
    /// Margins and overheads.
    pub rules: FlightRules,
    /// What is in the way.
    pub situation: Situation,
    /// The names of the situation's closures, one for each.
    pub closure_ids: Vec<String>,
    /// Where the plan begins.
    pub start: FlightStart,
    /// Where it has to lead.
    pub destination: NodeIx,
    /// When it began, in seconds.
    pub began_s: f64,
    /// The latest landing, in seconds.
    pub deadline_s: f64,
    /// The least battery at every node.
    pub reserve: f64,
    /// Segments closed for this plan alone.
    pub closed_segments: Vec<SegmentIx>,
    /// The plan.
    pub plan: FlightPlan,
}

impl FlightDocument {
    /// The premises on a network, for the verifier.
    pub fn premises<'a>(&'a self, topology: &'a Topology) -> FlightPremises<'a> {
        FlightPremises {
            topology,
            airframe: &self.airframe,
            payload_kg: self.payload_kg,
            wind: &self.wind,
            rules: &self.rules,
            situation: &self.situation,
            starts: slice::from_ref(&self.start),
            destination: self.destination,
            began_s: self.began_s,
            deadline_s: self.deadline_s,
            reserve: self.reserve,
            closed_segments: &self.closed_segments,
        }
    }
}

/// True for a text that says it is such a document.
pub fn is_flight_document(text: &str) -> bool {
    let value: Option<Value> = serde_json::from_str(text).ok();
    value.is_some_and(|value| value.get("format").is_some_and(|format| format == FORMAT))
}
