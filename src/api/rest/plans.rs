//! `/v1/plans`: delivery requests, composed into plans that drones fly and take over.

use super::answer::{Answer, created, json, of_bytes};
use super::extract::{self, Call, IdempotencyKey, PathId};
use super::reading::{self, JsonBody};
use super::refusals;
use crate::edge::{Edge, PageRequest, PlanFilter, PlanWord, Refusal};
use crate::formats::RouteFormat;
use crate::wire::{
    Ack, Cancellation, Completion, Decline, DeliveryRequest, Id, Place, Plan, PlanState, Plans,
    Release,
};
use http::{HeaderMap, StatusCode};
use serde::Deserialize;
use utoipa::IntoParams;

/// Which plans are listed.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct PlansParameters {
    /// At most how many entries; 100 where none is given.
    #[param(value_type = u32, required = false, minimum = 1, maximum = 1000)]
    page_size: Option<u32>,
    /// The `next_page_token` of the page before.
    #[param(value_type = String, required = false)]
    page_token: Option<String>,
    /// Only those that this zone or closure affects.
    #[param(value_type = String, required = false)]
    affected_by: Option<String>,
    /// Only those of this drone.
    #[param(value_type = String, required = false)]
    drone_id: Option<String>,
    /// Only those in this state.
    #[param(value_type = String, required = false, example = "activated")]
    state: Option<PlanState>,
    /// Only those that are over, or are not.
    #[param(value_type = bool, required = false)]
    ended: Option<bool>,
}

/// Where the drone of a plan that is cancelled is: a node, a place, or how far on a leg.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct CancelParameters {
    /// A node.
    #[param(value_type = String, required = false)]
    node: Option<String>,
    /// Longitude in degrees, with `lat`.
    #[param(value_type = f64, required = false, minimum = -180, maximum = 180)]
    lon: Option<f64>,
    /// Latitude in degrees.
    #[param(value_type = f64, required = false, minimum = -90, maximum = 90)]
    lat: Option<f64>,
    /// Metres on a planar network, with `y`.
    #[param(value_type = f64, required = false)]
    x: Option<f64>,
    /// Metres on a planar network.
    #[param(value_type = f64, required = false)]
    y: Option<f64>,
    /// The leg of the reported version, counted from 0.
    #[param(value_type = u32, required = false)]
    leg: Option<u32>,
    /// How far on that leg, from 0 to 1.
    #[param(value_type = f64, required = false, minimum = 0, maximum = 1)]
    fraction: Option<f64>,
    /// Only while its drone has not departed; else it is refused with `plan_state_conflict`.
    #[param(value_type = bool, required = false)]
    before_departure: Option<bool>,
}

impl CancelParameters {
    fn read(self) -> Result<Cancellation, Refusal> {
        let location = match (self.node, (self.lon, self.lat), (self.x, self.y)) {
            (None, (None, None), (None, None)) => None,
            (Some(node), (None, None), (None, None)) => Some(Place::Node(Id::new(node))),
            (None, (Some(lon), Some(lat)), (None, None)) => Some(Place::Pair([lon, lat])),
            (None, (None, None), (Some(x), Some(y))) => Some(Place::Planar { x, y }),
            _ => {
                let message = "a place is 'node', or 'lon' and 'lat', or 'x' and 'y'".to_owned();
                return Err(extract::invalid("parameter_invalid", "?node", message));
            }
        };
        if let Some(fraction) = self.fraction.filter(|share| !(0.0..=1.0).contains(share)) {
            let message = format!("{fraction} is not between 0 and 1");
            return Err(extract::invalid("out_of_range", "?fraction", message));
        }
        Ok(Cancellation {
            location,
            leg: self.leg,
            fraction: self.fraction,
            before_departure: self.before_departure == Some(true),
        })
    }
}

/// Composes a plan: the shortest open way, or with the flight model the best one that the drone can fly; each leg with what to do if it closes.
#[utoipa::path(
    post,
    path = "/v1/plans",
    params(IdempotencyKey),
    request_body(
        content = DeliveryRequest,
        example = json!({"source": "379", "destination": "450", "drone_id": "drone-7", "payload_kg": 1.5}),
    ),
    responses((status = 201, description = "The plan.", body = Plan), refusals::Creation),
)]
pub(super) async fn create_plan(
    Call(edge, caller, _): Call<Edge>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    let request: DeliveryRequest = reading::body(&body, "delivery request")?;
    let idempotency = extract::idempotency(&headers, &body)?;
    let plan = edge.compose_plan(&caller, request, idempotency).await?;
    created(&plan, "/v1/plans", &plan.id)
}

/// Lists the plans that the caller may see, by id.
#[utoipa::path(
    get,
    path = "/v1/plans",
    params(PlansParameters),
    responses((status = 200, description = "A page of plans.", body = Plans)),
)]
pub(super) async fn list_plans(Call(edge, caller, asked): Call<Edge, PlansParameters>) -> Answer {
    let page = PageRequest {
        size: asked.page_size,
        token: asked.page_token,
    };
    let filter = PlanFilter {
        affected_by: asked.affected_by,
        drone_id: asked.drone_id,
        state: asked.state,
        ended: asked.ended,
    };
    json(&edge.plans(&caller, &page, &filter)?)
}

/// Tells a plan, with what it is asked to fly instead, if anything.
///
/// With `Accept` of a format of ground stations or maps: the route of the newest version, in that format.
#[utoipa::path(
    get,
    path = "/v1/plans/{id}",
    responses(
        (status = 200, description = "The plan, or its route.", content(
            (Plan = "application/json"),
            (Object = "application/geo+json"),
            (Object = "application/vnd.qgroundcontrol.plan+json"),
            (String = "text/vnd.qgroundcontrol.waypoints"),
            (String = "application/gpx+xml"),
            (String = "application/vnd.google-earth.kml+xml"),
        )),
        (status = 422, response = refusals::UnprocessableContent),
    ),
)]
pub(super) async fn get_plan(
    PathId(id): PathId,
    Call(edge, caller, _): Call<Edge>,
    headers: HeaderMap,
) -> Answer {
    let media_types = RouteFormat::ALL.map(RouteFormat::media_type);
    let Some(format) = extract::accepted(&headers, &media_types) else {
        return json(&edge.plan(&caller, &id)?);
    };
    let format = RouteFormat::ALL[format];
    let route = edge.plan_route(&caller, &id, format)?;
    Ok(of_bytes(StatusCode::OK, format.media_type(), route))
}

/// Cancels a plan; its segments are free for others. In flight they are only where its place is told, or was seen just now.
#[utoipa::path(
    delete,
    path = "/v1/plans/{id}",
    params(CancelParameters, IdempotencyKey),
    responses(
        (status = 200, description = "The cancelled plan.", body = Plan),
        refusals::Write,
    ),
)]
pub(super) async fn cancel_plan(
    PathId(id): PathId,
    Call(edge, caller, stated): Call<Edge, CancelParameters>,
    headers: HeaderMap,
) -> Answer {
    let cancellation = stated.read()?;
    let told = format!("{cancellation:?}");
    let idempotency = extract::idempotency(&headers, told.as_bytes())?;
    let word = PlanWord::Cancel(cancellation);
    json(&edge.say_of_plan(&caller, &id, word, idempotency).await?)
}

/// Takes over a version of a plan, whichever of those that were sent; the drone flies it from now on.
#[utoipa::path(
    post,
    path = "/v1/plans/{id}/ack",
    params(IdempotencyKey),
    request_body(content = Ack, example = json!({"version": 2})),
    responses(
        (status = 200, description = "The plan as it is flown now.", body = Plan),
        refusals::Write,
    ),
)]
pub(super) async fn acknowledge_plan(
    PathId(id): PathId,
    Call(edge, caller, _): Call<Edge>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    let word = PlanWord::Acknowledge(reading::body(&body, "acknowledgement")?);
    let idempotency = extract::idempotency(&headers, &body)?;
    json(&edge.say_of_plan(&caller, &id, word, idempotency).await?)
}

/// Declines a version of a plan: the drone flies on as it reported, and is asked to fly another one.
#[utoipa::path(
    post,
    path = "/v1/plans/{id}/decline",
    params(IdempotencyKey),
    request_body(content = Decline, example = json!({"version": 2, "reason": "obstacle"})),
    responses(
        (status = 200, description = "The plan, with what it is asked to fly now.", body = Plan),
        refusals::Write,
    ),
)]
pub(super) async fn decline_plan(
    PathId(id): PathId,
    Call(edge, caller, _): Call<Edge>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    let word = PlanWord::Decline(reading::body(&body, "declined version")?);
    let idempotency = extract::idempotency(&headers, &body)?;
    json(&edge.say_of_plan(&caller, &id, word, idempotency).await?)
}

/// Completes a plan: its drone has landed.
#[utoipa::path(
    post,
    path = "/v1/plans/{id}/complete",
    params(IdempotencyKey),
    request_body(content = Completion, example = json!({"location": {"node": "450"}})),
    responses(
        (status = 200, description = "The plan, which has ended.", body = Plan),
        refusals::Write,
    ),
)]
pub(super) async fn complete_plan(
    PathId(id): PathId,
    Call(edge, caller, _): Call<Edge>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    let word = PlanWord::Complete(reading::body(&body, "completion")?);
    let idempotency = extract::idempotency(&headers, &body)?;
    json(&edge.say_of_plan(&caller, &id, word, idempotency).await?)
}

/// Releases a plan of which nothing has been heard: an operator says what became of it, and what it takes is free.
#[utoipa::path(
    post,
    path = "/v1/plans/{id}/release",
    params(IdempotencyKey),
    request_body(content = Release, example = json!({"ended_as": "delivered"})),
    responses(
        (status = 200, description = "The plan, which has ended.", body = Plan),
        refusals::Write,
    ),
)]
pub(super) async fn release_plan(
    PathId(id): PathId,
    Call(edge, caller, _): Call<Edge>,
    headers: HeaderMap,
    JsonBody(body): JsonBody,
) -> Answer {
    let word = PlanWord::Release(reading::body(&body, "release")?);
    let idempotency = extract::idempotency(&headers, &body)?;
    json(&edge.say_of_plan(&caller, &id, word, idempotency).await?)
}
