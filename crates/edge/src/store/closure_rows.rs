//! Rows of zones, closures and proposals.

use super::codec::{Names, read, write};
use super::file::StoreFault;
use crate::entries::{ClosureEntry, ProposalEntry, ProposedBy, ZoneEntry};
use crate::upstream::Upstream;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use skyway_contract::{Author, Fault};
use skyway_engine::airspace::{Cause, Closure, Hits, MAX_RECORD_DEPTH, Window, Zone, record_depth};
use skyway_engine::flight::FailureType;
use skyway_engine::network::Topology;
use skyway_formats::{ZoneId, zone_from_feature, zone_to_feature};
use std::borrow::Cow;
use std::sync::Arc;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredZone {
    zone: Value,
    version: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    upstream: Option<Upstream>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    by: Option<Arc<Author>>,
}

pub(super) fn write_zone(entry: &ZoneEntry) -> String {
    write(&StoredZone {
        zone: zone_to_feature(&entry.zone),
        version: entry.version,
        upstream: entry.upstream,
        by: entry.by.clone(),
    })
}

/// A zone with what it closes, worked out anew: so it follows what this version knows of geometry.
pub(super) fn read_zone(
    topology: &Topology,
    key: &str,
    body: &str,
) -> Result<(ZoneEntry, Closure), StoreFault> {
    let stored: StoredZone = read("zone", key, body)?;
    let zone = Arc::new(zone_of(topology, key, stored.zone)?);
    let entry = ZoneEntry {
        zone: zone.clone(),
        version: stored.version,
        upstream: stored.upstream,
        by: stored.by,
    };
    Ok((entry, Closure::of_zone(topology, zone)))
}

fn zone_of(topology: &Topology, key: &str, mut feature: Value) -> Result<Zone, StoreFault> {
    // Earlier versions took deeper records. Nothing acts on one, and the zone has to close all the same.
    let properties = feature.get_mut("properties").and_then(Value::as_object_mut);
    if let Some(properties) = properties
        && let Some(record) = properties.get("record")
        && record_depth(&record.to_string()) > MAX_RECORD_DEPTH
    {
        properties.remove("record");
    }
    let zone = zone_from_feature(&feature, ZoneId::Fixed(key), topology.frame());
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
    windows: Vec<(Option<Timestamp>, Option<Timestamp>)>,
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
                .map(|window| (window.from(), window.until()))
                .collect(),
            segments: names.segments(&hits.segments),
            nodes: names.nodes(&hits.nodes),
            pads: names.nodes(&closure.pads),
        }
    }

    fn into_closure(self, names: Names<'_>) -> Result<Closure, StoreFault> {
        let cause = match self.cause {
            StoredCause::Zone(feature) => {
                let zone = zone_of(names.0, &self.id, feature)?;
                return Ok(Closure::of_zone(names.0, Arc::new(zone)));
            }
            StoredCause::Report(report) => Cause::Report { report },
            StoredCause::Operator(reason) => Cause::Operator { reason },
        };
        let windows = self.windows.iter().map(|&(from, until)| {
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
    reported_by: Option<Arc<str>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    by: Option<Arc<Author>>,
    confirmed: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    from: Option<Timestamp>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    until: Option<Timestamp>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    upstream: Option<Upstream>,
}

pub(super) fn write_closure(topology: &Topology, entry: &ClosureEntry) -> String {
    write(&StoredEntry {
        closure: StoredClosure::of(Names(topology), &entry.closure),
        version: entry.version,
        failure: entry.failure,
        reported_by: entry.reported_by.clone(),
        by: entry.by.clone(),
        confirmed: entry.confirmed,
        from: entry.from,
        until: entry.until,
        upstream: entry.upstream,
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
        reported_by: stored.reported_by,
        by: stored.by,
        confirmed: stored.confirmed,
        from: stored.from,
        until: stored.until,
        upstream: stored.upstream,
    })
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredProposal {
    reason: Cow<'static, str>,
    proposed_at: Timestamp,
    expires_at: Timestamp,
    /// With the type of failure, where a report brought it; neither where a feed did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    recomposition_id: Option<Arc<str>>,
    drone_id: Option<Arc<str>>,
    #[serde(default)]
    subject: Arc<str>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failure: Option<FailureType>,
    #[serde(default, skip_serializing_if = "<[Fault]>::is_empty")]
    faults: Arc<[Fault]>,
    closure: StoredClosure,
}

pub(super) fn write_proposal(topology: &Topology, entry: &ProposalEntry) -> String {
    let (recomposition_id, drone_id, failure, faults) = match &entry.by {
        ProposedBy::Report {
            recomposition_id,
            drone_id,
            failure,
        } => {
            let id = Some(recomposition_id.clone());
            (id, drone_id.clone(), Some(*failure), Arc::default())
        }
        ProposedBy::Feed { faults } => (None, None, None, faults.clone()),
    };
    write(&StoredProposal {
        reason: entry.reason.clone(),
        proposed_at: entry.proposed_at,
        expires_at: entry.expires_at,
        recomposition_id,
        drone_id,
        subject: entry.subject.clone(),
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
        reason: stored.reason,
        proposed_at: stored.proposed_at,
        expires_at: stored.expires_at,
        by: match (stored.recomposition_id, stored.failure) {
            (Some(recomposition_id), Some(failure)) => ProposedBy::Report {
                recomposition_id,
                drone_id: stored.drone_id,
                failure,
            },
            _ => ProposedBy::Feed {
                faults: stored.faults,
            },
        },
        subject: stored.subject,
        bytes: body.len(),
        closure: Arc::new(stored.closure.into_closure(Names(topology))?),
    })
}
