//! What of a flight is a default, as neither client nor telemetry said it.

use crate::edge::drones::Sighting;
use crate::edge::plan_entry::PlanEntry;
use jiff::{SignedDuration, Timestamp};
use std::borrow::Cow;

/// A battery that was told longer ago is not known any more.
pub(super) const SEEN_WITHIN: SignedDuration = SignedDuration::from_mins(5);

/// What a flight rests on that is a default: neither the client said it, nor telemetry lately.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::edge) struct Assumed {
    pub(in crate::edge) airframe: bool,
    pub(in crate::edge) battery: bool,
}

impl Assumed {
    /// What is a default of a drone, by its plan and its telemetry. A plan that has departed says of no battery what is left.
    pub(super) fn of_drone(
        plan: Option<&PlanEntry>,
        sighting: Option<&Sighting>,
        now: Timestamp,
    ) -> Self {
        let order = plan.and_then(|plan| plan.order.as_ref());
        let waiting = plan.filter(|plan| now < plan.reported.departs_at);
        let waiting = waiting.and_then(|plan| plan.reported.flight.as_deref());
        let is_said = waiting.is_some_and(|flown| !flown.assumed.battery);
        Self {
            airframe: order.is_none_or(|order| !order.is_airframe_named),
            battery: !is_said && seen_lately(plan, sighting, now).is_none(),
        }
    }

    /// The same where a report names the airframe, or states the battery.
    pub(super) fn but_for(self, is_airframe_named: bool, is_battery_stated: bool) -> Self {
        Self {
            airframe: self.airframe && !is_airframe_named,
            battery: self.battery && !is_battery_stated,
        }
    }

    /// What is a default in either.
    #[must_use]
    pub(in crate::edge) fn or(self, other: Self) -> Self {
        Self {
            airframe: self.airframe || other.airframe,
            battery: self.battery || other.battery,
        }
    }

    /// How certain the energy of a flight is that rests on this, and the names of the defaults, in the words of the wire.
    pub(in crate::edge) fn told(self) -> (Cow<'static, str>, Vec<Cow<'static, str>>) {
        let all = [(self.airframe, "airframe"), (self.battery, "battery")];
        let assumed = all.into_iter().filter(|(is_assumed, _)| *is_assumed);
        let names: Vec<_> = assumed.map(|(_, name)| Cow::Borrowed(name)).collect();
        let energy = if names.is_empty() {
            "checked"
        } else {
            "assumed"
        };
        (Cow::Borrowed(energy), names)
    }
}

/// The battery by the telemetry of the last minutes, of the flight that its drone is on.
pub(super) fn seen_lately(
    plan: Option<&PlanEntry>,
    sighting: Option<&Sighting>,
    now: Timestamp,
) -> Option<f64> {
    let lately = sighting.filter(|sighting| {
        let is_of_plan = plan.is_none_or(|plan| sighting.seen_at >= plan.reported.departs_at);
        is_of_plan && now.duration_since(sighting.seen_at) <= SEEN_WITHIN
    });
    lately?.battery_fraction
}
