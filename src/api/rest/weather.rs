//! `/v1/weather`: wind over the network, as one document.

use super::answer::{Answer, json, not_modified, set};
use super::extract::{self, Call};
use super::reading::{self, JsonBody};
use super::refusals;
use crate::edge::Edge;
use crate::wire::{Weather, WeatherAnswer};
use http::{HeaderMap, header};

fn told(weather: &WeatherAnswer<'_>) -> Answer {
    let mut response = json(weather)?;
    if let Some(etag) = &weather.etag {
        set(&mut response, header::ETAG, etag);
    }
    Ok(response)
}

/// Tells the weather over the network.
#[utoipa::path(
    get,
    path = "/v1/weather",
    responses(
        (
            status = 200,
            description = "The weather.",
            body = WeatherAnswer,
            headers(("ETag" = String, description = "Its version, for `If-Match`; none where nothing was ever stated.")),
        ),
        (status = 304, description = "The caller has the current version."),
    ),
)]
pub(super) async fn get_weather(Call(edge, caller, _): Call<Edge>, headers: HeaderMap) -> Answer {
    let weather = edge.weather(&caller);
    let etag = weather.etag.as_deref();
    if let Some(response) = etag.and_then(|etag| not_modified(&headers, etag)) {
        return Ok(response);
    }
    told(&weather)
}

/// Puts the weather over the network, for the first time or in place of the version that `If-Match` names.
#[utoipa::path(
    put,
    path = "/v1/weather",
    request_body(
        content = Weather,
        example = json!({"wind": [{"from": "2026-11-27T06:00:00Z", "until": "2026-11-27T12:00:00Z", "speed_mps": 6.5, "from_deg": 225}]}),
    ),
    responses(
        (status = 200, description = "The weather as it is now.", body = WeatherAnswer),
        refusals::Write,
        refusals::Version,
    ),
)]
pub(super) async fn put_weather(
    Call(edge, caller, _): Call<Edge>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    let weather: Weather = reading::body(&body, "weather")?;
    let if_match = extract::if_match(&headers)?;
    told(&edge.put_weather(&caller, weather, if_match).await?)
}
