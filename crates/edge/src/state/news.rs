//! News in the state: what the registry is to be told of plans that are flown for its deliveries, and of failures.
//!
//! A plan may change several times before anybody sees a snapshot. What is told is how it stands in the snapshot, where
//! that differs from how it stood in the one before; so both are stored together, or neither is.

use super::State;
use super::timers::Due;
use crate::planner::Version;
use crate::plans::entry::{FlownFor, PlanEntry};
use crate::upstream::news::NEWS_MAX;
use crate::words;
use crate::writer::commands::{Done, NewsOrder};
use jiff::Timestamp;
use skyway_contract::{EndedAs, FailureNews, FlightNews, NewsEntry, PlanState};
use skyway_engine::network::NodeIx;
use skyway_engine::recompose::Outcome;
use std::sync::Arc;

/// One warning for this many entries that have made room.
const WARNED_EVERY: u64 = 1_000;

/// What is told of a flight, once for each change of it.
#[derive(Debug, PartialEq)]
struct Facts<'a> {
    state: PlanState,
    ended_as: Option<EndedAs>,
    version: u32,
    outcome: &'static str,
    flown_for: &'a FlownFor,
}

impl<'a> Facts<'a> {
    /// `None` of a plan that is flown for no delivery.
    fn of(plan: &'a PlanEntry) -> Option<Self> {
        let newest = newest(plan);
        let has_no_way = plan.is_active() && plan.flags.affected && plan.wanted.is_none();
        Some(Self {
            state: plan.state,
            ended_as: plan.ended_as,
            version: newest.number,
            outcome: match has_no_way {
                true => Outcome::NoRoute.name(),
                false => words::outcome_name(newest.outcome),
            },
            flown_for: plan.flown_for.as_ref()?,
        })
    }
}

/// What the drone of a plan is to fly.
fn newest(plan: &PlanEntry) -> &Arc<Version> {
    plan.wanted.as_ref().unwrap_or(&plan.reported)
}

impl State {
    /// Notes that a plan may stand otherwise than the registry was told.
    pub(super) fn note_flight(&mut self, plan: &PlanEntry) {
        let is_told = plan.flown_for.is_some() && !plan.is_quote();
        if is_told && self.settings.follows_registry {
            self.flights.touched.insert(plan.id.clone());
        }
    }

    /// Puts into the news what has become of the plans that were touched since the last snapshot.
    pub(super) fn tell_flights(&mut self) {
        if !self.settings.follows_registry {
            return;
        }
        let plans = self.next.plans.clone();
        for id in std::mem::take(&mut self.flights.touched) {
            let Some(plan) = plans.get(&id) else {
                continue;
            };
            let before = self.flights.told.get(&id).cloned();
            let before = before.as_deref().and_then(Facts::of);
            if let Some(facts) = Facts::of(plan).filter(|facts| before.as_ref() != Some(facts)) {
                self.tell_flight(plan, &facts);
            }
        }
        self.flights.told = plans;
    }

    /// Takes up what was not told when the edge ended. How plans stood then is among it, or was told.
    pub(super) fn restore_news(&mut self, news: Vec<NewsEntry>) {
        for entry in news {
            self.next.news.put(entry, usize::MAX);
        }
        self.flights.told = self.next.plans.clone();
        let plans = self.flights.told.clone();
        let is_told = |plan: &&Arc<PlanEntry>| plan.is_active() && !plan.is_quote();
        let follows = self.settings.follows_registry;
        for plan in plans.values().filter(is_told).filter(|_| follows) {
            // A drone that has taken off meanwhile is told of at once.
            self.time_take_off(plan);
        }
    }

    /// Carries out what is done to the news.
    pub(super) fn change_news(&mut self, order: NewsOrder) -> Done {
        match order {
            NewsOrder::Failed(failure) => self.put_news(None, Some(*failure)),
            NewsOrder::Taken { through } => self.next.news.forget_through(through),
            NewsOrder::Refused { number } => self.next.news.forget(number),
        }
        Done::Nothing
    }

    /// Tells that a drone of which the last news were that it holds does so no more.
    pub(super) fn tell_take_off(&mut self, id: &Arc<str>) {
        let plan = self.next.plans.get(id).cloned();
        let plan = plan.filter(|plan| self.flights.holding.contains(id) && !self.holds(plan));
        if let Some((plan, facts)) = plan
            .as_ref()
            .and_then(|plan| Some((plan, Facts::of(plan)?)))
        {
            self.tell_flight(plan, &facts);
        }
    }

    /// Whether a drone waits on a pad before it flies what it is to fly.
    fn holds(&self, plan: &PlanEntry) -> bool {
        let until = newest(plan).holds_until();
        plan.is_active() && until.is_some_and(|until| until > self.now)
    }

    fn time_take_off(&mut self, plan: &PlanEntry) {
        let until = newest(plan).holds_until();
        if let Some(until) = until.filter(|until| *until < Timestamp::MAX) {
            self.flights.holding.insert(plan.id.clone());
            self.timers.set(until, Due::TakeOff(plan.id.clone()));
        }
    }

    /// Puts into the news that a plan is over which is told of no more.
    pub(super) fn tell_last_of_flight(&mut self, ended: &PlanEntry) {
        let is_told = self.settings.follows_registry && !ended.is_quote();
        if let Some(facts) = Facts::of(ended).filter(|_| is_told) {
            self.tell_flight(ended, &facts);
        }
    }

    /// Telemetry shows at how many stops the delivery of a plan has been served.
    pub(super) fn note_served(&mut self, plan: &PlanEntry, version: u32, stops: u32) -> Done {
        let is_flown = plan.reported.number == version;
        match plan.with_served(stops).filter(|_| is_flown) {
            Some(served) => Done::Plan(self.keep_plan(served)),
            None => Done::Nothing,
        }
    }

    /// A plan with how far its delivery is at its end, its drone standing on a node where that is known.
    pub(super) fn with_end_of_delivery(
        &self,
        plan: &Arc<PlanEntry>,
        how: EndedAs,
        node: Option<NodeIx>,
    ) -> Arc<PlanEntry> {
        if plan.flown_for.is_none() {
            return plan.clone();
        }
        let sighting = plan.drone_id.as_deref().and_then(|id| self.drones.last(id));
        let flown = sighting.and_then(|sighting| sighting.flown);
        let topology = self.next.topology();
        let flown_for = plan.ended(topology, (how, node), flown.as_ref(), self.now);
        Arc::new(PlanEntry {
            flown_for,
            ..(**plan).clone()
        })
    }

    fn tell_flight(&mut self, plan: &PlanEntry, facts: &Facts<'_>) {
        let flight = self.flight_news(plan, facts);
        self.flights.holding.remove(&plan.id);
        if flight.holds {
            self.time_take_off(plan);
        }
        self.put_news(Some(flight), None);
    }

    fn flight_news(&self, plan: &PlanEntry, facts: &Facts<'_>) -> FlightNews {
        let newest = newest(plan);
        let flown_for = facts.flown_for;
        let is_on_earth = self.next.topology().frame().is_geographic();
        let sighting = plan.drone_id.as_deref().and_then(|id| self.drones.last(id));
        FlightNews {
            plan_id: plan.id.to_string(),
            delivery_id: flown_for.delivery.to_string(),
            drone_id: plan.drone_id.as_deref().map(str::to_owned),
            state: facts.state,
            ended_as: facts.ended_as,
            version: facts.version,
            outcome: facts.outcome.to_owned(),
            stops_served: flown_for.served,
            stops: flown_for.stops,
            holds: self.holds(plan),
            expected_at: flown_for.expected_at(newest).to_string(),
            causes: plan.affected_by.clone(),
            place: sighting
                .filter(|_| is_on_earth)
                .map(|sighting| sighting.coordinates),
            landed_on: flown_for.landed_on.as_deref().map(str::to_owned),
        }
    }

    fn put_news(&mut self, flight: Option<FlightNews>, failure: Option<FailureNews>) {
        let entry = NewsEntry {
            number: self.write_number(),
            at: self.now.to_string(),
            flight,
            failure,
        };
        let is_full = self.next.news.put(entry, NEWS_MAX).is_some();
        let dropped = self.next.news.dropped();
        if is_full && dropped % WARNED_EVERY == 1 {
            tracing::warn!(
                dropped,
                "too much waits to be told to the registry: the oldest of it is forgotten, failures first"
            );
        }
    }
}
