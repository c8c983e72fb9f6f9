//! The ways back into the network of a drone in flight, for those who answer it by more than lengths.

use super::answer::Warning;
use super::holding::held_at;
use super::recomposition::{Scratch, World, close_for_request};
use super::request::Request;
use super::safety::UnsafeWay;
use super::starts::{self, Leg};
use crate::airspace::Closed;
use crate::flight::Reentry;
use crate::network::{NodeIx, SegmentIx};

/// Where a drone can re-enter the network.
#[derive(Clone, Debug, PartialEq)]
pub struct ReentryPoints {
    /// The nodes, each with the stretch that leads to it.
    pub ways: Vec<Reentry>,
    /// True when the drone is off its leg.
    pub off_leg: bool,
    /// True when the drone is inside an active zone, which its first stretch leaves.
    pub leaves_zone: bool,
    /// The longer way out of it, for where the shorter one leads nowhere.
    pub spare: Option<Reentry>,
    /// True when it comes into a zone before it can turn.
    pub cannot_stop: bool,
    /// Where there is no way: the least bad one.
    pub least_bad: Option<UnsafeWay>,
    /// For a drone that stands, or may stand, at a node in an active zone: that node, where it holds.
    pub held_at: Option<NodeIx>,
    /// The segment of the leg; `None` where the network has none.
    pub segment: Option<SegmentIx>,
    /// True where the cause lies behind the drone, so that the leg's end is the one way on.
    pub only_ahead: bool,
    /// Segments that the report closes for this request: the leg where its type does, and what a zone brought along covers.
    pub closed_segments: Vec<SegmentIx>,
    /// Nodes likewise.
    pub closed_nodes: Vec<NodeIx>,
    /// What the receiver should know.
    pub warnings: Vec<Warning>,
}

/// The ways back of a request, as [`recompose`](super::recompose) begins with them.
pub fn reentry_points(
    world: &World<'_>,
    request: &Request,
    scratch: &mut Scratch,
) -> ReentryPoints {
    let airspace = world.airspace;
    let topology = &**airspace.topology();
    scratch.fit(topology);
    let Scratch {
        closures, starts, ..
    } = scratch;
    closures.reset();
    close_for_request(request, airspace, closures);
    let closed = Closed::new(topology, airspace.closed(), closures);
    let leg = Leg::of(request, topology);
    let mut warnings = Vec::new();
    if leg.segment.is_none() {
        warnings.push(Warning::UnknownSegment);
    }
    starts::find(request, airspace, &closed, &leg, starts, &mut warnings);
    ReentryPoints {
        only_ahead: matches!(starts.ways.as_slice(), [only] if only.node == leg.to),
        ways: starts.ways.clone(),
        off_leg: starts.off_leg,
        leaves_zone: starts.leaves_zone,
        spare: starts.spare,
        cannot_stop: starts.cannot_stop,
        least_bad: starts.least_bad.clone(),
        held_at: held_at(request, airspace, &leg),
        segment: leg.segment,
        closed_segments: closures.segments().to_vec(),
        closed_nodes: closures.nodes().to_vec(),
        warnings,
    }
}
