//! `GET /v1/events`: what happens, as server-sent events.

use super::answer::Answer;
use super::extract::{self, Call};
use super::refusals;
use crate::api::problem;
use crate::edge::{Edge, EventRecord, Refusal};
use axum::response::IntoResponse;
use axum::response::sse::{Event, KeepAlive, Sse};
use http::HeaderMap;
use serde::Deserialize;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;
use tokio_stream::StreamExt;
use utoipa::IntoParams;

/// How often a quiet stream says that it is still there.
pub(super) const KEEP_ALIVE: Duration = Duration::from_secs(15);
/// How long a client waits before it connects again.
pub(super) const RETRY: Duration = Duration::from_secs(2);

pub(super) const LAST_EVENT_ID: &str = "last-event-id";

/// Where the stream begins.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct EventsParameters {
    /// Id of the last event seen; `Last-Event-ID` counts where both are given.
    #[param(value_type = String, required = false)]
    after: Option<String>,
}

/// Tells changes, recompositions and acknowledgements as they happen.
///
/// Each event has its id, its kind as `event`, and an `Event` as data. The first frame has only the id from which
/// the stream goes on. A listener that is too slow gets a last event `gone` with a problem as its data: it reads the
/// lists again and listens anew.
#[utoipa::path(
    get,
    path = "/v1/events",
    params(
        EventsParameters,
        ("Last-Event-ID" = Option<String>, Header, description = "Id of the last event seen, which browsers send by themselves."),
    ),
    responses(
        (status = 200, description = "Events without end.", body = String, content_type = "text/event-stream"),
        (status = 410, response = refusals::Gone),
        (status = 429, response = refusals::TooManyRequests),
    ),
)]
pub(super) async fn watch_events(
    Call(edge, _, query): Call<Edge, EventsParameters>,
    headers: HeaderMap,
) -> Answer {
    let after = extract::header(&headers, LAST_EVENT_ID)?.or(query.after);
    // Asked before listening, so that who comes back with it may hear an event twice, but misses none.
    let latest = edge.latest_event_id();
    let events = edge.events(after.as_deref())?;
    let first = Event::default()
        .comment("skyway")
        .retry(RETRY)
        .id(after.unwrap_or(latest));
    let events = tokio_stream::once(first)
        .chain(events.map(frame))
        .map(Ok::<_, Infallible>);
    let keep_alive = KeepAlive::new().interval(KEEP_ALIVE).text("still here");
    Ok(Sse::new(events).keep_alive(keep_alive).into_response())
}

fn frame(event: Result<Arc<EventRecord>, Refusal>) -> Event {
    match event {
        Ok(event) => {
            let kind = serde_json::to_value(event.kind).unwrap_or_default();
            let kind = kind.as_str().unwrap_or("message");
            Event::default().id(&event.id).event(kind).data(&event.json)
        }
        Err(refusal) => {
            let document = problem::document(&refusal, None);
            // A problem document is text and numbers, and always has a JSON form.
            let document = serde_json::to_string(&document).unwrap_or_default();
            Event::default().event("gone").data(document)
        }
    }
}
