//! Rows of alarms.

use super::codec::{Instant, read, write};
use super::file::StoreFault;
use crate::entries::{AlarmDraft, AlarmEntry};
use serde::{Deserialize, Serialize};
use skyway_contract::AlarmKind;
use std::sync::Arc;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredAlarm {
    kind: AlarmKind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    plan: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    drone: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    recomposition: Option<String>,
    causes: Vec<String>,
    message: String,
    raised_at: Instant,
    renewed_at: Instant,
    count: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    acknowledged: Option<(Instant, String)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ended_at: Option<Instant>,
}

pub(super) fn write_alarm(entry: &AlarmEntry) -> String {
    let text = |text: &Option<Arc<str>>| text.as_deref().map(str::to_owned);
    let draft = &entry.draft;
    let acknowledged = entry.acknowledged.as_ref();
    write(&StoredAlarm {
        kind: draft.kind,
        plan: text(&draft.plan),
        drone: text(&draft.drone),
        recomposition: text(&draft.recomposition),
        causes: draft.causes.clone(),
        message: draft.message.clone(),
        raised_at: entry.raised_at.into(),
        renewed_at: entry.renewed_at.into(),
        count: entry.count,
        acknowledged: acknowledged.map(|(at, by)| ((*at).into(), by.to_string())),
        ended_at: entry.ended_at.map(Into::into),
    })
}

pub(super) fn read_alarm(number: u64, body: &str) -> Result<AlarmEntry, StoreFault> {
    let stored: StoredAlarm = read("alarm", &number.to_string(), body)?;
    let acknowledged = match stored.acknowledged {
        Some((at, by)) => Some((at.read()?, Arc::from(by))),
        None => None,
    };
    Ok(AlarmEntry {
        number,
        draft: AlarmDraft {
            kind: stored.kind,
            plan: stored.plan.map(Arc::from),
            drone: stored.drone.map(Arc::from),
            recomposition: stored.recomposition.map(Arc::from),
            causes: stored.causes,
            message: stored.message,
        },
        raised_at: stored.raised_at.read()?,
        renewed_at: stored.renewed_at.read()?,
        count: stored.count,
        acknowledged,
        ended_at: Instant::read_some(stored.ended_at.as_ref())?,
    })
}
