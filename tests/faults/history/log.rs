//! The operations of a run against the log that is there at its end.

use super::{Act, Holding, Logged, Operation, Outcome, Seen, Version, holding_at};
use std::collections::{BTreeMap, BTreeSet};

/// A run of a registry: what was done, and what is there.
#[derive(Clone, Debug, Default)]
pub(crate) struct Run {
    pub(crate) operations: Vec<Operation>,
    /// All changes of zones, in the order of the log.
    pub(crate) log: Vec<Logged>,
    /// The revisions that the log has, of anything.
    pub(crate) revisions: Vec<u64>,
    /// What the registry says that holds.
    pub(crate) holding: Holding,
    /// Where a backup was restored that ends with a version: what came after it in its epoch is lost, and known to be.
    pub(crate) restored: Vec<Version>,
}

impl Run {
    /// Everything that must not have happened; nothing where all is well.
    pub(crate) fn violations(&self) -> Vec<String> {
        let mut violations = Vec::new();
        self.check_revisions(&mut violations);
        self.check_acknowledged(&mut violations);
        self.check_explained(&mut violations);
        self.check_order(&mut violations);
        self.check_reads(&mut violations);
        self.check_holding(&mut violations);
        violations
    }

    fn is_lost(&self, version: Version) -> bool {
        self.restored
            .iter()
            .any(|end| end.epoch == version.epoch && version.revision > end.revision)
    }

    /// Revisions follow each other without a gap, and none comes twice.
    fn check_revisions(&self, violations: &mut Vec<String>) {
        for pair in self.revisions.windows(2) {
            if pair[1] != pair[0] + 1 {
                violations.push(format!("revision {} follows {}", pair[1], pair[0]));
            }
        }
    }

    /// What was acknowledged is in the log, as the version that the answer said.
    fn check_acknowledged(&self, violations: &mut Vec<String>) {
        let by_id = self.by_id();
        for operation in self
            .operations
            .iter()
            .filter(|operation| operation.is_done())
        {
            let Outcome::Done(Some(version)) = operation.outcome else {
                continue;
            };
            let changes = by_id.get(operation.act.id()).into_iter().flatten();
            let found = changes.into_iter().find(|change| {
                change.version == version && change.tag.as_deref() == operation.act.tag()
            });
            match (found, self.is_lost(version)) {
                (None, false) => violations.push(format!("acknowledged and lost: {operation}")),
                (Some(_), true) => {
                    violations.push(format!("it was not in the backup: {operation}"));
                }
                _ => {}
            }
        }
    }

    /// The changes of each zone.
    fn by_id(&self) -> BTreeMap<&str, Vec<&Logged>> {
        let mut by_id: BTreeMap<&str, Vec<&Logged>> = BTreeMap::new();
        for change in &self.log {
            by_id.entry(&change.id).or_default().push(change);
        }
        by_id
    }

    /// Every change was made by one operation, and by no refused one.
    fn check_explained(&self, violations: &mut Vec<String>) {
        let mut by_id: BTreeMap<&str, Vec<&Operation>> = BTreeMap::new();
        for operation in &self.operations {
            by_id.entry(operation.act.id()).or_default().push(operation);
        }
        let mut made = BTreeSet::new();
        for change in &self.log {
            if let Some(tag) = &change.tag
                && !made.insert(tag)
            {
                violations.push(format!("made twice: {change:?}"));
            }
            let by = |operation: &Operation| {
                let is_it = match &operation.act {
                    Act::Put { .. } | Act::Delete { .. } => {
                        operation.act.tag() == change.tag.as_deref()
                    }
                    Act::Read { .. } => false,
                };
                let may_have = match operation.outcome {
                    // Asked again after a backup was restored, it was done once more; a later backup may have brought
                    // back what was done the first time.
                    Outcome::Done(version) => version
                        .is_none_or(|it| it == change.version || it.epoch > change.version.epoch),
                    Outcome::Unknown => true,
                    Outcome::Seen(_) | Outcome::Refused(_) => false,
                };
                is_it && may_have
            };
            let mut those = by_id.get(&*change.id).into_iter().flatten();
            if !those.any(|operation| by(operation)) {
                violations.push(format!("no party did it, or it was refused: {change:?}"));
            }
        }
    }

    /// What was acknowledged before another began comes before it in the log. What was sent again began when it was
    /// sent first.
    fn check_order(&self, violations: &mut Vec<String>) {
        let version = |operation: &Operation| match operation.outcome {
            Outcome::Done(Some(version)) if !self.is_lost(version) => Some(version),
            _ => None,
        };
        let mut began: BTreeMap<&str, u64> = BTreeMap::new();
        for operation in &self.operations {
            if let Some(tag) = operation.act.tag() {
                let first = began.entry(tag).or_insert(operation.began);
                *first = operation.began.min(*first);
            }
        }
        let began = |operation: &Operation| {
            let tag = operation.act.tag();
            tag.map_or(operation.began, |tag| began[tag])
        };
        let mut done: Vec<(&Operation, Version)> = self
            .operations
            .iter()
            .filter_map(|operation| Some((operation, version(operation)?)))
            .collect();
        done.sort_by_key(|(operation, _)| began(operation));
        // By the time each began, the highest version acknowledged before.
        let mut ends: Vec<(u64, Version)> = done
            .iter()
            .filter_map(|(operation, version)| Some((operation.ended?, *version)))
            .collect();
        ends.sort_unstable();
        let mut ends = ends.into_iter().peekable();
        let mut highest: Option<Version> = None;
        for (operation, version) in done {
            while let Some((_, earlier)) = ends.next_if(|(ended, _)| *ended < began(operation)) {
                highest = highest.max(Some(earlier));
            }
            if let Some(highest) = highest.filter(|highest| *highest >= version) {
                violations.push(format!("{highest} was acknowledged before: {operation}"));
            }
        }
    }

    /// A read shows what held at some revision, and at none older than what anyone was acknowledged or had read before
    /// it began. What was read of a life that a backup ended is not looked at.
    fn check_reads(&self, violations: &mut Vec<String>) {
        if !self.restored.is_empty() {
            return;
        }
        let by_id = self.by_id();
        let shown = self.operations.iter();
        let shown = shown.filter_map(|it| Some((it.ended?, version_of(it)?)));
        let mut shown: Vec<(u64, Version)> = shown.collect();
        shown.sort_unstable();
        let mut reads: Vec<(&Operation, &Option<Seen>)> = Vec::new();
        for operation in &self.operations {
            if let Outcome::Seen(seen) = &operation.outcome {
                reads.push((operation, seen));
            }
        }
        reads.sort_by_key(|(read, _)| read.began);
        let mut shown = shown.into_iter().peekable();
        let mut floor: Option<Version> = None;
        for (read, seen) in reads {
            while let Some((_, version)) = shown.next_if(|(ended, _)| *ended < read.began) {
                floor = floor.max(Some(version));
            }
            let changes = by_id.get(read.act.id()).map_or(&[][..], Vec::as_slice);
            let tag = seen.as_ref().map(|seen| seen.tag.as_str());
            if !held(changes, tag, floor) {
                violations.push(format!("not what held at {floor:?} or later: {read}"));
            }
        }
    }

    /// What is said to hold is what the log makes.
    fn check_holding(&self, violations: &mut Vec<String>) {
        let made = holding_at(&self.log, u64::MAX);
        for (id, tag) in &made {
            if self.holding.get(id) != Some(tag) {
                let found = self.holding.get(id);
                violations.push(format!("zone {id} is {tag} by the log, and {found:?}"));
            }
        }
        for id in self.holding.keys().filter(|id| !made.contains_key(*id)) {
            violations.push(format!("zone {id} holds, and is not in the log"));
        }
    }
}

/// Whether an object, by its changes, was so at a version or later.
fn held(changes: &[&Logged], tag: Option<&str>, floor: Option<Version>) -> bool {
    let is_after = |end: Option<&&Logged>| match (end, floor) {
        (Some(end), Some(floor)) => end.version > floor,
        _ => true,
    };
    if tag.is_none() && is_after(changes.first()) {
        return true;
    }
    let mut states = changes.iter().enumerate();
    states.any(|(place, change)| change.tag.as_deref() == tag && is_after(changes.get(place + 1)))
}

/// The version that an operation has shown to be there.
fn version_of(operation: &Operation) -> Option<Version> {
    match &operation.outcome {
        Outcome::Done(version) => *version,
        Outcome::Seen(seen) => seen.as_ref()?.version,
        Outcome::Refused(_) | Outcome::Unknown => None,
    }
}
