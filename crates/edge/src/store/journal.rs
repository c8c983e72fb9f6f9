//! The journal: what was answered, written soon after. No request waits for it, and it is bounded: under trouble the
//! newest entries are lost and counted, never the airspace.

use super::codec::number_key;
use super::decisions::{key_of, place_of, write_decision};
use super::file::{Row, StoreFault, StoreFile, Table};
use super::reply_rows::{Reply, ReportReply, reply_row};
use super::worlds::Worlds;
use crate::failures::records::AnswerRecord;
use crate::failures::views::report_reply;
use crate::settings::Settings;
use crate::standing::Staleness;
use jiff::{SignedDuration, Timestamp};
use std::collections::VecDeque;
use std::sync::Arc;

/// At most this many entries wait to be written; further ones are lost.
pub(super) const ENTRIES_MAX: usize = 4_096;
/// The most bytes that wait for a disk that fails.
const UNSAVED_MAX: usize = 8 << 20;
/// Answers for requests that may be sent again take at most this many bytes of the file.
const REPLIES_BYTES_MAX: u64 = 32 << 20;
/// Entries after which others get their turn.
const STRETCH: usize = 32;
/// The most old rows that go at once.
const FORGOTTEN_AT_ONCE: usize = 512;
/// The age of the oldest decision is looked at once in this many writings.
const AGE_EVERY: u64 = 64;

/// The fact of the last world's number.
const WORLDS: &str = "worlds";

/// Something to be written.
#[derive(Debug)]
pub(crate) enum Entry {
    /// What a failure report was answered.
    Decision {
        record: Arc<AnswerRecord>,
        standing: Staleness,
    },
    /// What is to be answered when the report of an id comes again.
    Report {
        subject: Arc<str>,
        id: String,
        record: Arc<AnswerRecord>,
        standing: Staleness,
    },
    /// What is to be answered when a write comes again.
    Write { reply: Reply, at: Timestamp },
}

impl Entry {
    /// Entries of the same world are written together.
    fn world(&self) -> u64 {
        match self {
            Self::Decision { record, .. } => record.airspace.revision(),
            Self::Report { .. } | Self::Write { .. } => 0,
        }
    }
}

/// What the file has of the journal.
#[derive(Debug)]
struct Index {
    worlds: Worlds,
    decisions: Shelf,
    replies: Shelf,
}

/// Rows of a table in the order in which they go.
#[derive(Debug)]
struct Shelf {
    table: Table,
    keys: VecDeque<(String, u64)>,
    bytes: u64,
}

impl Shelf {
    async fn load(file: &mut dyn StoreFile, table: Table) -> Result<Self, StoreFault> {
        let keys: VecDeque<(String, u64)> = file.sizes(table).await?.into();
        let bytes = keys.iter().map(|(_, bytes)| bytes).sum();
        Ok(Self { table, keys, bytes })
    }

    fn add(&mut self, row: &Row) {
        let bytes = row.body.as_ref().map_or(0, String::len) as u64;
        self.bytes += bytes;
        self.keys.push_back((row.key.clone(), bytes));
    }

    fn forget_oldest(&mut self, rows: &mut Vec<Row>) {
        if let Some((key, bytes)) = self.keys.pop_front() {
            self.bytes = self.bytes.saturating_sub(bytes);
            rows.push(Row::remove(self.table, key));
        }
    }
}

/// How much of it is kept.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    decisions_bytes: u64,
    decisions_age: SignedDuration,
    replies: usize,
    replies_age: SignedDuration,
}

/// The journal, as the storekeeper writes it.
#[derive(Debug)]
pub(super) struct Journal {
    bounds: Bounds,
    /// None until it is read, and after something was lost.
    index: Option<Index>,
    /// Rows that are not in the file yet, and about how many bytes they have.
    unsaved: Vec<Row>,
    writings: u64,
}

impl Journal {
    pub(super) fn new(settings: &Settings) -> Self {
        Self {
            bounds: Bounds {
                decisions_bytes: settings.decisions_bytes_max,
                decisions_age: settings.decisions_age,
                replies: settings.idempotency_max,
                replies_age: settings.idempotency_age,
            },
            index: None,
            unsaved: Vec::new(),
            writings: 0,
        }
    }

    /// Whether rows wait for the file.
    pub(super) fn is_saved(&self) -> bool {
        self.unsaved.is_empty()
    }

    /// The rows to be written; they are given back where that fails.
    pub(super) fn take(&mut self) -> Vec<Row> {
        std::mem::take(&mut self.unsaved)
    }

    /// Takes rows back that could not be written; tells how many are lost because they are too many.
    pub(super) fn give_back(&mut self, rows: Vec<Row>) -> u64 {
        self.unsaved = rows;
        let bytes = |row: &Row| row.key.len() + row.body.as_ref().map_or(0, String::len);
        let bytes: usize = self.unsaved.iter().map(bytes).sum();
        match bytes > UNSAVED_MAX {
            true => self.drop_all(),
            false => 0,
        }
    }

    fn drop_all(&mut self) -> u64 {
        // What the file has is read again: it is not what was thought.
        self.index = None;
        std::mem::take(&mut self.unsaved).len() as u64
    }

    /// Makes rows of entries, and of what is to go for them.
    pub(super) async fn encode(
        &mut self,
        file: &mut dyn StoreFile,
        mut entries: Vec<Entry>,
        now: Timestamp,
    ) -> Result<(), StoreFault> {
        if self.index.is_none() {
            let mut worlds = Worlds::load(file).await?;
            if let Some(last) = file.read(Table::Facts, WORLDS).await? {
                worlds.begin_after(last.parse().unwrap_or_default());
            }
            self.index = Some(Index {
                worlds,
                decisions: Shelf::load(file, Table::Decisions).await?,
                replies: Shelf::load(file, Table::Replies).await?,
            });
        }
        let Some(index) = &mut self.index else {
            return Ok(());
        };
        entries.sort_by_key(Entry::world);
        for (number, entry) in (1..).zip(entries) {
            index.write(entry, &mut self.unsaved);
            if number % STRETCH == 0 {
                tokio::task::yield_now().await;
            }
        }
        self.writings += 1;
        let looks_at_age = self.writings % AGE_EVERY == 1;
        index.forget_replies(self.bounds, now, &mut self.unsaved);
        let rows = &mut self.unsaved;
        let forgotten = index.forget_decisions(file, self.bounds, now, looks_at_age, rows);
        if let Err(fault) = forgotten.await {
            tracing::warn!(%fault, "old decisions could not be looked over");
        }
        Ok(())
    }
}

impl Index {
    fn write(&mut self, entry: Entry, rows: &mut Vec<Row>) {
        match entry {
            Entry::Decision { record, standing } => {
                let last = self.worlds.last();
                let world = self.worlds.number(&record.airspace, rows);
                if self.worlds.last() != last {
                    rows.push(Row::put(Table::Facts, WORLDS, world.to_string()));
                }
                let body = write_decision(&record, standing, world);
                let row = Row::put(Table::Decisions, key_of(&record), body);
                self.decisions.add(&row);
                rows.push(row);
            }
            Entry::Report {
                subject,
                id,
                record,
                standing,
            } => {
                let reply: ReportReply = report_reply(&subject, id, &record, standing);
                let row = reply_row(&Reply::Report(Box::new(reply)), record.answered_at);
                self.replies.add(&row);
                rows.push(row);
            }
            Entry::Write { reply, at } => {
                let row = reply_row(&reply, at);
                self.replies.add(&row);
                rows.push(row);
            }
        }
    }

    fn forget_replies(&mut self, bounds: Bounds, now: Timestamp, rows: &mut Vec<Row>) {
        let horizon = now.saturating_sub(bounds.replies_age);
        let horizon = horizon.map_or(0, Timestamp::as_millisecond).max(0);
        let horizon = number_key(horizon.unsigned_abs());
        for _ in 0..FORGOTTEN_AT_ONCE {
            let replies = &mut self.replies;
            let is_old = replies.keys.front().is_some_and(|(key, _)| *key < horizon);
            let is_much = replies.keys.len() > bounds.replies || replies.bytes > REPLIES_BYTES_MAX;
            if !is_old && !is_much {
                return;
            }
            replies.forget_oldest(rows);
        }
    }

    async fn forget_decisions(
        &mut self,
        file: &mut dyn StoreFile,
        bounds: Bounds,
        now: Timestamp,
        looks_at_age: bool,
        rows: &mut Vec<Row>,
    ) -> Result<(), StoreFault> {
        let mut forgotten = 0;
        while forgotten < FORGOTTEN_AT_ONCE && !self.decisions.keys.is_empty() {
            let is_much = self.decisions.bytes > bounds.decisions_bytes;
            let is_old = looks_at_age && {
                let oldest = self.oldest(file).await?;
                oldest.is_some_and(|(_, at)| now.duration_since(at) > bounds.decisions_age)
            };
            if !is_much && !is_old {
                break;
            }
            self.decisions.forget_oldest(rows);
            forgotten += 1;
        }
        if forgotten > 0
            && let Some((world, _)) = self.oldest(file).await?
        {
            self.worlds.forget_before(world, rows);
        }
        Ok(())
    }

    /// World and time of the oldest decision that is in the file.
    async fn oldest(
        &self,
        file: &mut dyn StoreFile,
    ) -> Result<Option<(u64, Timestamp)>, StoreFault> {
        let Some((key, _)) = self.decisions.keys.front() else {
            return Ok(None);
        };
        let body = file.read(Table::Decisions, key).await?;
        body.map(|body| place_of(key, &body)).transpose()
    }
}
