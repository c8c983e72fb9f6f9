//! What became of deliveries, read from the registry alone, beside what drones have flown and the endpoint was told.

use super::drones::Flown;
use super::town::Town;
use crate::Result;
use crate::rows::Row;
use serde_json::Value;
use std::collections::BTreeMap;

const PAGE: usize = 1_000;
const FINAL: [&str; 5] = ["delivered", "diverted", "returned", "failed", "cancelled"];

/// Faults of all deliveries.
#[derive(Default)]
pub(super) struct Judged {
    pub(super) deliveries: usize,
    pub(super) delivered: usize,
    pub(super) recomposed: usize,
    /// Without a final status, with several, or with a status after one.
    unended: usize,
    /// Ordered and not there, or there and not ordered.
    lost: usize,
    /// Flown as far as the drop more than once, or delivered and not flown.
    flown_wrong: usize,
    /// Told in another order than that of their history, or not whole.
    told_wrong: usize,
    /// The first of each kind.
    examples: Vec<String>,
}

pub(super) fn is_final(status: &str) -> bool {
    FINAL.contains(&status)
}

/// Every delivery of the registry, by its id.
pub(super) async fn all(town: &Town) -> Result<BTreeMap<String, Value>> {
    let mut found = BTreeMap::new();
    let mut page_token = String::new();
    loop {
        let path = format!("/v1/deliveries?page_size={PAGE}{page_token}");
        let page = town.client.get(&path).await?;
        for delivery in page["deliveries"].as_array().into_iter().flatten() {
            let id = delivery["id"].as_str().unwrap_or_default().to_owned();
            found.insert(id, delivery.clone());
        }
        match page["next_page_token"].as_str() {
            Some(next) => page_token = format!("&page_token={next}"),
            None => return Ok(found),
        }
    }
}

/// The statuses that a delivery had.
pub(super) fn history(delivery: &Value) -> Vec<&str> {
    let changes = delivery["history"].as_array().into_iter().flatten();
    changes
        .filter_map(|change| change["status"].as_str())
        .collect()
}

/// The plans of a delivery that drones have flown as far as the drop, each with its drone.
pub(super) fn flights(flown: &Flown, delivery: &str) -> Vec<String> {
    let prefix = format!("delivery-{delivery}-");
    let flown = flown.plans.borrow();
    let plans = flown.range(prefix.clone()..);
    let plans = plans.take_while(|(plan, _)| plan.starts_with(&prefix));
    let flights = plans
        .flat_map(|(plan, drones)| drones.iter().map(move |drone| format!("{plan} by {drone}")));
    flights.collect()
}

impl Judged {
    /// Holds what the registry says against the orders, the drones' own count and the endpoint.
    pub(super) fn of(
        town: &Town,
        ordered: &[String],
        found: &BTreeMap<String, Value>,
        flown: Option<&Flown>,
    ) -> Self {
        let mut judged = Self {
            deliveries: ordered.len(),
            ..Self::default()
        };
        let strangers = found.len().saturating_sub(ordered.len());
        judged.lost += strangers;
        for id in ordered {
            match found.get(id) {
                Some(delivery) => judged.look(town, id, delivery, flown),
                None => judged.lost += 1,
            }
        }
        judged
    }

    fn look(&mut self, town: &Town, id: &str, delivery: &Value, flown: Option<&Flown>) {
        let statuses = history(delivery);
        let ends: Vec<usize> = (0..statuses.len())
            .filter(|&number| is_final(statuses[number]))
            .collect();
        let is_ended = ends == [statuses.len().wrapping_sub(1)];
        let is_delivered = statuses.last() == Some(&"delivered");
        self.delivered += usize::from(is_delivered);
        let recompositions = delivery["recompositions"].as_array();
        self.recomposed += recompositions.map_or(0, Vec::len);
        if !is_ended {
            self.unended += 1;
            self.example(format!("{id} was {statuses:?}"));
        }
        if let Some(flown) = flown {
            let flights = flights(flown, id);
            if flights.len() != usize::from(is_delivered) {
                self.flown_wrong += 1;
                self.example(format!(
                    "{id} was flown as {flights:?} and was {statuses:?}"
                ));
            }
        }
        let received = town.receiver.received();
        let events = received.events.get(id).into_iter().flatten();
        let told: Vec<&str> = events.map(|event| event.status.as_str()).collect();
        if told != statuses {
            self.told_wrong += 1;
            self.example(format!("{id} was {statuses:?}, and {told:?} was told"));
        }
    }

    fn example(&mut self, text: String) {
        if self.examples.len() < 10 {
            self.examples.push(text);
        }
    }

    pub(super) fn rows(&self, what: &str, is_flown: bool) -> Vec<Row> {
        for example in &self.examples {
            crate::run::eprintln_line(example);
        }
        let mut rows = vec![
            Row::none(format!("{what}: lost, or never ordered"), self.lost),
            Row::none(
                format!("{what}: without one final status at the end"),
                self.unended,
            ),
            Row::none(
                format!("{what}: told to the endpoint in another way than they were"),
                self.told_wrong,
            ),
        ];
        if is_flown {
            rows.push(Row::none(
                format!(
                    "{what}: delivered and not flown there once, or flown there and not delivered"
                ),
                self.flown_wrong,
            ));
        }
        rows
    }
}
