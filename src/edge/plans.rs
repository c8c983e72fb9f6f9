//! Composition plans: composed, listed, taken over, cancelled.

use super::Edge;
use super::failures::DEFAULT_AIRSPEED_MPS;
use super::orders::{Done, Order};
use super::plan_entry::{PlanEntry, PlanFlags};
use super::planner::{DroneKind, FlightOrder, Flights, FlownVersion, Version, Wanted};
use super::replies::Idempotency;
use super::reporter::may_speak_for;
use super::snapshot::Snapshot;
use super::views;
use super::zones::unexpected;
use crate::access::Caller;
use crate::checked::{Case, FallenBackTo};
use crate::compose::{Composition, compose};
use crate::intake::Faults;
use crate::intake::{PageRequest, filtered, token};
use crate::network::NodeIx;
use crate::recompose::{Outcome, World};
use crate::refusal::{Code, Refusal};
use crate::wire::{self, PlanState};
use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// How far ahead a plan may start.
const START_AHEAD_MAX: SignedDuration = SignedDuration::from_hours(24 * 7);
/// How long ago a plan may have started: clocks differ a little.
const START_BEFORE_MAX: SignedDuration = SignedDuration::from_mins(5);
/// The heaviest payload, in kilograms; more is a slip of units.
const PAYLOAD_MAX_KG: f64 = 100.0;
/// The fastest airspeed, in metres per second.
const AIRSPEED_MAX_MPS: f64 = 100.0;
/// How long a quote holds.
const QUOTED_FOR: SignedDuration = SignedDuration::from_mins(5);
/// How often a plan is composed anew as the network, or other plans, change under it.
const ATTEMPTS: usize = 8;

/// Which plans are asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PlanFilter {
    /// Those affected by this closure.
    pub affected_by: Option<String>,
    /// Those of this drone.
    pub drone_id: Option<String>,
    /// Those in this state.
    pub state: Option<PlanState>,
    /// Those that are over, or are not.
    pub ended: Option<bool>,
}

impl PlanFilter {
    fn passes(&self, snapshot: &Snapshot, plan: &PlanEntry) -> bool {
        let closure = self.affected_by.as_ref();
        let drone = self.drone_id.as_deref();
        closure.is_none_or(|id| snapshot.affecting(plan).any(|cause| cause == id))
            && drone.is_none_or(|id| plan.drone_id.as_deref() == Some(id))
            && self.state.is_none_or(|state| plan.state == state)
            && self.ended.is_none_or(|ended| ended != plan.is_active())
    }
}

/// How many of the plans that a caller may see are in each state.
fn counted(snapshot: &Snapshot, caller: &Caller) -> wire::PlanCounts {
    let mut counts = wire::PlanCounts::default();
    let plans = snapshot.plans.values();
    for plan in plans.filter(|plan| may_speak_for(caller, plan)) {
        let count = match plan.state {
            PlanState::Accepted => &mut counts.accepted,
            PlanState::Activated => &mut counts.activated,
            PlanState::Nonconforming => &mut counts.nonconforming,
            PlanState::Contingent => &mut counts.contingent,
            PlanState::Ended => &mut counts.ended,
        };
        *count += 1;
    }
    counts
}

/// A delivery request that has been read.
struct Delivery {
    id: Option<String>,
    source: NodeIx,
    destination: NodeIx,
    start: Timestamp,
    payload_kg: f64,
    airspeed_mps: f64,
    drone_id: Option<Arc<str>>,
    /// How it is to be flown, with the flight model.
    flight: Option<DeliveryFlight>,
}

/// How a delivery is to be flown.
struct DeliveryFlight {
    order: FlightOrder,
    kind: DroneKind,
    battery: Option<f64>,
}

impl Edge {
    /// Composes a plan: the shortest open way, each leg with its contingencies; with the flight model the best one that the
    /// drone can fly among all others, with the stops that it takes.
    ///
    /// # Errors
    /// When the request is not valid, there is no open way, or the drone flies another plan.
    pub async fn compose_plan(
        self: &Arc<Self>,
        caller: &Caller,
        request: wire::DeliveryRequest,
        idempotency: Idempotency,
    ) -> Result<wire::Plan<'static>, Refusal> {
        let composed = async {
            for _ in 0..ATTEMPTS {
                let on = self.on_network()?;
                let topology = on.topology().clone();
                let delivery = self.read_delivery(&on, caller, &request)?;
                let (edge, subject) = (self.clone(), caller.subject.clone());
                let composed = self.aside(move || edge.compose(&on, delivery, subject));
                let order = Order::AddPlan(Box::new(composed.await??));
                let (outcome, snapshot) = self.order(order.made_on(&topology).by(caller)).await?;
                match outcome.done {
                    // The network has changed under it, or another plan has come between.
                    Done::Outdated => {}
                    done => return self.told(done, &snapshot),
                }
            }
            let detail = "the network or other plans change faster than a plan is composed";
            Err(Refusal::new(Code::Overloaded, detail).retry_after_s(1))
        };
        let now = self.clock.now();
        self.write_replies
            .once(&caller.subject, "compose_plan", idempotency, now, composed)
            .await
    }

    /// A page of plans, by id, as far as the caller may see them.
    ///
    /// # Errors
    /// When the page is not one.
    pub fn plans(
        &self,
        caller: &Caller,
        page: &PageRequest,
        filter: &PlanFilter,
    ) -> Result<wire::Plans<'static>, Refusal> {
        let page = page.check()?;
        let snapshot = self.snapshot();
        let passes =
            |plan: &Arc<PlanEntry>| filter.passes(&snapshot, plan) && may_speak_for(caller, plan);
        let (told, next) = filtered(&snapshot.plans, &page, passes);
        let stamp = self.stamp_of(&snapshot);
        let plans = told
            .iter()
            .map(|plan| views::plan(&snapshot, plan, &self.settings, stamp.clone()));
        Ok(wire::Plans {
            plans: plans.collect(),
            next_page_token: next.map(|id| token(&id)),
            counts: counted(&snapshot, caller),
            stamp: stamp.clone(),
        })
    }

    /// A plan.
    ///
    /// # Errors
    /// When there is none that the caller may see.
    pub fn plan(&self, caller: &Caller, id: &str) -> Result<wire::Plan<'static>, Refusal> {
        let snapshot = self.snapshot();
        let plan = own_plan(&snapshot, caller, id)?;
        Ok(views::plan(
            &snapshot,
            &plan,
            &self.settings,
            self.stamp_of(&snapshot),
        ))
    }

    pub(super) fn told(
        &self,
        done: Done,
        snapshot: &Snapshot,
    ) -> Result<wire::Plan<'static>, Refusal> {
        match done {
            Done::Plan(plan) => Ok(views::plan(
                snapshot,
                &plan,
                &self.settings,
                self.stamp_of(snapshot),
            )),
            _ => Err(unexpected()),
        }
    }

    fn read_delivery(
        &self,
        snapshot: &Snapshot,
        caller: &Caller,
        request: &wire::DeliveryRequest,
    ) -> Result<Delivery, Refusal> {
        let topology = snapshot.topology();
        let now = self.clock.now();
        let mut faults = Faults::default();
        faults.id("/id", request.id.as_deref());
        faults.id("/drone_id", request.drone_id.as_deref());
        let source = faults.node("/source", topology, &request.source);
        let destination = faults.node("/destination", topology, &request.destination);
        let start = faults
            .instant("/start_time", request.start_time.as_deref())
            .unwrap_or(now);
        check_start(start, now, &mut faults);
        let payload_kg = faults.number("/payload_kg", request.payload_kg, 0.0, PAYLOAD_MAX_KG);
        let payload_kg = payload_kg.unwrap_or(0.0);
        let speed = request.airspeed_mps;
        let airspeed_mps = faults.number("/airspeed_mps", speed, 0.1, AIRSPEED_MAX_MPS);
        let flight = match self.flights.as_deref() {
            Some(flights) => self.read_flight(flights, request, (start, payload_kg), &mut faults),
            None => {
                refuse_flight(request, &mut faults);
                None
            }
        };
        faults.check(Code::PlanInvalid, "delivery request")?;
        if let Some(drone) = request
            .drone_id
            .as_deref()
            .filter(|drone| !caller.speaks_for(drone))
        {
            let detail = format!(
                "'{}' may not compose plans for drone '{drone}'",
                caller.subject
            );
            return Err(Refusal::new(Code::Forbidden, detail));
        }
        let (Some(source), Some(destination)) = (source, destination) else {
            return Err(unexpected());
        };
        let cruises_mps = flight
            .as_ref()
            .map(|flight| flight.kind.airframe.airspeed_mps);
        Ok(Delivery {
            id: request.id.clone(),
            source,
            destination,
            // Nobody flies in the past, however clocks differ.
            start: match flight {
                Some(_) => start.max(now),
                None => start,
            },
            payload_kg,
            airspeed_mps: cruises_mps.or(airspeed_mps).unwrap_or(DEFAULT_AIRSPEED_MPS),
            drone_id: request.drone_id.as_deref().map(Arc::from),
            flight,
        })
    }

    fn read_flight(
        &self,
        flights: &Flights,
        request: &wire::DeliveryRequest,
        (start, payload_kg): (Timestamp, f64),
        faults: &mut Faults,
    ) -> Option<DeliveryFlight> {
        let stated = faults.fraction("/battery_fraction", request.battery_fraction);
        let seen = request.drone_id.as_deref();
        let seen = seen.and_then(|drone| self.drones.last(drone)?.battery_fraction);
        let order = flights.read_order(request, start, faults)?;
        let airframe = flights.airframe(Some(&order.airframe), request.airspeed_mps)?;
        Some(DeliveryFlight {
            order,
            kind: DroneKind::new(airframe, payload_kg),
            battery: stated.or(seen),
        })
    }

    fn compose(
        &self,
        snapshot: &Snapshot,
        delivery: Delivery,
        subject: Arc<str>,
    ) -> Result<PlanEntry, Refusal> {
        let (composition, flown) = self.composed_and_checked(snapshot, &delivery)?;
        let number = self.next_number.fetch_add(1, Ordering::Relaxed);
        let now = self.clock.now();
        let is_quote = delivery.drone_id.is_none();
        let expires_at = is_quote.then(|| now.saturating_add(QUOTED_FOR).unwrap_or(now));
        let id = delivery
            .id
            .unwrap_or_else(|| format!("plan-{}-{number}", self.epoch));
        let version = Version {
            number: 1,
            epoch: self.epoch,
            sent_at: now,
            outcome: None,
            composition,
            flight: flown,
            stretch: None,
            first_stretch_m: 0.0,
            departs_at: delivery.start,
            recomposition_id: None,
            acknowledge_by: None,
            flags: Vec::new(),
            warnings: Vec::new(),
        };
        Ok(PlanEntry {
            id: Arc::from(id),
            subject,
            drone_id: delivery.drone_id,
            source: delivery.source,
            destination: delivery.destination,
            payload_kg: delivery.payload_kg,
            airspeed_mps: delivery.airspeed_mps,
            order: delivery.flight.map(|flight| flight.order),
            state: PlanState::Accepted,
            ended_as: None,
            flags: PlanFlags::default(),
            reported: Arc::new(version),
            wanted: None,
            sent: Vec::new(),
            holds: false,
            landed_on: None,
            expires_at,
            declined: 0,
            affected_by: Vec::new(),
            next_version: Arc::new(AtomicU32::new(2)),
        })
    }

    /// What is composed, once it has passed the checker: at the second try without anything that was worked out before.
    fn composed_and_checked(
        &self,
        snapshot: &Snapshot,
        delivery: &Delivery,
    ) -> Result<(Composition, Option<Arc<FlownVersion>>), Refusal> {
        let kind = delivery.flight.as_ref().map(|flight| &flight.kind);
        let drone = (kind, snapshot.own_of_drone(delivery.drone_id.as_deref()));
        let start = (delivery.start, delivery.destination);
        let first = self.composed(snapshot, delivery, false)?;
        let Err(fault) = self.check_composed(snapshot, &first, start, drone) else {
            return Ok(first);
        };
        let again = self.composed(snapshot, delivery, true);
        let again = again.ok().filter(|again| {
            let checked = self.check_composed(snapshot, again, start, drone);
            checked.is_ok()
        });
        let fallback = match again {
            Some(_) => FallenBackTo::Baseline,
            None => FallenBackTo::Refusal,
        };
        let case = Case {
            fault,
            outcome: Outcome::Rerouted,
            nodes: first.0.way.nodes,
            fallback,
        };
        let now = self.clock.now();
        self.tell_case(snapshot, &case, (None, None, None), now);
        again.ok_or_else(|| {
            let fault = fault.text(snapshot.topology());
            let detail = format!("no plan passed the check before it leaves: {fault}");
            Refusal::new(Code::Internal, detail)
        })
    }

    fn composed(
        &self,
        snapshot: &Snapshot,
        delivery: &Delivery,
        plainly: bool,
    ) -> Result<(Composition, Option<Arc<FlownVersion>>), Refusal> {
        let (Some(flight), Some(flights)) = (&delivery.flight, self.flights.as_deref()) else {
            let way = self.shortest_composition(snapshot, delivery, plainly)?;
            return Ok((way, None));
        };
        let DeliveryFlight {
            order,
            kind,
            battery,
        } = flight;
        let wanted = Wanted {
            source: delivery.source,
            destination: delivery.destination,
            start: delivery.start,
            own: snapshot.own_of_drone(delivery.drone_id.as_deref()),
            battery: *battery,
            plainly,
        };
        let now = self.clock.now();
        let (flown, way) = flights.compose(snapshot, kind, order, wanted, now)?;
        Ok((way, Some(Arc::new(flown))))
    }

    /// The shortest open way, whatever the battery.
    fn shortest_composition(
        &self,
        snapshot: &Snapshot,
        delivery: &Delivery,
        plainly: bool,
    ) -> Result<Composition, Refusal> {
        let topology = snapshot.topology();
        let world = World {
            airspace: &snapshot.airspace,
            trees: (!plainly).then_some(&self.trees),
        };
        let (source, destination) = (delivery.source, delivery.destination);
        let mut scratch = self.scratches.take(topology);
        let airspeed_mps = delivery.airspeed_mps;
        let composition = compose(&world, source, destination, airspeed_mps, &mut scratch);
        self.scratches.give_back(scratch);
        composition.ok_or_else(|| {
            let [from, to] = [source, destination].map(|node| topology.node_id(node));
            let detail = format!(
                "no open way leads from node '{from}' to node '{to}' at revision {}",
                snapshot.revision
            );
            Refusal::new(Code::NoRoute, detail)
        })
    }
}

/// An edge without the flight model can promise nothing of a flight.
fn refuse_flight(request: &wire::DeliveryRequest, faults: &mut Faults) {
    let asked = [
        ("/airframe", request.airframe.is_some()),
        ("/battery_fraction", request.battery_fraction.is_some()),
        ("/objective", request.objective.is_some()),
        ("/deadline", request.deadline.is_some()),
    ];
    for (pointer, _) in asked.into_iter().filter(|(_, is_asked)| *is_asked) {
        let message = "this edge computes neither times nor energy".to_owned();
        let hint = "leave it out, or turn the flight model on in the edge's configuration";
        faults.add("flight_model_off", pointer, message, Some(hint.to_owned()));
    }
}

fn check_start(start: Timestamp, now: Timestamp, faults: &mut Faults) {
    let ahead = start.duration_since(now);
    if ahead > START_AHEAD_MAX || -ahead > START_BEFORE_MAX {
        let message =
            format!("the start {start} is not within five minutes ago and a week ahead of {now}");
        faults.add("start_time_out_of_range", "/start_time", message, None);
    }
}

/// A plan that the caller may speak for; one of others is not told from one that is not there.
pub(super) fn own_plan(
    snapshot: &Snapshot,
    caller: &Caller,
    id: &str,
) -> Result<Arc<PlanEntry>, Refusal> {
    let plan = snapshot.plans.get(id);
    let plan = plan.filter(|plan| may_speak_for(caller, plan));
    plan.cloned().ok_or_else(|| Refusal::not_found("plan", id))
}
