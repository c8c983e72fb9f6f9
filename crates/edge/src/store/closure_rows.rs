//! Rows of zones, closures, proposals, holds and the outbox.

use super::codec::{Instant, Names, read, write};
use super::file::StoreFault;
use crate::entries::{
    ClosureEntry, Contested, PendingReview, ProposalEntry, ProposedBy, ZoneEntry,
};
use crate::upstream::{OutboxEntry, RegistryCursor, Upstream};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use skyway_contract::{Author, ChangeOperation, Fault, ObjectKind};
use skyway_engine::airspace::{Cause, Closure, Hits, Window, Zone};
use skyway_engine::flight::FailureType;
use skyway_engine::network::Topology;
use skyway_formats::{ZoneId, zone_from_feature, zone_to_feature};
use std::borrow::Cow;
use std::sync::Arc;

/// The epoch and the revision of a version at the registry.
type StoredUpstream = (u64, u64);

fn upstream(stored: Option<StoredUpstream>) -> Option<Upstream> {
    stored.map(|(epoch, revision)| Upstream { epoch, revision })
}

fn stored(upstream: Option<Upstream>) -> Option<StoredUpstream> {
    upstream.map(|upstream| (upstream.epoch, upstream.revision))
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredZone {
    zone: Value,
    version: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    upstream: Option<StoredUpstream>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    by: Option<Author>,
}

pub(super) fn write_zone(entry: &ZoneEntry) -> String {
    write(&StoredZone {
        zone: zone_to_feature(&entry.zone),
        version: entry.version,
        upstream: stored(entry.upstream),
        by: entry.by.as_deref().cloned(),
    })
}

/// A zone with what it closes, worked out anew: so it follows what this version knows of geometry.
pub(super) fn read_zone(
    topology: &Topology,
    key: &str,
    body: &str,
) -> Result<(ZoneEntry, Closure), StoreFault> {
    let stored: StoredZone = read("zone", key, body)?;
    let zone = Arc::new(zone_of(topology, key, &stored.zone)?);
    let entry = ZoneEntry {
        zone: zone.clone(),
        version: stored.version,
        upstream: upstream(stored.upstream),
        by: stored.by.map(Arc::new),
    };
    Ok((entry, Closure::of_zone(topology, zone)))
}

fn zone_of(topology: &Topology, key: &str, feature: &Value) -> Result<Zone, StoreFault> {
    let zone = zone_from_feature(feature, ZoneId::Fixed(key), topology.frame());
    zone.map_err(|problems| {
        let first = problems.first().map(ToString::to_string);
        let first = first.unwrap_or_default();
        StoreFault::damaged(format!("zone '{key}' is not valid: {first}"))
    })
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum StoredCause {
    Zone(Value),
    Report(String),
    Operator(String),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredClosure {
    id: String,
    cause: StoredCause,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    windows: Vec<(Option<Instant>, Option<Instant>)>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    segments: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    nodes: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pads: Vec<String>,
}

impl StoredClosure {
    fn of(names: Names<'_>, closure: &Closure) -> Self {
        // What a zone closes is worked out when it is read.
        let (cause, hits) = match &closure.cause {
            Cause::Zone(zone) => (StoredCause::Zone(zone_to_feature(zone)), &Hits::default()),
            Cause::Report { report } => (StoredCause::Report(report.clone()), &closure.hits),
            Cause::Operator { reason } => (StoredCause::Operator(reason.clone()), &closure.hits),
        };
        let windows = closure.windows.iter();
        Self {
            id: closure.id.clone(),
            cause,
            windows: windows
                .map(|window| {
                    (
                        window.from().map(Into::into),
                        window.until().map(Into::into),
                    )
                })
                .collect(),
            segments: names.segments(&hits.segments),
            nodes: names.nodes(&hits.nodes),
            pads: names.nodes(&closure.pads),
        }
    }

    fn into_closure(self, names: Names<'_>) -> Result<Closure, StoreFault> {
        let cause = match self.cause {
            StoredCause::Zone(feature) => {
                let zone = zone_of(names.0, &self.id, &feature)?;
                return Ok(Closure::of_zone(names.0, Arc::new(zone)));
            }
            StoredCause::Report(report) => Cause::Report { report },
            StoredCause::Operator(reason) => Cause::Operator { reason },
        };
        let windows = self.windows.iter().map(|(from, until)| {
            let (from, until) = (
                Instant::read_some(from.as_ref())?,
                Instant::read_some(until.as_ref())?,
            );
            Window::new(from, until).map_err(|error| StoreFault::damaged(error.to_string()))
        });
        Ok(Closure {
            windows: windows.collect::<Result<_, _>>()?,
            hits: Hits::new(
                names.find_segments(&self.segments)?,
                names.find_nodes(&self.nodes)?,
            ),
            pads: names.find_nodes(&self.pads)?,
            cause,
            id: self.id,
        })
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredEntry {
    closure: StoredClosure,
    version: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<FailureType>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reported_by: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    by: Option<Author>,
    confirmed: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    from: Option<Instant>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    until: Option<Instant>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    upstream: Option<StoredUpstream>,
}

pub(super) fn write_closure(topology: &Topology, entry: &ClosureEntry) -> String {
    write(&StoredEntry {
        closure: StoredClosure::of(Names(topology), &entry.closure),
        version: entry.version,
        failure: entry.failure,
        reported_by: entry.reported_by.as_deref().map(str::to_owned),
        by: entry.by.as_deref().cloned(),
        confirmed: entry.confirmed,
        from: entry.from.map(Into::into),
        until: entry.until.map(Into::into),
        upstream: stored(entry.upstream),
    })
}

pub(super) fn read_closure(
    topology: &Topology,
    key: &str,
    body: &str,
) -> Result<ClosureEntry, StoreFault> {
    let stored: StoredEntry = read("closure", key, body)?;
    Ok(ClosureEntry {
        closure: Arc::new(stored.closure.into_closure(Names(topology))?),
        version: stored.version,
        failure: stored.failure,
        reported_by: stored.reported_by.map(Arc::from),
        by: stored.by.map(Arc::new),
        confirmed: stored.confirmed,
        from: Instant::read_some(stored.from.as_ref())?,
        until: Instant::read_some(stored.until.as_ref())?,
        upstream: upstream(stored.upstream),
    })
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredProposal {
    reason: String,
    proposed_at: Instant,
    expires_at: Instant,
    /// With the type of failure, where a report brought it; neither where a feed did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    recomposition_id: Option<String>,
    drone_id: Option<String>,
    #[serde(default)]
    subject: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<FailureType>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    faults: Vec<Fault>,
    closure: StoredClosure,
}

pub(super) fn write_proposal(topology: &Topology, entry: &ProposalEntry) -> String {
    let (recomposition_id, drone_id, failure, faults) = match &entry.by {
        ProposedBy::Report {
            recomposition_id,
            drone_id,
            failure,
        } => {
            let drone_id = drone_id.as_deref().map(str::to_owned);
            let recomposition_id = Some(recomposition_id.to_string());
            (recomposition_id, drone_id, Some(*failure), Vec::new())
        }
        ProposedBy::Feed { faults } => (None, None, None, faults.to_vec()),
    };
    write(&StoredProposal {
        reason: entry.reason.to_string(),
        proposed_at: entry.proposed_at.into(),
        expires_at: entry.expires_at.into(),
        recomposition_id,
        drone_id,
        subject: entry.subject.to_string(),
        failure,
        faults,
        closure: StoredClosure::of(Names(topology), &entry.closure),
    })
}

pub(super) fn read_proposal(
    topology: &Topology,
    number: u64,
    body: &str,
) -> Result<ProposalEntry, StoreFault> {
    let stored: StoredProposal = read("proposal", &number.to_string(), body)?;
    Ok(ProposalEntry {
        number,
        reason: Cow::Owned(stored.reason),
        proposed_at: stored.proposed_at.read()?,
        expires_at: stored.expires_at.read()?,
        by: match (stored.recomposition_id, stored.failure) {
            (Some(id), Some(failure)) => ProposedBy::Report {
                recomposition_id: Arc::from(id),
                drone_id: stored.drone_id.map(Arc::from),
                failure,
            },
            _ => ProposedBy::Feed {
                faults: Arc::from(stored.faults),
            },
        },
        subject: Arc::from(stored.subject),
        bytes: body.len(),
        closure: Arc::new(stored.closure.into_closure(Names(topology))?),
    })
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredHold {
    origin: String,
    held_at: Instant,
    lifts: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    contested: Option<StoredContested>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredContested {
    kind: ObjectKind,
    id: String,
    body: Option<String>,
    aside: Option<String>,
    is_refused: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    removes: Option<StoredUpstream>,
}

pub(super) fn write_hold(entry: &PendingReview) -> String {
    write(&StoredHold {
        origin: entry.origin.to_string(),
        held_at: entry.held_at.into(),
        lifts: entry.lifts.clone(),
        contested: entry.contested.as_deref().map(|contested| StoredContested {
            kind: contested.kind,
            id: contested.id.to_string(),
            body: contested.body.as_deref().map(str::to_owned),
            aside: contested.aside.as_deref().map(str::to_owned),
            is_refused: contested.is_refused,
            removes: stored(contested.removes),
        }),
    })
}

pub(super) fn read_hold(number: u64, body: &str) -> Result<PendingReview, StoreFault> {
    let stored: StoredHold = read("hold", &number.to_string(), body)?;
    Ok(PendingReview {
        number,
        origin: Arc::from(stored.origin),
        held_at: stored.held_at.read()?,
        lifts: stored.lifts,
        contested: stored.contested.map(|stored| {
            Arc::new(Contested {
                kind: stored.kind,
                id: Arc::from(stored.id),
                body: stored.body.map(Arc::from),
                aside: stored.aside.map(Arc::from),
                is_refused: stored.is_refused,
                removes: upstream(stored.removes),
            })
        }),
    })
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredOutbox {
    kind: ObjectKind,
    id: String,
    operation: ChangeOperation,
    body: Option<String>,
    expected: Option<StoredUpstream>,
    made_at: Instant,
    subject: String,
}

pub(super) fn write_outbox(entry: &OutboxEntry) -> String {
    write(&StoredOutbox {
        kind: entry.kind,
        id: entry.id.to_string(),
        operation: entry.operation,
        body: entry.body.as_deref().map(str::to_owned),
        expected: stored(entry.expected),
        made_at: entry.made_at.into(),
        subject: entry.subject.to_string(),
    })
}

pub(super) fn read_outbox(number: u64, body: &str) -> Result<OutboxEntry, StoreFault> {
    let stored: StoredOutbox = read("outbox entry", &number.to_string(), body)?;
    Ok(OutboxEntry {
        number,
        kind: stored.kind,
        id: Arc::from(stored.id),
        operation: stored.operation,
        body: stored.body.map(Arc::from),
        expected: upstream(stored.expected),
        made_at: stored.made_at.read()?,
        subject: Arc::from(stored.subject),
    })
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredCursor {
    registry_id: String,
    epoch: u64,
    revision: u64,
}

pub(super) fn write_cursor(cursor: &RegistryCursor) -> String {
    write(&StoredCursor {
        registry_id: cursor.registry_id.to_string(),
        epoch: cursor.epoch,
        revision: cursor.revision,
    })
}

pub(super) fn read_cursor(body: &str) -> Result<RegistryCursor, StoreFault> {
    let stored: StoredCursor = read("fact", "registry", body)?;
    Ok(RegistryCursor {
        registry_id: Arc::from(stored.registry_id),
        epoch: stored.epoch,
        revision: stored.revision,
    })
}
