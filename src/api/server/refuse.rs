//! Refusals in the dialect of the request, and the code of those that handlers and libraries answer.

use super::services::Content;
use crate::api::metrics::Dialect;
use crate::api::operations::Unresolved;
use crate::api::problem;
use crate::edge::{Code, Refusal};
use http::{HeaderValue, Response, StatusCode, header};

/// A refusal in a dialect.
pub(crate) fn answer(refusal: &Refusal, dialect: Dialect, request_id: &str) -> Response<Content> {
    match dialect {
        Dialect::Rest => problem::response(refusal, Some(request_id)).map(Content::Routed),
        Dialect::Grpc => {
            let mut response = problem::grpc_status(refusal).into_http().map(Content::Grpc);
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
) -> Response<Content> {
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
pub(crate) fn find(response: &Response<Content>, dialect: Dialect) -> Finding {
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

fn find_grpc(response: &Response<Content>) -> Finding {
    // A refusal is in the headers of an answer without a body. tonic leaves it in the extensions, too.
    let Some(status) = response.extensions().get::<tonic::Status>() else {
        return Finding::Fine;
    };
    if let Some(refusal) = problem::of_grpc_status(status) {
        return Finding::Told(refusal.code);
    }
    if let Some(refusal) = unread(status) {
        return Finding::Foreign(refusal);
    }
    let message = status.message();
    let refusal = match status.code() {
        tonic::Code::Ok => return Finding::Fine,
        tonic::Code::Unimplemented => Refusal::new(Code::MethodNotAllowed, message),
        tonic::Code::NotFound => Refusal::new(Code::NotFound, message),
        _ => Refusal::new(Code::Internal, message),
    };
    Finding::Foreign(refusal)
}

/// The refusal of a message that tonic does not read, in place of its words for one that cannot be decoded and for one beyond the
/// limit. As a server has no other cause for them, a client reads its own mistake instead of a defect of the edge.
pub(crate) fn unread(status: &tonic::Status) -> Option<Refusal> {
    match status.code() {
        tonic::Code::Internal | tonic::Code::InvalidArgument => {
            let detail = format!("the message cannot be decoded: {}", status.message());
            Some(Refusal::new(Code::BodyInvalid, detail))
        }
        tonic::Code::OutOfRange | tonic::Code::ResourceExhausted => Some(Refusal::new(
            Code::BodyTooLarge,
            "the message is larger than is read here",
        )),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tonic::Status;

    #[test]
    fn what_tonic_says_of_a_message_is_told_with_a_code_of_ours() {
        let told = |status: Status| {
            let response = status.into_http().map(Content::Grpc);
            match find(&response, Dialect::Grpc) {
                Finding::Foreign(refusal) => Some(refusal.code),
                Finding::Told(_) | Finding::Fine => None,
            }
        };
        assert_eq!(told(Status::internal("not UTF-8")), Some(Code::BodyInvalid));
        assert_eq!(told(Status::out_of_range("long")), Some(Code::BodyTooLarge));
        assert_eq!(told(Status::unknown("odd")), Some(Code::Internal));
        let own = problem::grpc_status(&Refusal::new(Code::NotFound, "none"));
        assert!(told(own).is_none(), "a refusal of ours stays as it is");
    }
}
