//! When the drone of each plan was answered last for being off it.

use crate::locks::lock;
use jiff::{SignedDuration, Timestamp};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// So long one is remembered at most.
const FORGOTTEN_AFTER: SignedDuration = SignedDuration::from_mins(1);
/// Plans remembered before those answered long ago are forgotten.
const REMEMBERED: usize = 1_000;

/// When the drone of a plan was answered last for being off it.
#[derive(Debug, Default)]
pub(crate) struct AnsweredLately(Mutex<BTreeMap<Arc<str>, Timestamp>>);

impl AnsweredLately {
    /// Whether a plan may be answered now, so long after it was last; then it counts as answered.
    pub(crate) fn begins(&self, plan: &Arc<str>, now: Timestamp, apart: SignedDuration) -> bool {
        let mut last = lock(&self.0);
        // An instant far ahead is of a clock that has been set back since.
        let is_within =
            |span: SignedDuration| move |at: &Timestamp| now.duration_since(*at).abs() < span;
        if last.get(plan).is_some_and(is_within(apart)) {
            return false;
        }
        if last.len() >= REMEMBERED {
            last.retain(|_, at| is_within(FORGOTTEN_AFTER)(at));
        }
        last.insert(plan.clone(), now);
        true
    }
}
