//! The frame of the description of a registry.

use crate::api::openapi::Outline;
use crate::api::openapi_conventions::{Resource, resources};
use crate::api::operations::Daemon;

const DESCRIPTION: &str = "The central log of what edges enforce: networks, no-fly zones, closures and weather; and the \
market: providers with their drones and services, customers, quotes and deliveries. Each write of the log is one revision of \
its network; edges follow revision by revision, or take the snapshot and follow from there. \
Positions are longitude first; times are RFC 3339 in UTC; units are in the names of fields. Every refusal is a problem \
document (RFC 9457) with a stable `code`; `/docs/problems` lists them.";

const TAGS: [(&str, &str); 10] = [
    ("networks", "Skyway networks."),
    ("airspace", "No-fly zones and closures over a network."),
    ("weather", "Wind over a network."),
    ("log", "What has changed, and everything that holds."),
    ("edges", "Who follows, and what edges tell."),
    ("providers", "Who delivers, with what drones and services."),
    ("customers", "Who orders."),
    (
        "deliveries",
        "What is offered, what was ordered, and what became of it.",
    ),
    ("webhooks", "Where customers and providers are told."),
    ("probes", "Whether the registry lives and is ready."),
];

const RESOURCES: &[Resource] = resources! {
    "/v1/clock", "networks", "";
    "/v1/customers", "customers", "Id of the customer, which is its tenant.";
    "/v1/deliveries", "deliveries", "Id of the delivery.";
    "/v1/drones", "providers", "Id of the drone, `PROVIDER:NAME`.";
    "/v1/edges", "edges", "";
    "/v1/networks", "networks", "";
    "/v1/networks/{network}/changes", "log", "";
    "/v1/networks/{network}/closures", "airspace", "Id of the closure.";
    "/v1/networks/{network}/edges", "edges", "Id of the edge.";
    "/v1/networks/{network}/snapshot", "log", "";
    "/v1/networks/{network}/weather", "weather", "";
    "/v1/networks/{network}/zones", "airspace", "Id of the zone.";
    "/v1/providers", "providers", "Id of the provider, which is its tenant.";
    "/v1/quotes", "deliveries", "Id of the quote.";
    "/v1/revoked-keys", "edges", "Id of the key: 16 hexadecimal digits, as `GET /v1/keys` of its edge lists them.";
    "/v1/services", "providers", "Id of the service, `PROVIDER:NAME`.";
    "/v1/services:", "deliveries", "";
    "/v1/webhooks", "webhooks", "Id of the webhook, `TENANT:NAME`.";
};

/// The frame.
pub(super) const REGISTRY: Outline = Outline {
    title: "Skyway registry",
    description: DESCRIPTION,
    daemon: Daemon::Registry,
    tags: &TAGS,
    resources: RESOURCES,
    tokens: "A token of this registry. Without tokens, on loopback, anyone may do everything.",
    schemas: |components| components,
};
