//! `/v1/deliveries`: orders.

use crate::api::registry::extract::{Named, WriteParameters, Writing};
use crate::api::registry::written::written;
use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::{Call, IdempotencyKey, PageParameters};
use crate::api::rest::reading::{self, JsonBody};
use crate::api::rest::refusals;
use crate::dispatch::Dispatch;
use crate::wire::{Deliveries, Delivery, DeliveryOrder, ProofOfDelivery};

const COLLECTION: &str = "/v1/deliveries";

/// Orders a delivery: a quote is accepted, or a request is filled by a service and a drone.
///
/// The answer comes before a drone is assigned; webhooks, or the delivery itself, tell the rest.
#[utoipa::path(
    post,
    path = "/v1/deliveries",
    params(IdempotencyKey),
    request_body(
        content = DeliveryOrder,
        example = json!({"network": "sydney", "source": "57", "destination": "301", "payload_kg": 1.2, "reference": "order 4711"}),
    ),
    responses(
        (status = 201, description = "The delivery, without its recipient.", body = Delivery),
        refusals::Creation,
    ),
)]
pub(super) async fn create_delivery(
    Call(dispatch, _, _): Call<Dispatch>,
    writing: Writing,
    JsonBody(body): JsonBody,
) -> Answer {
    let asked = WriteParameters {
        validate_only: false,
    };
    let manner = writing.manner(&asked, &body)?;
    let order: DeliveryOrder = reading::body(&body, "order")?;
    let reply = dispatch
        .create_delivery(&writing.caller, &order, &manner)
        .await?;
    Ok(written(reply, COLLECTION, false))
}

/// Lists deliveries, the oldest first: to customers those that they ordered, to providers those that they fly.
#[utoipa::path(
    get,
    path = "/v1/deliveries",
    params(PageParameters),
    responses((status = 200, description = "A page of deliveries, without recipients.", body = Deliveries)),
)]
pub(super) async fn list_deliveries(
    Call(dispatch, caller, page): Call<Dispatch, PageParameters>,
) -> Answer {
    json(&dispatch.deliveries(&caller, &page.into_request()).await?)
}

/// Tells a delivery. Its customer sees all of it, its provider not the recipient, operators neither recipient nor price.
#[utoipa::path(
    get,
    path = "/v1/deliveries/{id}",
    responses((status = 200, description = "The delivery.", body = Delivery)),
)]
pub(super) async fn get_delivery(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
) -> Answer {
    json(&dispatch.delivery(&caller, &id).await?)
}

/// Calls a delivery off, as long as its drone is on the ground.
///
/// Where an edge has its flight and does not answer at once, `reason` says that it is being called off.
#[utoipa::path(
    post,
    path = "/v1/deliveries/{id}/cancel",
    responses(
        (status = 200, description = "The delivery as it stands.", body = Delivery),
        refusals::Write,
    ),
)]
pub(super) async fn cancel_delivery(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
) -> Answer {
    json(&dispatch.cancel_delivery(&caller, &id).await?)
}

/// Adds a photo, a code or the place to the proof of a delivery that has arrived.
///
/// Once the customer's data were deleted, of these the place alone is kept.
#[utoipa::path(
    post,
    path = "/v1/deliveries/{id}/proof",
    request_body(
        content = ProofOfDelivery,
        example = json!({"at": "2026-11-27T18:12:00Z", "photo": "https://proofs.example/4711.jpg", "code": "2718"}),
    ),
    responses(
        (status = 200, description = "The delivery with its proof.", body = Delivery),
        refusals::Write,
    ),
)]
pub(super) async fn prove_delivery(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
    JsonBody(body): JsonBody,
) -> Answer {
    let proof: ProofOfDelivery = reading::body(&body, "proof")?;
    json(&dispatch.prove_delivery(&caller, &id, &proof).await?)
}
