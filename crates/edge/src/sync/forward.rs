//! Emptying the outbox: what was changed here is told to the registry, one change after the other.
//!
//! A change that met a newer version there waits until the log brings that version: the writer then decides what
//! becomes of both. A removal that finds nothing there, and the log read to its end, is done. What the registry will
//! never take leaves the outbox, and an operator is told.

use super::client::{ClientError, RegistryClient, RegistryWrite};
use super::task::Sync;
use crate::upstream::{OutboxEntry, Upstream};
use crate::writer::commands::Command;
use skyway_contract::{ChangeOperation, RegistryRevision, Written};
use std::sync::Arc;
use std::time::Duration;

/// So often the log is read to its end after a change has met another version than it expects, until it is sure not to
/// bring that version. The first page may have been under way already.
const READINGS: u64 = 2;
/// How often a change may meet another version where the log is not read to its end.
const MEETINGS_MAX: u32 = 60;

/// The code of what a removal that finds nothing is answered with.
const NOT_FOUND: &str = "not_found";
/// The code of what would be one too many.
const LIMIT_REACHED: &str = "limit_reached";

/// What became of a change that was sent.
enum Sent {
    /// The registry has it.
    Taken(Option<Upstream>),
    /// There is another version than expected.
    Met { code: String, detail: String },
    /// The registry will never take it.
    Refused { code: String, detail: String },
    /// The outcome is unknown; to be sent again, not before this many seconds.
    Unknown(Option<u32>),
}

/// A change that has met another version than it expects.
#[derive(Debug, Default)]
struct Meetings {
    /// The change, and the version that it expects.
    of: (u64, Option<Upstream>),
    /// How often the log had been read to its end when they first met.
    read_before: u64,
    count: u32,
}

/// What follows from a meeting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Patience {
    /// The log may bring the other version yet.
    Wait,
    /// The log was read to its end, and does not bring it.
    Read,
    /// It takes too long, and all that waits behind it is held up.
    Over,
}

impl Meetings {
    /// Notes that a change has met another version, the log having been read to its end so often.
    fn note(&mut self, entry: &OutboxEntry, times_read: u64) -> Patience {
        let of = (entry.number, entry.expected);
        if self.of != of {
            *self = Self {
                of,
                read_before: times_read,
                count: 0,
            };
        }
        self.count += 1;
        if times_read >= self.read_before + READINGS {
            return Patience::Read;
        }
        match self.count >= MEETINGS_MAX {
            true => Patience::Over,
            false => Patience::Wait,
        }
    }
}

impl<C: RegistryClient> Sync<C> {
    /// Sends what waits, for ever.
    pub(super) async fn forward_all(&self) {
        let mut pace = self.pace(1);
        let mut news = self.edge.events.news();
        let mut turns = self.contact().turns.subscribe();
        let mut stored = self.edge.store.health().first_changes();
        let mut meetings = Meetings::default();
        loop {
            // Seen from here on, so that what happens meanwhile wakes.
            news.mark_unchanged();
            turns.mark_unchanged();
            stored.mark_unchanged();
            let snapshot = self.edge.snapshot();
            let first = snapshot.outbox.get_min().map(|(_, entry)| entry.clone());
            // A crash must forget neither what others know, nor that the one before it is through.
            let first = first.filter(|entry| self.edge.store.begins_with(entry.number));
            let followed = snapshot.registry.as_ref().map(|cursor| cursor.epoch);
            let followed = followed.filter(|_| self.contact().is_ours());
            let (Some(entry), Some(epoch)) = (first, followed) else {
                // All three live as long as the edge.
                tokio::select! {
                    _ = news.changed() => {}
                    _ = turns.changed() => {}
                    _ = stored.changed() => {}
                }
                continue;
            };
            match self.send(&entry).await {
                Sent::Taken(upstream) => {
                    self.contact().forwarded(true);
                    self.settle(entry.number, upstream, epoch).await;
                    pace.succeeded();
                }
                Sent::Refused { code, detail } => self.give_up(&entry, code, detail).await,
                Sent::Met { code, detail } => {
                    let finds_nothing = code == NOT_FOUND;
                    match meetings.note(&entry, self.contact().times_read()) {
                        // The log brings the other version, and the writer decides.
                        Patience::Wait => {
                            let soon = pace.spread(Duration::from_secs(1));
                            tokio::select! {
                                _ = turns.changed() => {}
                                () = self.pause(soon) => {}
                            }
                        }
                        Patience::Read if finds_nothing => {
                            self.settle(entry.number, None, epoch).await;
                        }
                        Patience::Read | Patience::Over => {
                            self.give_up(&entry, code, detail).await;
                        }
                    }
                }
                Sent::Unknown(retry_after_s) => {
                    let least = Duration::from_secs(retry_after_s.unwrap_or_default().into());
                    self.pause(pace.failed().max(least)).await;
                }
            }
        }
    }

    async fn send(&self, entry: &OutboxEntry) -> Sent {
        let made_ms = entry.made_at.as_millisecond();
        let write = RegistryWrite {
            kind: entry.kind,
            id: entry.id.clone(),
            body: entry.body.clone(),
            if_match: entry
                .expected
                .map(|Upstream { epoch, revision }| format!("\"{epoch}-{revision}\"")),
            // The number begins anew where an edge without a store does; its time tells the two apart.
            idempotency_key: format!("{}-{}-{made_ms}", self.settings.edge_id, entry.number),
            on_behalf_of: entry.subject.clone(),
        };
        match self.client.write(&write).await {
            Ok(written) => self.taken(entry, &written),
            Err(error) => {
                self.contact().failed(error.reason());
                tracing::debug!(%error, id = &*entry.id, "a change was not forwarded");
                judged(entry, error)
            }
        }
    }

    fn taken(&self, entry: &OutboxEntry, written: &Written) -> Sent {
        let snapshot = self.edge.snapshot();
        let followed = snapshot.registry.as_ref();
        if followed.is_some_and(|cursor| *cursor.registry_id != *written.registry_id) {
            // Told to a stranger: the registry that is followed still has to learn of it.
            self.contact().estrange();
            return Sent::Unknown(None);
        }
        if entry.operation == ChangeOperation::Delete {
            return Sent::Taken(None);
        }
        let tag = written.etag.as_deref().map(|tag| tag.trim_matches('"'));
        let version: Option<RegistryRevision> = tag.and_then(|tag| tag.parse().ok());
        let said = RegistryRevision {
            epoch: written.epoch,
            revision: written.revision,
        };
        if version != Some(said) {
            // It says the same twice, and has no other digest: what was bent on its way is asked for again.
            return Sent::Unknown(None);
        }
        Sent::Taken(Some(Upstream {
            epoch: said.epoch,
            revision: said.revision,
        }))
    }

    async fn settle(&self, number: u64, upstream: Option<Upstream>, epoch: u64) {
        let command = Command::Forwarded {
            number,
            upstream,
            epoch,
        };
        if let Err(refusal) = self.edge.command(command).await {
            // It stays in the outbox, and is answered the same when it is sent again.
            tracing::warn!(%refusal, "what was forwarded could not be noted");
            self.pause(Duration::from_secs(1)).await;
        }
    }

    async fn give_up(&self, entry: &Arc<OutboxEntry>, code: String, detail: String) {
        self.contact().forwarded(false);
        tracing::error!(
            id = &*entry.id,
            kind = entry.kind.name(),
            code,
            detail,
            "the registry will not take a change made here"
        );
        let command = Command::NotForwarded {
            number: entry.number,
            code,
            detail,
        };
        if let Err(refusal) = self.edge.command(command).await {
            tracing::warn!(%refusal, "what was refused could not be noted");
            self.pause(Duration::from_secs(1)).await;
        }
    }
}

fn judged(entry: &OutboxEntry, error: ClientError) -> Sent {
    let ClientError::Refused {
        status,
        code,
        detail,
        retry_after_s,
    } = error
    else {
        return Sent::Unknown(None);
    };
    let is_removal = entry.operation == ChangeOperation::Delete;
    match (status, code.as_str()) {
        // As expected: what it was to lift was never there, or is gone by a change before it.
        (404, NOT_FOUND) if is_removal && entry.expected.is_none() => Sent::Taken(None),
        (412 | 428, _) | (409, "already_exists") => Sent::Met { code, detail },
        // Gone already, or no such network; the log tells.
        (404, NOT_FOUND) if is_removal => Sent::Met { code, detail },
        // Of no registry: a proxy on the way knows no such address, for now or for ever.
        (404, "") => Sent::Met { code, detail },
        // The registry is full, and what makes room may wait behind this. What is too much at once says when to try again.
        (429, LIMIT_REACHED) if retry_after_s.is_none() => Sent::Refused { code, detail },
        (400 | 405 | 413 | 415 | 422, _) => Sent::Refused { code, detail },
        _ => Sent::Unknown(retry_after_s),
    }
}
