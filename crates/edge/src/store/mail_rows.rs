//! Rows of mailboxes: a row for each message.

use super::codec::{Instant, read, write};
use super::file::StoreFault;
use crate::line::mailbox::{Content, MailEntry};
use serde::{Deserialize, Serialize};
use skyway_contract::{AlarmKind, EndedAs};
use std::sync::Arc;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredMessage {
    drone: String,
    plan: String,
    at: Instant,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    causes: Vec<String>,
    content: StoredContent,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum StoredContent {
    Version(u32),
    Offer(u32),
    Relieved,
    Contingencies(u32),
    NoWay(Option<String>),
    Declined,
    Ended(EndedAs),
    Alarm(AlarmKind, String),
    WhereAreYou,
    Assigned,
}

pub(super) fn write_message(entry: &MailEntry) -> String {
    write(&StoredMessage {
        drone: entry.drone.to_string(),
        plan: entry.plan.to_string(),
        at: entry.at.into(),
        causes: entry.causes.clone(),
        content: match &entry.content {
            Content::Version(number) => StoredContent::Version(*number),
            Content::Offer(number) => StoredContent::Offer(*number),
            Content::Relieved => StoredContent::Relieved,
            Content::Contingencies(number) => StoredContent::Contingencies(*number),
            Content::NoWay { unsafe_way } => {
                StoredContent::NoWay(unsafe_way.as_deref().map(str::to_owned))
            }
            Content::Declined => StoredContent::Declined,
            Content::Ended(how) => StoredContent::Ended(*how),
            Content::Alarm { kind, text } => StoredContent::Alarm(*kind, text.to_string()),
            Content::WhereAreYou => StoredContent::WhereAreYou,
            Content::Assigned => StoredContent::Assigned,
        },
    })
}

pub(super) fn read_message(number: u64, body: &str) -> Result<MailEntry, StoreFault> {
    let stored: StoredMessage = read("message", &number.to_string(), body)?;
    Ok(MailEntry {
        drone: Arc::from(stored.drone),
        number,
        at: stored.at.read()?,
        plan: Arc::from(stored.plan),
        causes: stored.causes,
        content: match stored.content {
            StoredContent::Version(number) => Content::Version(number),
            StoredContent::Offer(number) => Content::Offer(number),
            StoredContent::Relieved => Content::Relieved,
            StoredContent::Contingencies(number) => Content::Contingencies(number),
            StoredContent::NoWay(way) => Content::NoWay {
                unsafe_way: way.map(Arc::from),
            },
            StoredContent::Declined => Content::Declined,
            StoredContent::Ended(how) => Content::Ended(how),
            StoredContent::Alarm(kind, text) => Content::Alarm {
                kind,
                text: Arc::from(text),
            },
            StoredContent::WhereAreYou => Content::WhereAreYou,
            StoredContent::Assigned => Content::Assigned,
        },
    })
}
