//! What all who take part in a run share: time, chance, what goes wrong now, and what is noted of it.

use crate::central::{Central, Lost};
use crate::history::Recorder;
use crate::history::edges::{Circle, Route, Sight};
use crate::rounds::Chance;
use crate::trace::Trace;
use jiff::Timestamp;
use skyway::clock::Clock;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

/// Each party acts in milliseconds of its own, so that no two act at once: which of two is woken first at an
/// instant is not determined by the seed.
const TURNS: u64 = 16;

/// When every run begins.
const DAWN: &str = "2026-11-21T06:00:00Z";

/// Who takes part: a name, and which milliseconds it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Who {
    /// An edge, and its line.
    Edge(usize),
    /// Those who write at an edge.
    Operator(usize),
    /// One who writes at the registry.
    Central(usize),
    Chaos,
}

impl Who {
    fn turn(self) -> u64 {
        let number = match self {
            Self::Edge(number) => number,
            Self::Operator(number) => 4 + number,
            Self::Central(number) => 8 + number,
            Self::Chaos => 15,
        };
        number as u64
    }

    pub(crate) fn name(self) -> String {
        match self {
            Self::Edge(number) => format!("e{number}"),
            Self::Operator(number) => format!("o{number}"),
            Self::Central(number) => format!("r{number}"),
            Self::Chaos => "--".to_owned(),
        }
    }
}

/// What goes wrong now, in a hundred messages.
#[derive(Clone, Debug, Default)]
pub(crate) struct Troubles {
    pub(crate) lost: u64,
    pub(crate) bent: u64,
    pub(crate) twice: u64,
    pub(crate) delay_max_ms: u64,
    /// Edges whose line is cut.
    pub(crate) cut: BTreeSet<usize>,
}

/// What was noted beside operations.
#[derive(Clone, Debug, Default)]
pub(crate) struct Notes {
    pub(crate) sights: Vec<Sight>,
    pub(crate) routes: Vec<Route>,
    /// The shape of what has a tag.
    pub(crate) shapes: BTreeMap<String, Circle>,
    /// What was found at once.
    pub(crate) violations: Vec<String>,
    /// What was lost where backups were restored.
    pub(crate) restored: Vec<Lost>,
    pub(crate) has_bent: bool,
    /// What operators have decided where two changes met.
    pub(crate) decided: BTreeSet<String>,
    pub(crate) counts: BTreeMap<&'static str, u64>,
}

/// A clock in a run that began at an instant.
pub(crate) fn clock_after(began: Instant) -> Clock {
    let dawn: Timestamp = DAWN.parse().expect("an instant");
    Clock::of_runtime(dawn + began.elapsed())
}

/// All of it.
pub(crate) struct World {
    began: Instant,
    pub(crate) seed: u64,
    pub(crate) trace: Trace,
    pub(crate) recorder: Recorder,
    pub(crate) central: Central,
    /// No party begins anything new any more.
    pub(crate) over: CancellationToken,
    troubles: Mutex<Troubles>,
    notes: Mutex<Notes>,
}

impl World {
    pub(crate) fn new(seed: u64, central: Central) -> Self {
        Self {
            began: Instant::now(),
            seed,
            trace: Trace::new(),
            recorder: Recorder::default(),
            central,
            over: CancellationToken::new(),
            troubles: Mutex::default(),
            notes: Mutex::default(),
        }
    }

    /// The chance of one who takes part; each use of it has a number of its own.
    pub(crate) fn chance(&self, who: Who, number: u64) -> Chance {
        Chance::of(self.seed, 1 + who.turn() + TURNS * number)
    }

    /// A clock for the party that begins now.
    pub(crate) fn clock(&self) -> Clock {
        clock_after(self.began)
    }

    pub(crate) fn now_ms(&self) -> u64 {
        u64::try_from(self.began.elapsed().as_millis()).unwrap_or(u64::MAX)
    }

    /// Waits so long, and then for the next millisecond of the party that waits.
    pub(crate) async fn pause(&self, who: Who, least: Duration) {
        let at_ms = self.now_ms() + u64::try_from(least.as_millis()).unwrap_or(0) + 1;
        let late = (TURNS + who.turn() - at_ms % TURNS) % TURNS;
        tokio::time::sleep_until(self.began + Duration::from_millis(at_ms + late)).await;
    }

    pub(crate) fn tell(&self, who: Who, what: String) {
        self.trace.tell(self.now_ms(), &who.name(), &what);
    }

    pub(crate) fn count(&self, what: &'static str) {
        *self.notes().counts.entry(what).or_default() += 1;
    }

    pub(crate) fn violation(&self, text: String) {
        self.notes().violations.push(text);
    }

    pub(crate) fn troubles(&self) -> MutexGuard<'_, Troubles> {
        self.troubles.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn notes(&self) -> MutexGuard<'_, Notes> {
        self.notes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
