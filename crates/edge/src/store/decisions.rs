//! What was answered, as the file keeps it: enough to explain an answer and to compute it again after any
//! number of restarts.

use super::codec::{read, write};
use super::file::{StoreFault, StoreFile, Table};
use super::opening::network_text;
use super::worlds::closures_of;
use crate::failures::records::AnswerRecord;
use crate::failures::views::wire_record;
use crate::standing::Staleness;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use skyway_contract as wire;

/// A decision as it is read back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredDecision {
    /// Who asked.
    pub(crate) subject: String,
    /// The drone that it was about.
    pub(crate) drone_id: Option<String>,
    /// The number of its world.
    world: u64,
    /// When, in seconds of Unix time.
    at_s: i64,
    /// The record; what closed anything is put in when it is read.
    pub(crate) record: wire::Record<'static>,
}

impl StoredDecision {
    /// The record, with everything that closed anything.
    pub fn into_record(self) -> wire::Record<'static> {
        self.record
    }
}

/// The key of the decision of an id, `epoch-number`; none for what is no such id.
pub(super) fn decision_key(id: &str) -> Option<String> {
    let (epoch, number) = id.split_once('-')?;
    let (epoch, number): (u64, u64) = (epoch.parse().ok()?, number.parse().ok()?);
    Some(format!("{epoch:020}-{number:020}"))
}

/// The same of a record.
pub(super) fn key_of(record: &AnswerRecord) -> String {
    format!("{:020}-{:020}", record.epoch, record.number)
}

/// The body of a decision, in a world of this number.
pub(super) fn write_decision(record: &AnswerRecord, standing: Staleness, world: u64) -> String {
    #[derive(Serialize)]
    struct Written<'a> {
        subject: &'a str,
        drone_id: Option<&'a str>,
        world: u64,
        at_s: i64,
        record: wire::Record<'a>,
    }
    write(&Written {
        subject: &record.subject,
        drone_id: record.drone_id.as_deref(),
        world,
        at_s: record.answered_at.as_second(),
        record: wire_record(record, standing, Vec::new(), None),
    })
}

/// What of a decision says when it was and in which world.
pub(super) fn place_of(key: &str, body: &str) -> Result<(u64, Timestamp), StoreFault> {
    #[derive(Deserialize)]
    struct Place {
        world: u64,
        at_s: i64,
    }
    let place: Place = read("decision", key, body)?;
    let at = Timestamp::from_second(place.at_s).unwrap_or(Timestamp::MIN);
    Ok((place.world, at))
}

/// The decision of an id, with everything that closed anything in its world; none where none is kept.
///
/// # Errors
/// When the file does not answer or is damaged.
pub async fn read_decision(
    file: &mut dyn StoreFile,
    id: &str,
) -> Result<Option<StoredDecision>, StoreFault> {
    let Some(key) = decision_key(id) else {
        return Ok(None);
    };
    let Some(body) = file.read(Table::Decisions, &key).await? else {
        return Ok(None);
    };
    let mut decision: StoredDecision = read("decision", id, &body)?;
    decision.record.world.closures = closures_of(file, decision.world).await?;
    Ok(Some(decision))
}

/// The text of the network that a file is of; none in a new file.
///
/// # Errors
/// When the file does not answer or is damaged.
pub async fn read_network(file: &mut dyn StoreFile) -> Result<Option<String>, StoreFault> {
    let facts = file.load(Table::Facts).await?;
    network_text(&facts)
}
