//! Alarms: what an operator has to look at, as it is kept, listed and acknowledged.

use super::Edge;
use super::commands::{Command, Done};
use super::snapshot::Snapshot;
use super::views;
use super::zones::unexpected;
use crate::access::Caller;
use crate::intake::{PageRequest, token};
use crate::refusal::Refusal;
use crate::wire::{self, AlarmKind};
use jiff::Timestamp;
use std::borrow::Cow;
use std::ops::Bound;
use std::sync::Arc;

/// At most this many causes of one alarm are told.
pub(super) const CAUSES_MAX: usize = 100;

/// What is to be told to an operator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct AlarmDraft {
    pub(super) kind: AlarmKind,
    pub(super) plan: Option<Arc<str>>,
    pub(super) drone: Option<Arc<str>>,
    pub(super) recomposition: Option<Arc<str>>,
    /// Ids of the zones and closures that cause it.
    pub(super) causes: Vec<String>,
    pub(super) message: String,
}

impl AlarmDraft {
    /// An alarm about nothing in particular.
    pub(super) fn new(kind: AlarmKind, message: impl Into<String>) -> Self {
        Self {
            kind,
            plan: None,
            drone: None,
            recomposition: None,
            causes: Vec::new(),
            message: message.into(),
        }
    }

    /// What it is about: alarms of one kind about the same are one alarm.
    pub(super) fn subject(&self) -> Arc<str> {
        let named = match (&self.plan, &self.drone) {
            (Some(plan), _) => format!("plan:{plan}"),
            (None, Some(drone)) => format!("drone:{drone}"),
            (None, None) => format!("causes:{}", self.causes.join(",")),
        };
        Arc::from(named)
    }
}

/// An alarm.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct AlarmEntry {
    pub(super) number: u64,
    /// What it says now.
    pub(super) draft: AlarmDraft,
    pub(super) raised_at: Timestamp,
    pub(super) renewed_at: Timestamp,
    pub(super) count: u64,
    /// When, and by whom.
    pub(super) acknowledged: Option<(Timestamp, Arc<str>)>,
    pub(super) ended_at: Option<Timestamp>,
}

/// Which alarms are asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AlarmFilter {
    /// Those of this kind.
    pub kind: Option<AlarmKind>,
    /// Those that an operator has acknowledged, or has not.
    pub acknowledged: Option<bool>,
    /// Those whose cause has ended, or has not.
    pub ended: Option<bool>,
}

impl AlarmFilter {
    fn passes(&self, entry: &AlarmEntry) -> bool {
        let is = |wanted: Option<bool>, found: bool| wanted.is_none_or(|wanted| wanted == found);
        self.kind.is_none_or(|kind| kind == entry.draft.kind)
            && is(self.acknowledged, entry.acknowledged.is_some())
            && is(self.ended, entry.ended_at.is_some())
    }
}

/// The id of an alarm.
pub(super) fn alarm_id(lineage: u64, number: u64) -> String {
    format!("alarm-{lineage}-{number}")
}

/// An alarm in the words of the wire.
pub(super) fn alarm_view(lineage: u64, entry: &AlarmEntry) -> wire::Alarm<'static> {
    let draft = &entry.draft;
    let acknowledged = entry.acknowledged.as_ref();
    let causes = draft.causes.iter().take(CAUSES_MAX);
    wire::Alarm {
        id: Cow::Owned(alarm_id(lineage, entry.number)),
        kind: draft.kind,
        at: views::instant(entry.raised_at),
        renewed_at: views::instant(entry.renewed_at),
        count: entry.count,
        plan_id: draft.plan.as_deref().map(views::text),
        drone_id: draft.drone.as_deref().map(views::text),
        recomposition_id: draft.recomposition.as_deref().map(views::text),
        causes: causes.map(|id| views::text(id)).collect(),
        message: views::text(&draft.message),
        acknowledged_at: acknowledged.map(|(at, _)| views::instant(*at)),
        acknowledged_by: acknowledged.map(|(_, by)| views::text(by)),
        ended_at: entry.ended_at.map(views::instant),
    }
}

impl Snapshot {
    /// How many alarms of each kind were raised since the start.
    pub(super) fn alarm_counts(&self) -> impl Iterator<Item = (AlarmKind, u64)> {
        AlarmKind::ALL.into_iter().zip(self.alarms_raised)
    }
}

impl Edge {
    /// A page of alarms, oldest first.
    ///
    /// # Errors
    /// When the page is not one.
    pub fn alarms(
        &self,
        _caller: &Caller,
        page: &PageRequest,
        filter: AlarmFilter,
    ) -> Result<wire::Alarms<'static>, Refusal> {
        let page = page.check()?;
        let snapshot = self.snapshot();
        let after = page.after.as_deref();
        let after = after.and_then(|id| views::number_in(id, "alarm", self.lineage));
        let from = after.map_or(Bound::Unbounded, Bound::Excluded);
        let entries = snapshot.alarms.range((from, Bound::Unbounded));
        let mut entries = entries.filter(|(_, entry)| filter.passes(entry));
        let told: Vec<&Arc<AlarmEntry>> = entries
            .by_ref()
            .take(page.size)
            .map(|(_, entry)| entry)
            .collect();
        let last = told.last().filter(|_| entries.next().is_some());
        Ok(wire::Alarms {
            next_page_token: last.map(|entry| token(&alarm_id(self.lineage, entry.number))),
            alarms: told
                .iter()
                .map(|entry| alarm_view(self.lineage, entry))
                .collect(),
            stamp: self.stamp_of(&snapshot),
        })
    }

    /// An operator has seen an alarm. Once more changes nothing.
    ///
    /// # Errors
    /// When there is none.
    pub async fn acknowledge_alarm(
        self: &std::sync::Arc<Self>,
        caller: &Caller,
        id: &str,
    ) -> Result<wire::Alarm<'static>, Refusal> {
        let number = views::number_in(id, "alarm", self.lineage);
        let number = number.ok_or_else(|| Refusal::not_found("alarm", id))?;
        let command = Command::AcknowledgeAlarm {
            number,
            by: caller.subject.clone(),
        };
        let (outcome, _) = self.command(command.by(caller)).await?;
        match outcome.done {
            Done::Alarm(entry) => Ok(alarm_view(self.lineage, &entry)),
            _ => Err(unexpected()),
        }
    }

    /// Alarms an operator from beside the writer.
    pub(super) fn raise_alarm(&self, draft: AlarmDraft) {
        let kind = draft.kind.name();
        if let Err(refusal) = self.writer.tell(Command::RaiseAlarm(Box::new(draft))) {
            tracing::error!(kind, %refusal, "an alarm could not be raised");
        }
    }
}
