//! `/v1/providers`: who runs drones and sells deliveries.

use super::entries::OnEntry;
use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::{Call, PageParameters};
use crate::api::rest::reading::JsonBody;
use crate::api::rest::refusals;
use crate::dispatch::Dispatch;
use crate::wire::{Provider, Providers};

/// Lists the providers that the caller sees, by id.
#[utoipa::path(
    get,
    path = "/v1/providers",
    params(PageParameters),
    responses((status = 200, description = "A page of providers.", body = Providers)),
)]
pub(super) async fn list_providers(
    Call(dispatch, caller, page): Call<Dispatch, PageParameters>,
) -> Answer {
    let page = dispatch
        .entries::<Provider>(&caller, &page.into_request())
        .await?;
    json(&Providers {
        providers: page.entries,
        next_page_token: page.next_page_token,
    })
}

/// Tells a provider.
#[utoipa::path(
    get,
    path = "/v1/providers/{id}",
    responses(
        (status = 200, description = "The provider.", body = Provider),
        (status = 304, description = "The caller has the current version."),
    ),
)]
pub(super) async fn get_provider(on: OnEntry) -> Answer {
    on.get::<Provider>().await
}

/// Puts a provider under an id, new or in place of the version that `If-Match` names.
#[utoipa::path(
    put,
    path = "/v1/providers/{id}",
    request_body(content = Provider, example = json!({"name": "Acme Drones", "contact": "operations@acme.example"})),
    responses(
        (status = 200, description = "The provider as it is kept; it was there before.", body = Provider),
        (status = 201, description = "The same; the provider is new.", body = Provider),
        refusals::Creation,
        refusals::Version,
    ),
)]
pub(super) async fn put_provider(on: OnEntry, JsonBody(body): JsonBody) -> Answer {
    on.put::<Provider>(&body, "provider", "/v1/providers").await
}

/// Deletes a provider, of the version that `If-Match` names.
#[utoipa::path(
    delete,
    path = "/v1/providers/{id}",
    responses(
        (status = 204, description = "It is gone."),
        refusals::Write,
        refusals::Version,
    ),
)]
pub(super) async fn delete_provider(on: OnEntry) -> Answer {
    on.delete::<Provider>().await
}
