//! Whose a report is: the drone or caller it counts for, and the plans its sender may speak for.

use crate::drones::DRONE_ID_BYTES_MAX;
use crate::drones::progress::Progress;
use crate::plans::entry::PlanEntry;
use crate::snapshot::Snapshot;
use skyway_contract as wire;
use skyway_formats::ReadWarning;
use skyway_service::access::{Caller, Role};
use std::sync::Arc;

/// Who a report is counted for: its drone where the caller may speak for it, else the caller.
pub(crate) fn reporter(caller: &Caller, report: &wire::FailureReport) -> Arc<str> {
    let drone = report.drone.as_ref().and_then(|drone| drone.id.as_deref());
    match drone.filter(|drone| caller.speaks_for(drone)) {
        Some(drone) => Arc::from(drone),
        None => caller.subject.clone(),
    }
}

/// Whether a caller may speak for a plan: for that of a drone as for the drone, for others as their maker.
pub(crate) fn may_speak_for(caller: &Caller, plan: &PlanEntry) -> bool {
    match plan.drone_id.as_deref() {
        Some(drone) => caller.speaks_for(drone),
        None => {
            matches!(caller.role, Role::Operator | Role::Anyone) || caller.subject == plan.subject
        }
    }
}

/// Who makes a change that a caller asks for.
pub(crate) fn author(caller: &Caller) -> Arc<wire::Author> {
    Arc::new(wire::Author::new(caller.role.name(), &caller.subject))
}

/// The drone that a report counts for and is shown as: the one it names, else that of its plan, where the caller may speak
/// for it. In the name of another drone nothing is known, nothing is published, and nothing is shown.
pub(crate) fn drone_of(
    caller: &Caller,
    report: &wire::FailureReport,
    plan: Option<&PlanEntry>,
    read: &mut Vec<ReadWarning>,
) -> Option<Arc<str>> {
    let stated = report.drone.as_ref().and_then(|drone| drone.id.as_deref());
    let drone = match stated {
        Some(drone) if !drone.is_empty() && drone.len() <= DRONE_ID_BYTES_MAX => {
            Some(Arc::from(drone))
        }
        _ => plan.and_then(|plan| plan.drone_id.clone()),
    };
    let is_own = drone.as_deref().is_none_or(|id| caller.speaks_for(id));
    if is_own {
        return drone;
    }
    let message = format!(
        "'{}' may not report for the drone '{}': it is answered as an unknown drone",
        caller.subject,
        drone.as_deref().unwrap_or_default()
    );
    read.push(ReadWarning::new("drone_not_yours", message));
    None
}

/// The id of the plan that a report names.
pub(crate) fn named_plan(report: &wire::FailureReport) -> Option<&str> {
    let service = report.service.as_ref();
    service.and_then(|service| service.plan_id.as_deref())
}

/// The plan a report is about: the one it names, or that its drone flies, if the caller may speak for it. A drone that
/// names a plan that is over flies another one all the same.
pub(crate) fn plan_of(
    snapshot: &Snapshot,
    caller: &Caller,
    report: &wire::FailureReport,
    read: &mut Vec<ReadWarning>,
) -> Option<Arc<PlanEntry>> {
    let is_own = |plan: &&Arc<PlanEntry>| plan.is_active() && may_speak_for(caller, plan);
    let named = named_plan(report);
    let found = named.and_then(|id| snapshot.plans.get(id)).filter(is_own);
    if let Some(id) = named.filter(|_| found.is_none()) {
        read.push(ReadWarning {
            code: "unknown_plan",
            message: format!("the edge knows no active plan '{id}' of yours; it is answered from what else the report says"),
        });
    }
    let drone = report.drone.as_ref().and_then(|drone| drone.id.as_deref());
    let flown = drone.and_then(|drone| snapshot.plan_of_drone(drone));
    found.or_else(|| flown.filter(is_own)).cloned()
}

/// Whether what is reported fits a drone that stands by its plan: it does not fly, and has the leg before it. One that is late
/// may report another.
pub(super) fn may_stand(report: &wire::FailureReport, progress: Option<Progress>) -> bool {
    let service_leg = report.service.as_ref().and_then(|service| service.leg);
    let stated = service_leg.or(report.leg);
    let next = progress.and_then(|progress| u32::try_from(progress.leg).ok());
    report.airborne != Some(true) && stated.is_none_or(|leg| Some(leg) == next)
}
