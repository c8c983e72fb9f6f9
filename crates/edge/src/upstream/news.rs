//! News: what the registry has yet to be told of flights and failures, in its order.
//!
//! They lie beside the outbox and not in it, so that no zone waits behind them. Where they become too many the oldest
//! failures go first: what is computed of many failures bears the loss of some, and a delivery does not bear that of its
//! end.

use crate::plans::entry::PlanEntry;
use imbl::OrdMap;
use skyway_contract::NewsEntry;
use std::collections::BTreeSet;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// The most entries that wait.
pub(crate) const NEWS_MAX: usize = 100_000;

/// Entries by their numbers.
type Entries = OrdMap<u64, Arc<NewsEntry>>;

/// What the registry is to be told of plans.
#[derive(Debug, Default)]
pub(crate) struct Flights {
    /// Those that were touched since the last snapshot.
    pub(crate) touched: BTreeSet<Arc<str>>,
    /// All plans as they stood in it.
    pub(crate) told: OrdMap<Arc<str>, Arc<PlanEntry>>,
    /// Those of which the last news were that their drones hold until a time.
    pub(crate) holding: BTreeSet<Arc<str>>,
}

/// What waits to be told.
#[derive(Clone, Debug, Default)]
pub(crate) struct News {
    flights: Entries,
    failures: Entries,
    /// How many have made room for others since the start.
    dropped: u64,
}

impl News {
    /// Puts an entry behind those that wait; where there are as many as `most`, an older one makes room. Gives its number.
    pub(crate) fn put(&mut self, entry: NewsEntry, most: usize) -> Option<u64> {
        let mut dropped = None;
        if self.len() >= most {
            let full = match self.failures.is_empty() {
                true => &mut self.flights,
                false => &mut self.failures,
            };
            dropped = full.get_min().map(|(number, _)| *number);
            dropped.iter().for_each(|number| drop(full.remove(number)));
            self.dropped += u64::from(dropped.is_some());
        }
        let part = match entry.flight.is_some() {
            true => &mut self.flights,
            false => &mut self.failures,
        };
        part.insert(entry.number, Arc::new(entry));
        dropped
    }

    /// The registry has these.
    pub(crate) fn forget_through(&mut self, through: u64) {
        for part in [&mut self.flights, &mut self.failures] {
            while let Some(&(number, _)) = part.get_min().filter(|(number, _)| *number <= through) {
                part.remove(&number);
            }
        }
    }

    /// The registry will never take this one.
    pub(crate) fn forget(&mut self, number: u64) {
        for part in [&mut self.flights, &mut self.failures] {
            part.remove(&number);
        }
    }

    /// All of them, in their order.
    pub(crate) fn entries(&self) -> impl Iterator<Item = &Arc<NewsEntry>> {
        self.between(0..=u64::MAX)
    }

    /// Those with these numbers, in their order.
    pub(crate) fn between(
        &self,
        numbers: RangeInclusive<u64>,
    ) -> impl Iterator<Item = &Arc<NewsEntry>> {
        let mut flights = self.flights.range(numbers.clone()).peekable();
        let mut failures = self.failures.range(numbers).peekable();
        std::iter::from_fn(move || {
            let next = match (flights.peek(), failures.peek()) {
                (Some((flight, _)), Some((failure, _))) if failure < flight => failures.next(),
                (None, _) => failures.next(),
                _ => flights.next(),
            };
            next.map(|(_, entry)| entry)
        })
    }

    /// The number of the last one.
    pub(crate) fn last(&self) -> Option<u64> {
        let parts = self.parts().into_iter();
        parts.filter_map(|part| Some(part.get_max()?.0)).max()
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.flights.len() + self.failures.len()
    }

    /// How many have made room for others since the start.
    pub(crate) fn dropped(&self) -> u64 {
        self.dropped
    }

    /// What is stored: flights and failures.
    pub(crate) fn parts(&self) -> [&Entries; 2] {
        [&self.flights, &self.failures]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skyway_contract::{FailureNews, FailureType, FlightNews, PlanState};

    fn entry(number: u64) -> NewsEntry {
        NewsEntry {
            number,
            at: String::new(),
            flight: None,
            failure: None,
        }
    }

    fn flight(number: u64) -> NewsEntry {
        let flight = FlightNews {
            plan_id: "p".to_owned(),
            delivery_id: "o".to_owned(),
            drone_id: None,
            state: PlanState::Accepted,
            ended_as: None,
            version: 1,
            outcome: "composed".to_owned(),
            stops_served: 0,
            stops: 2,
            holds: false,
            expected_at: String::new(),
            causes: Vec::new(),
            place: None,
            landed_on: None,
        };
        NewsEntry {
            flight: Some(flight),
            ..entry(number)
        }
    }

    fn failure(number: u64) -> NewsEntry {
        let failure = FailureNews {
            recomposition_id: "r".to_owned(),
            drone_id: None,
            failure_type: FailureType::Navigational,
            segment: None,
            outcome: "rerouted".to_owned(),
            elapsed_us: 1.0,
        };
        NewsEntry {
            failure: Some(failure),
            ..entry(number)
        }
    }

    fn numbers(news: &News) -> Vec<u64> {
        news.entries().map(|entry| entry.number).collect()
    }

    #[test]
    fn they_are_told_in_their_order_and_forgotten_once_they_are() {
        let mut news = News::default();
        for entry in [failure(1), flight(2), flight(4), failure(5), flight(6)] {
            assert_eq!(news.put(entry, 9), None);
        }
        assert_eq!(numbers(&news), [1, 2, 4, 5, 6]);
        assert_eq!(news.last(), Some(6));
        news.forget_through(4);
        assert_eq!(numbers(&news), [5, 6]);
        news.forget(6);
        assert_eq!(numbers(&news), [5]);
        assert_eq!((news.len(), news.dropped()), (1, 0));
    }

    #[test]
    fn failures_make_room_first_and_flights_only_for_flights() {
        let mut news = News::default();
        for entry in [flight(1), failure(2), flight(3), failure(4)] {
            news.put(entry, 4);
        }
        assert_eq!(news.put(flight(5), 4), Some(2));
        assert_eq!(news.put(failure(6), 4), Some(4));
        assert_eq!(news.put(flight(7), 4), Some(6));
        assert_eq!(numbers(&news), [1, 3, 5, 7]);
        assert_eq!(news.put(flight(8), 4), Some(1), "there is nothing else");
        assert_eq!(numbers(&news), [3, 5, 7, 8]);
        assert_eq!(news.dropped(), 4);
    }
}
