//! The flight of a plan's version in its row: numbers beside the legs that the row has anyway.

use super::codec::{Dictionary, Names, Places};
use super::detour_rows::StoredEnd;
use super::file::StoreFault;
use crate::planner::{Assumed, FlownVersion, LegEnds};
use serde::{Deserialize, Serialize};
use skyway_engine::compose::Leg;
use skyway_engine::delivery::{FlightComposition, Hold, Proof};
use skyway_engine::flight::{FlightPlan, FlightStart, FlownLeg, Reservation, Stop, StopKind};
use skyway_engine::itinerary::{
    Effort, LegFigures, Objective, PlanFigures, Step, StopFigures, Unproved, Value,
};
use skyway_engine::network::Topology;
use std::sync::Arc;

/// Seconds from the departure of the version.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StoredFlight {
    airframe: Arc<str>,
    battery_wh: f64,
    payload_kg: f64,
    confirmed: bool,
    objective: Objective,
    start: StoredStart,
    destination: u32,
    began_s: f64,
    /// None where it may land at any time.
    deadline_s: Option<f64>,
    reserve: f64,
    /// Ids of segments closed for it alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    closed: Vec<String>,
    legs: Vec<StoredFlownLeg>,
    stops: Vec<StoredStop>,
    arrives_s: f64,
    battery_at_arrival: f64,
    energy: f64,
    energy_wh: f64,
    cost_usd: f64,
    proof: StoredProof,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    reserve_used: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    energy_unchecked: bool,
    /// Whether the client named the airframe, and stated the battery; absent in rows of before as well.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    airframe_named: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    battery_stated: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    hold: Option<StoredStay>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    refuge: Option<StoredStay>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredStart {
    node: u32,
    at_s: f64,
    battery: f64,
    on_ground: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pad: Option<u16>,
    flown_m: f64,
    drawn: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredFlownLeg {
    /// Before and after.
    battery: [f64; 2],
    /// In the air, over ground.
    speeds_mps: [f64; 2],
    energy_wh: f64,
    cost_usd: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    if_closed: Option<StoredEnd>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    safe: Option<StoredEnd>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredStop {
    kind: StopKind,
    before_leg: usize,
    node: u32,
    pad: u16,
    lands_s: f64,
    takes_off_s: f64,
    /// Before and after.
    battery: [f64; 2],
    waits_s: f64,
    /// Of a stop at which the delivery is served.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    service_s: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredStay {
    node: u32,
    pad: u16,
    /// None where the drone is there already.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    from_s: Option<f64>,
    until_s: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredProof {
    proved: bool,
    /// Weight and landing.
    value: [f64; 2],
    /// None where nothing bounds it.
    bound: [Option<f64>; 2],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reason: Option<Unproved>,
}

pub(super) fn store_flight(
    topology: &Topology,
    flown: &FlownVersion,
    dictionary: &mut Dictionary,
) -> StoredFlight {
    let composition = &flown.composition;
    let (plan, start) = (&composition.plan, &composition.plan.start);
    let hold = flown.hold.map(|hold| StoredStay {
        node: dictionary.place(hold.node),
        pad: hold.pad,
        from_s: None,
        until_s: hold.until_s,
    });
    let refuge = flown.alternate.map(|stay| StoredStay {
        node: dictionary.place(stay.node),
        pad: stay.pad,
        from_s: Some(stay.from_s),
        until_s: stay.until_s,
    });
    StoredFlight {
        airframe: flown.airframe.clone(),
        battery_wh: flown.battery_wh,
        payload_kg: flown.payload_kg,
        confirmed: flown.is_confirmed,
        objective: composition.objective,
        start: StoredStart {
            node: dictionary.place(start.node),
            at_s: start.at_s,
            battery: start.battery,
            on_ground: start.on_ground,
            pad: start.pad,
            flown_m: start.flown_m,
            drawn: start.drawn,
        },
        destination: dictionary.place(composition.destination),
        began_s: composition.began_s,
        deadline_s: finite(composition.deadline_s),
        reserve: composition.reserve,
        closed: Names(topology).segments(&composition.closed_segments),
        legs: store_legs(flown),
        stops: store_stops(composition, dictionary),
        arrives_s: plan.arrives_s,
        battery_at_arrival: plan.battery_at_arrival,
        energy: plan.energy,
        energy_wh: composition.figures.energy_wh,
        cost_usd: composition.figures.cost_usd,
        proof: store_proof(&composition.proof),
        reserve_used: flown.reserve_used,
        energy_unchecked: !flown.is_energy_checked,
        airframe_named: !flown.assumed.airframe,
        battery_stated: !flown.assumed.battery,
        hold,
        refuge,
    }
}

/// JSON has no infinity.
fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

fn store_legs(flown: &FlownVersion) -> Vec<StoredFlownLeg> {
    let composition = &flown.composition;
    let figures = composition.figures.legs.iter();
    let legs = composition.plan.legs.iter().zip(figures);
    // Contingencies that are still to be worked out have no ends yet.
    let ends = (0..).map(|leg: usize| flown.ends.get(leg).cloned().unwrap_or_default());
    let told = legs.zip(&composition.leg_costs_usd).zip(ends);
    told.map(|(((leg, figures), &cost_usd), ends)| StoredFlownLeg {
        battery: [leg.battery_before, leg.battery_after],
        speeds_mps: [figures.airspeed_mps, figures.ground_speed_mps],
        energy_wh: figures.energy_wh,
        cost_usd,
        if_closed: ends.if_closed.map(StoredEnd::of),
        safe: ends.safe.map(StoredEnd::of),
    })
    .collect()
}

fn store_stops(composition: &FlightComposition, dictionary: &mut Dictionary) -> Vec<StoredStop> {
    let figures = composition.figures.stops.iter();
    let stops = composition.plan.stops.iter().zip(figures);
    stops
        .map(|(stop, figures)| StoredStop {
            kind: stop.kind,
            before_leg: stop.before_leg,
            node: dictionary.place(stop.node),
            pad: stop.pad,
            lands_s: stop.lands_s,
            takes_off_s: stop.takes_off_s,
            battery: [stop.battery_before, stop.battery_after],
            waits_s: figures.waits_s,
            service_s: stop.service_s,
        })
        .collect()
}

fn store_proof(proof: &Proof) -> StoredProof {
    let bound = &proof.lower_bound;
    StoredProof {
        proved: proof.proved,
        value: [proof.value.weight, proof.value.arrives_s],
        bound: [finite(bound.weight), finite(bound.arrives_s)],
        reason: proof.reason,
    }
}

/// The flight of a version whose legs have been read.
pub(super) fn read_flight(
    topology: &Topology,
    places: Places<'_>,
    legs: &[Leg],
    stored: &StoredFlight,
) -> Result<FlownVersion, StoreFault> {
    if legs.len() != stored.legs.len() {
        return Err(StoreFault::damaged(
            "a plan has another number of legs than of flights over them",
        ));
    }
    let start = &stored.start;
    let plan = FlightPlan {
        start: FlightStart {
            node: places.node(start.node)?,
            at_s: start.at_s,
            battery: start.battery,
            on_ground: start.on_ground,
            pad: start.pad,
            flown_m: start.flown_m,
            drawn: start.drawn,
            stretch: None,
        },
        legs: legs.iter().zip(&stored.legs).map(flown_leg).collect(),
        stops: read_stops(places, &stored.stops)?,
        arrives_s: stored.arrives_s,
        battery_at_arrival: stored.battery_at_arrival,
        distance_m: start.flown_m + legs.iter().map(|leg| leg.length_m).sum::<f64>(),
        energy: stored.energy,
    };
    let ends = stored.legs.iter().map(|leg| LegEnds {
        if_closed: leg.if_closed.as_ref().map(StoredEnd::read),
        safe: leg.safe.as_ref().map(StoredEnd::read),
    });
    let hold = read_stay(places, stored.hold.as_ref())?;
    Ok(FlownVersion {
        airframe: stored.airframe.clone(),
        battery_wh: stored.battery_wh,
        payload_kg: stored.payload_kg,
        ends: ends.collect(),
        reserve_used: stored.reserve_used,
        hold: hold.map(|stay| Hold {
            node: stay.node,
            pad: stay.pad,
            until_s: stay.until_s,
        }),
        alternate: read_stay(places, stored.refuge.as_ref())?,
        is_confirmed: stored.confirmed,
        is_energy_checked: !stored.energy_unchecked,
        assumed: Assumed {
            airframe: !stored.airframe_named,
            battery: !stored.battery_stated,
        },
        composition: FlightComposition {
            destination: places.node(stored.destination)?,
            objective: stored.objective,
            began_s: stored.began_s,
            deadline_s: stored.deadline_s.unwrap_or(f64::INFINITY),
            reserve: stored.reserve,
            closed_segments: Names(topology).find_segments(&stored.closed)?,
            figures: figures(legs, stored, &plan),
            plan,
            leg_costs_usd: stored.legs.iter().map(|leg| leg.cost_usd).collect(),
            contingencies: Vec::new(),
            proof: read_proof(&stored.proof),
        },
    })
}

fn read_stay(
    places: Places<'_>,
    stored: Option<&StoredStay>,
) -> Result<Option<Reservation>, StoreFault> {
    let stay = stored.map(|stay| {
        Ok(Reservation {
            node: places.node(stay.node)?,
            pad: stay.pad,
            from_s: stay.from_s.unwrap_or_default(),
            until_s: stay.until_s,
        })
    });
    stay.transpose()
}

fn flown_leg((leg, stored): (&Leg, &StoredFlownLeg)) -> FlownLeg {
    FlownLeg {
        from: leg.from,
        to: leg.to,
        segment: leg.segment,
        enters_s: leg.departure_s,
        leaves_s: leg.arrival_s,
        battery_before: stored.battery[0],
        battery_after: stored.battery[1],
    }
}

fn read_stops(places: Places<'_>, stored: &[StoredStop]) -> Result<Vec<Stop>, StoreFault> {
    let stops = stored.iter().map(|stop| {
        Ok(Stop {
            kind: stop.kind,
            before_leg: stop.before_leg,
            node: places.node(stop.node)?,
            pad: stop.pad,
            lands_s: stop.lands_s,
            takes_off_s: stop.takes_off_s,
            battery_before: stop.battery[0],
            battery_after: stop.battery[1],
            service_s: stop.service_s,
        })
    });
    stops.collect()
}

fn figures(legs: &[Leg], stored: &StoredFlight, plan: &FlightPlan) -> PlanFigures {
    let flown = legs.iter().zip(&stored.legs);
    let stops = stored.stops.iter();
    PlanFigures {
        legs: flown
            .map(|(leg, stored)| LegFigures {
                length_m: leg.length_m,
                time_s: leg.arrival_s - leg.departure_s,
                airspeed_mps: stored.speeds_mps[0],
                ground_speed_mps: stored.speeds_mps[1],
                energy_wh: stored.energy_wh,
            })
            .collect(),
        stops: stops
            .map(|stop| StopFigures {
                stay_s: stop.takes_off_s - stop.lands_s,
                charged: stop.battery[1] - stop.battery[0],
                waits_s: stop.waits_s,
            })
            .collect(),
        distance_m: plan.distance_m,
        time_s: stored.arrives_s - stored.began_s,
        energy_wh: stored.energy_wh,
        cost_usd: stored.cost_usd,
    }
}

/// What the search cost is not kept.
fn read_proof(stored: &StoredProof) -> Proof {
    let [weight, arrives_s] = stored.value;
    let unbounded = f64::NEG_INFINITY;
    let [least, earliest_s] = stored.bound.map(|bound| bound.unwrap_or(unbounded));
    Proof {
        proved: stored.proved,
        value: Value { weight, arrives_s },
        lower_bound: Value {
            weight: least,
            arrives_s: earliest_s,
        },
        reason: stored.reason,
        step: Step::Walk,
        effort: Effort::default(),
    }
}
