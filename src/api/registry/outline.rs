//! The frame of the description of a registry.

use crate::api::openapi::Outline;

const DESCRIPTION: &str = "The central log of what edges enforce: networks, no-fly zones, closures and weather. Each \
write is one revision of its network; edges follow revision by revision, or take the snapshot and follow from there. \
Positions are longitude first; times are RFC 3339 in UTC; units are in the names of fields. Every refusal is a problem \
document (RFC 9457) with a stable `code`; `/docs/problems` lists them.";

const TAGS: [(&str, &str); 6] = [
    ("networks", "Skyway networks."),
    ("airspace", "No-fly zones and closures over a network."),
    ("weather", "Wind over a network."),
    ("log", "What has changed, and everything that holds."),
    ("edges", "Who follows."),
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
