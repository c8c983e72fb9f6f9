//! The outbox: what was changed at this edge and the registry has yet to be told.
//!
//! Entries are made by the order that makes the change, so that both are stored together or not at all. Of one
//! thing at most two wait: the first may be on its way already, and whatever comes after it takes the place of
//! the second.

use super::State;
use crate::entries::{ClosureEntry, ZoneEntry};
use crate::upstream::published::{closure_body, end_of, zone_body};
use crate::upstream::{ITSELF, OutboxEntry, Upstream, is_after};
use serde_json::json;
use skyway_contract::{Author, ChangeOperation, EventKind, ObjectKind};
use std::sync::Arc;

/// A change that is to be told to the registry: the text of what is put, and none where it is lifted.
type Forward = (ObjectKind, Arc<str>, Option<Arc<str>>);

impl State {
    /// Notes that a zone is to be told.
    pub(super) fn forward_zone(&mut self, entry: &ZoneEntry) {
        if self.settings.follows_registry {
            let (id, body) = (Arc::from(entry.zone.id()), zone_body(&entry.zone));
            let change = (ObjectKind::Zone, id, Some(body));
            self.forward(change, entry.upstream, self.on_behalf_of());
        }
    }

    /// Notes that a closure is to be told.
    pub(super) fn forward_closure(&mut self, entry: &ClosureEntry) {
        if self.settings.follows_registry {
            let body = closure_body(self.next.topology(), entry);
            let id = Arc::from(entry.closure.id.as_str());
            let change = (ObjectKind::Closure, id, Some(body));
            self.forward(change, entry.upstream, self.on_behalf_of());
        }
    }

    /// Notes that something was lifted here.
    pub(super) fn forward_removal(
        &mut self,
        kind: ObjectKind,
        id: &str,
        upstream: Option<Upstream>,
    ) {
        self.end_refused(kind, id);
        let is_known = upstream.is_some() || !self.waiting_for(kind, id).is_empty();
        if self.settings.follows_registry && is_known {
            let change = (kind, Arc::from(id), None);
            self.forward(change, upstream, self.on_behalf_of());
        }
    }

    /// A closure has ended here by itself. Everyone ends what was told just so; a version that still waits to be replaced
    /// or removed may last longer, so that it is removed.
    pub(super) fn forward_end(&mut self, id: &str) {
        let kind = ObjectKind::Closure;
        let waiting = self.waiting_for(kind, id);
        let Some(first) = waiting.first() else {
            return;
        };
        self.withdraw(kind, id);
        let is_removal = first.operation == ChangeOperation::Delete;
        let end = first.body.as_deref().and_then(end_of);
        let is_over = end.is_some_and(|end| end < self.now);
        if is_removal || !is_over {
            // It may be on its way already.
            self.next.outbox.insert(first.number, first.clone());
        }
        if !is_removal && (!is_over || first.expected.is_some()) {
            let change = (kind, first.id.clone(), None);
            self.forward(change, first.expected, Arc::from(ITSELF));
        }
    }

    /// In whose name something is told: as the registry writes it beside the edge.
    fn on_behalf_of(&self) -> Arc<str> {
        match self.author.as_deref() {
            Some(Author { role, subject, .. }) => Arc::from(format!("{role}:{subject}")),
            None => Arc::from(ITSELF),
        }
    }

    /// Puts a change into the outbox: with the version at the registry, where it is known there, and with who made it.
    pub(super) fn forward(
        &mut self,
        (kind, id, body): Forward,
        upstream: Option<Upstream>,
        subject: Arc<str>,
    ) {
        self.end_refused(kind, &id);
        let waiting = self.waiting_for(kind, &id);
        let expected = match waiting.as_slice() {
            [] => upstream,
            // Known once the one before it is through.
            [_only] => None,
            [_first, .., last] => {
                let last = last.number;
                self.next.outbox.remove(&last).and_then(|e| e.expected)
            }
        };
        let number = self.write_number();
        let operation = match body {
            Some(_) => ChangeOperation::Put,
            None => ChangeOperation::Delete,
        };
        let entry = OutboxEntry {
            number,
            kind,
            id,
            operation,
            body,
            expected,
            made_at: self.now,
            subject,
        };
        self.next.outbox.insert(number, Arc::new(entry));
    }

    /// What waits to be told of a thing, in its order.
    pub(super) fn waiting_for(&self, kind: ObjectKind, id: &str) -> Vec<Arc<OutboxEntry>> {
        let all = self.next.outbox.values();
        all.filter(|entry| entry.kind == kind && &*entry.id == id)
            .cloned()
            .collect()
    }

    /// The registry has answered a change that was told while an epoch of it was followed: it has it.
    ///
    /// The log may have said so before; then this changes nothing.
    pub(super) fn note_answered(&mut self, number: u64, upstream: Option<Upstream>, epoch: u64) {
        let Some(cursor) = self.next.registry.clone() else {
            return;
        };
        if cursor.epoch != epoch {
            // Perhaps it was lost with the epoch that has ended since: it is told again.
            return;
        }
        match upstream {
            Some(version) if !is_after(version, &cursor) => {
                return self.note_overtaken(number);
            }
            Some(version) => {
                if let Some(entry) = self.next.outbox.get(&number) {
                    self.told.note(entry.kind, &entry.id, version);
                }
            }
            None => {}
        }
        self.note_forwarded(number, upstream);
    }

    /// The registry has taken a change at a revision that the cursor has passed, as it says when it is told again.
    ///
    /// Had what was read up to the cursor shown the version, the change would wait no longer. So another one has
    /// taken its place, and what was read has shown that one, or that there is nothing: this counts, and the version
    /// that was answered does not.
    fn note_overtaken(&mut self, number: u64) {
        let Some(entry) = self.next.outbox.remove(&number) else {
            return;
        };
        let (kind, id, there) = (entry.kind, &*entry.id, entry.expected);
        self.set_upstream(kind, id, there);
        self.expect_next(kind, id, there);
        if there.is_none() && self.waiting_for(kind, id).is_empty() {
            // Ours was in force there, and was lifted.
            self.lift_here(kind, id);
        }
    }

    /// The registry has a change: it is that version there now, or gone.
    ///
    /// The answer may come twice, by the log and by itself; the second time changes nothing.
    pub(super) fn note_forwarded(&mut self, number: u64, upstream: Option<Upstream>) {
        let Some(entry) = self.next.outbox.remove(&number) else {
            return;
        };
        let upstream = upstream.filter(|_| entry.operation != ChangeOperation::Delete);
        if upstream.is_some() {
            self.set_upstream(entry.kind, &entry.id, upstream);
        }
        self.expect_next(entry.kind, &entry.id, upstream);
    }

    /// The next change of a thing that waits replaces this version.
    pub(super) fn expect_next(&mut self, kind: ObjectKind, id: &str, expected: Option<Upstream>) {
        if let Some(next) = self.waiting_for(kind, id).first() {
            let next = OutboxEntry {
                expected,
                ..(**next).clone()
            };
            self.next.outbox.insert(next.number, Arc::new(next));
        }
    }

    /// Takes back whatever waits to be told of a thing.
    pub(super) fn withdraw(&mut self, kind: ObjectKind, id: &str) {
        if self.next.outbox.is_empty() {
            return;
        }
        for entry in self.waiting_for(kind, id) {
            self.next.outbox.remove(&entry.number);
        }
    }

    /// The registry will never take a change: an operator decides what becomes of it, unless it was changed again since.
    pub(super) fn give_up(&mut self, number: u64, code: &str, detail: &str) {
        let Some(entry) = self.next.outbox.remove(&number) else {
            return;
        };
        let data = json!({
            "kind": entry.kind, "id": &*entry.id, "operation": entry.operation,
            "code": code, "detail": detail,
        });
        self.happen(EventKind::ForwardRefused, data);
        if self.waiting_for(entry.kind, &entry.id).is_empty() {
            self.hold_refused(&entry);
        }
        // What it was to replace is there as before.
        self.expect_next(entry.kind, &entry.id, entry.expected);
    }

    /// Notes which version a thing has at the registry, which changes nothing here.
    pub(super) fn set_upstream(&mut self, kind: ObjectKind, id: &str, upstream: Option<Upstream>) {
        match kind {
            ObjectKind::Zone => {
                if let Some(entry) = self.next.zones.get_mut(id) {
                    let known = (**entry).clone();
                    *entry = Arc::new(ZoneEntry { upstream, ..known });
                }
            }
            ObjectKind::Closure => {
                if let Some(entry) = self.next.closures.get_mut(id) {
                    let known = (**entry).clone();
                    *entry = Arc::new(ClosureEntry { upstream, ..known });
                }
            }
            ObjectKind::Network | ObjectKind::Weather => {}
        }
    }
}
