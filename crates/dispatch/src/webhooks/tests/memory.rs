//! Documents and messages in memory, as far as webhooks need them.

use skyway_registry::documents::{
    Commit, Committed, Document, DocumentKind, DocumentQuery, Documents, FailureCount, Followers,
    Message, PositionRow, Settlement,
};
use skyway_registry::store::{Answer, KeptReply, StoreError};
use std::collections::BTreeMap;
use std::mem;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What is kept.
#[derive(Debug, Default)]
struct Kept {
    documents: BTreeMap<(DocumentKind, String), Document>,
    messages: BTreeMap<String, Message>,
    /// How often messages were settled.
    settlements: usize,
    is_broken: bool,
    is_overtaken: bool,
}

/// A store that is gone with the test.
#[derive(Debug, Default)]
pub(super) struct Memory(Mutex<Kept>);

impl Memory {
    /// How often messages were settled, whatever their number.
    pub(super) fn settlements(&self) -> usize {
        self.kept().settlements
    }

    /// Settles no message any more.
    pub(super) fn break_down(&self) {
        self.kept().is_broken = true;
    }

    /// Before messages are settled the next time, another process sends them.
    pub(super) fn overtake(&self) {
        self.kept().is_overtaken = true;
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn now<'a, T: Send + 'a>(value: T) -> Answer<'a, T> {
    Box::pin(async move { Ok(value) })
}

fn not_here<'a, T: Send + 'a>() -> Answer<'a, T> {
    let message = "it is not kept in memory".to_owned();
    Box::pin(async move { Err(StoreError::Unavailable { message }) })
}

/// Whether no message about the same, to the same webhook, comes before.
fn is_first(message: &Message, all: &BTreeMap<String, Message>) -> bool {
    !all.values().any(|other| {
        other.state == "pending"
            && (&other.webhook, &other.subject) == (&message.webhook, &message.subject)
            && other.number < message.number
    })
}

fn settle(kept: &mut Kept, settlement: &Settlement) -> bool {
    let Settlement {
        message,
        attempts_before,
    } = settlement;
    let current = kept.messages.get(&message.id);
    let is_as_seen = current.is_none_or(|current| {
        attempts_before
            .is_none_or(|before| current.state == "pending" && current.attempts == before)
    });
    if !is_as_seen {
        return false;
    }
    kept.messages.insert(message.id.clone(), message.clone());
    let followers = kept.messages.values_mut().filter(|other| {
        other.state == "pending"
            && (&other.webhook, &other.subject) == (&message.webhook, &message.subject)
            && other.number > message.number
    });
    for other in followers {
        other.due_ms = match settlement.followers() {
            Followers::Stay => other.due_ms,
            Followers::NotBefore => other.due_ms.max(message.due_ms),
            Followers::By => other.due_ms.min(message.due_ms),
        };
    }
    true
}

impl Documents for Memory {
    fn document<'a>(&'a self, kind: DocumentKind, id: &'a str) -> Answer<'a, Option<Document>> {
        now(self.kept().documents.get(&(kind, id.to_owned())).cloned())
    }

    fn documents<'a>(&'a self, query: &'a DocumentQuery) -> Answer<'a, Vec<Document>> {
        let kept = self.kept();
        let found = kept.documents.values().filter(|document| {
            let of = query.of.as_ref();
            let is_of = of.is_none_or(|of| [&document.tenant, &document.party].contains(&of));
            let stands_so = query.states.is_empty() || query.states.contains(&document.state);
            let is_after = query.after.as_ref().is_none_or(|after| {
                let beyond = document.id.cmp(after);
                beyond.is_ne() && beyond.is_lt() == query.is_newest_first
            });
            document.kind == query.kind && is_of && stands_so && is_after
        });
        let limit = usize::try_from(query.limit).expect("a small limit");
        let mut found: Vec<Document> = found.cloned().collect();
        if query.is_newest_first {
            found.reverse();
        }
        found.truncate(limit);
        now(found)
    }

    fn count_standing<'a>(
        &'a self,
        _: DocumentKind,
        _: &'a str,
        _: &'a [&'static str],
        _: Option<&'a str>,
    ) -> Answer<'a, u64> {
        not_here()
    }

    fn count_documents<'a>(
        &'a self,
        kind: DocumentKind,
        tenant: Option<&'a str>,
    ) -> Answer<'a, u64> {
        let kept = self.kept();
        let of_kind = kept
            .documents
            .values()
            .filter(|document| document.kind == kind);
        let counted =
            of_kind.filter(|document| tenant.is_none_or(|tenant| document.tenant == tenant));
        now(counted.count() as u64)
    }

    fn commit<'a>(&'a self, commit: &'a Commit) -> Answer<'a, Committed> {
        let mut kept = self.kept();
        let has_moved = commit.seen.iter().any(|seen| {
            let current = kept.documents.get(&(seen.kind, seen.id.clone()));
            current.map(|document| document.version) != seen.version
        });
        if has_moved {
            return now(Committed::Moved);
        }
        for document in &commit.puts {
            let key = (document.kind, document.id.clone());
            kept.documents.insert(key, document.clone());
        }
        for key in &commit.deletes {
            kept.documents.remove(key);
        }
        for message in &commit.messages {
            kept.messages.insert(message.id.clone(), message.clone());
        }
        now(Committed::Done)
    }

    fn due_messages<'a>(
        &'a self,
        now_ms: i64,
        limit: u64,
        without: &'a [String],
    ) -> Answer<'a, Vec<Message>> {
        let kept = self.kept();
        let due = kept.messages.values().filter(|message| {
            message.state == "pending"
                && message.due_ms <= now_ms
                && !without.contains(&message.webhook)
                && is_first(message, &kept.messages)
        });
        let mut due: Vec<Message> = due.cloned().collect();
        due.sort_by_key(|message| message.due_ms);
        due.truncate(usize::try_from(limit).expect("a small limit"));
        now(due)
    }

    fn next_due(&self) -> Answer<'_, Option<i64>> {
        let kept = self.kept();
        let first = kept
            .messages
            .values()
            .filter(|message| message.state == "pending" && is_first(message, &kept.messages));
        now(first.map(|message| message.due_ms).min())
    }

    fn settle_messages<'a>(&'a self, settled: &'a [Settlement]) -> Answer<'a, Vec<bool>> {
        Box::pin(async move {
            // Others come to wait meanwhile, as with a database.
            tokio::task::yield_now().await;
            let mut kept = self.kept();
            if kept.is_broken {
                let message = "it is broken".to_owned();
                return Err(StoreError::Unavailable { message });
            }
            if mem::take(&mut kept.is_overtaken) {
                for settlement in settled {
                    let lease = settlement.message.clone();
                    kept.messages.insert(lease.id.clone(), lease);
                }
            }
            kept.settlements += 1;
            Ok(settled.iter().map(|one| settle(&mut kept, one)).collect())
        })
    }

    fn messages<'a>(
        &'a self,
        webhook: &'a str,
        before: Option<(i64, String)>,
        limit: u64,
    ) -> Answer<'a, Vec<Message>> {
        let kept = self.kept();
        let of_webhook = kept
            .messages
            .values()
            .filter(|message| message.webhook == webhook);
        let place = |message: &Message| (message.created_ms, message.id.clone());
        let earlier = of_webhook.filter(|message| {
            before
                .as_ref()
                .is_none_or(|before| place(message) < *before)
        });
        let mut found: Vec<Message> = earlier.cloned().collect();
        found.sort_by_key(|message| std::cmp::Reverse(place(message)));
        found.truncate(usize::try_from(limit).expect("a small limit"));
        now(found)
    }

    fn message<'a>(&'a self, id: &'a str) -> Answer<'a, Option<Message>> {
        now(self.kept().messages.get(id).cloned())
    }

    fn kept_reply<'a>(&'a self, _: &'a str, _: &'a str) -> Answer<'a, Option<(String, KeptReply)>> {
        not_here()
    }

    fn news_through<'a>(&'a self, _: &'a str, _: &'a str, _: u64) -> Answer<'a, u64> {
        not_here()
    }

    fn keep_positions<'a>(&'a self, _: &'a [PositionRow]) -> Answer<'a, u64> {
        not_here()
    }

    fn positions<'a>(&'a self, _: &'a str, _: i64, _: i64, _: u64) -> Answer<'a, Vec<PositionRow>> {
        not_here()
    }

    fn last_positions<'a>(&'a self, _: &'a [String], _: i64) -> Answer<'a, Vec<PositionRow>> {
        not_here()
    }

    fn count_failures<'a>(
        &'a self,
        _: &'a str,
        _: i64,
        _: i64,
        _: u64,
    ) -> Answer<'a, Vec<FailureCount>> {
        not_here()
    }

    fn drop_before(&self, _: i64, _: i64) -> Answer<'_, ()> {
        not_here()
    }
}
