//! `/v1/networks/{network}/statistics`: what is worked out of all that edges have told.

use crate::api::registry::extract::OnNetwork;
use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::{Authenticated, Query};
use crate::dispatch::Dispatch;
use crate::wire::NetworkStatistics;
use axum::extract::State;
use serde::Deserialize;
use std::sync::Arc;
use utoipa::IntoParams;

/// Over which span of time.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct SpanParameters {
    /// From when on, RFC 3339; 30 days before `until` where nothing is said.
    #[param(value_type = String, format = DateTime, required = false)]
    from: Option<String>,
    /// Until before when, RFC 3339; now where nothing is said.
    #[param(value_type = String, format = DateTime, required = false)]
    until: Option<String>,
}

/// Tells how often what fails where and when, and how late which service is.
#[utoipa::path(
    get,
    path = "/v1/networks/{network}/statistics",
    tag = "networks",
    params(("network" = String, Path, description = "Id of the network."), SpanParameters),
    responses((status = 200, description = "Counts with their 95 % intervals.", body = NetworkStatistics)),
)]
pub(super) async fn get_statistics(
    State(dispatch): State<Arc<Dispatch>>,
    OnNetwork(network): OnNetwork,
    Authenticated(caller): Authenticated,
    Query(span): Query<SpanParameters>,
) -> Answer {
    let (from, until) = (span.from.as_deref(), span.until.as_deref());
    json(&dispatch.statistics(&caller, &network, from, until).await?)
}
