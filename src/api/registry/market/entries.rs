//! The answers to reads and writes of the directory, with their entity tags.

use crate::api::rest::answer::{Answer, JSON, escaped, not_modified, set, told};
use crate::dispatch::Tagged;
use axum::body::Body;
use axum::response::Response;
use http::{HeaderMap, StatusCode, header};
use serde::Serialize;

/// An entry, or that the caller has its version.
pub(super) fn read<T: Serialize>(found: &Tagged<T>, headers: &HeaderMap) -> Answer {
    if let Some(response) = not_modified(headers, &found.etag) {
        return Ok(response);
    }
    let mut response = told(StatusCode::OK, JSON, &found.value)?;
    set(&mut response, header::ETAG, &found.etag);
    Ok(response)
}

/// An entry that was put below a collection.
pub(super) fn written<T: Serialize>(put: &Tagged<T>, collection: &str) -> Answer {
    let status = if put.created {
        StatusCode::CREATED
    } else {
        StatusCode::OK
    };
    let mut response = told(status, JSON, &put.value)?;
    set(&mut response, header::ETAG, &put.etag);
    if put.created {
        let location = format!("{collection}/{}", escaped(&put.id));
        set(&mut response, header::LOCATION, &location);
    }
    Ok(response)
}

/// That something is gone.
pub(super) fn gone() -> Response {
    let mut response = Response::new(Body::empty());
    *response.status_mut() = StatusCode::NO_CONTENT;
    response
}
