//! The description of the REST API (OpenAPI 3.1): what no single operation says of itself.
//!
//! Handlers describe their operations; here stands the frame, and what follows from the tables of operations
//! and of problems: who may call, and how any call may be refused.

use super::openapi_conventions::{self as conventions, Resource, resources};
use super::openapi_ids::with_given_ids;
use super::operations::{Access, Daemon, Operation};
use super::rest::refusals;
use crate::wire::{Author, Event, EventKind, Fault, Problem, TelemetryEntry};
use http::{Method, StatusCode};
use serde_json::Value;
use utoipa::openapi::path::{Operation as Described, PathItem};
use utoipa::openapi::schema::{SchemaType, Type};
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme};
use utoipa::openapi::tag::TagBuilder;
use utoipa::openapi::{
    ComponentsBuilder, InfoBuilder, LicenseBuilder, OpenApi, OpenApiBuilder, Ref, RefOr, Schema,
    ServerBuilder,
};

const BEARER: &str = "bearer";

/// What distinguishes the description of one daemon from that of another.
pub(in crate::api) struct Outline {
    pub(in crate::api) title: &'static str,
    pub(in crate::api) description: &'static str,
    pub(in crate::api) daemon: Daemon,
    pub(in crate::api) tags: &'static [(&'static str, &'static str)],
    pub(in crate::api) resources: &'static [Resource],
    /// Whose tokens are asked for.
    pub(in crate::api) tokens: &'static str,
    /// Schemas that no operation names.
    pub(in crate::api) schemas: fn(ComponentsBuilder) -> ComponentsBuilder,
}

/// The description of an edge.
pub(super) const EDGE: Outline = Outline {
    title: "Skyway edge",
    description: DESCRIPTION,
    daemon: Daemon::Edge,
    tags: &TAGS,
    resources: RESOURCES,
    tokens: "A token of this edge. Without tokens, on loopback, anyone may do everything.",
    schemas: |components| {
        components
            .schema_from::<Event<'static>>()
            .schema_from::<EventKind>()
            .schema_from::<Author>()
            .schema_from::<TelemetryEntry>()
    },
};

const DESCRIPTION: &str = "Exact recomposition of drone delivery routes on a skyway network, beside the airspace and the \
plans that it depends on. Positions are longitude first; times are RFC 3339 in UTC; units are in the names of fields. \
Every refusal is a problem document (RFC 9457) with a stable `code`; `/docs/problems` lists them. What drones \
and simulators need is offered over gRPC too, with the same codes.";

const TAGS: [(&str, &str); 8] = [
    (
        "recomposition",
        "Failure reports and what they were answered.",
    ),
    (
        "plans",
        "Delivery requests and the plans composed for them.",
    ),
    ("airspace", "No-fly zones, closures and the weather."),
    ("decisions", "What waits for an operator."),
    ("network", "The skyway network."),
    ("drones", "Telemetry, and where drones are."),
    ("events", "What happens, as it happens."),
    ("probes", "Whether the edge lives and is ready."),
];

const RESOURCES: &[Resource] = resources! {
    "/v1/alarms", "decisions", "`id` of an alarm.";
    "/v1/clock", "network", "";
    "/v1/clock:", "decisions", "";
    "/v1/closures", "airspace", "`id` of a closure.";
    "/v1/drones", "drones", "";
    "/v1/events", "events", "";
    "/v1/failure-rates", "network", "";
    "/v1/failures", "recomposition", "";
    "/v1/holds", "decisions", "`id` of a hold.";
    "/v1/keys", "plans", "";
    "/v1/n", "network", "";
    "/v1/plans", "plans", "`id` of a plan.";
    "/v1/proposals", "decisions", "`id` of a proposal.";
    "/v1/recompositions", "recomposition", "`id` of a recomposition.";
    "/v1/telemetry", "drones", "";
    "/v1/weather", "airspace", "";
    "/v1/zones", "airspace", "`id` of the zone.";
};

/// The frame, without any operation.
pub(super) fn outline(outline: &Outline) -> OpenApi {
    let license = LicenseBuilder::new()
        .name("Apache-2.0")
        .identifier(Some("Apache-2.0"));
    let info = InfoBuilder::new()
        .title(outline.title)
        .version(env!("CARGO_PKG_VERSION"))
        .description(Some(outline.description))
        .license(Some(license.build()));
    let tags = outline.tags.iter().map(|(name, description)| {
        TagBuilder::new()
            .name(*name)
            .description(Some(*description))
            .build()
    });
    let token = HttpBuilder::new()
        .scheme(HttpAuthScheme::Bearer)
        .description(Some(outline.tokens));
    let mut components = ComponentsBuilder::new()
        .security_scheme(BEARER, SecurityScheme::Http(token.build()))
        .schema_from::<Problem>()
        .schema_from::<Fault>();
    components = (outline.schemas)(components);
    for (_, name, response) in refusals::all() {
        components = components.response(name, response);
    }
    OpenApiBuilder::new()
        .info(info)
        .tags(Some(tags))
        .servers(Some([ServerBuilder::new().url("/").build()]))
        .components(Some(components.build()))
        .build()
}

/// The description with what follows for each operation from the tables.
pub(super) fn complete(mut description: OpenApi, outline: &Outline) -> Value {
    let versioned = conventions::versioned(&description.paths);
    for (path, item) in &mut description.paths.paths {
        for (method, described) in operations(item) {
            conventions::add_parameters(described, &method, path, outline.resources);
            let asked = path.replace(['{', '}'], "");
            if let Ok(operation) = Operation::of_rest(outline.daemon, &method, &asked) {
                conventions::add_headers(described, operation, &method, path, &versioned);
                refuse(described, operation, path.contains('{'));
            }
            state_parameters(described);
        }
    }
    // A map with text keys and plain values always has a JSON form.
    with_given_ids(serde_json::to_value(description).unwrap_or_default())
}

fn operations(item: &mut PathItem) -> impl Iterator<Item = (Method, &mut Described)> {
    let operations = [
        (Method::GET, &mut item.get),
        (Method::POST, &mut item.post),
        (Method::PUT, &mut item.put),
        (Method::PATCH, &mut item.patch),
        (Method::DELETE, &mut item.delete),
    ];
    let operations = operations.into_iter();
    operations.filter_map(|(method, described)| Some((method, described.as_mut()?)))
}

/// A parameter that need not be given is absent, never null: headers and queries have no null.
fn state_parameters(described: &mut Described) {
    for parameter in described.parameters.iter_mut().flatten() {
        let RefOr::T(parameter) = parameter else {
            continue;
        };
        let Some(RefOr::T(Schema::Object(schema))) = &mut parameter.schema else {
            continue;
        };
        if let SchemaType::Array(types) = &mut schema.schema_type {
            types.retain(|kind| *kind != Type::Null);
            if let [only] = types.as_slice() {
                schema.schema_type = SchemaType::Type(only.clone());
            }
        }
    }
}

/// Adds who may call an operation, and the refusals that any such operation may meet.
fn refuse(described: &mut Described, operation: Operation, has_id: bool) {
    let is_open = operation.row().access == Access::Open;
    let has_body = described.request_body.is_some();
    let rules = [
        (StatusCode::BAD_REQUEST, !is_open),
        (StatusCode::UNAUTHORIZED, !is_open),
        (StatusCode::FORBIDDEN, !is_open),
        (StatusCode::NOT_FOUND, has_id),
        (StatusCode::PAYLOAD_TOO_LARGE, has_body),
        (StatusCode::UNSUPPORTED_MEDIA_TYPE, has_body),
        (StatusCode::MISDIRECTED_REQUEST, true),
        (StatusCode::INTERNAL_SERVER_ERROR, true),
        (StatusCode::SERVICE_UNAVAILABLE, true),
        (StatusCode::GATEWAY_TIMEOUT, true),
    ];
    for (status, name, _) in refusals::all() {
        if rules.contains(&(status, true)) {
            let answer = RefOr::Ref(Ref::from_response_name(name));
            described
                .responses
                .responses
                .insert(status.as_str().to_owned(), answer);
        }
    }
    if !is_open {
        let token = SecurityRequirement::new::<_, _, String>(BEARER, []);
        // Without tokens, on loopback, none is needed.
        described.security = Some(vec![token, SecurityRequirement::default()]);
    }
}
