//! Drones of a provider over a planar network: they wait on the line of their edge, fly what they are assigned by its times,
//! and land.

use crate::Result;
use crate::line::client::{Connection, Session};
use crate::run::eprintln_line;
use jiff::Timestamp;
use skyway::api::grpc::proto::session_request::Body as Said;
use skyway::api::grpc::proto::session_response::Body as Told;
use skyway::api::grpc::proto::{
    self, MessageKind, Place, PlanState, PlanVersion, PlanarPosition, place,
};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::Duration;
use tokio::task::spawn_local;
use tokio::time::{MissedTickBehavior, interval, sleep};

/// Drones on each stream.
const ON_STREAM: usize = 100;
/// How often a drone tells where it is.
const EVERY: Duration = Duration::from_secs(3);
const COME_BACK_AFTER: Duration = Duration::from_millis(200);
/// The codes that say that a plan or version is over; after any other the drone asks again.
const OVER: [&str; 2] = ["not_found", "plan_state_conflict"];
/// The numbers of landings begin here; those of acknowledgements at 0.
const LANDINGS: u64 = ON_STREAM as u64;

/// What drones have flown, and fly.
#[derive(Clone, Default)]
pub(super) struct Flown {
    /// Who has flown each plan as far as its drop, by its id.
    pub(super) plans: Rc<RefCell<BTreeMap<String, Vec<String>>>>,
    /// Who has its drop still before it.
    pub(super) before: Rc<RefCell<BTreeSet<String>>>,
}

/// Puts drones on the line of an edge, for as long as this program runs.
pub(super) fn fly(edge: SocketAddr, drones: &[String], flown: &Flown) {
    for part in drones.chunks(ON_STREAM) {
        let mut drones: Vec<Drone> = part.iter().cloned().map(Drone::of).collect();
        let flown = flown.clone();
        spawn_local(async move {
            loop {
                // Its edge is killed now and then; a drone flies on meanwhile, and comes back.
                let _broken = on_line(edge, &mut drones, &flown).await;
                sleep(COME_BACK_AFTER).await;
            }
        });
    }
}

/// One session, until the line breaks.
async fn on_line(edge: SocketAddr, drones: &mut [Drone], flown: &Flown) -> Result<()> {
    let connection = Connection::open(edge, "").await?;
    let hello = drones.iter().map(Drone::hello).collect();
    let mut session = connection.session_of(hello).await?;
    for drone in drones.iter_mut() {
        drone.session_id = Some(session.id.clone());
    }
    let mut tick = interval(EVERY);
    tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            told = session.next_answer() => take(&session, drones, told?, flown),
            _ = tick.tick() => tell(&session, drones, flown),
        }
    }
}

/// Where those are that fly, what they have taken over, and who has landed.
fn tell(session: &Session, drones: &mut [Drone], flown: &Flown) {
    let now_s = seconds(Timestamp::now());
    let positions = drones.iter().filter_map(|drone| drone.position(now_s));
    let positions = positions.collect();
    session.say(
        None,
        Said::Telemetry(proto::ReportTelemetryRequest { positions }),
    );
    for (number, drone) in drones.iter_mut().enumerate() {
        drone.counts(now_s, flown);
        let Some(flight) = &mut drone.flight else {
            continue;
        };
        // Each until it is answered.
        if !flight.is_acknowledged {
            session.say(Some(number as u64), flight.acknowledgement());
        }
        flight.has_landed = now_s >= flight.lands_at_s;
        if flight.has_landed {
            let landed = proto::CompletePlanRequest {
                id: flight.plan_id.clone(),
                ..proto::CompletePlanRequest::default()
            };
            session.say(Some(LANDINGS + number as u64), Said::Complete(landed));
        }
    }
}

fn take(session: &Session, drones: &mut [Drone], told: (Option<u64>, Told), flown: &Flown) {
    if let (_, Told::Message(message)) = told {
        let named = |drone: &Drone| drone.id == message.drone_id;
        if let Some(number) = drones.iter().position(named) {
            drones[number].read(session, number as u64, message, flown);
        }
        return;
    }
    let (Some(number), told) = told else {
        return;
    };
    let is_landing = number >= LANDINGS;
    let number = usize::try_from(number % LANDINGS).ok();
    let Some(drone) = number.and_then(|number| drones.get_mut(number)) else {
        return;
    };
    match told {
        Told::Plan(plan) => drone.read_plan(&plan, flown),
        Told::Problem(problem) if OVER.contains(&&*problem.code) && is_landing => drone.ends(flown),
        Told::Problem(problem) if OVER.contains(&&*problem.code) => drone.read_refusal(),
        _ => {}
    }
}

/// A drone.
struct Drone {
    id: String,
    session_id: Option<String>,
    received: Option<String>,
    flight: Option<Flying>,
}

/// What it flies.
struct Flying {
    plan_id: String,
    token: (u64, u64, u32),
    pieces: Vec<Piece>,
    /// When what it carries is handed over: at the last stop that is served, if any is to come.
    delivers_at_s: Option<f64>,
    lands_at_s: f64,
    has_landed: bool,
    is_acknowledged: bool,
}

/// A straight piece of way: from when to when, from where to where.
struct Piece {
    times_s: [f64; 2],
    ends: [[f64; 2]; 2],
}

impl Drone {
    fn of(id: String) -> Self {
        Self {
            id,
            session_id: None,
            received: None,
            flight: None,
        }
    }

    fn hello(&self) -> proto::HelloDrone {
        proto::HelloDrone {
            drone_id: self.id.clone(),
            ends_session: self.session_id.clone(),
            received_through: self.received.clone(),
        }
    }

    fn position(&self, now_s: f64) -> Option<proto::TelemetryEntry> {
        let flight = self.flight.as_ref()?;
        let [x, y] = flight.place(now_s)?;
        let place = Some(place::Place::Planar(PlanarPosition { x, y }));
        let departs_at_s = flight.pieces.first()?.times_s[0];
        Some(proto::TelemetryEntry {
            drone_id: self.id.clone(),
            location: Some(Place { place }),
            airborne: Some(departs_at_s <= now_s && now_s < flight.lands_at_s),
            ..proto::TelemetryEntry::default()
        })
    }

    /// Reads a message from its mailbox.
    fn read(
        &mut self,
        session: &Session,
        number: u64,
        message: proto::DroneMessage,
        flown: &Flown,
    ) {
        self.received = Some(message.id.clone());
        let through = message.id.clone();
        match (message.kind(), message.version) {
            (MessageKind::Assigned, Some(version)) => {
                self.is_assigned(Flying::of(message.plan_id, &version, None), flown);
            }
            (MessageKind::Version, Some(version)) => {
                self.counts(seconds(Timestamp::now()), flown);
                let flight = self.flight.as_ref();
                let here = flight.and_then(|flight| flight.place(seconds(Timestamp::now())));
                let newer = Flying {
                    is_acknowledged: false,
                    ..Flying::of(message.plan_id, &version, here)
                };
                let is_newer = self.flight.as_ref().is_some_and(|flight| {
                    flight.plan_id == newer.plan_id && newer.token > flight.token
                });
                if is_newer {
                    session.say(Some(number), newer.acknowledgement());
                    self.flight = Some(newer);
                    return;
                }
            }
            (MessageKind::Ended, _) => {
                self.counts(seconds(Timestamp::now()), flown);
                let flight = self.flight.take();
                self.flight = flight.filter(|flight| flight.plan_id != message.plan_id);
            }
            _ => {}
        }
        let received = proto::ReceivedRequest {
            drone_id: self.id.clone(),
            through,
        };
        session.say(None, Said::Received(received));
    }

    /// It has another plan. Where it has landed, its edge has taken that although the answer was lost.
    ///
    /// Messages come at least once: what it has flown is not new.
    fn is_assigned(&mut self, next: Flying, flown: &Flown) {
        if let Some(flight) = &mut self.flight {
            flight.has_landed |= seconds(Timestamp::now()) >= flight.lands_at_s;
            let (flies, is_same) = (&flight.plan_id, flight.plan_id == next.plan_id);
            if is_same {
                return;
            }
            if !flight.has_landed {
                let text = format!(
                    "{} is assigned {} while it flies {flies}",
                    self.id, next.plan_id
                );
                eprintln_line(&text);
            }
        }
        let has_flown = |drones: &Vec<String>| drones.contains(&self.id);
        if flown
            .plans
            .borrow()
            .get(&next.plan_id)
            .is_some_and(has_flown)
        {
            let text = format!(
                "{} is assigned {} again, which it has flown",
                self.id, next.plan_id
            );
            eprintln_line(&text);
            return;
        }
        self.ends(flown);
        self.flight = Some(next);
    }

    /// Reads how its plan stands. One that ends at a stop is not over when its drone has landed there.
    fn read_plan(&mut self, plan: &proto::Plan, flown: &Flown) {
        let Some(flight) = self
            .flight
            .as_mut()
            .filter(|flight| flight.plan_id == plan.id)
        else {
            return;
        };
        if plan.state() == PlanState::Ended {
            self.ends(flown);
            return;
        }
        let reported = plan.reported.as_ref().map(|version| version.version);
        flight.is_acknowledged |= reported == Some(flight.token.2);
    }

    /// Reads that the version it has acknowledged is not wanted any more.
    fn read_refusal(&mut self) {
        if let Some(flight) = &mut self.flight {
            flight.is_acknowledged = true;
        }
    }

    /// Where it has landed, its flight is over; it counts where it did not before.
    fn ends(&mut self, flown: &Flown) {
        if let Some(flight) = self.flight.take_if(|flight| flight.has_landed) {
            self.has_delivered(&flight.plan_id, flown);
        }
    }

    /// Its flight counts from its drop on: the way home may take it an hour more.
    fn counts(&self, now_s: f64, flown: &Flown) {
        let flight = self.flight.as_ref();
        let drop = flight.and_then(|flight| Some((flight, flight.delivers_at_s?)));
        match drop {
            Some((flight, at_s)) if now_s >= at_s => self.has_delivered(&flight.plan_id, flown),
            Some(_) => {
                flown.before.borrow_mut().insert(self.id.clone());
            }
            None => {
                flown.before.borrow_mut().remove(&self.id);
            }
        }
    }

    /// Each plan counts once for a drone.
    fn has_delivered(&self, plan_id: &str, flown: &Flown) {
        flown.before.borrow_mut().remove(&self.id);
        let mut plans = flown.plans.borrow_mut();
        let drones = plans.entry(plan_id.to_owned()).or_default();
        if !drones.contains(&self.id) {
            drones.push(self.id.clone());
        }
    }
}

impl Flying {
    /// A version, flown from `here` on where it is one that stays.
    fn of(plan_id: String, version: &PlanVersion, here: Option<[f64; 2]>) -> Self {
        let mut pieces = Vec::new();
        let enters = version
            .legs
            .first()
            .and_then(|leg| leg.departs_at)
            .or(version.arrives_at);
        if let Some(stretch) = &version.first_stretch {
            pieces.extend(Piece::of(version.departs_at, enters, &stretch.geometry));
        }
        for leg in &version.legs {
            pieces.extend(Piece::of(leg.departs_at, leg.arrives_at, &leg.geometry));
        }
        if let (true, Some(here), Some(at)) = (pieces.is_empty(), here, version.departs_at) {
            pieces.push(Piece {
                times_s: [proto_seconds(at); 2],
                ends: [here; 2],
            });
        }
        Self {
            plan_id,
            token: (version.token, version.epoch, version.version),
            delivers_at_s: handed_over_s(version),
            lands_at_s: version.arrives_at.map_or(f64::INFINITY, proto_seconds),
            pieces,
            has_landed: false,
            is_acknowledged: true,
        }
    }

    fn acknowledgement(&self) -> Said {
        Said::Acknowledge(proto::AcknowledgePlanRequest {
            id: self.plan_id.clone(),
            version: self.token.2,
            ..proto::AcknowledgePlanRequest::default()
        })
    }

    /// Where it is: on a piece of way, or at the end of the last one that it has flown.
    fn place(&self, now_s: f64) -> Option<[f64; 2]> {
        let mut place = self.pieces.first()?.ends[0];
        for Piece {
            times_s: [from_s, until_s],
            ends: [start, end],
        } in &self.pieces
        {
            if now_s < *from_s {
                break;
            }
            let share = if until_s > from_s {
                ((now_s - from_s) / (until_s - from_s)).min(1.0)
            } else {
                1.0
            };
            place = [0, 1].map(|axis| start[axis] + share * (end[axis] - start[axis]));
        }
        Some(place)
    }
}

impl Piece {
    fn of(
        departs_at: Option<proto::Timestamp>,
        arrives_at: Option<proto::Timestamp>,
        corners: &[proto::Waypoint],
    ) -> Option<Self> {
        let (first, last) = (corners.first()?, corners.last()?);
        Some(Self {
            times_s: [proto_seconds(departs_at?), proto_seconds(arrives_at?)],
            ends: [[first.x, first.y], [last.x, last.y]],
        })
    }
}

/// When the last stop of a version that is served has been.
fn handed_over_s(version: &PlanVersion) -> Option<f64> {
    let served = |stop: &proto::Stop| Some(proto_seconds(stop.lands_at?) + stop.service_s?);
    let flight = version.flight.as_ref()?;
    flight.stops.iter().filter_map(served).next_back()
}

fn seconds(at: Timestamp) -> f64 {
    at.as_nanosecond() as f64 * 1e-9
}

fn proto_seconds(at: proto::Timestamp) -> f64 {
    at.seconds as f64 + f64::from(at.nanos) * 1e-9
}
