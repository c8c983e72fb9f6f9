//! Answers to what drones report, by the flight model: in the air with the battery that is left, on a pad from where they stand.

use super::answered::without_flight;
use super::answering::{Stand, stops_ahead};
use super::assumed::Assumed;
use super::kept::Told;
use super::known::{assumed_of, seen_lately};
use super::terms::DroneKind;
use super::{Budget, Flights, FlownVersion, Ground};
use crate::drones::Sighting;
use crate::drones::progress::progress;
use crate::planner::AT_NODE_M;
use crate::planner::{Answer, Asked, Own, Scene};
use crate::plans::entry::PlanEntry;
use jiff::Timestamp;
use serde_json::Value;
use skyway_contract as wire;
use skyway_engine::compose::Composition;
use skyway_engine::delivery::{
    self, BatteryNow, DeliveryWorld, FlightFailure, FlightRecomposition, Landing, ReportedFigures,
    Trouble, answer_failure,
};
use skyway_engine::flight::{Aloft, Location};
use skyway_engine::itinerary::{Limits, Objective};
use skyway_engine::network::{NodeIx, Topology};
use skyway_engine::recompose::{Outcome, Request};
use skyway_formats::{FlightQuestion, ReadWarning, write_flight_question};
use skyway_planted::{self as planted, Bug};
use std::sync::Arc;

/// The heaviest payload that is believed, in kilograms.
const PAYLOAD_MAX_KG: f64 = 100.0;

/// Where a drone that reports is on its plan, and what it said of itself before.
#[derive(Clone, Copy)]
struct Reporter<'a> {
    plan: Option<&'a PlanEntry>,
    /// Which leg of its plan it is on, counted from 0.
    leg: Option<usize>,
    /// What its telemetry said last.
    sighting: Option<&'a Sighting>,
}

/// A drone whose battery is known.
#[derive(Clone, Debug)]
pub(super) struct ReportingDrone {
    pub(super) kind: DroneKind,
    pub(super) battery: BatteryNow,
    pub(super) assumed: Assumed,
    pub(super) objective: Objective,
    /// The latest landing, in seconds, where one is to be kept.
    pub(super) deadline_s: Option<f64>,
    /// Where its plan was going to stop, if it has one.
    pub(super) planned_stops: Option<Vec<NodeIx>>,
    pub(super) stand: Option<Stand>,
    /// Where it has to land, of which nothing that it reports shows that it can fly on.
    pub(super) landing: Option<Landing>,
    pub(super) budget: Budget,
    /// Its plan, whose legs and pads are in no way but its own.
    pub(super) plan: Option<Arc<str>>,
    /// The drone itself, else that of its plan: the pad that it stands on is in no way but its own.
    pub(super) drone_id: Option<Arc<str>>,
}

impl ReportingDrone {
    /// The node on whose pad it stands; `None` in the air.
    pub(super) fn stands_at(&self) -> Option<NodeIx> {
        self.stand.map(|stand| stand.node)
    }

    /// What it takes itself.
    pub(super) fn own<'a>(&'a self, scene: Scene<'a>) -> Own<'a> {
        let traffic = scene.traffic;
        traffic.own(self.plan.as_deref(), self.drone_id.as_deref())
    }
}

/// How an answer is flown, and what it takes to compute it again.
#[derive(Clone, Debug)]
pub(crate) struct Flight {
    /// How the path is flown, and the path; `None` where there is none.
    pub(crate) version: Option<(Arc<FlownVersion>, Composition)>,
    /// When that departs.
    pub(crate) departs_at: Timestamp,
    /// How one flies that is in the air, where it is unknown whether this one is.
    pub(super) if_airborne: Option<Arc<FlownVersion>>,
    /// What keeps the drone from its destination.
    pub(crate) causes: Vec<wire::FlightCause<'static>>,
    /// The plan that there would be but for the deadline.
    pub(crate) opens: Option<wire::Opening<'static>>,
    /// False where it is unknown whether the battery suffices.
    pub(crate) is_energy_checked: bool,
    pub(super) drone: ReportingDrone,
    /// The wind that it is flown in.
    pub(super) weather: Option<Arc<str>>,
    flights: Arc<Flights>,
}

impl Flight {
    /// What is a default of it.
    pub(crate) fn assumed(&self) -> Assumed {
        self.drone.assumed
    }

    /// All that it was computed from beside its report and the closures in force, as a document; of the scene that it was
    /// computed in.
    pub(crate) fn question(&self, scene: Scene<'_>, request: &Request) -> Value {
        let (flights, drone) = (&self.flights, &self.drone);
        let ground = flights.ground(scene, &drone.kind, drone.own(scene), drone.budget);
        write_flight_question(&FlightQuestion {
            skies: &ground.skies,
            setting: &ground.setting,
            weather: scene.weather.map(|weather| &**weather),
            failure: &flights.failure(drone, request, scene.now),
            stand: drone.stand.map(|stand| flights.in_seconds(stand)),
            refuge_stay_s: flights.settings.refuge_stay_s,
            limits: ground.limits,
        })
    }
}

impl Flights {
    /// The drone of a report; `None` where its battery is unknown. What cannot be so is passed over with a warning.
    pub(super) fn reporting(
        &self,
        scene: Scene<'_>,
        asked: &Asked<'_>,
        read: &mut Vec<ReadWarning>,
    ) -> Option<ReportingDrone> {
        let (report, request, plan, drones) =
            (asked.report, asked.request, asked.plan, asked.drones);
        let topology = scene.topology();
        let sighting = asked.drone_id.and_then(|id| drones.last(id));
        let progress = plan.and_then(|plan| progress(topology, plan, drones, scene.now));
        let reporter = Reporter {
            plan,
            leg: progress.map(|progress| progress.leg),
            sighting: sighting.as_ref(),
        };
        let facts = report.drone.clone().unwrap_or_default();
        let stated = facts.battery_fraction.filter(is_fraction);
        let named = facts.airframe.as_deref();
        let is_named = named.is_some_and(|name| self.settings.airframe(name).is_some());
        let leg = leg_of(request, reporter);
        let known = battery(&facts, leg, reporter, scene.now);
        let landing = Landing::of(
            request.report.failure,
            Trouble::of(request.circumstances.detail),
            ReportedFigures {
                battery: stated.is_some(),
                payload: facts.payload_kg.is_some_and(|kg| is_payload(&kg))
                    && matches!(known, Some(BatteryNow::Given(_))),
            },
        );
        // Who has to land lands whatever is left.
        let assumed = landing.map(|_| BatteryNow::Assumed(self.settings.airframe.full_charge));
        // What its telemetry said of a drone that has to land was said before it failed.
        let known = known.map(|known| match known {
            BatteryNow::Given(seen) if landing.is_some() && stated.is_none() => {
                BatteryNow::Assumed(seen)
            }
            known => known,
        });
        let Some(battery) = known.or(assumed) else {
            read.push(ReadWarning::new(
                "battery_unknown",
                "the drone's battery is unknown, so that the answer is the shortest way and may not be flyable; \
                 send 'drone.battery_fraction'",
            ));
            return None;
        };
        let stand = self.stand_of(scene, request, reporter);
        let stand = stand.map(|stand| Stand {
            battery: stated.unwrap_or(stand.battery),
            ..stand
        });
        let objective = self.objective_of_report(report, plan, read);
        Some(ReportingDrone {
            kind: self.kind_of_reporter(&facts, plan, read),
            battery,
            assumed: assumed_of(plan, sighting.as_ref(), scene.now)
                .but_for(is_named, stated.is_some()),
            objective,
            budget: Budget::Request(objective),
            deadline_s: self.deadline_of_report(report, plan, scene.now, read),
            planned_stops: plan.zip(leg).and_then(|(plan, leg)| stops_ahead(plan, leg)),
            stand,
            landing,
            plan: plan.map(|plan| plan.id.clone()),
            drone_id: drone_of(asked),
        })
    }

    /// Where who reports stands, if that fits the report.
    fn stand_of(
        &self,
        scene: Scene<'_>,
        request: &Request,
        reporter: Reporter<'_>,
    ) -> Option<Stand> {
        let topology = scene.topology();
        let plan = reporter.plan.filter(|_| may_stand(request))?;
        let stand = self.stand(topology, plan, reporter.sighting, scene.now)?;
        is_near(topology, request, stand.node).then_some(stand)
    }

    fn kind_of_reporter(
        &self,
        facts: &wire::DroneFacts,
        plan: Option<&PlanEntry>,
        read: &mut Vec<ReadWarning>,
    ) -> DroneKind {
        let is_speed = |speed_mps: &f64| *speed_mps > 0.0 && *speed_mps <= 100.0;
        let stated_mps = facts.airspeed_mps.filter(is_speed);
        let planned = plan.map(|plan| self.kind_of(plan));
        let named = facts.airframe.as_deref().and_then(|name| {
            let found = self.airframe(Some(name), stated_mps);
            if found.is_none() {
                let message = format!(
                    "no airframe is called '{name:.80}', and it is ignored; there are: {}",
                    self.airframe_names()
                );
                read.push(ReadWarning {
                    code: "unknown_airframe",
                    message,
                });
            }
            found
        });
        let airframe = match (named, stated_mps, &planned) {
            (Some(named), ..) => named,
            (None, None, Some(planned)) => planned.airframe.clone(),
            (None, stated_mps, _) => {
                let order = plan.and_then(|plan| plan.order.as_ref());
                let name = order.map(|order| &*order.airframe);
                let known = self.airframe(name, stated_mps);
                known.unwrap_or_else(|| self.settings.airframe.clone())
            }
        };
        let stated_kg = facts.payload_kg.filter(|kg| {
            let is_weight = is_payload(kg);
            if !is_weight {
                let message = format!(
                    "'drone.payload_kg' is {kg}, not within 0 and {PAYLOAD_MAX_KG}, and is ignored"
                );
                read.push(ReadWarning {
                    code: "payload_ignored",
                    message,
                });
            }
            is_weight
        });
        let planned_kg = planned.map(|planned| planned.payload_kg);
        DroneKind::new(airframe, stated_kg.or(planned_kg).unwrap_or_default())
    }

    fn objective_of_report(
        &self,
        report: &wire::FailureReport,
        plan: Option<&PlanEntry>,
        read: &mut Vec<ReadWarning>,
    ) -> Objective {
        let stated = report.objective.as_deref();
        let named = stated.and_then(|name| {
            let mut all = Objective::ALL.into_iter();
            all.find(|objective| objective.name() == name)
        });
        if named.is_some() {
            // That is what answers without a flight say.
            read.retain(|warning| warning.code != "objective_unsupported");
        }
        let planned = plan.map(|plan| self.objective_of(plan));
        named.or(planned).unwrap_or(self.settings.objective)
    }

    fn deadline_of_report(
        &self,
        report: &wire::FailureReport,
        plan: Option<&PlanEntry>,
        now: Timestamp,
        read: &mut Vec<ReadWarning>,
    ) -> Option<f64> {
        let stated = report.deadline.as_deref();
        let stated = stated.and_then(|text| text.parse::<Timestamp>().ok());
        match stated {
            Some(deadline) if deadline <= now => {
                let message = format!(
                    "the deadline {deadline} is over, and is ignored; the drone is to land as soon as any other"
                );
                read.push(ReadWarning {
                    code: "deadline_ignored",
                    message,
                });
                None
            }
            Some(deadline) => Some(self.seconds(deadline)),
            None => plan.and_then(|plan| self.deadline_s(plan, now)),
        }
    }

    /// Answers a drone.
    pub(super) fn answer_report(
        self: &Arc<Self>,
        scene: Scene<'_>,
        drone: ReportingDrone,
        request: &Request,
    ) -> Answer {
        let ground = self.ground(scene, &drone.kind, drone.own(scene), drone.budget);
        self.answer_on(&ground, scene, drone, request)
    }

    /// The same without the tables that searches are guided by.
    pub(super) fn answer_without_tables(
        self: &Arc<Self>,
        scene: Scene<'_>,
        drone: ReportingDrone,
        request: &Request,
    ) -> Answer {
        let ground = self.ground(scene, &drone.kind, drone.own(scene), drone.budget);
        self.answer_on(&ground.without_tables(), scene, drone, request)
    }

    fn answer_on(
        self: &Arc<Self>,
        ground: &Ground,
        scene: Scene<'_>,
        drone: ReportingDrone,
        request: &Request,
    ) -> Answer {
        let failure = self.failure(&drone, request, scene.now);
        let told_within = |limits: Limits<'static>| {
            let world = DeliveryWorld {
                limits,
                ..ground.world()
            };
            self.with_scratch(scene.topology(), |scratch| match drone.stand {
                Some(stand) => self.in_seconds(stand).answer(&world, &failure, scratch),
                None => answer_failure(&world, &failure, scratch),
            })
        };
        let mut told = told_within(ground.limits);
        // That a wave had no time for its way is no reason to tell a drone in the air that there is none. One on the ground
        // is looked at again.
        let is_cut_short = told.outcome == Outcome::NoRoute && !told.proof.proved;
        if is_cut_short && drone.budget == Budget::Wave && drone.stand.is_none() {
            told = told_within(self.limits(Budget::Request(drone.objective)));
        }
        let departs_at = drone.stand.map_or(scene.now, |stand| stand.from);
        let flown = |told: &FlightRecomposition, departs_at: Timestamp| {
            let composition = told.composition.as_ref()?;
            let told = Told::of_answer(told, drone.assumed);
            let (flown, way) = FlownVersion::of(ground, composition, told, departs_at);
            Some((Arc::new(flown), way))
        };
        let airborne = told.if_airborne.as_deref();
        let airborne = airborne.and_then(|told| flown(told, scene.now));
        let flight = Flight {
            version: flown(&told, departs_at),
            departs_at,
            if_airborne: airborne.map(|(version, _)| version),
            causes: ground.causes(&told.causes),
            opens: told.opens.and_then(|opens| ground.opening(opens)),
            is_energy_checked: told.is_energy_checked,
            weather: scene.weather.cloned(),
            flights: self.clone(),
            drone,
        };
        Answer {
            told: without_flight(ground, &told),
            flight: Some(flight),
        }
    }

    /// Whether an answer of an instant can still be flown: at its times, in the same wind, over what is still open.
    pub(super) fn still_holds(
        &self,
        scene: Scene<'_>,
        flight: &Flight,
        answered_at: Timestamp,
    ) -> bool {
        let age_s = scene.now.duration_since(answered_at).as_secs_f64();
        if age_s > self.settings.late_tolerance_s || scene.weather != flight.weather.as_ref() {
            return false;
        }
        let Some((version, _)) = &flight.version else {
            return true;
        };
        let (_, setting) = self.bare(scene, &flight.drone.kind);
        let timed = version.composition_at(self.seconds(flight.departs_at));
        setting.in_the_way(&timed.plan, timed.began_s, 0).is_empty()
    }

    fn in_seconds(&self, stand: Stand) -> delivery::Stand {
        delivery::Stand {
            node: stand.node,
            pad: stand.pad,
            at_s: self.seconds(stand.from),
            battery: stand.battery,
        }
    }

    fn failure<'a>(
        &self,
        drone: &'a ReportingDrone,
        request: &'a Request,
        now: Timestamp,
    ) -> FlightFailure<'a> {
        FlightFailure {
            request,
            at_s: self.seconds(now),
            battery: drone.battery,
            objective: drone.objective,
            deadline_s: drone.deadline_s,
            planned_stops: drone.planned_stops.as_deref(),
            landing: drone.landing,
        }
    }
}

/// The drone that reports, else that of its plan.
fn drone_of(asked: &Asked<'_>) -> Option<Arc<str>> {
    let planned = asked.plan.and_then(|plan| plan.drone_id.clone());
    asked.drone_id.map(Arc::from).or(planned)
}

/// Whether what a drone reports fits one that stands: what closes the leg of one that may be passing closes it in flight.
fn may_stand(request: &Request) -> bool {
    match request.circumstances.aloft {
        Aloft::Grounded => true,
        Aloft::Unknown => !request.report.failure.closes_leg(),
        Aloft::Airborne => false,
    }
}

/// Whether a drone is at a node, by the place that it reports.
fn is_near(topology: &Topology, request: &Request, node: NodeIx) -> bool {
    match request.report.location {
        Location::At(place) => place.distance_m(topology.position(node)) <= AT_NODE_M,
        Location::LegStart => request.report.leg.0 == node,
        Location::Unknown => request.report.leg.0 == node,
    }
}

fn is_fraction(fraction: &f64) -> bool {
    (0.0..=1.0).contains(fraction)
}

fn is_payload(payload_kg: &f64) -> bool {
    (0.0..=PAYLOAD_MAX_KG).contains(payload_kg)
}

/// The leg of its plan that a report is about: the one that the drone is on, if that is it, else the first of these ends.
fn leg_of(request: &Request, reporter: Reporter<'_>) -> Option<usize> {
    let legs = &reporter.plan?.reported.composition.legs;
    let is_it = |leg: usize| {
        legs.get(leg)
            .is_some_and(|leg| (leg.from, leg.to) == request.report.leg)
    };
    let on = reporter.leg.filter(|leg| is_it(*leg));
    on.or_else(|| (0..legs.len()).find(|leg| is_it(*leg)))
}

/// What is known of the battery: as the drone reports, as its telemetry had it lately, or as its plan has it on the leg.
fn battery(
    facts: &wire::DroneFacts,
    leg: Option<usize>,
    reporter: Reporter<'_>,
    now: Timestamp,
) -> Option<BatteryNow> {
    let stated = facts.battery_fraction.filter(is_fraction);
    if let Some(stated) = stated.filter(|_| !planted::is(Bug::PlansBattery)) {
        return Some(BatteryNow::Given(stated));
    }
    if let Some(seen) = seen_lately(reporter.plan, reporter.sighting, now) {
        return Some(BatteryNow::Given(seen));
    }
    let flown = reporter.plan?.reported.flight.as_deref()?;
    let leg = flown.composition.plan.legs.get(leg?)?;
    Some(BatteryNow::ByPlan {
        before: leg.battery_before,
        after: leg.battery_after,
    })
}
