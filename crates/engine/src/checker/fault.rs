//! What is wrong with an answer: the rule that it breaks, where, and by which figures.

use super::claim::Flag;
use crate::network::{NodeIx, SegmentIx, Topology};

/// A rule that an answer can break.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// The path begins where the drone is.
    BeginsAtDrone,
    /// The first stretch never passes a cause.
    PassesCause,
    /// The first stretch never enters a zone from outside.
    EntersZone,
    /// Segments exist, and join.
    Joins,
    /// No segment that is closed when it is flown.
    ClosedSegment,
    /// No node that is closed is entered.
    ClosedNode,
    /// Lengths add up.
    Length,
    /// Times add up.
    Time,
    /// The battery adds up.
    Battery,
    /// The battery never falls below what is promised.
    Reserve,
    /// Pads are there, open and free.
    Pad,
    /// The delivery is served at all of its stops, in order and for as long as it takes.
    Service,
    /// The outcome says what the path does.
    Outcome,
    /// A drone on the ground is not sent up in a zone.
    SentUp,
    /// A flag has its ground.
    FlagWithoutGround(Flag),
    /// What holds is flagged.
    FlagMissing(Flag),
}

impl Rule {
    /// The name under which cases are told.
    pub fn name(self) -> &'static str {
        match self {
            Self::BeginsAtDrone => "begins_at_drone",
            Self::PassesCause => "passes_cause",
            Self::EntersZone => "enters_zone",
            Self::Joins => "joins",
            Self::ClosedSegment => "closed_segment",
            Self::ClosedNode => "closed_node",
            Self::Length => "length",
            Self::Time => "time",
            Self::Battery => "battery",
            Self::Reserve => "reserve",
            Self::Pad => "pad",
            Self::Service => "service",
            Self::Outcome => "outcome",
            Self::SentUp => "sent_up",
            Self::FlagWithoutGround(_) => "flag_without_ground",
            Self::FlagMissing(_) => "flag_missing",
        }
    }

    fn said(self) -> &'static str {
        match self {
            Self::BeginsAtDrone => "the path does not begin where the drone is",
            Self::PassesCause => "the first stretch passes what is closed",
            Self::EntersZone => "the first stretch enters a zone",
            Self::Joins => "segments and nodes do not join",
            Self::ClosedSegment => "a closed segment is flown",
            Self::ClosedNode => "a closed node is entered",
            Self::Length => "lengths do not add up",
            Self::Time => "times do not add up",
            Self::Battery => "the battery does not add up",
            Self::Reserve => "the battery falls below what is promised",
            Self::Pad => "a pad is not there, closed or taken",
            Self::Service => "a stop of the delivery is left out, or too short",
            Self::Outcome => "the outcome does not say what the path does",
            Self::SentUp => "a drone on the ground is sent up in a zone",
            Self::FlagWithoutGround(_) => "a flag has no ground",
            Self::FlagMissing(_) => "what holds is not flagged",
        }
    }
}

/// Where a rule is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The answer as a whole.
    Answer,
    /// The first stretch.
    FirstStretch,
    /// A leg of the path, counted from 0, with its segment.
    Leg(usize, SegmentIx),
    /// A node.
    Node(NodeIx),
    /// A stay on a pad, counted from 0.
    Stop(usize),
}

/// What is wrong with an answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// The rule that it breaks.
    pub rule: Rule,
    /// Where.
    pub place: Place,
    /// What the answer says, in the unit of the rule, where it is a figure.
    pub stated: Option<f64>,
    /// What it is.
    pub found: Option<f64>,
}

impl Fault {
    pub(super) fn new(rule: Rule, place: Place) -> Self {
        Self {
            rule,
            place,
            stated: None,
            found: None,
        }
    }

    pub(super) fn figures(rule: Rule, place: Place, stated: f64, found: f64) -> Self {
        Self {
            stated: Some(stated),
            found: Some(found),
            ..Self::new(rule, place)
        }
    }

    /// The place in words, with the ids of the network.
    pub fn place_text(&self, topology: &Topology) -> String {
        match self.place {
            Place::Answer => "the answer".to_owned(),
            Place::FirstStretch => "the first stretch".to_owned(),
            Place::Leg(leg, segment) => {
                format!("leg {} ({})", leg + 1, topology.segment_id(segment))
            }
            Place::Node(node) => format!("node {}", topology.node_id(node)),
            Place::Stop(stop) => format!("stop {}", stop + 1),
        }
    }

    /// The fault in one sentence, with the ids of the network.
    pub fn text(&self, topology: &Topology) -> String {
        let flag = match self.rule {
            Rule::FlagWithoutGround(flag) | Rule::FlagMissing(flag) => {
                format!(" ({})", flag.name())
            }
            _ => String::new(),
        };
        let figures = match (self.stated, self.found) {
            (Some(stated), Some(found)) => format!(": stated {stated}, found {found}"),
            _ => String::new(),
        };
        let place = self.place_text(topology);
        format!("{place}: {}{flag}{figures}", self.rule.said())
    }
}
