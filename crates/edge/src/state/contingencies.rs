//! What drones do on legs that close: which plans lack that, and what is taken of what was found.

use super::State;
use crate::line::mailbox::Content;
use crate::planner::Version;
use crate::plans::entry::PlanEntry;
use skyway_engine::airspace::Airspace;
use skyway_engine::network::NodeIx;
use std::sync::Arc;

impl State {
    /// Notes whether the contingencies of a plan are still to be worked out.
    pub(super) fn note_contingencies(&mut self, plan: &PlanEntry) {
        let versions = std::iter::once(&plan.reported).chain(&plan.wanted);
        let mut lacking = versions.filter(|version| version.composition.lacks_contingencies());
        if plan.is_active() && lacking.next().is_some() {
            self.lacking_contingencies.insert(plan.id.clone());
        } else {
            self.lacking_contingencies.remove(&plan.id);
        }
    }

    /// Puts contingencies beside the legs of the versions that lacked them, unless what has closed since meets one: then
    /// they are worked out again.
    pub(super) fn take_contingencies(
        &mut self,
        plan: &Arc<str>,
        versions: Vec<Version>,
        on: &Arc<Airspace>,
    ) {
        let plan = self.next.plans.get(plan).filter(|plan| plan.is_active());
        let Some(plan) = plan.cloned() else {
            return;
        };
        let airspace = self.next.airspace.clone();
        let is_same_airspace = Arc::ptr_eq(&airspace, on);
        if !Arc::ptr_eq(airspace.topology(), on.topology()) {
            // On another network the same numbers are other nodes. Where the plan lacks some there, it waits for them again.
            return;
        }
        let mut filled = (*plan).clone();
        let mut told = Vec::with_capacity(versions.len());
        for version in versions {
            if !is_same_airspace && crosses_closed(&airspace, &version) {
                continue;
            }
            let is_it = |kept: &Version| {
                let is_same = (kept.number, kept.epoch) == (version.number, version.epoch);
                is_same && kept.composition.way == version.composition.way
            };
            let number = version.number;
            if is_it(&filled.reported) {
                filled.reported = Arc::new(version);
            } else if filled.wanted.as_deref().is_some_and(is_it) {
                filled.wanted = Some(Arc::new(version));
            } else {
                continue;
            }
            told.push(number);
        }
        // What is taken for a drone that is not heard of is taken for its new contingencies.
        self.guard_no_more(&filled.id);
        let plan = self.keep_plan(filled);
        for number in told {
            self.post(&plan, &[], Content::Contingencies(number));
        }
    }
}

/// Whether a contingency of a version crosses something that is closed.
fn crosses_closed(airspace: &Airspace, version: &Version) -> bool {
    let topology = airspace.topology();
    let is_closed = |nodes: &[NodeIx]| {
        nodes.windows(2).any(|ends| {
            let segment = topology.segment_between(ends[0], ends[1]);
            segment.is_none_or(|segment| airspace.closed().blocks(segment))
        })
    };
    let legs = version.composition.legs.iter();
    let ways = legs.flat_map(|leg| {
        let detour = leg.if_closed.iter().map(|detour| &detour.nodes);
        detour.chain(leg.safe.iter().map(|safe| &safe.nodes))
    });
    ways.into_iter().any(|nodes| is_closed(nodes))
}
