//! What can be wrong with a network as stated, and where.

use std::fmt;
use thiserror::Error;

/// At most this many errors are collected; a file with more has one cause, not a thousand.
pub const MAX_ERRORS: usize = 100;

/// The feature that an error is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Feature {
    /// The network as a whole.
    Network,
    /// A node, by its place among the nodes of the file (from 0) and its id.
    Node {
        /// Place among the nodes, from 0.
        index: usize,
        /// The id as stated.
        id: String,
    },
    /// A segment, by its place among the segments of the file (from 0) and its ends.
    Segment {
        /// Place among the segments, from 0.
        index: usize,
        /// Id of the node it starts from.
        from: String,
        /// Id of the node it leads to.
        to: String,
    },
}

impl fmt::Display for Feature {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Network => write!(formatter, "network"),
            Self::Node { index, id } => write!(formatter, "node {index} (id '{id}')"),
            Self::Segment { index, from, to } => {
                write!(formatter, "segment {index} ('{from}' - '{to}')")
            }
        }
    }
}

/// A network error: the feature and what is wrong with it.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{feature}: {fault}")]
pub struct NetworkError {
    /// The feature at fault.
    pub feature: Feature,
    /// What is wrong.
    pub fault: NetworkFault,
}

/// What is wrong with a feature.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum NetworkFault {
    /// There is nothing to fly to.
    #[error("has no nodes; a network needs at least one")]
    Empty,
    /// Indices are 32 bits wide.
    #[error("has {count} features, more than the {limit} that can be held")]
    TooLarge {
        /// How many there are.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
    /// An id is the empty text.
    #[error("has an empty id; give every node an id of its own")]
    EmptyId,
    /// Two nodes, or two segments, bear one id.
    #[error("bears the id '{id}' that an earlier one bears; ids are unique")]
    DuplicateId {
        /// The id borne twice.
        id: String,
    },
    /// A coordinate is not a finite number.
    #[error("has a coordinate that is not finite: [{}, {}]", .position[0], .position[1])]
    NotFinite {
        /// The position as stated.
        position: [f64; 2],
    },
    /// A coordinate is out of range.
    #[error("lies at [{}, {}], outside longitude -180..180 and latitude -90..90; longitude comes first: were they swapped?", .position[0], .position[1])]
    Impossible {
        /// The position as stated, longitude first.
        position: [f64; 2],
    },
    /// A planar coordinate is too large for lengths to keep their precision.
    #[error("lies at [{}, {}], beyond {limit_m} m from the origin", .position[0], .position[1])]
    TooFar {
        /// The position as stated.
        position: [f64; 2],
        /// The largest coordinate allowed, in metres.
        limit_m: f64,
    },
    /// A segment names a node that the network does not have.
    #[error("names the node '{id}', which the network does not have")]
    UnknownNode {
        /// The id that was not found.
        id: String,
    },
    /// A segment leads back to where it starts.
    #[error("leads from a node to itself; remove it")]
    SelfLoop,
    /// A length that is not a finite number above 0.
    #[error("has the length {length_m} m; a length is finite and above 0{}", if *.stated { "" } else { " (none is stated and its nodes coincide: state one)" })]
    Length {
        /// The length, in metres.
        length_m: f64,
        /// False when it was computed from coincident nodes.
        stated: bool,
    },
    /// Two segments join the same nodes.
    #[error("is parallel to segment {earlier}; keep the shorter one")]
    Parallel {
        /// Place of the earlier one among the segments, from 0.
        earlier: usize,
    },
}
