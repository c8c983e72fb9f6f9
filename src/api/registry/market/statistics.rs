//! `/v1/networks/{network}/statistics`: what is worked out of all that edges have told.

use super::statistics_table::{PARQUET, StatisticsTable, as_parquet};
use crate::api::registry::extract::OnNetwork;
use crate::api::rest::answer::{Answer, json, of_bytes};
use crate::api::rest::extract::{Call, accepted};
use crate::dispatch::Dispatch;
use crate::refusal::{Code, Refusal};
use crate::wire::NetworkStatistics;
use http::{HeaderMap, StatusCode};
use serde::Deserialize;
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
    /// With `Accept` of Parquet: which table; `failures` where nothing is said.
    #[serde(default)]
    #[param(required = false, inline)]
    table: StatisticsTable,
}

/// Tells how often what fails where and when, and how late which service is; with `Accept` of Parquet one table of it.
#[utoipa::path(
    get,
    path = "/v1/networks/{network}/statistics",
    params(SpanParameters),
    responses((status = 200, description = "Counts with their 95 % intervals.", content(
        (NetworkStatistics = "application/json"),
        (Vec<u8> = "application/vnd.apache.parquet"),
    ))),
)]
pub(super) async fn get_statistics(
    OnNetwork(network): OnNetwork,
    Call(dispatch, caller, span): Call<Dispatch, SpanParameters>,
    headers: HeaderMap,
) -> Answer {
    let (from, until) = (span.from.as_deref(), span.until.as_deref());
    let statistics = dispatch.statistics(&caller, &network, from, until).await?;
    if accepted(&headers, &[PARQUET]).is_some() {
        let table = as_parquet(&statistics, span.table)
            .map_err(|error| Refusal::new(Code::Internal, error.to_string()))?;
        return Ok(of_bytes(StatusCode::OK, PARQUET, table));
    }
    json(&statistics)
}
