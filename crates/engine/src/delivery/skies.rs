//! One state of the world: what is closed when and why, and what other plans take, in seconds of one clock.

use super::world::DEFAULT_DEADLINE_S;
use crate::airspace::Airspace;
use crate::flight::{FlightRules, Reservation, Situation, TimedClosure, TrafficLeg};
use crate::itinerary::{OthersOccupancy, timed_closures};
use crate::network::{NodeIx, Topology};
use crate::recompose::Severance;
use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;

/// What the other plans of an edge take, and what nodes offer beside recharging.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OtherPlans {
    /// Pads that they have reserved; those of the plan that is answered left out.
    pub reservations: Vec<Reservation>,
    /// Legs that they fly, likewise.
    pub traffic: Vec<TrafficLeg>,
    /// Nodes that swap batteries on their pads instead of charging them.
    pub swap_stations: Vec<NodeIx>,
}

/// One immutable state of the world, for any number of requests and drones.
#[derive(Clone, Debug)]
pub struct FlightEnvironment {
    /// Second 0.
    zero: Timestamp,
    airspace: Arc<Airspace>,
    /// What is closed at the airspace's time, whatever closes later.
    now: Arc<Airspace>,
    /// What is closed when, and what nodes offer; no plans.
    closed: Arc<Situation>,
    others: OthersOccupancy,
    /// The causes of the closures, one for each.
    causes: Arc<Vec<Severance>>,
}

impl FlightEnvironment {
    /// The state of an airspace, beside what other plans take, in seconds from the airspace's time.
    pub fn of(airspace: &Airspace, others: OtherPlans, rules: &FlightRules) -> Self {
        Self::since(airspace.as_of(), airspace, others, rules)
    }

    /// The same in seconds from another instant, which many states of the world may share.
    pub fn since(
        zero: Timestamp,
        airspace: &Airspace,
        others: OtherPlans,
        rules: &FlightRules,
    ) -> Self {
        let now_s = airspace.as_of().duration_since(zero).as_secs_f64();
        let (mut closures, mut causes) = (Vec::new(), Vec::new());
        // Windows that have ended are widened at most by this: plans begin at the airspace's time at the earliest, and no leg takes longer
        // than a delivery.
        let widened_s = rules.time_margin_s + rules.time_margin_growth * DEFAULT_DEADLINE_S;
        for (closure, _) in airspace.closures() {
            let windows = timed_closures(closure, zero).into_iter();
            for timed in windows.filter(|timed| timed.until_s > now_s - widened_s) {
                closures.push(timed);
                causes.push(Severance::Closure(closure.id.clone()));
            }
        }
        Self {
            zero,
            now: Arc::new(closed_now(airspace, rules.time_margin_s)),
            airspace: Arc::new(airspace.clone()),
            others: OthersOccupancy::from_facts(&others.reservations, &others.traffic),
            closed: Arc::new(Situation {
                closures,
                swap_stations: others.swap_stations,
                ..Situation::default()
            }),
            causes: Arc::new(causes),
        }
    }

    /// A state that was written down: an airspace, what of it has begun, and what is in the way of drones.
    pub fn recorded(
        zero: Timestamp,
        airspace: &Airspace,
        begun: &Airspace,
        situation: Situation,
        causes: Vec<Severance>,
        rules: &FlightRules,
    ) -> Self {
        Self {
            zero,
            now: Arc::new(closed_now(begun, rules.time_margin_s)),
            airspace: Arc::new(airspace.clone()),
            others: OthersOccupancy::from_facts(&situation.reservations, &situation.traffic),
            closed: Arc::new(Situation {
                reservations: Vec::new(),
                traffic: Vec::new(),
                ..situation
            }),
            causes: Arc::new(causes),
        }
    }

    /// The same closures among what other plans take, in the seconds of this state.
    #[must_use]
    pub fn among(&self, others: OthersOccupancy) -> Self {
        Self {
            others,
            ..self.clone()
        }
    }

    /// The same with closures and taken pads that a report brings for its own request.
    #[must_use]
    pub(super) fn with(&self, closures: Vec<TimedClosure>, taken: &[Reservation]) -> Self {
        let mut more = self.clone();
        let reported = closures.iter().map(|_| Severance::Report);
        Arc::make_mut(&mut more.causes).extend(reported);
        Arc::make_mut(&mut more.closed).closures.extend(closures);
        more.others = more.others.with_taken(taken);
        more
    }

    /// The network.
    pub fn topology(&self) -> &Arc<Topology> {
        self.airspace.topology()
    }

    /// The airspace as it was given, with its look ahead.
    pub fn airspace(&self) -> &Airspace {
        &self.airspace
    }

    /// The airspace with what is closed at its time, and nothing that closes later.
    pub fn now(&self) -> &Airspace {
        &self.now
    }

    /// What is closed when, and what nodes offer beside recharging; no plans.
    pub fn closed(&self) -> &Situation {
        &self.closed
    }

    /// What other plans take.
    pub fn others(&self) -> &OthersOccupancy {
        &self.others
    }

    /// All of it as plain facts, copied.
    pub fn situation(&self) -> Situation {
        Situation {
            reservations: self.others.reservations(),
            traffic: self.others.traffic(),
            ..(*self.closed).clone()
        }
    }

    /// The causes of the closures, one for each.
    pub fn causes(&self) -> &[Severance] {
        &self.causes
    }

    /// Second 0 of everything here.
    pub fn zero(&self) -> Timestamp {
        self.zero
    }

    /// An instant in seconds.
    pub fn seconds(&self, instant: Timestamp) -> f64 {
        instant.duration_since(self.zero()).as_secs_f64()
    }

    /// The instant of a number of seconds, to the microsecond; `None` for one that no calendar has.
    pub fn instant(&self, seconds: f64) -> Option<Timestamp> {
        let whole = (seconds * 1e6).round() / 1e6;
        let since = SignedDuration::try_from_secs_f64(whole).ok()?;
        self.zero().checked_add(since).ok()
    }
}

/// The same airspace without a look ahead, but for the margin.
fn closed_now(airspace: &Airspace, margin_s: f64) -> Airspace {
    let horizon = SignedDuration::try_from_secs_f64(margin_s).unwrap_or(SignedDuration::ZERO);
    airspace.looking_ahead(horizon)
}
