//! Zones and closures as a registry has them: read strictly, by the judges of what operators send, and written.

use super::Upstream;
use crate::background::give_way;
use crate::entries::{ClosureEntry, windows};
use crate::words;
use jiff::Timestamp;
use skyway_contract::{ClosureDraft, ObjectKind, PublishedCause, PublishedClosure, Weather};
use skyway_engine::airspace::{Cause, Closure, Zone};
use skyway_engine::flight::FailureType;
use skyway_engine::network::Topology;
use skyway_formats::{ZoneId, zone_to_feature};
use skyway_service::intake::{ClosureIds, read_closure, read_weather, read_zone};
use skyway_service::refusal::Refusal;
use std::sync::Arc;

/// A zone or a closure that a registry has, worked out on a topology.
#[derive(Clone, Debug)]
pub(crate) struct Published {
    pub(crate) kind: ObjectKind,
    pub(crate) id: Arc<str>,
    pub(crate) upstream: Upstream,
    pub(crate) body: Arc<str>,
    pub(crate) thing: Restriction,
}

/// What is put.
#[derive(Clone, Debug)]
pub(crate) enum Restriction {
    /// A zone, as the closure it causes.
    Zone(Arc<Closure>),
    /// A closure that no zone causes.
    Closure(Box<ClosureEntry>),
}

impl Restriction {
    /// What it closes.
    pub(crate) fn closure(&self) -> &Arc<Closure> {
        match self {
            Self::Zone(closure) => closure,
            Self::Closure(entry) => &entry.closure,
        }
    }

    /// When it is over; none where it never is.
    pub(crate) fn ends_at(&self) -> Option<Timestamp> {
        match self {
            // A zone stays until it is lifted, whatever its windows.
            Self::Zone(_) => None,
            Self::Closure(entry) => entry.until,
        }
    }
}

/// Why a body of the registry is of no use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BodyFault {
    pub(crate) code: &'static str,
    pub(crate) reason: String,
}

impl BodyFault {
    pub(crate) fn of(kind: ObjectKind, reason: impl ToString) -> Self {
        let code = match kind {
            ObjectKind::Network => "network_invalid",
            ObjectKind::Closure => "closure_invalid",
            ObjectKind::Weather => "weather_invalid",
            ObjectKind::Zone => "zone_invalid",
        };
        Self {
            code,
            reason: reason.to_string(),
        }
    }
}

/// A refusal in one line.
fn told(kind: ObjectKind, refusal: &Refusal) -> BodyFault {
    let first = refusal.faults.first();
    let place = first.map_or_else(String::new, |fault| {
        format!(": {} {}", fault.pointer, fault.message)
    });
    BodyFault::of(kind, format!("{}{place}", refusal.detail))
}

/// Reads a zone or a closure, and works out what it closes.
///
/// # Errors
/// The first thing wrong with it.
pub(crate) fn read_thing(
    kind: ObjectKind,
    id: &str,
    body: &str,
    topology: &Topology,
    margin_m: f64,
) -> Result<Restriction, BodyFault> {
    // Thousands may come at once.
    give_way();
    match kind {
        ObjectKind::Zone => {
            let zone = read_feature(id, body, topology, margin_m)?;
            let closure = Closure::of_zone(topology, Arc::new(zone));
            Ok(Restriction::Zone(Arc::new(closure)))
        }
        ObjectKind::Closure => {
            let entry = read_published(id, body, topology)?;
            Ok(Restriction::Closure(Box::new(entry)))
        }
        ObjectKind::Network | ObjectKind::Weather => {
            Err(BodyFault::of(kind, "it is neither a zone nor a closure"))
        }
    }
}

fn read_feature(
    id: &str,
    body: &str,
    topology: &Topology,
    margin_m: f64,
) -> Result<Zone, BodyFault> {
    let kind = ObjectKind::Zone;
    let feature = serde_json::from_str(body).map_err(|error| BodyFault::of(kind, error))?;
    let zone = read_zone(feature, ZoneId::Fixed(id), topology.frame(), margin_m);
    zone.map_err(|refusal| told(kind, &refusal))
}

fn read_published(id: &str, body: &str, topology: &Topology) -> Result<ClosureEntry, BodyFault> {
    let kind = ObjectKind::Closure;
    let published: PublishedClosure =
        serde_json::from_str(body).map_err(|error| BodyFault::of(kind, error))?;
    if published.id.as_deref() != Some(id) {
        return Err(BodyFault::of(kind, "its body has another id"));
    }
    let draft = ClosureDraft {
        id: published.id,
        reason: published.reason.clone(),
        segments: published.segments,
        nodes: published.nodes,
        pads: published.pads,
        from: published.from,
        until: published.until,
    };
    let ids = match published.cause {
        PublishedCause::Operator => ClosureIds::OfOperators,
        PublishedCause::Report => ClosureIds::OfReports,
    };
    // A registry tells closures that are over, too, until it lifts them.
    let read = read_closure(&draft, topology, Timestamp::MIN, ids);
    let read = read.map_err(|refusal| told(kind, &refusal))?;
    let reason = published.reason.unwrap_or_default();
    let is_report = published.cause == PublishedCause::Report;
    let mut types = FailureType::ALL.into_iter();
    let closure = Closure {
        id: id.to_owned(),
        windows: windows(Some(read.from), read.until),
        hits: read.hits,
        pads: read.pads,
        cause: match is_report {
            // The report itself is known to the edge that it was sent to.
            true => Cause::Report {
                report: String::new(),
            },
            false => Cause::Operator {
                reason: reason.clone(),
            },
        },
    };
    Ok(ClosureEntry {
        closure: Arc::new(closure),
        version: 0,
        failure: types.find(|failure| is_report && failure.name() == reason),
        reported_by: published.reported_by.map(Arc::from),
        by: None,
        confirmed: published.confirmed,
        from: Some(read.from),
        until: read.until,
        upstream: None,
    })
}

/// Checks the text of weather.
///
/// # Errors
/// The first thing wrong with it.
pub(crate) fn check_weather(body: &str, topology: &Topology) -> Result<(), BodyFault> {
    let kind = ObjectKind::Weather;
    let weather: Weather =
        serde_json::from_str(body).map_err(|error| BodyFault::of(kind, error))?;
    read_weather(&weather, topology.frame()).map_err(|refusal| told(kind, &refusal))
}

/// A zone as a registry keeps it.
pub(crate) fn zone_body(zone: &Zone) -> Arc<str> {
    Arc::from(zone_to_feature(zone).to_string())
}

/// Whether two bodies say the same: older versions wrote the ids of nodes in closures as integers.
pub(crate) fn says_the_same(one: &str, other: &str) -> bool {
    let closure = |body| serde_json::from_str::<PublishedClosure>(body).ok();
    one == other || closure(one).is_some_and(|one| Some(one) == closure(other))
}

/// When a closure ends, by its body; none where it never does.
pub(crate) fn end_of(body: &str) -> Option<Timestamp> {
    let closure: PublishedClosure = serde_json::from_str(body).ok()?;
    closure.until?.parse().ok()
}

/// A closure as a registry keeps it, to the byte, so that it is recognised when it comes back.
pub(crate) fn closure_body(topology: &Topology, entry: &ClosureEntry) -> Arc<str> {
    let closure = &entry.closure;
    let (cause, reason) = match &closure.cause {
        Cause::Report { .. } => {
            let name = entry.failure.map(|failure| failure.name().to_owned());
            (PublishedCause::Report, name)
        }
        Cause::Operator { reason } => (PublishedCause::Operator, Some(reason.clone())),
        Cause::Zone(zone) => (
            PublishedCause::Operator,
            zone.reason().map(ToOwned::to_owned),
        ),
    };
    let segments = closure.hits.segments.iter();
    let published = PublishedClosure {
        id: Some(closure.id.clone()),
        cause,
        reason: reason.filter(|reason| !reason.is_empty()),
        reported_by: match cause {
            PublishedCause::Report => entry.reported_by.as_deref().map(ToOwned::to_owned),
            PublishedCause::Operator => None,
        },
        confirmed: entry.confirmed,
        segments: segments
            .map(|&segment| topology.segment_id(segment).into_owned())
            .collect(),
        nodes: words::node_ids(topology, &closure.hits.nodes),
        pads: words::node_ids(topology, &closure.pads),
        from: entry.from.map(|from| from.to_string()),
        until: entry.until.map(|until| until.to_string()),
    };
    // Plain texts and lists of them always have a JSON form.
    let value = serde_json::to_value(&published).unwrap_or_default();
    Arc::from(value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_say_the_same_whichever_form_their_ids_have() {
        let older = r#"{"id":"c","cause":"operator","confirmed":true,"nodes":[406]}"#;
        let newer = r#"{"id":"c","cause":"operator","confirmed":true,"nodes":["406"]}"#;
        assert!(says_the_same(older, newer) && says_the_same(older, older));
        assert!(!says_the_same(older, &newer.replace("406", "407")));
        assert!(!says_the_same("{}", "no closure"));
    }
}
