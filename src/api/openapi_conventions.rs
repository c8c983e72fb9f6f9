//! What the conventions of the API say of every operation, so that no handler repeats it: its tag, the ids in its
//! path, and the headers of versions, of stamps and of what is new. What a handler says itself stays.

use super::operations::Operation;
use http::Method;
use std::collections::BTreeSet;
use utoipa::openapi::header::HeaderBuilder;
use utoipa::openapi::path::{
    Operation as Described, Parameter, ParameterBuilder, ParameterIn, Paths,
};
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{RefOr, Required};

/// The beginning of a path, the tag of its operations, and what an id is that follows.
pub(in crate::api) type Resource = (&'static str, &'static str, &'static str);

/// A row a path; a longer path stands behind one that it begins with.
macro_rules! resources {
    ($($start:literal, $tag:literal, $id:literal;)*) => { &[$(($start, $tag, $id)),*] };
}

pub(in crate::api) use resources;

/// Their answers say in headers on which world they were computed, as no body does.
const STAMPED: [Operation; 9] = [
    Operation::GetPack,
    Operation::GetZone,
    Operation::GetClosure,
    Operation::CreateClosure,
    Operation::ChangeClosure,
    Operation::DeleteClosure,
    Operation::DecideProposal,
    Operation::DecideHold,
    Operation::GetNetwork,
];

/// Headers of answers; those of a stamp last.
const HEADERS: [(&str, &str); 5] = [
    ("Location", "Its path."),
    ("ETag", "Its version, for `If-Match`."),
    ("Skyway-Revision", "Revision of the edge."),
    ("Skyway-Freshness", "`fresh`, `stale` or `degraded`."),
    ("Skyway-Clock", "`real`, `simulated` or `external`."),
];

/// The paths of what has versions: a write there may name the one that it takes the place of.
pub(super) fn versioned(paths: &Paths) -> BTreeSet<String> {
    let names_one = |operation: &Option<Described>| {
        let responses = operation.as_ref().map(|described| &described.responses);
        responses.is_some_and(|responses| responses.responses.contains_key("412"))
    };
    let items = paths.paths.iter();
    items
        .filter(|(_, item)| names_one(&item.put) || names_one(&item.patch))
        .map(|(path, _)| path.clone())
        .collect()
}

/// Completes an operation by its tag and by what its path and its headers are asked for.
pub(super) fn add_parameters(
    described: &mut Described,
    method: &Method,
    path: &str,
    resources: &[Resource],
) {
    let found = resources.iter().rfind(|row| path.starts_with(row.0));
    let (start, tag, id) = found.copied().unwrap_or(("", "probes", ""));
    described.tags = Some(vec![tag.to_owned()]);
    if path[start.len()..].starts_with("/{id}") {
        add(described, ParameterIn::Path, "id", id);
    }
    if path.contains("{network}") {
        let id = "Id of the network.";
        add(described, ParameterIn::Path, "network", id);
    }
    let answers = |status: &str| described.responses.responses.contains_key(status);
    let verb = match *method {
        Method::PUT => "replace",
        Method::PATCH => "change",
        _ if answers("204") => "delete",
        _ => "lift",
    };
    let when = match *method {
        Method::PUT => "required where there is one",
        _ if answers("428") => "required",
        _ => "any where none is given",
    };
    let (may_differ, may_be_had) = (answers("412"), answers("304"));
    if may_differ {
        let tag = format!("Entity tag of the version to {verb}; {when}.");
        add(described, ParameterIn::Header, "If-Match", &tag);
    }
    if may_be_had {
        let tags = "Entity tags of the versions that the caller has.";
        add(described, ParameterIn::Header, "If-None-Match", tags);
    }
    let parameters = described.parameters.iter_mut();
    parameters.for_each(|parameters| parameters.sort_by_key(rank));
}

fn add(described: &mut Described, place: ParameterIn, name: &str, description: &str) {
    let required = match place {
        ParameterIn::Path => Required::True,
        _ => Required::False,
    };
    let parameters = described.parameters.get_or_insert_default();
    let is_it = |there: &RefOr<Parameter>| matches!(there, RefOr::T(there) if there.name == name);
    if !parameters.iter().any(is_it) {
        let parameter = ParameterBuilder::new()
            .name(name)
            .parameter_in(place)
            .required(required)
            .description(Some(description))
            .schema(Some(ObjectBuilder::new().schema_type(Type::String)));
        parameters.push(RefOr::T(parameter.build()));
    }
}

/// Paths before queries before headers; a network before what is on it, a version before a key.
fn rank(parameter: &RefOr<Parameter>) -> u8 {
    let RefOr::T(parameter) = parameter else {
        return 0;
    };
    match (&parameter.parameter_in, parameter.name.as_str()) {
        (ParameterIn::Path, "network") => 0,
        (ParameterIn::Path, _) => 1,
        (ParameterIn::Query, _) => 2,
        (_, "Idempotency-Key") => 4,
        _ => 3,
    }
}

/// Completes the answers of an operation by their headers.
pub(super) fn add_headers(
    described: &mut Described,
    operation: Operation,
    method: &Method,
    path: &str,
    versioned: &BTreeSet<String>,
) {
    let responses = &mut described.responses.responses;
    let may_be_had = responses.contains_key("304");
    let tells_version =
        *method != Method::POST && *method != Method::DELETE && versioned.contains(path);
    let makes_version = tells_version || versioned.contains(&format!("{path}/{{id}}"));
    for (status, response) in responses {
        let RefOr::T(response) = response else {
            continue;
        };
        let (is_told, is_new) = (status == "200", status == "201");
        let is_sent = |name| match name {
            "Location" => is_new,
            "ETag" => is_new && makes_version || is_told && (tells_version || may_be_had),
            _ => (is_told || is_new) && STAMPED.contains(&operation),
        };
        for (name, description) in HEADERS.into_iter().filter(|(name, _)| is_sent(*name)) {
            let header = HeaderBuilder::new()
                .schema(Some(ObjectBuilder::new().schema_type(Type::String)))
                .description(Some(description));
            let headers = response.headers.entry(name.to_owned());
            headers.or_insert_with(|| header.build().into());
        }
    }
}
