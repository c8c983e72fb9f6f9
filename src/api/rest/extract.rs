//! What a handler takes out of a request before its body: the caller, the id in the path, the query.

use super::answer::Refused;
use super::reading;
use crate::access::Caller;
use crate::api::server::RequestContext;
use crate::edge::{Code, Idempotency, PageRequest, Refusal};
use crate::wire::Fault;
use axum::extract::{FromRef, FromRequestParts, Path};
use http::request::Parts;
use http::{HeaderMap, HeaderValue};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};
use std::convert::Infallible;
use std::sync::Arc;
use utoipa::IntoParams;

/// The header that makes a request one that may be sent twice.
pub(in crate::api) const IDEMPOTENCY_KEY: &str = "idempotency-key";

/// The same header, for the description.
#[derive(IntoParams)]
#[into_params(parameter_in = Header)]
#[expect(
    dead_code,
    reason = "it describes what is taken from the headers, and is never made"
)]
pub(in crate::api) struct IdempotencyKey {
    /// The same key and request again get the same answer.
    #[param(rename = "Idempotency-Key", min_length = 1, max_length = 256)]
    key: Option<String>,
}

/// Who calls, as the gate has found out.
pub(in crate::api) struct Authenticated(pub(in crate::api) Caller);

impl<S: Sync> FromRequestParts<S> for Authenticated {
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Refused> {
        match parts.extensions.get::<RequestContext>() {
            Some(context) => Ok(Self(context.caller.clone())),
            // Without a gate the caller is unknown, so no caller is answered.
            None => Err(Refusal::new(Code::Internal, "the request came past the gate").into()),
        }
    }
}

/// The idempotency key, if the request has one. It alone is taken: copying all headers costs a report more than its search.
pub(in crate::api) struct Key(pub(in crate::api) Option<HeaderValue>);

impl<S: Sync> FromRequestParts<S> for Key {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(Self(parts.headers.get(IDEMPOTENCY_KEY).cloned()))
    }
}

/// The id in the path.
pub(in crate::api) struct PathId(pub(in crate::api) String);

impl<S: Send + Sync> FromRequestParts<S> for PathId {
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refused> {
        match Path::<String>::from_request_parts(parts, state).await {
            Ok(Path(id)) => Ok(Self(id)),
            Err(rejection) => Err(invalid("path_invalid", "{id}", rejection.body_text()).into()),
        }
    }
}

/// The parameters of the query, read strictly.
pub(in crate::api) struct Query<T>(pub(in crate::api) T);

impl<T: DeserializeOwned, S: Sync> FromRequestParts<S> for Query<T> {
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Refused> {
        match axum::extract::Query::<T>::try_from_uri(&parts.uri) {
            Ok(axum::extract::Query(parameters)) => Ok(Self(parameters)),
            Err(rejection) => {
                let fault = reading::query_fault(&rejection.body_text());
                Err(Refusal::at(Code::ParameterInvalid, fault).into())
            }
        }
    }
}

/// The query of an operation without parameters.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::api) struct NoParameters {}

/// What nearly every handler takes: the use cases, who calls, and the parameters of the query.
pub(in crate::api) struct Call<U, Q = NoParameters>(
    pub(in crate::api) Arc<U>,
    pub(in crate::api) Caller,
    pub(in crate::api) Q,
);

impl<U, Q, S> FromRequestParts<S> for Call<U, Q>
where
    Arc<U>: FromRef<S>,
    Q: DeserializeOwned,
    S: Sync,
{
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refused> {
        let Authenticated(caller) = Authenticated::from_request_parts(parts, state).await?;
        let Query(query) = Query::from_request_parts(parts, state).await?;
        Ok(Self(Arc::from_ref(state), caller, query))
    }
}

/// Which page of a list.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(in crate::api) struct PageParameters {
    /// At most how many entries; 100 where none is given.
    #[param(value_type = u32, required = false, minimum = 1, maximum = 1000)]
    page_size: Option<u32>,
    /// The `next_page_token` of the page before.
    #[param(value_type = String, required = false)]
    page_token: Option<String>,
}

impl PageParameters {
    pub(in crate::api) fn into_request(self) -> PageRequest {
        PageRequest {
            size: self.page_size,
            token: self.page_token,
        }
    }
}

/// The text of a header, where it is given.
pub(in crate::api) fn header(headers: &HeaderMap, name: &str) -> Result<Option<String>, Refusal> {
    let Some(value) = headers.get(name) else {
        return Ok(None);
    };
    match value.to_str() {
        Ok(text) => Ok(Some(text.to_owned())),
        Err(_) => Err(invalid(
            "header_invalid",
            name,
            "the header is not plain text".to_owned(),
        )),
    }
}

/// Which of some media types `Accept` names first; none where it asks for JSON or anything, before
/// them or alone.
pub(in crate::api) fn accepted(headers: &HeaderMap, offered: &[&str]) -> Option<usize> {
    let lines = headers.get_all(http::header::ACCEPT).iter();
    let mut named = lines
        .filter_map(|line| line.to_str().ok())
        .flat_map(|line| line.split(','))
        .map(|range| range.split(';').next().unwrap_or_default().trim());
    named.find_map(|range| {
        let found = offered
            .iter()
            .position(|media_type| media_type.eq_ignore_ascii_case(range));
        let is_json = ["application/json", "*/*", "application/*"].contains(&range);
        (found.is_some() || is_json).then_some(found)
    })?
}

/// The first of a list of entity tags that is none (RFC 9110, 8.8.3 and 13.1.1); a tag may have commas between its quotes.
fn not_a_tag(list: &str) -> Option<&str> {
    let is_between = |letter: char| [' ', '\t', ','].contains(&letter);
    let mut rest = list;
    loop {
        rest = rest.trim_start_matches(is_between);
        if rest.is_empty() {
            return None;
        }
        let opaque = rest.strip_prefix("W/").unwrap_or(rest);
        let after = match opaque.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').map(|(_, after)| after),
            None => rest.strip_prefix('*'),
        };
        match after.filter(|after| after.is_empty() || after.starts_with(is_between)) {
            Some(after) => rest = after,
            None => return rest.split(is_between).next(),
        }
    }
}

/// `If-Match` as it is sent; several headers count as one list.
pub(in crate::api) fn if_match(headers: &HeaderMap) -> Result<Option<String>, Refusal> {
    let mut lines = Vec::new();
    for value in headers.get_all(http::header::IF_MATCH) {
        let line = value.to_str().map_err(|_| {
            invalid(
                "header_invalid",
                "if-match",
                "the header is not plain text".to_owned(),
            )
        })?;
        if let Some(tag) = not_a_tag(line) {
            let message = format!("'{tag}' is no entity tag");
            let hint = "write it as ETag has it, in quotes; * stands for any";
            return Err(hinted("header_invalid", "if-match", message, hint));
        }
        lines.push(line);
    }
    Ok((!lines.is_empty()).then(|| lines.join(", ")))
}

/// The idempotency key, where one is given, and what the body was.
pub(in crate::api) fn idempotency(
    headers: &HeaderMap,
    body: &[u8],
) -> Result<Idempotency, Refusal> {
    let Some(key) = header(headers, IDEMPOTENCY_KEY)? else {
        return Ok(Idempotency::default());
    };
    Ok(Idempotency {
        key: Some(key),
        fingerprint: Sha256::digest(body).into(),
    })
}

pub(super) fn invalid(code: &str, place: &str, message: String) -> Refusal {
    at(code, place, message, None)
}

fn hinted(code: &str, place: &str, message: String, hint: &str) -> Refusal {
    at(code, place, message, Some(hint.to_owned()))
}

fn at(code: &str, place: &str, message: String, hint: Option<String>) -> Refusal {
    let fault = Fault {
        code: code.to_owned(),
        pointer: place.to_owned(),
        message,
        hint,
    };
    Refusal::at(Code::ParameterInvalid, fault)
}
