//! What the gate knows of a request, for its handler: who calls what, under which id, until when.

use crate::access::Caller;
use crate::api::metrics::Dialect;
use crate::api::operations::Operation;
use http::request::Parts;
use http::{HeaderMap, HeaderName, HeaderValue, header};
use std::fmt;
use std::time::Duration;
use tokio::time::Instant;

const ID_LENGTH_MAX: usize = 64;

/// The header with the id of a request.
pub(crate) const X_REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// In the extensions of every request that a handler sees.
#[derive(Clone, Debug)]
pub struct RequestContext {
    /// Who calls. Operations that need no token are called by `Caller::anyone`.
    pub caller: Caller,
    /// What was asked.
    pub operation: Operation,
    /// Its id, as in the logs and the `x-request-id` header.
    pub request_id: RequestId,
    /// When the handler is dropped if it has not answered.
    pub deadline: Instant,
}

/// The id of a request: the client's own, or a number of this process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RequestId(Source);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Source {
    Client(HeaderValue),
    Counted { process: u32, number: u64 },
}

impl RequestId {
    pub(crate) fn counted(process: u32, number: u64) -> Self {
        Self(Source::Counted { process, number })
    }

    /// The client's own, where it is one that can stand in a log line.
    pub(crate) fn of_client(headers: &HeaderMap) -> Option<Self> {
        let id = headers.get(X_REQUEST_ID)?;
        let is_sane = |byte: &u8| byte.is_ascii_alphanumeric() || b"._-".contains(byte);
        let bytes = id.as_bytes();
        let accepted = (1..=ID_LENGTH_MAX).contains(&bytes.len()) && bytes.iter().all(is_sane);
        accepted.then(|| Self(Source::Client(id.clone())))
    }

    pub(crate) fn header(&self) -> HeaderValue {
        match &self.0 {
            Source::Client(id) => id.clone(),
            Source::Counted { process, number } => {
                let mut text = Vec::with_capacity(26);
                push_hex(&mut text, u64::from(*process), 8);
                text.push(b'-');
                push_hex(&mut text, *number, 1);
                // Hexadecimal digits are a header value.
                HeaderValue::try_from(text).unwrap_or(HeaderValue::from_static(""))
            }
        }
    }
}

/// Writes a number in hexadecimal with at least this many digits: every answer has one, and formatting takes several
/// times as long.
fn push_hex(text: &mut Vec<u8>, number: u64, digits_min: u32) {
    let digits = (u64::BITS - number.leading_zeros())
        .div_ceil(4)
        .max(digits_min);
    let nibbles = (0..digits).rev().map(|place| (number >> (4 * place)) & 0xf);
    text.extend(nibbles.map(|nibble| b"0123456789abcdef"[nibble as usize]));
}

impl fmt::Display for RequestId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0 {
            Source::Client(id) => formatter.write_str(id.to_str().unwrap_or_default()),
            Source::Counted { process, number } => write!(formatter, "{process:08x}-{number:x}"),
        }
    }
}

/// The time that a gRPC client allows (gRPC over HTTP/2, `Timeout`). What cannot be read is as if it were not
/// there: a drone in trouble is answered all the same.
pub(crate) fn grpc_timeout(headers: &HeaderMap) -> Option<Duration> {
    const DIGITS_MAX: usize = 8;
    let text = headers.get("grpc-timeout")?.to_str().ok()?;
    let (digits, unit) = text.split_at_checked(text.len().checked_sub(1)?)?;
    let is_number = (1..=DIGITS_MAX).contains(&digits.len())
        && digits.bytes().all(|byte| byte.is_ascii_digit());
    let number: u64 = digits.parse().ok().filter(|_| is_number)?;
    match unit {
        "H" => Some(Duration::from_secs(number * 3600)),
        "M" => Some(Duration::from_secs(number * 60)),
        "S" => Some(Duration::from_secs(number)),
        "m" => Some(Duration::from_millis(number)),
        "u" => Some(Duration::from_micros(number)),
        "n" => Some(Duration::from_nanos(number)),
        _ => None,
    }
}

/// The dialect that a request is in.
pub(super) fn dialect(head: &Parts) -> Dialect {
    let media_type = head.headers.get(header::CONTENT_TYPE);
    if media_type.is_some_and(|media_type| media_type.as_bytes().starts_with(b"application/grpc")) {
        return Dialect::Grpc;
    }
    Dialect::Rest
}

/// The bearer token that a request shows.
pub(super) fn bearer(head: &Parts) -> Option<&str> {
    let text = head.headers.get(header::AUTHORIZATION)?.to_str().ok()?;
    let (scheme, token) = text.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| token.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(name: &'static str, value: &str) -> HeaderMap {
        let value = HeaderValue::from_bytes(value.as_bytes()).expect("a header value");
        HeaderMap::from_iter([(http::HeaderName::from_static(name), value)])
    }

    #[test]
    fn timeouts_are_read_in_every_unit_and_rubbish_is_none() {
        let read = |text: &str| grpc_timeout(&headers("grpc-timeout", text));
        assert_eq!(read("200m"), Some(Duration::from_millis(200)));
        assert_eq!(read("1H"), Some(Duration::from_secs(3600)));
        assert_eq!(read("2M"), Some(Duration::from_secs(120)));
        assert_eq!(read("3S"), Some(Duration::from_secs(3)));
        assert_eq!(read("4u"), Some(Duration::from_micros(4)));
        assert_eq!(read("99999999n"), Some(Duration::from_nanos(99_999_999)));
        for rubbish in [
            "",
            "m",
            "5",
            "-5m",
            "+5m",
            "5x",
            "5ms",
            "123456789m",
            "1.5S",
            "5é",
        ] {
            assert_eq!(read(rubbish), None, "{rubbish}");
        }
    }

    #[test]
    fn a_clients_id_is_kept_where_it_can_stand_in_a_log() {
        let long = "x".repeat(65);
        for (id, kept) in [
            ("a-1_B.2", true),
            ("", false),
            ("a b", false),
            ("a\"b", false),
            ("ä", false),
            (&long, false),
        ] {
            let found = RequestId::of_client(&headers("x-request-id", id));
            assert_eq!(
                found.map(|found| found.to_string()).as_deref(),
                kept.then_some(id)
            );
        }
        for id in [
            RequestId::counted(0xab, 17),
            RequestId::counted(0, 0),
            RequestId::counted(u32::MAX, u64::MAX),
        ] {
            assert_eq!(id.header(), id.to_string());
        }
        assert_eq!(RequestId::counted(0xab, 17).header(), "000000ab-11");
    }
}
