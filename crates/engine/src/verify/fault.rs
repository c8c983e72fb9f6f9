//! What keeps a text from being a proof, and where.

use std::fmt;
use thiserror::Error;

/// A segment in the direction in which it is flown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// Id of the segment.
    pub segment: String,
    /// Id of the node it is flown from.
    pub from: String,
    /// Id of the node it is flown to.
    pub to: String,
}

impl fmt::Display for Step {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { segment, from, to } = self;
        write!(
            formatter,
            "segment '{segment}' from node '{from}' to '{to}'"
        )
    }
}

/// Why a certificate proves nothing. Metres throughout.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CertificateFault {
    /// The text is not JSON, or not a certificate.
    #[error("not a certificate: {reason}")]
    Unreadable {
        /// What is wrong, with line and column.
        reason: String,
    },
    /// The certificate is about another network.
    #[error(
        "network_sha256: the certificate is about network {stated}, this one is {actual}; take the file that the answer was computed on"
    )]
    OtherNetwork {
        /// As the certificate has it.
        stated: String,
        /// Of the network at hand.
        actual: String,
    },
    /// A node that the network does not have.
    #[error("{place}: the network has no node '{node}'")]
    UnknownNode {
        /// The member of the certificate.
        place: &'static str,
        /// The id.
        node: String,
    },
    /// A segment that the network does not have.
    #[error("{place}: the network has no segment '{segment}'")]
    UnknownSegment {
        /// The member of the certificate.
        place: &'static str,
        /// The id.
        segment: String,
    },
    /// A closed segment is said to join other nodes than it does.
    #[error("closed_segments: the network has no {step}")]
    SegmentEnds {
        /// The segment as the certificate has it.
        step: Step,
    },
    /// Something is listed twice.
    #[error("{place}: '{id}' is listed twice")]
    Repeated {
        /// The member of the certificate.
        place: &'static str,
        /// The id.
        id: String,
    },
    /// There is nowhere to start from.
    #[error("starts: there are none; without a start nothing is claimed")]
    NoStart,
    /// A first stretch is negative.
    #[error("starts: the first stretch to node '{node}' is {offset_m} m, below 0")]
    NegativeOffset {
        /// The start.
        node: String,
        /// Its first stretch.
        offset_m: f64,
    },
    /// A node has no bound.
    #[error(
        "h_m: node '{node}' is missing; every node of the network has an entry, null where it is unreachable"
    )]
    MissingBound {
        /// The node.
        node: String,
    },
    /// A bound is negative.
    #[error("h_m: node '{node}' has {h_m} m, below 0")]
    NegativeBound {
        /// The node.
        node: String,
        /// Its bound.
        h_m: f64,
    },
    /// The destination's own bound is not 0.
    #[error("h_m: the destination '{node}' has {}, not 0", metres_or_null(*.h_m))]
    DestinationBound {
        /// The destination.
        node: String,
        /// Its bound; `None` is infinite.
        h_m: Option<f64>,
    },
    /// The bounds at the ends of an open segment differ by more than its length.
    #[error("h_m: {step}, {length_m} m long, bridges a difference of {difference_m} m")]
    BoundsDiffer {
        /// The segment.
        step: Step,
        /// How much the bounds differ.
        difference_m: f64,
        /// The segment's length.
        length_m: f64,
    },
    /// An open segment joins a node that can reach the destination and one that cannot.
    #[error("h_m: {step} is open, yet one of its nodes is unreachable (null) and the other is not")]
    HalfReachable {
        /// The segment.
        step: Step,
    },
    /// A settled start lies farther than its first stretch.
    #[error("settled: start '{node}' has {d_m} m, above its first stretch of {offset_m} m")]
    StartLabel {
        /// The start.
        node: String,
        /// Its label.
        d_m: f64,
        /// Its first stretch.
        offset_m: f64,
    },
    /// From a start that is not settled, a way shorter than claimed is possible.
    #[error("starts: from node '{node}' {bound_m} m may do, below the {length_m} m claimed")]
    StartBelow {
        /// The start.
        node: String,
        /// First stretch and bound together.
        bound_m: f64,
        /// The length claimed.
        length_m: f64,
    },
    /// The destination is settled nearer than claimed.
    #[error("settled: the destination '{node}' has {d_m} m, below the {length_m} m claimed")]
    DestinationLabel {
        /// The destination.
        node: String,
        /// Its label.
        d_m: f64,
        /// The length claimed.
        length_m: f64,
    },
    /// A settled node lies farther than the way to it over another settled node.
    #[error("settled: {step} leads there in {through_m} m, but node '{}' has {d_m} m", .step.to)]
    Label {
        /// The segment.
        step: Step,
        /// The length of the way over the segment.
        through_m: f64,
        /// The label of the node it leads to.
        d_m: f64,
    },
    /// A way shorter than claimed may leave the settled nodes.
    #[error(
        "{step} leads from a settled node below the length claimed: {bound_m} m may do, {length_m} m are claimed"
    )]
    SegmentBelow {
        /// The segment.
        step: Step,
        /// Label, length and bound together.
        bound_m: f64,
        /// The length claimed.
        length_m: f64,
    },
    /// Numbers of nodes and segments that make no path.
    #[error(
        "path: {nodes} nodes and {segments} segments are no path; it has one node more than segments"
    )]
    PathCounts {
        /// How many nodes there are.
        nodes: usize,
        /// How many segments there are.
        segments: usize,
    },
    /// The path begins elsewhere than at a start.
    #[error("path: it begins at node '{node}', which is no start")]
    PathStart {
        /// The first node.
        node: String,
    },
    /// The path ends elsewhere than at the destination.
    #[error("path: it ends at node '{node}', not at the destination '{destination}'")]
    PathEnd {
        /// The last node.
        node: String,
        /// The destination.
        destination: String,
    },
    /// A segment of the path does not join the nodes around it.
    #[error("path: the network has no {step}")]
    PathBroken {
        /// The segment between the nodes that the path has around it.
        step: Step,
    },
    /// The path uses what is closed.
    #[error("path: {step} is closed, or leads to a closed node")]
    PathClosed {
        /// The segment.
        step: Step,
    },
    /// The path has another length than claimed.
    #[error("path: with its first stretch it is {path_m} m long, {length_m} m are claimed")]
    PathLength {
        /// Length of the path, first stretch included.
        path_m: f64,
        /// The length claimed.
        length_m: f64,
    },
    /// There is a path though there is said to be none.
    #[error(
        "path: it has nodes or segments, yet length_m is null, which claims that there is no way"
    )]
    PathWithoutLength,
    /// There is said to be no way, but not all starts were searched from.
    #[error(
        "settled: start '{node}' is missing; that there is no way is proved by all that can be reached"
    )]
    StartNotSettled {
        /// The start.
        node: String,
    },
    /// There is said to be no way, but the destination was reached.
    #[error(
        "settled: the destination '{node}' is among what can be reached, yet no way is claimed"
    )]
    DestinationSettled {
        /// The destination.
        node: String,
    },
    /// There is said to be no way, but what can be reached goes on.
    #[error("settled: {step} is open and leads out of what can be reached, yet no way is claimed")]
    SegmentLeaves {
        /// The segment.
        step: Step,
    },
}

fn metres_or_null(value_m: Option<f64>) -> String {
    value_m.map_or_else(|| "null".to_owned(), |metres| format!("{metres} m"))
}
