//! The messages of a snapshot, as their drones are told them.

use super::mailbox::{Content, DECLINED_TEXT, MailEntry, WITHOUT_WAY_TEXT, message_id};
use crate::planner::Version;
use crate::plans::entry::PlanEntry;
use crate::snapshot::Snapshot;
use crate::{views, words};
use skyway_contract as wire;
use skyway_engine::network::Topology;
use std::borrow::Cow;
use std::ops::Bound;
use std::sync::Arc;

impl Snapshot {
    /// The messages of a drone that come after a number.
    pub(crate) fn mail_of(
        &self,
        drone: &Arc<str>,
        after: u64,
    ) -> impl Iterator<Item = &Arc<MailEntry>> {
        let from = Bound::Excluded((drone.clone(), after));
        let until = Bound::Included((drone.clone(), u64::MAX));
        self.mail.range((from, until)).map(|(_, entry)| entry)
    }

    /// A message as its drone is told it; none where the version that it speaks of is there no more.
    pub(crate) fn told_message(
        &self,
        entry: &MailEntry,
        stamp: wire::Stamp<'static>,
    ) -> Option<wire::DroneMessage<'static>> {
        let plan = self.plans.get(&entry.plan);
        let version = entry.content.version_number();
        let version = version.map(|number| version_of(self.topology(), plan?, number));
        if version.as_ref().is_some_and(Option::is_none) {
            return None;
        }
        let (unsafe_way, ended_as, alarm, text) = match &entry.content {
            Content::NoWay(unsafe_way) => {
                let way = unsafe_way.as_deref();
                let way = way.and_then(|way| serde_json::from_str(way).ok());
                (way, None, None, Some(WITHOUT_WAY_TEXT.into()))
            }
            Content::Declined => (None, None, None, Some(DECLINED_TEXT.into())),
            Content::Ended(how) => (None, Some(*how), None, None),
            Content::Alarm(kind, text) => (None, None, Some(*kind), Some(words::text(text))),
            _ => (None, None, None, None),
        };
        Some(wire::DroneMessage {
            id: Cow::Owned(message_id(self.lineage, entry.number)),
            drone_id: words::text(&entry.drone),
            kind: entry.content.kind(),
            at: words::instant(entry.at),
            plan_id: words::text(&entry.plan),
            version: version.flatten(),
            causes: entry.causes.iter().cloned().map(Cow::Owned).collect(),
            unsafe_way,
            ended_as,
            alarm,
            text,
            stamp,
        })
    }
}

/// A version of a plan that was sent and has not ended.
fn version_of(
    topology: &Topology,
    plan: &PlanEntry,
    number: u32,
) -> Option<wire::PlanVersion<'static>> {
    let is_it = |version: &&Arc<Version>| version.number == number;
    let version = plan.versions().find(is_it)?;
    Some(views::version(topology, version))
}
