//! Edges with the flight model on, and the checker that flies what they tell.

use crate::stage::{Stage, loaded, node, segment};
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway::edge::{FlightSettings, Idempotency, Refusal, Settings};
use skyway::flight::{
    Airframe, FlightPlan, FlightRules, FlightStart, FlownLeg, Reservation, Situation, Stop,
    StopKind, TrafficLeg, Wind,
};
use skyway::formats::{load_network, wind_field};
use skyway::itinerary::timed_closures;
use skyway::network::{Coordinates, NetworkDraft, NodeIx, Topology, bundled};
use skyway::verify::{FlightFault, FlightPremises, verify_flight};
use skyway::wire;
use std::sync::Arc;

pub(crate) fn settings() -> Settings {
    Settings {
        closed_fraction_max: 0.2,
        flight: Some(FlightSettings::of(Airframe::phantom3())),
        ..Settings::default()
    }
}

/// On the corridor from San Marcos to San Antonio, which takes several charges.
pub(crate) fn corridor() -> Stage {
    let topology = load_network(bundled::CORRIDOR).expect("a network").topology;
    Stage::on(Arc::new(topology), bundled::CORRIDOR.into(), settings())
}

/// A street of rooftops one kilometre apart, each with a number of pads.
pub(crate) fn street(pads: &[u16]) -> NetworkDraft {
    let places = pads.iter().zip(0..);
    let nodes = places.map(|(&pads, place)| {
        let mut rooftop = node(&format!("s{place}"), 1_000.0 * f64::from(place), 0.0);
        rooftop.pads = pads;
        rooftop
    });
    let joined =
        (1..pads.len()).map(|place| segment(format!("s{}", place - 1), format!("s{place}")));
    NetworkDraft {
        nodes: nodes.collect(),
        segments: joined.collect(),
        coordinates: Coordinates::Planar,
        name: "street".to_owned(),
        ..NetworkDraft::default()
    }
}

pub(crate) fn on(draft: &NetworkDraft) -> Stage {
    on_with(draft, settings())
}

pub(crate) fn on_with(draft: &NetworkDraft, settings: Settings) -> Stage {
    let network = loaded(draft);
    Stage::on(network.topology, network.geojson, settings)
}

impl Stage {
    /// Asks for a delivery, by a drone of its own where none is named.
    pub(crate) async fn deliver(&self, request: Value) -> Result<wire::Plan<'static>, Refusal> {
        let mut request: wire::DeliveryRequest =
            serde_json::from_value(request).expect("a delivery request");
        if request.drone_id.is_none() {
            let plan = request.id.as_deref().unwrap_or("unnamed");
            request.drone_id = Some(format!("drone-{plan}"));
        }
        let asked = self
            .edge
            .compose_plan(&self.caller, request, Idempotency::default());
        let plan = asked.await?;
        // Contingencies come after the answer.
        self.settle().await;
        Ok(self.plan(&plan.id))
    }

    /// The checker flies the current version of a plan that began on the ground, among the current versions of others.
    pub(crate) fn check(
        &self,
        plan: &wire::Plan<'_>,
        others: &[&wire::Plan<'_>],
    ) -> Result<(), FlightFault> {
        let others: Vec<&wire::PlanVersion<'_>> =
            others.iter().map(|plan| &plan.reported).collect();
        self.check_version(plan, &plan.reported, &others)
    }

    /// The same of any version; one that was proposed in flight begins in the air.
    pub(crate) fn check_version(
        &self,
        plan: &wire::Plan<'_>,
        version: &wire::PlanVersion<'_>,
        others: &[&wire::PlanVersion<'_>],
    ) -> Result<(), FlightFault> {
        let snapshot = self.edge.snapshot();
        let topology = snapshot.topology();
        let zero = instant(&version.departs_at);
        let closures = snapshot.airspace().closures();
        let closures = closures.flat_map(|(closure, _)| timed_closures(closure, zero));
        let mut situation = Situation {
            closures: closures.collect(),
            ..Situation::default()
        };
        for other in others {
            let flown = plan_of(topology, other, zero);
            situation
                .reservations
                .extend(flown.stops.iter().map(|stop| Reservation {
                    node: stop.node,
                    pad: stop.pad,
                    from_s: stop.lands_s,
                    until_s: stop.takes_off_s,
                }));
            situation
                .traffic
                .extend(flown.legs.iter().map(|leg| TrafficLeg {
                    segment: leg.segment,
                    from: leg.from,
                    enters_s: leg.enters_s,
                    leaves_s: leg.leaves_s,
                }));
        }
        let flight = version.flight.as_ref().expect("a flight");
        let deadline = plan.deadline.as_deref().map(instant);
        let leads_to = version.path.nodes.last().expect("a node");
        let start = start_of(topology, version);
        let weather = self.edge.weather(&self.caller);
        let weather = wire::Weather { wind: weather.wind };
        let weather = serde_json::to_string(&weather).expect("JSON");
        let wind = wind_field(Some(&weather), Wind::default(), topology.frame(), zero);
        let rules = FlightRules::default();
        let airframe = Airframe::phantom3();
        verify_flight(
            &plan_of(topology, version, zero),
            &FlightPremises {
                topology,
                airframe: &airframe,
                payload_kg: plan.payload_kg,
                wind: &wind,
                rules: &rules,
                situation: &situation,
                starts: &[start],
                destination: find(topology, leads_to),
                began_s: 0.0,
                deadline_s: deadline.map_or(9_000.0, |deadline| seconds(zero, deadline)),
                reserve: flight.reserve_fraction,
                closed_segments: &[],
            },
        )
    }
}

fn find(topology: &Topology, id: &wire::Id<'_>) -> NodeIx {
    topology.node(id.text()).expect("a node of the network")
}

pub(crate) fn instant(text: &str) -> Timestamp {
    text.parse().expect("an instant")
}

pub(crate) fn seconds(zero: Timestamp, instant: Timestamp) -> f64 {
    instant.duration_since(zero).as_secs_f64()
}

/// Where a version begins that begins on the ground, in seconds from its departure.
fn start_of(topology: &Topology, version: &wire::PlanVersion<'_>) -> FlightStart {
    let flight = version.flight.as_ref().expect("a flight");
    FlightStart {
        node: find(topology, &version.path.nodes[0]),
        at_s: 0.0,
        battery: flight.battery_at_departure_fraction,
        on_ground: true,
        pad: None,
        flown_m: 0.0,
        drawn: 0.0,
        stretch: None,
    }
}

/// A version as it is told, in seconds from an instant.
fn plan_of(topology: &Topology, version: &wire::PlanVersion<'_>, zero: Timestamp) -> FlightPlan {
    let time_s = |text: &str| seconds(zero, instant(text));
    let flight = version.flight.as_ref().expect("a flight");
    let legs = version.legs.iter().map(|leg| {
        let flown = leg.flight.as_ref().expect("how it is flown");
        FlownLeg {
            from: find(topology, &leg.from),
            to: find(topology, &leg.to),
            segment: topology.find_segment(&leg.segment).expect("a segment"),
            enters_s: time_s(&leg.departs_at),
            leaves_s: time_s(&leg.arrives_at),
            battery_before: flown.battery_before_fraction,
            battery_after: flown.battery_after_fraction,
        }
    });
    let stops = flight.stops.iter().map(|stop| Stop {
        kind: match stop.kind {
            wire::StopKind::Start => StopKind::Start,
            wire::StopKind::Charge => StopKind::Charge,
            wire::StopKind::Swap => StopKind::Swap,
        },
        before_leg: stop.before_leg as usize,
        node: find(topology, &stop.node),
        pad: stop.pad,
        lands_s: time_s(&stop.lands_at),
        takes_off_s: time_s(&stop.takes_off_at),
        battery_before: stop.battery_before_fraction,
        battery_after: stop.battery_after_fraction,
        service_s: stop.service_s,
    });
    FlightPlan {
        start: start_of(topology, version),
        legs: legs.collect(),
        stops: stops.collect(),
        arrives_s: time_s(&version.arrives_at),
        battery_at_arrival: flight.battery_at_arrival_fraction,
        distance_m: version.length_m,
        energy: flight.energy_wh / Airframe::phantom3().battery_wh,
    }
}

/// The stops of a version: where, on which pad, from when until when.
pub(crate) fn stops<'a>(
    version: &'a wire::PlanVersion<'_>,
) -> Vec<(String, u16, &'a str, &'a str)> {
    let flight = version.flight.as_ref().expect("a flight");
    let stops = flight.stops.iter();
    stops
        .map(|stop| {
            (
                stop.node.to_string(),
                stop.pad,
                &*stop.lands_at,
                &*stop.takes_off_at,
            )
        })
        .collect()
}

/// An hour and minute of the day of all stories.
pub(crate) fn at(time: &str) -> Timestamp {
    instant(&format!("2026-11-21T{time}:00Z"))
}

impl Stage {
    /// Lets it be this time of the day.
    pub(crate) async fn wait_until(&self, time: &str) {
        let span: SignedDuration = at(time).duration_since(self.edge.clock().now());
        self.pass(span).await;
    }
}

/// A round zone with a window.
pub(crate) fn windowed(mut zone: Value, from: &str, until: &str) -> Value {
    zone["properties"]["windows"] =
        json!([{"from": at(from).to_string(), "until": at(until).to_string()}]);
    zone
}
