//! Commands that take over what the registry has: what is stricter is in force at once, many removals wait for
//! an operator; where both sides changed one thing the stricter stays, see `reviews`.

use super::State;
use crate::background::give_way;
use crate::entries::{ClosureEntry, ZoneEntry};
use crate::sync::followed::{Extent, RegistryDelta, Superseded, Tombstone};
use crate::upstream::published::{Published, Restriction, says_the_same};
use crate::upstream::{OutboxEntry, RegistryCursor, Upstream, is_after};
use crate::views;
use crate::writer::commands::Done;
use serde_json::json;
use skyway_contract::{ChangeOperation, EventKind, ObjectKind};
use skyway_engine::airspace::{Change, Closure};
use skyway_planted::{self as planted, Bug};
use skyway_service::refusal::{Code, Refusal};
use std::collections::BTreeSet;
use std::sync::Arc;

/// What a batch from the registry has changed.
#[derive(Debug, Default)]
pub(super) struct Tally {
    put: Vec<Arc<str>>,
    gone: Vec<Arc<str>>,
}

impl State {
    /// Takes over what the registry has changed, or all that it has.
    pub(super) fn follow(&mut self, followed: RegistryDelta) -> Result<Done, Refusal> {
        self.check_place(&followed)?;
        if let Some(network) = &followed.network {
            self.replace_network(network, self.now)?;
        }
        let mut tally = Tally::default();
        let extent = followed.extent;
        if extent == Extent::Restrictions {
            // Nothing else of what is in doubt counts.
            for put in followed.puts {
                self.follow_strict(put, &mut tally);
            }
            if planted::is(Bug::DeleteFromBadPage) {
                for tombstone in &followed.lifts {
                    self.remove(tombstone.kind, &tombstone.id, &mut tally);
                }
            }
            return Ok(Done::Nothing);
        }
        for superseded in &followed.superseded {
            self.recognise(superseded);
        }
        let listed: BTreeSet<Arc<str>> = match extent {
            Extent::Everything => followed.puts.iter().map(|put| put.id.clone()).collect(),
            Extent::Changes | Extent::Restrictions => BTreeSet::new(),
        };
        if extent == Extent::Everything {
            // What it shows counts, also of a version that was lifted from here and that a backup has brought back.
            self.told.passed(&followed.cursor);
        }
        let mut gone = Vec::new();
        for tombstone in &followed.lifts {
            gone.extend(self.follow_lift(tombstone));
        }
        let standing = self.next.zones.len() + self.next.closures.len();
        // A thing may be lifted as a zone and put as a closure under the same id.
        self.remove_or_hold(gone, standing, &mut tally);
        for put in followed.puts {
            give_way();
            self.follow_put(put, extent, &followed.cursor, &mut tally);
        }
        if extent == Extent::Everything {
            let absent = self.absent(&listed, &followed.cursor);
            self.remove_or_hold(absent, standing, &mut tally);
        }
        match followed.weather {
            Some(weather) => {
                self.state_weather(weather);
                self.next.has_own_weather = false;
            }
            None if extent == Extent::Everything => self.forget_weather(),
            None => {}
        }
        self.move_cursor(followed.cursor, &tally);
        Ok(Done::Nothing)
    }

    /// What was worked out for another state is worked out again.
    fn check_place(&self, followed: &RegistryDelta) -> Result<(), Refusal> {
        let is_here = self.next.registry == followed.after;
        let is_on_it = followed.network.is_some()
            || Arc::ptr_eq(&followed.topology, self.next.airspace.topology());
        match is_here && is_on_it {
            true => Ok(()),
            false => Err(Refusal::new(
                Code::PreconditionFailed,
                "the edge has moved on meanwhile",
            )),
        }
    }

    fn move_cursor(&mut self, cursor: RegistryCursor, tally: &Tally) {
        self.told.passed(&cursor);
        self.doubted.passed(&cursor);
        let before = self.next.registry.replace(Arc::new(cursor.clone()));
        let Some(before) = before.filter(|before| before.epoch != cursor.epoch) else {
            return;
        };
        let told = |ids: &[Arc<str>]| {
            let ids = ids.iter().take(views::IDS_MAX);
            ids.map(|id| id.to_string()).collect::<Vec<String>>()
        };
        let data = json!({
            "from": format!("{}-{}", before.epoch, before.revision),
            "to": format!("{}-{}", cursor.epoch, cursor.revision),
            "put_count": tally.put.len(), "put": told(&tally.put),
            "gone_count": tally.gone.len(), "gone": told(&tally.gone),
        });
        self.happen(EventKind::RegistryEpoch, data);
    }

    /// Finds a change of ours that has come back and was superseded since.
    fn recognise(&mut self, superseded: &Superseded) {
        let waiting = self.waiting_for(superseded.kind, &superseded.id);
        let known = self.last_known(superseded.kind, &superseded.id, &waiting);
        if known >= Some(superseded.upstream) {
            // An earlier one: all removals look the same.
            return;
        }
        let body = superseded.body.as_ref();
        if let Some(first) = waiting.first()
            && is_own_write(first, superseded.operation, body)
        {
            self.note_forwarded(first.number, Some(superseded.upstream));
        }
    }

    /// Something is lifted at the registry; gives it where it has to go here, too.
    fn follow_lift(&mut self, tombstone: &Tombstone) -> Option<(ObjectKind, Arc<str>)> {
        let Tombstone { kind, id, upstream } = tombstone;
        let waiting = self.waiting_for(*kind, id);
        let known = self.last_known(*kind, id, &waiting);
        if known.is_some_and(|known| known > *upstream) {
            // It was put there again since, perhaps from here.
            return None;
        }
        if let Some(first) = waiting.first() {
            self.meet_removal(first);
            return None;
        }
        self.ended.take(id);
        self.upstream_of(*kind, id).map(|_| (*kind, id.clone()))
    }

    /// Something of which changes wait here is gone at the registry.
    fn meet_removal(&mut self, first: &OutboxEntry) {
        match first.operation {
            ChangeOperation::Delete => self.note_forwarded(first.number, None),
            // What is put here is stricter than nothing: it goes there as something new.
            ChangeOperation::Put | ChangeOperation::Patch => {
                self.set_upstream(first.kind, &first.id, None);
                self.expect_next(first.kind, &first.id, None);
            }
        }
    }

    fn follow_put(
        &mut self,
        put: Published,
        extent: Extent,
        cursor: &RegistryCursor,
        tally: &mut Tally,
    ) {
        let waiting = self.waiting_for(put.kind, &put.id);
        let known = self.upstream_of(put.kind, &put.id);
        // What was held back from removal was theirs.
        let was_held = self.release_from_holds(&put.id) && waiting.is_empty();
        let last = self.last_known(put.kind, &put.id, &waiting);
        let is_old = last.is_some_and(|last| is_old_news(last, put.upstream, extent, cursor));
        let is_overruled = waiting.is_empty() && self.stands_in_doubt(&put, cursor);
        if is_old && !is_overruled {
            return;
        }
        if let Some(first) = waiting.first()
            && is_own_write(first, ChangeOperation::Put, Some(&put.body))
        {
            self.note_forwarded(first.number, Some(put.upstream));
            return;
        }
        if let Some(first) = waiting.first()
            && first.expected == Some(put.upstream)
        {
            // The very version that waits to be replaced.
            return;
        }
        if !was_held && self.is_local_only(&put, &waiting) {
            return self.resolve_conflict(put, &mut tally.put);
        }
        self.resolve_name_conflict(&put, tally);
        if self.is_same(&put) {
            self.set_upstream(put.kind, &put.id, Some(put.upstream));
            return;
        }
        if self.is_over(&put) && known.is_none() {
            self.ended.note(&put.id, Some(put.upstream));
            return;
        }
        self.ended.take(&put.id);
        self.take(put, tally);
    }

    /// Whether it has ended by itself.
    pub(super) fn is_over(&self, put: &Published) -> bool {
        put.thing.ends_at().is_some_and(|end| end < self.now)
    }

    /// Whether something was changed here under this id that the registry does not know.
    fn is_local_only(&self, put: &Published, waiting: &[Arc<OutboxEntry>]) -> bool {
        let other = namesake(put.kind);
        let stands_here =
            |kind| self.has(kind, &put.id) && self.upstream_of(kind, &put.id).is_none();
        !waiting.is_empty() || stands_here(put.kind) || stands_here(other)
    }

    /// What has the same id and is of the other kind was lifted there before.
    fn resolve_name_conflict(&mut self, put: &Published, tally: &mut Tally) {
        let other = namesake(put.kind);
        if self.has(other, &put.id) {
            self.remove(other, &put.id, tally);
        }
    }

    /// Whether it is here just so.
    fn is_same(&self, put: &Published) -> bool {
        match &put.thing {
            Restriction::Zone(closure) => {
                let standing = self.next.zones.get(&put.id);
                standing.is_some_and(|entry| Some(&entry.zone) == closure.zone())
            }
            Restriction::Closure(entry) => {
                self.next.closures.get(&put.id).is_some_and(|standing| {
                    let as_there = ClosureEntry {
                        version: standing.version,
                        upstream: standing.upstream,
                        by: standing.by.clone(),
                        ..(**entry).clone()
                    };
                    **standing == as_there
                })
            }
        }
    }

    /// Puts into force what the registry has.
    pub(super) fn take_over(&mut self, put: Published) {
        let version = self.write_number();
        let upstream = Some(put.upstream);
        match put.thing {
            Restriction::Zone(closure) => self.place_zone(&closure, version, upstream),
            Restriction::Closure(entry) => {
                self.keep_closure(ClosureEntry {
                    version,
                    upstream,
                    ..*entry
                });
            }
        }
    }

    pub(super) fn take(&mut self, put: Published, tally: &mut Tally) {
        tally.put.push(put.id.clone());
        self.take_over(put);
    }

    /// Puts a zone into force, whatever was under its id.
    pub(super) fn place_zone(
        &mut self,
        closure: &Arc<Closure>,
        version: u64,
        upstream: Option<Upstream>,
    ) {
        let Some(zone) = closure.zone().cloned() else {
            return;
        };
        let entry = Arc::new(ZoneEntry {
            zone,
            version,
            upstream,
            by: self.author.clone(),
        });
        let etag = self.next.etag(version);
        let data = json!({"zone": views::zone_feature(&entry), "etag": etag});
        let id = Arc::from(closure.id.as_str());
        self.next.zones.insert(id, entry);
        self.changes.push(Change::Put(closure.clone()));
        self.happen(EventKind::ZonePut, data);
    }

    /// Lifts something here, without telling the registry.
    fn remove(&mut self, kind: ObjectKind, id: &Arc<str>, tally: &mut Tally) {
        tally.gone.push(id.clone());
        self.lift_here(kind, id);
    }

    /// Lifts something here, without telling the registry; what is gone already needs no lifting.
    pub(super) fn lift_here(&mut self, kind: ObjectKind, id: &str) {
        match kind {
            ObjectKind::Zone => {
                if self.next.zones.contains_key(id) {
                    self.drop_zone(id);
                }
            }
            ObjectKind::Closure => {
                if let Some(entry) = self.next.closures.get(id).cloned() {
                    self.drop_closure(&entry, "lifted");
                }
            }
            ObjectKind::Network | ObjectKind::Weather => {}
        }
    }

    /// Removes things, or holds them where they are many at once.
    fn remove_or_hold(
        &mut self,
        gone: Vec<(ObjectKind, Arc<str>)>,
        standing: usize,
        tally: &mut Tally,
    ) {
        if Self::is_mass_removal(gone.len(), standing) {
            for (kind, id) in &gone {
                // The registry has it no more, whatever becomes of it here.
                self.set_upstream(*kind, id, None);
            }
            let lifts = gone.into_iter().map(|(_, id)| id.to_string()).collect();
            self.hold_removals("registry", lifts);
            return;
        }
        for (kind, id) in gone {
            self.remove(kind, &id, tally);
        }
    }

    /// What stands here and is not in the list of all that the registry has.
    fn absent(
        &mut self,
        listed: &BTreeSet<Arc<str>>,
        cursor: &RegistryCursor,
    ) -> Vec<(ObjectKind, Arc<str>)> {
        self.meet_absence(listed, cursor);
        let zones = self.next.zones.iter();
        let zones = zones.map(|(id, entry)| (ObjectKind::Zone, id.clone(), entry.upstream));
        let closures = self.next.closures.iter();
        let closures =
            closures.map(|(id, entry)| (ObjectKind::Closure, id.clone(), entry.upstream));
        let here: Vec<(ObjectKind, Arc<str>, Option<Upstream>)> = zones
            .chain(closures)
            .filter(|(_, id, _)| !listed.contains(id))
            .collect();
        let held = self.held_ids();
        let mut gone = Vec::new();
        for (kind, id, upstream) in here {
            let waiting = self.waiting_for(kind, &id);
            match (upstream, waiting.first()) {
                (Some(upstream), _) if is_after(upstream, cursor) => {}
                (Some(_), Some(first)) => self.meet_removal(first),
                (Some(_), None) => gone.push((kind, id)),
                (None, Some(_)) => {}
                // From before this edge followed: told now.
                (None, None) if !held.contains(&*id) => self.introduce(kind, &id),
                (None, None) => {}
            }
        }
        gone
    }

    /// What waits to replace something that is not in the list any more meets its removal.
    ///
    /// What stands here does not tell: it may have been lifted here and put anew.
    fn meet_absence(&mut self, listed: &BTreeSet<Arc<str>>, cursor: &RegistryCursor) {
        // What the registry has made after this list is not gone for not being in it.
        let was_there = |expected: Upstream| !is_after(expected, cursor);
        let waiting = self.next.outbox.values();
        let waiting: Vec<Arc<OutboxEntry>> = waiting
            .filter(|entry| entry.expected.is_some_and(was_there) && !listed.contains(&entry.id))
            .cloned()
            .collect();
        for entry in waiting {
            self.meet_removal(&entry);
        }
    }

    /// Notes that something that stands here is to be told.
    pub(super) fn introduce(&mut self, kind: ObjectKind, id: &str) {
        match kind {
            ObjectKind::Zone => {
                if let Some(entry) = self.next.zones.get(id).cloned() {
                    self.forward_zone(&entry);
                }
            }
            ObjectKind::Closure => {
                if let Some(entry) = self.next.closures.get(id).cloned() {
                    self.forward_closure(&entry);
                }
            }
            ObjectKind::Network | ObjectKind::Weather => {}
        }
    }

    /// The version at the registry of what stands here.
    pub(super) fn upstream_of(&self, kind: ObjectKind, id: &str) -> Option<Upstream> {
        match kind {
            ObjectKind::Zone => self.next.zones.get(id)?.upstream,
            ObjectKind::Closure => self.next.closures.get(id)?.upstream,
            ObjectKind::Network | ObjectKind::Weather => None,
        }
    }

    /// The last version at the registry that is known of something: of what stands here, of what waits to be changed
    /// there, or of what was told. What was told from here may be known before the log brings what came before it.
    pub(super) fn last_known(
        &self,
        kind: ObjectKind,
        id: &str,
        waiting: &[Arc<OutboxEntry>],
    ) -> Option<Upstream> {
        let expected = waiting.first().and_then(|first| first.expected);
        let known = self.upstream_of(kind, id).max(expected);
        known.max(self.told.of(kind, id))
    }

    pub(super) fn has(&self, kind: ObjectKind, id: &str) -> bool {
        match kind {
            ObjectKind::Zone => self.next.zones.contains_key(id),
            ObjectKind::Closure => self.next.closures.contains_key(id),
            ObjectKind::Network | ObjectKind::Weather => false,
        }
    }

    /// What stands here under an id, as it closes things.
    pub(super) fn closure_of(&self, kind: ObjectKind, id: &str) -> Option<Arc<Closure>> {
        match kind {
            ObjectKind::Closure => {
                let entry = self.next.closures.get(id)?;
                Some(entry.closure.clone())
            }
            ObjectKind::Zone => {
                let zone = &self.next.zones.get(id)?.zone;
                // Of this batch, or of the batches before.
                let of_this = self.changes.iter().rev().find_map(|change| match change {
                    Change::Put(closure) if closure.id == id => Some(closure.clone()),
                    Change::Put(_) | Change::Lift(_) => None,
                });
                let known = of_this.or_else(|| self.next.airspace.closure(id).cloned());
                known.filter(|closure| closure.zone() == Some(zone))
            }
            ObjectKind::Network | ObjectKind::Weather => None,
        }
    }
}

/// Whether what came is what waits to be told.
fn is_own_write(entry: &OutboxEntry, operation: ChangeOperation, body: Option<&Arc<str>>) -> bool {
    let is_same = match (&entry.body, body) {
        (Some(ours), Some(theirs)) => says_the_same(ours, theirs),
        (ours, theirs) => ours.as_ref() == theirs,
    };
    entry.operation == operation && is_same
}

/// Whether a version that came is none that would change the one known.
fn is_old_news(known: Upstream, came: Upstream, extent: Extent, cursor: &RegistryCursor) -> bool {
    match extent {
        Extent::Changes | Extent::Restrictions => known >= came,
        // A registry that was restored may have an older version, and then that is the one.
        Extent::Everything => known == came || is_after(known, cursor),
    }
}

/// The kind that shares its ids with this one.
pub(super) fn namesake(kind: ObjectKind) -> ObjectKind {
    match kind {
        ObjectKind::Zone => ObjectKind::Closure,
        ObjectKind::Closure => ObjectKind::Zone,
        other => other,
    }
}
