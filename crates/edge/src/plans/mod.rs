//! Composition plans: composed, listed, taken over, cancelled; in this folder their stops, packs, first stretches, and what
//! drones say of them.

pub(crate) mod entry;
pub(crate) mod fleet;
mod packs;
pub(crate) mod served;
pub(crate) mod stops;
pub(crate) mod stretches;
pub(crate) mod ways;
pub(crate) mod words;

use crate::failures::reporter::may_speak_for;
use crate::planner::{Course, Stated, Terms, Version, Wanted};
use crate::replies::Idempotency;
use crate::snapshot::Snapshot;
use crate::writer::commands::{Command, Done, unexpected};
use crate::{Edge, views};
use entry::{FlownFor, PRIORITY, PlanEntry, PlanFlags};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{self as wire, PlanState};
use skyway_engine::checked::{Case, FallenBackTo};
use skyway_engine::flight::ServiceStop;
use skyway_engine::network::NodeIx;
use skyway_engine::recompose::Outcome;
use skyway_formats::{Route, RouteFormat, first_stretch, write_route};
use skyway_service::access::{Caller, Role};
use skyway_service::intake::{Faults, PageRequest, filtered, token};
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use stops::read_places;

/// How far ahead a plan may start.
const START_AHEAD_MAX: SignedDuration = SignedDuration::from_hours(24 * 7);
/// How long ago a plan may have started: clocks differ a little.
const START_BEFORE_MAX: SignedDuration = SignedDuration::from_mins(5);
/// The heaviest payload, in kilograms; more is a slip of units.
const PAYLOAD_MAX_KG: f64 = 100.0;
/// The fastest airspeed, in metres per second.
const AIRSPEED_MAX_MPS: f64 = 100.0;
/// The highest priority.
const PRIORITY_MAX: u8 = 100;
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
    destination: Option<NodeIx>,
    stops: Vec<ServiceStop>,
    payload_kg: f64,
    priority: u8,
    drone_id: Option<Arc<str>>,
    /// The delivery at the registry that it is flown for.
    delivery_id: Option<String>,
    terms: Terms,
}

impl Delivery {
    fn wanted(&self, plainly: bool) -> Wanted<'_> {
        Wanted {
            source: self.source,
            destination: self.destination,
            stops: &self.stops,
            terms: &self.terms,
            drone_id: self.drone_id.as_deref(),
            plainly,
        }
    }
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
        let (edge, author) = (self.clone(), caller.clone());
        let composed = async move {
            for _ in 0..ATTEMPTS {
                let on = edge.on_network()?;
                let topology = on.topology().clone();
                let delivery = edge.read_delivery(&on, &author, &request)?;
                // Composed once more, for another time, it could be refused.
                if let Some(known) = delivery
                    .id
                    .as_deref()
                    .filter(|id| on.plans.contains_key(*id))
                {
                    return Err(already_exists(known));
                }
                let (composer, subject) = (edge.clone(), author.subject.clone());
                let composed = edge.in_turn(&edge.turns.compositions, move || {
                    composer.compose(&on, delivery, subject)
                });
                let command = Command::AddPlan(Box::new(composed.await??));
                let command = command.made_on(&topology).by(&author);
                let (outcome, snapshot) = edge.command(command).await?;
                match outcome.done {
                    // The network has changed under it, or another plan has come between.
                    Done::Outdated => {}
                    done => return edge.told(done, &snapshot),
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
        let after = page.after.as_deref().map(Arc::from);
        let (told, next) = filtered(&snapshot.plans, after, page.size, passes);
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

    /// The route of a plan's newest version, in a format of ground stations or maps.
    ///
    /// # Errors
    /// When there is none that the caller may see, or the format cannot say it.
    pub fn plan_route(
        &self,
        caller: &Caller,
        id: &str,
        format: RouteFormat,
    ) -> Result<String, Refusal> {
        let snapshot = self.snapshot();
        let plan = own_plan(&snapshot, caller, id)?;
        let version = plan.wanted.as_ref().unwrap_or(&plan.reported);
        let stops = version.flight.iter().flat_map(|flown| flown.landings());
        let landings: Vec<usize> = stops.collect();
        let mut route = Route::of_composition(
            id.to_owned(),
            &version.composition,
            version.departs_at,
            &landings,
        );
        if let Some(stretch) = &version.stretch {
            route.lead_in = first_stretch(snapshot.topology(), &stretch.reentry).geometry;
        }
        let written = write_route(&route, &snapshot.airspace, format);
        let written =
            written.map_err(|problem| Refusal::new(Code::PlanInvalid, problem.to_string()))?;
        Ok(written.text)
    }

    pub(crate) fn told(
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
        faults.id("/delivery_id", request.delivery_id.as_deref());
        let (source, stops, destination) = read_places(topology, request, &mut faults);
        let start = faults
            .instant("/start_time", request.start_time.as_deref())
            .unwrap_or(now);
        check_start(start, now, &mut faults);
        let payload_kg = faults.number("/payload_kg", request.payload_kg, 0.0, PAYLOAD_MAX_KG);
        let payload_kg = payload_kg.unwrap_or(0.0);
        let speed = request.airspeed_mps;
        let airspeed_mps = faults.number("/airspeed_mps", speed, 0.1, AIRSPEED_MAX_MPS);
        let seen = request.drone_id.as_deref();
        let stated = Stated {
            start,
            now,
            payload_kg,
            airspeed_mps,
            seen_battery: seen.and_then(|drone| {
                let battery = self.drones.last(drone)?.battery?;
                Some((battery.fraction, battery.at))
            }),
        };
        let highest = self.highest_priority(caller);
        let priority = priority(request.priority, highest, &mut faults);
        let terms = self.planner.read_terms(request, &stated, &mut faults);
        faults.check(Code::PlanInvalid, "delivery request")?;
        check_order(caller, request)?;
        if priority > highest {
            let subject = &caller.subject;
            let detail = format!(
                "'{subject}' may ask for a priority up to {highest}, not for {priority}; 'plans.urgent' names who may"
            );
            return Err(Refusal::new(Code::Forbidden, detail));
        }
        let (Some(source), Some(terms)) = (source, terms) else {
            return Err(unexpected());
        };
        Ok(Delivery {
            id: request.id.clone(),
            source,
            destination,
            stops,
            payload_kg,
            priority,
            drone_id: request.drone_id.as_deref().map(Arc::from),
            delivery_id: request.delivery_id.clone(),
            terms,
        })
    }

    /// The highest priority that a caller may ask for.
    fn highest_priority(&self, caller: &Caller) -> u8 {
        let mut urgent = self.settings.urgent.iter();
        let is_limited =
            caller.role == Role::Drone && urgent.all(|urgent| **urgent != *caller.subject);
        match is_limited {
            true => self.settings.priority_max,
            false => PRIORITY_MAX,
        }
    }

    fn compose(
        &self,
        snapshot: &Snapshot,
        delivery: Delivery,
        subject: Arc<str>,
    ) -> Result<PlanEntry, Refusal> {
        let course = self.composed_and_checked(snapshot, &delivery)?;
        let number = self.next_number.fetch_add(1, Ordering::Relaxed);
        let now = self.clock.now();
        let is_quote = delivery.drone_id.is_none();
        let expires_at = is_quote.then(|| now.saturating_add(QUOTED_FOR).unwrap_or(now));
        let id = delivery
            .id
            .unwrap_or_else(|| format!("plan-{}-{number}", self.epoch));
        let last = course.composition.way.nodes.last().copied();
        let destination = delivery.destination.or(last).ok_or_else(unexpected)?;
        let version = Version {
            number: 1,
            epoch: self.epoch,
            sent_at: now,
            outcome: None,
            composition: course.composition,
            flight: course.flight,
            stretch: course.stretch,
            first_stretch_m: 0.0,
            departs_at: course.departs_at,
            stops: course.stops.into(),
            recomposition_id: None,
            acknowledge_by: None,
            flags: Vec::new(),
            warnings: Vec::new(),
        };
        let flown_for = delivery.delivery_id.as_deref();
        Ok(PlanEntry {
            id: Arc::from(id),
            subject,
            drone_id: delivery.drone_id,
            flown_for: flown_for.map(|delivery| FlownFor::new(delivery, &version)),
            source: delivery.source,
            destination,
            payload_kg: delivery.payload_kg,
            airspeed_mps: delivery.terms.airspeed_mps,
            priority: delivery.priority,
            order: delivery.terms.flight.map(|flight| flight.order),
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
    ) -> Result<Course, Refusal> {
        let scene = snapshot.scene(self.clock.now());
        let check = |course: &Course| {
            self.planner
                .check_composed(scene, &delivery.wanted(false), course)
        };
        let first = self.planner.compose(scene, &delivery.wanted(false))?;
        let Err(fault) = check(&first) else {
            return Ok(first);
        };
        let again = self.planner.compose(scene, &delivery.wanted(true));
        let again = again.ok().filter(|again| check(again).is_ok());
        let fallback = match again {
            Some(_) => FallenBackTo::Baseline,
            None => FallenBackTo::Refusal,
        };
        let case = Case {
            fault,
            outcome: Outcome::Rerouted,
            nodes: first.composition.way.nodes,
            fallback,
        };
        self.tell_case(snapshot, &case, (None, None, None), scene.now);
        again.ok_or_else(|| {
            let fault = fault.text(snapshot.topology());
            let detail = format!("no plan passed the check before it leaves: {fault}");
            Refusal::new(Code::Internal, detail)
        })
    }
}

/// There is a plan of this id.
pub(crate) fn already_exists(id: &str) -> Refusal {
    let detail = format!("there is a plan '{id}' already; give this one another id");
    Refusal::new(Code::AlreadyExists, detail)
}

/// Whether a caller may order what it asks for: a drone speaks for itself alone, and does not know for which delivery of the
/// registry it flies.
fn check_order(caller: &Caller, request: &wire::DeliveryRequest) -> Result<(), Refusal> {
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
    let may_name_delivery = matches!(caller.role, Role::Operator | Role::Edge | Role::Anyone);
    if request.delivery_id.is_some() && !may_name_delivery {
        let detail = format!(
            "'{}' may not say for which delivery a plan is flown: operators may, for the registry",
            caller.subject
        );
        return Err(Refusal::new(Code::Forbidden, detail));
    }
    Ok(())
}

/// From 0 to 100; where none is stated the usual one, or the highest that may be asked for.
fn priority(stated: Option<u32>, highest: u8, faults: &mut Faults) -> u8 {
    let usual = PRIORITY.min(highest);
    let Some(stated) = stated else {
        return usual;
    };
    let read = u8::try_from(stated).ok();
    read.filter(|read| *read <= PRIORITY_MAX)
        .unwrap_or_else(|| {
            let message = format!("{stated} is not between 0 and {PRIORITY_MAX}");
            faults.add("out_of_range", "/priority", message, None);
            usual
        })
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
pub(crate) fn own_plan(
    snapshot: &Snapshot,
    caller: &Caller,
    id: &str,
) -> Result<Arc<PlanEntry>, Refusal> {
    let plan = snapshot.plans.get(id);
    let plan = plan.filter(|plan| may_speak_for(caller, plan));
    plan.cloned().ok_or_else(|| Refusal::not_found("plan", id))
}
