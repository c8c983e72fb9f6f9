//! `/v1/failure-rates`: how often what fails where, as the registry told it.

use super::answer::{Answer, json};
use super::extract::Call;
use crate::edge::Edge;
use crate::wire::FailureRates;
use serde::Deserialize;
use utoipa::IntoParams;

/// Which rates.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct RateParameters {
    /// Those of this segment alone.
    #[param(required = false)]
    segment: Option<String>,
}

/// Tells how often what fails where; the registry works it out, and this edge pulls it every ten minutes.
#[utoipa::path(
    get,
    path = "/v1/failure-rates",
    params(RateParameters),
    responses((status = 200, description = "Counts with their 95 % intervals.", body = FailureRates)),
)]
pub(super) async fn list_failure_rates(
    Call(edge, caller, asked): Call<Edge, RateParameters>,
) -> Answer {
    json(&edge.failure_rates(&caller, asked.segment.as_deref())?)
}
