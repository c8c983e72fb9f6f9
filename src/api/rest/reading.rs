//! Bodies and queries of operators, read strictly: what is wrong is told with its place and a hint.
//!
//! Whether it is JSON and of the right shape is found here; what it means, the use cases find.

use super::answer::Refused;
use crate::edge::{Code, Refusal};
use crate::formats::{
    ForeignFormat, KML_MEDIA_TYPE, ReportProblem, members_twice, nearest, without_mark,
};
use crate::wire::Fault;
use axum::body::{Body, to_bytes};
use axum::extract::FromRequest;
use bytes::Bytes;
use http::{HeaderMap, Request, header};
use serde::de::{DeserializeOwned, IgnoredAny};
use serde_json::Value;
use serde_path_to_error::{Path, Segment, Track};

/// How much of a reader's message is told; it may quote what was sent.
const MESSAGE_CHARACTERS_MAX: usize = 200;

const JSON: &str = "application/json";
const KMZ_MEDIA_TYPE: &str = "application/vnd.google-earth.kmz";
/// What to do with a KMZ.
const UNPACK: &str = "the feed is a zip, as a KMZ is: unpack it, and send the KML that is in it";
/// What clients say of a body whose type was not chosen.
const UNCHOSEN: [&str; 4] = [
    "",
    "text/plain",
    "application/octet-stream",
    "application/x-www-form-urlencoded",
];

/// The body of a request whose media type is JSON, or is not said.
pub(in crate::api) struct JsonBody(pub(in crate::api) Bytes);

impl<S: Sync> FromRequest<S> for JsonBody {
    type Rejection = Refused;

    async fn from_request(request: Request<Body>, _: &S) -> Result<Self, Refused> {
        check_media_type(request.headers())?;
        whole_body(request).await.map(Self)
    }
}

/// The body of a drone's request. A drone in need is not refused for a header that its program did not
/// choose: what libraries say where no type is set is read as JSON, as is a body that states none.
/// A type of something else was chosen, and so it is not JSON.
pub(in crate::api) struct DroneJsonBody(pub(in crate::api) Bytes);

impl<S: Sync> FromRequest<S> for DroneJsonBody {
    type Rejection = Refused;

    async fn from_request(request: Request<Body>, _: &S) -> Result<Self, Refused> {
        let is_unchosen = |essence: &str| {
            UNCHOSEN
                .iter()
                .any(|known| known.eq_ignore_ascii_case(essence))
        };
        if !media_type(request.headers()).is_none_or(is_unchosen) {
            check_media_type(request.headers())?;
        }
        whole_body(request).await.map(Self)
    }
}

/// The text of a feed of zones: JSON, KML, or of a type that is not said. Which format it is follows
/// from what is in it.
pub(in crate::api) struct FeedBody(pub(in crate::api) String);

impl<S: Sync> FromRequest<S> for FeedBody {
    type Rejection = Refused;

    async fn from_request(request: Request<Body>, _: &S) -> Result<Self, Refused> {
        let stated = media_type(request.headers())
            .unwrap_or(JSON)
            .to_ascii_lowercase();
        if !is_json(&stated) && stated != KML_MEDIA_TYPE {
            let detail = match stated.as_str() {
                KMZ_MEDIA_TYPE => UNPACK.to_owned(),
                other => format!(
                    "the media type '{}' is not read here; send JSON with Content-Type: {JSON}, or KML with {KML_MEDIA_TYPE}",
                    cut(other)
                ),
            };
            return Err(Refusal::new(Code::MediaTypeUnsupported, detail).into());
        }
        let body = whole_body(request).await?;
        if ForeignFormat::of_bytes(&body) == Some(ForeignFormat::Zip) {
            return Err(Refusal::new(Code::BodyInvalid, UNPACK).into());
        }
        let text = String::from_utf8(body.into()).map_err(|error| {
            let place = error.utf8_error().valid_up_to();
            let detail = format!("the feed is not UTF-8 text: see byte {place}");
            Refusal::new(Code::BodyInvalid, detail)
        })?;
        Ok(Self(text))
    }
}

async fn whole_body(request: Request<Body>) -> Result<Bytes, Refused> {
    // The gate holds bodies to the limit of the configuration.
    match to_bytes(request.into_body(), usize::MAX).await {
        Ok(bytes) => Ok(bytes),
        Err(error) => {
            let detail = format!("the body broke off: {error}");
            Err(Refusal::new(Code::BodyInvalid, detail).into())
        }
    }
}

fn check_media_type(headers: &HeaderMap) -> Result<(), Refusal> {
    let Some(essence) = media_type(headers) else {
        return Ok(());
    };
    let essence = essence.to_ascii_lowercase();
    if is_json(&essence) {
        return Ok(());
    }
    let detail = format!(
        "the media type '{}' is not read here; send JSON, and Content-Type: {JSON}",
        cut(&essence)
    );
    Err(Refusal::new(Code::MediaTypeUnsupported, detail))
}

/// Whether a media type in small letters is that of JSON, or of something written in it.
fn is_json(essence: &str) -> bool {
    let suffix = essence.rsplit_once('+').map(|(_, suffix)| suffix);
    essence == JSON || suffix == Some("json")
}

/// The media type that is stated, without its parameters.
fn media_type(headers: &HeaderMap) -> Option<&str> {
    let stated = headers.get(header::CONTENT_TYPE)?;
    let essence = stated.to_str().unwrap_or_default().split(';').next();
    Some(essence.unwrap_or_default().trim())
}

/// Reads a body, of which `what` says what it is.
pub(in crate::api) fn body<T: DeserializeOwned>(bytes: &[u8], what: &str) -> Result<T, Refusal> {
    let bytes = without_mark(bytes);
    check_object(bytes, what)?;
    let mut reader = serde_json::Deserializer::from_slice(bytes);
    let mut track = Track::new();
    let tracked = serde_path_to_error::Deserializer::new(&mut reader, &mut track);
    let read = T::deserialize(tracked).map_err(|error| refused(&error, &track.path()))?;
    reader.end().map_err(|error| not_json(&error))?;
    Ok(read)
}

/// Reads a body as it is; a member that is there twice is refused, as it is unclear which one was meant.
pub(in crate::api) fn value(bytes: &[u8]) -> Result<Value, Refusal> {
    let bytes = without_mark(bytes);
    let read = serde_json::from_slice(bytes).map_err(|error| not_json(&error))?;
    check_once(bytes)?;
    Ok(read)
}

/// Refuses a body that has a member twice, of which the reader takes parts as they are.
pub(in crate::api) fn check_once(bytes: &[u8]) -> Result<(), Refusal> {
    let faults = members_twice(bytes).into_iter().map(|pointer| Fault {
        code: "duplicate_field".to_owned(),
        message: format!("the field '{}' is there more than once", cut(&pointer)),
        pointer,
        hint: Some("leave one of them".to_owned()),
    });
    let mut refusal = Refusal::new(Code::BodyInvalid, "the body has fields more than once");
    refusal.faults = faults.collect();
    match refusal.faults.is_empty() {
        true => Ok(()),
        false => Err(refusal),
    }
}

/// A derived reader would take a list of the fields in order, too, which no client means.
fn check_object(bytes: &[u8], what: &str) -> Result<(), Refusal> {
    if bytes.trim_ascii_start().starts_with(b"{") {
        return Ok(());
    }
    if let Err(error) = serde_json::from_slice::<IgnoredAny>(bytes) {
        return Err(not_json(&error));
    }
    let fault = Fault {
        code: "not_an_object".to_owned(),
        pointer: String::new(),
        message: format!("a {what} is a JSON object"),
        hint: None,
    };
    Err(Refusal::at(Code::BodyInvalid, fault))
}

fn refused(error: &serde_json::Error, path: &Path) -> Refusal {
    if !error.is_data() {
        return not_json(error);
    }
    let told = error.to_string();
    let message = told
        .rsplit_once(" at line ")
        .map_or(&*told, |(message, _)| message);
    Refusal::at(Code::BodyInvalid, fault(message, &pointer(path)))
}

/// Says where a body ceases to be JSON; a number beyond what a double holds is none either.
fn not_json(error: &serde_json::Error) -> Refusal {
    let fault = Fault {
        code: "not_json".to_owned(),
        pointer: String::new(),
        message: format!("the body {}", ReportProblem::not_json(error)),
        hint: None,
    };
    Refusal::at(Code::BodyInvalid, fault)
}

/// The path as a JSON Pointer (RFC 6901), as far as it is known.
fn pointer(path: &Path) -> String {
    let mut text = String::new();
    for segment in path {
        match segment {
            Segment::Seq { index } => text.push_str(&format!("/{index}")),
            Segment::Map { key } | Segment::Enum { variant: key } => {
                text.push_str(&format!("/{}", escaped(key)));
            }
            Segment::Unknown => break,
        }
    }
    text
}

fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

/// What the reader of a query says, as a fault of the parameter.
pub(in crate::api) fn query_fault(told: &str) -> Fault {
    let told = told
        .strip_prefix("Failed to deserialize query string: ")
        .unwrap_or(told);
    let is_name = |text: &str| {
        text.bytes()
            .all(|byte| byte == b'_' || byte.is_ascii_lowercase())
    };
    let (name, message) = match told.split_once(": ") {
        Some((name, message)) if is_name(name) => (name, message),
        _ => ("", told),
    };
    let fault = fault(&in_words(message), "");
    let named = fault.pointer.strip_prefix('/').unwrap_or(name);
    Fault {
        pointer: format!("?{named}"),
        ..fault
    }
}

/// What the standard library says of a text that is no number, as what to write instead.
fn in_words(message: &str) -> String {
    let expected = match message {
        "invalid digit found in string" => "it is not a whole number of 0 or more",
        "cannot parse integer from empty string" => {
            "it is empty; give a whole number, or leave it out"
        }
        "number too large to fit in target type" => "it is too large a number",
        "number too small to fit in target type" => "it is too small a number",
        "invalid float literal" => "it is not a number such as 0.5",
        "cannot parse float from empty string" => "it is empty; give a number, or leave it out",
        "provided string was not `true` or `false`" => "it is neither true nor false",
        told => told,
    };
    expected.to_owned()
}

/// The fault in a derived reader's message: the reader names fields between backticks.
fn fault(message: &str, place: &str) -> Fault {
    let mut names = message.split('`').skip(1).step_by(2);
    let kinds = [
        ("unknown field", "unknown_field"),
        ("missing field", "missing_field"),
        ("duplicate field", "duplicate_field"),
    ];
    let kind = kinds
        .into_iter()
        .find(|(words, _)| message.starts_with(words));
    let (Some((words, code)), Some(name)) = (kind, names.next()) else {
        return Fault {
            code: "wrong_type".to_owned(),
            pointer: place.to_owned(),
            message: cut(message),
            hint: None,
        };
    };
    let told = match words {
        "unknown field" => format!("the field '{}' is not known", cut(name)),
        "missing field" => format!("the field '{name}' is missing"),
        _ => format!("the field '{}' is there more than once", cut(name)),
    };
    let last = format!("/{}", escaped(name));
    let pointer = match place.ends_with(&last) {
        true => place.to_owned(),
        false => format!("{place}{last}"),
    };
    Fault {
        code: code.to_owned(),
        pointer,
        message: told,
        hint: hint(name, &names.collect::<Vec<_>>()),
    }
}

fn hint(name: &str, known: &[&str]) -> Option<String> {
    if known.is_empty() {
        return None;
    }
    Some(match nearest(name, known.iter().copied(), 1).first() {
        Some(meant) => format!("did you mean '{meant}'?"),
        None => format!("known are {}", known.join(", ")),
    })
}

/// Text from a client as a message shows it.
fn cut(text: &str) -> String {
    match text.char_indices().nth(MESSAGE_CHARACTERS_MAX) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{Ack, ClosureDraft, DeliveryRequest};

    fn fault_of<T: DeserializeOwned>(body_text: &str) -> (String, String, Option<String>) {
        let refusal = body::<T>(body_text.as_bytes(), "test")
            .err()
            .expect(body_text);
        assert_eq!(refusal.code, Code::BodyInvalid, "{body_text}");
        let fault = refusal.faults.into_iter().next().expect(body_text);
        (fault.code, fault.pointer, fault.hint)
    }

    fn told(code: &str, pointer: &str, hint: Option<&str>) -> (String, String, Option<String>) {
        (code.to_owned(), pointer.to_owned(), hint.map(str::to_owned))
    }

    #[test]
    fn each_fault_of_a_body_has_its_place() {
        let of = fault_of::<DeliveryRequest>;
        let meant = Some("did you mean 'source'?");
        assert_eq!(
            of(r#"{"sorce": 1, "destination": 2}"#),
            told("unknown_field", "/sorce", meant)
        );
        assert_eq!(
            of(r#"{"destination": 1}"#),
            told("missing_field", "/source", None)
        );
        assert_eq!(
            of(r#"{"source": 1, "source": 2}"#),
            told("duplicate_field", "/source", None)
        );
        let wrong = r#"{"source": 1, "destination": 2, "payload_kg": "1"}"#;
        assert_eq!(of(wrong), told("wrong_type", "/payload_kg", None));
        assert_eq!(
            fault_of::<ClosureDraft>(r#"{"nodes": [1, {}]}"#),
            told("wrong_type", "/nodes/1", None)
        );
        let wrong = r#"{"version": 1, "location": {"lng": 1}}"#;
        assert_eq!(fault_of::<Ack>(wrong).1, "/location/lng");
        for list in ["[1, 2]", " \"x\"", "null"] {
            assert_eq!(of(list), told("not_an_object", "", None), "{list}");
        }
        for broken in [
            "",
            "{",
            "[",
            "{\"source\": 1e999}",
            "{} x",
            "{\"source\": 1,}",
            "\u{feff}",
        ] {
            let (code, ..) = of(broken);
            assert!(
                code == "not_json" || code == "missing_field",
                "{broken}: {code}"
            );
        }
        assert_eq!(of("{\"source\": 1e999}").0, "not_json");
        let marked = "\u{feff}{\"source\": 1, \"destination\": 2}";
        assert!(body::<DeliveryRequest>(marked.as_bytes(), "test").is_ok());
        assert_eq!(value(b"\xef\xbb\xbf{}"), Ok(serde_json::json!({})));
        let deep = format!("{{\"source\": {}", "[".repeat(10_000));
        assert_eq!(fault_of::<DeliveryRequest>(&deep).1, "/source");
    }

    #[test]
    fn a_member_that_is_there_twice_is_refused_at_any_depth() {
        let text = br#"{"type": "Feature", "properties": {"windows": [{"from": 1, "from": 2}]}}"#;
        let refusal = value(text).expect_err("a member is there twice");
        assert_eq!(refusal.faults[0].code, "duplicate_field");
        assert_eq!(refusal.faults[0].pointer, "/properties/windows/0/from");
        let text = br#"{"b": [1, -2, 3.5, "x", null, true, {}], "a": {"b": 1}}"#;
        let expected: Value = serde_json::from_slice(text).expect("is JSON");
        assert_eq!(value(text), Ok(expected));
        let deep = value("[".repeat(100_000).as_bytes()).expect_err("too deep");
        assert_eq!(deep.faults[0].code, "not_json");
        assert_eq!(
            value(b"[1e999]").expect_err("too large").faults[0].code,
            "not_json"
        );
    }
}
