//! An answer that was given: in this start, with all it was computed from, or in an earlier one.

use super::records::AnswerRecord;
use super::validity::first_stretch_is_clear;
use super::views::recomposition;
use crate::planner::{Planner, way_is_open};
use crate::snapshot::Snapshot;
use crate::standing::Staleness;
use crate::store::ReportReply;
use jiff::Timestamp;
use skyway_contract as wire;
use skyway_engine::flight::Location;
use skyway_engine::geo::Point;
use skyway_engine::recompose::Strategy;
use skyway_engine::routing::Path;
use skyway_formats::IntoTerm;
use std::sync::Arc;

/// An answer that was given.
#[derive(Clone, Debug)]
pub(crate) enum StoredAnswer {
    /// In this start.
    Now(Arc<AnswerRecord>),
    /// In an earlier one.
    Before(Arc<RestoredAnswer>),
}

/// An answer of an earlier start.
#[derive(Debug)]
pub(crate) struct RestoredAnswer {
    answer: wire::Recomposition<'static>,
    /// Where the drone was, in metres of the plane, where that was known.
    place: Option<Point>,
    /// SHA-256 of the network it was computed on.
    network: String,
    /// About how many bytes it takes.
    bytes: usize,
}

/// Bytes in memory, about, for each byte of an answer's text.
const ANSWER_TO_TEXT: usize = 4;

impl RestoredAnswer {
    /// About how many bytes it takes.
    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }

    /// The answer that was kept; none where it cannot be read any more, and is given anew.
    pub(crate) fn of(reply: &ReportReply) -> Option<Self> {
        Some(Self {
            answer: serde_json::from_str(&reply.answer).ok()?,
            place: reply.place.map(|[x, y]| Point::new(x, y)),
            network: reply.network.clone(),
            bytes: ANSWER_TO_TEXT * reply.answer.len(),
        })
    }

    /// Whether it may be given again: it is still valid and its path is open. One without a path was given for a revision of that start.
    fn still_holds(&self, deadline: Option<&str>, snapshot: &Snapshot, now: Timestamp) -> bool {
        let topology = snapshot.topology();
        let is_over = |text: Option<&str>| {
            let until = text.and_then(|text| text.parse::<Timestamp>().ok());
            until.is_some_and(|until| until < now)
        };
        let valid_until = self.answer.valid_until.as_deref();
        if self.network != topology.fingerprint_text() || is_over(deadline) || is_over(valid_until)
        {
            return false;
        }
        if self.answer.times == "computed" {
            // It is no longer known whether its times can be kept.
            return false;
        }
        let path = &self.answer.answer.path;
        let nodes = path.nodes.iter().map(|id| topology.node(id.text()));
        let segments = path.segments.iter().map(|id| topology.find_segment(id));
        let (nodes, segments) = (
            nodes.collect::<Option<Vec<_>>>(),
            segments.collect::<Option<Vec<_>>>(),
        );
        let (Some(nodes), Some(segments)) = (nodes, segments) else {
            return false;
        };
        let way = Path { nodes, segments };
        let is_diversion = self.answer.answer.outcome == wire::Outcome::Diverted;
        let location = self.place.map_or(Location::LegStart, Location::At);
        !way.nodes.is_empty()
            && way_is_open(&way, is_diversion, &snapshot.airspace)
            && first_stretch_is_clear(location, &way, None, snapshot)
    }
}

impl StoredAnswer {
    /// Whether it may be given again, to a report with this deadline.
    pub(crate) fn still_holds(
        &self,
        deadline: Option<&str>,
        planner: &dyn Planner,
        snapshot: &Snapshot,
        now: Timestamp,
    ) -> bool {
        match self {
            Self::Now(record) => super::validity::still_holds(record, planner, snapshot, now),
            Self::Before(earlier) => earlier.still_holds(deadline, snapshot, now),
        }
    }

    pub(crate) fn outcome(&self) -> wire::Outcome {
        match self {
            Self::Now(record) => record.answer.told().outcome.into_term(),
            Self::Before(earlier) => earlier.answer.answer.outcome,
        }
    }

    pub(crate) fn strategy_used(&self) -> Strategy {
        match self {
            Self::Now(record) => record.answer.told().strategy_used,
            Self::Before(earlier) => earlier.answer.answer.strategy_used.into_term(),
        }
    }

    /// As it is sent, borrowing what it can.
    pub(crate) fn to_wire(&self, replayed: bool, standing: Staleness) -> wire::Recomposition<'_> {
        match self {
            Self::Now(record) => recomposition(record, replayed, standing),
            Self::Before(earlier) => {
                let mut answer = earlier.answer.clone();
                answer.replayed = replayed;
                standing.put_into(&mut answer.stamp);
                answer
            }
        }
    }
}
