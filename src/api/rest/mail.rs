//! `GET /v1/drones/{id}/events` and `POST /v1/drones/{id}/received`: what a drone is told, for programs without gRPC.

use super::answer::{Answer, json};
use super::events::{KEEP_ALIVE, LAST_EVENT_ID, RETRY};
use super::extract::{self, Authenticated, Call, PathId};
use super::reading::{self, JsonBody};
use super::refusals;
use crate::edge::{Edge, Mail};
use crate::wire::{DroneMessage, MailLeft, Received};
use axum::extract::State;
use axum::response::IntoResponse;
use axum::response::sse::{Event, KeepAlive, Sse};
use http::HeaderMap;
use serde::Deserialize;
use std::convert::Infallible;
use std::sync::Arc;
use tokio_stream::StreamExt;
use utoipa::IntoParams;

/// What a drone has received before.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct MailParameters {
    /// Id of the last message that the drone has received; `Last-Event-ID` counts where both are given.
    #[param(value_type = String, required = false)]
    after: Option<String>,
}

/// Tells a drone what is in its mailbox, and what comes into it.
///
/// Each event has the id of a message, its kind as `event`, and a `DroneMessage` as data. A message stays in the mailbox
/// until the drone says that it has received it, a version until it is acknowledged, declined or overtaken: on a new
/// stream those after `Last-Event-ID` are told, and versions that still wait.
#[utoipa::path(
    get,
    path = "/v1/drones/{id}/events",
    params(
        ("id" = String, Path, min_length = 1, max_length = 128, description = "Id of the drone."),
        MailParameters,
        ("Last-Event-ID" = Option<String>, Header, description = "Id of the last message received, which browsers send by themselves."),
    ),
    responses(
        (status = 200, description = "Messages without end.", body = DroneMessage, content_type = "text/event-stream"),
        (status = 429, response = refusals::TooManyRequests),
    ),
)]
pub(super) async fn watch_mail(
    PathId(drone): PathId,
    Call(edge, caller, query): Call<Edge, MailParameters>,
    headers: HeaderMap,
) -> Answer {
    let after = extract::header(&headers, LAST_EVENT_ID)?.or(query.after);
    let mail = edge.mail(&caller, &drone, after.as_deref())?;
    let first = Event::default().comment("skyway").retry(RETRY);
    let events = tokio_stream::once(first)
        .chain(mail.filter_map(frame))
        .map(Ok::<_, Infallible>);
    let keep_alive = KeepAlive::new().interval(KEEP_ALIVE).text("still here");
    Ok(Sse::new(events).keep_alive(keep_alive).into_response())
}

/// A message as an event. That a session has ended concerns those who are on it alone.
fn frame(mail: Mail) -> Option<Event> {
    let Mail::Message(message) = mail else {
        return None;
    };
    // A message is text and finite numbers, and always has a JSON form.
    let json = serde_json::to_string(&message).unwrap_or_default();
    let event = Event::default().id(&message.id).event(message.kind.name());
    Some(event.data(json))
}

/// Takes it that a drone has received its messages up to one; versions stay until they are acknowledged, declined or
/// overtaken. Once more changes nothing.
#[utoipa::path(
    post,
    path = "/v1/drones/{id}/received",
    params(("id" = String, Path, min_length = 1, max_length = 128, description = "Id of the drone.")),
    request_body(content = Received, example = json!({"through": "1795334027520-17"})),
    responses((status = 200, description = "How many are left.", body = MailLeft)),
)]
pub(super) async fn receive_mail(
    State(edge): State<Arc<Edge>>,
    Authenticated(caller): Authenticated,
    PathId(drone): PathId,
    JsonBody(body): JsonBody,
) -> Answer {
    let received: Received = reading::body(&body, "message received")?;
    json(&edge.receive_mail(&caller, &drone, &received).await?)
}
