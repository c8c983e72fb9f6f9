//! Orders about zones, closures, proposals and holds.

use super::timers::Due;
use super::{State, check_expected};
use crate::entries::{ClosureEntry, ProposalEntry, ProposedBy, Reported, windows};
use crate::snapshot::Snapshot;
use crate::views;
use crate::words::weather_etag;
use crate::writer::commands::{Decision, Done, Publication};
use imbl::OrdMap;
use jiff::Timestamp;
use serde_json::{Value, json};
use skyway_contract::{EventKind, ObjectKind};
use skyway_engine::airspace::{Cause, Change, Closure, Window};
use skyway_service::intake::Expected;
use skyway_service::refusal::{Code, Refusal};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

/// At most this many proposals wait; the oldest go first.
const PROPOSALS_MAX: usize = 1_000;
/// And about so many bytes of them, in all and of the reports of one subject.
const PROPOSAL_BYTES_MAX: usize = 16 * 1024 * 1024;
const PROPOSAL_BYTES_PER_SUBJECT: usize = 4 * 1024 * 1024;

impl State {
    pub(super) fn put_zone(
        &mut self,
        closure: Arc<Closure>,
        expected: &Expected,
    ) -> Result<Done, Refusal> {
        let id: Arc<str> = Arc::from(closure.id.as_str());
        let standing = self.next.zones.get(&id);
        let current = standing.map(|entry| entry.version);
        let upstream = standing.and_then(|entry| entry.upstream);
        check_expected(expected, current, self.next.lineage, "zone", &id)?;
        if current.is_none() {
            check_new_zone(&self.next, self.settings.zones_max, &id)?;
        }
        let version = self.write_number();
        self.place_zone(&closure, version, upstream);
        let Some(entry) = self.next.zones.get(&id).cloned() else {
            return Err(Refusal::new(Code::Internal, "a zone without its shape"));
        };
        self.forward_zone(&entry);
        let created = current.is_none();
        Ok(Done::Zone { entry, created })
    }

    pub(super) fn delete_zone(&mut self, id: &str, expected: &Expected) -> Result<Done, Refusal> {
        let Some(entry) = self.next.zones.get(id).cloned() else {
            return Err(Refusal::not_found("zone", id));
        };
        check_expected(expected, Some(entry.version), self.next.lineage, "zone", id)?;
        self.drop_zone(id);
        self.forward_removal(ObjectKind::Zone, id, entry.upstream);
        Ok(Done::ZoneDeleted(entry))
    }

    pub(super) fn drop_zone(&mut self, id: &str) {
        self.next.zones.remove(id);
        self.changes.push(Change::Lift(id.to_owned()));
        self.happen(EventKind::ZoneDeleted, json!({"zone_id": id}));
    }

    pub(super) fn put_weather(
        &mut self,
        text: Arc<str>,
        expected: &Expected,
    ) -> Result<Done, Refusal> {
        let current = self.next.weather.as_deref().map(weather_etag);
        expected.check(current.as_deref(), "weather", "network")?;
        self.state_weather(text);
        self.next.has_own_weather = true;
        Ok(Done::Nothing)
    }

    /// Takes the weather over, unless it is the one that is known.
    pub(super) fn state_weather(&mut self, text: Arc<str>) {
        if self.next.weather.as_ref() == Some(&text) {
            return;
        }
        let weather: Value = serde_json::from_str(&text).unwrap_or_default();
        self.happen(EventKind::WeatherPut, weather);
        self.next.weather = Some(text);
        self.weather_turned = true;
    }

    /// The registry has no weather any more: what came from there is gone.
    pub(super) fn forget_weather(&mut self) {
        if !self.next.has_own_weather && self.next.weather.take().is_some() {
            self.happen(EventKind::WeatherPut, json!({"wind": []}));
            self.weather_turned = true;
        }
    }

    pub(super) fn put_closure(&mut self, mut entry: ClosureEntry) -> Result<Done, Refusal> {
        let id: Arc<str> = Arc::from(entry.closure.id.as_str());
        check_new_id(&self.next, "closure", &id)?;
        if self.next.closures.len() >= self.settings.closures_max {
            let detail = format!(
                "there are {} closures, as many as this edge holds",
                self.settings.closures_max
            );
            return Err(Refusal::new(Code::LimitReached, detail));
        }
        entry.version = self.write_number();
        Ok(Done::Closure(self.keep_own(entry)))
    }

    /// Puts a closure made here, which the registry is to be told of.
    fn keep_own(&mut self, mut entry: ClosureEntry) -> Arc<ClosureEntry> {
        let ended = self.ended.take(&entry.closure.id);
        if entry.reported_by.is_none() || entry.by.is_none() {
            // What a drone reported counts for it as long as it lasts.
            entry.by.clone_from(&self.author);
        }
        entry.upstream = entry.upstream.or(ended);
        let entry = self.keep_closure(entry);
        self.forward_closure(&entry);
        entry
    }

    pub(super) fn keep_closure(&mut self, entry: ClosureEntry) -> Arc<ClosureEntry> {
        let id: Arc<str> = Arc::from(entry.closure.id.as_str());
        if let Some(until) = entry.until {
            self.timers.set(just_after(until), Due::Closure(id.clone()));
        }
        self.changes.push(Change::Put(entry.closure.clone()));
        let entry = Arc::new(entry);
        let before = self.next.closures.insert(id, entry.clone());
        self.count_reported(before.as_deref(), Some(&entry));
        let data = json!({"closure": views::closure(&self.next, &entry, self.now)});
        self.happen(EventKind::ClosurePut, data);
        entry
    }

    /// Keeps count of what reports close, in all, by drone, and by the subject of a token.
    pub(super) fn count_reported(
        &mut self,
        before: Option<&ClosureEntry>,
        after: Option<&ClosureEntry>,
    ) {
        let next = &mut self.next;
        if let Some(entry) = after {
            next.reported = next.reported.plus(entry.reported());
            raise(&mut next.alive_reports, entry.reported_by.as_deref());
            raise(&mut next.alive_by_subject, entry.fleet());
        }
        if let Some(entry) = before {
            next.reported = next.reported.minus(entry.reported());
            lower(&mut next.alive_reports, entry.reported_by.as_deref());
            lower(&mut next.alive_by_subject, entry.fleet());
        }
    }

    pub(super) fn change_closure(
        &mut self,
        id: &str,
        confirmed: Option<bool>,
        until: Option<Timestamp>,
        expected: &Expected,
        now: Timestamp,
    ) -> Result<Done, Refusal> {
        let entry = self.closure_to_change(id, expected)?;
        let mut changed = (*entry).clone();
        changed.confirmed = confirmed.unwrap_or(changed.confirmed);
        if let Some(until) = until {
            let from = changed.from.unwrap_or(Timestamp::MIN);
            if until <= now || until <= from {
                let detail = format!(
                    "the closure would end at {until}, which is over; lift it with DELETE instead"
                );
                return Err(Refusal::new(Code::ClosureInvalid, detail));
            }
            changed = with_end(changed, Some(until));
        }
        changed.version = self.write_number();
        Ok(Done::Closure(self.keep_own(changed)))
    }

    pub(super) fn lift_closure(&mut self, id: &str, expected: &Expected) -> Result<Done, Refusal> {
        let entry = self.closure_to_change(id, expected)?;
        self.drop_closure(&entry, "lifted");
        self.forward_removal(ObjectKind::Closure, id, entry.upstream);
        Ok(Done::ClosureLifted(entry))
    }

    fn closure_to_change(
        &self,
        id: &str,
        expected: &Expected,
    ) -> Result<Arc<ClosureEntry>, Refusal> {
        if self.next.zones.contains_key(id) {
            let detail = format!(
                "the closure '{id}' is caused by the zone '{id}': change or delete the zone"
            );
            return Err(Refusal::new(Code::ClosureOfZone, detail));
        }
        let Some(entry) = self.next.closures.get(id).cloned() else {
            return Err(Refusal::not_found("closure", id));
        };
        check_expected(
            expected,
            Some(entry.version),
            self.next.lineage,
            "closure",
            id,
        )?;
        Ok(entry)
    }

    pub(super) fn drop_closure(&mut self, entry: &ClosureEntry, why: &str) {
        let id = &entry.closure.id;
        self.next.closures.remove(id.as_str());
        self.count_reported(Some(entry), None);
        self.changes.push(Change::Lift(id.clone()));
        let data = json!({"closure_id": id, "why": why});
        self.happen(EventKind::ClosureEnded, data);
    }

    /// A closure's life is over, unless it was renewed since.
    pub(super) fn end_closure(&mut self, id: &str, now: Timestamp) {
        let entry = self.next.closures.get(id).cloned();
        if let Some(entry) = entry.filter(|entry| entry.until.is_some_and(|until| until < now)) {
            self.drop_closure(&entry, "over");
            self.forward_end(id);
            if self.waiting_for(ObjectKind::Closure, id).is_empty() {
                self.ended.note(id, entry.upstream);
            }
        }
    }

    /// Closes for everyone what a report closes; a second report of the same thing renews it.
    pub(super) fn publish_report(&mut self, publication: Publication) -> Done {
        let Publication {
            mut entry,
            otherwise,
        } = publication;
        let known = self.next.closures.get(entry.closure.id.as_str()).cloned();
        if let Some(known) = known {
            let until = known.until.max(entry.until);
            let renewed = match known.until {
                // An operator made it last without end.
                None => (*known).clone(),
                Some(_) => with_end((*known).clone(), until),
            };
            let version = self.write_number();
            return Done::Closure(self.keep_own(ClosureEntry { version, ..renewed }));
        }
        match self.exceeded_quota(&entry) {
            Some(reason) => self.propose(ProposalEntry {
                reason: Cow::Borrowed(reason),
                ..otherwise
            }),
            None => {
                entry.version = self.write_number();
                Done::Closure(self.keep_own(entry))
            }
        }
    }

    fn exceeded_quota(&self, entry: &ClosureEntry) -> Option<&'static str> {
        let drone = entry.reported_by.as_deref().unwrap_or_default();
        let more = Reported::of(&entry.closure);
        let reporter = (drone, entry.fleet());
        self.next.exceeded_quota(&self.settings, reporter, more)
    }

    pub(super) fn propose(&mut self, proposal: ProposalEntry) -> Done {
        let due = Due::Proposal(proposal.number);
        self.timers.set(just_after(proposal.expires_at), due);
        let proposal = Arc::new(proposal);
        self.next
            .proposals
            .insert(proposal.number, proposal.clone());
        let data = json!({"proposal": views::proposal(&self.next, &proposal)});
        self.happen(EventKind::ProposalMade, data);
        self.bound_proposals(&proposal.subject);
        Done::Proposal(proposal)
    }

    /// Too many proposals, or too large ones, go, the oldest first: those of who has just made one,
    /// and else those of who has the most of them.
    fn bound_proposals(&mut self, subject: &Arc<str>) {
        while bytes_of(&self.next, Some(subject)) > PROPOSAL_BYTES_PER_SUBJECT {
            self.crowd_out(subject);
        }
        let is_too_much = |next: &Snapshot| {
            next.proposals.len() > PROPOSALS_MAX || bytes_of(next, None) > PROPOSAL_BYTES_MAX
        };
        while is_too_much(&self.next) {
            let proposals = self.next.proposals.values();
            let subjects: BTreeSet<Arc<str>> = proposals.map(|it| it.subject.clone()).collect();
            let bytes = |subject: &Arc<str>| bytes_of(&self.next, Some(subject));
            let Some(most) = subjects.into_iter().max_by_key(bytes) else {
                return;
            };
            self.crowd_out(&most);
        }
    }

    fn crowd_out(&mut self, subject: &Arc<str>) {
        let proposals = self.next.proposals.iter();
        let mut own = proposals.filter(|(_, proposal)| proposal.subject == *subject);
        if let Some(oldest) = own.next().map(|(number, _)| *number) {
            self.drop_proposal(oldest, "crowded_out");
        }
    }

    pub(super) fn drop_proposal(&mut self, number: u64, decision: &str) {
        self.next.proposals.remove(&number);
        let data = json!({"proposal_id": views::proposal_id(self.next.lineage, number), "decision": decision});
        self.happen(EventKind::ProposalDecided, data);
    }

    pub(super) fn expire_proposal(&mut self, number: u64, now: Timestamp) {
        let proposal = self.next.proposals.get(&number);
        if proposal.is_some_and(|proposal| proposal.expires_at < now) {
            self.drop_proposal(number, "expired");
        }
    }

    pub(super) fn decide_proposal(
        &mut self,
        number: u64,
        decision: Decision,
    ) -> Result<Done, Refusal> {
        let Some(proposal) = self.next.proposals.get(&number).cloned() else {
            let id = views::proposal_id(self.next.lineage, number);
            return Err(Refusal::not_found("proposal", &id));
        };
        if decision == Decision::Reject {
            self.drop_proposal(number, "rejected");
            return Ok(Done::Proposal(proposal));
        }
        match &proposal.closure.cause {
            Cause::Zone(_) => {
                self.put_zone(proposal.closure.clone(), &Expected::Absent)?;
            }
            Cause::Report { .. } | Cause::Operator { .. } => {
                let entry = confirmed_closure(&proposal);
                let standing = self.next.closures.get(entry.closure.id.as_str());
                match standing.cloned() {
                    Some(standing) => {
                        // It opens nothing that is closed for longer by now.
                        let until = standing.until.zip(entry.until);
                        let until = until.map(|(one, other)| one.max(other));
                        let version = self.write_number();
                        self.keep_own(ClosureEntry {
                            version,
                            upstream: standing.upstream,
                            ..with_end(entry, until)
                        });
                    }
                    None => {
                        self.put_closure(entry)?;
                    }
                }
            }
        }
        self.drop_proposal(number, "accepted");
        Ok(Done::Proposal(proposal))
    }
}

/// Whether there may be a new zone of this id, by the ids there are and by how many zones there are.
pub(crate) fn check_new_zone(next: &Snapshot, zones_max: usize, id: &str) -> Result<(), Refusal> {
    check_new_id(next, "zone", id)?;
    if next.zones.len() >= zones_max {
        let detail = format!("there are {zones_max} zones, as many as this edge holds");
        return Err(Refusal::new(Code::LimitReached, detail));
    }
    Ok(())
}

/// Zones and closures share one space of ids: both close things under theirs.
fn check_new_id(next: &Snapshot, what: &str, id: &str) -> Result<(), Refusal> {
    let other = match (next.zones.get(id), next.closures.get(id)) {
        (Some(zone), _) => Some(("zone", zone.version)),
        (_, Some(closure)) => Some(("closure", closure.version)),
        (None, None) => None,
    };
    match other {
        None => Ok(()),
        Some((kind, version)) => {
            let detail = format!("a {kind} has the id '{id}' already; give the {what} another one");
            Err(Refusal::new(Code::AlreadyExists, detail).with_etag(next.etag(version)))
        }
    }
}

fn raise(counts: &mut OrdMap<Arc<str>, usize>, key: Option<&str>) {
    if let Some(key) = key {
        *counts.entry(Arc::from(key)).or_default() += 1;
    }
}

fn lower(counts: &mut OrdMap<Arc<str>, usize>, key: Option<&str>) {
    let Some(key) = key else {
        return;
    };
    match counts.get(key).copied().unwrap_or_default() {
        0 | 1 => counts.remove(key),
        more => counts.insert(Arc::from(key), more - 1),
    };
}

/// What accepting a proposal closes: until the proposal itself would have ended, and confirmed.
fn confirmed_closure(proposal: &ProposalEntry) -> ClosureEntry {
    let window = proposal.closure.windows.first();
    ClosureEntry {
        closure: proposal.closure.clone(),
        version: 0,
        failure: match proposal.by {
            ProposedBy::Report { failure, .. } => Some(failure),
            ProposedBy::Feed { .. } => None,
        },
        reported_by: None,
        by: None,
        confirmed: true,
        from: window.and_then(Window::from),
        until: window.and_then(Window::until),
        upstream: None,
    }
}

/// A closure that ends at another time.
fn with_end(entry: ClosureEntry, until: Option<Timestamp>) -> ClosureEntry {
    let mut closure = (*entry.closure).clone();
    closure.windows = windows(entry.from, until);
    ClosureEntry {
        closure: Arc::new(closure),
        until,
        ..entry
    }
}

/// The first instant at which something that ends then, end included, is over.
pub(super) fn just_after(instant: Timestamp) -> Timestamp {
    let nanosecond = jiff::SignedDuration::from_nanos(1);
    instant.checked_add(nanosecond).unwrap_or(Timestamp::MAX)
}

/// About how many bytes proposals take: of one subject, or all.
fn bytes_of(snapshot: &Snapshot, subject: Option<&Arc<str>>) -> usize {
    let proposals = snapshot.proposals.values();
    let counted = proposals.filter(|it| subject.is_none_or(|subject| it.subject == *subject));
    counted.map(|proposal| proposal.bytes).sum()
}
