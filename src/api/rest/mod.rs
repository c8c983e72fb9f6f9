//! REST: one file for each resource, whose handlers read a request, call the use case and write its answer.
//!
//! A handler and its description stand together, so that neither is there without the other. Problems are
//! told by the gate, which knows the request's id; a handler only says what was refused.

pub(in crate::api) mod admin;
mod alarms;
pub(in crate::api) mod answer;
mod clock;
mod closures;
pub(in crate::api) mod docs;
mod drones;
mod events;
mod exposition;
pub(in crate::api) mod extract;
mod failure_rates;
mod failures;
mod holds;
mod mail;
mod network;
mod packs;
mod plans;
pub(in crate::api) mod probes;
mod proposals;
pub(in crate::api) mod reading;
mod recompositions;
pub(crate) mod refusals;
mod weather;
pub(in crate::api) mod zone_schema;
mod zones;

use super::openapi;
use super::operations::Operation;
use super::server::{Drain, RestHandler};
use crate::edge::Edge;
use axum::Router;
use axum::extract::FromRef;
use axum::handler::Handler;
use axum::routing::get;
use prometheus_client::registry::Registry;
use serde_json::Value;
use std::sync::Arc;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

/// What handlers work with.
#[derive(Clone)]
struct Shared {
    edge: Arc<Edge>,
    drain: Drain,
}

impl FromRef<Shared> for Arc<Edge> {
    fn from_ref(shared: &Shared) -> Self {
        shared.edge.clone()
    }
}

impl FromRef<Shared> for Drain {
    fn from_ref(shared: &Shared) -> Self {
        shared.drain.clone()
    }
}

/// The public listener's REST routes, and their description. Readiness ends when the drain begins.
///
/// It is to stand behind the gate: handlers take the caller from its `RequestContext`, and leave problems to it.
pub fn router(edge: Arc<Edge>, drain: Drain) -> (Router, Value) {
    let (routes, described) = OpenApiRouter::with_openapi(openapi::outline(&openapi::EDGE))
        .merge(recomposition())
        .merge(planning())
        .merge(airspace())
        .merge(observation())
        .split_for_parts();
    let description = openapi::complete(described, &openapi::EDGE);
    let router = routes
        .with_state(Shared { edge, drain })
        .merge(docs::router(&description));
    (router, description)
}

/// The handlers of what is asked most, which need no route.
pub fn handlers(edge: Arc<Edge>, drain: Drain) -> Vec<(Operation, RestHandler)> {
    let shared = Shared { edge, drain };
    let report: RestHandler =
        Arc::new(move |request| Handler::call(failures::report_failure, request, shared.clone()));
    vec![(Operation::ReportFailure, report)]
}

/// The admin listener's routes.
pub fn admin_router(edge: Arc<Edge>, registry: Arc<Registry>, drain: Drain) -> Router {
    let shared = Shared {
        edge: edge.clone(),
        drain,
    };
    Router::new()
        .route("/livez", get(probes::live))
        .route("/readyz", get(probes::ready))
        .with_state(shared)
        .merge(admin::router(edge, registry))
}

fn recomposition() -> OpenApiRouter<Shared> {
    OpenApiRouter::default()
        .routes(routes!(failures::report_failure))
        .routes(routes!(failures::report_failures))
        .routes(routes!(recompositions::list_recompositions))
        .routes(routes!(recompositions::get_recomposition))
}

fn planning() -> OpenApiRouter<Shared> {
    OpenApiRouter::default()
        .routes(routes!(plans::create_plan, plans::list_plans))
        .routes(routes!(plans::get_plan, plans::cancel_plan))
        .routes(routes!(plans::acknowledge_plan))
        .routes(routes!(plans::decline_plan))
        .routes(routes!(plans::complete_plan))
        .routes(routes!(plans::release_plan))
        .routes(routes!(packs::get_pack))
        .routes(routes!(packs::list_keys))
}

fn airspace() -> OpenApiRouter<Shared> {
    OpenApiRouter::default()
        .routes(routes!(zones::create_zone, zones::list_zones))
        .routes(routes!(
            zones::put_zone,
            zones::get_zone,
            zones::delete_zone
        ))
        .routes(routes!(zones::preview_zone))
        .routes(routes!(zones::import_zones))
        .routes(routes!(closures::create_closure, closures::list_closures))
        .routes(routes!(
            closures::get_closure,
            closures::change_closure,
            closures::delete_closure
        ))
        .routes(routes!(failure_rates::list_failure_rates))
        .routes(routes!(proposals::list_proposals))
        .routes(routes!(proposals::accept_proposal))
        .routes(routes!(proposals::reject_proposal))
        .routes(routes!(alarms::list_alarms))
        .routes(routes!(alarms::acknowledge_alarm))
        .routes(routes!(holds::list_holds))
        .routes(routes!(holds::release_hold))
        .routes(routes!(holds::reject_hold))
        .routes(routes!(weather::get_weather, weather::put_weather))
        .routes(routes!(clock::get_clock))
        .routes(routes!(clock::advance_clock))
        .routes(routes!(clock::confirm_clock))
}

fn observation() -> OpenApiRouter<Shared> {
    OpenApiRouter::default()
        .routes(routes!(network::get_network))
        .routes(routes!(network::get_node))
        .routes(routes!(network::nearest))
        .routes(routes!(drones::post_telemetry))
        .routes(routes!(drones::list_drones))
        .routes(routes!(mail::watch_mail))
        .routes(routes!(mail::receive_mail))
        .routes(routes!(events::watch_events))
        .routes(routes!(probes::live))
        .routes(routes!(probes::ready))
}
