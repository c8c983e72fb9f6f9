//! `/v1/services`: what providers offer.

use super::entries::OnEntry;
use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::{Call, PageParameters};
use crate::api::rest::reading::JsonBody;
use crate::api::rest::refusals;
use crate::dispatch::Dispatch;
use crate::wire::{PublishedService, PublishedServices};

/// Lists the services that the caller sees, by id.
#[utoipa::path(
    get,
    path = "/v1/services",
    params(PageParameters),
    responses((status = 200, description = "A page of services.", body = PublishedServices)),
)]
pub(super) async fn list_services(
    Call(dispatch, caller, page): Call<Dispatch, PageParameters>,
) -> Answer {
    let page = dispatch
        .entries::<PublishedService>(&caller, &page.into_request())
        .await?;
    json(&PublishedServices {
        services: page.entries,
        next_page_token: page.next_page_token,
    })
}

/// Tells a service.
#[utoipa::path(
    get,
    path = "/v1/services/{id}",
    responses(
        (status = 200, description = "The service.", body = PublishedService),
        (status = 304, description = "The caller has the current version."),
    ),
)]
pub(super) async fn get_service(on: OnEntry) -> Answer {
    on.get::<PublishedService>().await
}

/// Puts a service under an id, new or in place of the version that `If-Match` names.
#[utoipa::path(
    put,
    path = "/v1/services/{id}",
    request_body(content = PublishedService, example = json!({"name": "Harbour express", "network": "sydney", "payload_max_kg": 2.0, "time_zone": "Australia/Sydney", "hours": [{"from": "07:00", "until": "21:00"}], "tariff": {"currency": "AUD", "base": "4.50", "per_km": "1.20"}})),
    responses(
        (status = 200, description = "The service as it is kept; it was there before.", body = PublishedService),
        (status = 201, description = "The same; the service is new.", body = PublishedService),
        refusals::Creation,
        refusals::Version,
    ),
)]
pub(super) async fn put_service(on: OnEntry, JsonBody(body): JsonBody) -> Answer {
    on.put::<PublishedService>(&body, "service", "/v1/services")
        .await
}

/// Deletes a service, of the version that `If-Match` names.
#[utoipa::path(
    delete,
    path = "/v1/services/{id}",
    responses(
        (status = 204, description = "It is gone."),
        refusals::Write,
        refusals::Version,
    ),
)]
pub(super) async fn delete_service(on: OnEntry) -> Answer {
    on.delete::<PublishedService>().await
}
