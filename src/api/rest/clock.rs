//! `GET /v1/clock`: the time that the edge goes by; `POST /v1/clock:advance`: a simulator moves it;
//! `POST /v1/clock:confirm`: an operator believes a wall clock that has stepped.

use super::answer::{Answer, json};
use super::extract::Call;
use super::reading::{self, JsonBody};
use super::refusals;
use crate::edge::Edge;
use crate::wire::{ClockAdvance, ClockAdvanced, ClockReading, ClockState};

/// Tells the time that the edge goes by, and how fast it passes. Departures, positions and deadlines are in this time.
#[utoipa::path(
    get,
    path = "/v1/clock",
    responses((status = 200, description = "The clock.", body = ClockReading)),
)]
pub(super) async fn get_clock(Call(edge, caller, _): Call<Edge>) -> Answer {
    json(&edge.clock_reading(&caller))
}

/// Moves the clock of an edge that was started with `--clock external`, at most 24 h at once. All that is due until then
/// happens first, each at its own instant: windows and lives of closures, acknowledgements, departures and ends of plans,
/// and the new plans that they lead to. The same time again changes nothing; an earlier one is refused. Where the
/// deadline of requests passes before, the clock stands where it has come to: ask again for the same time.
#[utoipa::path(
    post,
    path = "/v1/clock:advance",
    request_body(content = ClockAdvance, example = json!({"to": "2026-11-27T18:00:01Z"})),
    responses(
        (status = 200, description = "The clock, and what came due on the way.", body = ClockAdvanced),
        refusals::ClockMove,
    ),
)]
pub(super) async fn advance_clock(
    Call(edge, caller, _): Call<Edge>,
    JsonBody(body): JsonBody,
) -> Answer {
    let advance: ClockAdvance = reading::body(&body, "instant")?;
    json(&edge.advance_clock(&caller, &advance).await?)
}

/// Believes the wall clock again after it has stepped by more than five seconds; until then nothing opens by it.
#[utoipa::path(
    post,
    path = "/v1/clock:confirm",
    responses((status = 200, description = "The clock, which is believed now.", body = ClockState)),
)]
pub(super) async fn confirm_clock(Call(edge, caller, _): Call<Edge>) -> Answer {
    json(&edge.confirm_clock(&caller).await?)
}
