//! `/v1/customers`: who orders, and all that is kept of it.

use super::entries::{OnEntry, gone};
use crate::api::registry::extract::Named;
use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::{Call, if_match};
use crate::api::rest::reading::JsonBody;
use crate::api::rest::refusals;
use crate::dispatch::Dispatch;
use crate::wire::{Customer, CustomerData};

/// Tells a customer.
#[utoipa::path(
    get,
    path = "/v1/customers/{id}",
    responses(
        (status = 200, description = "The customer.", body = Customer),
        (status = 304, description = "The caller has the current version."),
    ),
)]
pub(super) async fn get_customer(on: OnEntry) -> Answer {
    on.get::<Customer>().await
}

/// Puts a customer under an id, new or in place of the version that `If-Match` names.
#[utoipa::path(
    put,
    path = "/v1/customers/{id}",
    request_body(content = Customer, example = json!({"name": "Harbour Pharmacy", "contact": "desk@pharmacy.example"})),
    responses(
        (status = 200, description = "The customer as it is kept; it was there before.", body = Customer),
        (status = 201, description = "The same; the customer is new.", body = Customer),
        refusals::Creation,
        refusals::Version,
    ),
)]
pub(super) async fn put_customer(on: OnEntry, JsonBody(body): JsonBody) -> Answer {
    on.put::<Customer>(&body, "customer", "/v1/customers").await
}

/// Tells all that is kept of a customer: itself, its deliveries with their recipients, its webhooks.
#[utoipa::path(
    get,
    path = "/v1/customers/{id}/data",
    responses((status = 200, description = "All of it.", body = CustomerData)),
)]
pub(super) async fn get_customer_data(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
) -> Answer {
    json(&dispatch.customer_data(&caller, &id).await?)
}

/// Deletes what is kept of a customer: itself, its webhooks, the recipients of its parcels, and of its deliveries what may
/// name a person.
///
/// Its deliveries stay without that. While one of them is not over, nothing is deleted.
#[utoipa::path(
    delete,
    path = "/v1/customers/{id}/data",
    params(
        ("If-Match" = Option<String>, Header, description = "Entity tag of the customer; whatever its version where none is given."),
    ),
    responses(
        (status = 204, description = "It is gone."),
        refusals::Write,
        (status = 412, response = refusals::PreconditionFailed),
    ),
)]
pub(super) async fn delete_customer_data(on: OnEntry) -> Answer {
    let version = if_match(&on.headers)?;
    let deleted = on
        .dispatch
        .delete_customer_data(&on.caller, &on.id, version);
    deleted.await?;
    Ok(gone())
}
