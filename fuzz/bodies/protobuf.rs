//! Any bytes as each request of gRPC: what decodes becomes what REST would have read, or is refused.

use crate::networks::airspaces;
use prost::Message;
use skyway::api::grpc::{FromProto, IntoProto, proto};
use skyway::formats::{Known, resolve_report};
use skyway::wire;

/// Decodes the bytes as every request there is.
///
/// # Panics
/// When a message that decodes breaks a promise.
pub(crate) fn run(bytes: &[u8]) {
    if let Some(report) = decoded::<proto::FailureReport>(bytes) {
        failure_report(&report);
    }
    if let Some(batch) = decoded::<proto::ReportFailuresRequest>(bytes) {
        batch.failures.iter().for_each(failure_report);
    }
    if let Some(telemetry) = decoded::<proto::ReportTelemetryRequest>(bytes) {
        for entry in telemetry.positions {
            entry.location.into_iter().for_each(place);
        }
    }
    if let Some(ack) = decoded::<proto::AcknowledgePlanRequest>(bytes) {
        ack.location.into_iter().for_each(place);
    }
    decoded::<proto::CreatePlanRequest>(bytes);
    decoded::<proto::ListPlansRequest>(bytes);
    decoded::<proto::DeclinePlanRequest>(bytes);
    decoded::<proto::CompletePlanRequest>(bytes);
    decoded::<proto::GetNetworkRequest>(bytes);
    decoded::<proto::NearestRequest>(bytes);
    decoded::<proto::WatchEventsRequest>(bytes);
}

/// What decodes is a message: encoded, it decodes again.
fn decoded<M: Message + Default>(bytes: &[u8]) -> Option<M> {
    let message = M::decode(bytes).ok()?;
    let written = message.encode_to_vec();
    let again = M::decode(written.as_slice()).expect("what is encoded decodes");
    assert_eq!(again.encode_to_vec(), written);
    Some(message)
}

/// A drone always gets an outcome: every report is read, and settling it is safe.
fn failure_report(message: &proto::FailureReport) {
    for airspace in airspaces() {
        let report =
            wire::FailureReport::from_proto(message.clone()).expect("every report can be read");
        // Refused or not, it must only end.
        let _outcome = resolve_report(&report, &Known::nothing(), airspace, &mut Vec::new());
        let _message: proto::FailureReport = report.into_proto();
    }
}

fn place(message: proto::Place) {
    if let Ok(place) = wire::Place::from_proto(message) {
        let _message: proto::Place = place.into_proto();
    }
}
