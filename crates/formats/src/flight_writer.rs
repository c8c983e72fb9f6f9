//! Compositions and answers with times and battery, under the names of the wire.

use crate::answer::warning_text;
use crate::delivery::{
    Alternate, DroneDeliveryService, FlightComposition, FlightEnvironment, FlightRecomposition,
    FlownDetour, LegContingency, NoDelivery, Proof, severance,
};
use crate::flight::{FlightPlan, FlownLeg, LegCourse, Stop, StopKind};
use crate::geo::AltitudeReference;
use crate::identifier::{node_id_json, segment_id_json};
use crate::itinerary::{FlightCause, FlightOpening, FlightSetting, LegFigures, StopFigures};
use crate::network::{NodeIx, Topology};
use crate::recompose::Severance;
use crate::safety::{first_stretch, near, unsafe_way, waypoint};
use serde_json::{Map, Value, json};

/// Writes answers of one state of the world for one drone.
#[derive(Clone, Copy, Debug)]
pub struct FlightWriter<'a> {
    /// The state of the world.
    pub skies: &'a FlightEnvironment,
    /// The drone.
    pub setting: &'a FlightSetting,
}

/// The name of a stay on the wire.
pub fn stop_kind_name(kind: StopKind) -> &'static str {
    match kind {
        StopKind::Start => "start",
        StopKind::Charge => "charge",
        StopKind::Swap => "swap",
    }
}

/// A cause's stable code and its text for people.
pub fn flight_cause_text(skies: &FlightEnvironment, cause: &FlightCause) -> (&'static str, String) {
    let topology: &Topology = skies.topology();
    let node = |node: NodeIx| format!("'{}'", topology.node_id(node));
    if let Some(severance) = severance(skies, cause) {
        return match severance {
            Severance::Closure(id) => ("closure", format!("closure '{id}'")),
            Severance::Report => ("report", "the failure itself".to_owned()),
            Severance::Network => ("network", "the network, which ends there".to_owned()),
        };
    }
    match cause {
        FlightCause::Unflyable {
            from, why, legs, ..
        } => {
            let text = format!(
                "wind or payload at node {}: {why} ({legs} legs)",
                node(*from)
            );
            ("unflyable", text)
        }
        FlightCause::Energy {
            from,
            missing,
            legs,
            ..
        } => {
            let percent = 100.0 * missing;
            let text = format!(
                "the battery: {percent:.1} % more would lead on from node {} ({legs} legs)",
                node(*from)
            );
            ("battery", text)
        }
        FlightCause::Pads(at) => ("pads", format!("the pads of node {}, all taken", node(*at))),
        FlightCause::Traffic(leg) => {
            let segment = topology.segment_id(leg.segment);
            ("traffic", format!("another plan on segment '{segment}'"))
        }
        FlightCause::BelowReserve => (
            "below_reserve",
            "the battery, which is below the reserve already".to_owned(),
        ),
        FlightCause::Deadline => ("deadline", "the deadline".to_owned()),
        FlightCause::Closure(_) | FlightCause::Request(_) | FlightCause::Network => {
            ("network", "the network, which ends there".to_owned())
        }
    }
}

impl FlightWriter<'_> {
    fn topology(&self) -> &Topology {
        self.skies.topology()
    }

    fn id(&self, node: NodeIx) -> Value {
        node_id_json(self.topology(), node)
    }

    fn ids(&self, nodes: &[NodeIx]) -> Vec<Value> {
        nodes.iter().map(|&node| self.id(node)).collect()
    }

    /// An instant in RFC 3339; null where there is none.
    fn time(&self, seconds: f64) -> Value {
        self.skies
            .instant(seconds)
            .map_or(Value::Null, |instant| json!(instant.to_string()))
    }

    /// The composition of a delivery.
    pub fn composition(&self, composition: &FlightComposition) -> Map<String, Value> {
        let plan = &composition.plan;
        let figures = &composition.figures;
        let legs = plan.legs.iter().zip(&figures.legs);
        let legs: Vec<Value> = legs
            .zip(&composition.leg_costs_usd)
            .zip(&composition.contingencies)
            .map(|(((leg, figures), &cost_usd), contingency)| {
                self.leg(leg, figures, cost_usd, contingency)
            })
            .collect();
        let stops = plan.stops.iter().zip(&figures.stops);
        let stops: Vec<Value> = stops
            .map(|(stop, figures)| self.stop(stop, figures))
            .collect();
        let services = composition.services(self.topology(), self.setting.payload_kg());
        let services: Vec<Value> = services.iter().map(|one| self.service(one)).collect();
        let fields = json!({
            "path": {"nodes": self.ids(&composition.nodes()), "segments": self.segments(plan)},
            "starts_at": self.time(plan.start.at_s),
            "arrives_at": self.time(plan.arrives_s),
            "deadline": self.time(composition.deadline_s),
            "objective": composition.objective.name(),
            "airframe": self.setting.airframe().name,
            "payload_kg": self.setting.payload_kg(),
            "reserve_fraction": composition.reserve,
            "battery_at_start_fraction": plan.start.battery,
            "battery_at_arrival_fraction": plan.battery_at_arrival,
            "length_m": figures.distance_m,
            "duration_s": figures.time_s,
            "energy_wh": figures.energy_wh,
            "energy_fraction": plan.energy,
            "delivery_cost_usd": figures.cost_usd,
            "times": "computed",
            "energy": "computed",
            "legs": legs,
            "stops": stops,
            "services": services,
        });
        let mut fields = into_map(fields);
        fields.extend(proof(&composition.proof, self));
        fields
    }

    fn segments(&self, plan: &FlightPlan) -> Vec<Value> {
        let legs = plan.legs.iter();
        legs.map(|leg| segment_id_json(self.topology(), leg.segment))
            .collect()
    }

    fn leg(
        &self,
        leg: &FlownLeg,
        figures: &LegFigures,
        cost_usd: f64,
        contingency: &LegContingency,
    ) -> Value {
        let course = LegCourse::of(self.topology(), leg.from, leg.to, leg.segment);
        json!({
            "from": self.id(leg.from),
            "to": self.id(leg.to),
            "segment": segment_id_json(self.topology(), leg.segment),
            "length_m": figures.length_m,
            "length_air_m": course.length_air_m,
            "geometry": self.geometry(&course),
            "height_reference": course.reference.map(AltitudeReference::name),
            "speed_limit_mps": self.topology().speed_limit_mps(leg.segment),
            "climb_m": course.climb_m,
            "departure": self.time(leg.enters_s),
            "arrival": self.time(leg.leaves_s),
            "airspeed_mps": figures.airspeed_mps,
            "ground_speed_mps": figures.ground_speed_mps,
            "battery_before_fraction": leg.battery_before,
            "battery_after_fraction": leg.battery_after,
            "energy_wh": figures.energy_wh,
            "delivery_cost_usd": cost_usd,
            "if_closed": self.detour(&contingency.if_closed),
            "alternate": contingency.safe.as_ref().map(|safe| self.alternate(safe)),
        })
    }

    /// The corners of a course, with heights where they are known.
    fn geometry(&self, course: &LegCourse) -> Value {
        let corners = course.corners.iter();
        let corners = corners.map(|one| json!(waypoint(self.topology(), one.place, one.height_m)));
        corners.collect()
    }

    fn detour(&self, detour: &FlownDetour) -> Value {
        let told = &detour.contingency;
        let flight = detour.flight.as_ref();
        let stops = flight.map(|flight| {
            let stops = flight.stops.iter();
            stops.map(|stop| self.id(stop.node)).collect::<Vec<Value>>()
        });
        json!({
            "outcome": told.outcome,
            "nodes": self.ids(&told.nodes),
            "rejoins": told.rejoins.map(|node| self.id(node)),
            "remaining_length_m": told.remaining_length_m,
            "extra_m": told.extra_m,
            "arrives_at": flight.map(|flight| self.time(flight.arrives_s)),
            "battery_at_arrival_fraction": flight.map(|flight| flight.battery_at_arrival),
            "stops": stops,
            "reserve_used": detour.reserve_used,
        })
    }

    fn alternate(&self, alternate: &Alternate) -> Value {
        json!({
            "node": self.id(alternate.safe.node),
            "nodes": self.ids(&alternate.safe.nodes),
            "length_m": alternate.safe.length_m,
            "arrives_at": self.time(alternate.flight.arrives_s),
            "battery_at_arrival_fraction": alternate.flight.battery_at_arrival,
            "reserve_used": alternate.reserve_used,
        })
    }

    fn stop(&self, stop: &Stop, figures: &StopFigures) -> Value {
        json!({
            "kind": stop_kind_name(stop.kind),
            "node": self.id(stop.node),
            "pad": stop.pad,
            "before_leg": stop.before_leg,
            "from": self.time(stop.lands_s),
            "until": self.time(stop.takes_off_s),
            "duration_s": figures.stay_s,
            "waits_s": figures.waits_s,
            "battery_before_fraction": stop.battery_before,
            "battery_after_fraction": stop.battery_after,
            "charged_wh": figures.charged * self.setting.airframe().battery_wh,
        })
    }

    fn service(&self, service: &DroneDeliveryService) -> Value {
        let quality = &service.quality;
        json!({
            "id": service.id,
            "from": self.id(service.from),
            "to": self.id(service.to),
            "starts_at": self.time(service.starts_s),
            "ends_at": self.time(service.ends_s),
            "quality": {
                "length_m": quality.length_m,
                "flight_time_s": quality.flight_time_s,
                "battery_fraction": quality.battery_fraction,
                "payload_kg": quality.payload_kg,
                "delivery_cost_usd": quality.cost_usd,
            },
        })
    }

    fn causes(&self, causes: &[FlightCause]) -> Vec<Value> {
        let causes = causes.iter().map(|cause| {
            let (code, message) = flight_cause_text(self.skies, cause);
            let mut fields = into_map(json!({"code": code, "message": message}));
            if let Some(Severance::Closure(id)) = severance(self.skies, cause) {
                fields.insert("id".to_owned(), json!(id));
            }
            Value::Object(fields)
        });
        let mut causes: Vec<Value> = causes.collect();
        // Two windows of a zone are one cause.
        causes.dedup();
        causes
    }

    fn opens(&self, opens: Option<FlightOpening>) -> Value {
        opens.map_or(Value::Null, |opens| {
            json!({"leaves_at": self.time(opens.leaves_s), "arrives_at": self.time(opens.arrives_s)})
        })
    }

    /// A delivery that cannot be composed.
    pub fn no_delivery(&self, refused: &NoDelivery) -> Map<String, Value> {
        into_map(json!({
            "outcome": "no_route",
            "deadline": self.time(refused.deadline_s),
            "causes": self.causes(&refused.causes),
            "opens": self.opens(refused.opens),
            "proved": refused.proved,
        }))
    }

    /// What a drone in flight is told.
    pub fn recomposition(&self, answer: &FlightRecomposition) -> Map<String, Value> {
        let warnings: Vec<Value> = answer
            .warnings
            .iter()
            .map(|warning| {
                let (code, message) = warning_text(self.topology(), warning);
                json!({"code": code, "message": message})
            })
            .collect();
        let hold = answer.hold.map(|hold| {
            let until = self.time(hold.until_s);
            json!({"node": self.id(hold.node), "pad": hold.pad, "until": until})
        });
        let fallback = answer.fallback.as_ref().map(ToString::to_string);
        let plan = answer.composition.as_ref();
        let reentry = plan.and_then(|plan| plan.plan.start.reentry());
        let fields = json!({
            "outcome": answer.outcome,
            "battery_fraction": answer.battery,
            "first_stretch_m": answer.first_stretch_m,
            "first_stretch": reentry.map(|reentry| first_stretch(self.topology(), &reentry)),
            "flags": answer.flags.iter().map(|flag| flag.name()).collect::<Vec<_>>(),
            "unsafe_way": answer.unsafe_way.as_ref().map(|way| unsafe_way(self.topology(), way)),
            "near": answer.near.iter().map(|one| near(self.topology(), one)).collect::<Vec<_>>(),
            "remaining_length_m": plan.map(|plan| plan.plan.distance_m),
            "hold": hold,
            "reserve_used": answer.reserve_used,
            "causes": self.causes(&answer.causes),
            "opens": self.opens(answer.opens),
            "strategy": answer.strategy,
            "strategy_used": answer.strategy_used,
            "fallback_reason": fallback,
            "stage": answer.stage,
            "energy": match answer.is_energy_checked {
                true => "checked",
                false => "unchecked",
            },
            "unflyable_stages": answer.unflyable_stages,
            "warnings": warnings,
            "plan": plan.map(|plan| self.composition(plan)),
        });
        let mut fields = into_map(fields);
        fields.extend(proof(&answer.proof, self));
        fields
    }
}

fn proof(proof: &Proof, writer: &FlightWriter<'_>) -> Map<String, Value> {
    let weight = proof.lower_bound.weight;
    into_map(json!({
        "proved": proof.proved,
        "lower_bound": {
            "weight": weight.is_finite().then_some(weight),
            "arrives_at": writer.time(proof.lower_bound.arrives_s),
        },
        "reason": proof.reason.map(crate::itinerary::Unproved::name),
        "search": {
            "labels": proof.effort.labels,
            "checks": proof.effort.checks,
            "walks": proof.effort.walks,
        },
    }))
}

fn into_map(value: Value) -> Map<String, Value> {
    match value {
        Value::Object(fields) => fields,
        _ => Map::new(),
    }
}
