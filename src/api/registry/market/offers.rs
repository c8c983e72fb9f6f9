//! `/v1/services:search`: what is offered.

use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::Call;
use crate::api::rest::reading::{self, JsonBody};
use crate::api::rest::refusals;
use crate::dispatch::Dispatch;
use crate::wire::{ServiceOffers, ServiceSearch};

/// Looks for services that fit an errand: what each would cost and when it would arrive, and why others do not fit.
///
/// Prices and times are those of the shortest way; a quote is composed by an edge.
#[utoipa::path(
    post,
    path = "/v1/services:search",
    request_body(
        content = ServiceSearch,
        example = json!({"network": "sydney", "source": "57", "destination": "301", "payload_kg": 1.2, "price_max": {"amount": "15.00", "currency": "AUD"}, "rank_by": "arrival"}),
    ),
    responses(
        (status = 200, description = "What fits, the best first, and what does not.", body = ServiceOffers),
        (status = 422, response = refusals::UnprocessableContent),
    ),
)]
pub(super) async fn search_services(
    Call(dispatch, _, _): Call<Dispatch>,
    JsonBody(body): JsonBody,
) -> Answer {
    let search: ServiceSearch = reading::body(&body, "search")?;
    json(&dispatch.search_services(&search).await?)
}
