//! Answers: JSON with its headers, and refusals, which the gate tells.

use crate::api::problem;
use crate::edge::{Code, Refusal};
use crate::wire::{ClockKind, Freshness, Stamp};
use axum::body::Body;
use axum::response::{IntoResponse, Response};
use http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use serde::Serialize;

/// The media type of most answers.
pub(in crate::api) const JSON: &str = "application/json";
/// The media type of zones and of the network (RFC 7946).
pub(in crate::api) const GEOJSON: &str = "application/geo+json";

/// Most recompositions are shorter; a longer answer grows the buffer.
const CAPACITY_BYTES: usize = 1024;

/// What a handler gives back.
pub(in crate::api) type Answer = Result<Response, Refused>;

/// A refusal on its way to the gate, which tells it with the id of the request.
pub(in crate::api) struct Refused(Refusal);

impl From<Refusal> for Refused {
    fn from(refusal: Refusal) -> Self {
        Self(refusal)
    }
}

impl IntoResponse for Refused {
    fn into_response(self) -> Response {
        let mut response = Response::new(Body::empty());
        *response.status_mut() = problem::row(self.0.code).status;
        response.extensions_mut().insert(self.0);
        response
    }
}

/// A body as JSON.
pub(in crate::api) fn json(body: &impl Serialize) -> Answer {
    told(StatusCode::OK, JSON, body)
}

/// What there is, as JSON that is about so long: a long body is not copied again and again as its buffer grows.
pub(in crate::api) fn json_of_about(capacity_bytes: usize, body: &impl Serialize) -> Answer {
    with_capacity(capacity_bytes, StatusCode::OK, JSON, body)
}

/// Something new as JSON, and where it is.
pub(in crate::api) fn created(body: &impl Serialize, collection: &str, id: &str) -> Answer {
    let mut response = told(StatusCode::CREATED, JSON, body)?;
    let location = format!("{collection}/{}", escaped(id));
    set(&mut response, header::LOCATION, &location);
    Ok(response)
}

/// A body of a media type that is JSON.
pub(in crate::api) fn told(
    status: StatusCode,
    media_type: &'static str,
    body: &impl Serialize,
) -> Answer {
    with_capacity(CAPACITY_BYTES, status, media_type, body)
}

fn with_capacity(
    capacity_bytes: usize,
    status: StatusCode,
    media_type: &'static str,
    body: &impl Serialize,
) -> Answer {
    let mut bytes = Vec::with_capacity(capacity_bytes);
    if let Err(error) = serde_json::to_writer(&mut bytes, body) {
        let detail = format!("the answer has no JSON form: {error}");
        return Err(Refusal::new(Code::Internal, detail).into());
    }
    Ok(of_bytes(status, media_type, bytes))
}

/// A body that is written already.
pub(in crate::api) fn of_bytes(
    status: StatusCode,
    media_type: &'static str,
    body: impl Into<Body>,
) -> Response {
    let mut response = Response::new(body.into());
    *response.status_mut() = status;
    let media_type = HeaderValue::from_static(media_type);
    response
        .headers_mut()
        .insert(header::CONTENT_TYPE, media_type);
    response
}

/// Sets a header; text that cannot stand in one is left out, as the body has it.
pub(in crate::api) fn set(response: &mut Response, name: HeaderName, text: &str) {
    if let Ok(value) = HeaderValue::from_str(text) {
        response.headers_mut().insert(name, value);
    }
}

/// An answer whose body does not say on which world it was computed says so in headers.
pub(in crate::api) fn stamped(mut response: Response, stamp: &Stamp<'_>) -> Response {
    let freshness = match stamp.freshness {
        Freshness::Fresh => "fresh",
        Freshness::Stale => "stale",
        Freshness::Degraded => "degraded",
    };
    let clock = match stamp.clock {
        ClockKind::Real => "real",
        ClockKind::Simulated => "simulated",
        ClockKind::External => "external",
    };
    let name = HeaderName::from_static;
    set(&mut response, name("skyway-revision"), &stamp.revision);
    set(&mut response, name("skyway-freshness"), freshness);
    set(&mut response, name("skyway-clock"), clock);
    if let Some(revision) = stamp.registry_revision {
        let revision = revision.to_string();
        set(&mut response, name("skyway-registry-revision"), &revision);
    }
    if let Some(age_s) = stamp.registry_age_s {
        let age_s = format!("{age_s:.3}");
        set(&mut response, name("skyway-registry-age-s"), &age_s);
    }
    response
}

/// The answer to who has the current version already (RFC 9110, 13.1.2); none to everybody else.
pub(in crate::api) fn not_modified(headers: &HeaderMap, etag: &str) -> Option<Response> {
    let lines = headers.get_all(header::IF_NONE_MATCH).iter();
    let mut tags = lines
        .filter_map(|line| line.to_str().ok())
        .flat_map(|line| line.split(','))
        .map(str::trim);
    let has_it = tags.any(|tag| tag == "*" || tag.strip_prefix("W/").unwrap_or(tag) == etag);
    if !has_it {
        return None;
    }
    let mut response = Response::new(Body::empty());
    *response.status_mut() = StatusCode::NOT_MODIFIED;
    set(&mut response, header::ETAG, etag);
    Some(response)
}

/// The current version of something that is written already, or that the caller has it.
pub(in crate::api) fn current(
    headers: &HeaderMap,
    etag: &str,
    media_type: &'static str,
    body: impl Into<Body>,
) -> Response {
    not_modified(headers, etag).unwrap_or_else(|| {
        let mut response = of_bytes(StatusCode::OK, media_type, body);
        set(&mut response, header::ETAG, etag);
        response
    })
}

/// An id as one segment of a path (RFC 3986, 2.3): everything but unreserved characters is escaped.
pub(in crate::api) fn escaped(id: &str) -> String {
    let mut text = String::with_capacity(id.len());
    for byte in id.bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' => {
                text.push(char::from(byte));
            }
            other => text.push_str(&format!("%{other:02X}")),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_escaped_in_paths() {
        assert_eq!(escaped("zone-1_a.b~"), "zone-1_a.b~");
        assert_eq!(escaped("a b/ü?"), "a%20b%2F%C3%BC%3F");
    }

    #[test]
    fn entity_tags_are_compared_weakly_in_lists() {
        let asked = |text: &str| {
            let value = HeaderValue::from_str(text).expect("a header value");
            let headers = HeaderMap::from_iter([(header::IF_NONE_MATCH, value)]);
            not_modified(&headers, "\"7-1\"").is_some()
        };
        assert!(asked("\"7-1\"") && asked("W/\"7-1\"") && asked("\"6-9\", \"7-1\"") && asked("*"));
        assert!(!asked("\"7-2\"") && !asked("7-1") && !asked(""));
        assert!(not_modified(&HeaderMap::new(), "\"7-1\"").is_none());
    }
}
