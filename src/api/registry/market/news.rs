//! `/v1/networks/{network}/edges/{id}/news`: what edges tell of flights and failures.

use crate::api::registry::extract::{PathId, check_edge};
use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::Call;
use crate::api::rest::reading::{self, JsonBody};
use crate::api::rest::refusals;
use crate::dispatch::Dispatch;
use crate::wire::{EdgeNews, NewsTaken};

/// Takes what became of flights, and failures that were answered: each number once.
///
/// The edge keeps its news until it is told here how far they were taken.
#[utoipa::path(
    post,
    path = "/v1/networks/{network}/edges/{id}/news",
    request_body(content = EdgeNews, example = json!({"lineage": 1, "news": []})),
    responses(
        (status = 200, description = "How far they are taken.", body = NewsTaken),
        refusals::Write,
    ),
)]
pub(super) async fn take_news(
    PathId { network, id }: PathId,
    Call(dispatch, caller, _): Call<Dispatch>,
    JsonBody(body): JsonBody,
) -> Answer {
    check_edge(&caller, &id)?;
    let news: EdgeNews = reading::body(&body, "batch of news")?;
    json(&dispatch.take_news(&network, &id, news).await?)
}
