//! The frame of the description of a registry.

use crate::api::openapi::Outline;

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

/// The frame.
pub(super) const REGISTRY: Outline = Outline {
    title: "Skyway registry",
    description: DESCRIPTION,
    tags: &TAGS,
    tokens: "A token of this registry. Without tokens, on loopback, anyone may do everything.",
    schemas: |components| components,
};
