//! An answer on its way out, and the records behind answers, in the words of the wire.

use super::Edge;
use super::given::Given;
use super::guard::case_view;
use super::records::AnswerRecord;
use super::store::ReportReply;
use super::views;
use crate::access::{Caller, Role};
use crate::airspace::{Airspace, Cause, Closure};
use crate::flight::{FailureType, Location};
use crate::formats::{
    IntoTerm, answer, read_flight_question, recorded_question, settled_report, write_certificate,
    zone_to_feature,
};
use crate::intake::{PageRequest, token};
use crate::network::Topology;
use crate::recompose::{Request, Scratch, Strategy, World, certify};
use crate::refusal::{Code, Refusal};
use crate::wire;
use serde_json::Value;
use std::borrow::Cow;
use std::sync::Arc;

/// How current the edge was when it answered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Standing {
    pub(super) registry_revision: Option<wire::RegistryRevision>,
    pub(super) registry_age_s: Option<f64>,
    pub(super) freshness: wire::Freshness,
    pub(super) clock: wire::ClockKind,
}

impl Standing {
    /// Says in an earlier answer how current the edge is now.
    pub(super) fn put_into(self, stamp: &mut wire::Stamp<'static>) {
        stamp.registry_revision = self.registry_revision;
        stamp.registry_age_s = self.registry_age_s;
        stamp.freshness = self.freshness;
        stamp.clock = self.clock;
    }
}

/// An answer to a failure report.
#[derive(Clone, Debug)]
pub struct Answered {
    given: Given,
    replayed: bool,
    standing: Standing,
    compute_us: f64,
}

impl Answered {
    pub(super) fn fresh(record: Arc<AnswerRecord>, standing: Standing, compute_us: f64) -> Self {
        Self {
            given: Given::Now(record),
            replayed: false,
            standing,
            compute_us,
        }
    }

    pub(super) fn replayed(given: Given, standing: Standing) -> Self {
        Self {
            given,
            replayed: true,
            standing,
            compute_us: 0.0,
        }
    }

    pub(super) fn given(&self) -> &Given {
        &self.given
    }

    /// What is kept of it, where it was given in this start.
    pub(super) fn record(&self) -> Option<&Arc<AnswerRecord>> {
        match &self.given {
            Given::Now(record) => Some(record),
            Given::Before(_) => None,
        }
    }

    /// How long it took to read, compute and keep, in microseconds; 0 for a stored answer.
    pub fn compute_us(&self) -> f64 {
        self.compute_us
    }

    /// What the drone is to do, for metrics.
    pub fn outcome(&self) -> wire::Outcome {
        self.given.outcome()
    }

    /// The strategy that answered, for metrics.
    pub fn strategy_used(&self) -> Strategy {
        self.given.strategy_used()
    }

    /// The answer as it is sent, borrowing what it can.
    pub fn to_wire(&self) -> wire::Recomposition<'_> {
        self.given.to_wire(self.replayed, self.standing)
    }
}

pub(super) fn recomposition(
    record: &AnswerRecord,
    replayed: bool,
    standing: Standing,
) -> wire::Recomposition<'_> {
    let published = &record.published;
    let plan = record.plan.as_ref();
    let topology = record.airspace.topology();
    let told = record.answer.told();
    let flight = record.answer.flight();
    let flown = flight.and_then(|flight| {
        let (version, way) = flight.version.as_ref()?;
        Some((version, way, flight.departs_at))
    });
    let proposed = plan.and_then(|plan| plan.version.as_ref());
    let legs = match (flown, proposed) {
        (Some((version, way, departs_at)), _) => {
            views::legs(topology, way, Some(version), departs_at)
        }
        (None, Some(version)) => {
            views::legs(topology, &version.composition, None, version.departs_at)
        }
        (None, None) => Vec::new(),
    };
    let mut told = answer(&record.airspace, told, &record.read);
    if flight.is_some_and(|flight| flight.is_energy_checked) {
        told.energy = Cow::Borrowed("checked");
    }
    wire::Recomposition {
        id: Cow::Owned(record.id()),
        answer: told,
        remaining_time_s: record.remaining_time_s,
        times: Cow::Borrowed(match flight {
            Some(_) => "computed",
            None => "nominal",
        }),
        publication: wire::Publication {
            state: published.state,
            closure_id: published.closure_id.as_deref().map(Cow::Borrowed),
            proposal_ids: published
                .proposal_ids
                .iter()
                .map(|id| Cow::Borrowed(&**id))
                .collect(),
            reason: published.reason.map(Cow::Borrowed),
        },
        plan: plan.map(|plan| wire::PlanReference {
            id: Cow::Borrowed(&*plan.plan),
            version: plan.version.as_ref().map(|version| version.number),
        }),
        legs,
        flight: flown.and_then(|(version, _, departs_at)| version.told(topology, departs_at)),
        causes: flight.map_or_else(Vec::new, |flight| flight.causes.clone()),
        opens: flight.and_then(|flight| flight.opens.clone()),
        replayed,
        valid_until: Some(views::instant(record.valid_until)),
        stamp: wire::Stamp {
            revision: Cow::Borrowed(&*record.revision),
            topology_revision: record.airspace.topology_revision(),
            registry_revision: standing.registry_revision,
            registry_age_s: standing.registry_age_s,
            freshness: standing.freshness,
            clock: standing.clock,
            network: views::network_name(topology),
        },
    }
}

/// A line of the list of what was answered.
pub(super) fn summary(record: &AnswerRecord) -> wire::RecordSummary<'static> {
    let topology = record.airspace.topology();
    let report = &record.settled.request.report;
    let (from, to) = report.leg;
    let old_path = report.remaining_path.as_deref();
    wire::RecordSummary {
        id: Cow::Owned(record.id()),
        answered_at: views::instant(record.answered_at),
        failure: failure(report.failure),
        drone_id: record.drone_id.as_deref().map(views::text),
        plan_id: record.plan.as_ref().map(|plan| views::text(&plan.plan)),
        leg: Some([from, to].map(|node| views::node_id(topology, node))),
        outcome: views::outcome(record.answer.told().outcome),
        path: views::path(topology, &record.answer.told().path),
        old_path: views::node_ids(topology, old_path.unwrap_or(&[from, to])),
        remaining_length_m: record.answer.told().remaining_length_m,
        dry_run: record.dry_run,
        revision: views::text(&record.revision),
    }
}

fn failure(failure: FailureType) -> wire::FailureType {
    match failure {
        FailureType::Environmental => wire::FailureType::Environmental,
        FailureType::Navigational => wire::FailureType::Navigational,
        FailureType::Regulatory => wire::FailureType::Regulatory,
        FailureType::Infrastructure => wire::FailureType::Infrastructure,
        FailureType::Operational => wire::FailureType::Operational,
        FailureType::ServiceLevel => wire::FailureType::ServiceLevel,
    }
}

impl Edge {
    /// What was answered, latest first, as far as the caller may see it.
    ///
    /// # Errors
    /// When the page is not one.
    pub fn recompositions(
        &self,
        caller: &Caller,
        page: &PageRequest,
    ) -> Result<wire::Recompositions<'static>, Refusal> {
        let page = page.check()?;
        let before = page
            .after
            .as_deref()
            .and_then(|id| self.records.number_of(id));
        let found = self.records.before(before, page.size + 1, |record| {
            may_see(caller, &record.subject, record.drone_id.as_deref())
        });
        let is_last = found.len() <= page.size;
        let told = &found[..found.len().min(page.size)];
        let next = told.last().filter(|_| !is_last);
        Ok(wire::Recompositions {
            recompositions: told.iter().map(|record| summary(record)).collect(),
            next_page_token: next.map(|record| token(&record.id())),
            stamp: self.stamp(),
        })
    }

    /// All that is kept of an answer; with the proof that it is the optimum, when asked for.
    ///
    /// # Errors
    /// When nothing is kept under the id that the caller may see.
    pub async fn recomposition(
        self: &Arc<Self>,
        caller: &Caller,
        id: &str,
        certificate: bool,
    ) -> Result<FullRecord, Refusal> {
        let standing = self.standing(&self.world.load_full());
        let kept = self.records.get(id);
        let kept = match kept {
            Some(record) => {
                let drone = record.drone_id.as_deref();
                may_see(caller, &record.subject, drone).then(|| Kept::Now(record.clone()))
            }
            None => self.earlier_record(caller, id, standing).await?,
        };
        let kept = kept.ok_or_else(|| Refusal::not_found("recomposition", id))?;
        let proof = match certificate {
            true => {
                let (kept, topology) = (kept.clone(), self.topology());
                self.aside(move || kept.prove(&topology)).await?
            }
            false => None,
        };
        Ok(FullRecord {
            kept,
            standing,
            proof,
        })
    }

    /// What the file has of an answer that is no longer in memory, as far as the caller may see it.
    async fn earlier_record(
        &self,
        caller: &Caller,
        id: &str,
        standing: Standing,
    ) -> Result<Option<Kept>, Refusal> {
        let found = self.store.decision(id).await.map_err(|fault| {
            Refusal::new(Code::StoreUnavailable, fault.to_string()).retry_after_s(5)
        })?;
        let found =
            found.filter(|found| may_see(caller, &found.subject, found.drone_id.as_deref()));
        Ok(found.map(|found| {
            let mut record = found.into_record();
            standing.put_into(&mut record.answer.stamp);
            Kept::Before(Arc::new(record))
        }))
    }
}

fn may_see(caller: &Caller, subject: &str, drone: Option<&str>) -> bool {
    match caller.role {
        Role::Operator | Role::Anyone => true,
        _ => drone.is_some_and(|drone| caller.speaks_for(drone)) || *caller.subject == *subject,
    }
}

/// A record, of this start or an earlier one.
#[derive(Clone, Debug)]
enum Kept {
    Now(Arc<AnswerRecord>),
    Before(Arc<wire::Record<'static>>),
}

impl Kept {
    /// The proof of an exact answer; `None` for one that is no optimum to prove, or whose network is gone.
    fn prove(&self, topology: &Arc<Topology>) -> Option<Value> {
        match self {
            Self::Now(record) => {
                let (request, told) = (&record.settled.request, record.answer.told());
                let question = record.flight_question();
                // Its flight looks ahead from the instant of the answer.
                let ahead = || record.airspace.apply(&[], record.answered_at);
                match question {
                    Some(question) => prove_flight(&question, &ahead(), request),
                    None => prove(&record.airspace, request, told.strategy_used),
                }
            }
            Self::Before(record) => {
                if record.world.network_sha256 != hex(topology.fingerprint()) {
                    return None;
                }
                let (airspace, read) = recorded_question(record, topology).ok()?;
                if let Some(question) = &record.world.flight {
                    return prove_flight(question, &airspace, &read.request);
                }
                let strategy = record.answer.answer.strategy_used.into_term();
                prove(&airspace, &read.request, strategy)
            }
        }
    }
}

/// The plan of an answer in flight with everything that it was made for; `None` where it has none, or not all is recorded.
fn prove_flight(question: &Value, airspace: &Airspace, request: &Request) -> Option<Value> {
    let question = read_flight_question(question, airspace).ok()?;
    let answer = question.answer(request);
    let certificate = question.certificate(&answer).ok()??;
    serde_json::from_str(&certificate).ok()
}

fn prove(airspace: &Airspace, request: &Request, strategy_used: Strategy) -> Option<Value> {
    let topology = airspace.topology();
    let leads_there = request.report.failure != FailureType::Operational;
    if strategy_used != Strategy::Exact || !leads_there {
        return None;
    }
    let world = World {
        airspace,
        trees: None,
    };
    let mut scratch = Scratch::new(topology);
    let proof = certify(&world, request, &mut scratch);
    serde_json::from_str(&write_certificate(topology, &proof)).ok()
}

/// All that is kept of an answer.
#[derive(Clone, Debug)]
pub struct FullRecord {
    kept: Kept,
    standing: Standing,
    proof: Option<Value>,
}

impl FullRecord {
    /// The record as it is sent, borrowing what it can.
    pub fn to_wire(&self) -> wire::Record<'_> {
        match &self.kept {
            Kept::Now(record) => {
                let topology = record.airspace.topology();
                let closures = record.airspace.in_force();
                let closures = closures.map(|closure| recorded_closure(topology, closure));
                wire_record(
                    record,
                    self.standing,
                    closures.collect(),
                    self.proof.clone(),
                )
            }
            Kept::Before(record) => wire::Record {
                certificate: self.proof.clone(),
                ..(**record).clone()
            },
        }
    }
}

/// A record as it is sent, with these closures of its world.
pub(super) fn wire_record<'a>(
    record: &'a AnswerRecord,
    standing: Standing,
    closures: Vec<wire::RecordedClosure<'a>>,
    certificate: Option<Value>,
) -> wire::Record<'a> {
    let airspace = &record.airspace;
    let topology = airspace.topology();
    wire::Record {
        id: Cow::Owned(record.id()),
        answered_at: views::instant(record.answered_at),
        report: record.report.clone(),
        settled_report: settled_report(&record.settled, topology),
        answer: recomposition(record, false, standing),
        world: wire::RecordedWorld {
            revision: Cow::Borrowed(&*record.revision),
            topology_revision: airspace.topology_revision(),
            network_sha256: Cow::Owned(hex(topology.fingerprint())),
            as_of: views::instant(airspace.as_of()),
            horizon_s: airspace.horizon().as_secs_f64(),
            closures,
            flight: record.flight_question(),
        },
        certificate,
        checker_case: record.case.as_ref().map(|case| case_view(topology, case)),
    }
}

/// What is to be answered when a report comes again in a later start.
pub(super) fn report_reply(
    subject: &str,
    id: String,
    record: &AnswerRecord,
    standing: Standing,
) -> ReportReply {
    let answer = recomposition(record, false, standing);
    ReportReply {
        subject: subject.to_owned(),
        id,
        report: record.report.clone(),
        // A map with text keys and finite numbers always has a JSON form.
        answer: serde_json::to_string(&answer).unwrap_or_default(),
        place: match record.settled.request.report.location {
            Location::At(place) => Some([place.x, place.y]),
            Location::LegStart | Location::Unknown => None,
        },
        network: hex(record.airspace.topology().fingerprint()),
    }
}

pub(super) fn recorded_closure(
    topology: &Topology,
    closure: &Closure,
) -> wire::RecordedClosure<'static> {
    let zone = closure.zone();
    let hits = match zone {
        Some(_) => None,
        None => Some(&closure.hits),
    };
    let segments = hits.iter().flat_map(|hits| &hits.segments);
    let nodes = hits.iter().flat_map(|hits| &hits.nodes);
    wire::RecordedClosure {
        id: views::text(&closure.id),
        cause: Cow::Borrowed(match closure.cause {
            Cause::Zone(_) => "zone",
            Cause::Report { .. } => "report",
            Cause::Operator { .. } => "operator",
        }),
        zone: zone.map(|zone| zone_to_feature(zone)),
        segments: segments
            .map(|&segment| Cow::Owned(topology.segment_id(segment).into_owned()))
            .collect(),
        nodes: nodes.map(|&node| views::node_id(topology, node)).collect(),
        pads: views::node_ids(topology, &closure.pads),
    }
}

/// Bytes in hexadecimal.
pub(super) fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write;
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to text cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}
