//! Alarms: what an operator has to look at, as it is kept, listed and acknowledged.

use crate::entries::{AlarmDraft, AlarmEntry};
use crate::views::{alarm_id, alarm_view};
use crate::writer::commands::{Command, Done, unexpected};
use crate::{Edge, views};
use skyway_contract::{self as wire, AlarmKind};
use skyway_service::access::Caller;
use skyway_service::intake::{PageRequest, filtered, token};
use skyway_service::refusal::Refusal;
use std::sync::Arc;

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
        let after = views::number_after(&page, "alarm", self.lineage)?;
        let (told, next) = filtered(&snapshot.alarms, after, page.size, |it| filter.passes(it));
        Ok(wire::Alarms {
            next_page_token: next.map(|number| token(&alarm_id(self.lineage, number))),
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
        self: &Arc<Self>,
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
