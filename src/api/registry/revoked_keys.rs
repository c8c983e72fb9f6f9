//! `/v1/revoked-keys`: which keys of packs are not to be believed any more.

use super::extract::Named;
use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::Call;
use crate::api::rest::reading::{self, JsonBody};
use crate::dispatch::Dispatch;
use crate::wire::{KeyRevocation, RevokedKey, RevokedKeys};

/// Lists the keys that were revoked, by id.
#[utoipa::path(
    get,
    path = "/v1/revoked-keys",
    responses((status = 200, description = "All of them.", body = RevokedKeys)),
)]
pub(super) async fn list_revoked_keys(Call(dispatch, _, _): Call<Dispatch>) -> Answer {
    json(&dispatch.revoked_keys().await?)
}

/// Revokes a key of packs, for good.
///
/// Its edge hears of it within some ten seconds, and signs with a new key from then on if it was the one that signs.
#[utoipa::path(
    put,
    path = "/v1/revoked-keys/{id}",
    request_body(content = KeyRevocation, example = json!({"reason": "the disk of edge-1 was stolen"})),
    responses((status = 200, description = "It is revoked; one that was so already stays as it was.", body = RevokedKey)),
)]
pub(super) async fn revoke_key(
    Named(id): Named,
    Call(dispatch, caller, _): Call<Dispatch>,
    JsonBody(body): JsonBody,
) -> Answer {
    let revocation: KeyRevocation = reading::body(&body, "revocation")?;
    json(&dispatch.revoke_key(&caller, &id, revocation).await?)
}
