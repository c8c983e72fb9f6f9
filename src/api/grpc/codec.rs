//! What tonic says of a message that it cannot read, in the words of the table of problems.

use crate::api::problem::grpc_status;
use crate::edge::{Code, Refusal};
use http::Response;
use tonic::Status;
use tonic::body::Body;

/// A status that no use case gave comes from the decoder, before any was called. It calls bytes that are no
/// message an internal error and says nothing of our codes; but they are the client's, as a body that is no JSON.
pub(super) fn in_our_words(response: Response<Body>) -> Response<Body> {
    if !response.headers().contains_key(Status::GRPC_STATUS) {
        return response;
    }
    let status = Status::from_header_map(response.headers());
    let Some(status) = status.filter(|status| status.details().is_empty()) else {
        return response;
    };
    let refusal = match status.code() {
        tonic::Code::Internal => {
            let detail = format!("the message cannot be decoded: {}", status.message());
            Refusal::new(Code::BodyInvalid, detail)
        }
        tonic::Code::OutOfRange => Refusal::new(
            Code::BodyTooLarge,
            "the message is larger than this edge reads",
        ),
        _ => return response,
    };
    grpc_status(&refusal).into_http()
}
