//! `/v1/drones`: the drones of providers.

use super::entries::{OnEntry, read};
use crate::api::rest::answer::{Answer, json};
use crate::api::rest::extract::{Call, PageParameters};
use crate::api::rest::reading::JsonBody;
use crate::api::rest::refusals;
use crate::dispatch::Dispatch;
use crate::wire::{FleetDrone, FleetDrones};
use axum::http::HeaderMap;

/// Lists the drones that the caller sees, by id.
#[utoipa::path(
    get,
    path = "/v1/drones",
    params(PageParameters),
    responses((status = 200, description = "A page of drones.", body = FleetDrones)),
)]
pub(super) async fn list_fleet_drones(
    Call(dispatch, caller, page): Call<Dispatch, PageParameters>,
) -> Answer {
    let page = dispatch.fleet_drones(&caller, &page.into_request()).await?;
    json(&FleetDrones {
        drones: page.entries,
        next_page_token: page.next_page_token,
    })
}

/// Tells a drone.
#[utoipa::path(
    get,
    path = "/v1/drones/{id}",
    responses(
        (status = 200, description = "The drone.", body = FleetDrone),
        (status = 304, description = "The caller has the current version."),
    ),
)]
pub(super) async fn get_fleet_drone(on: OnEntry) -> Answer {
    let drone = on.dispatch.fleet_drone(&on.caller, &on.id).await?;
    // Where it is changes without its version.
    let nothing_known = HeaderMap::new();
    let known = match drone.value.last {
        Some(_) => &nothing_known,
        None => &on.headers,
    };
    read(&drone, known)
}

/// Puts a drone under an id, new or in place of the version that `If-Match` names.
#[utoipa::path(
    put,
    path = "/v1/drones/{id}",
    request_body(content = FleetDrone, example = json!({"network": "sydney", "home": "379", "payload_max_kg": 2.5})),
    responses(
        (status = 200, description = "The drone as it is kept; it was there before.", body = FleetDrone),
        (status = 201, description = "The same; the drone is new.", body = FleetDrone),
        refusals::Creation,
        refusals::Version,
    ),
)]
pub(super) async fn put_fleet_drone(on: OnEntry, JsonBody(body): JsonBody) -> Answer {
    on.put::<FleetDrone>(&body, "drone", "/v1/drones").await
}

/// Deletes a drone, of the version that `If-Match` names.
#[utoipa::path(
    delete,
    path = "/v1/drones/{id}",
    responses(
        (status = 204, description = "It is gone."),
        refusals::Write,
        refusals::Version,
    ),
)]
pub(super) async fn delete_fleet_drone(on: OnEntry) -> Answer {
    on.delete::<FleetDrone>().await
}
