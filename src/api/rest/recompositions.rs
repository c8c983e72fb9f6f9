//! `GET /v1/recompositions`: what was answered, and all that it was computed from.

use super::answer::{Answer, json};
use super::extract::{Call, PageParameters, PathId};
use crate::edge::Edge;
use crate::wire::{Recompositions, Record};
use serde::Deserialize;
use utoipa::IntoParams;

/// What is told of a recomposition.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct RecordParameters {
    /// Whether to compute the proof that an exact answer is the optimum.
    #[serde(default)]
    certificate: bool,
}

/// Lists what was answered lately, latest first.
#[utoipa::path(
    get,
    path = "/v1/recompositions",
    params(PageParameters),
    responses((status = 200, description = "A page of answers.", body = Recompositions)),
)]
pub(super) async fn list_recompositions(
    Call(edge, caller, page): Call<Edge, PageParameters>,
) -> Answer {
    json(&edge.recompositions(&caller, &page.into_request())?)
}

/// Tells an answer with all it was computed from, enough to compute it again.
#[utoipa::path(
    get,
    path = "/v1/recompositions/{id}",
    params(RecordParameters),
    responses((status = 200, description = "The report, the world and the answer.", body = Record)),
)]
pub(super) async fn get_recomposition(
    PathId(id): PathId,
    Call(edge, caller, asked): Call<Edge, RecordParameters>,
) -> Answer {
    let record = edge.recomposition(&caller, &id, asked.certificate).await?;
    json(&record.to_wire())
}
