//! `POST /v1/failures` and `POST /v1/failures:batch`: failure reports, answered by recompositions.
//!
//! Every report that is a JSON object and locates the drone gets an outcome; others are refused.

use super::answer::{Answer, json, set};
use super::extract::{Authenticated, Key};
use super::reading::{self, DroneJsonBody};
use super::refusals;
use crate::api::problem;
use crate::edge::{Edge, Refusal, ReportResponse};
use crate::formats::{
    ParsedReport, ReadWarning, lenient_report, members_twice, parse_report, twice,
};
use crate::wire::{BatchAnswer, BatchEntry, FailureReport, Failures, Id, Recomposition};
use axum::extract::State;
use http::{HeaderName, HeaderValue};
use std::sync::Arc;

/// How long the computation took (W3C Server Timing).
const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");

/// Answers a failure report with a recomposition.
///
/// Send at least what locates the drone: `service` with the failed leg, `remaining_path`, or `location`. A field
/// that cannot be read is passed over with a warning. With `remaining_path` the report is complete in itself.
#[utoipa::path(
    post,
    path = "/v1/failures",
    params(
        ("Idempotency-Key" = Option<String>, Header, description = "Counts as `id` where the report has none."),
    ),
    request_body(
        content = FailureReport,
        example = json!({
            "type": "navigational",
            "service": {"from": "379", "to": "406"},
            "location": {"node": "379"},
            "remaining_path": ["379", "406", "420", "450"],
            "drone": {"id": "drone-7", "battery_fraction": 0.62},
        }),
    ),
    responses(
        (
            status = 200,
            description = "What the drone is to do; `outcome` says whether there is a way.",
            body = Recomposition,
            headers(("Server-Timing" = String, description = "`recompose;dur=` the computation in milliseconds; 0 for a stored answer.")),
        ),
        (status = 422, response = refusals::UnprocessableContent),
    ),
)]
pub(super) async fn report_failure(
    State(edge): State<Arc<Edge>>,
    Authenticated(caller): Authenticated,
    Key(key): Key,
    DroneJsonBody(body): DroneJsonBody,
) -> Answer {
    let mut parsed = parse_report(&body).map_err(Refusal::from)?;
    if parsed.report.id.is_none() {
        take_key(&mut parsed, key.as_ref());
    }
    let answered = edge.report_failure(&caller, parsed).await?;
    let mut response = json(&answered.to_wire())?;
    // In milliseconds, to the microsecond; whole numbers are written faster.
    let compute_us = answered.compute_us().round() as u64;
    let timing = format!(
        "recompose;dur={}.{:03}",
        compute_us / 1000,
        compute_us % 1000
    );
    set(&mut response, SERVER_TIMING, &timing);
    Ok(response)
}

fn take_key(parsed: &mut ParsedReport, key: Option<&HeaderValue>) {
    let Some(key) = key else {
        return;
    };
    match key.to_str() {
        Ok(key) => parsed.report.id = Some(Id::new(key.to_owned())),
        Err(_) => {
            let message = "the header Idempotency-Key is not plain text and is passed over";
            let warning = ReadWarning::new("idempotency_key_ignored", message);
            parsed.warnings.push(warning);
        }
    }
}

/// Answers many failure reports at once, in their order, each with its own recomposition or problem.
#[utoipa::path(
    post,
    path = "/v1/failures:batch",
    request_body(
        content = Failures,
        example = json!({"failures": [
            {"type": "navigational", "service": {"from": "379", "to": "406"}, "remaining_path": ["379", "406", "420", "450"]},
            {"type": "operational", "location": [151.2097388, -33.862532]},
        ]}),
    ),
    responses(
        (status = 200, description = "An entry for each report, in order.", body = BatchAnswer),
    ),
)]
pub(super) async fn report_failures(
    State(edge): State<Arc<Edge>>,
    Authenticated(caller): Authenticated,
    DroneJsonBody(body): DroneJsonBody,
) -> Answer {
    let batch: Failures = reading::body(&body, "batch of failure reports")?;
    let mut reports: Vec<_> = batch.failures.into_iter().map(lenient_report).collect();
    for pointer in members_twice(&body) {
        let in_report = pointer
            .strip_prefix("/failures/")
            .and_then(|rest| rest.split_once('/'));
        if let Some((number, place)) = in_report
            && let Some(Ok(parsed)) = number
                .parse::<usize>()
                .ok()
                .and_then(|number| reports.get_mut(number))
        {
            parsed.warnings.push(twice(&format!("/{place}")));
        }
    }
    let answers = edge.report_failures(&caller, reports).await?;
    json(&BatchAnswer {
        answers: answers.iter().map(entry).collect(),
    })
}

fn entry(answer: &Result<ReportResponse, Refusal>) -> BatchEntry<'_> {
    match answer {
        Ok(answered) => BatchEntry::Recomposition(Box::new(answered.to_wire())),
        Err(refusal) => BatchEntry::Problem(Box::new(problem::document(refusal, None))),
    }
}
