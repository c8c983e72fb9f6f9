//! `/v1/providers`: who runs drones and sells deliveries.

use super::entries::{gone, read, written};
use crate::api::registry::extract::Named;
use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::{Call, PageParameters, if_match};
use crate::api::rest::reading::{self, JsonBody};
use crate::api::rest::refusals;
use crate::dispatch::Dispatch;
use crate::wire::{Provider, Providers};
use http::HeaderMap;

const COLLECTION: &str = "/v1/providers";

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
pub(super) async fn get_provider(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
    headers: HeaderMap,
) -> Answer {
    read(&dispatch.entry::<Provider>(&caller, &id).await?, &headers)
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
pub(super) async fn put_provider(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    let draft: Provider = reading::body(&body, "provider")?;
    let put = dispatch
        .put_entry(&caller, &id, &draft, if_match(&headers)?)
        .await?;
    written(&put, COLLECTION)
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
pub(super) async fn delete_provider(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
    headers: HeaderMap,
) -> Answer {
    let version = if_match(&headers)?;
    dispatch
        .delete_entry::<Provider>(&caller, &id, version)
        .await?;
    Ok(gone())
}
