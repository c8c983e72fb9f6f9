//! What was answered, kept for a while: enough to explain an answer from its id alone and to compute it again.

use crate::locks::lock;
use crate::planner::{Answer, Version};
use crate::snapshot::Snapshot;
use jiff::Timestamp;
use serde_json::Value;
use skyway_contract as wire;
use skyway_engine::airspace::Airspace;
use skyway_engine::checked::Case;
use skyway_formats::{ReadWarning, ResolvedReport};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// Answers keep the network that they were given on; those of earlier networks beyond this number
/// are let go, as each is large.
const NETWORKS_KEPT: u64 = 3;

/// What becomes of what a report closes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Published {
    pub(crate) state: wire::PublicationState,
    pub(crate) closure_id: Option<String>,
    pub(crate) proposal_ids: Vec<String>,
    pub(crate) reason: Option<&'static str>,
}

impl Published {
    /// It binds this answer alone.
    pub(crate) fn nothing(reason: &'static str) -> Self {
        Self {
            state: wire::PublicationState::None,
            closure_id: None,
            proposal_ids: Vec::new(),
            reason: Some(reason),
        }
    }
}

/// The plan that an answer would change, and what its drone would fly.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlanChange {
    pub(crate) plan: Arc<str>,
    /// The version to acknowledge; `None` where there is no path, or nothing changes.
    pub(crate) version: Option<Version>,
}

/// An answer, with all it was computed from.
#[derive(Clone, Debug)]
pub(crate) struct AnswerRecord {
    pub(crate) epoch: u64,
    pub(crate) number: u64,
    pub(crate) answered_at: Timestamp,
    /// Until when its drone may begin to follow it.
    pub(crate) valid_until: Timestamp,
    pub(crate) subject: Arc<str>,
    pub(crate) report: wire::FailureReport,
    /// About how many bytes that takes.
    pub(crate) report_bytes: usize,
    pub(crate) read: Vec<ReadWarning>,
    pub(crate) settled: ResolvedReport,
    pub(crate) answer: Answer,
    /// The answer that did not pass, where this one stands in for it.
    pub(crate) case: Option<Box<Case>>,
    /// The plans and the wind that it was computed among; `None` where they made no difference.
    pub(crate) among: Option<Arc<Snapshot>>,
    pub(crate) airspace: Arc<Airspace>,
    pub(crate) revision: Arc<str>,
    pub(crate) drone_id: Option<Arc<str>>,
    pub(crate) published: Published,
    pub(crate) plan: Option<PlanChange>,
    pub(crate) remaining_time_s: Option<f64>,
    pub(crate) dry_run: bool,
    /// Whether its edge plans by distance: it has no airframe.
    pub(crate) by_distance: bool,
}

impl AnswerRecord {
    /// The id by which it is asked for.
    pub(crate) fn id(&self) -> String {
        record_id(self.epoch, self.number)
    }

    /// What an answer in flight was computed from beside its report and the closures in force.
    pub(crate) fn flight_question(&self) -> Option<Value> {
        let flight = self.answer.flight()?;
        let among = self.among.as_ref()?;
        let scene = among.scene_in(&self.airspace, self.answered_at);
        Some(flight.question(scene, &self.settled.request))
    }

    /// About how many bytes it takes, its world not included.
    pub(crate) fn bytes(&self) -> usize {
        let told = self.answer.told();
        let path = told.path.nodes.len() + told.path.segments.len();
        let stages = told.stages.iter().map(|stage| stage.nodes.len());
        let stages: usize = stages.sum();
        let version = self.plan.as_ref().and_then(|plan| plan.version.as_ref());
        let legs = version.map_or(0, |version| version.composition.legs.len());
        let flown = self.answer.flown_legs();
        let plan = self.settled.request.report.remaining_path.as_ref();
        let plan = plan.map_or(0, Vec::len);
        let warnings: usize = self.read.iter().map(ReadWarning::bytes).sum();
        let sent = self.report_bytes + warnings + self.brought_bytes();
        size_of::<Self>() + 4 * (path + stages + plan) + 200 * legs + 600 * flown + sent + 500
    }

    /// About how many bytes a zone takes that the report brought, as it was understood: its shape, and what it covers.
    fn brought_bytes(&self) -> usize {
        let Some(brought) = &self.settled.request.zone else {
            return 0;
        };
        let covered = brought.hits.segments.len() + brought.hits.nodes.len();
        // Its vertices take no more than they did as JSON.
        self.report_bytes + 4 * covered
    }
}

/// The id of the record of a number.
pub(crate) fn record_id(epoch: u64, number: u64) -> String {
    // Every answer writes one: formatting takes several times as long.
    let (mut epoch_text, mut number_text) = (itoa::Buffer::new(), itoa::Buffer::new());
    [epoch_text.format(epoch), number_text.format(number)].join("-")
}

/// Answers, latest last; the oldest go first when a bound is reached.
#[derive(Debug)]
pub(crate) struct Records {
    epoch: u64,
    capacity: usize,
    capacity_bytes: usize,
    kept: Mutex<RecordBuffer>,
}

#[derive(Debug, Default)]
struct RecordBuffer {
    /// How many were ever given.
    given: u64,
    records: VecDeque<Arc<AnswerRecord>>,
    bytes: usize,
}

impl Records {
    pub(crate) fn new(epoch: u64, capacity: usize, capacity_bytes: usize) -> Self {
        Self {
            epoch,
            capacity,
            capacity_bytes,
            kept: Mutex::default(),
        }
    }

    /// The number of an answer about to be given.
    pub(crate) fn next_number(&self) -> u64 {
        let mut kept = lock(&self.kept);
        kept.given += 1;
        kept.given
    }

    /// Keeps an answer.
    pub(crate) fn keep(&self, record: &Arc<AnswerRecord>) {
        let mut kept = lock(&self.kept);
        // Answers given side by side may come here in another order than they were numbered.
        let is_last = kept
            .records
            .back()
            .is_none_or(|last| last.number < record.number);
        let place = match is_last {
            true => kept.records.len(),
            false => kept
                .records
                .partition_point(|other| other.number < record.number),
        };
        kept.bytes += record.bytes()
            + world_bytes(
                place.checked_sub(1).map(|before| &kept.records[before]),
                record,
            );
        kept.records.insert(place, record.clone());
        let oldest_network = record
            .airspace
            .topology_revision()
            .saturating_sub(NETWORKS_KEPT);
        let is_of_old_network = |kept: &RecordBuffer| {
            let oldest = kept.records.front();
            oldest.is_some_and(|oldest| oldest.airspace.topology_revision() < oldest_network)
        };
        while kept.records.len() > self.capacity
            || kept.bytes > self.capacity_bytes
            || is_of_old_network(&kept)
        {
            let Some(oldest) = kept.records.pop_front() else {
                return;
            };
            // The world of the oldest lives on in those that share it.
            let shared = kept
                .records
                .front()
                .is_some_and(|next| Arc::ptr_eq(&next.airspace, &oldest.airspace));
            let world = if shared { 0 } else { weight(&oldest.airspace) };
            kept.bytes = kept.bytes.saturating_sub(oldest.bytes() + world);
        }
    }

    /// The answer of an id, while it is kept.
    pub(crate) fn get(&self, id: &str) -> Option<Arc<AnswerRecord>> {
        let number = self.number_of(id)?;
        let kept = lock(&self.kept);
        let place = kept
            .records
            .binary_search_by_key(&number, |record| record.number)
            .ok()?;
        Some(kept.records[place].clone())
    }

    /// The number in an id of this start.
    pub(crate) fn number_of(&self, id: &str) -> Option<u64> {
        let (epoch, number) = id.split_once('-')?;
        (epoch.parse() == Ok(self.epoch))
            .then(|| number.parse().ok())
            .flatten()
    }

    /// Answers before a number, latest first, that a caller may see.
    pub(crate) fn before(
        &self,
        number: Option<u64>,
        size: usize,
        may_see: impl Fn(&AnswerRecord) -> bool,
    ) -> Vec<Arc<AnswerRecord>> {
        let kept = lock(&self.kept);
        let end = number.map_or(kept.records.len(), |number| {
            kept.records
                .partition_point(|record| record.number < number)
        });
        let earlier = kept.records.range(..end).rev();
        earlier
            .filter(|record| may_see(record))
            .take(size)
            .cloned()
            .collect()
    }

    /// How many are kept, and about how many bytes they take.
    pub(crate) fn figures(&self) -> (usize, usize) {
        let kept = lock(&self.kept);
        (kept.records.len(), kept.bytes)
    }
}

/// What a record adds for its world: nothing where it shares that of the one before.
fn world_bytes(before: Option<&Arc<AnswerRecord>>, record: &AnswerRecord) -> usize {
    match before {
        Some(before) if Arc::ptr_eq(&before.airspace, &record.airspace) => 0,
        _ => weight(&record.airspace),
    }
}

/// About how many bytes a snapshot of the airspace takes beside what it shares with others.
pub(crate) fn weight(airspace: &Airspace) -> usize {
    let topology = airspace.topology();
    let bits = topology.segment_count() / 2 + topology.node_count();
    4 * bits + 160 * airspace.closure_count()
}
