//! The operations of a run against what is there at its end, where there is no log: each object for itself.

use super::{Act, Holding, Operation, Outcome};
use std::collections::{BTreeMap, BTreeSet};

/// Everything that must not have happened. Each object has one who writes it, one operation after the other.
pub(crate) fn violations(operations: &[Operation], holding: &Holding) -> Vec<String> {
    let mut by_id: BTreeMap<&str, Vec<&Operation>> = BTreeMap::new();
    for operation in operations {
        by_id.entry(operation.act.id()).or_default().push(operation);
    }
    let mut violations = Vec::new();
    for (id, mut operations) in by_id {
        operations.sort_by_key(|operation| operation.began);
        let may_be = states(&operations, &mut violations);
        let is = holding.get(id).map(String::as_str);
        if !may_be.contains(&is) {
            let last = operations.last();
            violations.push(format!(
                "{id} is {is:?} and may be {may_be:?}, after {last:?}"
            ));
        }
    }
    violations
}

/// What an object may be after its operations: a tag, or none where it is not there.
fn states<'a>(
    operations: &[&'a Operation],
    violations: &mut Vec<String>,
) -> BTreeSet<Option<&'a str>> {
    let mut may_be = BTreeSet::from([None]);
    for operation in operations {
        let after = match &operation.act {
            Act::Put { .. } | Act::Delete { .. } => operation.act.tag(),
            Act::Read { .. } => None,
        };
        match &operation.outcome {
            Outcome::Done(_) => may_be = BTreeSet::from([after]),
            Outcome::Unknown if !matches!(operation.act, Act::Read { .. }) => {
                may_be.insert(after);
            }
            // What was seen is so, and does not become something else.
            Outcome::Seen(seen) => {
                let seen = seen.as_ref().map(|seen| seen.tag.as_str());
                if !may_be.contains(&seen) {
                    violations.push(format!("it may be {may_be:?}: {operation}"));
                }
                may_be = BTreeSet::from([seen]);
            }
            Outcome::Unknown | Outcome::Refused(_) => {}
        }
    }
    may_be
}
