//! Closures whose time is over: lifted after a while, so that what reports bring does not fill the registry.

use super::Registry;
use super::store::{Append, Expectation, KeptReply, NetworkState, NewChange, ObjectsQuery};
use super::topologies::version_of;
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{ChangeOperation, LoggedChange, ObjectKind, PublishedClosure};
use skyway_service::refusal::Refusal;
use std::sync::Arc;

/// How long a closure stays after its end: edges whose clocks differ still end it by themselves.
const KEPT: SignedDuration = SignedDuration::from_hours(1);
/// How many are lifted in one revision.
const AT_ONCE: u64 = 1_000;
/// Who lifts them, in the log.
const SUBJECT: &str = "registry";

impl Registry {
    /// Lifts the closures of a network that have been over for a while.
    pub(super) async fn lift_ended(self: &Arc<Self>, state: &NetworkState) -> Result<(), Refusal> {
        if state.closures == 0 {
            return Ok(());
        }
        let now = self.clock.now();
        let mut after = None;
        loop {
            let query = ObjectsQuery {
                network: state.id.clone(),
                at: None,
                kind: Some(ObjectKind::Closure),
                after: after.take(),
                limit: AT_ONCE,
                bytes: self.settings.page_bytes,
            };
            let Some(read) = self.store.objects(&query).await? else {
                return Ok(());
            };
            after = read.objects.last().map(|last| (last.kind, last.id.clone()));
            let ended = read
                .objects
                .iter()
                .filter(|object| over_for(object, now).is_some_and(|over_for| over_for > KEPT));
            let ended: Vec<&LoggedChange> = ended.collect();
            if !ended.is_empty() {
                // Where one has been extended meanwhile nothing is lifted; the next visit looks again.
                self.commit(lifting(&state.id, &ended, now)).await?;
            }
            if !read.has_more {
                return Ok(());
            }
        }
    }
}

/// Whether an object is a closure whose end has come.
pub(super) fn is_over(object: &LoggedChange, now: Timestamp) -> bool {
    over_for(object, now).is_some_and(|over_for| over_for > SignedDuration::ZERO)
}

/// For how long a closure has been over; none of what has no end, and of all that is no closure.
fn over_for(object: &LoggedChange, now: Timestamp) -> Option<SignedDuration> {
    if object.kind != ObjectKind::Closure {
        return None;
    }
    let closure: PublishedClosure = serde_json::from_str(object.body.as_deref()?).ok()?;
    let until: Timestamp = closure.until?.parse().ok()?;
    Some(now.duration_since(until))
}

fn lifting(network: &str, ended: &[&LoggedChange], now: Timestamp) -> Append {
    let expects = ended.iter().map(|object| Expectation {
        kind: object.kind,
        id: object.id.clone(),
        version: Some(version_of(object)),
    });
    let changes = ended.iter().map(|object| NewChange {
        kind: object.kind,
        id: object.id.clone(),
        operation: ChangeOperation::Delete,
        body: None,
    });
    Append {
        network: network.to_owned(),
        creates: None,
        subject: SUBJECT.to_owned(),
        at: now.to_string(),
        head: None,
        expects: expects.collect(),
        changes: changes.collect(),
        zones_max: u64::MAX,
        closures_max: u64::MAX,
        key: None,
        reply: Box::new(|_, _| KeptReply {
            created: false,
            etag: None,
            id: String::new(),
            body: String::new(),
        }),
    }
}
