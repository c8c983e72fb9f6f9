//! Pages of the registry's log, judged: what they change, or why they are not taken over. Pure: a page in, a
//! verdict out.
//!
//! A page is good as a whole or not at all. Of a page that is not good, only what is stricter than before may be
//! taken over, each change by its own digest; what is lifted or relaxed comes from good pages only.

use super::followed::{
    BACKWARDS, CHECKSUM, Extent, FOREIGN_REGISTRY, OUT_OF_PLACE, REVISIONS, RegistryDelta,
    Rejected, Superseded, Tombstone, Verdict,
};
use super::ground::BaseNetwork;
use crate::upstream::published::{BodyFault, Published, check_weather, read_thing};
use crate::upstream::{RegistryCursor, Upstream};
use skyway_contract::{ChangeOperation, ChangesPage, LoggedChange, Nack, ObjectKind};
use skyway_planted::{self as planted, Bug};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What a follower goes by: the network it follows, and how zones without a margin are read.
#[derive(Clone, Debug)]
pub(crate) struct Follower {
    /// The id of the network at the registry.
    pub(crate) network: Arc<str>,
    /// By how much a zone is widened where it does not say, in metres.
    pub(crate) margin_m: f64,
}

/// The last change of each thing in a page.
type Last<'a> = BTreeMap<(ObjectKind, &'a str), &'a LoggedChange>;

/// A change that cannot be taken over.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) revision: u64,
    pub(super) object: Option<String>,
    pub(super) body: BodyFault,
}

impl Fault {
    pub(super) fn nack(self) -> Nack {
        Nack {
            revision: self.revision,
            code: self.body.code.to_owned(),
            object: self.object,
            reason: bounded(self.body.reason),
        }
    }
}

/// As much of a reason as a registry takes.
pub(super) fn bounded(mut reason: String) -> String {
    const REASON_BYTES_MAX: usize = 900;
    if reason.len() > REASON_BYTES_MAX {
        let end = (0..=REASON_BYTES_MAX).rev();
        let end = end
            .into_iter()
            .find(|&place| reason.is_char_boundary(place));
        reason.truncate(end.unwrap_or_default());
        reason.push('…');
    }
    reason
}

pub(super) fn named(kind: ObjectKind, id: &str) -> String {
    let mut name = format!("{} {id}", kind.name());
    const NAME_BYTES_MAX: usize = 250;
    while name.len() > NAME_BYTES_MAX {
        name.pop();
    }
    name
}

impl Follower {
    /// Judges a page that was asked for after a cursor.
    pub(crate) fn read_changes(
        &self,
        page: &ChangesPage,
        after: &Arc<RegistryCursor>,
        ground: &BaseNetwork,
    ) -> Verdict {
        let nack = |code: &str, reason: String| Nack {
            revision: page.revision,
            code: code.to_owned(),
            object: None,
            reason: bounded(reason),
        };
        let refuse = |nack: Nack, restrictions: Option<Box<RegistryDelta>>| {
            Verdict::Nack(Box::new(Rejected { nack, restrictions }))
        };
        if !page.is_intact() && !planted::is(Bug::AcceptBadChecksum) {
            let reason = "the page is not as its digests say".to_owned();
            let restrictions = self.restrictions(page, after, ground);
            return refuse(nack(CHECKSUM, reason), restrictions);
        }
        if let Some((code, reason)) = self.foreign(&page.registry_id, &page.network, Some(after)) {
            return refuse(nack(code, reason), None);
        }
        if page.epoch > after.epoch {
            return Verdict::Resync(format!("epoch {} has begun", page.epoch));
        }
        let leads_back = page.epoch < after.epoch || page.after < after.revision;
        if leads_back && planted::is(Bug::AcceptOlderRevision) {
            return self.fold_or_refuse(page, after, ground);
        }
        if leads_back {
            let reason = format!(
                "a page of {}-{} after {}-{} was followed already",
                page.epoch, page.after, after.epoch, after.revision
            );
            return refuse(nack(BACKWARDS, reason), None);
        }
        if page.after != after.revision {
            let reason = format!(
                "it begins after {}, not after {}",
                page.after, after.revision
            );
            return refuse(nack(OUT_OF_PLACE, reason), None);
        }
        if let Err(reason) = check_revisions(page) {
            let restrictions = self.restrictions(page, after, ground);
            return refuse(nack(REVISIONS, reason), restrictions);
        }
        if page.changes.is_empty() {
            return Verdict::Idle;
        }
        match before_network(page) {
            Some(first) => self.fold_or_refuse(&first, after, ground),
            None => self.fold_or_refuse(page, after, ground),
        }
    }

    fn fold_or_refuse(
        &self,
        page: &ChangesPage,
        after: &Arc<RegistryCursor>,
        ground: &BaseNetwork,
    ) -> Verdict {
        match self.fold(page, after, ground) {
            Ok(followed) => Verdict::Follow(Box::new(followed)),
            Err(fault) => {
                let restrictions = self.restrictions(page, after, ground);
                let nack = fault.nack();
                Verdict::Nack(Box::new(Rejected { nack, restrictions }))
            }
        }
    }

    /// Why something is not of the registry and network that are followed.
    pub(super) fn foreign(
        &self,
        registry_id: &str,
        network: &str,
        cursor: Option<&Arc<RegistryCursor>>,
    ) -> Option<(&'static str, String)> {
        if network != &*self.network {
            let reason = format!("it is of the network '{network}', not '{}'", self.network);
            return Some((FOREIGN_REGISTRY, reason));
        }
        let followed = cursor.filter(|cursor| *cursor.registry_id != *registry_id)?;
        if planted::is(Bug::AcceptForeignId) {
            return None;
        }
        let reason = format!(
            "it is of the registry {registry_id}; this edge follows {}",
            followed.registry_id
        );
        Some((FOREIGN_REGISTRY, reason))
    }

    /// What a good page changes.
    fn fold(
        &self,
        page: &ChangesPage,
        after: &Arc<RegistryCursor>,
        ground: &BaseNetwork,
    ) -> Result<RegistryDelta, Fault> {
        let network_changes = page
            .changes
            .iter()
            .filter(|change| change.kind == ObjectKind::Network);
        let bodies = network_changes
            .clone()
            .map(|change| (change.operation, change.body.as_deref().unwrap_or_default()));
        let network = ground.changed(bodies).map_err(|body| {
            let last = network_changes.clone().next_back();
            Fault {
                revision: last.map_or(page.revision, |change| change.revision),
                object: Some(ObjectKind::Network.name().to_owned()),
                body,
            }
        })?;
        let topology = network.as_ref().map_or_else(
            || ground.topology.clone(),
            |network| network.topology.clone(),
        );
        let (last, superseded) = folded(page);
        let mut followed = RegistryDelta {
            extent: Extent::Changes,
            after: Some(after.clone()),
            cursor: cursor_of(page),
            topology,
            network,
            superseded,
            puts: Vec::new(),
            lifts: Vec::new(),
            weather: None,
        };
        for change in last.into_values() {
            self.take(change, &mut followed).map_err(|body| Fault {
                revision: change.revision,
                object: Some(named(change.kind, &change.id)),
                body,
            })?;
        }
        Ok(followed)
    }

    /// Takes a change into what is to be followed.
    fn take(&self, change: &LoggedChange, followed: &mut RegistryDelta) -> Result<(), BodyFault> {
        let kind = change.kind;
        let upstream = upstream_of(change);
        let body = change.body.as_deref();
        match (kind, change.operation, body) {
            (ObjectKind::Network, _, _) => Ok(()),
            (_, ChangeOperation::Delete, None) => {
                if kind == ObjectKind::Weather {
                    return Err(BodyFault::of(kind, "weather is never lifted"));
                }
                if planted::is(Bug::PassOverTombstone) {
                    return Ok(());
                }
                let id = Arc::from(change.id.as_str());
                followed.lifts.push(Tombstone { kind, id, upstream });
                Ok(())
            }
            (ObjectKind::Weather, ChangeOperation::Put, Some(body)) => {
                check_weather(body, &followed.topology)?;
                followed.weather = Some(Arc::from(body));
                Ok(())
            }
            (_, ChangeOperation::Put, Some(body)) => {
                let topology = &followed.topology;
                let thing = read_thing(kind, &change.id, body, topology, self.margin_m)?;
                followed.puts.push(Published {
                    kind,
                    id: Arc::from(change.id.as_str()),
                    upstream,
                    body: Arc::from(body),
                    thing,
                });
                Ok(())
            }
            _ => Err(BodyFault::of(
                kind,
                "its operation and its body do not go together",
            )),
        }
    }

    /// What may be taken over of a batch whose network cannot be: things put that are right on the one in service.
    pub(super) fn without_network(
        &self,
        followed: RegistryDelta,
        ground: &BaseNetwork,
    ) -> Option<Box<RegistryDelta>> {
        let puts = followed.puts.into_iter().filter_map(|put| {
            let Published { kind, id, body, .. } = &put;
            let thing = read_thing(*kind, id, body, &ground.topology, self.margin_m).ok()?;
            Some(Published { thing, ..put })
        });
        let puts: Vec<Published> = puts.collect();
        let is_something = !puts.is_empty();
        let strict = RegistryDelta {
            extent: Extent::Restrictions,
            topology: ground.topology.clone(),
            network: None,
            superseded: Vec::new(),
            puts,
            lifts: Vec::new(),
            weather: None,
            ..followed
        };
        is_something.then(|| Box::new(strict))
    }

    /// What may be taken over of a page that is not good: things put that are right by themselves and not lifted later in it.
    fn restrictions(
        &self,
        page: &ChangesPage,
        after: &Arc<RegistryCursor>,
        ground: &BaseNetwork,
    ) -> Option<Box<RegistryDelta>> {
        if page.registry_id != *after.registry_id || page.network != *self.network {
            return None;
        }
        let mut followed = RegistryDelta {
            extent: Extent::Restrictions,
            after: Some(after.clone()),
            cursor: cursor_of(page),
            topology: ground.topology.clone(),
            network: None,
            superseded: Vec::new(),
            puts: Vec::new(),
            lifts: Vec::new(),
            weather: None,
        };
        let mut last: BTreeMap<(ObjectKind, &str), Option<Published>> = BTreeMap::new();
        for change in &page.changes {
            let is_new = change.epoch == after.epoch && change.revision > after.revision;
            if !is_new || change.sha256 != change.digest(&self.network) {
                continue;
            }
            let key = (change.kind, change.id.as_str());
            if change.operation == ChangeOperation::Delete {
                if planted::is(Bug::DeleteFromBadPage) {
                    // What cannot be read lifts nothing.
                    let _ = self.take(change, &mut followed);
                }
                last.insert(key, None);
                continue;
            }
            // What cannot be read leaves what was put before it.
            if self.take(change, &mut followed).is_ok()
                && let Some(put) = followed.puts.pop()
            {
                last.insert(key, Some(put));
            }
        }
        followed.puts = last.into_values().flatten().collect();
        followed.weather = None;
        let is_something = !followed.puts.is_empty() || !followed.lifts.is_empty();
        is_something.then(|| Box::new(followed))
    }
}

fn cursor_of(page: &ChangesPage) -> RegistryCursor {
    RegistryCursor {
        registry_id: Arc::from(page.registry_id.as_str()),
        epoch: page.epoch,
        revision: page.revision,
    }
}

fn upstream_of(change: &LoggedChange) -> Upstream {
    Upstream {
        epoch: change.epoch,
        revision: change.revision,
    }
}

/// What a page has before a network, where that lifts something: it may have no place on that network, and is lifted
/// before. What is left out comes with the next page.
fn before_network(page: &ChangesPage) -> Option<ChangesPage> {
    let changes = &page.changes;
    let lift = changes
        .iter()
        .position(|change| change.operation == ChangeOperation::Delete)?;
    let mut after_lift = changes[lift..].iter();
    let network = after_lift.find(|change| change.kind == ObjectKind::Network)?;
    let before = changes
        .iter()
        .take_while(|change| change.revision < network.revision);
    let before: Vec<LoggedChange> = before.cloned().collect();
    let revision = before.last()?.revision;
    Some(ChangesPage {
        registry_id: page.registry_id.clone(),
        network: page.network.clone(),
        checksum: page.checksum.clone(),
        changes: before,
        revision,
        ..*page
    })
}

/// The last change of each thing, and those that these supersede.
fn folded(page: &ChangesPage) -> (Last<'_>, Vec<Superseded>) {
    let mut last: Last<'_> = BTreeMap::new();
    let mut superseded = Vec::new();
    for change in &page.changes {
        let key = (change.kind, change.id.as_str());
        if let Some(before) = last.insert(key, change)
            && before.kind != ObjectKind::Network
        {
            superseded.push(Superseded {
                kind: before.kind,
                id: Arc::from(before.id.as_str()),
                operation: before.operation,
                body: before.body.as_deref().map(Arc::from),
                upstream: upstream_of(before),
            });
        }
    }
    (last, superseded)
}

/// Whole revisions one after the other, all of the epoch of the page.
fn check_revisions(page: &ChangesPage) -> Result<(), String> {
    let mut reached = page.after;
    for change in &page.changes {
        if change.epoch != page.epoch {
            return Err(format!(
                "revision {} is of epoch {}, the page of epoch {}",
                change.revision, change.epoch, page.epoch
            ));
        }
        let follows = change.revision == reached + 1;
        let goes_on = change.revision == reached && reached > page.after;
        if !follows && !goes_on {
            return Err(format!(
                "revision {} comes after revision {reached}",
                change.revision
            ));
        }
        reached = change.revision;
    }
    if reached != page.revision || page.head < page.revision {
        return Err(format!(
            "it ends with revision {reached}, and says {} of {}",
            page.revision, page.head
        ));
    }
    Ok(())
}
