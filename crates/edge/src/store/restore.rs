//! From the rows of a file to what an edge starts with.

use super::closure_rows::{read_closure, read_proposal, read_zone};
use super::codec::{number_of, read};
use super::difference::{CLOCK_APART, COUNTS, OWN_WEATHER, REGISTRY, WEATHER};
use super::file::{StoreFault, StoreFile, Table};
use super::opening::fact;
use super::plan_rows::read_plan;
use super::reply_rows::{Reply, read_reply};
use crate::entries::{AlarmEntry, ClosureEntry, PendingReview, ProposalEntry, ZoneEntry};
use crate::line::mailbox::MailEntry;
use crate::plans::entry::PlanEntry;
use crate::upstream::{OutboxEntry, RegistryCursor};
use jiff::{SignedDuration, Timestamp};
use rayon::prelude::*;
use serde::de::DeserializeOwned;
use skyway_contract::NewsEntry;
use skyway_engine::airspace::Closure;
use skyway_engine::network::Topology;
use std::sync::Arc;

/// What an edge knew when it ended.
#[derive(Debug, Default)]
pub(crate) struct Restored {
    /// Zones with what they close on the network.
    pub(crate) zones: Vec<(ZoneEntry, Closure)>,
    pub(crate) closures: Vec<ClosureEntry>,
    pub(crate) proposals: Vec<ProposalEntry>,
    pub(crate) holds: Vec<PendingReview>,
    pub(crate) alarms: Vec<AlarmEntry>,
    pub(crate) plans: Vec<PlanEntry>,
    /// What drones have yet to be told.
    pub(crate) mail: Vec<MailEntry>,
    pub(crate) outbox: Vec<OutboxEntry>,
    /// What the registry has yet to be told of flights and failures.
    pub(crate) news: Vec<NewsEntry>,
    pub(crate) registry: Option<RegistryCursor>,
    /// The weather as it was stated, here or at the registry, as text.
    pub(crate) weather: Option<Arc<str>>,
    pub(crate) has_own_weather: bool,
    pub(crate) unacknowledged: u64,
    /// Answers for requests that may be sent again, the oldest first.
    pub(crate) replies: Vec<(Timestamp, Reply)>,
    /// The time for which all this was; none in a new store.
    pub(crate) as_of: Option<Timestamp>,
    /// How far the wall clock was ahead of it, where it had stepped and no operator had confirmed that.
    pub(crate) clock_apart: Option<SignedDuration>,
}

/// Reads all that an edge knew. What zones close is worked out on all cores.
pub(crate) async fn restore(
    file: &mut dyn StoreFile,
    facts: &[(String, String)],
    topology: &Topology,
) -> Result<Restored, StoreFault> {
    let zones = file.load(Table::Zones).await?;
    let closures = file.load(Table::Closures).await?;
    let proposals = file.load(Table::Proposals).await?;
    let holds = file.load(Table::Holds).await?;
    let alarms = file.load(Table::Alarms).await?;
    let plans = file.load(Table::Plans).await?;
    let mail = file.load(Table::Mail).await?;
    let outbox = file.load(Table::Outbox).await?;
    let news = file.load(Table::News).await?;
    let replies = file.load(Table::Replies).await?;
    let counts: Option<(u64, Timestamp)> = read_fact(facts, COUNTS)?;
    let clock_apart: Option<i64> = read_fact(facts, CLOCK_APART)?;
    Ok(Restored {
        zones: each(&zones, |key, body| read_zone(topology, key, body))?,
        closures: each(&closures, |key, body| read_closure(topology, key, body))?,
        proposals: each(&proposals, |key, body| {
            read_proposal(topology, number_of("a proposal", key)?, body)
        })?,
        holds: numbered::<PendingReview>(&holds, ["a hold", "hold"], |it| &mut it.number)?,
        alarms: numbered::<AlarmEntry>(&alarms, ["an alarm", "alarm"], |it| &mut it.number)?,
        plans: each(&plans, |key, body| read_plan(topology, key, body))?,
        mail: numbered::<MailEntry>(&mail, ["a message", "message"], |it| &mut it.number)?,
        outbox: numbered::<OutboxEntry>(&outbox, ["an outbox entry", "outbox entry"], |it| {
            &mut it.number
        })?,
        news: each(&news, |key, body| read_news(number_of("news", key)?, body))?,
        weather: fact(facts, WEATHER).map(Arc::from),
        // Without a place in a log it can be from nowhere else.
        has_own_weather: fact(facts, OWN_WEATHER).is_some() || fact(facts, REGISTRY).is_none(),
        registry: read_fact(facts, REGISTRY)?,
        replies: each(&replies, read_reply)?,
        unacknowledged: counts.map_or(0, |(unacknowledged, _)| unacknowledged),
        as_of: counts.map(|(_, as_of)| as_of),
        clock_apart: clock_apart.map(SignedDuration::from_secs),
    })
}

fn read_fact<T: DeserializeOwned>(
    facts: &[(String, String)],
    name: &str,
) -> Result<Option<T>, StoreFault> {
    let body = fact(facts, name);
    body.map(|body| read("fact", name, body)).transpose()
}

fn read_news(number: u64, body: &str) -> Result<NewsEntry, StoreFault> {
    let entry: NewsEntry = read("news", &number.to_string(), body)?;
    match entry.number == number {
        true => Ok(entry),
        false => Err(StoreFault::damaged(format!(
            "news {number} has the number {}",
            entry.number
        ))),
    }
}

/// Rows that leave the number of what they are of to their keys.
fn numbered<T: DeserializeOwned + Send>(
    rows: &[(String, String)],
    [one, what]: [&str; 2],
    number_of_it: impl Fn(&mut T) -> &mut u64 + Sync,
) -> Result<Vec<T>, StoreFault> {
    each(rows, |key, body| {
        let number = number_of(one, key)?;
        let mut entry: T = read(what, &number.to_string(), body)?;
        *number_of_it(&mut entry) = number;
        Ok(entry)
    })
}

fn each<T: Send>(
    rows: &[(String, String)],
    read: impl Fn(&str, &str) -> Result<T, StoreFault> + Sync,
) -> Result<Vec<T>, StoreFault> {
    let rows = rows.par_iter().with_min_len(16);
    rows.map(|(key, body)| read(key, body)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planner::FlightOrder;
    use crate::plans::entry::FlownFor;
    use crate::store::codec::write;
    use serde::Serialize;

    /// Rows are read and written to the letter, and one with a member that only a newer version knows is refused.
    fn holds<T: Serialize + DeserializeOwned>(rows: &[&str]) {
        for row in rows {
            let entry: T = read("row", "1", row).expect("it is read");
            assert_eq!(write(&entry), *row);
            let newer = row.replacen('{', r#"{"newer":1,"#, 1);
            assert!(read::<T>("row", "1", &newer).is_err(), "{newer}");
        }
    }

    #[test]
    fn what_is_stored_as_it_stands_has_the_form_of_earlier_versions() {
        for content in [
            r#"{"version":2}"#,
            r#"{"offer":3}"#,
            r#""relieved""#,
            r#"{"contingencies":1}"#,
            r#"{"no_way":null}"#,
            r#"{"no_way":"{}"}"#,
            r#""declined""#,
            r#"{"ended":"diverted"}"#,
            r#"{"alarm":["no_route","open one"]}"#,
            r#""where_are_you""#,
            r#""assigned""#,
        ] {
            holds::<MailEntry>(&[&format!(
                r#"{{"drone":"d1","plan":"p1","at":"2026-11-21T09:00:00.25Z","causes":["z1"],"content":{content}}}"#
            )]);
        }
        holds::<AlarmEntry>(&[
            r#"{"kind":"lost","plan":"p1","drone":"d1","causes":["z1"],"message":"look","raised_at":"2026-11-21T09:00:00Z","renewed_at":"2026-11-21T09:00:01Z","count":2,"acknowledged":["2026-11-21T09:00:02Z","anna"],"ended_at":"2026-11-21T09:00:03Z"}"#,
            r#"{"kind":"overdue","recomposition":"1-2","causes":[],"message":"look","raised_at":"2026-11-21T09:00:00Z","renewed_at":"2026-11-21T09:00:00Z","count":1}"#,
        ]);
        holds::<PendingReview>(&[
            r#"{"origin":"registry","held_at":"2026-11-21T09:00:00Z","lifts":["z1"]}"#,
            r#"{"origin":"registry","held_at":"2026-11-21T09:00:00Z","lifts":[],"contested":{"kind":"zone","id":"z1","body":null,"aside":"held-1-2","is_refused":true,"removes":[1,7]}}"#,
        ]);
        holds::<OutboxEntry>(&[
            r#"{"kind":"closure","id":"c1","operation":"delete","body":null,"expected":[1,7],"made_at":"2026-11-21T09:00:00Z","subject":"operator:anna"}"#,
        ]);
        holds::<RegistryCursor>(&[r#"{"registry_id":"r1","epoch":1,"revision":7}"#]);
        holds::<FlownFor>(&[
            r#"{"delivery":"o1","stops":2}"#,
            r#"{"delivery":"o1","stops":2,"served":1,"landed_on":"7"}"#,
        ]);
        holds::<FlightOrder>(&[
            r#"{"airframe":"phantom3","objective":"energy"}"#,
            r#"{"airframe":"phantom3","airframe_named":true,"objective":"time","deadline":"2026-11-21T09:00:00Z"}"#,
        ]);
    }
}
