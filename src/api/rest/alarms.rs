//! `/v1/alarms`: what an operator has to look at.

use super::answer::{Answer, json};
use super::extract::{Call, PathId};
use super::refusals;
use crate::edge::{AlarmFilter, Edge, PageRequest};
use crate::wire::{Alarm, AlarmKind, Alarms};
use serde::Deserialize;
use utoipa::IntoParams;

/// Which alarms are listed.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct AlarmsParameters {
    /// At most how many entries; 100 where none is given.
    #[param(value_type = u32, required = false, minimum = 1, maximum = 1000)]
    page_size: Option<u32>,
    /// The `next_page_token` of the page before.
    #[param(value_type = String, required = false)]
    page_token: Option<String>,
    /// Only those of this kind.
    #[param(value_type = String, required = false, example = "no_route")]
    kind: Option<AlarmKind>,
    /// Only those that an operator has acknowledged, or has not.
    #[param(value_type = bool, required = false)]
    acknowledged: Option<bool>,
    /// Only those whose cause has ended, or has not.
    #[param(value_type = bool, required = false)]
    ended: Option<bool>,
}

/// Lists alarms, oldest first.
#[utoipa::path(
    get,
    path = "/v1/alarms",
    params(AlarmsParameters),
    responses((status = 200, description = "A page of alarms.", body = Alarms)),
)]
pub(super) async fn list_alarms(Call(edge, caller, asked): Call<Edge, AlarmsParameters>) -> Answer {
    let page = PageRequest {
        size: asked.page_size,
        token: asked.page_token,
    };
    let filter = AlarmFilter {
        kind: asked.kind,
        acknowledged: asked.acknowledged,
        ended: asked.ended,
    };
    json(&edge.alarms(&caller, &page, filter)?)
}

/// Acknowledges an alarm; once more changes nothing.
#[utoipa::path(
    post,
    path = "/v1/alarms/{id}/acknowledge",
    responses(
        (status = 200, description = "The alarm, which is acknowledged now.", body = Alarm),
        (status = 507, response = refusals::InsufficientStorage),
    ),
)]
pub(super) async fn acknowledge_alarm(
    PathId(id): PathId,
    Call(edge, caller, _): Call<Edge>,
) -> Answer {
    json(&edge.acknowledge_alarm(&caller, &id).await?)
}
