//! From the rows of a file to what an edge starts with.

use super::alarm_rows::read_alarm;
use super::closure_rows::{
    read_closure, read_cursor, read_hold, read_outbox, read_proposal, read_zone,
};
use super::codec::{Instant, number_of, read};
use super::difference::{CLOCK_APART, COUNTS, REGISTRY, WEATHER};
use super::file::{StoreFault, StoreFile, Table};
use super::mail_rows::read_message;
use super::news_rows::read_news;
use super::opening::fact;
use super::plan_rows::read_plan;
use super::reply_rows::{Reply, read_reply};
use crate::entries::{AlarmEntry, ClosureEntry, PendingReview, ProposalEntry, ZoneEntry};
use crate::line::mailbox::MailEntry;
use crate::plans::entry::PlanEntry;
use crate::upstream::{OutboxEntry, RegistryCursor};
use jiff::{SignedDuration, Timestamp};
use rayon::prelude::*;
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
    let counts: Option<(u64, Instant)> = fact(facts, COUNTS)
        .map(|body| read("fact", COUNTS, body))
        .transpose()?;
    let (unacknowledged, as_of) = match counts {
        Some((unacknowledged, as_of)) => (unacknowledged, Some(as_of.read()?)),
        None => (0, None),
    };
    let clock_apart: Option<i64> = fact(facts, CLOCK_APART)
        .map(|body| read("fact", CLOCK_APART, body))
        .transpose()?;
    Ok(Restored {
        zones: each(&zones, |key, body| read_zone(topology, key, body))?,
        closures: each(&closures, |key, body| read_closure(topology, key, body))?,
        proposals: each(&proposals, |key, body| {
            read_proposal(topology, number_of("a proposal", key)?, body)
        })?,
        holds: each(&holds, |key, body| {
            read_hold(number_of("a hold", key)?, body)
        })?,
        alarms: each(&alarms, |key, body| {
            read_alarm(number_of("an alarm", key)?, body)
        })?,
        plans: each(&plans, |key, body| read_plan(topology, key, body))?,
        mail: each(&mail, |key, body| {
            read_message(number_of("a message", key)?, body)
        })?,
        outbox: each(&outbox, |key, body| {
            read_outbox(number_of("an outbox entry", key)?, body)
        })?,
        news: each(&news, |key, body| read_news(number_of("news", key)?, body))?,
        weather: fact(facts, WEATHER).map(Arc::from),
        registry: fact(facts, REGISTRY).map(read_cursor).transpose()?,
        replies: each(&replies, read_reply)?,
        unacknowledged,
        as_of,
        clock_apart: clock_apart.map(SignedDuration::from_secs),
    })
}

fn each<T: Send>(
    rows: &[(String, String)],
    read: impl Fn(&str, &str) -> Result<T, StoreFault> + Sync,
) -> Result<Vec<T>, StoreFault> {
    let rows = rows.par_iter().with_min_len(16);
    rows.map(|(key, body)| read(key, body)).collect()
}
