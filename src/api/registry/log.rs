//! `/v1/networks/{network}/changes` and `/snapshot`: what edges follow.

use super::extract::{OnNetwork, check_edge, invalid};
use crate::access::Role;
use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::Call;
use crate::api::rest::refusals;
use crate::api::server::Drain;
use crate::refusal::Refusal;
use crate::registry::{Follow, Registry, SnapshotRequest};
use crate::wire::{ChangesPage, RegistrySnapshot};
use axum::extract::State;
use jiff::SignedDuration;
use serde::Deserialize;
use std::time::Duration;
use utoipa::IntoParams;

/// From where to follow, and how.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct FollowParameters {
    /// Changes after this revision: that of the snapshot, or of the page before.
    after: u64,
    /// The epoch of that revision; the current one where none is given.
    #[param(value_type = u64, required = false)]
    epoch: Option<u64>,
    /// The most changes, except that a page has at least one whole revision.
    #[param(value_type = u64, required = false, minimum = 1, maximum = 10000)]
    limit: Option<u64>,
    /// How long to wait where there is nothing new: `30s`, `500ms`; not at all where nothing is given.
    #[param(value_type = String, required = false, example = "30s")]
    wait: Option<String>,
    /// Which edge asks; that of the token where it is for one.
    #[param(value_type = String, required = false)]
    edge: Option<String>,
}

/// Which page of a snapshot is asked for.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct SnapshotParameters {
    /// At most how many objects; 2,000 where none is given. A page may have fewer, by their size.
    #[param(value_type = u64, required = false, minimum = 1, maximum = 2000)]
    page_size: Option<u64>,
    /// The `next_page_token` of the page before.
    #[param(value_type = String, required = false)]
    page_token: Option<String>,
}

fn wait_of(text: Option<&str>) -> Result<Duration, Refusal> {
    let Some(text) = text else {
        return Ok(Duration::ZERO);
    };
    let read = text.parse::<SignedDuration>().ok();
    read.and_then(|wait| Duration::try_from(wait).ok())
        .ok_or_else(|| invalid("?wait", format!("'{text}' is not a duration such as 30s")))
}

/// Tells what has changed after a revision, at once or as soon as something does.
#[utoipa::path(
    get,
    path = "/v1/networks/{network}/changes",
    params(FollowParameters),
    responses(
        (status = 200, description = "Whole revisions in their order; none where nothing came in time.", body = ChangesPage),
        (status = 410, response = refusals::Gone),
        (status = 429, response = refusals::TooManyRequests),
    ),
)]
pub(super) async fn follow(
    State(drain): State<Drain>,
    OnNetwork(network): OnNetwork,
    Call(registry, caller, asked): Call<Registry, FollowParameters>,
) -> Answer {
    let own = Some(caller.subject.to_string());
    let own = own.filter(|subject| caller.role == Role::Edge && subject != "*");
    let edge = asked.edge.or(own);
    if let Some(edge) = &edge {
        check_edge(&caller, edge)?;
    }
    let follow = Follow {
        after: asked.after,
        epoch: asked.epoch,
        limit: asked.limit,
        wait: wait_of(asked.wait.as_deref())?,
        edge,
    };
    json(&registry.changes(&network, &follow, drain.begun()).await?)
}

/// Tells everything that holds, in pages at one revision.
#[utoipa::path(
    get,
    path = "/v1/networks/{network}/snapshot",
    params(SnapshotParameters),
    responses(
        (status = 200, description = "A page; the first one begins with the network.", body = RegistrySnapshot),
        (status = 410, response = refusals::Gone),
    ),
)]
pub(super) async fn snapshot(
    OnNetwork(network): OnNetwork,
    Call(registry, _, asked): Call<Registry, SnapshotParameters>,
) -> Answer {
    let request = SnapshotRequest {
        size: asked.page_size,
        token: asked.page_token,
    };
    json(&registry.snapshot(&network, &request).await?)
}
