//! `/v1/networks/{network}/edges/{id}/positions` and `/v1/drones/{id}/positions`: where drones were.

use crate::api::registry::extract::{Named, PathId, check_edge};
use crate::api::rest::answer::{Answer, json, json_of_about};
use crate::api::rest::extract::Call;
use crate::api::rest::reading::{self, JsonBody};
use crate::api::rest::refusals;
use crate::dispatch::{Dispatch, PositionsAsked};
use crate::refusal::{Code, Refusal};
use crate::wire::{PositionBatch, PositionHistory, PositionsTaken};
use bytes::Bytes;
use flate2::read::GzDecoder;
use http::{HeaderMap, header};
use serde::Deserialize;
use std::io::Read;
use utoipa::IntoParams;

/// The largest batch once it is not compressed any more, in bytes: 10,000 positions take a fifth of it.
const BATCH_BYTES_MAX: usize = 8 << 20;

/// What a position takes as JSON, in bytes, where its drone has a short name.
const POSITION_BYTES: usize = 160;

/// Which positions of a drone.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct HistoryParameters {
    /// From when on, RFC 3339; an hour before `until` where nothing is said.
    #[param(value_type = String, format = DateTime, required = false)]
    from: Option<String>,
    /// Until before when, RFC 3339; now where nothing is said.
    #[param(value_type = String, format = DateTime, required = false)]
    until: Option<String>,
    /// The most of them; 1,000 where nothing is said.
    #[param(value_type = u64, required = false, minimum = 1, maximum = 100000)]
    limit: Option<u64>,
}

/// Keeps where drones were. The same position is kept once, however often it is sent.
///
/// The body may be compressed (`Content-Encoding: gzip`); it counts as it is then, too: at most 8 MiB. A token that is kept to a
/// network places no drone that is enrolled over another one.
#[utoipa::path(
    post,
    path = "/v1/networks/{network}/edges/{id}/positions",
    params(("Content-Encoding" = Option<String>, Header, description = "`gzip`, where the body is compressed.")),
    request_body(
        content = PositionBatch,
        example = json!({"positions": [{"drone_id": "acme:7", "at_ms": 1795802400000_i64, "lon": 151.21, "lat": -33.86}]}),
    ),
    responses(
        (status = 200, description = "How many are kept that were not before.", body = PositionsTaken),
        refusals::Write,
    ),
)]
pub(super) async fn take_positions(
    PathId { network, id }: PathId,
    Call(dispatch, caller, _): Call<Dispatch>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    check_edge(&caller, &id)?;
    // The gate lets no other encoding through.
    let encoding = headers.get(header::CONTENT_ENCODING);
    let is_compressed =
        encoding.is_some_and(|encoding| encoding.as_bytes().eq_ignore_ascii_case(b"gzip"));
    // Thousands of positions are read in the time of hundreds of other requests.
    let read = tokio::task::spawn_blocking(move || read_batch(&body, is_compressed)).await;
    let batch = read.map_err(|error| {
        Refusal::new(Code::Internal, format!("the batch was not read: {error}"))
    })??;
    json(
        &dispatch
            .take_positions(&caller, &network, &id, &batch)
            .await?,
    )
}

/// Tells where a drone was, oldest first.
#[utoipa::path(
    get,
    path = "/v1/drones/{id}/positions",
    params(HistoryParameters),
    responses((status = 200, description = "The positions that are kept.", body = PositionHistory)),
)]
pub(super) async fn list_positions(
    Named(id): Named,
    Call(dispatch, caller, asked): Call<Dispatch, HistoryParameters>,
) -> Answer {
    let asked = PositionsAsked {
        from: asked.from,
        until: asked.until,
        limit: asked.limit,
    };
    let history = dispatch.positions(&caller, &id, &asked).await?;
    // A day is 10 MB: neither is it written in the time of hundreds of other requests.
    let written = tokio::task::spawn_blocking(move || {
        json_of_about(history.positions.len() * POSITION_BYTES, &history)
    });
    written.await.map_err(|error| {
        Refusal::new(
            Code::Internal,
            format!("the positions were not written: {error}"),
        )
    })?
}

fn read_batch(body: &Bytes, is_compressed: bool) -> Result<PositionBatch, Refusal> {
    if !is_compressed {
        return reading::body(body, "batch of positions");
    }
    let mut plain = Vec::with_capacity(body.len().saturating_mul(4).min(BATCH_BYTES_MAX));
    let most = BATCH_BYTES_MAX as u64 + 1;
    let read = GzDecoder::new(&**body).take(most).read_to_end(&mut plain);
    if let Err(error) = read {
        let detail = format!("the body is not what gzip makes: {error}");
        return Err(Refusal::new(Code::BodyInvalid, detail));
    }
    if plain.len() > BATCH_BYTES_MAX {
        let mib = BATCH_BYTES_MAX >> 20;
        let detail = format!("the body has more than {mib} MiB once it is not compressed any more");
        return Err(Refusal::new(Code::BodyTooLarge, detail));
    }
    reading::body(&plain, "batch of positions")
}
