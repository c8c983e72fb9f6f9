//! Plans that are over when the network changes: told of as long as their ways are there, with what
//! they still take.

use super::State;
use super::migrated_plans::{ends_over, sent_carried, version_carried};
use crate::plans::entry::{LandedOn, PlanEntry};
use skyway_engine::compose::Change;
use std::sync::Arc;

impl State {
    /// Carries a plan that is over to the network that is in service now.
    pub(super) fn migrate_ended_plan(&mut self, plan: &Arc<PlanEntry>, change: &Change<'_>) {
        self.leave_landed(plan);
        let ends = ends_over(plan, change.correspondence);
        let current = version_carried(plan, &plan.reported, change);
        let Some(((source, destination), (current, _))) = ends.zip(current) else {
            self.next.plans.remove(&plan.id);
            self.over.retain(|id| *id != plan.id);
            return;
        };
        let landed_on = plan.landed_on.and_then(|landed| {
            let node = change.correspondence.node(landed.node)?;
            let has_pad = landed.pad < self.next.topology().pads(node);
            has_pad.then_some(LandedOn { node, ..landed })
        });
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
