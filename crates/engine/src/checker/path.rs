//! That a path joins, is open, and is as long as it says.

use super::claim::{Claim, Sky, Told};
use super::fault::{Fault, Place, Rule};
use crate::airspace::Hits;
use crate::network::{NodeIx, SegmentIx};
use jiff::Timestamp;

/// Lengths this much apart, in metres, count as the same, and this share of them.
const SAME_M: f64 = 1e-2;
const SAME_SHARE: f64 = 1e-9;

/// Every segment exists and joins the nodes beside it.
pub(super) fn joins(claim: &Claim<'_>, sky: &Sky<'_>) -> Result<(), Fault> {
    let topology = sky.airspace.topology();
    if claim.nodes.len() != claim.segments.len() + 1 {
        let (nodes, segments) = (claim.nodes.len() as f64, claim.segments.len() as f64);
        return Err(Fault::figures(
            Rule::Joins,
            Place::Answer,
            nodes,
            segments + 1.0,
        ));
    }
    let count = topology.node_count();
    if claim.nodes.iter().any(|node| node.at() >= count) {
        return Err(Fault::new(Rule::Joins, Place::Answer));
    }
    for (number, (pair, &segment)) in claim.nodes.windows(2).zip(claim.segments).enumerate() {
        if segment.at() >= topology.segment_count() {
            return Err(Fault::new(Rule::Joins, Place::Answer));
        }
        let ends = topology.segment(segment);
        let joins = (ends.from, ends.to) == (pair[0], pair[1])
            || (ends.to, ends.from) == (pair[0], pair[1]);
        if !joins {
            return Err(Fault::new(Rule::Joins, Place::Leg(number, segment)));
        }
    }
    Ok(())
}

/// Nothing on the path is closed, as far as it is closed now: what an answer by distance keeps to.
pub(super) fn is_open(claim: &Claim<'_>, sky: &Sky<'_>) -> Result<(), Fault> {
    let closed = sky.airspace.closed();
    let has_zone = sky.own.zone.is_some();
    for (number, (pair, &segment)) in claim.nodes.windows(2).zip(claim.segments).enumerate() {
        let is_clear = !closed.blocks(segment) && !has_zone && sky.own.segment != Some(segment);
        if is_clear {
            continue;
        }
        // The node that the drone leaves may be closed.
        let ends = if number == 0 { &pair[1..] } else { pair };
        if claim.told == Told::Hold && has_opened(claim, sky, segment, ends) {
            continue;
        }
        if sky.closes_segment(segment) {
            return Err(Fault::new(Rule::ClosedSegment, Place::Leg(number, segment)));
        }
        // Where the path begins may be closed: the drone is there, as a first stretch never enters what is closed.
        let enters_again = number > 0 && sky.closes_node(pair[0]);
        if sky.closes_node(pair[1]) || enters_again {
            let node = if enters_again { pair[0] } else { pair[1] };
            return Err(Fault::new(Rule::ClosedNode, Place::Node(node)));
        }
    }
    Ok(())
}

/// Whether all that closes a leg is over once the drone has waited: the zones over it, and what ends until then.
fn has_opened(claim: &Claim<'_>, sky: &Sky<'_>, segment: SegmentIx, ends: &[NodeIx]) -> bool {
    let Some(&waits_at) = claim.nodes.first() else {
        return false;
    };
    let meets = |hits: &Hits| {
        let mut nodes = ends.iter();
        hits.segments.binary_search(&segment).is_ok()
            || nodes.any(|node| hits.nodes.binary_search(node).is_ok())
    };
    let is_over_it = |hits: &Hits| hits.nodes.binary_search(&waits_at).is_ok();
    let stays = |hits: &Hits| meets(hits) && !is_over_it(hits);
    let by_brought = sky.own.zone.is_some_and(|(_, hits)| stays(hits));
    if sky.own.segment == Some(segment) || by_brought {
        return false;
    }
    let has_ended = |until: Option<Timestamp>| {
        let end = claim.waits_until;
        end.is_some_and(|end| until.is_some_and(|until| until <= end))
    };
    let mut causes = sky.airspace.in_force();
    causes.all(|closure| {
        let windows = &closure.windows;
        let ends = !windows.is_empty() && windows.iter().all(|window| has_ended(window.until()));
        let is_zone = closure.zone().is_some();
        !meets(&closure.hits) || ends || (is_zone && is_over_it(&closure.hits))
    })
}

/// The length stated is that of the first stretch and the segments.
pub(super) fn lengths(claim: &Claim<'_>, sky: &Sky<'_>) -> Result<(), Fault> {
    let topology = sky.airspace.topology();
    let segments = claim.segments.iter();
    let path_m: f64 = segments
        .map(|&segment| topology.segment(segment).length_m)
        .sum();
    let found_m = claim.stretch.map_or(0.0, |stretch| stretch.length_m) + path_m;
    let stated_m = claim.length_m.unwrap_or(f64::NAN);
    let tolerance_m = SAME_M + SAME_SHARE * found_m;
    // Not a number is no length either.
    let adds_up = (stated_m - found_m).abs() <= tolerance_m;
    match adds_up {
        true => Ok(()),
        false => Err(Fault::figures(
            Rule::Length,
            Place::Answer,
            stated_m,
            found_m,
        )),
    }
}
