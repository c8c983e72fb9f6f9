//! The answer to a write: the bytes that the registry made of it, with their headers.

use crate::api::rest::answer::{JSON, escaped, of_bytes, set};
use crate::registry::Reply;
use axum::response::Response;
use http::{StatusCode, header};

/// The answer to a write of something below `collection`, or at it where `is_alone`.
pub(super) fn written(reply: Reply, collection: &str, is_alone: bool) -> Response {
    let status = match reply.created {
        true => StatusCode::CREATED,
        false => StatusCode::OK,
    };
    let mut response = of_bytes(status, JSON, reply.body);
    if let Some(etag) = &reply.etag {
        set(&mut response, header::ETAG, etag);
    }
    if reply.created {
        let location = match is_alone {
            true => collection.to_owned(),
            false => format!("{collection}/{}", escaped(&reply.id)),
        };
        set(&mut response, header::LOCATION, &location);
    }
    response
}

/// The path of what is kept for a network.
pub(super) fn below(network: &str, rest: &str) -> String {
    format!("/v1/networks/{}{rest}", escaped(network))
}
