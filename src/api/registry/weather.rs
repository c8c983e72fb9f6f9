//! `/v1/networks/{network}/weather`: wind over a network, as one document.

use super::extract::{OnNetwork, WriteParameters, Writing};
use super::written::{below, written};
use crate::api::rest::answer::{Answer, JSON, current};
use crate::api::rest::extract::{Call, IdempotencyKey};
use crate::api::rest::reading::{self, JsonBody};
use crate::api::rest::refusals;
use crate::registry::Registry;
use crate::wire::{ObjectKind, Weather, Written};
use http::HeaderMap;

/// Tells the weather over a network.
#[utoipa::path(
    get,
    path = "/v1/networks/{network}/weather",
    responses(
        (status = 200, description = "The weather.", body = Weather),
        (status = 304, description = "The caller has the current version."),
    ),
)]
pub(super) async fn get_weather(
    OnNetwork(network): OnNetwork,
    Call(registry, _, _): Call<Registry>,
    headers: HeaderMap,
) -> Answer {
    let (body, etag) = registry.object(&network, ObjectKind::Weather, "").await?;
    Ok(current(&headers, &etag, JSON, body))
}

/// Puts the weather over a network, for the first time or in place of the version that `If-Match` names.
#[utoipa::path(
    put,
    path = "/v1/networks/{network}/weather",
    params(WriteParameters, IdempotencyKey),
    request_body(
        content = Weather,
        example = json!({"wind": [{"from": "2026-11-27T06:00:00Z", "until": "2026-11-27T12:00:00Z", "speed_mps": 6.5, "from_deg": 225}]}),
    ),
    responses(
        (status = 200, description = "It was stated before, or `validate_only`.", body = Written),
        (status = 201, description = "It is stated for the first time.", body = Written),
        refusals::Write,
        refusals::Version,
    ),
)]
pub(super) async fn put_weather(
    OnNetwork(network): OnNetwork,
    Call(registry, _, asked): Call<Registry, WriteParameters>,
    writing: Writing,
    JsonBody(body): JsonBody,
) -> Answer {
    let manner = writing.manner(&asked, &body)?;
    let weather: Weather = reading::body(&body, "weather")?;
    let reply = registry.put_weather(&network, weather, &manner).await?;
    Ok(written(reply, &below(&network, "/weather"), true))
}
