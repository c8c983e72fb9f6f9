//! What is kept of a composition that is flown, with the way that it takes.

use super::assumed::Assumed;
use super::flown_version::later_by;
use super::terms::DroneKind;
use super::{DetourEnd, DetourStop, FlownVersion, Ground, LegEnds};
use jiff::Timestamp;
use skyway_engine::compose::{Composition, Leg};
use skyway_engine::delivery::{FlightComposition, FlightRecomposition, Hold, LegContingency};
use skyway_engine::flight::{FlightPlan, Reservation, Stop};
use skyway_engine::recompose::{Outcome, Warning};
use skyway_engine::routing::Path;
use std::sync::Arc;

/// What a drone is told beside its plan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Told {
    /// Whether it stays where it lands, as no way leads on.
    pub(super) stays: bool,
    pub(super) reserve_used: bool,
    pub(super) hold: Option<Hold>,
    pub(super) is_energy_unchecked: bool,
    pub(super) assumed: Assumed,
}

impl Told {
    /// Of a plan that is new.
    pub(super) fn of_plan(assumed: Assumed) -> Self {
        Self {
            stays: false,
            reserve_used: false,
            hold: None,
            is_energy_unchecked: false,
            assumed,
        }
    }

    pub(super) fn of_answer(answer: &FlightRecomposition, assumed: Assumed) -> Self {
        let ends_at_stop = |warning: &Warning| matches!(warning, Warning::EndsAtStop { .. });
        Self {
            stays: answer.outcome == Outcome::Diverted || answer.warnings.iter().any(ends_at_stop),
            reserve_used: answer.reserve_used,
            hold: answer.hold,
            is_energy_unchecked: !answer.is_energy_checked,
            assumed,
        }
    }
}

impl FlownVersion {
    /// What is kept of a composition that departs at an instant, and the way that it takes.
    pub(super) fn of(
        ground: &Ground,
        composition: &FlightComposition,
        told: Told,
        departs_at: Timestamp,
    ) -> (Self, Composition) {
        let departs_s = ground.skies.seconds(departs_at);
        let way = way_of(composition, departs_s);
        let DroneKind {
            airframe,
            payload_kg,
        } = ground.kind();
        let version = Self {
            airframe: Arc::from(airframe.name.as_str()),
            battery_wh: airframe.battery_wh,
            payload_kg: *payload_kg,
            // Worked out later, with the contingencies.
            ends: Vec::new(),
            reserve_used: told.reserve_used,
            hold: told.hold.map(|hold| Hold {
                until_s: hold.until_s - departs_s,
                ..hold
            }),
            // One that flies nowhere holds on a pad.
            alternate: (told.stays || composition.plan.legs.is_empty())
                .then(|| alternate(ground, composition, departs_s))
                .flatten(),
            is_confirmed: ground.is_alone,
            is_energy_checked: !told.is_energy_unchecked,
            assumed: told.assumed,
            composition: FlightComposition {
                contingencies: Vec::new(),
                ..later_by(composition, -departs_s)
            },
        };
        (version, way)
    }
}

impl LegEnds {
    /// How the contingencies of a leg end, of a plan that departs at so many seconds.
    pub(super) fn of(leg: &LegContingency, departs_s: f64) -> Self {
        let stop = |stop: &Stop| DetourStop {
            before_leg: stop.before_leg,
            takes_off_s: stop.takes_off_s - departs_s,
            battery: [stop.battery_before, stop.battery_after],
        };
        let end = |flight: &FlightPlan, reserve_used: bool| DetourEnd {
            arrives_s: flight.arrives_s - departs_s,
            battery: flight.battery_at_arrival,
            reserve_used,
            stops: Some(flight.stops.iter().map(stop).collect()),
        };
        let detour = &leg.if_closed;
        let flight = detour.flight.as_ref();
        let safe = leg.safe.as_ref();
        Self {
            if_closed: flight.map(|flight| end(flight, detour.reserve_used)),
            safe: safe.map(|alternate| end(&alternate.flight, alternate.reserve_used)),
        }
    }
}

/// The way of a composition as plans without flights have it, from its departure on.
fn way_of(composition: &FlightComposition, departs_s: f64) -> Composition {
    let plan = &composition.plan;
    let figures = composition.figures.legs.iter();
    let flown = plan.legs.iter().zip(figures);
    let legs = flown.map(|(leg, figures)| Leg {
        from: leg.from,
        to: leg.to,
        segment: leg.segment,
        length_m: figures.length_m,
        departure_s: leg.enters_s - departs_s,
        arrival_s: leg.leaves_s - departs_s,
        if_closed: None,
        safe: None,
    });
    Composition {
        way: Path {
            nodes: composition.nodes(),
            segments: plan.legs.iter().map(|leg| leg.segment).collect(),
        },
        legs: legs.collect(),
        length_m: plan.distance_m,
        flight_time_s: plan.arrives_s - departs_s,
    }
}

/// The pad on which a drone that diverts, ends at a stop, or holds may stay.
fn alternate(
    ground: &Ground,
    composition: &FlightComposition,
    departs_s: f64,
) -> Option<Reservation> {
    let from_s = composition.plan.arrives_s;
    let until_s = from_s + ground.settings.refuge_stay_s;
    let node = composition.destination;
    let pad = ground.setting.pads().free_pad(node, from_s, until_s)?;
    Some(Reservation {
        node,
        pad,
        from_s: from_s - departs_s,
        until_s: until_s - departs_s,
    })
}
