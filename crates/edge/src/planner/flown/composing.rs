//! Deliveries that are flown: what is asked for, read strictly, and the plan that comes of it.

use super::assumed::Assumed;
use super::kept::Told;
use super::known::SEEN_WITHIN;
use super::terms::{DroneKind, FlightOrder, FlightTerms};
use super::{Budget, Flights, FlownVersion};
use crate::planner::{Course, Scene, Stated, Wanted};
use crate::plans::stops::{with_end, without_end};
use skyway_contract as wire;
use skyway_engine::delivery::{DeliveryRequest, Lands, compose_with_stops};
use skyway_engine::itinerary::Objective;
use skyway_service::intake::Faults;
use skyway_service::refusal::Refusal;
use std::sync::Arc;

impl Flights {
    /// Reads what a delivery request asks for of its flight.
    pub(super) fn read_terms(
        &self,
        request: &wire::DeliveryRequest,
        stated: &Stated,
        faults: &mut Faults,
    ) -> Option<FlightTerms> {
        let battery = faults.fraction("/battery_fraction", request.battery_fraction);
        let named = request.airframe.as_deref();
        let airframe = self.airframe(named, request.airspeed_mps);
        if airframe.is_none() {
            let message = format!("no airframe is called '{}'", named.unwrap_or_default());
            let hint = format!("there are: {}", self.airframe_names());
            faults.add("unknown_airframe", "/airframe", message, Some(hint));
        }
        let objective = match request.objective.as_deref() {
            None => Some(self.settings.objective),
            Some(name) => objective_of(name, faults),
        };
        let deadline = faults.instant("/deadline", request.deadline.as_deref());
        if let Some(deadline) = deadline.filter(|deadline| *deadline <= stated.start) {
            let message = format!(
                "the deadline {deadline} is not after the start {}",
                stated.start
            );
            faults.add("deadline_before_start", "/deadline", message, None);
        }
        let airframe = airframe?;
        let seen = stated.seen_battery;
        let is_seen_lately =
            seen.is_some_and(|(_, at)| stated.now.duration_since(at) <= SEEN_WITHIN);
        Some(FlightTerms {
            order: FlightOrder {
                airframe: Arc::from(airframe.name.as_str()),
                is_airframe_named: named.is_some(),
                objective: objective?,
                deadline,
            },
            kind: DroneKind::new(airframe, stated.payload_kg),
            battery: battery.or(seen.map(|(battery, _)| battery)),
            assumed: Assumed {
                airframe: named.is_none(),
                battery: battery.is_none() && !is_seen_lately,
            },
        })
    }

    /// The names of all airframes that may be named.
    pub(super) fn airframe_names(&self) -> String {
        let all = std::iter::once(&self.settings.airframe).chain(&self.settings.airframes);
        let names: Vec<&str> = all.map(|airframe| airframe.name.as_str()).collect();
        names.join(", ")
    }

    /// Composes a delivery among the plans of a scene.
    ///
    /// # Errors
    /// When there is no plan: every cause.
    pub(super) fn compose(
        &self,
        scene: Scene<'_>,
        wanted: &Wanted<'_>,
        terms: &FlightTerms,
    ) -> Result<Course, Refusal> {
        let FlightTerms {
            order,
            kind,
            battery,
            assumed,
        } = terms;
        let own = scene.traffic.own(None, wanted.drone_id);
        let stays = scene.traffic.stays_at(wanted.source).iter();
        let mut stands = stays.filter(|stay| own.landed == Some(&*stay.plan));
        let pad = stands.next().map(|stay| stay.pad);
        let budget = Budget::Request(order.objective);
        let ground = self.ground(scene, kind, own, budget);
        let ground = if wanted.plainly {
            ground.without_tables()
        } else {
            ground
        };
        let topology = scene.topology();
        let departs_at = wanted.terms.departs_at;
        let start_s = self.seconds(departs_at);
        let (lands, destination) = match wanted.destination {
            Some(destination) => (Lands::AtDestination, destination),
            None => (Lands::OnNearestPad, wanted.source),
        };
        let request = DeliveryRequest {
            source: wanted.source,
            pad,
            destination,
            start_s,
            began_s: start_s,
            battery: battery.unwrap_or(kind.airframe.full_charge),
            objective: order.objective,
            deadline_s: order.deadline.map(|deadline| self.seconds(deadline)),
        };
        let composed = self.with_scratch(topology, |scratch| {
            compose_with_stops(&ground.world(), &request, (wanted.stops, lands), scratch)
        });
        let composed = composed.map_err(|no_delivery| {
            let stops = wanted.stops.iter().map(|stop| stop.node);
            let way = std::iter::once(wanted.source).chain(stops);
            let way = way.chain([destination]).map(|node| topology.node_id(node));
            ground.refusal(&no_delivery, &way.collect::<Vec<_>>(), scene.revision)
        })?;
        let (flown, composition) =
            FlownVersion::of(&ground, &composed, Told::of_plan(*assumed), departs_at);
        Ok(Course {
            composition,
            flight: Some(Arc::new(flown)),
            departs_at,
            stretch: None,
            stops: without_end(&with_end(wanted.stops, composed.destination)),
        })
    }
}

/// The objective of a name.
fn objective_of(name: &str, faults: &mut Faults) -> Option<Objective> {
    let found = Objective::ALL.into_iter().find(|one| one.name() == name);
    if found.is_none() {
        let message = format!("the objective '{name}' is not known");
        let hint = "distance, time and energy are".to_owned();
        faults.add("unknown_objective", "/objective", message, Some(hint));
    }
    found
}
