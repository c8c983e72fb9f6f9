//! REST of the market: directory, offers, orders, webhooks, and what edges tell.

mod customers;
mod deliveries;
mod drones;
mod entries;
mod news;
mod offers;
mod positions;
mod providers;
mod quotes;
mod services;
mod statistics;
mod statistics_table;
mod tracks;
mod webhooks;

use super::Shared;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

/// All of it.
pub(super) fn routes() -> OpenApiRouter<Shared> {
    OpenApiRouter::default()
        .merge(directory())
        .merge(told_by_edges())
        .merge(orders())
        .merge(telling())
}

fn directory() -> OpenApiRouter<Shared> {
    OpenApiRouter::default()
        .routes(routes!(providers::list_providers))
        .routes(routes!(
            providers::get_provider,
            providers::put_provider,
            providers::delete_provider
        ))
        .routes(routes!(drones::list_fleet_drones))
        .routes(routes!(
            drones::get_fleet_drone,
            drones::put_fleet_drone,
            drones::delete_fleet_drone
        ))
        .routes(routes!(services::list_services))
        .routes(routes!(
            services::get_service,
            services::put_service,
            services::delete_service
        ))
        .routes(routes!(customers::get_customer, customers::put_customer))
        .routes(routes!(
            customers::get_customer_data,
            customers::delete_customer_data
        ))
}

fn told_by_edges() -> OpenApiRouter<Shared> {
    OpenApiRouter::default()
        .routes(routes!(news::take_news))
        .routes(routes!(positions::take_positions))
        .routes(routes!(positions::list_positions))
        .routes(routes!(statistics::get_statistics))
}

fn telling() -> OpenApiRouter<Shared> {
    OpenApiRouter::default()
        .routes(routes!(webhooks::list_webhooks))
        .routes(routes!(
            webhooks::get_webhook,
            webhooks::put_webhook,
            webhooks::delete_webhook
        ))
        .routes(routes!(webhooks::rotate_webhook))
        .routes(routes!(webhooks::list_messages))
        .routes(routes!(webhooks::resend_message))
}

fn orders() -> OpenApiRouter<Shared> {
    OpenApiRouter::default()
        .routes(routes!(offers::search_services))
        .routes(routes!(quotes::create_quote))
        .routes(routes!(quotes::get_quote))
        .routes(routes!(
            deliveries::list_deliveries,
            deliveries::create_delivery
        ))
        .routes(routes!(deliveries::get_delivery))
        .routes(routes!(deliveries::cancel_delivery))
        .routes(routes!(deliveries::prove_delivery))
        .routes(routes!(tracks::track_delivery))
}
