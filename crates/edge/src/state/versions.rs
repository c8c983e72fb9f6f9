//! What drones say of the versions of their plans: taken over, declined, or nothing at all.
//!
//! What a drone says is true: an acknowledgement of any version that was sent becomes what it reports. A version that was sent
//! and not answered may be flown, so nothing of it is freed by the passing of its deadline.

use super::State;
use super::alarms::AFTER_RELIEF;
use super::ends::only_quoted;
use crate::drones::progress;
use crate::planner::Version;
use crate::plans::entry::PlanEntry;
use crate::plans::fleet::{self, Detour};
use crate::writer::commands::{DeclineReason, Done};
use jiff::Timestamp;
use skyway_contract::{AlarmKind, EventKind, PlanState};
use skyway_engine::airspace::{Airspace, Change, Closure};
use skyway_engine::flight::FailureType;
use skyway_engine::network::SegmentIx;
use skyway_engine::recompose::Outcome;
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// So many declined versions are answered by another one; then an operator is called.
const DECLINES_ANSWERED: u32 = 2;

impl State {
    /// A drone flies a version: whichever of those that were sent.
    pub(super) fn acknowledge_plan(&mut self, id: &str, version: u32) -> Result<Done, Refusal> {
        let plan = self.plan(id)?;
        if plan.is_quote() {
            return Err(only_quoted(id));
        }
        if version == 0 {
            return Err(never_sent(&plan, version));
        }
        if version < plan.reported.number {
            // Said before, and come late.
            return Ok(Done::Plan(self.hear_while_active(&plan)));
        }
        if !plan.is_active() {
            if version == plan.reported.number {
                return Ok(Done::Plan(plan));
            }
            let detail = format!("plan '{id}' is over");
            return Err(Refusal::new(Code::PlanStateConflict, detail));
        }
        let Some(taken) = plan.versions().find(|sent| sent.number == version).cloned() else {
            return Err(never_sent(&plan, version));
        };
        let has_more = plan.wanted.is_none() && !plan.sent.is_empty();
        if version == plan.reported.number && !has_more {
            return Ok(Done::Plan(self.heard_of(&plan)));
        }
        let is_wanted = plan
            .wanted
            .as_ref()
            .is_none_or(|wanted| wanted.number == version);
        let taken_over = self.take_up(&plan, &taken, is_wanted);
        let plan = if is_wanted {
            taken_over
        } else {
            self.want_anew(&taken_over)
        };
        self.touched_plans.insert(plan.id.clone());
        self.tell(EventKind::PlanAcknowledged, &plan);
        Ok(Done::Plan(plan))
    }

    /// What a drone flies takes the place of what it flew; what was sent later may yet be taken over.
    fn take_up(
        &mut self,
        plan: &Arc<PlanEntry>,
        taken: &Arc<Version>,
        is_wanted: bool,
    ) -> Arc<PlanEntry> {
        let is_later = |version: &Arc<Version>| version.number > taken.number && !is_wanted;
        let (later, over): (Vec<_>, Vec<_>) = plan.versions().cloned().partition(is_later);
        for version in over.iter().filter(|version| version.number != taken.number) {
            self.vacate(&plan.id, version);
        }
        // Where another plan has come onto its pad since, its drone is told.
        let reported = Version {
            acknowledge_by: None,
            ..self.with_contest(&plan.id, (**taken).clone())
        };
        self.end_plan_alarms(&plan.id, &AFTER_RELIEF);
        self.end_plan_alarms(&plan.id, &[AlarmKind::Overdue]);
        self.occupy(&plan.id, &reported);
        self.time_arrival(&plan.id, &reported);
        let topology = self.next.topology();
        let progress = progress::progress(topology, plan, &self.drones, self.now);
        let was_silent = plan.flags.silent;
        let flown_for = plan.taken_up(&reported, topology, progress.as_ref(), self.now);
        let plan = self.keep_plan(PlanEntry {
            flown_for,
            state: match plan.state {
                PlanState::Accepted => PlanState::Accepted,
                _ => PlanState::Activated,
            },
            flags: plan.flags.of_taken_up(),
            reported: Arc::new(reported),
            wanted: None,
            sent: later,
            declined: 0,
            affected_by: Vec::new(),
            ..(**plan).clone()
        });
        if was_silent {
            self.attend_again(&plan);
        }
        self.time_way_on(&plan);
        plan
    }

    /// A drone that has said again what it flies is heard of.
    fn heard_of(&mut self, plan: &Arc<PlanEntry>) -> Arc<PlanEntry> {
        let plan = &self.hear_of_again(plan);
        if !plan.flags.unacknowledged || plan.wanted.is_some() {
            return plan.clone();
        }
        self.keep_plan(plan.with(|plan| plan.flags.unacknowledged = false))
    }

    /// The drone of a plan has said something that changes nothing else.
    fn hear_while_active(&mut self, plan: &Arc<PlanEntry>) -> Arc<PlanEntry> {
        match plan.is_active() {
            true => self.hear_of_again(plan),
            false => plan.clone(),
        }
    }

    /// A drone flies something else than it was to: what it is to fly is worked out from where it is.
    fn want_anew(&mut self, plan: &Arc<PlanEntry>) -> Arc<PlanEntry> {
        let airspace = self.next.airspace.clone();
        let Some(detour) = self.detour_of(plan, &airspace, None) else {
            return plan.clone();
        };
        if detour.outcome() == Outcome::Unaffected {
            return plan.clone();
        }
        let version = self.version_of(&detour, &airspace, self.now);
        let version = version.map(|version| self.with_contest(&plan.id, version));
        let plan = self.replace_wanted(plan, version);
        self.tell(EventKind::PlanAffected, &plan);
        plan
    }

    /// A drone does not take a version over, and flies on as it reported.
    pub(super) fn decline_plan(
        &mut self,
        id: &str,
        version: u32,
        reason: DeclineReason,
    ) -> Result<Done, Refusal> {
        let plan = self.plan(id)?;
        if plan.is_quote() {
            return Err(only_quoted(id));
        }
        if version == 0 || version >= plan.next_version.load(Ordering::Relaxed) {
            return Err(never_sent(&plan, version));
        }
        let declined = plan
            .wanted
            .clone()
            .filter(|wanted| wanted.number == version);
        let Some(declined) = declined.filter(|_| plan.is_active()) else {
            // Said before, or overtaken: what it is asked now stands in the answer.
            return Ok(Done::Plan(self.hear_while_active(&plan)));
        };
        let plan = self.hear_of_again(&plan);
        self.end_plan_alarms(&plan.id, &[AlarmKind::Unacknowledged]);
        if plan.is_as_planned() && plan.may_go_on() {
            // It was offered, and need not be taken: what its drone does not fly takes nothing.
            self.vacate(&plan.id, &declined);
            let plan = self.keep_plan(plan.with(|plan| plan.wanted = None));
            self.tell(EventKind::PlanDeclined, &plan);
            return Ok(Done::Plan(plan));
        }
        let count = plan.declined + 1;
        let kept = plan.with(|plan| {
            plan.declined = count;
            plan.flags.unacknowledged = false;
        });
        let answer = match count <= DECLINES_ANSWERED {
            true => self.instead_of(&Arc::new(kept.clone()), &declined, reason),
            false => None,
        };
        let plan = self.replace_wanted(&Arc::new(kept), answer);
        let plan = self.contingent_without_way(plan);
        if plan.wanted.is_none() {
            self.time_way(&plan, self.now);
        }
        self.tell(EventKind::PlanDeclined, &plan);
        if count >= DECLINES_ANSWERED || plan.wanted.is_none() {
            let message = format!(
                "the drone of plan '{}' has declined version {version}: call it",
                plan.id
            );
            self.raise_plan_alarm(AlarmKind::Declined, &plan, message);
        }
        Ok(Done::Plan(plan))
    }

    /// A version that respects why another one was declined, and why those before it were.
    fn instead_of(
        &mut self,
        plan: &Arc<PlanEntry>,
        declined: &Version,
        reason: DeclineReason,
    ) -> Option<Version> {
        let airspace = self.next.airspace.clone();
        let (detour, world) = match reason {
            DeclineReason::Unfit => {
                let failure = Some(FailureType::Operational);
                (self.detour_of(plan, &airspace, failure)?, airspace)
            }
            DeclineReason::Passed => {
                let detour = self.detour_of(plan, &airspace, None)?;
                if *detour.way() == declined.composition.way {
                    self.detour_beside(plan, declined, &airspace)?
                } else {
                    (detour, airspace)
                }
            }
            DeclineReason::Obstructed => self.detour_beside(plan, declined, &airspace)?,
        };
        let version = self.version_of(&detour, &world, self.now)?;
        Some(self.with_contest(&plan.id, version))
    }

    /// A detour that begins with none of the segments with which the versions began that were declined in a row; where there
    /// is none, with another than that of the last one.
    fn detour_beside(
        &mut self,
        plan: &Arc<PlanEntry>,
        declined: &Version,
        airspace: &Arc<Airspace>,
    ) -> Option<(Detour, Arc<Airspace>)> {
        let before = usize::try_from(plan.declined).unwrap_or_default();
        let before = plan.sent.iter().rev().take(before.saturating_sub(1));
        let begins = |version: &Version| version.composition.way.segments.first().copied();
        let last = begins(declined);
        let mut all: Vec<SegmentIx> = before.filter_map(|it| begins(it)).chain(last).collect();
        all.sort_unstable();
        all.dedup();
        let world = without_segments(airspace, all, self.now);
        let detour = self.detour_of(plan, &world, None)?;
        if detour.outcome() != Outcome::NoRoute {
            return Some((detour, world));
        }
        let world = without_segments(airspace, last.into_iter().collect(), self.now);
        Some((self.detour_of(plan, &world, None)?, world))
    }

    /// What the drone of a plan is told in a world, for a failure where there is one.
    fn detour_of(
        &mut self,
        plan: &Arc<PlanEntry>,
        airspace: &Arc<Airspace>,
        failure: Option<FailureType>,
    ) -> Option<Detour> {
        let topology = airspace.topology();
        let progress = progress::progress(topology, plan, &self.drones, self.now)?;
        let means = self.means(airspace, self.now);
        Some(fleet::detour_for(plan, &progress, failure, &means))
    }

    /// The time for an acknowledgement is over. All that was sent goes on to count, as it may be flown.
    pub(super) fn miss_acknowledgement(&mut self, id: &str, version: u32, now: Timestamp) {
        let plan = self.next.plans.get(id).cloned();
        let Some(plan) = plan.filter(|plan| plan.is_active()) else {
            return;
        };
        let is_missed = plan.wanted.as_ref().is_some_and(|wanted| {
            wanted.number == version && wanted.acknowledge_by.is_some_and(|by| by <= now)
        });
        if !is_missed {
            return;
        }
        if plan.is_as_planned() {
            // Nobody had to take what was offered.
            self.withdraw_wanted(&plan);
            return;
        }
        self.next.unacknowledged += 1;
        let plan = self.keep_plan(plan.with(|plan| plan.flags.unacknowledged = true));
        self.tell(EventKind::PlanUnacknowledged, &plan);
        let message = format!(
            "version {version} of plan '{}' was not acknowledged in time: call its drone",
            plan.id
        );
        self.raise_plan_alarm(AlarmKind::Unacknowledged, &plan, message);
    }
}

/// The world with some segments closed.
fn without_segments(
    airspace: &Arc<Airspace>,
    segments: Vec<SegmentIx>,
    now: Timestamp,
) -> Arc<Airspace> {
    let id = "declined".to_owned();
    let closure = Closure::of_operator(id, String::new(), Vec::new(), segments);
    Arc::new(airspace.apply(&[Change::Put(Arc::new(closure))], now))
}

fn never_sent(plan: &PlanEntry, version: u32) -> Refusal {
    let sent: Vec<String> = plan
        .versions()
        .map(|sent| sent.number.to_string())
        .collect();
    let detail = format!(
        "plan '{}' has no version {version}: it flies {}, and {} were sent",
        plan.id,
        plan.reported.number,
        sent.join(", ")
    );
    Refusal::new(Code::PlanStateConflict, detail)
}
