//! The rows that make of one stored snapshot another. Maps of snapshots share what did not change, so this
//! costs what did.

use super::closure_rows::{write_closure, write_proposal, write_zone};
use super::codec::{number_key, write};
use super::file::{Row, Table};
use super::opening::network_row;
use super::plan_rows::write_plan;
use crate::background::give_way;
use crate::line::mailbox::MailKey;
use crate::snapshot::Snapshot;
use imbl::OrdMap;
use imbl::ordmap::DiffItem;
use std::sync::Arc;

/// The fact of the cursor at the registry.
pub(super) const REGISTRY: &str = "registry";
/// The fact of the weather.
pub(super) const WEATHER: &str = "weather";
/// The fact that the weather was put here, where there is a cursor as well.
pub(super) const OWN_WEATHER: &str = "own_weather";
/// The fact of how far the wall clock is ahead of the time, in seconds, while no operator has confirmed that.
pub(super) const CLOCK_APART: &str = "clock_apart_s";
/// The fact of single numbers.
pub(super) const COUNTS: &str = "counts";

/// The rows that differ between what is stored and what is to be. On another network, all of them.
pub(super) fn difference(before: &Snapshot, after: &Snapshot) -> Vec<Row> {
    let topology = after.topology();
    let is_anew = !Arc::ptr_eq(before.topology(), topology);
    let mut changes = Changes {
        rows: Vec::new(),
        is_anew,
    };
    let text = |key: &Arc<str>| key.to_string();
    let number = |key: &u64| number_key(*key);
    changes.map(Table::Zones, &before.zones, &after.zones, text, write_zone);
    let closures = (&before.closures, &after.closures);
    changes.map(Table::Closures, closures.0, closures.1, text, |entry| {
        write_closure(topology, entry)
    });
    let proposals = (&before.proposals, &after.proposals);
    changes.map(
        Table::Proposals,
        proposals.0,
        proposals.1,
        number,
        |entry| write_proposal(topology, entry),
    );
    changes.map(Table::Holds, &before.holds, &after.holds, number, write);
    let alarms = (&before.alarms, &after.alarms);
    changes.map(Table::Alarms, alarms.0, alarms.1, number, write);
    changes.map(Table::Plans, &before.plans, &after.plans, text, |plan| {
        write_plan(topology, plan)
    });
    let mail = (&before.mail, &after.mail);
    let key = |(_, number): &MailKey| number_key(*number);
    changes.map(Table::Mail, mail.0, mail.1, key, write);
    let outbox = (&before.outbox, &after.outbox);
    changes.map(Table::Outbox, outbox.0, outbox.1, number, write);
    for (before, after) in before.news.parts().into_iter().zip(after.news.parts()) {
        changes.map(Table::News, before, after, number, write);
    }
    let mut rows = changes.rows;
    if is_anew {
        rows.push(network_row(&after.network, topology));
    }
    let registry = (&before.registry, &after.registry);
    rows.extend(changed_fact(REGISTRY, registry, write));
    let weather = (&before.weather, &after.weather);
    rows.extend(changed_fact(WEATHER, weather, |it| it.to_string()));
    let is_own = |it: &Snapshot| (it.has_own_weather && it.registry.is_some()).then_some(true);
    let own = (&is_own(before), &is_own(after));
    rows.extend(changed_fact(OWN_WEATHER, own, write));
    let apart = (&before.clock_apart, &after.clock_apart);
    rows.extend(changed_fact(CLOCK_APART, apart, |it| write(&it.as_secs())));
    if !rows.is_empty() || before.unacknowledged != after.unacknowledged {
        // For which time all this is: when the edge starts again, what was due since happens first.
        let counts = (after.unacknowledged, after.airspace.as_of());
        rows.push(Row::put(Table::Facts, COUNTS, write(&counts)));
    }
    rows
}

/// The row of a fact that has changed.
fn changed_fact<T: PartialEq>(
    name: &str,
    (before, after): (&Option<T>, &Option<T>),
    body: impl Fn(&T) -> String,
) -> Option<Row> {
    let row = || match after {
        Some(fact) => Row::put(Table::Facts, name, body(fact)),
        None => Row::remove(Table::Facts, name),
    };
    (before != after).then(row)
}

struct Changes {
    rows: Vec<Row>,
    is_anew: bool,
}

impl Changes {
    fn map<K: Ord, V: PartialEq>(
        &mut self,
        table: Table,
        before: &OrdMap<K, Arc<V>>,
        after: &OrdMap<K, Arc<V>>,
        key: impl Fn(&K) -> String,
        body: impl Fn(&V) -> String,
    ) {
        if self.is_anew {
            let gone = before.keys().filter(|key| !after.contains_key(*key));
            let gone = gone.map(|gone| Row::remove(table, key(gone)));
            self.rows.extend(gone);
            let all = after.iter();
            self.rows
                .extend(all.map(|(place, entry)| Row::put(table, key(place), body(entry))));
            return;
        }
        for item in before.diff(after) {
            give_way();
            self.rows.push(match item {
                DiffItem::Add(place, entry)
                | DiffItem::Update {
                    new: (place, entry),
                    ..
                } => Row::put(table, key(place), body(entry)),
                DiffItem::Remove(place, _) => Row::remove(table, key(place)),
            });
        }
    }
}
