//! Deliveries that are flown: what is asked for, read strictly, and the plan that comes of it.

use super::{DroneKind, Flights, FlownVersion, Told};
use crate::compose::Composition;
use crate::delivery::{DeliveryRequest, compose};
use crate::edge::planner::Own;
use crate::edge::snapshot::Snapshot;
use crate::intake::Faults;
use crate::itinerary::Objective;
use crate::network::NodeIx;
use crate::refusal::Refusal;
use crate::wire;
use jiff::Timestamp;
use std::sync::Arc;

/// What was asked for of a plan's flight.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::edge) struct FlightOrder {
    /// The airframe's name.
    pub(in crate::edge) airframe: Arc<str>,
    /// What is made least.
    pub(in crate::edge) objective: Objective,
    /// The latest landing, where one was stated.
    pub(in crate::edge) deadline: Option<Timestamp>,
}

/// A flight that is wanted: from where a drone stands.
#[derive(Clone, Copy, Debug)]
pub(in crate::edge) struct Wanted<'a> {
    pub(in crate::edge) source: NodeIx,
    pub(in crate::edge) destination: NodeIx,
    pub(in crate::edge) start: Timestamp,
    /// What its drone has already.
    pub(in crate::edge) own: Own<'a>,
    /// Full where nobody knows.
    pub(in crate::edge) battery: Option<f64>,
    /// Whether nothing that was worked out before counts.
    pub(in crate::edge) plainly: bool,
}

impl Flights {
    /// Reads what a delivery request asks for of its flight, and with how much battery it starts.
    pub(in crate::edge) fn read_order(
        &self,
        request: &wire::DeliveryRequest,
        start: Timestamp,
        faults: &mut Faults,
    ) -> Option<FlightOrder> {
        let named = request.airframe.as_deref();
        let airframe = self.airframe(named, None);
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
        if let Some(deadline) = deadline.filter(|deadline| *deadline <= start) {
            let message = format!("the deadline {deadline} is not after the start {start}");
            faults.add("deadline_before_start", "/deadline", message, None);
        }
        Some(FlightOrder {
            airframe: Arc::from(airframe?.name.as_str()),
            objective: objective?,
            deadline,
        })
    }

    /// The names of all airframes that may be named.
    pub(super) fn airframe_names(&self) -> String {
        let all = std::iter::once(&self.settings.airframe).chain(&self.settings.airframes);
        let names: Vec<&str> = all.map(|airframe| airframe.name.as_str()).collect();
        names.join(", ")
    }

    /// Composes a delivery among the plans of a snapshot.
    ///
    /// # Errors
    /// When there is no plan: every cause.
    pub(in crate::edge) fn compose(
        &self,
        snapshot: &Snapshot,
        kind: &DroneKind,
        order: &FlightOrder,
        wanted: Wanted<'_>,
        now: Timestamp,
    ) -> Result<(FlownVersion, Composition), Refusal> {
        let ground = self.ground(snapshot, &snapshot.airspace, kind, wanted.own, now);
        let ground = if wanted.plainly {
            ground.without_tables()
        } else {
            ground
        };
        let topology = snapshot.topology();
        let request = DeliveryRequest {
            source: wanted.source,
            destination: wanted.destination,
            start_s: self.seconds(wanted.start),
            battery: wanted.battery.unwrap_or(kind.airframe.full_charge),
            objective: order.objective,
            deadline_s: order.deadline.map(|deadline| self.seconds(deadline)),
        };
        let composed = self.with_scratch(topology, |scratch| {
            compose(&ground.world(), &request, scratch)
        });
        let composition = composed.map_err(|no_delivery| {
            let ends = [wanted.source, wanted.destination].map(|node| topology.node_id(node));
            ground.refusal(&no_delivery, ends, &snapshot.revision)
        })?;
        let told = Told::default();
        Ok(FlownVersion::of(&ground, &composition, told, wanted.start))
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
