//! An answer on its way out, and the records behind answers, for those who ask.

use super::records::AnswerRecord;
use super::stored_answer::StoredAnswer;
use super::views::{recorded_closure, summary, wire_record};
use crate::Edge;
use crate::standing::Staleness;
use serde_json::Value;
use skyway_contract as wire;
use skyway_engine::airspace::Airspace;
use skyway_engine::flight::FailureType;
use skyway_engine::network::Topology;
use skyway_engine::recompose::{Request, Scratch, Strategy, World, certify};
use skyway_formats::{IntoTerm, read_flight_question, recorded_question, write_certificate};
use skyway_service::access::{Caller, Role};
use skyway_service::intake::{PageRequest, token};
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

/// An answer to a failure report.
#[derive(Clone, Debug)]
pub struct ReportResponse {
    given: StoredAnswer,
    replayed: bool,
    standing: Staleness,
    compute_us: f64,
}

impl ReportResponse {
    pub(crate) fn fresh(record: Arc<AnswerRecord>, standing: Staleness, compute_us: f64) -> Self {
        Self {
            given: StoredAnswer::Now(record),
            replayed: false,
            standing,
            compute_us,
        }
    }

    pub(crate) fn replayed(given: StoredAnswer, standing: Staleness) -> Self {
        Self {
            given,
            replayed: true,
            standing,
            compute_us: 0.0,
        }
    }

    pub(crate) fn given(&self) -> &StoredAnswer {
        &self.given
    }

    /// What is kept of it, where it was given in this start.
    pub(crate) fn record(&self) -> Option<&Arc<AnswerRecord>> {
        match &self.given {
            StoredAnswer::Now(record) => Some(record),
            StoredAnswer::Before(_) => None,
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
        let before = page.after_as(|id| self.records.number_of(id))?;
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
                may_see(caller, &record.subject, drone).then(|| StoredRecord::Now(record.clone()))
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
        standing: Staleness,
    ) -> Result<Option<StoredRecord>, Refusal> {
        let found = self.store.decision(id).await.map_err(|fault| {
            Refusal::new(Code::StoreUnavailable, fault.to_string()).retry_after_s(5)
        })?;
        let found =
            found.filter(|found| may_see(caller, &found.subject, found.drone_id.as_deref()));
        Ok(found.map(|found| {
            let mut record = found.into_record();
            standing.put_into(&mut record.answer.stamp);
            StoredRecord::Before(Arc::new(record))
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
enum StoredRecord {
    Now(Arc<AnswerRecord>),
    Before(Arc<wire::Record<'static>>),
}

impl StoredRecord {
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
                if record.world.network_sha256 != topology.fingerprint_text() {
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
    kept: StoredRecord,
    standing: Staleness,
    proof: Option<Value>,
}

impl FullRecord {
    /// The record as it is sent, borrowing what it can.
    pub fn to_wire(&self) -> wire::Record<'_> {
        match &self.kept {
            StoredRecord::Now(record) => {
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
            StoredRecord::Before(record) => wire::Record {
                certificate: self.proof.clone(),
                ..(**record).clone()
            },
        }
    }
}
