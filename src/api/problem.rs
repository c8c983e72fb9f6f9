//! How refusals are told: one table, with the columns of both dialects, and the renderings that read it.

use crate::edge::{Code, Refusal};
use crate::wire::{Fault, Problem};
use axum::body::Body;
use http::{HeaderValue, Response, StatusCode, header};
use std::time::Duration;
use tonic::metadata::MetadataValue;
use tonic_types::{ErrorDetails, FieldViolation, StatusExt};

/// The domain of a gRPC `ErrorInfo`.
pub const DOMAIN: &str = "skyway";

/// The media type of a problem document (RFC 9457).
pub const MEDIA_TYPE: &str = "application/problem+json";

/// How many faults fit in the headers of a gRPC answer.
const GRPC_FAULTS: usize = 16;

/// How many bytes of a text fit in them.
const GRPC_TEXT_BYTES: usize = 256;

const RETRY_PUSHBACK: &str = "grpc-retry-pushback-ms";

const CURRENT_ETAG: &str = "current_etag";

const OLDEST_REVISION: &str = "oldest_revision";

const ENFORCED: &str = "enforced";

const DURABLE: &str = "durable";

/// One row of the table.
#[derive(Debug)]
pub struct Row {
    /// Which code.
    pub code: Code,
    /// As clients see it: `code` of a problem document, `reason` of an `ErrorInfo`.
    pub name: &'static str,
    /// HTTP status.
    pub status: StatusCode,
    /// gRPC code.
    pub grpc: tonic::Code,
    /// The code in words.
    pub title: &'static str,
    /// What it means, and what to do.
    pub meaning: &'static str,
}

// The match is exhaustive, so that a new code without a row does not compile.
macro_rules! problems {
    ($($code:ident $name:literal $status:ident $grpc:ident $title:literal $meaning:literal;)*) => {
        /// The table.
        pub static TABLE: &[Row] = &[$(Row {
            code: Code::$code,
            name: $name,
            status: StatusCode::$status,
            grpc: tonic::Code::$grpc,
            title: $title,
            meaning: $meaning,
        },)*];

        /// The row of a code.
        pub fn row(code: Code) -> &'static Row {
            match code {
                $(Code::$code => &Row {
                    code: Code::$code,
                    name: $name,
                    status: StatusCode::$status,
                    grpc: tonic::Code::$grpc,
                    title: $title,
                    meaning: $meaning,
                },)*
            }
        }
    };
}

problems! {
    BodyInvalid "body_invalid" BAD_REQUEST InvalidArgument "the body is not valid"
        "The body is not JSON, or not of the shape that the operation reads. Each fault names its place.";
    ParameterInvalid "parameter_invalid" BAD_REQUEST InvalidArgument "a parameter is not valid"
        "A parameter of the query, or a header, cannot be read. Each fault names it.";
    ZoneInvalid "zone_invalid" UNPROCESSABLE_ENTITY InvalidArgument "the zone is not valid"
        "The zone can be read but not enforced: its shape, altitudes or windows are impossible. Each fault names its place and what would set it right.";
    ReportNotLocated "report_not_located" UNPROCESSABLE_ENTITY InvalidArgument "the report does not locate the drone"
        "Nothing in the report says where the drone is. Send a service, a remaining path or a location.";
    PlanInvalid "plan_invalid" UNPROCESSABLE_ENTITY InvalidArgument "the plan is not valid"
        "The delivery request can be read but not composed. Each fault names its place.";
    ClosureInvalid "closure_invalid" UNPROCESSABLE_ENTITY InvalidArgument "the closure is not valid"
        "The closure can be read but not enforced. Each fault names its place.";
    NetworkInvalid "network_invalid" UNPROCESSABLE_ENTITY InvalidArgument "the network is not valid"
        "The network, or the patch of one, can be read but not flown. Each fault names its place.";
    WeatherInvalid "weather_invalid" UNPROCESSABLE_ENTITY InvalidArgument "the weather is not valid"
        "The weather can be read but not be so. Each fault names its place.";
    WeatherElsewhere "weather_elsewhere" CONFLICT FailedPrecondition "the weather is put at the registry"
        "An edge that follows a registry has its weather from there, as all edges of the network do. Put it at the registry.";
    NotFound "not_found" NOT_FOUND NotFound "not found"
        "Nothing has this id, or the path leads nowhere.";
    MethodNotAllowed "method_not_allowed" METHOD_NOT_ALLOWED Unimplemented "method not allowed"
        "The path has other methods, which the Allow header lists; over gRPC, there is no such method.";
    MediaTypeUnsupported "media_type_unsupported" UNSUPPORTED_MEDIA_TYPE InvalidArgument "media type not supported"
        "Bodies are JSON without a content encoding; batches of positions may be compressed with gzip.";
    AlreadyExists "already_exists" CONFLICT AlreadyExists "already exists"
        "Something has this id. Change it under its own path, with If-Match.";
    NoRoute "no_route" CONFLICT FailedPrecondition "no open route"
        "No open way leads to the destination at this time. Closures or zones that end may open one.";
    NoOffer "no_offer" CONFLICT FailedPrecondition "nothing is offered"
        "No service fits what was asked for. Each fault names a service and why it does not fit.";
    QuoteExpired "quote_expired" CONFLICT FailedPrecondition "the quote has expired"
        "A quote holds for some minutes. Ask for another one.";
    DeliveryStateConflict "delivery_state_conflict" CONFLICT FailedPrecondition "the delivery is in another state"
        "The delivery stands otherwise than this needs: its drone has departed, or it is over. Read it again.";
    ClosureOfZone "closure_of_zone" CONFLICT FailedPrecondition "the closure belongs to a zone"
        "The closure stands as long as its zone does. Lift the zone.";
    NetworkInUse "network_in_use" CONFLICT FailedPrecondition "the network is in use"
        "A zone or a closure names what the change of the network would take away. Lift it first. Each fault names one.";
    InUse "in_use" CONFLICT FailedPrecondition "something needs it"
        "A delivery that is not over, or something else that stands, needs what was to be changed or deleted. `detail` names it. End that first.";
    ClockNotExternal "clock_not_external" CONFLICT FailedPrecondition "no client moves the clock"
        "The edge goes by a clock that moves by itself. Only one that was started with --clock external is moved by clients.";
    ClockBackwards "clock_backwards" UNPROCESSABLE_ENTITY OutOfRange "the clock goes forward only"
        "The clock shows a later time already. Read it, and move it to that time or a later one.";
    ClockTooFar "clock_too_far" UNPROCESSABLE_ENTITY OutOfRange "the clock is moved too far at once"
        "A clock is moved by at most 24 hours at once. Move it in several steps.";
    PlanStateConflict "plan_state_conflict" CONFLICT FailedPrecondition "the plan is in another state"
        "The plan has no such version to acknowledge, or is over. Read it again.";
    PreconditionRequired "precondition_required" PRECONDITION_REQUIRED FailedPrecondition "If-Match is required"
        "What exists is changed only by who has seen its current version. Read it, and send its ETag as If-Match.";
    PreconditionFailed "precondition_failed" PRECONDITION_FAILED Aborted "the version is not the current one"
        "Someone changed it in between. Read it again, and decide anew.";
    IdempotencyMismatch "idempotency_mismatch" UNPROCESSABLE_ENTITY AlreadyExists "the idempotency key has another body"
        "The key was used with another body. A new request needs a new key.";
    IdempotencyInProgress "idempotency_in_progress" CONFLICT Aborted "the same request is in progress"
        "The first request with this key is still being answered. Try again for its answer.";
    EventsGone "events_gone" GONE OutOfRange "the events are gone"
        "Events before the oldest kept, or of another epoch. Read the state again, and watch from there.";
    ChangesGone "changes_gone" GONE OutOfRange "the changes are gone"
        "Changes before the oldest kept, or of another epoch. Take the snapshot, and follow from its revision.";
    BodyTooLarge "body_too_large" PAYLOAD_TOO_LARGE ResourceExhausted "the body is too large"
        "The body exceeds the limit of this server. Send less at once.";
    Unauthenticated "unauthenticated" UNAUTHORIZED Unauthenticated "not authenticated"
        "Send a token of this server as Authorization: Bearer.";
    Forbidden "forbidden" FORBIDDEN PermissionDenied "not allowed"
        "The role of the token, or its subject, may not do this.";
    HostRefused "host_refused" MISDIRECTED_REQUEST PermissionDenied "the host is not this server"
        "Without tokens, a server answers only under its own loopback names, so that no web page reaches it by another.";
    Overloaded "overloaded" SERVICE_UNAVAILABLE ResourceExhausted "overloaded"
        "Too much of this kind at once. Try again after the time given.";
    LimitReached "limit_reached" TOO_MANY_REQUESTS ResourceExhausted "a limit is reached"
        "A bound of this server is reached. Remove what is not needed, or try again later.";
    NotReady "not_ready" SERVICE_UNAVAILABLE Unavailable "not ready"
        "The edge has no network to answer on yet. Try again after the time given.";
    EdgeUnavailable "edge_unavailable" SERVICE_UNAVAILABLE Unavailable "no edge answers"
        "The edge that composes flights over the network is not known or does not answer. Try again after the time given.";
    ShuttingDown "shutting_down" SERVICE_UNAVAILABLE Unavailable "shutting down"
        "The server stops. Go to another, or try again when it is back.";
    StoreUnavailable "store_unavailable" SERVICE_UNAVAILABLE Unavailable "the store does not answer"
        "What is known cannot be read or written just now. Try again after the time given.";
    StoreFull "store_full" INSUFFICIENT_STORAGE Unavailable "the store takes nothing more"
        "The disk of the store is full or failing. The write is not acknowledged. Free it, and try again.";
    NotDurable "not_durable" INSUFFICIENT_STORAGE DataLoss "in force, but not stored"
        "It is in force at this edge, but its disk has not taken it: a restart may undo it. It is stored as soon as the disk works; read it to see its version.";
    DeadlineExceeded "deadline_exceeded" GATEWAY_TIMEOUT DeadlineExceeded "the deadline passed"
        "There was no answer within the time allowed. The work was stopped.";
    Internal "internal" INTERNAL_SERVER_ERROR Internal "internal error"
        "A defect of the server. Its log has the request id.";
}

/// The code of a name.
pub fn code_of(name: &str) -> Option<Code> {
    TABLE
        .iter()
        .find(|row| row.name == name)
        .map(|row| row.code)
}

/// A refusal as a problem document.
pub fn document(refusal: &Refusal, request_id: Option<&str>) -> Problem {
    let row = row(refusal.code);
    Problem {
        kind: format!("/docs/problems#{}", row.name),
        title: row.title.to_owned(),
        status: row.status.as_u16(),
        code: row.name.to_owned(),
        detail: refusal.detail.clone(),
        errors: refusal.faults.clone(),
        request_id: request_id.map(str::to_owned),
        retry_after_s: refusal.retry_after_s,
        current_etag: refusal.current_etag.clone(),
        oldest_revision: refusal.oldest_revision,
        enforced: refusal.enforced.then_some(true),
        durable: refusal.enforced.then_some(false),
    }
}

/// A refusal as a REST answer. Its code is left in the extensions, for the gate's metrics.
pub fn response(refusal: &Refusal, request_id: Option<&str>) -> Response<Body> {
    let row = row(refusal.code);
    let body = serde_json::to_vec(&document(refusal, request_id)).unwrap_or_default();
    let mut response = Response::new(Body::from(body));
    *response.status_mut() = row.status;
    response.extensions_mut().insert(refusal.code);
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(MEDIA_TYPE));
    if let Some(seconds) = refusal.retry_after_s {
        headers.insert(header::RETRY_AFTER, HeaderValue::from(seconds));
    }
    // An ETag that is no header value is still in the document.
    let etag = refusal.current_etag.as_deref().map(HeaderValue::from_str);
    if let Some(Ok(etag)) = etag {
        headers.insert(header::ETAG, etag);
    }
    if refusal.code == Code::Unauthenticated {
        headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    }
    response
}

/// A refusal as a gRPC status, with `ErrorInfo`, `BadRequest` and `RetryInfo`.
///
/// A field violation has the pointer as its field, the fault's code as its reason and, in its description,
/// the message with the hint on a line of its own. All of it travels in headers, which clients bound: the
/// first 16 faults are told, and no text beyond 256 bytes.
pub fn grpc_status(refusal: &Refusal) -> tonic::Status {
    let row = row(refusal.code);
    let etag = refusal.current_etag.clone();
    let oldest = refusal.oldest_revision.map(|revision| revision.to_string());
    let enforced = refusal.enforced.then(|| "true".to_owned());
    let stated = [
        (CURRENT_ETAG, etag),
        (OLDEST_REVISION, oldest),
        (DURABLE, enforced.as_ref().map(|_| "false".to_owned())),
        (ENFORCED, enforced),
    ];
    let stated = stated.into_iter();
    let metadata: Metadata = stated
        .filter_map(|(name, text)| Some((name.to_owned(), text?)))
        .collect();
    let mut details = ErrorDetails::new();
    details.set_error_info(row.name, DOMAIN, metadata);
    if !refusal.faults.is_empty() {
        let told = refusal.faults.iter().take(GRPC_FAULTS);
        let violations: Vec<FieldViolation> = told.map(violation).collect();
        details.set_bad_request(violations);
    }
    if let Some(seconds) = refusal.retry_after_s {
        details.set_retry_info(Some(Duration::from_secs(u64::from(seconds))));
    }
    let mut status =
        tonic::Status::with_error_details(row.grpc, within_a_header(&refusal.detail), details);
    if let Some(seconds) = refusal.retry_after_s {
        // What retry policies of gRPC clients listen to (proposal A6).
        let pushback_ms = MetadataValue::from(u64::from(seconds) * 1000);
        status.metadata_mut().insert(RETRY_PUSHBACK, pushback_ms);
    }
    status
}

/// A gRPC status as a refusal; none where it has no `ErrorInfo` of this domain.
pub fn of_grpc_status(status: &tonic::Status) -> Option<Refusal> {
    let details = status.get_error_details();
    let info = details.error_info().filter(|info| info.domain == DOMAIN)?;
    let faults = details
        .bad_request()
        .map(|bad| bad.field_violations.iter().map(fault).collect());
    let retry_delay = details.retry_info().and_then(|retry| retry.retry_delay);
    Some(Refusal {
        code: code_of(&info.reason)?,
        detail: status.message().to_owned(),
        faults: faults.unwrap_or_default(),
        current_etag: info.metadata.get(CURRENT_ETAG).cloned(),
        retry_after_s: retry_delay.and_then(|delay| u32::try_from(delay.as_secs()).ok()),
        oldest_revision: info
            .metadata
            .get(OLDEST_REVISION)
            .and_then(|text| text.parse().ok()),
        enforced: info
            .metadata
            .get(ENFORCED)
            .is_some_and(|text| text == "true"),
    })
}

#[expect(
    clippy::disallowed_types,
    reason = "the type that tonic-types takes; its one entry has no order"
)]
type Metadata = std::collections::HashMap<String, String>;

fn violation(fault: &Fault) -> FieldViolation {
    let message = within_a_header(&fault.message);
    let description = match &fault.hint {
        Some(hint) => format!("{message}\n{}", within_a_header(hint)),
        None => message.to_owned(),
    };
    FieldViolation {
        reason: fault.code.clone(),
        ..FieldViolation::new(within_a_header(&fault.pointer), description)
    }
}

/// The beginning of a text that may quote what a client sent.
fn within_a_header(text: &str) -> &str {
    &text[..text.floor_char_boundary(GRPC_TEXT_BYTES)]
}

fn fault(violation: &FieldViolation) -> Fault {
    let (message, hint) = match violation.description.split_once('\n') {
        Some((message, hint)) => (message, Some(hint.to_owned())),
        None => (violation.description.as_str(), None),
    };
    Fault {
        code: violation.reason.clone(),
        pointer: violation.field.clone(),
        message: message.to_owned(),
        hint,
    }
}

/// The table as a page, on which the `type` of a problem document points at its row.
pub fn problems_html() -> String {
    let mut page = String::from(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>Problems</title>\
         <style>body{font:1rem/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}\
         td,th{text-align:left;vertical-align:top;padding:.3rem .8rem .3rem 0}tr:target{background:#fe9}</style></head>\
         <body><h1>Problems</h1><p>Answers with an error are problem documents (RFC 9457); their code is also the reason of \
         the gRPC ErrorInfo.</p><table><tr><th>Code</th><th>HTTP</th><th>gRPC</th><th>Meaning</th></tr>",
    );
    for row in TABLE {
        // Everything in the table is text without markup, so nothing needs escaping.
        page.push_str(&format!(
            "<tr id=\"{name}\"><td><code>{name}</code></td><td>{status}</td><td>{grpc:?}</td><td>{meaning}</td></tr>",
            name = row.name,
            status = row.status.as_u16(),
            grpc = row.grpc,
            meaning = row.meaning,
        ));
    }
    page.push_str("</table></body></html>");
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full(code: Code) -> Refusal {
        let fault = |hint: Option<&str>| Fault {
            code: "ring_not_closed".to_owned(),
            pointer: "/geometry/coordinates/0".to_owned(),
            message: "the ring of 'Süd' is open".to_owned(),
            hint: hint.map(str::to_owned),
        };
        Refusal {
            enforced: true,
            faults: vec![fault(Some("repeat the first position")), fault(None)],
            ..Refusal::new(code, "the zone has 2 faults: 'ä\u{7f}'")
                .with_etag("\"7\"")
                .retry_after_s(1)
                .with_oldest_revision(12)
        }
    }

    #[test]
    fn a_refusal_survives_both_dialects() {
        for row in TABLE {
            for refusal in [full(row.code), Refusal::new(row.code, "")] {
                let json =
                    serde_json::to_string(&document(&refusal, Some("r-1"))).expect("serializes");
                let read: Problem = serde_json::from_str(&json).expect("parses");
                assert_eq!(read.status, row.status.as_u16());
                assert_eq!(read, document(&refusal, Some("r-1")), "{}", row.name);

                let http: Response<Body> = grpc_status(&refusal).into_http();
                let read = tonic::Status::from_header_map(http.headers()).expect("has a status");
                assert_eq!(read.code(), row.grpc);
                assert_eq!(of_grpc_status(&read), Some(refusal), "{}", row.name);
            }
        }
    }

    #[test]
    fn the_table_and_its_rows_agree() {
        for (place, listed) in TABLE.iter().enumerate() {
            let of_code = row(listed.code);
            assert_eq!(of_code.name, listed.name);
            assert_eq!(code_of(listed.name), Some(listed.code));
            let twice = TABLE[..place].iter().any(|other| other.name == listed.name);
            assert!(!twice, "{} is listed twice", listed.name);
            assert!(listed.status.is_client_error() || listed.status.is_server_error());
            assert!(
                listed
                    .name
                    .chars()
                    .all(|letter| letter.is_ascii_lowercase() || letter == '_')
            );
        }
    }

    #[test]
    fn what_is_in_force_is_not_repeated_by_a_retry_policy() {
        let is_retried = |code| row(code).grpc == tonic::Code::Unavailable;
        assert!(is_retried(Code::StoreFull) && !is_retried(Code::NotDurable));
    }

    #[test]
    fn headers_say_when_to_come_back_and_which_version_is_current() {
        let response = response(&full(Code::PreconditionFailed), None);
        assert_eq!(response.status(), 412);
        assert_eq!(response.headers()["retry-after"], "1");
        assert_eq!(response.headers()["etag"], "\"7\"");
        assert_eq!(response.headers()["content-type"], MEDIA_TYPE);
        let refused = super::response(&Refusal::new(Code::Unauthenticated, "who?"), None);
        assert_eq!(refused.headers()["www-authenticate"], "Bearer");
    }

    #[test]
    fn a_grpc_status_fits_in_headers_whatever_was_sent() {
        let mut refusal = full(Code::ZoneInvalid);
        refusal.detail = "ä".repeat(100_000);
        refusal.faults[0].pointer = "/ü".repeat(100_000);
        refusal.faults[0].message = "ö".repeat(100_000);
        refusal.faults = vec![refusal.faults[0].clone(); 1000];
        let http: Response<Body> = grpc_status(&refusal).into_http();
        let header_bytes: usize = http.headers().values().map(HeaderValue::len).sum();
        assert!(header_bytes <= 16 * 1024, "{header_bytes}");
        assert_eq!(http.headers()["grpc-status"], "3");
    }

    #[test]
    fn the_page_has_every_code() {
        let page = problems_html();
        for row in TABLE {
            assert!(
                page.contains(&format!("<tr id=\"{}\">", row.name)),
                "{}",
                row.name
            );
        }
    }
}
