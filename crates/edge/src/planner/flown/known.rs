//! What is known of a drone: by its plan, and by the telemetry of the last minutes.

use super::assumed::Assumed;
use crate::drones::Sighting;
use crate::plans::entry::PlanEntry;
use jiff::{SignedDuration, Timestamp};

/// A battery that was told longer ago is not known any more.
pub(super) const SEEN_WITHIN: SignedDuration = SignedDuration::from_mins(5);

/// What is a default of a drone, by its plan and its telemetry. A plan that has departed says of no battery what is left.
pub(super) fn assumed_of(
    plan: Option<&PlanEntry>,
    sighting: Option<&Sighting>,
    now: Timestamp,
) -> Assumed {
    let order = plan.and_then(|plan| plan.order.as_ref());
    let waiting = plan.filter(|plan| now < plan.reported.departs_at);
    let waiting = waiting.and_then(|plan| plan.reported.flight.as_deref());
    let is_said = waiting.is_some_and(|flown| !flown.assumed.battery);
    Assumed {
        airframe: order.is_none_or(|order| !order.is_airframe_named),
        battery: !is_said && seen_lately(plan, sighting, now).is_none(),
    }
}

/// The battery by the telemetry of the last minutes, of the flight that its drone is on.
pub(super) fn seen_lately(
    plan: Option<&PlanEntry>,
    sighting: Option<&Sighting>,
    now: Timestamp,
) -> Option<f64> {
    let said = sighting.and_then(|sighting| sighting.battery);
    let lately = said.filter(|battery| {
        let is_of_plan = plan.is_none_or(|plan| battery.at >= plan.reported.departs_at);
        is_of_plan && now.duration_since(battery.at) <= SEEN_WITHIN
    });
    lately.map(|battery| battery.fraction)
}
