//! What an edge counts and measures of itself, read when it is asked for. No ids and no places.

use crate::Edge;
use crate::status::Status;
use crate::sync::{ClientError, SyncStatus};
use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, EncodeMetric};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::registry::{Registry, Unit};
use std::fmt;
use std::sync::Arc;

/// Reads the figures of an edge.
#[derive(Debug)]
struct EdgeCollector {
    edge: Arc<Edge>,
}

impl Edge {
    /// Adds the figures of this edge to what is collected.
    pub fn register_metrics(self: &Arc<Self>, registry: &mut Registry) {
        let edge = self.clone();
        registry.register_collector(Box::new(EdgeCollector { edge }));
    }
}

impl Collector for EdgeCollector {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> Result<(), fmt::Error> {
        let status = self.edge.status();
        for (name, help, value) in gauges(&status) {
            let gauge = ConstGauge::new(i64::try_from(value).unwrap_or(i64::MAX));
            put(&mut encoder, name, help, None, &gauge)?;
        }
        for (name, help, value) in counters(&status) {
            put(&mut encoder, name, help, None, &ConstCounter::new(value))?;
        }
        let apart = ConstGauge::new(status.clock_apart_s.unwrap_or_default());
        let help = "Seconds that a stepped wall clock is ahead, until it is confirmed";
        put(&mut encoder, "clock_apart_seconds", help, None, &apart)?;
        encode_alarms(&status, &mut encoder)?;
        encode_store(&status, &mut encoder)?;
        match &status.registry {
            Some(sync) => encode_sync(&status, sync, &mut encoder),
            None => Ok(()),
        }
    }
}

/// A figure with its name and its meaning.
fn put(
    encoder: &mut DescriptorEncoder<'_>,
    name: &str,
    help: &str,
    unit: Option<&Unit>,
    metric: &impl EncodeMetric,
) -> Result<(), fmt::Error> {
    metric.encode(encoder.encode_descriptor(name, help, unit, metric.metric_type())?)
}

/// Names, meanings and values of what goes up and down.
fn gauges(status: &Status) -> [(&'static str, &'static str, usize); 19] {
    [
        ("network_nodes", "Nodes of the network", status.nodes),
        (
            "network_segments",
            "Segments of the network",
            status.segments,
        ),
        ("zones", "Zones, in force or not", status.zones),
        ("closures", "Closures that no zone causes", status.closures),
        (
            "blocked_segments",
            "Segments blocked now",
            status.blocked_segments,
        ),
        (
            "active_plans",
            "Plans that are not over",
            status.active_plans,
        ),
        (
            "affected_plans",
            "Plans with something closed ahead",
            status.affected_plans,
        ),
        (
            "nonconforming_plans",
            "Plans whose drones are elsewhere than they were told",
            status.nonconforming_plans,
        ),
        (
            "contingent_plans",
            "Plans whose drones are silent, or have no way",
            status.contingent_plans,
        ),
        (
            "proposals",
            "Proposals that wait for an operator",
            status.proposals,
        ),
        ("holds", "Removals that wait for an operator", status.holds),
        (
            "alarms_open",
            "Alarms that are neither acknowledged nor over",
            status.alarms,
        ),
        ("drones", "Drones seen", status.drones),
        (
            "drones_on_sessions",
            "Drones that are on a session",
            status.drones_on_sessions,
        ),
        (
            "mail",
            "Messages that drones have not received",
            status.mail,
        ),
        ("records", "Answers kept", status.records),
        (
            "records_bytes",
            "Bytes of answers kept and their worlds, about",
            status.record_bytes,
        ),
        ("tables", "Destinations with a table", status.tables),
        ("tables_bytes", "Bytes of tables", status.table_bytes),
    ]
}

/// Names, meanings and values of what only goes up.
fn counters(status: &Status) -> [(&'static str, &'static str, u64); 8] {
    [
        (
            "checker_cases",
            "Answers that the checker did not let pass, and that were not sent",
            status.checker_cases,
        ),
        (
            "store_commits",
            "Transactions that were stored",
            status.store.commits,
        ),
        (
            "store_failures",
            "Attempts to store that failed, or took too long",
            status.store.failures,
        ),
        (
            "journal_lost",
            "Decisions and answers that were not kept on the disk",
            status.store.journal_lost,
        ),
        (
            "table_hits",
            "Searches that found the table of their destination",
            status.table_hits,
        ),
        (
            "table_misses",
            "Searches without a table, answered by A*",
            status.table_misses,
        ),
        (
            "plans_unacknowledged",
            "Proposed versions that were not acknowledged in time",
            status.plans_unacknowledged,
        ),
        (
            "clock_steps",
            "Steps of the wall clock against time that only goes forward",
            status.clock_steps,
        ),
    ]
}

/// How many alarms of each kind were raised; every kind is there from the start.
fn encode_alarms(status: &Status, encoder: &mut DescriptorEncoder<'_>) -> Result<(), fmt::Error> {
    let help = "Alarms raised since the start, by kind";
    let mut family = encoder.encode_descriptor("alarms", help, None, MetricType::Counter)?;
    for (kind, count) in &status.alarms_raised {
        let labels = [("kind", kind.name())];
        ConstCounter::new(*count).encode(family.encode_family(&labels)?)?;
    }
    Ok(())
}

/// How the store stands.
fn encode_store(status: &Status, encoder: &mut DescriptorEncoder<'_>) -> Result<(), fmt::Error> {
    let durable = ConstGauge::new(i64::from(status.store.durable));
    let help = "Whether what is in force survives a restart: 1 where it does";
    put(encoder, "store_durable", help, None, &durable)?;
    let seconds = Some(&Unit::Seconds);
    let unstored = ConstGauge::new(status.store.unstored_age_s);
    let help = "For how long something has been waiting to be stored";
    put(encoder, "store_unstored_age", help, seconds, &unstored)?;
    let spent = ConstCounter::new(status.store.commit_seconds);
    let help = "How long transactions took together";
    put(encoder, "store_commit", help, seconds, &spent)
}

/// How following the registry stands.
fn encode_sync(
    status: &Status,
    sync: &SyncStatus,
    encoder: &mut DescriptorEncoder<'_>,
) -> Result<(), fmt::Error> {
    let mut gauge = |name: &str, help: &str, value: f64| {
        put(encoder, name, help, None, &ConstGauge::new(value))
    };
    if let Some(cursor) = status.stamp.registry_revision {
        let (epoch, revision) = (cursor.epoch as f64, cursor.revision as f64);
        gauge("registry_epoch", "Epoch of the registry in service", epoch)?;
        gauge(
            "registry_revision",
            "Revision of the registry in service",
            revision,
        )?;
    }
    if let Some(age_s) = status.stamp.registry_age_s {
        gauge(
            "registry_age_seconds",
            "Since the edge had all that the registry had",
            age_s,
        )?;
    }
    gauge(
        "outbox_entries",
        "Changes that the registry has yet to be told",
        sync.outbox as f64,
    )?;
    gauge(
        "outbox_age_seconds",
        "How long the oldest of them has waited",
        sync.outbox_age_s,
    )?;
    gauge(
        "news_entries",
        "News of flights and failures that the registry has yet to be told",
        sync.news as f64,
    )?;
    gauge(
        "positions_waiting",
        "Positions of drones that the registry has yet to be told",
        sync.positions as f64,
    )?;
    encode_counts(sync, encoder)
}

/// What was counted while following.
fn encode_counts(sync: &SyncStatus, encoder: &mut DescriptorEncoder<'_>) -> Result<(), fmt::Error> {
    let counters = [
        (
            "registry_nacks",
            "What the registry said and was not taken over",
            sync.nacks,
        ),
        (
            "registry_restarts",
            "Times that following began anew after a defect",
            sync.restarts,
        ),
        (
            "forwarded",
            "Changes made here that the registry has taken",
            sync.forwarded,
        ),
        (
            "forwards_refused",
            "Changes made here that the registry will not take",
            sync.forwards_refused,
        ),
        (
            "news_lost",
            "News that were forgotten untold, as there were too many, or the registry will not take them",
            sync.news_lost,
        ),
        (
            "positions_left_out",
            "Positions that were left out, as the registry did not take them in time",
            sync.positions_left_out,
        ),
    ];
    for (name, help, value) in counters {
        put(encoder, name, help, None, &ConstCounter::new(value))?;
    }
    let help = "Questions to the registry that failed, by reason";
    let mut family =
        encoder.encode_descriptor("registry_failures", help, None, MetricType::Counter)?;
    // Every reason is there from the start.
    for reason in ClientError::REASONS {
        let count = sync.failures.get(reason).copied().unwrap_or_default();
        let labels = [("reason", reason)];
        ConstCounter::new(count).encode(family.encode_family(&labels)?)?;
    }
    Ok(())
}
