//! `/v1/quotes`: prices that hold for a while.

use crate::api::registry::extract::Named;
use crate::api::rest::answer::{Answer, created, json};
use crate::api::rest::extract::Call;
use crate::api::rest::reading::{self, JsonBody};
use crate::api::rest::refusals;
use crate::dispatch::Dispatch;
use crate::wire::{Quote, QuoteRequest};

const COLLECTION: &str = "/v1/quotes";

/// Asks for a price that holds for five minutes: an edge composes the flight, with the wind, the pads and the traffic there.
#[utoipa::path(
    post,
    path = "/v1/quotes",
    request_body(
        content = QuoteRequest,
        example = json!({"service_id": "swift:parcels", "source": "57", "destination": "301", "payload_kg": 1.2}),
    ),
    responses((status = 201, description = "The quote.", body = Quote), refusals::Creation),
)]
pub(super) async fn create_quote(
    Call(dispatch, caller, _): Call<Dispatch>,
    JsonBody(body): JsonBody,
) -> Answer {
    let request: QuoteRequest = reading::body(&body, "request for a quote")?;
    let quote = dispatch.create_quote(&caller, request).await?;
    created(&quote, COLLECTION, &quote.id)
}

/// Tells a quote to who asked for it and to who would fly it.
#[utoipa::path(
    get,
    path = "/v1/quotes/{id}",
    responses((status = 200, description = "The quote.", body = Quote)),
)]
pub(super) async fn get_quote(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
) -> Answer {
    json(&dispatch.quote(&caller, &id).await?)
}
