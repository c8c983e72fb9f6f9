//! What is in a store in memory: the logs of its networks, and what is kept beside them.

use skyway::registry::store::{
    Append, Appended, ChangesQuery, Compaction, EdgeHeard, Expectation, Identity, KeptReply,
    NetworkState, NewChange, ObjectsQuery, ObjectsRead, Version,
};
use skyway::wire::{ChangeOperation, LoggedChange, ObjectKind};
use std::collections::BTreeMap;

/// A network in the store.
#[derive(Clone, Debug)]
pub(super) struct Network {
    pub(super) state: NetworkState,
    log: Vec<LoggedChange>,
    /// The log as it would be had nothing been dropped.
    annals: Vec<LoggedChange>,
}

/// An answer that is kept.
#[derive(Clone, Debug)]
pub(super) struct Reply {
    pub(super) fingerprint: String,
    at_ms: i64,
    pub(super) kept: KeptReply,
}

/// All that is in a store.
#[derive(Clone, Debug)]
pub(crate) struct Contents {
    pub(super) identity: Identity,
    pub(super) networks: BTreeMap<String, Network>,
    pub(super) replies: BTreeMap<(String, String), Reply>,
    pub(super) edges: BTreeMap<(String, String), EdgeHeard>,
}

impl Contents {
    /// All that was ever committed to a network, of which followers may be told less.
    pub(crate) fn annals(&self, network: &str) -> &[LoggedChange] {
        let network = self.networks.get(network);
        network.map_or(&[], |network| &network.annals)
    }

    pub(crate) fn identity(&self) -> &Identity {
        &self.identity
    }

    pub(crate) fn head(&self, network: &str) -> u64 {
        self.networks.get(network).map_or(0, |it| it.state.head)
    }
}

impl Network {
    fn new(id: &str, epoch: u64) -> Self {
        let state = NetworkState {
            id: id.to_owned(),
            head: 0,
            oldest: 0,
            topology: Version { epoch, revision: 0 },
            zones: 0,
            closures: 0,
        };
        Self {
            state,
            log: Vec::new(),
            annals: Vec::new(),
        }
    }

    /// The last change of an object up to a revision, a tombstone too.
    pub(super) fn last(&self, kind: ObjectKind, id: &str, at: u64) -> Option<&LoggedChange> {
        let mut changes = self.log.iter().rev();
        changes.find(|it| it.kind == kind && it.id == id && it.revision <= at)
    }

    fn version(&self, kind: ObjectKind, id: &str) -> Option<Version> {
        let last = self.last(kind, id, u64::MAX)?;
        (last.operation != ChangeOperation::Delete).then_some(Version {
            epoch: last.epoch,
            revision: last.revision,
        })
    }

    fn holds(&self, expects: &[Expectation]) -> bool {
        let mut expects = expects.iter();
        expects.all(|it| self.version(it.kind, &it.id) == it.version)
    }

    fn count(&mut self, change: &NewChange, version: Version) {
        let was = self.version(change.kind, &change.id).is_some();
        let number = match change.kind {
            ObjectKind::Network => {
                self.state.topology = version;
                return;
            }
            ObjectKind::Weather => return,
            ObjectKind::Zone => &mut self.state.zones,
            ObjectKind::Closure => &mut self.state.closures,
        };
        match (was, change.operation != ChangeOperation::Delete) {
            (false, true) => *number += 1,
            (true, false) => *number -= 1,
            _ => {}
        }
    }

    fn put_in(&mut self, append: &Append, change: &NewChange, version: Version) {
        let mut logged = LoggedChange {
            revision: version.revision,
            epoch: version.epoch,
            at: append.at.clone(),
            subject: append.subject.clone(),
            kind: change.kind,
            id: change.id.clone(),
            operation: change.operation,
            body: change.body.clone(),
            sha256: String::new(),
        };
        logged.sha256 = logged.digest(&append.network);
        self.log.push(logged.clone());
        self.annals.push(logged);
    }

    /// The last whole network up to a revision, and the patches after it.
    pub(super) fn parts(&self, at: u64) -> Vec<LoggedChange> {
        let network = |it: &&LoggedChange| it.kind == ObjectKind::Network && it.revision <= at;
        let changes: Vec<&LoggedChange> = self.log.iter().filter(network).collect();
        let whole = changes
            .iter()
            .rposition(|it| it.operation == ChangeOperation::Put);
        let parts = whole.map_or(&[][..], |place| &changes[place..]);
        parts.iter().map(|&it| it.clone()).collect()
    }

    /// What holds at a revision, without the network.
    fn holding(&self, kind: Option<ObjectKind>, at: u64) -> Vec<&LoggedChange> {
        let mut holding = BTreeMap::new();
        for change in &self.log {
            let is_asked = kind.is_none_or(|kind| change.kind == kind);
            if change.revision > at || change.kind == ObjectKind::Network || !is_asked {
                continue;
            }
            let key = (change.kind.name(), change.id.as_str());
            match change.operation {
                ChangeOperation::Delete => holding.remove(&key),
                _ => holding.insert(key, change),
            };
        }
        holding.into_values().collect()
    }

    pub(super) fn changes(&self, query: &ChangesQuery) -> Vec<LoggedChange> {
        if !(self.state.oldest..self.state.head).contains(&query.after) {
            return Vec::new();
        }
        let log: Vec<&LoggedChange> = self.log.iter().collect();
        let later = log.iter().filter(|it| it.revision > query.after);
        let later: Vec<&LoggedChange> = later.copied().collect();
        let (mut page, mut bytes): (Vec<LoggedChange>, u64) = (Vec::new(), 0);
        for revision in later.chunk_by(|one, next| one.revision == next.revision) {
            let more: u64 = revision.iter().map(|it| size_bytes(it)).sum();
            let count = (page.len() + revision.len()) as u64;
            if !page.is_empty() && (count > query.changes || bytes + more > query.bytes) {
                break;
            }
            bytes += more;
            page.extend(revision.iter().map(|&it| it.clone()));
        }
        page
    }

    pub(super) fn compact(&mut self, compaction: &Compaction) {
        let Some(base) = self.parts(compaction.oldest).pop() else {
            return;
        };
        let (oldest, base_revision) = (compaction.oldest, compaction.base_revision);
        if base.revision != base_revision {
            return;
        }
        let log = std::mem::take(&mut self.log);
        let is_superseded = |change: &LoggedChange| {
            let later = |it: &LoggedChange| it.revision > change.revision && it.revision <= oldest;
            let mut log = log.iter();
            log.any(|it| it.kind == change.kind && it.id == change.id && later(it))
        };
        let kept = log.iter().filter(|change| match change.kind {
            ObjectKind::Network => change.revision >= base_revision,
            _ if change.revision > oldest => true,
            _ => change.operation != ChangeOperation::Delete && !is_superseded(change),
        });
        self.log = kept.cloned().collect();
        for change in &mut self.log {
            if change.kind == ObjectKind::Network && change.revision == base_revision {
                change.operation = ChangeOperation::Put;
                change.body = Some(compaction.base.clone());
                change.sha256 = change.digest(&compaction.network);
            }
        }
        self.state.oldest = self.state.oldest.max(oldest);
    }
}

fn size_bytes(change: &LoggedChange) -> u64 {
    change.body.as_ref().map_or(0, String::len) as u64
}

impl Contents {
    pub(super) fn new(registry_id: &str) -> Self {
        Self {
            identity: Identity {
                registry_id: registry_id.to_owned(),
                epoch: 1,
            },
            networks: BTreeMap::new(),
            replies: BTreeMap::new(),
            edges: BTreeMap::new(),
        }
    }

    pub(super) fn append(&mut self, append: &Append) -> Appended {
        if let Some(key) = &append.key
            && let Some(reply) = self.replies.get(&(key.subject.clone(), key.key.clone()))
        {
            return Appended::Repeated {
                fingerprint: reply.fingerprint.clone(),
                reply: reply.kept.clone(),
            };
        }
        let found = self.networks.get(&append.network).cloned();
        let is_elsewhere = |it: &Network| append.head.is_some_and(|head| head != it.state.head);
        if found.as_ref().is_some_and(is_elsewhere) {
            return Appended::Moved;
        }
        let before = match (found, append.creates) {
            (Some(network), None) => network,
            (None, Some(limit)) if self.networks.len() as u64 >= limit => {
                let kind = ObjectKind::Network;
                return Appended::Bounded { kind, limit };
            }
            (None, Some(_)) => Network::new(&append.network, self.identity.epoch),
            _ => return Appended::Moved,
        };
        if !before.holds(&append.expects) {
            return Appended::Moved;
        }
        let version = Version {
            epoch: self.identity.epoch,
            revision: before.state.head + 1,
        };
        let mut after = before.clone();
        after.state.head = version.revision;
        for change in &append.changes {
            after.count(change, version);
        }
        if let Some(bounded) = beyond_bounds(append, &before.state, &after.state) {
            return bounded;
        }
        for change in &append.changes {
            after.put_in(append, change, version);
        }
        let reply = (append.reply)(&self.identity, version);
        if let Some(key) = &append.key {
            let kept = Reply {
                fingerprint: key.fingerprint.clone(),
                at_ms: key.at_ms,
                kept: reply.clone(),
            };
            let place = (key.subject.clone(), key.key.clone());
            self.replies.insert(place, kept);
        }
        self.networks.insert(append.network.clone(), after);
        Appended::Done { version, reply }
    }

    pub(super) fn forget_replies(&mut self, before_ms: i64, bytes_max: u64) {
        self.replies.retain(|_, reply| reply.at_ms >= before_ms);
        let mut taken: BTreeMap<String, u64> = BTreeMap::new();
        for ((subject, _), reply) in &self.replies {
            *taken.entry(subject.clone()).or_default() += reply.kept.body.len() as u64;
        }
        let mut taken: Vec<(u64, String)> = taken.into_iter().map(|(of, by)| (by, of)).collect();
        taken.sort();
        let (mut room, mut subjects) = (bytes_max, taken.len() as u64);
        for (bytes, subject) in taken {
            let share = room / subjects;
            if bytes > share {
                self.forget_oldest(&subject, share);
            }
            room -= bytes.min(share);
            subjects -= 1;
        }
    }

    fn forget_oldest(&mut self, subject: &str, bytes_max: u64) {
        let own = self.replies.iter().filter(|((of, _), _)| of == subject);
        let mut by_age: Vec<&Reply> = own.map(|(_, reply)| reply).collect();
        by_age.sort_by_key(|reply| std::cmp::Reverse(reply.at_ms));
        let mut bytes = 0;
        let beyond = by_age.into_iter().find(|reply| {
            bytes += reply.kept.body.len() as u64;
            bytes > bytes_max
        });
        if let Some(cutoff_ms) = beyond.map(|reply| reply.at_ms) {
            let stays = |of: &str, at_ms: i64| of != subject || at_ms > cutoff_ms;
            self.replies.retain(|(of, _), reply| stays(of, reply.at_ms));
        }
    }
}

fn beyond_bounds(append: &Append, before: &NetworkState, after: &NetworkState) -> Option<Appended> {
    let bounded = |kind, limit| Some(Appended::Bounded { kind, limit });
    let (zones, closures) = (append.zones_max, append.closures_max);
    if after.zones > before.zones && after.zones > zones {
        return bounded(ObjectKind::Zone, zones);
    }
    if after.closures > before.closures && after.closures > closures {
        return bounded(ObjectKind::Closure, closures);
    }
    None
}

pub(super) fn objects(identity: &Identity, network: &Network, query: &ObjectsQuery) -> ObjectsRead {
    let at = query.at.unwrap_or(network.state.head);
    let is_kept = (network.state.oldest..=network.state.head).contains(&at);
    let all = match is_kept {
        true => network.holding(query.kind, at),
        false => Vec::new(),
    };
    let is_restriction = |it: &&&LoggedChange| it.kind != ObjectKind::Weather;
    let restrictions = all.iter().filter(is_restriction).count() as u64;
    let (mut found, mut bytes, mut has_more) = (Vec::new(), 0, false);
    let is_after = |change: &LoggedChange| {
        let after = query.after.as_ref();
        after.is_none_or(|(kind, id)| (change.kind.name(), &change.id) > (kind.name(), id))
    };
    for &change in all.iter().filter(|change| is_after(change)) {
        let more = size_bytes(change);
        let is_full = found.len() as u64 >= query.limit || bytes + more > query.bytes;
        if !found.is_empty() && is_full {
            has_more = true;
            break;
        }
        bytes += more;
        found.push(change.clone());
    }
    ObjectsRead {
        identity: identity.clone(),
        state: network.state.clone(),
        at,
        count: all.len() as u64,
        restrictions,
        objects: found,
        has_more,
    }
}
