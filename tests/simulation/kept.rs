//! What was acknowledged at an edge is in force there until it is lifted, and at the registry in the end.
//!
//! Looked at are the zones that only the operator of that edge changes. What came of an operation without an answer
//! is not known until the next one. What a backup of the registry did not have is lost.

use crate::history::edges::Sight;
use crate::history::{Holding, Logged, Operation, Outcome};
use std::collections::{BTreeMap, BTreeSet};

/// A run as this looks at it.
pub(crate) struct Kept<'a> {
    pub(crate) operations: &'a [Operation],
    pub(crate) sights: &'a [Sight],
    /// What the registry has in the end.
    pub(crate) holding: &'a Holding,
    /// What was committed to the registry and lost again.
    pub(crate) lost: &'a [Logged],
    /// Zones of which an operator has decided.
    pub(crate) decided: &'a BTreeSet<String>,
}

/// What is known of a zone from a moment on: that it has this tag, that it is gone, or nothing.
type Known = (u64, Option<Option<String>>);

impl Kept<'_> {
    pub(crate) fn violations(&self) -> Vec<String> {
        let lost: BTreeSet<&str> = self.lost.iter().map(|change| &*change.id).collect();
        let mut violations = Vec::new();
        for ((edge, id), known) in self.known() {
            if lost.contains(id) || self.decided.contains(id) {
                continue;
            }
            self.check_sights(edge, id, &known, &mut violations);
            let in_the_end = known.last().and_then(|(_, known)| known.as_ref());
            if let Some(expected) = in_the_end
                && self.holding.get(id) != expected.as_ref()
            {
                let found = self.holding.get(id);
                violations.push(format!(
                    "{edge} acknowledged {expected:?} for zone {id}, and the registry has {found:?} in the end"
                ));
            }
        }
        violations
    }

    /// What is known of the zones that are an edge's own, in the order of its operator, who does one thing at a time.
    fn known(&self) -> BTreeMap<(&str, &str), Vec<Known>> {
        let mut all: BTreeMap<(&str, &str), Vec<Known>> = BTreeMap::new();
        for operation in self.operations {
            let id = operation.act.id();
            let is_own = operation.who.starts_with('e') && id.starts_with(&*operation.who);
            if !is_own {
                continue;
            }
            let known = all.entry((&*operation.who, id)).or_default();
            let before = known.last().and_then(|(_, known)| known.clone());
            known.push((operation.began, None));
            match &operation.outcome {
                Outcome::Done(_) => {
                    let tag = operation.act.tag().map(str::to_owned);
                    let ended = operation.ended.unwrap_or(operation.began);
                    known.push((ended, Some(tag)));
                }
                Outcome::Refused(_) | Outcome::Seen(_) => {
                    let ended = operation.ended.unwrap_or(operation.began);
                    known.push((ended, before));
                }
                Outcome::Unknown => {}
            }
        }
        all
    }

    fn check_sights(&self, edge: &str, id: &str, known: &[Known], violations: &mut Vec<String>) {
        let is_own = |sight: &&Sight| sight.edge.split('.').next() == Some(edge);
        let own = self.sights.iter().filter(is_own);
        for sight in own {
            let place = known.partition_point(|(moment, _)| *moment < sight.moment);
            let last = place.checked_sub(1).and_then(|place| known.get(place));
            // What was lifted may come back until the log has brought that, too; it is what holds at the stated
            // revision, which is looked at elsewhere.
            if let Some((_, Some(Some(expected)))) = last
                && sight.zones.get(id) != Some(expected)
            {
                let (found, moment) = (sight.zones.get(id), sight.moment);
                violations.push(format!(
                    "{edge} acknowledged {expected} for zone {id}, and has {found:?} at {moment}"
                ));
            }
        }
    }
}
