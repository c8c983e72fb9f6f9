//! Failure reports: read, answered on one snapshot, kept, and then published.
//!
//! An answer waits for nothing: the failed leg is closed for the request itself, and what is to be closed for
//! everyone goes to the writer afterwards. A drone gets an outcome unless nothing says where it is; what it may change is decided in
//! `publication`.

pub(crate) mod answered;
mod checking;
pub(crate) mod guard;
pub(crate) mod publication;
mod recomposing;
pub(crate) mod records;
pub(crate) mod reporter;
pub(crate) mod stored_answer;
pub(crate) mod traces;
mod validity;
pub(crate) mod views;

use crate::Edge;
use crate::drones::progress;
use crate::entries::AlarmDraft;
use crate::events::Happening;
use crate::plans::entry::PlanEntry;
use crate::plans::stops;
use crate::plans::stretches::Stretch;
use crate::snapshot::Snapshot;
use crate::standing::Staleness;
use crate::store::Entry;
use crate::writer::commands::{Command, NewsOrder};
use answered::ReportResponse;
use jiff::Timestamp;
use recomposing::Case;
use records::{AnswerRecord, Published, record_id};
use reporter::{author, drone_of, may_stand, named_plan, plan_of, reporter};
use skyway_contract::{self as wire, AlarmKind};
use skyway_engine::recompose::Outcome;
use skyway_formats::{
    IntoTerm, Known, KnownPlan, ParsedReport, ReadWarning, ReportProblem, ResolvedReport, Unplaced,
    bounded, resolve_report,
};
use skyway_service::access::Caller;
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;
use stored_answer::StoredAnswer;

/// Reports with longer ids are answered as if they had none.
const REPORT_ID_BYTES_MAX: usize = 256;
/// Reports of a batch after which others get their turn.
const BATCH_STRETCH: usize = 32;
/// The speed that telemetry tells is believed for so long, in seconds.
const SPEED_HOLDS_S: f64 = 5.0;

/// What an answer may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReplyMode {
    /// The first answer to a report: all that it may.
    First,
    /// A fresh answer to a report answered before: the plan of its drone.
    Again,
    /// The id was used for another report: nothing.
    Suppressed,
}

impl Edge {
    /// Answers a failure report.
    ///
    /// # Errors
    /// When the report names nothing that locates the drone.
    pub async fn report_failure(
        self: &Arc<Self>,
        caller: &Caller,
        parsed: ParsedReport,
    ) -> Result<ReportResponse, Refusal> {
        if parsed.report.id.is_none() && self.is_quick(&parsed.report) {
            return self.answer_drone(caller, parsed, ReplyMode::First);
        }
        // In a box, because a future is as large as its largest path, and is moved before it runs.
        Box::pin(self.answer_with_patience(caller, parsed)).await
    }

    /// The answer to a report that has an id, or takes its time.
    async fn answer_with_patience(
        self: &Arc<Self>,
        caller: &Caller,
        parsed: ParsedReport,
    ) -> Result<ReportResponse, Refusal> {
        // A dry run is no first sending: what follows it under its id counts.
        let is_sent = parsed.report.dry_run != Some(true);
        let id = parsed.report.id.as_ref().filter(|_| is_sent);
        let id = id.map(|id| id.text().to_owned());
        match id.filter(|id| !id.is_empty() && id.len() <= REPORT_ID_BYTES_MAX) {
            None => self.answer(caller, parsed, ReplyMode::First).await,
            Some(id) => self.answer_once(caller, parsed, &id).await,
        }
    }

    /// Answers many failure reports, in order, each with its own outcome or refusal.
    ///
    /// # Errors
    /// When there are more than a batch may have.
    pub async fn report_failures(
        self: &Arc<Self>,
        caller: &Caller,
        reports: Vec<Result<ParsedReport, ReportProblem>>,
    ) -> Result<Vec<Result<ReportResponse, Refusal>>, Refusal> {
        self.check_ready()?;
        self.check_batch("failures", reports.len())?;
        let mut answers = Vec::with_capacity(reports.len());
        for (number, report) in (1..).zip(reports) {
            answers.push(match report {
                Ok(parsed) => self.report_failure(caller, parsed).await,
                Err(problem) => Err(problem.into()),
            });
            if number % BATCH_STRETCH == 0 {
                tokio::task::yield_now().await;
            }
        }
        Ok(answers)
    }

    /// The answer to a report with an id: the stored one while it holds; the first sending is joined.
    async fn answer_once(
        self: &Arc<Self>,
        caller: &Caller,
        mut parsed: ParsedReport,
        id: &str,
    ) -> Result<ReportResponse, Refusal> {
        let subject = reporter(caller, &parsed.report);
        let now = self.clock.now();
        let sending = self.report_replies.join(&subject, id, &parsed.report, now);
        let report_bytes = parsed.report.bytes();
        if sending.report != parsed.report {
            parsed.warnings.push(ReadWarning {
                code: "id_reused",
                message: format!("the id '{id}' was used for another report; this one is answered and publishes nothing"),
            });
            return self.answer(caller, parsed, ReplyMode::Suppressed).await;
        }
        let mut fresh = None;
        let first = async {
            let answered = self
                .answer(caller, parsed.clone(), ReplyMode::First)
                .await?;
            let given = answered.given().clone();
            fresh = Some(answered);
            Ok::<_, Refusal>(given)
        };
        let given = sending.answer.get_or_try_init(|| first).await?.clone();
        if let Some(answered) = fresh {
            self.note_reply(&subject, id, answered.given());
            let replies = &self.report_replies;
            replies.weigh(&subject, id, (&sending, report_bytes), now);
            return Ok(answered);
        }
        let snapshot = self.world.load_full();
        let deadline = parsed.report.deadline.as_deref();
        if given.still_holds(deadline, &*self.planner, &snapshot, now) {
            return Ok(ReportResponse::replayed(given, self.standing(&snapshot)));
        }
        let report = parsed.report.clone();
        let answered = self.answer(caller, parsed, ReplyMode::Again).await?;
        let again = answered.given().clone();
        self.note_reply(&subject, id, &again);
        self.report_replies.renew(&subject, id, &report, again, now);
        Ok(answered)
    }

    /// Notes for a later start what the report of an id was answered.
    fn note_reply(&self, subject: &Arc<str>, id: &str, given: &StoredAnswer) {
        if let StoredAnswer::Now(record) = given
            && !record.dry_run
            && self.store.is_kept()
        {
            self.store.note(Entry::Report {
                subject: subject.clone(),
                id: id.to_owned(),
                record: record.clone(),
                standing: self.standing(&self.world.load_full()),
            });
        }
    }

    /// Whether a report is answered in place; others go where blocking is allowed.
    fn is_quick(&self, report: &wire::FailureReport) -> bool {
        self.planner
            .answers_at_once(report, self.world.load().topology())
    }

    async fn answer(
        self: &Arc<Self>,
        caller: &Caller,
        parsed: ParsedReport,
        mode: ReplyMode,
    ) -> Result<ReportResponse, Refusal> {
        if self.is_quick(&parsed.report) {
            return self.answer_drone(caller, parsed, mode);
        }
        let (edge, caller) = (self.clone(), caller.clone());
        self.in_turn(&self.turns.reports, move || {
            edge.answer_drone(&caller, parsed, mode)
        })
        .await?
    }

    /// Answers a report that a drone has sent, which the registry is to be told once.
    fn answer_drone(
        &self,
        caller: &Caller,
        parsed: ParsedReport,
        mode: ReplyMode,
    ) -> Result<ReportResponse, Refusal> {
        let answered = self.answer_in_place(caller, parsed, mode)?;
        if let Some(record) = answered.record().filter(|_| mode != ReplyMode::Again) {
            self.note_failure(record, answered.compute_us());
        }
        Ok(answered)
    }

    pub(crate) fn answer_in_place(
        &self,
        caller: &Caller,
        parsed: ParsedReport,
        mode: ReplyMode,
    ) -> Result<ReportResponse, Refusal> {
        let span = traces::of_answer().entered();
        let stopwatch = self.clock.stopwatch();
        let now = self.clock.now();
        let snapshot = self.on_network()?;
        let (report, mut read) = (parsed.report, parsed.warnings);
        let plan = plan_of(&snapshot, caller, &report, &mut read);
        let own = drone_of(caller, &report, plan.as_deref(), &mut read);
        let settled = traces::of_settling().in_scope(|| {
            // Where a drone is, only a caller learns that may speak for it.
            let known = self.known(&snapshot, &report, plan.as_ref(), own.as_deref(), now);
            resolve_report(&report, &known, &snapshot.airspace, &mut read)
        })?;
        let settled = self.by_stops(settled, &snapshot, plan.as_deref(), now);
        let dry_run = report.dry_run == Some(true);
        let is_told_only = dry_run || mode == ReplyMode::Suppressed;
        let case = Case {
            snapshot: &snapshot,
            report: &report,
            request: &settled.request,
            plan: plan.as_ref(),
            may_change: !is_told_only && plan.as_ref().is_none_or(|plan| !plan.is_quote()),
            drone_id: own.as_deref(),
            now,
        };
        let number = self.records.next_number();
        let recomposed = self.recompose_checked(&case, &mut read);
        let recomposed = recomposed.of_record(&record_id(self.epoch, number));
        let snapshot = recomposed.snapshot.clone();
        let mut record = AnswerRecord {
            epoch: self.epoch,
            number,
            answered_at: now,
            valid_until: self.valid_until(&snapshot, now),
            subject: caller.subject.clone(),
            airspace: snapshot.airspace.clone(),
            revision: snapshot.revision.clone(),
            report_bytes: report.bytes(),
            report,
            read: bounded(read),
            settled,
            among: recomposed.among(),
            answer: recomposed.answer,
            case: recomposed.refused.map(Box::new),
            drone_id: own,
            published: Published::nothing("dry_run"),
            plan: recomposed.plan,
            remaining_time_s: recomposed.remaining_time_s,
            dry_run,
            by_distance: self.settings.flight.is_none(),
        };
        if !dry_run {
            let _span = traces::of_publication().entered();
            // First, so that the closure then finds the plan with a way that is open.
            self.propose_to_plan(&record);
            record.published = self.publish(&snapshot, caller, &record, plan.as_ref(), mode);
            self.alarm_without_way(caller, &record, plan.as_deref());
        }
        let record = Arc::new(record);
        traces::tell(&span, &record);
        let standing = self.keep(caller, &record, &snapshot, plan.as_deref());
        let elapsed_us = stopwatch.elapsed_us();
        Ok(ReportResponse::fresh(record, standing, elapsed_us))
    }

    /// Keeps an answer and tells of it; says how current the edge is.
    fn keep(
        &self,
        caller: &Caller,
        record: &Arc<AnswerRecord>,
        snapshot: &Snapshot,
        plan: Option<&PlanEntry>,
    ) -> Staleness {
        self.records.keep(record);
        if let Some(case) = &record.case {
            let plan = plan.map(|plan| &*plan.id);
            let subjects = (Some(record.id()), plan, record.drone_id.as_deref());
            self.tell_case(snapshot, case, subjects, record.answered_at);
        }
        let standing = self.standing(snapshot);
        // What if: it changes nothing, and must not push what was decided out of a log that has a bound.
        if !record.dry_run {
            self.store.note_decision(record, standing);
        }
        self.tell_recomposed(caller, record);
        standing
    }

    /// Until when a drone may begin to follow an answer: as long as it has to acknowledge one, but not beyond the
    /// next turn of a window.
    fn valid_until(&self, snapshot: &Snapshot, now: Timestamp) -> Timestamp {
        let acknowledged = now.saturating_add(self.settings.acknowledge_within);
        let acknowledged = acknowledged.unwrap_or(now);
        let turn = snapshot.airspace.next_change();
        turn.map_or(acknowledged, |turn| turn.clamp(now, acknowledged))
    }

    /// A report about a plan that stops on its way leads to the next of its stops, unless it states another destination.
    fn by_stops(
        &self,
        mut settled: ResolvedReport,
        snapshot: &Snapshot,
        plan: Option<&PlanEntry>,
        now: Timestamp,
    ) -> ResolvedReport {
        let request = &mut settled.request;
        let goes_there = |plan: &&PlanEntry| plan.destination == request.report.destination;
        if let Some(plan) = plan.filter(goes_there) {
            let topology = snapshot.topology();
            let progress = progress::progress(topology, plan, &self.drones, now);
            let way = &plan.reported.composition.way.nodes;
            let progress = progress.map(|known| known.as_reported(way, &request.report));
            let onward = stops::onward(topology, plan, progress.as_ref(), now);
            request.lead_by(onward);
        }
        settled
    }

    /// What the edge knows of the drone.
    fn known<'a>(
        &self,
        snapshot: &Snapshot,
        report: &wire::FailureReport,
        plan: Option<&'a Arc<PlanEntry>>,
        drone_id: Option<&str>,
        now: Timestamp,
    ) -> Known<'a> {
        let progress =
            plan.and_then(|plan| progress::progress(snapshot.topology(), plan, &self.drones, now));
        let stretch = plan.and_then(|plan| plan.reported.stretch.as_ref());
        let on_stretch = progress.is_some_and(|progress| progress.on_stretch);
        let sighting = drone_id.and_then(|id| self.drones.last(id));
        let age_s = sighting
            .as_ref()
            .map(|sighting| now.duration_since(sighting.seen_at).as_secs_f64());
        let is_fresh = age_s.is_some_and(|age_s| age_s <= SPEED_HOLDS_S);
        let facts = report.drone.as_ref();
        let airframe = facts.and_then(|drone| drone.airframe.as_deref());
        Known {
            plan: plan.map(|plan| KnownPlan {
                nodes: &plan.reported.composition.way.nodes,
                leg: progress.map(|progress| progress.leg),
                before: stretch.filter(|_| on_stretch).and_then(Stretch::leg),
                is_meant: named_plan(report).is_none_or(|named| *named == *plan.id),
            }),
            position: sighting
                .as_ref()
                .map(|sighting| sighting.position(snapshot.topology().frame())),
            position_age_s: age_s.unwrap_or_default().max(0.0),
            airborne: sighting
                .as_ref()
                .and_then(|sighting| sighting.airborne_now(now)),
            ground_speed_mps: sighting
                .filter(|_| is_fresh)
                .and_then(|sighting| sighting.ground_speed_mps),
            airspeed_mps: self
                .planner
                .airspeed_mps(airframe, plan.map(|plan| &**plan)),
            is_grounded: plan.is_some_and(|plan| plan.stands_at(now))
                && may_stand(report, progress),
            unplaced: Unplaced::Anywhere,
            now: Some(now),
        }
    }

    /// What the drone of a plan flies after this answer, once it acknowledges it.
    fn propose_to_plan(&self, record: &AnswerRecord) {
        let change = record.plan.as_ref();
        let Some((change, version)) = change.and_then(|it| Some((it, it.version.as_ref()?))) else {
            return;
        };
        let command = Command::ProposeVersion {
            plan: change.plan.clone(),
            version: Box::new(version.clone()),
        };
        let topology = record.airspace.topology();
        if let Err(refusal) = self.writer.tell(command.made_on(topology)) {
            tracing::warn!(%refusal, "a recomposed version could not be proposed to its plan");
        }
    }

    /// Alarms an operator where an answer has no way.
    fn alarm_without_way(&self, caller: &Caller, record: &AnswerRecord, plan: Option<&PlanEntry>) {
        if record.answer.told().outcome != Outcome::NoRoute {
            return;
        }
        // A name that the caller may not speak for makes no alarm of its own.
        let drone = record.drone_id.clone();
        let drone = drone.filter(|drone| caller.speaks_for(drone));
        let who = match (plan, &drone) {
            (Some(plan), _) => format!("the drone of plan '{}'", plan.id),
            (None, Some(drone)) => format!("drone '{drone}'"),
            (None, None) => "a drone that no caller vouches for".to_owned(),
        };
        let id = record.id();
        let message =
            format!("{who} has no open way from where it is, by answer {id}: open one, or land it");
        self.raise_alarm(AlarmDraft {
            plan: plan.map(|plan| plan.id.clone()),
            drone,
            recomposition: Some(Arc::from(id)),
            ..AlarmDraft::new(AlarmKind::NoRoute, message)
        });
    }

    /// Notes for the registry that a failure was reported and answered. Dry runs are not told.
    fn note_failure(&self, record: &AnswerRecord, elapsed_us: f64) {
        if record.dry_run || !self.settings.follows_registry {
            return;
        }
        let topology = record.airspace.topology();
        let report = &record.settled.request.report;
        let (from, to) = report.leg;
        let segment = topology.segment_between(from, to);
        let failure = wire::FailureNews {
            recomposition_id: record.id(),
            drone_id: record.drone_id.as_deref().map(str::to_owned),
            failure_type: report.failure.into_term(),
            segment: segment.map(|segment| topology.segment_id(segment).into_owned()),
            outcome: record.answer.told().outcome.name().to_owned(),
            elapsed_us,
        };
        let command = Command::News(NewsOrder::Failed(Box::new(failure)));
        if let Err(refusal) = self.writer.tell(command) {
            tracing::warn!(%refusal, "a failure is not told to the registry");
        }
    }

    /// Dry runs are not told: they change nothing.
    fn tell_recomposed(&self, caller: &Caller, record: &AnswerRecord) {
        if record.dry_run {
            return;
        }
        let summary = views::summary(record);
        // A map with text keys and plain values always has a JSON form.
        let data = serde_json::to_value(&summary).unwrap_or_default();
        let mut happening = Happening::new(wire::EventKind::Recomposed, data);
        happening.by = Some(author(caller));
        self.events
            .add(vec![happening], record.answered_at, &record.revision);
    }

    pub(crate) fn check_batch(&self, name: &str, count: usize) -> Result<(), Refusal> {
        let limit = self.settings.batch_max;
        match count <= limit {
            true => Ok(()),
            false => {
                let detail =
                    format!("'{name}' has {count} entries, more than the {limit} of one batch");
                Err(Refusal::new(Code::BodyTooLarge, detail))
            }
        }
    }
}
