//! What a drone's report closes for everyone: little, a few at a time, and each ending by itself.
//!
//! A drone is not an operator. It publishes its own leg, or the pads that it comes to, when the edge can tell that it is
//! there; everything else it brings is answered, binds its own request, and is proposed to operators.

use super::ReplyMode;
use super::records::{AnswerRecord, Published};
use super::reporter::author;
use crate::entries::{ClosureEntry, ProposalEntry, ProposedBy, Reported, windows};
use crate::plans::entry::PlanEntry;
use crate::snapshot::Snapshot;
use crate::writer::commands::{Command, Publication};
use crate::{Edge, views};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::PublicationState;
use skyway_engine::airspace::{Cause, Closure, Hits};
use skyway_engine::flight::FailureType;
use skyway_engine::network::{NodeIx, SegmentIx};
use skyway_engine::recompose::Request;
use skyway_service::access::{Caller, Role};
use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// How near its leg a drone's telemetry has to place it, in metres.
const PLACED_WITHIN_M: f64 = 50.0;
/// How old that telemetry may be.
const PLACED_SINCE: SignedDuration = SignedDuration::from_secs(60);

/// What a report of a type closes.
#[derive(Clone, Copy, Debug)]
enum ReportClosure {
    Segment(SegmentIx),
    Pads(NodeIx),
}

impl Edge {
    /// Decides what becomes of what a report closes, and hands it to the writer.
    pub(crate) fn publish(
        &self,
        snapshot: &Snapshot,
        caller: &Caller,
        record: &AnswerRecord,
        plan: Option<&Arc<PlanEntry>>,
        mode: ReplyMode,
    ) -> Published {
        match mode {
            ReplyMode::First => {}
            ReplyMode::Again => return Published::nothing("sent_before"),
            ReplyMode::Suppressed => return Published::nothing("id_reused"),
        }
        let mut proposal_ids = Vec::new();
        if let Some(brought) = &record.settled.request.zone {
            let closure = Closure {
                id: brought.zone.id().to_owned(),
                windows: brought.zone.windows().to_vec(),
                hits: brought.hits.clone(),
                pads: Vec::new(),
                cause: Cause::Zone(brought.zone.clone()),
            };
            proposal_ids.extend(self.propose(caller, record, "zone_from_report", closure));
        }
        let Some((thing, life)) = self.closes(snapshot, &record.settled.request) else {
            return Published {
                proposal_ids,
                ..Published::nothing("closes_nothing")
            };
        };
        let closure = closure_of(snapshot, record, thing, life);
        let doubt = self.doubt(snapshot, caller, record, plan, thing);
        if let Some(reason) = doubt {
            proposal_ids.extend(self.propose(caller, record, reason, closure));
            return Published {
                state: PublicationState::Proposed,
                closure_id: None,
                proposal_ids,
                reason: Some(reason),
            };
        }
        self.order_publication(record, caller, closure, proposal_ids)
    }

    fn closes(
        &self,
        snapshot: &Snapshot,
        request: &Request,
    ) -> Option<(ReportClosure, SignedDuration)> {
        let report = &request.report;
        let life = self.settings.lives.of(report.failure)?;
        let (from, to) = report.leg;
        let thing = match report.failure {
            FailureType::Infrastructure => {
                let failed = request.failed_pads()?;
                let pads = snapshot.topology().pads(failed.node);
                // What is left of a node's pads cannot be told to others: only all of them close.
                let are_all = failed.count.is_none_or(|count| count >= pads);
                are_all.then_some(ReportClosure::Pads(failed.node))?
            }
            FailureType::Environmental
            | FailureType::Navigational
            | FailureType::Regulatory
            | FailureType::Operational
            | FailureType::ServiceLevel => {
                ReportClosure::Segment(snapshot.topology().segment_between(from, to)?)
            }
        };
        Some((thing, life))
    }

    /// Why a report is not published as it is; `None` when it is.
    fn doubt(
        &self,
        snapshot: &Snapshot,
        caller: &Caller,
        record: &AnswerRecord,
        plan: Option<&Arc<PlanEntry>>,
        thing: ReportClosure,
    ) -> Option<&'static str> {
        if record.settled.doubts {
            return Some("doubtful");
        }
        let Some(drone) = record
            .drone_id
            .as_deref()
            .filter(|drone| caller.speaks_for(drone))
        else {
            return Some("anonymous");
        };
        let report = &record.settled.request.report;
        let own = plan.filter(|plan| plan.drone_id.as_deref() == Some(drone));
        let on_plan = own.is_some_and(|plan| flies(plan, report.leg));
        if !on_plan && !self.is_placed_on(snapshot, drone, report.leg, record.answered_at) {
            return Some("not_placed_there");
        }
        if let ReportClosure::Pads(node) = thing
            && node != report.leg.1
            && !own.is_some_and(|plan| comes_to(plan, report.leg, node))
        {
            // Of pads elsewhere it can have seen nothing.
            return Some("not_placed_there");
        }
        let (id, segments, pads) = match thing {
            ReportClosure::Segment(segment) => (segment_closure_id(snapshot, segment), 1, 0),
            ReportClosure::Pads(node) => (pads_closure_id(snapshot, node), 0, 1),
        };
        // What is closed already is renewed, which closes nothing more.
        match snapshot.closures.contains_key(id.as_str()) {
            true => None,
            false => {
                let subject = (caller.role == Role::Drone).then_some(&*caller.subject);
                let more = Reported { segments, pads };
                snapshot.exceeded_quota(&self.settings, (drone, subject), more)
            }
        }
    }

    fn is_placed_on(
        &self,
        snapshot: &Snapshot,
        drone: &str,
        leg: (NodeIx, NodeIx),
        now: Timestamp,
    ) -> bool {
        let Some(sighting) = self.drones.last(drone) else {
            return false;
        };
        let topology = snapshot.topology();
        let (from, to) = (topology.position(leg.0), topology.position(leg.1));
        let age = now.duration_since(sighting.seen_at);
        age <= PLACED_SINCE
            && sighting
                .position(topology.frame())
                .distance_to_line_m(from, to)
                <= PLACED_WITHIN_M
    }

    fn order_publication(
        &self,
        record: &AnswerRecord,
        caller: &Caller,
        closure: Closure,
        proposal_ids: Vec<String>,
    ) -> Published {
        let window = closure.windows.first();
        let (from, until) = (
            window.and_then(|window| window.from()),
            window.and_then(|window| window.until()),
        );
        let closure = Arc::new(closure);
        let otherwise = self.proposal(record, "quota", closure.clone());
        let closure_id = closure.id.clone();
        let entry = ClosureEntry {
            closure,
            version: 0,
            failure: Some(record.settled.request.report.failure),
            reported_by: record.drone_id.clone(),
            by: Some(author(caller)),
            confirmed: false,
            from,
            until,
            upstream: None,
        };
        let publication = Box::new(Publication { entry, otherwise });
        let command = Command::Publish(publication).made_on(record.airspace.topology());
        let command = command.by(caller);
        match self.writer.tell(command) {
            Ok(()) => Published {
                state: PublicationState::Published,
                closure_id: Some(closure_id),
                proposal_ids,
                reason: None,
            },
            Err(refusal) => {
                tracing::warn!(%refusal, "a report could not be published");
                Published {
                    proposal_ids,
                    ..Published::nothing("overloaded")
                }
            }
        }
    }

    /// Proposes something to operators; gives the id of the proposal.
    fn propose(
        &self,
        caller: &Caller,
        record: &AnswerRecord,
        reason: &'static str,
        closure: Closure,
    ) -> Option<String> {
        let proposal = self.proposal(record, reason, Arc::new(closure));
        let id = views::proposal_id(self.lineage, proposal.number);
        let command = Command::Propose(Box::new(proposal));
        let command = command.made_on(record.airspace.topology()).by(caller);
        match self.writer.tell(command) {
            Ok(()) => Some(id),
            Err(refusal) => {
                tracing::warn!(%refusal, "a report could not be proposed to operators");
                None
            }
        }
    }

    fn proposal(
        &self,
        record: &AnswerRecord,
        reason: &'static str,
        closure: Arc<Closure>,
    ) -> ProposalEntry {
        let failure = record.settled.request.report.failure;
        let life = self
            .settings
            .lives
            .of(failure)
            .unwrap_or(self.settings.lives.regulatory);
        ProposalEntry {
            number: self.next_number.fetch_add(1, Ordering::Relaxed),
            reason: Cow::Borrowed(reason),
            proposed_at: record.answered_at,
            expires_at: record
                .answered_at
                .checked_add(life)
                .unwrap_or(Timestamp::MAX),
            by: ProposedBy::Report {
                recomposition_id: Arc::from(record.id()),
                drone_id: record.drone_id.clone(),
                failure,
            },
            subject: record.subject.clone(),
            // A zone that it brings is in the report.
            bytes: size_of::<ProposalEntry>() + record.report_bytes + hits_bytes(&closure),
            closure,
        }
    }
}

fn flies(plan: &PlanEntry, (from, to): (NodeIx, NodeIx)) -> bool {
    let mut legs = plan
        .versions()
        .flat_map(|version| &version.composition.legs);
    legs.any(|leg| (leg.from, leg.to) == (from, to))
}

/// Whether a version of a plan leads from a leg on to a node, or stops there.
fn comes_to(plan: &PlanEntry, (from, to): (NodeIx, NodeIx), node: NodeIx) -> bool {
    plan.versions().any(|version| {
        let legs = &version.composition.legs;
        let on = legs.iter().position(|leg| (leg.from, leg.to) == (from, to));
        let ahead = on.map_or(&legs[..0], |on| &legs[on..]);
        let mut stops = version.flight.iter().flat_map(|flight| flight.stop_nodes());
        ahead.iter().any(|leg| leg.to == node) || stops.any(|stop| stop == node)
    })
}

fn segment_closure_id(snapshot: &Snapshot, segment: SegmentIx) -> String {
    format!("report:{}", snapshot.topology().segment_id(segment))
}

fn pads_closure_id(snapshot: &Snapshot, node: NodeIx) -> String {
    format!("pads:{}", snapshot.topology().node_id(node))
}

fn closure_of(
    snapshot: &Snapshot,
    record: &AnswerRecord,
    thing: ReportClosure,
    life: SignedDuration,
) -> Closure {
    let (id, hits, pads) = match thing {
        ReportClosure::Segment(segment) => {
            let hits = Hits::new(vec![segment], Vec::new());
            (segment_closure_id(snapshot, segment), hits, Vec::new())
        }
        ReportClosure::Pads(node) => (pads_closure_id(snapshot, node), Hits::default(), vec![node]),
    };
    let until = record.answered_at.checked_add(life).ok();
    Closure {
        id,
        cause: Cause::Report {
            report: record.id(),
        },
        windows: windows(Some(record.answered_at), until),
        hits,
        pads,
    }
}

/// About how much what a closure closes takes, in bytes.
pub(crate) fn hits_bytes(closure: &Closure) -> usize {
    let hits = &closure.hits;
    size_of::<Closure>()
        + size_of::<SegmentIx>() * hits.segments.len()
        + size_of::<NodeIx>() * (hits.nodes.len() + closure.pads.len())
}
