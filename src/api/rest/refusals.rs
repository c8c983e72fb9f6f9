//! Problem answers in the description of the API, one for each HTTP status, from the table of problems.

use crate::api::problem::{self, Row};
use http::StatusCode;
use std::collections::BTreeMap;
use utoipa::openapi::header::{Header, HeaderBuilder};
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{ContentBuilder, Ref, RefOr, Response, ResponseBuilder};
use utoipa::{IntoResponses, ToResponse};

macro_rules! refusals {
    ($($name:ident $status:ident;)*) => {
        $(
            /// The problems of one HTTP status.
            pub(crate) enum $name {}

            impl<'r> ToResponse<'r> for $name {
                fn response() -> (&'r str, RefOr<Response>) {
                    (stringify!($name), RefOr::T(response(StatusCode::$status)))
                }
            }
        )*

        /// All of them, by status and name.
        pub(crate) fn all() -> Vec<(StatusCode, &'static str, RefOr<Response>)> {
            vec![$((StatusCode::$status, stringify!($name), $name::response().1),)*]
        }
    };
}

refusals! {
    BadRequest BAD_REQUEST;
    Unauthorized UNAUTHORIZED;
    Forbidden FORBIDDEN;
    NotFound NOT_FOUND;
    Conflict CONFLICT;
    Gone GONE;
    PreconditionFailed PRECONDITION_FAILED;
    ContentTooLarge PAYLOAD_TOO_LARGE;
    UnsupportedMediaType UNSUPPORTED_MEDIA_TYPE;
    MisdirectedRequest MISDIRECTED_REQUEST;
    UnprocessableContent UNPROCESSABLE_ENTITY;
    PreconditionRequired PRECONDITION_REQUIRED;
    TooManyRequests TOO_MANY_REQUESTS;
    InternalServerError INTERNAL_SERVER_ERROR;
    ServiceUnavailable SERVICE_UNAVAILABLE;
    InsufficientStorage INSUFFICIENT_STORAGE;
    GatewayTimeout GATEWAY_TIMEOUT;
}

macro_rules! groups {
    ($($(#[$doc:meta])* $name:ident $refusals:tt;)*) => {$(
        $(#[$doc])*
        pub(crate) enum $name {}

        impl IntoResponses for $name {
            fn responses() -> BTreeMap<String, RefOr<Response>> {
                references(&$refusals)
            }
        }
    )*};
}

groups! {
    /// What a write may meet.
    Write ["Conflict", "UnprocessableContent", "InsufficientStorage"];
    /// What a write may meet that makes something new, of which there may be too many.
    Creation ["Conflict", "UnprocessableContent", "TooManyRequests", "InsufficientStorage"];
    /// What may be met by who moves the clock.
    ClockMove ["Conflict", "UnprocessableContent"];
    /// What a write may meet that names the version it takes the place of.
    Version ["PreconditionFailed", "PreconditionRequired"];
}

fn references(names: &[&str]) -> BTreeMap<String, RefOr<Response>> {
    let named = all()
        .into_iter()
        .filter(|(_, name, _)| names.contains(name));
    named
        .map(|(status, name, _)| {
            let reference = RefOr::Ref(Ref::from_response_name(name));
            (status.as_str().to_owned(), reference)
        })
        .collect()
}

fn response(status: StatusCode) -> Response {
    let rows: Vec<&Row> = problem::TABLE
        .iter()
        .filter(|row| row.status == status)
        .collect();
    let lines = rows
        .iter()
        .map(|row| format!("`{}`: {}", row.name, row.meaning));
    let description = lines.collect::<Vec<_>>().join("\n\n");
    let content = ContentBuilder::new()
        .schema(Some(Ref::from_schema_name("Problem")))
        .example(rows.first().map(|row| example(row)));
    let mut response = ResponseBuilder::new()
        .description(description)
        .content(problem::MEDIA_TYPE, content.build());
    for (name, header) in headers(status) {
        response = response.header(name, header);
    }
    response.build()
}

fn example(row: &Row) -> serde_json::Value {
    serde_json::json!({
        "type": format!("/docs/problems#{}", row.name),
        "title": row.title,
        "status": row.status.as_u16(),
        "code": row.name,
        "detail": row.meaning,
        "request_id": "5f1d3a90-1c",
    })
}

fn headers(status: StatusCode) -> Vec<(&'static str, Header)> {
    let header = |kind: Type, description: &str| {
        let schema = ObjectBuilder::new().schema_type(kind).build();
        HeaderBuilder::new()
            .schema(Some(schema))
            .description(Some(description))
            .build()
    };
    match status {
        StatusCode::CONFLICT | StatusCode::TOO_MANY_REQUESTS | StatusCode::SERVICE_UNAVAILABLE => {
            vec![(
                "Retry-After",
                header(Type::Integer, "When to try again, in seconds."),
            )]
        }
        StatusCode::PRECONDITION_FAILED | StatusCode::PRECONDITION_REQUIRED => {
            vec![("ETag", header(Type::String, "The current version."))]
        }
        StatusCode::UNAUTHORIZED => {
            vec![("WWW-Authenticate", header(Type::String, "`Bearer`."))]
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_status_of_the_table_is_described() {
        let described: Vec<StatusCode> = all().into_iter().map(|(status, ..)| status).collect();
        for row in problem::TABLE {
            // A method that a path does not have is no operation, so no operation describes it.
            let is_operation = row.status != StatusCode::METHOD_NOT_ALLOWED;
            assert!(
                !is_operation || described.contains(&row.status),
                "{}",
                row.name
            );
        }
    }
}
