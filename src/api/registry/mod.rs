//! REST of a registry: what operators write, and what edges follow.
//!
//! It stands behind the same gate as an edge, with the same table of operations and of problems; a handler and
//! its description stand together.

mod clock;
mod closures;
mod edges;
mod extract;
mod log;
mod market;
mod networks;
mod outline;
mod probes;
mod revoked_keys;
mod weather;
mod written;
mod zones;

use super::openapi;
use super::rest::{self, admin, docs};
use super::server::Drain;
use crate::dispatch::Dispatch;
use crate::registry::Registry;
use axum::Router;
use axum::extract::FromRef;
use axum::routing::get;
use prometheus_client::registry::Registry as Metrics;
use serde_json::Value;
use std::sync::Arc;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

/// What handlers work with.
#[derive(Clone)]
struct Shared {
    registry: Arc<Registry>,
    dispatch: Arc<Dispatch>,
    drain: Drain,
}

impl FromRef<Shared> for Arc<Dispatch> {
    fn from_ref(shared: &Shared) -> Self {
        shared.dispatch.clone()
    }
}

impl FromRef<Shared> for Arc<Registry> {
    fn from_ref(shared: &Shared) -> Self {
        shared.registry.clone()
    }
}

impl FromRef<Shared> for Drain {
    fn from_ref(shared: &Shared) -> Self {
        shared.drain.clone()
    }
}

/// The public listener's routes, and their description. Readiness ends when the drain begins, and so does waiting
/// for changes.
///
/// It is to stand behind the gate: handlers take the caller from its `RequestContext`, and leave problems to it.
pub fn router(dispatch: Arc<Dispatch>, drain: Drain) -> (Router, Value) {
    let (routes, described) = OpenApiRouter::with_openapi(openapi::outline(&outline::REGISTRY))
        .merge(over_networks())
        .merge(following())
        .merge(market::routes())
        .split_for_parts();
    let description = openapi::complete(described, &outline::REGISTRY);
    let router = routes
        .with_state(shared(dispatch, drain))
        .merge(docs::router(&description));
    (router, description)
}

/// The admin listener's routes.
pub fn admin_router(dispatch: Arc<Dispatch>, metrics: Arc<Metrics>, drain: Drain) -> Router {
    let shared = shared(dispatch, drain);
    Router::new()
        .route("/livez", get(rest::probes::live))
        .route("/readyz", get(probes::ready))
        .route("/status", get(probes::status))
        .with_state(shared)
        .merge(admin::metrics_router(metrics))
}

fn shared(dispatch: Arc<Dispatch>, drain: Drain) -> Shared {
    Shared {
        registry: dispatch.registry().clone(),
        dispatch,
        drain,
    }
}

fn over_networks() -> OpenApiRouter<Shared> {
    OpenApiRouter::default()
        .routes(routes!(networks::list_networks))
        .routes(routes!(
            networks::get_network,
            networks::put_network,
            networks::patch_network
        ))
        .routes(routes!(zones::list_zones, zones::create_zone))
        .routes(routes!(
            zones::get_zone,
            zones::put_zone,
            zones::delete_zone
        ))
        .routes(routes!(closures::list_closures, closures::create_closure))
        .routes(routes!(
            closures::get_closure,
            closures::put_closure,
            closures::delete_closure
        ))
        .routes(routes!(weather::get_weather, weather::put_weather))
}

fn following() -> OpenApiRouter<Shared> {
    OpenApiRouter::default()
        .routes(routes!(log::follow))
        .routes(routes!(log::snapshot))
        .routes(routes!(edges::report_edge))
        .routes(routes!(edges::list_edges))
        .routes(routes!(revoked_keys::list_revoked_keys))
        .routes(routes!(revoked_keys::revoke_key))
        .routes(routes!(clock::get_clock))
        .routes(routes!(rest::probes::live))
        .routes(routes!(probes::ready))
}
