//! One state of the world: what is closed when and why, and what other plans take, in seconds of one clock.

use super::world::DEFAULT_DEADLINE_S;
use crate::airspace::{Airspace, Closure};
use crate::flight::{FlightRules, Reservation, Situation, TimedClosure, TrafficLeg};
use crate::itinerary::{ClosedWindows, ClosureKey, OthersOccupancy, timed_closures};
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
    /// What is closed when.
    closed: Arc<ClosedWindows>,
    /// Nodes that swap batteries on their pads instead of charging them.
    swap_stations: Arc<[NodeIx]>,
    others: OthersOccupancy,
    /// The causes of closures that were written down, one for each; those of an airspace bear their names.
    recorded: Arc<[Severance]>,
    /// Windows that have ended are widened at most by so much, in seconds.
    widened_s: f64,
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
        let topology = airspace.topology();
        let mut state = Self {
            zero,
            now: Arc::new(closed_now(airspace, rules.time_margin_s)),
            airspace: Arc::new(airspace.clone()),
            others: OthersOccupancy::from_facts(&others.reservations, &others.traffic),
            closed: Arc::new(ClosedWindows::none(topology)),
            swap_stations: others.swap_stations.into(),
            recorded: Arc::default(),
            // Plans begin at the airspace's time at the earliest, and no leg takes longer than a delivery.
            widened_s: rules.time_margin_s + rules.time_margin_growth * DEFAULT_DEADLINE_S,
        };
        let closures = airspace.closures();
        let windows = closures.flat_map(|(closure, _)| state.windows_ahead(closure));
        let windows = windows.collect();
        Arc::make_mut(&mut state.closed).add(topology, windows);
        state
    }

    /// The state of a later airspace, beside nothing else: costs what has come and gone between the two. `None` where it has to
    /// be made anew: the network is another one, the time has gone back, or this state was written down.
    pub fn followed_by(&self, airspace: &Airspace) -> Option<Self> {
        let topology = airspace.topology();
        let is_later = airspace.as_of() >= self.airspace.as_of();
        if !Arc::ptr_eq(topology, self.topology()) || !is_later || !self.recorded.is_empty() {
            return None;
        }
        let mut next = Self {
            now: Arc::new(airspace.looking_ahead_after(&self.airspace, &self.now)),
            airspace: Arc::new(airspace.clone()),
            others: OthersOccupancy::default(),
            ..self.clone()
        };
        let mut closed = (*self.closed).clone();
        let mut came = Vec::new();
        for (went, new) in airspace.changes_since(&self.airspace) {
            if let Some(went) = went {
                closed.remove(topology, &Arc::from(went.id.as_str()));
            }
            came.extend(new.into_iter().flat_map(|new| next.windows_ahead(new)));
        }
        if !closed.has_numbers_for(came.len()) {
            return None;
        }
        closed.remove_ended(topology, next.ended_s());
        closed.add(topology, came);
        next.closed = Arc::new(closed);
        Some(next)
    }

    /// What has ended by then, in seconds, is in the way of no plan.
    fn ended_s(&self) -> f64 {
        self.seconds(self.airspace.as_of()) - self.widened_s
    }

    /// The windows of a closure that may be in the way of a plan.
    fn windows_ahead(&self, closure: &Closure) -> Vec<(ClosureKey, TimedClosure)> {
        let ended_s = self.ended_s();
        let id: Arc<str> = Arc::from(closure.id.as_str());
        let windows = (0..).zip(timed_closures(closure, self.zero));
        let ahead = windows.filter(|(_, window)| window.until_s > ended_s);
        ahead
            .map(|(number, window)| (ClosureKey::Standing(id.clone(), number), window))
            .collect()
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
            closed: Arc::new(ClosedWindows::of(airspace.topology(), &situation.closures)),
            swap_stations: situation.swap_stations.into(),
            recorded: causes.into(),
            widened_s: f64::INFINITY,
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
        let closed = (*self.closed).clone().with(self.topology(), closures);
        Self {
            closed: Arc::new(closed),
            others: self.others.clone().with_taken(taken),
            ..self.clone()
        }
    }

    /// The network.
    pub fn topology(&self) -> &Arc<Topology> {
        self.airspace.topology()
    }

    /// The airspace as it was given, with its look ahead.
    pub fn airspace(&self) -> &Arc<Airspace> {
        &self.airspace
    }

    /// The airspace with what is closed at its time, and nothing that closes later.
    pub fn now(&self) -> &Airspace {
        &self.now
    }

    /// What is closed when.
    pub fn closed(&self) -> &Arc<ClosedWindows> {
        &self.closed
    }

    /// Nodes that swap batteries on their pads instead of charging them.
    pub fn swap_stations(&self) -> &[NodeIx] {
        &self.swap_stations
    }

    /// What other plans take.
    pub fn others(&self) -> &OthersOccupancy {
        &self.others
    }

    /// All of it as plain facts, copied.
    pub fn situation(&self) -> Situation {
        let closures = self.closed.closures();
        Situation {
            closures: closures.map(|(_, _, closure)| closure.clone()).collect(),
            reservations: self.others.reservations(),
            traffic: self.others.traffic(),
            swap_stations: self.swap_stations.to_vec(),
        }
    }

    /// The causes of the closures, one for each, in the order of [`FlightEnvironment::situation`].
    pub fn causes(&self) -> Vec<Severance> {
        let closures = self.closed.closures();
        closures.map(|(_, key, _)| self.cause(key)).collect()
    }

    /// The cause of the closure of a number.
    pub fn cause_of(&self, number: usize) -> Option<Severance> {
        let (key, _) = self.closed.closure(number)?;
        Some(self.cause(key))
    }

    fn cause(&self, key: &ClosureKey) -> Severance {
        match key {
            ClosureKey::Standing(id, _) => Severance::Closure(id.to_string()),
            // What a report brings follows what stands.
            ClosureKey::Unnamed(number) => {
                let recorded = self.recorded.get(*number as usize).cloned();
                recorded.unwrap_or(Severance::Report)
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::airspace::{
        Change, DailyPeriod, DayTime, Days, Recurrence, Window, Zone, ZoneDraft, ZoneGeometry,
    };
    use crate::geo::AltitudeBand;
    use crate::network::{Seeded, sketch};
    use jiff::civil::Time;
    use jiff::tz::Offset;

    const SEEDS: u64 = 40;
    const STEPS: usize = 60;
    const IDS: u16 = 12;
    /// No window of a schedule is made so far ahead.
    const BEYOND_SCHEDULES: SignedDuration = SignedDuration::from_hours(10 * 24);

    fn network() -> Arc<Topology> {
        let row = [("a", "b"), ("b", "c"), ("c", "d"), ("a", "e"), ("e", "f")];
        let more = [("f", "g"), ("g", "h"), ("b", "f"), ("c", "g"), ("d", "h")];
        let segments: Vec<(&str, &str)> = row.into_iter().chain(more).collect();
        Arc::new(sketch("a.b.c.d\ne.f.g.h", &segments))
    }

    fn windows(seeded: &mut Seeded, now: Timestamp) -> Vec<Window> {
        let near = |seeded: &mut Seeded| {
            let minutes = i64::from(seeded.below(400)) - 100;
            now + SignedDuration::from_mins(minutes)
        };
        let windows = (0..seeded.below(3)).filter_map(|_| {
            let from = (seeded.below(4) > 0).then(|| near(seeded));
            let until = (seeded.below(4) > 0).then(|| near(seeded));
            Window::new(from, until).ok()
        });
        windows.collect()
    }

    fn zone(seeded: &mut Seeded, topology: &Topology, id: &str, now: Timestamp) -> Closure {
        let clock = |hour| DayTime::Clock {
            time: Time::constant(hour, 0, 0, 0),
            offset: Offset::UTC,
        };
        let every_day = Recurrence {
            within: Window::ALWAYS,
            periods: vec![DailyPeriod {
                days: Days::EVERY,
                from: clock(8),
                until: clock(17),
            }],
        };
        let mut draft = ZoneDraft {
            id: id.to_owned(),
            name: None,
            reason: None,
            authority: None,
            geometry: ZoneGeometry::Circle {
                centre: [seeded.between(0.0, 600.0), seeded.between(0.0, 100.0)],
                radius_m: seeded.between(1.0, 150.0),
            },
            band: AltitudeBand::UNLIMITED,
            windows: windows(seeded, now),
            margin_m: 0.0,
            terms: Default::default(),
        };
        if seeded.below(10) == 0 {
            draft.terms.schedules = vec![every_day];
        }
        let zone = Zone::new(draft, topology.frame()).expect("a zone");
        Closure::of_zone(topology, Arc::new(zone))
    }

    fn change(seeded: &mut Seeded, topology: &Topology, now: Timestamp) -> Change {
        let id = format!("closure-{}", seeded.below(IDS));
        let node = NodeIx(u32::from(seeded.below(8)));
        match seeded.below(5) {
            0 | 1 => Change::Lift(id),
            2 => {
                let reason = "works".to_owned();
                let mut closure = Closure::of_operator(id, reason, vec![node], Vec::new());
                closure.pads = vec![node];
                closure.windows = windows(seeded, now);
                Change::Put(Arc::new(closure))
            }
            _ => Change::Put(Arc::new(zone(seeded, topology, &id, now))),
        }
    }

    /// All that requests read of a state.
    fn told(state: &FlightEnvironment) -> Vec<String> {
        let mut told = state.closed.told();
        told.push(format!("{:?}", state.causes()));
        for airspace in [&state.airspace, &state.now] {
            let in_force: Vec<_> = airspace.closures().collect();
            let numbers = (airspace.revision(), airspace.opened_at(), airspace.as_of());
            let next = airspace.next_change();
            told.push(format!("{numbers:?} {next:?} {:?}", airspace.closed()));
            told.push(format!("{in_force:?}"));
            let closes_pads = |node: &NodeIx| airspace.closes_pads(*node);
            let nodes = airspace.topology().nodes().filter(closes_pads);
            told.push(format!("{:?}", nodes.collect::<Vec<_>>()));
        }
        told
    }

    /// An airspace with the same closures, put into an open one beside the same clock.
    fn put_anew(airspace: &Airspace, apart: Option<SignedDuration>) -> Vec<String> {
        let topology = airspace.topology().clone();
        let open = Airspace::open(topology, 1, airspace.as_of(), airspace.horizon());
        let closures = airspace.closures();
        let puts = closures.map(|(closure, _)| Change::Put(closure.clone()));
        let open = open.beside_clock(apart);
        let anew = open.apply(&puts.collect::<Vec<_>>(), airspace.as_of());
        told_of(&anew)
    }

    fn told_of(airspace: &Airspace) -> Vec<String> {
        let closures = airspace.closures();
        let in_force = closures.map(|(closure, in_force)| format!("{} {in_force}", closure.id));
        let mut told: Vec<String> = in_force.collect();
        told.push(format!("{:?}", airspace.closed()));
        // The windows of schedules begin and end by when they were made.
        if !airspace.closures().any(|(closure, _)| closure.recurs()) {
            told.push(format!("{:?}", airspace.next_change()));
        }
        told
    }

    #[test]
    fn what_follows_an_earlier_state_is_what_is_made_anew() {
        let topology = network();
        let rules = FlightRules::default();
        let zero = Timestamp::UNIX_EPOCH;
        let mut followed_by_windows = 0;
        for seed in 0..SEEDS {
            let mut seeded = Seeded::new(seed);
            let mut now = zero + SignedDuration::from_hours(10);
            let horizon = SignedDuration::from_mins(30);
            let mut airspace = Airspace::open(topology.clone(), 1, now, horizon);
            let of = |airspace: &Airspace| {
                FlightEnvironment::since(zero, airspace, OtherPlans::default(), &rules)
            };
            let mut state = of(&airspace);
            let mut apart = None;
            for _ in 0..STEPS {
                let most_s = [60, 2_000][usize::from(seeded.below(2))];
                now += SignedDuration::from_secs(i64::from(seeded.below(most_s)));
                if seeded.below(30) == 0 {
                    now += BEYOND_SCHEDULES;
                }
                if seeded.below(8) == 0 {
                    apart = (seeded.below(2) == 0).then_some(SignedDuration::from_mins(7));
                    airspace = airspace.beside_clock(apart);
                }
                let changes: Vec<Change> = (0..seeded.below(4))
                    .map(|_| change(&mut seeded, &topology, now))
                    .collect();
                airspace = airspace.apply(&changes, now);
                followed_by_windows += usize::from(changes.is_empty());
                state = state.followed_by(&airspace).expect("a later state");
                assert_eq!(told(&state), told(&of(&airspace)), "seed {seed}");
                let anew = put_anew(&airspace, apart);
                assert_eq!(told_of(&airspace), anew, "seed {seed}");
            }
        }
        assert!(followed_by_windows > 100, "windows turn by themselves, too");
    }

    #[test]
    fn a_state_of_another_network_or_an_earlier_time_does_not_follow() {
        let now = Timestamp::UNIX_EPOCH;
        let horizon = SignedDuration::from_mins(30);
        let open = |topology, now| Airspace::open(topology, 1, now, horizon);
        let topology = network();
        let rules = FlightRules::default();
        let later = open(topology.clone(), now + SignedDuration::from_secs(1));
        let state = FlightEnvironment::since(now, &later, OtherPlans::default(), &rules);
        assert!(state.followed_by(&open(topology, now)).is_none());
        assert!(state.followed_by(&open(network(), later.as_of())).is_none());
    }
}
