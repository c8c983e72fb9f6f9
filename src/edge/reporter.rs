//! Whose a report is: the drone or caller it counts for, and the plans its sender may speak for.

use super::snapshot::PlanEntry;
use crate::access::{Caller, Role};
use crate::wire;
use std::sync::Arc;

/// Who a report is counted for: its drone where the caller may speak for it, else the caller.
pub(super) fn reporter(caller: &Caller, report: &wire::FailureReport) -> Arc<str> {
    let drone = report.drone.as_ref().and_then(|drone| drone.id.as_deref());
    match drone.filter(|drone| caller.speaks_for(drone)) {
        Some(drone) => Arc::from(drone),
        None => caller.subject.clone(),
    }
}

/// Whether a caller may speak for a plan: for that of a drone as for the drone, for others as their maker.
pub(super) fn may_speak_for(caller: &Caller, plan: &PlanEntry) -> bool {
    match plan.drone_id.as_deref() {
        Some(drone) => caller.speaks_for(drone),
        None => {
            matches!(caller.role, Role::Operator | Role::Anyone) || caller.subject == plan.subject
        }
    }
}

pub(super) fn drone_of(report: &wire::FailureReport, plan: Option<&PlanEntry>) -> Option<Arc<str>> {
    let stated = report.drone.as_ref().and_then(|drone| drone.id.as_deref());
    match stated {
        Some(drone) if !drone.is_empty() && drone.len() <= 128 => Some(Arc::from(drone)),
        _ => plan.and_then(|plan| plan.drone_id.clone()),
    }
}
