//! `/v1/deliveries/{id}/track`: a flight as its customer sees it.

use crate::access::Caller;
use crate::api::problem;
use crate::api::registry::extract::Named;
use crate::api::rest::answer::Answer;
use crate::api::rest::extract::Call;
use crate::api::rest::refusals;
use crate::api::server::Drain;
use crate::dispatch::Dispatch;
use crate::refusal::Refusal;
use crate::wire::DeliveryTrack;
use axum::extract::State;
use axum::response::IntoResponse;
use axum::response::sse::{Event, KeepAlive, Sse};
use std::convert::Infallible;
use std::time::Duration;
use tokio::sync::mpsc;
use tokio_stream::StreamExt;
use tokio_stream::wrappers::ReceiverStream;

/// How often it is looked where the drone is.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// How often a quiet stream says that it is still there.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// Tells how a delivery stands and where its drone is, whenever that changes, at most once a second.
///
/// Each event is a `track` with a `DeliveryTrack` as data. The stream ends with the delivery. The place is told only while the
/// drone flies for this delivery.
#[utoipa::path(
    get,
    path = "/v1/deliveries/{id}/track",
    responses(
        (status = 200, description = "Events until the delivery is over.", body = String, content_type = "text/event-stream"),
        (status = 429, response = refusals::TooManyRequests),
    ),
)]
pub(super) async fn track_delivery(
    State(drain): State<Drain>,
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
) -> Answer {
    let first = dispatch.track(&caller, &id).await?;
    // One event may wait: who reads slowly gets fewer.
    let (events, told) = mpsc::channel(1);
    tokio::spawn(async move {
        tokio::select! {
            () = follow(&dispatch, &caller, first, &events) => {}
            () = drain.begun() => {}
        }
    });
    let events = ReceiverStream::new(told).map(Ok::<_, Infallible>);
    let keep_alive = KeepAlive::new().interval(KEEP_ALIVE).text("still here");
    Ok(Sse::new(events).keep_alive(keep_alive).into_response())
}

/// Tells a track from its first state on, until the delivery is over or no one listens.
async fn follow(
    dispatch: &Dispatch,
    caller: &Caller,
    first: DeliveryTrack,
    events: &mpsc::Sender<Event>,
) {
    let id = first.id.clone();
    let mut track = first;
    loop {
        let is_over = track.status.is_final();
        if events.send(event(&track)).await.is_err() || is_over {
            return;
        }
        loop {
            tokio::select! {
                () = tokio::time::sleep(LOOK_EVERY) => {}
                () = events.closed() => return,
            }
            match dispatch.track(caller, &id).await {
                Ok(now) if now == track => {}
                Ok(now) => {
                    track = now;
                    break;
                }
                Err(refusal) => {
                    // A client that has gone meanwhile needs no event.
                    let _gone = events.send(gone(&refusal)).await;
                    return;
                }
            }
        }
    }
}

fn event(track: &DeliveryTrack) -> Event {
    // A track is text and numbers, and always has a JSON form.
    let data = serde_json::to_string(track).unwrap_or_default();
    Event::default().event("track").data(data)
}

fn gone(refusal: &Refusal) -> Event {
    let document = problem::document(refusal, None);
    let document = serde_json::to_string(&document).unwrap_or_default();
    Event::default().event("gone").data(document)
}
