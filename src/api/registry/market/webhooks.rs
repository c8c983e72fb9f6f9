//! `/v1/webhooks`: where customers and providers are told.

use super::entries::gone;
use crate::api::registry::extract::{Named, invalid};
use crate::api::rest::answer::{self, Answer, JSON, json, not_modified, set, told};
use crate::api::rest::extract::{Call, PageParameters, if_match};
use crate::api::rest::reading::{self, JsonBody};
use crate::api::rest::refusals;
use crate::dispatch::{Dispatch, TaggedWebhook};
use crate::wire::{Webhook, WebhookDraft, WebhookMessage, WebhookMessages, Webhooks};
use axum::extract::Path;
use axum::extract::rejection::PathRejection;
use http::{HeaderMap, StatusCode, header};

const COLLECTION: &str = "/v1/webhooks";

/// Lists the caller's webhooks, by id.
#[utoipa::path(
    get,
    path = "/v1/webhooks",
    params(PageParameters),
    responses((status = 200, description = "A page of webhooks.", body = Webhooks)),
)]
pub(super) async fn list_webhooks(
    Call(dispatch, caller, page): Call<Dispatch, PageParameters>,
) -> Answer {
    json(&dispatch.webhooks(&caller, &page.into_request()).await?)
}

/// Tells a webhook, without its secret.
#[utoipa::path(
    get,
    path = "/v1/webhooks/{id}",
    responses(
        (status = 200, description = "The webhook.", body = Webhook),
        (status = 304, description = "The caller has the current version."),
    ),
)]
pub(super) async fn get_webhook(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
    headers: HeaderMap,
) -> Answer {
    let found = dispatch.webhook(&caller, &id).await?;
    match not_modified(&headers, &found.etag) {
        Some(response) => Ok(response),
        None => tagged(&found, StatusCode::OK),
    }
}

/// Puts a webhook under an id, new or in place of the version that `If-Match` names. The answer to a new one has its
/// secret, which is told once; a disabled one is called again.
#[utoipa::path(
    put,
    path = "/v1/webhooks/{id}",
    request_body = WebhookDraft,
    responses(
        (status = 200, description = "The webhook; it was there before.", body = Webhook),
        (status = 201, description = "The webhook; it is new, and this answer has its secret.", body = Webhook),
        refusals::Creation,
        refusals::Version,
    ),
)]
pub(super) async fn put_webhook(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    let draft: WebhookDraft = reading::body(&body, "a webhook")?;
    let expected = if_match(&headers)?;
    let put = dispatch.put_webhook(&caller, &id, &draft, expected).await?;
    if !put.created {
        return tagged(&put, StatusCode::OK);
    }
    let mut response = tagged(&put, StatusCode::CREATED)?;
    let location = format!("{COLLECTION}/{}", answer::escaped(&id));
    set(&mut response, header::LOCATION, &location);
    Ok(response)
}

/// Deletes the version of a webhook that `If-Match` names. What was to be sent to it is given up.
#[utoipa::path(
    delete,
    path = "/v1/webhooks/{id}",
    responses(
        (status = 204, description = "It is deleted."),
        refusals::Write,
        refusals::Version,
    ),
)]
pub(super) async fn delete_webhook(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
    headers: HeaderMap,
) -> Answer {
    let expected = if_match(&headers)?;
    dispatch.delete_webhook(&caller, &id, expected).await?;
    Ok(gone())
}

/// Gives a webhook a new secret, which the answer has; the one before signs for another day, too.
#[utoipa::path(
    post,
    path = "/v1/webhooks/{id}/rotate",
    responses(
        (
            status = 200,
            description = "The webhook, with its new secret.",
            body = Webhook,
            headers(("ETag" = String, description = "Its version, for `If-Match`.")),
        ),
        refusals::Creation,
    ),
)]
pub(super) async fn rotate_webhook(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
) -> Answer {
    let rotated = dispatch.rotate_webhook(&caller, &id).await?;
    tagged(&rotated, StatusCode::OK)
}

/// Lists the messages of a webhook, the newest first, with what came of the last attempt.
#[utoipa::path(
    get,
    path = "/v1/webhooks/{id}/messages",
    params(PageParameters),
    responses((status = 200, description = "A page of messages.", body = WebhookMessages)),
)]
pub(super) async fn list_messages(
    Named(id): Named,
    Call(dispatch, caller, page): Call<Dispatch, PageParameters>,
) -> Answer {
    let page = page.into_request();
    json(&dispatch.webhook_messages(&caller, &id, &page).await?)
}

/// Sends a message again, whatever has become of it.
#[utoipa::path(
    post,
    path = "/v1/webhooks/{id}/messages/{message}/resend",
    params(("message" = String, Path, description = "Id of the message.")),
    responses(
        (status = 200, description = "The message, to be sent.", body = WebhookMessage),
        refusals::Write,
    ),
)]
pub(super) async fn resend_message(
    place: Result<Path<(String, String)>, PathRejection>,
    Call(dispatch, caller, _): Call<Dispatch>,
) -> Answer {
    let Path((id, message)) =
        place.map_err(|rejection| invalid("{message}", rejection.body_text()))?;
    json(&dispatch.resend_message(&caller, &id, &message).await?)
}

/// A webhook with its version. An answer with a secret is cached by no one on its way.
fn tagged(found: &TaggedWebhook, status: StatusCode) -> Answer {
    let mut response = told(status, JSON, &found.webhook)?;
    set(&mut response, header::ETAG, &found.etag);
    if found.webhook.secret.is_some() {
        set(&mut response, header::CACHE_CONTROL, "no-store");
    }
    Ok(response)
}
