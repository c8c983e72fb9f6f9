//! Rows of answers to requests that may be sent again.

use super::codec::{number_key, read, write};
use super::file::{Row, StoreFault, Table};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use skyway_contract as wire;

/// What a report with an id was answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ReportReply {
    pub(crate) subject: String,
    pub(crate) id: String,
    pub(crate) report: wire::FailureReport,
    /// The JSON of the answer.
    pub(crate) answer: String,
    /// Where the drone was, in metres of the plane, where that was known.
    pub(crate) place: Option<[f64; 2]>,
    /// SHA-256 of the network.
    pub(crate) network: String,
}

/// What a write with an idempotency key was answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WriteReply {
    pub(crate) subject: String,
    pub(crate) operation: String,
    pub(crate) key: String,
    /// SHA-256 of the body.
    pub(crate) fingerprint: [u8; 32],
    /// The JSON of the answer.
    pub(crate) answer: String,
}

/// Either of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Reply {
    Report(Box<ReportReply>),
    Write(WriteReply),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredReply {
    at: Timestamp,
    reply: Reply,
}

/// The row of a reply. Rows go in the order of their keys, the oldest first.
pub(super) fn reply_row(reply: &Reply, at: Timestamp) -> Row {
    let fields = match reply {
        Reply::Report(reply) => ["report", &reply.subject, "", &reply.id],
        Reply::Write(reply) => ["write", &reply.subject, &reply.operation, &reply.key],
    };
    let mut digest = Sha256::new();
    for field in fields {
        digest.update(field.len().to_le_bytes());
        digest.update(field);
    }
    let stored = StoredReply {
        at,
        reply: reply.clone(),
    };
    let at_ms = at.as_millisecond().max(0).unsigned_abs();
    let key = format!(
        "{}-{}",
        number_key(at_ms),
        hex::encode(&digest.finalize()[..16])
    );
    Row::put(Table::Replies, key, write(&stored))
}

/// A reply, and when it was given.
pub(super) fn read_reply(key: &str, body: &str) -> Result<(Timestamp, Reply), StoreFault> {
    let stored: StoredReply = read("reply", key, body)?;
    Ok((stored.at, stored.reply))
}
