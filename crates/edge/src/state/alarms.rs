//! Alarms in the state: raised, renewed, acknowledged, ended, and bounded in number.

use super::State;
use crate::entries::{AlarmDraft, AlarmEntry};
use crate::line::mailbox::Content;
use crate::planner::Version;
use crate::plans::entry::PlanEntry;
use crate::views::{alarm_id, alarm_view};
use crate::writer::commands::Done;
use jiff::Timestamp;
use serde_json::json;
use skyway_contract::{AlarmKind, EventKind, Flag};
use skyway_engine::airspace::Closure;
use skyway_engine::network::NodeIx;
use skyway_service::refusal::Refusal;
use std::sync::Arc;

/// At most this many alarms are kept, those that have ended included.
const ALARMS_MAX: usize = 1_000;
/// Where there are more, so many go at once.
const DROPPED_AT_ONCE: usize = 100;
/// A message names no more causes than this.
const CAUSES_NAMED: usize = 10;

/// What a way that is open again ends.
pub(super) const WITHOUT_WAY: [AlarmKind; 2] = [AlarmKind::NoRoute, AlarmKind::Grounded];
/// What a drone that is known to fly an open version ends.
pub(super) const AFTER_RELIEF: [AlarmKind; 4] = [
    AlarmKind::NoRoute,
    AlarmKind::Grounded,
    AlarmKind::Unacknowledged,
    AlarmKind::Declined,
];
/// What the end of a plan ends; that a drone is lost is not over with its plan.
pub(super) const AT_THE_END: [AlarmKind; 7] = [
    AlarmKind::NoRoute,
    AlarmKind::Grounded,
    AlarmKind::Unacknowledged,
    AlarmKind::Declined,
    AlarmKind::Contingent,
    AlarmKind::Unseparated,
    AlarmKind::Overdue,
];

impl State {
    /// Alarms an operator. The same alarm again, of one kind about one thing, renews the one there is; it is told and
    /// has to be acknowledged anew only where its causes are others. What is about no plan has no end that could be
    /// seen: where it was acknowledged, the same again is another alarm.
    pub(super) fn raise_alarm(&mut self, draft: AlarmDraft, now: Timestamp) -> Arc<AlarmEntry> {
        let key = (draft.kind, draft.subject());
        let open = self.open_alarms.get(&key);
        let standing = open
            .and_then(|number| self.next.alarms.get(number))
            .cloned();
        let is_over =
            |standing: &Arc<AlarmEntry>| draft.plan.is_none() && standing.acknowledged.is_some();
        if let Some(standing) = &standing
            && is_over(standing)
        {
            self.end_alarm(standing);
        } else if let Some(standing) = standing {
            let is_as_told = standing.draft.causes == draft.causes;
            let acknowledged = standing.acknowledged.clone().filter(|_| is_as_told);
            return self.keep_alarm(
                AlarmEntry {
                    draft,
                    renewed_at: now,
                    count: standing.count + 1,
                    acknowledged,
                    ..(*standing).clone()
                },
                (!is_as_told).then_some(EventKind::AlarmRaised),
            );
        }
        let number = self.write_number();
        self.next.alarms_raised[draft.kind as usize] += 1;
        tracing::warn!(
            kind = draft.kind.name(),
            plan = draft.plan.as_deref(),
            drone = draft.drone.as_deref(),
            "alarm: {}",
            draft.message
        );
        self.open_alarms.insert(key, number);
        let entry = AlarmEntry {
            number,
            draft,
            raised_at: now,
            renewed_at: now,
            count: 1,
            acknowledged: None,
            ended_at: None,
        };
        let entry = self.keep_alarm(entry, Some(EventKind::AlarmRaised));
        if self.next.alarms.len() > ALARMS_MAX {
            self.drop_alarms();
        }
        entry
    }

    /// Alarms an operator about a plan.
    pub(super) fn raise_plan_alarm(&mut self, kind: AlarmKind, plan: &PlanEntry, message: String) {
        let draft = AlarmDraft {
            plan: Some(plan.id.clone()),
            drone: plan.drone_id.clone(),
            causes: plan.affected_by.clone(),
            ..AlarmDraft::new(kind, message)
        };
        let now = self.now;
        self.raise_alarm(draft, now);
    }

    /// Alarms an operator about a plan whose drone has no way: one that waits on a pad inside a zone without an end is
    /// grounded.
    pub(super) fn alarm_without_way(&mut self, plan: &PlanEntry, now: Timestamp) {
        let current = &plan.reported;
        let sighting = plan.drone_id.as_deref().and_then(|id| self.drones.last(id));
        let is_seen = sighting.is_some_and(|sighting| sighting.seen_at >= current.departs_at);
        let waits = !is_seen && now < current.departs_at;
        let stand = current.composition.way.nodes.first().copied();
        let is_shut_in = stand.is_some_and(|node| waits && self.is_closed_for_good(node));
        let (id, causes) = (&plan.id, in_brackets(&plan.affected_by));
        if is_shut_in {
            let message = format!(
                "the drone of plan '{id}' stands in a zone without an end{causes}: it stays on its pad until the zone \
                 is lifted"
            );
            self.raise_plan_alarm(AlarmKind::Grounded, plan, message);
            return;
        }
        let message = format!(
            "the drone of plan '{id}' has no open way from where it is{causes}: open one, or land it"
        );
        self.raise_plan_alarm(AlarmKind::NoRoute, plan, message);
    }

    /// Alarms an operator about a plan whose drone is to fly near others.
    pub(super) fn alarm_unseparated(&mut self, plan: &PlanEntry, wanted: &Version) {
        if !wanted.flags.contains(&Flag::Unseparated) {
            return;
        }
        let message = format!(
            "other plans are too near to every way of the drone of plan '{}': version {} does not keep apart from them; \
             land or delay those that it names",
            plan.id, wanted.number
        );
        self.raise_plan_alarm(AlarmKind::Unseparated, plan, message);
    }

    /// Ends the alarm about a plan of which no version that its drone may fly comes near others any more.
    pub(super) fn end_unseparated(&mut self, plan: &PlanEntry) {
        let is_flagged = |version: &Version| version.flags.contains(&Flag::Unseparated);
        if !plan.versions().any(|version| is_flagged(version)) {
            self.end_plan_alarms(&plan.id, &[AlarmKind::Unseparated]);
        }
    }

    fn is_closed_for_good(&self, node: NodeIx) -> bool {
        let airspace = &self.next.airspace;
        let closes = |closure: &&Arc<Closure>| {
            let ends = closure
                .windows
                .iter()
                .all(|window| window.until().is_some());
            let is_endless = !closure.recurs() && (closure.windows.is_empty() || !ends);
            let is_hit = closure.hits.nodes.binary_search(&node).is_ok();
            closure.zone().is_some() && is_endless && is_hit
        };
        airspace.closed().closes_node(node) && airspace.in_force().any(|closure| closes(&closure))
    }

    /// What alarms of these kinds about a plan were about is over.
    pub(super) fn end_plan_alarms(&mut self, plan: &str, kinds: &[AlarmKind]) {
        if self.open_alarms.is_empty() {
            return;
        }
        let subject: Arc<str> = Arc::from(format!("plan:{plan}"));
        for kind in kinds {
            let Some(number) = self.open_alarms.remove(&(*kind, subject.clone())) else {
                continue;
            };
            if let Some(standing) = self.next.alarms.get(&number).cloned() {
                self.end_alarm(&standing);
            }
        }
    }

    fn end_alarm(&mut self, standing: &AlarmEntry) {
        let ended = AlarmEntry {
            ended_at: Some(self.now),
            ..standing.clone()
        };
        self.keep_alarm(ended, Some(EventKind::AlarmEnded));
    }

    /// A drone has another plan: what alarms about plans that are forgotten were about, such as of one that a new network has
    /// ended, is over; not that it was lost.
    pub(super) fn end_alarms_of_former_plans(&mut self, drone: &Arc<str>) {
        let open = self.open_alarms.values();
        let open = open.filter_map(|number| self.next.alarms.get(number));
        let of_drone = open.filter(|alarm| alarm.draft.drone.as_ref() == Some(drone));
        let plans = of_drone.filter_map(|alarm| alarm.draft.plan.clone());
        let former: Vec<Arc<str>> = plans
            .filter(|plan| !self.next.plans.contains_key(plan))
            .collect();
        for plan in former {
            self.end_plan_alarms(&plan, &AT_THE_END);
        }
    }

    pub(super) fn acknowledge_alarm(
        &mut self,
        number: u64,
        by: Arc<str>,
        now: Timestamp,
    ) -> Result<Done, Refusal> {
        let Some(standing) = self.next.alarms.get(&number).cloned() else {
            let id = alarm_id(self.next.lineage, number);
            return Err(Refusal::not_found("alarm", &id));
        };
        if standing.acknowledged.is_some() {
            return Ok(Done::Alarm(standing));
        }
        let acknowledged = AlarmEntry {
            acknowledged: Some((now, by)),
            ..(*standing).clone()
        };
        let kind = EventKind::AlarmAcknowledged;
        Ok(Done::Alarm(self.keep_alarm(acknowledged, Some(kind))))
    }

    /// Takes up an alarm that was known when the edge ended.
    pub(super) fn restore_alarm(&mut self, entry: AlarmEntry) {
        let number = entry.number;
        if entry.ended_at.is_none() {
            let key = (entry.draft.kind, entry.draft.subject());
            self.open_alarms.insert(key, number);
        }
        self.next.alarms.insert(number, Arc::new(entry));
    }

    fn keep_alarm(&mut self, entry: AlarmEntry, told: Option<EventKind>) -> Arc<AlarmEntry> {
        let entry = Arc::new(entry);
        self.next.alarms.insert(entry.number, entry.clone());
        if told == Some(EventKind::AlarmRaised) {
            self.post_alarm(&entry);
        }
        if let Some(kind) = told {
            let data = json!({"alarm": alarm_view(self.next.lineage, &entry)});
            self.happen(kind, data);
        }
        entry
    }

    /// Tells the drone of a plan that an operator was alarmed about it.
    fn post_alarm(&mut self, entry: &AlarmEntry) {
        let plan = entry.draft.plan.as_deref();
        if let Some(plan) = plan.and_then(|plan| self.next.plans.get(plan)).cloned() {
            let text = Arc::from(entry.draft.message.as_str());
            let content = Content::Alarm(entry.draft.kind, text);
            self.post(&plan, &entry.draft.causes, content);
        }
    }

    /// Those go first that have ended, then those that were acknowledged, then those about no plan, of which reports of invented
    /// drones make as many as they like, then the oldest.
    fn drop_alarms(&mut self) {
        let rank = |entry: &AlarmEntry| match (&entry.ended_at, &entry.acknowledged) {
            (Some(_), Some(_)) => 0,
            (Some(_), None) => 1,
            (None, Some(_)) => 2,
            (None, None) => 3,
        };
        let alarms = self.next.alarms.values();
        let place = |entry: &Arc<AlarmEntry>| {
            let is_about_plan = entry.draft.plan.is_some();
            (rank(entry), is_about_plan, entry.number)
        };
        let mut ranked: Vec<_> = alarms.map(place).collect();
        ranked.sort_unstable();
        for (.., number) in ranked.into_iter().take(DROPPED_AT_ONCE) {
            if let Some(entry) = self.next.alarms.remove(&number) {
                let key = (entry.draft.kind, entry.draft.subject());
                if self.open_alarms.get(&key) == Some(&number) {
                    self.open_alarms.remove(&key);
                }
            }
        }
    }
}

/// What causes something, as it follows what it causes; nothing where no cause is known, such as traffic alone.
fn in_brackets(causes: &[String]) -> String {
    match causes {
        [] => String::new(),
        causes => match causes.split_at_checked(CAUSES_NAMED) {
            Some((named, more @ [_, ..])) => {
                format!(" ({} and {} more)", named.join(", "), more.len())
            }
            _ => format!(" ({})", causes.join(", ")),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_names_ten_causes_and_counts_the_others() {
        let causes =
            |count: usize| -> Vec<String> { (1..=count).map(|it| it.to_string()).collect() };
        assert_eq!(in_brackets(&causes(0)), "");
        assert_eq!(in_brackets(&causes(2)), " (1, 2)");
        let ten = "1, 2, 3, 4, 5, 6, 7, 8, 9, 10";
        assert_eq!(in_brackets(&causes(10)), format!(" ({ten})"));
        assert_eq!(
            in_brackets(&causes(5_000)),
            format!(" ({ten} and 4990 more)")
        );
    }
}
