//! What is kept of a plan that is flown: times count from its departure, so that it means the same in every state of the edge.

use super::{DroneKind, Ground};
use crate::compose::{Composition, Leg};
use crate::delivery::{FlightComposition, FlightRecomposition, Hold, LegContingency};
use crate::flight::{FlightPlan, Reservation};
use crate::itinerary::Value;
use crate::network::NodeIx;
use crate::recompose::Outcome;
use crate::routing::Way;
use jiff::Timestamp;
use std::sync::Arc;

/// How a contingency ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::edge) struct DetourEnd {
    /// When, in seconds from the plan's departure.
    pub(in crate::edge) arrives_s: f64,
    /// Battery then, as a fraction.
    pub(in crate::edge) battery: f64,
    /// True where it draws on the reserve.
    pub(in crate::edge) reserve_used: bool,
}

/// How the contingencies of a leg end; `None` where there is no way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::edge) struct LegEnds {
    pub(in crate::edge) if_closed: Option<DetourEnd>,
    pub(in crate::edge) safe: Option<DetourEnd>,
}

impl LegEnds {
    /// How the contingencies of a leg end, of a plan that departs at so many seconds.
    pub(super) fn of(leg: &LegContingency, departs_s: f64) -> Self {
        let end = |flight: &FlightPlan, reserve_used: bool| DetourEnd {
            arrives_s: flight.arrives_s - departs_s,
            battery: flight.battery_at_arrival,
            reserve_used,
        };
        let detour = &leg.if_closed;
        let flight = detour.flight.as_ref();
        let safe = leg.safe.as_ref();
        Self {
            if_closed: flight.map(|flight| end(flight, detour.reserve_used)),
            safe: safe.map(|haven| end(&haven.flight, haven.reserve_used)),
        }
    }
}

/// A version of a plan that is flown with times, battery and pads. All seconds count from the version's departure.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::edge) struct FlownVersion {
    /// The airframe's name.
    pub(in crate::edge) airframe: Arc<str>,
    /// Its full battery, in watt hours.
    pub(in crate::edge) battery_wh: f64,
    /// The payload that was reckoned with, in kilograms.
    pub(in crate::edge) payload_kg: f64,
    /// Legs and stops with all figures. Of its contingencies only the ends are kept.
    pub(in crate::edge) composition: FlightComposition,
    /// How the contingencies of each leg end.
    pub(in crate::edge) ends: Vec<LegEnds>,
    /// True where it draws on the reserve, to reach a safe node.
    pub(in crate::edge) reserve_used: bool,
    /// Where it waits first, where it is told so.
    pub(in crate::edge) hold: Option<Hold>,
    /// The pad of the safe node that it diverts to.
    pub(in crate::edge) refuge: Option<Reservation>,
    /// Whether its pads are surely its own: no other edge gives them away.
    pub(in crate::edge) is_confirmed: bool,
    /// False where nobody knows whether the battery suffices: its levels mean nothing then.
    pub(in crate::edge) is_energy_checked: bool,
}

/// What a drone is told beside its plan.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Told {
    pub(super) is_diverted: bool,
    pub(super) reserve_used: bool,
    pub(super) hold: Option<Hold>,
    pub(super) is_energy_unchecked: bool,
}

impl From<&FlightRecomposition> for Told {
    fn from(answer: &FlightRecomposition) -> Self {
        Self {
            is_diverted: answer.outcome == Outcome::Diverted,
            reserve_used: answer.reserve_used,
            hold: answer.hold,
            is_energy_unchecked: !answer.is_energy_checked,
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
        let contingencies = composition.contingencies.iter();
        let ends = contingencies.map(|leg| LegEnds::of(leg, departs_s));
        let DroneKind {
            airframe,
            payload_kg,
        } = ground.kind();
        let version = Self {
            airframe: Arc::from(airframe.name.as_str()),
            battery_wh: airframe.battery_wh,
            payload_kg: *payload_kg,
            ends: ends.collect(),
            reserve_used: told.reserve_used,
            hold: told.hold.map(|hold| Hold {
                until_s: hold.until_s - departs_s,
                ..hold
            }),
            refuge: told
                .is_diverted
                .then(|| refuge(ground, composition, departs_s))
                .flatten(),
            is_confirmed: ground.is_alone,
            is_energy_checked: !told.is_energy_unchecked,
            composition: FlightComposition {
                contingencies: Vec::new(),
                ..later_by(composition, -departs_s)
            },
        };
        (version, way)
    }

    /// Its legs and stops, departing at so many seconds.
    pub(super) fn composition_at(&self, departs_s: f64) -> FlightComposition {
        later_by(&self.composition, departs_s)
    }

    /// The pads that it takes: those of its stops, and that of the node that it diverts to.
    pub(in crate::edge) fn reservations(&self) -> Vec<Reservation> {
        let mut reservations = self.composition.reservations();
        reservations.extend(self.refuge);
        reservations
    }

    /// The nodes that it stops at, in order.
    pub(in crate::edge) fn stop_nodes(&self) -> impl Iterator<Item = NodeIx> + '_ {
        self.composition.plan.stops.iter().map(|stop| stop.node)
    }
}

/// The way of a composition as plans without flights have it, from its departure on.
fn way_of(composition: &FlightComposition, departs_s: f64) -> Composition {
    let plan = &composition.plan;
    let figures = composition.figures.legs.iter();
    let flown = plan.legs.iter().zip(figures);
    let legs = flown.zip(&composition.contingencies);
    let legs = legs.map(|((leg, figures), contingency)| Leg {
        from: leg.from,
        to: leg.to,
        segment: leg.segment,
        length_m: figures.length_m,
        departure_s: leg.enters_s - departs_s,
        arrival_s: leg.leaves_s - departs_s,
        if_closed: contingency.if_closed.contingency.clone(),
        safe: contingency.safe.as_ref().map(|haven| haven.safe.clone()),
    });
    Composition {
        way: Way {
            nodes: composition.nodes(),
            segments: plan.legs.iter().map(|leg| leg.segment).collect(),
        },
        legs: legs.collect(),
        length_m: plan.distance_m,
        flight_time_s: plan.arrives_s - departs_s,
    }
}

/// A composition so many seconds later, but for its contingencies.
fn later_by(composition: &FlightComposition, seconds: f64) -> FlightComposition {
    let mut later = composition.clone();
    later.plan.start.at_s += seconds;
    later.began_s += seconds;
    later.deadline_s += seconds;
    later.plan.arrives_s += seconds;
    for leg in &mut later.plan.legs {
        leg.enters_s += seconds;
        leg.leaves_s += seconds;
    }
    for stop in &mut later.plan.stops {
        stop.lands_s += seconds;
        stop.takes_off_s += seconds;
    }
    let shifted = |value: Value| Value {
        arrives_s: value.arrives_s + seconds,
        ..value
    };
    later.proof.value = shifted(later.proof.value);
    later.proof.lower_bound = shifted(later.proof.lower_bound);
    later
}

/// The pad on which a drone that diverts may stay.
fn refuge(ground: &Ground, composition: &FlightComposition, departs_s: f64) -> Option<Reservation> {
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
