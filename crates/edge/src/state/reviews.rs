//! What waits for an operator: many removals at once, and changes that met a newer version at the registry.
//!
//! A change made here that meets another one made there is applied only where it enlarges: then it is sent again
//! in place of the newer version. Otherwise theirs takes the id, ours stays in force beside it under an id of the
//! hold's, and an operator decides: to release writes ours in place of theirs, to reject drops ours.

use super::State;
use super::import::feed_of;
use super::sync::namesake;
use crate::entries::{ClosureEntry, Contested, PendingReview};
use crate::upstream::OutboxEntry;
use crate::upstream::published::{
    Published, Restriction, closure_body, read_thing, says_the_same, zone_body,
};
use crate::views;
use crate::writer::commands::{Decision, Done};
use serde_json::json;
use skyway_contract::{ChangeOperation, EventKind, ObjectKind};
use skyway_engine::airspace::{Cause, Closure};
use skyway_formats::{ZoneId, zone_to_feature};
use skyway_service::intake::read_zone;
use skyway_service::refusal::{Code, Refusal};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Removals at once wait for an operator above this share of what is there ...
const HELD_SHARE: f64 = 0.2;
/// ... and from this many on.
const HELD_FROM: usize = 10;
/// At most this many mass removals wait apart; further ones join the latest.
const HOLDS_MAX: usize = 100;

impl State {
    pub(super) fn is_mass_removal(count: usize, standing: usize) -> bool {
        let share = count as f64 / standing.max(1) as f64;
        count >= HELD_FROM && share > HELD_SHARE
    }

    /// Holds removals until an operator decides.
    pub(super) fn hold_removals(&mut self, origin: &str, lifts: Vec<String>) {
        let latest = self.next.holds.iter().rev();
        let mut latest =
            latest.filter(|(_, hold)| hold.contested.is_none() && &*hold.origin == origin);
        if self.next.holds.len() >= HOLDS_MAX
            && let Some((&number, hold)) = latest.next()
        {
            let mut joined = (**hold).clone();
            joined.lifts.extend(lifts);
            self.next.holds.insert(number, Arc::new(joined));
            return;
        }
        self.add_review(origin, lifts, None);
    }

    fn add_review(&mut self, origin: &str, lifts: Vec<String>, contested: Option<Contested>) {
        let hold = Arc::new(PendingReview {
            number: self.write_number(),
            origin: Arc::from(origin),
            held_at: self.now,
            lifts,
            contested: contested.map(Arc::new),
        });
        self.next.holds.insert(hold.number, hold.clone());
        let data = json!({"hold": views::hold(&self.next, &hold)});
        self.happen(EventKind::HoldMade, data);
    }

    /// What was to be removed is put anew: no hold may lift it any more.
    ///
    /// Tells whether one would have.
    pub(super) fn release_from_holds(&mut self, id: &str) -> bool {
        let naming: Vec<Arc<PendingReview>> = self
            .next
            .holds
            .values()
            .filter(|hold| hold.lifts.iter().any(|lift| lift == id))
            .cloned()
            .collect();
        let is_named = !naming.is_empty();
        for hold in naming {
            let mut left = (*hold).clone();
            left.lifts.retain(|lift| lift != id);
            match left.lifts.is_empty() {
                true => self.end_hold(hold.number, "overtaken"),
                false => {
                    self.next.holds.insert(hold.number, Arc::new(left));
                }
            }
        }
        is_named
    }

    /// The ids of what waits for an operator here: neither lifted nor told.
    pub(super) fn held_ids(&self) -> BTreeSet<String> {
        let holds = self.next.holds.values();
        let ids = holds.flat_map(|hold| {
            let contested = hold.contested.as_ref();
            let aside = contested.and_then(|contested| contested.aside.as_deref());
            let refused = contested
                .filter(|contested| contested.is_refused)
                .map(|contested| &*contested.id);
            let lifts = hold.lifts.iter().map(String::as_str);
            lifts.chain(aside).chain(refused)
        });
        ids.map(str::to_owned).collect()
    }

    /// Both sides have changed one thing: theirs has come, ours waits to be told or stands only here.
    pub(super) fn resolve_conflict(&mut self, theirs: Published, put: &mut Vec<Arc<str>>) {
        let (kind, id) = (theirs.kind, theirs.id.clone());
        let other = namesake(kind);
        let (own_kind, waiting) = match self.waiting_for(kind, &id) {
            none if none.is_empty() && self.has(other, &id) => {
                (other, self.waiting_for(other, &id))
            }
            waiting => (kind, waiting),
        };
        let removal = waiting.last();
        let removal = removal.filter(|last| last.operation == ChangeOperation::Delete);
        let is_removal = removal.is_some();
        let ours = self.standing_body(own_kind, &id);
        let standing = self.closure_of(own_kind, &id);
        let (Some(ours), Some(standing), false) = (ours, standing, is_removal) else {
            self.withdraw(own_kind, &id);
            put.push(id.clone());
            self.take_over(theirs);
            // What has ended here by itself gives way to what is closed there since.
            if removal.is_some_and(|removal| !removal.is_end()) {
                self.hold_change(own_kind, &id, None, None);
            }
            return;
        };
        let closes = theirs.thing.closure().clone();
        self.withdraw(own_kind, &id);
        if own_kind == kind && standing.encloses(&closes, self.now) {
            // Stricter than theirs: it goes there in its place.
            self.set_upstream(kind, &id, Some(theirs.upstream));
            if !says_the_same(&ours, &theirs.body) {
                let change = (kind, id, Some(ours));
                self.forward(change, Some(theirs.upstream), Arc::from("operator"));
            }
            return;
        }
        let is_within = own_kind == kind && closes.encloses(&standing, self.now);
        let is_report = matches!(standing.cause, Cause::Report { .. });
        put.push(id.clone());
        if is_within && is_report {
            // A report never opens anything, so nothing of it is lost.
            self.take_over(theirs);
            return;
        }
        let aside = (!is_within).then(|| self.set_aside(own_kind, &id, &standing));
        if own_kind != kind {
            self.lift_here(own_kind, &id);
        }
        self.take_over(theirs);
        self.hold_change(own_kind, &id, Some(ours), aside.flatten());
    }

    /// The text that would be told of what stands here.
    fn standing_body(&self, kind: ObjectKind, id: &str) -> Option<Arc<str>> {
        match kind {
            ObjectKind::Zone => {
                let entry = self.next.zones.get(id)?;
                Some(zone_body(&entry.zone))
            }
            ObjectKind::Closure => {
                let entry = self.next.closures.get(id)?;
                let topology = self.next.topology();
                Some(closure_body(topology, entry))
            }
            ObjectKind::Network | ObjectKind::Weather => None,
        }
    }

    /// Keeps what stands here in force under an id of its own.
    fn set_aside(
        &mut self,
        kind: ObjectKind,
        id: &str,
        standing: &Arc<Closure>,
    ) -> Option<Arc<str>> {
        let version = self.write_number();
        let aside: Arc<str> = Arc::from(format!("held-{}-{version}", self.next.lineage));
        match kind {
            ObjectKind::Zone => {
                let zone = standing.zone()?;
                let mut feature = zone_to_feature(zone);
                feature["id"] = json!(&*aside);
                let frame = self.next.topology().frame();
                let margin_m = self.settings.margin_m;
                let zone = read_zone(feature, ZoneId::Fixed(&aside), frame, margin_m).ok()?;
                let closure = Closure {
                    id: aside.to_string(),
                    cause: Cause::Zone(Arc::new(zone)),
                    ..(**standing).clone()
                };
                self.place_zone(&Arc::new(closure), version, None);
            }
            ObjectKind::Closure => {
                let entry = self.next.closures.get(id).cloned()?;
                let closure = Closure {
                    id: aside.to_string(),
                    ..(**standing).clone()
                };
                self.keep_closure(ClosureEntry {
                    closure: Arc::new(closure),
                    version,
                    upstream: None,
                    ..(*entry).clone()
                });
            }
            ObjectKind::Network | ObjectKind::Weather => return None,
        }
        Some(aside)
    }

    fn hold_change(
        &mut self,
        kind: ObjectKind,
        id: &str,
        body: Option<Arc<str>>,
        aside: Option<Arc<str>>,
    ) {
        let contested = Contested {
            kind,
            id: Arc::from(id),
            body,
            aside,
            is_refused: false,
            removes: None,
        };
        self.add_review("registry", Vec::new(), Some(contested));
    }

    /// Holds a change that the registry will not take: to release tries again, to reject leaves it to this edge.
    pub(super) fn hold_refused(&mut self, entry: &OutboxEntry) {
        self.end_refused(entry.kind, &entry.id);
        let is_removal = entry.operation == ChangeOperation::Delete;
        let contested = Contested {
            kind: entry.kind,
            id: entry.id.clone(),
            body: entry.body.clone(),
            aside: None,
            is_refused: true,
            removes: entry.expected.filter(|_| is_removal),
        };
        self.add_review("registry", Vec::new(), Some(contested));
    }

    /// What was changed since is not to be written over by what the registry did not take before.
    pub(super) fn end_refused(&mut self, kind: ObjectKind, id: &str) {
        let holds = self.next.holds.values();
        let is_of_it = |contested: &Contested| {
            contested.is_refused && contested.kind == kind && &*contested.id == id
        };
        let overtaken = holds.filter(|hold| hold.contested.as_deref().is_some_and(is_of_it));
        let overtaken: Vec<u64> = overtaken.map(|hold| hold.number).collect();
        for number in overtaken {
            self.end_hold(number, "overtaken");
        }
    }

    pub(super) fn decide_hold(&mut self, number: u64, decision: Decision) -> Result<Done, Refusal> {
        // What is decided is not overtaken by what it leads to.
        let Some(hold) = self.next.holds.remove(&number) else {
            let id = views::hold_id(self.next.lineage, number);
            return Err(Refusal::not_found("hold", &id));
        };
        match (&hold.contested, decision) {
            (None, _) if feed_of(&hold.origin).is_some() => {
                if decision == Decision::Accept {
                    self.lift_absent(&hold);
                }
            }
            (None, Decision::Accept) => {
                for id in self.left_of(&hold.lifts) {
                    self.lift_here(ObjectKind::Zone, &id);
                    self.lift_here(ObjectKind::Closure, &id);
                }
            }
            (None, Decision::Reject) => self.tell_again(&self.left_of(&hold.lifts)),
            (Some(contested), Decision::Accept) => {
                if let Err(refusal) = self.write_ours(contested) {
                    self.next.holds.insert(number, hold);
                    return Err(refusal);
                }
            }
            (Some(contested), Decision::Reject) => self.lift_aside(contested),
        }
        let decision = match decision {
            Decision::Accept => "released",
            Decision::Reject => "rejected",
        };
        self.end_hold(number, decision);
        Ok(Done::Hold(hold))
    }

    /// Of things whose removal is held, those that nobody has put here anew since.
    fn left_of(&self, lifts: &[String]) -> Vec<String> {
        let is_anew = |id: &str| {
            [ObjectKind::Zone, ObjectKind::Closure]
                .into_iter()
                .any(|kind| {
                    self.upstream_of(kind, id).is_some() || !self.waiting_for(kind, id).is_empty()
                })
        };
        let left = lifts.iter().filter(|id| !is_anew(id));
        left.cloned().collect()
    }

    fn end_hold(&mut self, number: u64, decision: &str) {
        self.next.holds.remove(&number);
        let id = views::hold_id(self.next.lineage, number);
        let data = json!({"hold_id": id, "decision": decision});
        self.happen(EventKind::HoldDecided, data);
    }

    /// What is not to be removed after all is put at the registry anew.
    fn tell_again(&mut self, ids: &[String]) {
        for id in ids {
            let kind = match self.has(ObjectKind::Zone, id) {
                true => ObjectKind::Zone,
                false => ObjectKind::Closure,
            };
            self.introduce(kind, id);
        }
    }

    fn lift_aside(&mut self, contested: &Contested) {
        if let Some(aside) = &contested.aside {
            self.lift_here(contested.kind, aside);
        }
    }

    /// Writes ours in place of what the registry has.
    fn write_ours(&mut self, contested: &Contested) -> Result<(), Refusal> {
        let Contested { kind, id, body, .. } = contested;
        let upstream = self.upstream_of(*kind, id);
        let Some(body) = body else {
            self.lift_aside(contested);
            self.lift_here(*kind, id);
            self.forward_removal(*kind, id, upstream.or(contested.removes));
            return Ok(());
        };
        let other = namesake(*kind);
        if self.has(other, id) {
            let other = other.name();
            let detail = format!("a {other} has the id '{id}' now; lift it first");
            return Err(Refusal::new(Code::AlreadyExists, detail));
        }
        let margin_m = self.settings.margin_m;
        let read = read_thing(*kind, id, body, self.next.topology(), margin_m);
        let thing = read.map_err(|fault| {
            let code = match kind {
                ObjectKind::Zone => Code::ZoneInvalid,
                _ => Code::ClosureInvalid,
            };
            Refusal::new(code, fault.reason)
        })?;
        self.lift_aside(contested);
        let version = self.write_number();
        match thing {
            Restriction::Zone(closure) => {
                self.place_zone(&closure, version, upstream);
                self.introduce(ObjectKind::Zone, id);
            }
            Restriction::Closure(entry) => {
                let entry = self.keep_closure(ClosureEntry {
                    version,
                    upstream,
                    ..*entry
                });
                self.forward_closure(&entry);
            }
        }
        Ok(())
    }
}
