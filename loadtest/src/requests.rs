//! Requests in both dialects, and what their answers say. What operators do is REST in both.

use crate::load::Standing;
use crate::measures::Seen;
use crate::scenario::Dialect;
use crate::transport::{Told, Wanted, framed};
use bytes::Bytes;
use http::Method;
use prost::Message;
use serde::Serialize;
use serde_json::json;
use skyway::api::grpc::{IntoProto, proto};
use skyway::wire::{
    BatchAnswer, BatchEntry, DeliveryRequest, FailureReport, Failures, Freshness, Id, Outcome,
    PublicationState, Recomposition, Stamp, Telemetry, TelemetryEntry,
};

const REPORT_FAILURE: &str = "/skyway.v1.Recomposition/ReportFailure";
const REPORT_FAILURES: &str = "/skyway.v1.Recomposition/ReportFailures";
const CREATE_PLAN: &str = "/skyway.v1.Plans/CreatePlan";
const GET_PLAN: &str = "/skyway.v1.Plans/GetPlan";
const REPORT_TELEMETRY: &str = "/skyway.v1.Drones/ReportTelemetry";
const NEAREST: &str = "/skyway.v1.Network/Nearest";

/// How large the zones are that are posted, and how far beside a segment they still close it.
const ZONE_RADIUS_M: f64 = 10.0;
const ZONE_MARGIN_M: f64 = 1.0;
const ZONE_REASON: &str = "load test";
/// Entries of the list of what was answered.
const HISTORY_PAGE: u32 = 400;
/// Nodes asked for around a place.
const NEAREST_NODES: u32 = 5;

/// A reader's question.
#[derive(Clone, Debug)]
pub(crate) enum Question<'a> {
    Node(&'a Id<'static>),
    Nearest([f64; 2]),
    Plan(&'a str),
    Zones,
    Closures,
    History,
}

pub(crate) fn get(path: impl Into<String>) -> Wanted {
    Wanted::Rest {
        method: Method::GET,
        path: path.into(),
        body: Bytes::new(),
        if_match: None,
    }
}

fn delete(path: String, if_match: Option<String>) -> Wanted {
    Wanted::Rest {
        method: Method::DELETE,
        path,
        body: Bytes::new(),
        if_match,
    }
}

pub(crate) fn send(method: Method, path: impl Into<String>, body: impl Into<Bytes>) -> Wanted {
    Wanted::Rest {
        method,
        path: path.into(),
        body: body.into(),
        if_match: None,
    }
}

fn post(path: &str, body: &impl Serialize) -> Wanted {
    // Plain values with text keys always have a JSON form.
    let body = serde_json::to_vec(body).unwrap_or_default();
    send(Method::POST, path, body)
}

fn call(path: &'static str, message: &impl Message) -> Wanted {
    Wanted::Grpc {
        path,
        message: framed(message),
    }
}

pub(crate) fn failure(dialect: Dialect, report: &FailureReport) -> Wanted {
    match dialect {
        Dialect::Rest => post("/v1/failures", report),
        Dialect::Grpc => {
            let message: proto::FailureReport = report.clone().into_proto();
            call(REPORT_FAILURE, &message)
        }
    }
}

pub(crate) fn failures(dialect: Dialect, reports: &[FailureReport]) -> Wanted {
    match dialect {
        Dialect::Rest => {
            let values = reports.iter().map(|report| json!(report));
            let failures = values.collect();
            post("/v1/failures:batch", &Failures { failures })
        }
        Dialect::Grpc => {
            let failures = reports.iter().cloned().map(IntoProto::into_proto);
            let failures = failures.collect();
            call(REPORT_FAILURES, &proto::ReportFailuresRequest { failures })
        }
    }
}

pub(crate) fn delivery(dialect: Dialect, request: &DeliveryRequest) -> Wanted {
    match dialect {
        Dialect::Rest => post("/v1/plans", request),
        Dialect::Grpc => {
            let message = proto::CreatePlanRequest {
                id: request.id.clone(),
                source: request.source.text().to_owned(),
                destination: request.destination.as_ref().map(|id| id.text().to_owned()),
                drone_id: request.drone_id.clone(),
                airspeed_mps: request.airspeed_mps,
                ..proto::CreatePlanRequest::default()
            };
            call(CREATE_PLAN, &message)
        }
    }
}

/// A small zone about a place, as a GeoJSON feature.
pub(crate) fn zone_feature(id: &str, centre: [f64; 2], from: Option<&str>) -> serde_json::Value {
    let mut properties = json!({
        "radius_m": ZONE_RADIUS_M,
        "margin_m": ZONE_MARGIN_M,
        "reason": ZONE_REASON,
    });
    if let Some(from) = from {
        properties["windows"] = json!([{"from": from}]);
    }
    json!({
        "type": "Feature",
        "id": id,
        "geometry": {"type": "Point", "coordinates": centre},
        "properties": properties,
    })
}

pub(crate) fn zone(id: &str, centre: [f64; 2]) -> Wanted {
    post("/v1/zones", &zone_feature(id, centre, None))
}

/// Cancels a plan, lifts a zone or a closure.
pub(crate) fn removal(standing: &Standing) -> Wanted {
    match standing {
        // Where its drone is: without a place what it takes in flight would stay taken.
        Standing::Plan(id) => delete(format!("/v1/plans/{id}?leg=0&fraction=0"), None),
        Standing::Zone { id, etag } => delete(format!("/v1/zones/{id}"), Some(etag.clone())),
        Standing::Closure(id) => delete(format!("/v1/closures/{id}"), None),
    }
}

pub(crate) fn telemetry(dialect: Dialect, entries: Vec<TelemetryEntry>) -> Wanted {
    match dialect {
        Dialect::Rest => {
            let positions = entries.iter().map(|entry| json!(entry)).collect();
            post("/v1/telemetry", &Telemetry { positions })
        }
        Dialect::Grpc => {
            let entry = |entry: TelemetryEntry| proto::TelemetryEntry {
                drone_id: entry.drone_id,
                location: Some(entry.location.into_proto()),
                battery_fraction: entry.battery_fraction,
                ..proto::TelemetryEntry::default()
            };
            let positions = entries.into_iter().map(entry).collect();
            call(
                REPORT_TELEMETRY,
                &proto::ReportTelemetryRequest { positions },
            )
        }
    }
}

pub(crate) fn question(dialect: Dialect, question: &Question<'_>) -> Wanted {
    match (dialect, question) {
        (_, Question::Node(id)) => get(format!("/v1/nodes/{id}")),
        (_, Question::Zones) => get("/v1/zones"),
        (_, Question::Closures) => get("/v1/closures"),
        (_, Question::History) => get(format!("/v1/recompositions?page_size={HISTORY_PAGE}")),
        (Dialect::Rest, Question::Nearest([lon, lat])) => {
            get(format!("/v1/nearest?lon={lon}&lat={lat}&k={NEAREST_NODES}"))
        }
        (Dialect::Grpc, Question::Nearest([x, y])) => {
            let message = proto::NearestRequest {
                location: Some(proto::Coordinates { x: *x, y: *y }),
                k: Some(NEAREST_NODES),
            };
            call(NEAREST, &message)
        }
        (Dialect::Rest, Question::Plan(id)) => get(format!("/v1/plans/{id}")),
        (Dialect::Grpc, Question::Plan(id)) => {
            let id = (*id).to_owned();
            call(GET_PLAN, &proto::GetPlanRequest { id })
        }
    }
}

// === answers ===

/// What the answer to a failure report says, and the closure that it published.
pub(crate) fn recomposition(dialect: Dialect, told: &Told) -> Option<(Seen, Option<String>)> {
    match dialect {
        Dialect::Rest => {
            let answer: Recomposition<'_> = serde_json::from_slice(&told.body).ok()?;
            let is_published = answer.publication.state == PublicationState::Published;
            let closure = answer.publication.closure_id.map(|id| id.into_owned());
            let seen = Seen {
                answers: 1,
                rerouted: u64::from(answer.answer.outcome == Outcome::Rerouted),
                published: Some(is_published),
                ..freshness_of(&answer.stamp)
            };
            Some((seen, closure))
        }
        Dialect::Grpc => {
            let answer = proto::RecompositionAnswer::decode(told.body.clone()).ok()?;
            let publication = answer.publication.clone()?;
            let stamp = answer.stamp.clone()?;
            let is_published = publication.state() == proto::PublicationState::Published;
            let seen = Seen {
                answers: 1,
                rerouted: u64::from(is_rerouted(&answer)),
                published: Some(is_published),
                fresh: Some(stamp.freshness() == proto::Freshness::Fresh),
                registry_age_s: stamp.registry_age_s,
            };
            Some((seen, publication.closure_id))
        }
    }
}

fn is_rerouted(answer: &proto::RecompositionAnswer) -> bool {
    let answer = answer.answer.as_ref();
    answer.is_some_and(|answer| answer.outcome() == proto::Outcome::Rerouted)
}

fn freshness_of(stamp: &Stamp<'_>) -> Seen {
    Seen {
        fresh: Some(stamp.freshness == Freshness::Fresh),
        registry_age_s: stamp.registry_age_s,
        ..Seen::default()
    }
}

pub(crate) fn batch(dialect: Dialect, told: &Told) -> Option<Seen> {
    let (answers, rerouted) = match dialect {
        Dialect::Rest => {
            let batch: BatchAnswer<'_> = serde_json::from_slice(&told.body).ok()?;
            let is_rerouted = |entry: &&BatchEntry<'_>| match entry {
                BatchEntry::Recomposition(answer) => answer.answer.outcome == Outcome::Rerouted,
                BatchEntry::Problem(_) => false,
            };
            let rerouted = batch.answers.iter().filter(is_rerouted).count();
            (batch.answers.len(), rerouted)
        }
        Dialect::Grpc => {
            use proto::batch_entry::Entry;
            let batch = proto::ReportFailuresResponse::decode(told.body.clone()).ok()?;
            let is_rerouted = |entry: &&proto::BatchEntry| match &entry.entry {
                Some(Entry::Recomposition(answer)) => is_rerouted(answer),
                _ => false,
            };
            let rerouted = batch.answers.iter().filter(is_rerouted).count();
            (batch.answers.len(), rerouted)
        }
    };
    Some(Seen {
        answers: answers as u64,
        rerouted: rerouted as u64,
        ..Seen::default()
    })
}
