//! `/v1/edges`, and what an edge tells of itself.

use super::extract::{PathId, check_edge};
use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::Call;
use crate::api::rest::reading::{self, JsonBody};
use crate::dispatch::Dispatch;
use crate::registry::Registry;
use crate::wire::{EdgeNoted, EdgeReport, EdgeStatuses};

/// Notes how far an edge is, and what it could not take over.
#[utoipa::path(
    put,
    path = "/v1/networks/{network}/edges/{id}",
    request_body(content = EdgeReport, example = json!({"epoch": 1, "revision": 7})),
    responses((status = 200, description = "It is noted; beside that, what every edge has to know.", body = EdgeNoted)),
)]
pub(super) async fn report_edge(
    PathId { network, id }: PathId,
    Call(dispatch, caller, _): Call<Dispatch>,
    JsonBody(body): JsonBody,
) -> Answer {
    check_edge(&caller, &id)?;
    let report: EdgeReport = reading::body(&body, "report")?;
    dispatch
        .registry()
        .report_edge(&network, &id, report)
        .await?;
    let revoked = dispatch.revoked_keys().await?.keys;
    json(&EdgeNoted {
        revoked_keys: revoked.into_iter().map(|key| key.id).collect(),
    })
}

/// Lists who follows, by network and id.
#[utoipa::path(
    get,
    path = "/v1/edges",
    responses((status = 200, description = "All that were heard.", body = EdgeStatuses)),
)]
pub(super) async fn list_edges(Call(registry, _, _): Call<Registry>) -> Answer {
    json(&registry.edges().await?)
}
