//! What happened in a run with faults, and what must not have happened.
//!
//! Each party notes each operation when it begins and how it ended; an operation whose answer never came
//! may have happened or not, but not both. `log` holds the operations against the log of the registry, `edges`
//! what edges showed and answered against it,
//! `objects` the operations against what is there where there is no log. Nothing here knows how a run is made: processes or a simulation.

pub(crate) mod edges;
pub(crate) mod log;
pub(crate) mod objects;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// A version of an object: the revision that made it so.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Version {
    pub(crate) epoch: u64,
    pub(crate) revision: u64,
}

impl Version {
    /// From an entity tag, or from what an edge states: `"1-7"`, `1-7`.
    pub(crate) fn read(text: &str) -> Option<Self> {
        let (epoch, revision) = text.trim_matches('"').split_once('-')?;
        Some(Self {
            epoch: epoch.parse().ok()?,
            revision: revision.parse().ok()?,
        })
    }
}

impl fmt::Display for Version {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}-{}", self.epoch, self.revision)
    }
}

/// What someone did. Each thing that is put has a tag that nothing else has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Act {
    Put { id: String, tag: String },
    Delete { id: String },
    Read { id: String },
}

impl Act {
    pub(crate) fn id(&self) -> &str {
        match self {
            Self::Put { id, .. } | Self::Delete { id } | Self::Read { id } => id,
        }
    }

    /// What the object is after it: its tag; none where it is gone.
    pub(crate) fn tag(&self) -> Option<&str> {
        match self {
            Self::Put { tag, .. } => Some(tag),
            Self::Delete { .. } | Self::Read { .. } => None,
        }
    }
}

/// How it ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// It was acknowledged, as this version where the answer says one.
    Done(Option<Version>),
    /// It was read: what was there.
    Seen(Option<Seen>),
    /// It was refused: it did not happen.
    Refused(u16),
    /// No answer came, or one that says nothing of it: it may have happened.
    Unknown,
}

/// An object as it was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Seen {
    pub(crate) version: Option<Version>,
    pub(crate) tag: String,
}

/// An operation. Of two operations of whom one ended before the other began, the first came first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Operation {
    pub(crate) who: String,
    pub(crate) act: Act,
    pub(crate) began: u64,
    pub(crate) ended: Option<u64>,
    pub(crate) outcome: Outcome,
    /// The epoch of the edge that answered, of which each of its lives has another; none where the answer tells none.
    pub(crate) life: Option<u64>,
}

impl Operation {
    pub(crate) fn is_done(&self) -> bool {
        matches!(self.outcome, Outcome::Done(_))
    }
}

impl fmt::Display for Operation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            who,
            act,
            began,
            outcome,
            ..
        } = self;
        write!(formatter, "{who} at {began}: {act:?} was {outcome:?}")
    }
}

/// Collects what happens; clones note into the same history.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recorder(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    moment: AtomicU64,
    operations: Mutex<Vec<Operation>>,
}

/// An operation that has begun.
#[derive(Debug)]
pub(crate) struct Begun(usize);

impl Recorder {
    /// The next moment.
    pub(crate) fn moment(&self) -> u64 {
        self.0.moment.fetch_add(1, Ordering::SeqCst)
    }

    pub(crate) fn begin(&self, who: &str, act: Act) -> Begun {
        let mut operations = self.lock();
        let began = self.moment();
        operations.push(Operation {
            who: who.to_owned(),
            act,
            began,
            ended: None,
            outcome: Outcome::Unknown,
            life: None,
        });
        Begun(operations.len() - 1)
    }

    /// Notes how it ended, and in which life of an edge; what never ends is unknown.
    pub(crate) fn end(&self, begun: &Begun, outcome: Outcome, life: Option<u64>) {
        let mut operations = self.lock();
        let ended = self.moment();
        let operation = &mut operations[begun.0];
        // What is unknown may still happen.
        operation.ended = (outcome != Outcome::Unknown).then_some(ended);
        operation.outcome = outcome;
        operation.life = life;
    }

    /// Waits until more is acknowledged than so much, so that the next fault meets work on a slow machine too; gives
    /// how much it is. Where nothing comes any more, as with a planted bug, no test waits again.
    pub(crate) async fn goes_on(&self, before: usize) -> usize {
        const LOOKS: usize = 5_000;
        const NEVER: usize = usize::MAX;
        for _ in 0..LOOKS {
            let done = self.done();
            if done > before || before == NEVER {
                return done.max(before);
            }
            tokio::time::sleep(std::time::Duration::from_millis(2)).await;
        }
        NEVER
    }

    /// How many operations are acknowledged.
    pub(crate) fn done(&self) -> usize {
        self.lock().iter().filter(|it| it.is_done()).count()
    }

    pub(crate) fn operations(&self) -> Vec<Operation> {
        self.lock().clone()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Operation>> {
        self.0
            .operations
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

/// What holds: the tag of each object by its id.
pub(crate) type Holding = BTreeMap<String, String>;

/// A change of a log. Bodies are told by their tags.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Logged {
    pub(crate) version: Version,
    pub(crate) id: String,
    /// None for a tombstone.
    pub(crate) tag: Option<String>,
}

/// What holds after the changes up to a revision.
pub(crate) fn holding_at(log: &[Logged], revision: u64) -> Holding {
    let is_later = |change: &Logged| change.version.revision > revision;
    let count = log.iter().position(is_later).unwrap_or(log.len());
    let mut holding = Holding::new();
    apply(&mut holding, &log[..count]);
    holding
}

/// Makes changes in their order.
fn apply(holding: &mut Holding, changes: &[Logged]) {
    for change in changes {
        match &change.tag {
            Some(tag) => holding.insert(change.id.clone(), tag.clone()),
            None => holding.remove(&change.id),
        };
    }
}
