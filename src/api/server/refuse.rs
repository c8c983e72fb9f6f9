//! Refusals in the dialect of the request, and the code of those that handlers and libraries answer.

use crate::api::metrics::Dialect;
use crate::api::operations::Unresolved;
use crate::api::problem;
use crate::edge::{Code, Refusal};
use axum::body::Body;
use http::{HeaderValue, Response, StatusCode, header};

/// A refusal in a dialect.
pub(crate) fn answer(refusal: &Refusal, dialect: Dialect, request_id: &str) -> Response<Body> {
    match dialect {
        Dialect::Rest => problem::response(refusal, Some(request_id)),
        Dialect::Grpc => {
            let mut response: Response<Body> = problem::grpc_status(refusal).into_http();
            response.extensions_mut().insert(refusal.code);
            response
        }
    }
}

/// A request that leads to no operation.
pub(crate) fn unresolved(
    reason: &Unresolved,
    path: &str,
    dialect: Dialect,
    request_id: &str,
) -> Response<Body> {
    if dialect == Dialect::Grpc {
        let refusal = Refusal::new(
            Code::MethodNotAllowed,
            format!("there is no gRPC method '{path}'"),
        );
        return answer(&refusal, dialect, request_id);
    }
    let Unresolved::Method { allowed } = reason else {
        let refusal = Refusal::new(Code::NotFound, format!("nothing is at '{path}'"));
        return answer(&refusal, dialect, request_id);
    };
    let refusal = Refusal::new(
        Code::MethodNotAllowed,
        format!("'{path}' has the methods {allowed}"),
    );
    let mut response = answer(&refusal, dialect, request_id);
    // Method names are header values.
    if let Ok(allowed) = HeaderValue::from_str(allowed) {
        response.headers_mut().insert(header::ALLOW, allowed);
    }
    response
}

/// What is wrong with an answer.
pub(crate) enum Finding {
    /// Nothing.
    Fine,
    /// It is a refusal, told as it should be.
    Told(Code),
    /// A handler refused and left it to be told here, or a library did in its own words.
    Foreign(Refusal),
}

/// Looks at an answer of a handler.
pub(crate) fn find(response: &Response<Body>, dialect: Dialect) -> Finding {
    if let Some(code) = response.extensions().get::<Code>() {
        return Finding::Told(*code);
    }
    if let Some(refusal) = response.extensions().get::<Refusal>() {
        return Finding::Foreign(refusal.clone());
    }
    match dialect {
        Dialect::Rest => find_rest(response.status()),
        Dialect::Grpc => find_grpc(response),
    }
}

fn find_rest(status: StatusCode) -> Finding {
    if !status.is_client_error() && !status.is_server_error() {
        return Finding::Fine;
    }
    let code = match status {
        StatusCode::NOT_FOUND => Code::NotFound,
        StatusCode::METHOD_NOT_ALLOWED => Code::MethodNotAllowed,
        StatusCode::PAYLOAD_TOO_LARGE => Code::BodyTooLarge,
        StatusCode::UNSUPPORTED_MEDIA_TYPE => Code::MediaTypeUnsupported,
        status if status.is_client_error() => Code::BodyInvalid,
        _ => Code::Internal,
    };
    Finding::Foreign(Refusal::new(code, problem::row(code).meaning))
}

fn find_grpc(response: &Response<Body>) -> Finding {
    // A refusal is in the headers of an answer without a body. tonic leaves it in the extensions, too.
    let Some(status) = response.extensions().get::<tonic::Status>() else {
        return Finding::Fine;
    };
    if let Some(refusal) = problem::of_grpc_status(status) {
        return Finding::Told(refusal.code);
    }
    // tonic's words for a message that cannot be decoded, and for one beyond the limit. As a server has no
    // other cause for them, a client reads its own mistake instead of a defect of the edge.
    let code = match status.code() {
        tonic::Code::Ok => return Finding::Fine,
        tonic::Code::Internal | tonic::Code::InvalidArgument => Code::BodyInvalid,
        tonic::Code::OutOfRange | tonic::Code::ResourceExhausted => Code::BodyTooLarge,
        tonic::Code::Unimplemented => Code::MethodNotAllowed,
        tonic::Code::NotFound => Code::NotFound,
        _ => Code::Internal,
    };
    Finding::Foreign(Refusal::new(code, status.message()))
}
