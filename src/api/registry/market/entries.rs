//! Reads and writes of the directory, with their entity tags.

use crate::access::Caller;
use crate::api::registry::extract::Named;
use crate::api::rest::answer::{Answer, Refused, created, json, not_modified, set};
use crate::api::rest::extract::{Call, NoParameters, if_match};
use crate::api::rest::reading;
use crate::dispatch::{Dispatch, Entry, Tagged};
use axum::body::Body;
use axum::extract::{FromRef, FromRequestParts};
use axum::response::Response;
use http::request::Parts;
use http::{HeaderMap, StatusCode, header};
use serde::Serialize;
use std::sync::Arc;

/// A call about the entry that its path names.
pub(super) struct OnEntry {
    pub(super) dispatch: Arc<Dispatch>,
    pub(super) caller: Caller,
    pub(super) id: String,
    pub(super) headers: HeaderMap,
}

impl<S> FromRequestParts<S> for OnEntry
where
    Arc<Dispatch>: FromRef<S>,
    S: Send + Sync,
{
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refused> {
        let Named(id) = Named::from_request_parts(parts, state).await?;
        let Call(dispatch, caller, NoParameters {}) =
            Call::from_request_parts(parts, state).await?;
        let headers = parts.headers.clone();
        Ok(Self {
            dispatch,
            caller,
            id,
            headers,
        })
    }
}

impl OnEntry {
    pub(super) async fn get<T: Entry>(self) -> Answer {
        let found = self.dispatch.entry::<T>(&self.caller, &self.id).await?;
        read(&found, &self.headers)
    }

    /// Puts what a body says, which is `what`, below a collection.
    pub(super) async fn put<T: Entry>(self, body: &[u8], what: &str, collection: &str) -> Answer {
        let draft: T = reading::body(body, what)?;
        let version = if_match(&self.headers)?;
        let Self { caller, id, .. } = &self;
        let put = self.dispatch.put_entry(caller, id, &draft, version).await?;
        let mut response = match put.created {
            true => created(&put.value, collection, &put.id)?,
            false => json(&put.value)?,
        };
        set(&mut response, header::ETAG, &put.etag);
        Ok(response)
    }

    pub(super) async fn delete<T: Entry>(self) -> Answer {
        let version = if_match(&self.headers)?;
        let Self { caller, id, .. } = &self;
        self.dispatch.delete_entry::<T>(caller, id, version).await?;
        Ok(gone())
    }
}

/// An entry, or that the caller has its version.
pub(super) fn read<T: Serialize>(found: &Tagged<T>, headers: &HeaderMap) -> Answer {
    if let Some(response) = not_modified(headers, &found.etag) {
        return Ok(response);
    }
    let mut response = json(&found.value)?;
    set(&mut response, header::ETAG, &found.etag);
    Ok(response)
}

/// That something is gone.
pub(super) fn gone() -> Response {
    let mut response = Response::new(Body::empty());
    *response.status_mut() = StatusCode::NO_CONTENT;
    response
}
