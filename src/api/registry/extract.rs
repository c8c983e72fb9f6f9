//! What a handler of the registry takes out of a request: ids in the path, and how to write.

use crate::access::{Caller, Role};
use crate::api::rest::answer::Refused;
use crate::api::rest::extract as rest;
use crate::refusal::{Code, Refusal};
use crate::registry::WriteOptions;
use crate::wire::{Fault, ON_BEHALF_OF};
use axum::extract::{FromRequestParts, Path};
use http::request::Parts;
use http::{HeaderMap, Method, Uri};
use serde::Deserialize;
use sha2::{Digest, Sha256};
use utoipa::IntoParams;

/// The longest name of who made a change at an edge, in bytes.
const AUTHOR_BYTES_MAX: usize = 512;

/// The network in the path.
pub(super) struct OnNetwork(pub(super) String);

impl<S: Send + Sync> FromRequestParts<S> for OnNetwork {
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refused> {
        match Path::<String>::from_request_parts(parts, state).await {
            Ok(Path(network)) => {
                check_network(parts, state, &network).await?;
                Ok(Self(network))
            }
            Err(rejection) => Err(invalid("{network}", rejection.body_text()).into()),
        }
    }
}

/// The network and the id in the path.
pub(super) struct PathId {
    pub(super) network: String,
    pub(super) id: String,
}

impl<S: Send + Sync> FromRequestParts<S> for PathId {
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refused> {
        match Path::<(String, String)>::from_request_parts(parts, state).await {
            Ok(Path((network, id))) => {
                check_network(parts, state, &network).await?;
                check("{id}", &id)?;
                Ok(Self { network, id })
            }
            Err(rejection) => Err(invalid("{id}", rejection.body_text()).into()),
        }
    }
}

/// The only id in the path.
pub(super) struct Named(pub(super) String);

impl<S: Send + Sync> FromRequestParts<S> for Named {
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refused> {
        match Path::<String>::from_request_parts(parts, state).await {
            Ok(Path(id)) => {
                check("{id}", &id)?;
                Ok(Self(id))
            }
            Err(rejection) => Err(invalid("{id}", rejection.body_text()).into()),
        }
    }
}

/// Nothing has an id with a control character in it, and not every store can even be asked for one.
fn check(place: &str, id: &str) -> Result<(), Refusal> {
    match id.chars().any(char::is_control) {
        true => Err(invalid(
            place,
            "the id has a control character in it".to_owned(),
        )),
        false => Ok(()),
    }
}

/// Checks that it is the id of a network, and one that the caller may speak of.
async fn check_network<S: Sync>(
    parts: &mut Parts,
    state: &S,
    network: &str,
) -> Result<(), Refused> {
    check("{network}", network)?;
    let rest::Authenticated(caller) = rest::Authenticated::from_request_parts(parts, state).await?;
    if caller.is_of_network(network) {
        return Ok(());
    }
    let detail = format!("this token is not of the network '{network}'");
    Err(Refusal::new(Code::Forbidden, detail).into())
}

/// How something is written.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct WriteParameters {
    /// Whether only to check: the same checks and the same answer, without effect.
    #[serde(default)]
    pub(super) validate_only: bool,
}

/// A request that writes, as far as it is no body.
pub(super) struct Writing {
    pub(super) caller: Caller,
    pub(super) method: Method,
    pub(super) uri: Uri,
    pub(super) headers: HeaderMap,
}

impl<S: Sync + Send> FromRequestParts<S> for Writing {
    type Rejection = Refused;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Refused> {
        let rest::Authenticated(caller) =
            rest::Authenticated::from_request_parts(parts, state).await?;
        Ok(Self {
            caller,
            method: parts.method.clone(),
            uri: parts.uri.clone(),
            headers: parts.headers.clone(),
        })
    }
}

impl Writing {
    /// For whom an edge writes; no other caller writes for others.
    fn on_behalf_of(&self) -> Result<Option<String>, Refusal> {
        if !matches!(self.caller.role, Role::Edge | Role::Anyone) {
            return Ok(None);
        }
        let author = rest::header(&self.headers, ON_BEHALF_OF)?;
        match author {
            Some(author) if author.len() > AUTHOR_BYTES_MAX => {
                let message = format!("it has more than {AUTHOR_BYTES_MAX} bytes");
                Err(invalid(ON_BEHALF_OF, message))
            }
            author => Ok(author),
        }
    }

    /// How to write, with this body.
    pub(super) fn manner(
        &self,
        asked: &WriteParameters,
        body: &[u8],
    ) -> Result<WriteOptions, Refusal> {
        let mut digest = Sha256::new();
        for part in [self.method.as_str().as_bytes(), self.uri.path().as_bytes()] {
            digest.update(part);
            digest.update([0]);
        }
        digest.update(body);
        let fingerprint = hex::encode(digest.finalize());
        Ok(WriteOptions {
            subject: self.caller.subject.to_string(),
            key: rest::header(&self.headers, rest::IDEMPOTENCY_KEY)?,
            fingerprint,
            if_match: rest::if_match(&self.headers)?,
            validate_only: asked.validate_only,
            on_behalf_of: self.on_behalf_of()?,
        })
    }
}

/// Checks that a caller may speak for an edge: an edge for itself, a caller without a subject of its own for all.
pub(super) fn check_edge(caller: &Caller, edge: &str) -> Result<(), Refusal> {
    let is_itself = &*caller.subject == "*" || &*caller.subject == edge;
    if caller.role != Role::Edge || is_itself {
        return Ok(());
    }
    let detail = format!(
        "this token is that of '{}', not of '{edge}'",
        caller.subject
    );
    Err(Refusal::new(Code::Forbidden, detail))
}

/// Something in the path or the query that cannot be read.
pub(super) fn invalid(place: &str, message: String) -> Refusal {
    let fault = Fault {
        code: "parameter_invalid".to_owned(),
        pointer: place.to_owned(),
        message,
        hint: None,
    };
    Refusal::at(Code::ParameterInvalid, fault)
}
