//! What every service does with a request: who calls, under which key.

use crate::access::Caller;
use crate::api::problem::grpc_status;
use crate::api::server::RequestContext;
use crate::edge::{Code, Idempotency, Refusal};
use crate::wire::Fault;
use prost::Message;
use sha2::{Digest, Sha256};
use tonic::{Request, Status};

/// Who calls, and with what.
pub(super) fn opened<M>(request: Request<M>) -> Result<(Caller, M), Status> {
    let (_, mut extensions, message) = request.into_parts();
    match extensions.remove::<RequestContext>() {
        Some(context) => Ok((context.caller, message)),
        None => Err(without_context()),
    }
}

/// As [`opened`], with the id of the request, for what is told within an answer.
pub(super) fn opened_with_id<M>(request: Request<M>) -> Result<(Caller, String, M), Status> {
    let (_, mut extensions, message) = request.into_parts();
    match extensions.remove::<RequestContext>() {
        Some(context) => Ok((context.caller, context.request_id.to_string(), message)),
        None => Err(without_context()),
    }
}

// Without the gate the caller is unknown, so no caller may.
fn without_context() -> Status {
    let detail = "the request has not passed the gate";
    grpc_status(&Refusal::new(Code::Internal, detail))
}

/// The answer of a use case, its refusal as a status.
pub(super) fn told<T>(answer: Result<T, Refusal>) -> Result<T, Status> {
    answer.map_err(|refusal| grpc_status(&refusal))
}

/// The key of a request, with the fingerprint of what it is the key of.
pub(super) fn idempotency<M: Message>(key: Option<String>, message: &M) -> Idempotency {
    // The fingerprint of a request without a key is never compared.
    let fingerprint = match key.is_some() {
        true => Sha256::digest(message.encode_to_vec()).into(),
        false => [0; 32],
    };
    Idempotency { key, fingerprint }
}

/// A number that JSON could have.
pub(super) fn finite(number: Option<f64>, pointer: &str) -> Result<Option<f64>, Refusal> {
    match number {
        Some(number) if !number.is_finite() => {
            let message = format!("{number} is not a finite number");
            Err(invalid("wrong_type", pointer, message))
        }
        _ => Ok(number),
    }
}

/// A refusal of a message for one thing in it.
pub(super) fn invalid(code: &str, pointer: &str, message: String) -> Refusal {
    let fault = Fault {
        code: code.to_owned(),
        pointer: pointer.to_owned(),
        message,
        hint: None,
    };
    Refusal::at(Code::BodyInvalid, fault)
}
