//! Closures: everything that is closed with its cause, and what operators close by their word.

use super::{checked_reason, effects};
use crate::entries::{ClosureEntry, windows};
use crate::plans::fleet::Detour;
use crate::replies::Idempotency;
use crate::snapshot::Snapshot;
use crate::writer::commands::{Command, Done, unexpected};
use crate::{Edge, views};
use jiff::Timestamp;
use skyway_contract as wire;
use skyway_engine::airspace::{Cause, Closure};
use skyway_engine::network::Topology;
use skyway_service::access::Caller;
use skyway_service::intake::{ClosureIds, Expected, Faults, PageRequest, read_closure, token};
use skyway_service::refusal::{Code, Refusal};
use std::ops::Bound;
use std::sync::Arc;
use std::sync::atomic::Ordering;

impl Edge {
    /// A page of everything that closes anything, by id: zones too.
    ///
    /// # Errors
    /// When the page is not one.
    pub fn closures(
        &self,
        caller: &Caller,
        page: &PageRequest,
    ) -> Result<wire::Closures<'static>, Refusal> {
        let page = page.check()?;
        let snapshot = self.snapshot();
        let from = page
            .after
            .as_deref()
            .map_or(Bound::Unbounded, Bound::Excluded);
        let now = self.clock.now();
        let mut held = snapshot.airspace.closures_from(from);
        let told: Vec<wire::Closure<'static>> = held
            .by_ref()
            .filter_map(|closure| closure_view(&snapshot, closure, now))
            .map(|closure| as_told(closure, caller))
            .take(page.size)
            .collect();
        let has_more = held.next().is_some();
        let next = told.last().filter(|_| has_more).map(|last| token(&last.id));
        Ok(wire::Closures {
            closures: told,
            next_page_token: next,
            stamp: self.stamp_of(&snapshot),
        })
    }

    /// One closure.
    ///
    /// # Errors
    /// When there is none.
    pub fn closure(&self, caller: &Caller, id: &str) -> Result<wire::Closure<'static>, Refusal> {
        let snapshot = self.snapshot();
        let (held, now) = (snapshot.airspace.closure(id), self.clock.now());
        held.and_then(|closure| closure_view(&snapshot, closure, now))
            .map(|closure| as_told(closure, caller))
            .ok_or_else(|| Refusal::not_found("closure", id))
    }

    /// Closes segments, nodes or pads by an operator's word.
    ///
    /// # Errors
    /// When the draft is not valid, or its id is taken.
    pub async fn close(
        self: &Arc<Self>,
        caller: &Caller,
        draft: wire::ClosureDraft,
        idempotency: Idempotency,
    ) -> Result<wire::Closure<'static>, Refusal> {
        let (edge, author) = (self.clone(), caller.clone());
        let close = async move {
            let on = edge.on_network()?;
            let entry = edge.read_closure(draft, on.topology())?;
            let command = Command::PutClosure(entry).made_on(on.topology());
            let (outcome, snapshot) = edge.command(command.by(&author)).await?;
            let Done::Closure(entry) = outcome.done else {
                return Err(unexpected());
            };
            Ok(told(&snapshot, &entry, (&outcome.detours, outcome.pending)))
        };
        let now = self.clock.now();
        self.write_replies
            .once(&caller.subject, "close", idempotency, now, close)
            .await
    }

    /// Confirms a closure or moves its end.
    ///
    /// # Errors
    /// When there is none, a zone causes it, `If-Match` is stale, or the new end is over.
    pub async fn change_closure(
        self: &Arc<Self>,
        caller: &Caller,
        id: &str,
        change: wire::ClosureChange,
        if_match: Option<String>,
    ) -> Result<wire::Closure<'static>, Refusal> {
        let mut faults = Faults::default();
        let until = faults.instant("/until", change.until.as_deref());
        if change.confirmed.is_none() && change.until.is_none() {
            let message = "nothing is to change".to_owned();
            faults.add(
                "change_empty",
                "",
                message,
                Some("give 'confirmed' or 'until'".to_owned()),
            );
        }
        faults.check(Code::ClosureInvalid, "change")?;
        let command = Command::ChangeClosure {
            id: id.to_owned(),
            confirmed: change.confirmed,
            until,
            expected: lenient(if_match),
        };
        let (outcome, snapshot) = self.command(command.by(caller)).await?;
        let Done::Closure(entry) = outcome.done else {
            return Err(unexpected());
        };
        Ok(told(&snapshot, &entry, (&outcome.detours, outcome.pending)))
    }

    /// Lifts a closure; what it closed alone opens again.
    ///
    /// # Errors
    /// When there is none, a zone causes it, or `If-Match` is stale.
    pub async fn lift_closure(
        self: &Arc<Self>,
        caller: &Caller,
        id: &str,
        if_match: Option<String>,
        reason: Option<String>,
    ) -> Result<wire::Closure<'static>, Refusal> {
        let reason = checked_reason(reason)?;
        let command = Command::LiftClosure {
            id: id.to_owned(),
            expected: lenient(if_match),
        };
        let (outcome, snapshot) = self.command(command.because(caller, reason)).await?;
        let Done::ClosureLifted(entry) = outcome.done else {
            return Err(unexpected());
        };
        let over = wire::Closure {
            in_force: false,
            closes_from: None,
            ..views::closure(&snapshot, &entry, self.clock.now())
        };
        Ok(over)
    }

    fn read_closure(
        &self,
        draft: wire::ClosureDraft,
        topology: &Topology,
    ) -> Result<ClosureEntry, Refusal> {
        let read = read_closure(&draft, topology, self.clock.now(), ClosureIds::OfOperators)?;
        let number = self.next_number.fetch_add(1, Ordering::Relaxed);
        let closure = Closure {
            id: draft
                .id
                .unwrap_or_else(|| format!("closure-{}-{number}", self.epoch)),
            cause: Cause::Operator {
                reason: draft.reason.unwrap_or_default(),
            },
            windows: windows(Some(read.from), read.until),
            hits: read.hits,
            pads: read.pads,
        };
        Ok(ClosureEntry {
            closure: Arc::new(closure),
            version: 0,
            failure: None,
            reported_by: None,
            by: None,
            confirmed: true,
            from: Some(read.from),
            until: read.until,
            upstream: None,
        })
    }
}

/// Closures may be changed without saying which version; one that is said has to be current.
fn lenient(if_match: Option<String>) -> Expected {
    match Expected::of(if_match) {
        Expected::Unstated => Expected::Anything,
        stated => stated,
    }
}

fn closure_view(
    snapshot: &Snapshot,
    closure: &Arc<Closure>,
    now: Timestamp,
) -> Option<wire::Closure<'static>> {
    let id = closure.id.as_str();
    if let Some(zone) = snapshot.zones.get(id) {
        return Some(views::closure_of_zone(snapshot, zone, closure, now));
    }
    let entry = snapshot.closures.get(id)?;
    Some(views::closure(snapshot, entry, now))
}

fn told(
    snapshot: &Snapshot,
    entry: &ClosureEntry,
    (detours, pending): (&[Detour], usize),
) -> wire::Closure<'static> {
    let closure = &entry.closure;
    let met: Vec<&Detour> = detours
        .iter()
        .filter(|detour| detour.plan.affected_by.contains(&closure.id))
        .collect();
    let now = snapshot.airspace.as_of();
    wire::Closure {
        effect: Some(effects::effect_with_pending(
            &snapshot.airspace,
            closure,
            (&met, pending),
        )),
        ..views::closure(snapshot, entry, now)
    }
}

/// A closure as a caller is told it: whose report made it, only those learn who may speak for that drone.
fn as_told(closure: wire::Closure<'static>, caller: &Caller) -> wire::Closure<'static> {
    let may_know = |who: &str| *who == *caller.subject || caller.speaks_for(who);
    wire::Closure {
        reported_by: closure.reported_by.filter(|who| may_know(who)),
        ..closure
    }
}
