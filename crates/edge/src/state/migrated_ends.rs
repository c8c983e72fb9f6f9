//! Plans that are over when the network changes: told of as long as their ways are there, or their drones stand on pads, with what
//! they still take.

use super::State;
use super::migrated_plans::{
    ends_over, nothing_left_of, part_carried, sent_carried, version_carried,
};
use crate::planner::Version;
use crate::plans::entry::{LandedOn, PlanEntry};
use skyway_contract::AlarmKind;
use skyway_engine::compose::{Change, Composition};
use skyway_engine::network::NodeIx;
use skyway_engine::routing::Path;
use std::sync::Arc;

impl State {
    /// Carries a plan that is over to the network that is in service now.
    pub(super) fn migrate_ended_plan(&mut self, plan: &Arc<PlanEntry>, change: &Change<'_>) {
        self.leave_landed(plan);
        let landed_on = plan.landed_on.and_then(|landed| {
            let node = change.correspondence.node(landed.node)?;
            let has_pad = landed.pad < self.next.topology().pads(node);
            has_pad.then_some(LandedOn { node, ..landed })
        });
        let whole = version_carried(plan, &plan.reported, change).map(|(whole, _)| whole);
        let whole = ends_over(plan, change.correspondence).zip(whole);
        let carried = whole.or_else(|| end_of_way(plan, landed_on, change));
        let Some(((source, destination), current)) = carried else {
            self.next.plans.remove(&plan.id);
            self.over.retain(|id| *id != plan.id);
            self.end_plan_alarms(&plan.id, &[AlarmKind::Lost]);
            return;
        };
        let is_off_its_pad = plan.landed_on.is_some() && landed_on.is_none();
        let plan = self.keep_plan(PlanEntry {
            source,
            destination,
            reported: Arc::new(current),
            sent: sent_carried(plan, change),
            holds: plan.holds && !is_off_its_pad,
            landed_on,
            ..(**plan).clone()
        });
        self.hold_again(&plan);
        if is_off_its_pad {
            self.forget_later(&plan.id);
        }
    }
}

/// What a plan still takes where some of the way that it was flown on is gone: its last legs, with their stops, or the node that its
/// drone stands on, or may be at, so that it can be said what became of it; with its ends. `None` where it takes nothing.
fn end_of_way(
    plan: &PlanEntry,
    landed_on: Option<LandedOn>,
    change: &Change<'_>,
) -> Option<((NodeIx, NodeIx), Version)> {
    let composition = &plan.reported.composition;
    let last = composition.legs.len().saturating_sub(1);
    let legs = composition.legs_left(change.correspondence, last);
    let takes_more = landed_on.is_some() || plan.holds;
    let left = (takes_more && !legs.is_empty()).then(|| part_carried(plan, legs, change));
    let left = left.flatten().or_else(|| {
        let nothing = nothing_left_of(&plan.reported);
        let node = |node| change.correspondence.node(node);
        let last = plan.reported.last_node().and_then(node);
        let may_be_at = || last.or(node(plan.source)).filter(|_| plan.holds);
        let at = landed_on.map(|landed| landed.node).or_else(may_be_at)?;
        let way = Path {
            nodes: vec![at],
            segments: Vec::new(),
        };
        Some(Version {
            composition: Composition {
                way,
                ..nothing.composition
            },
            stops: Arc::default(),
            ..nothing
        })
    })?;
    let nodes = &left.composition.way.nodes;
    let destination = change.correspondence.node(plan.destination);
    let ends = (*nodes.first()?, destination.or(nodes.last().copied())?);
    Some((ends, left))
}
