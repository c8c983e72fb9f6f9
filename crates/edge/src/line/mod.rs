//! The lines on which drones are told: who hears of what comes into a mailbox, and when.
//!
//! Mail is told once it is stored, so that no drone flies a version that its edge has forgotten after a crash; while the
//! store fails it is told all the same, as a drone in the air cannot wait for a disk. A line holds no messages: it knows
//! which of its drones have news, and writes a message out when its reader takes it. A slow reader costs nothing.

pub(crate) mod claims;
pub(crate) mod mailbox;
pub(crate) mod sessions;
pub(crate) mod stream;
mod views;

use crate::locks::lock;
use crate::snapshot::Snapshot;
use arc_swap::ArcSwap;
use imbl::ordmap::DiffItem;
use mailbox::MailEntry;
use skyway_contract::{self as wire, ClockKind};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::{Arc, Mutex};
use std::task::{Poll, Waker};

/// Who tells which drones.
#[derive(Debug)]
pub(crate) struct Lines {
    /// The mail that is told: of the newest snapshot that is stored.
    told: ArcSwap<Snapshot>,
    newest: ArcSwap<Snapshot>,
    /// Whether mail is told before it is stored: a client that moves the clock is told all that has happened until then
    /// before it goes on.
    tells_at_once: bool,
    by_drone: Mutex<BTreeMap<Arc<str>, Vec<Arc<Line>>>>,
}

/// One reader: what it has been told, and what it has not.
#[derive(Debug, Default)]
pub(crate) struct Line {
    state: Mutex<LineState>,
}

#[derive(Debug, Default)]
struct LineState {
    /// Its drones, each with how far it has been told.
    drones: BTreeMap<Arc<str>, ToldTo>,
    /// Those that may have more.
    news: BTreeSet<Arc<str>>,
    /// Drones that another session has taken over.
    ended: VecDeque<wire::EndedSession<'static>>,
    reader: Option<Waker>,
}

/// How far a drone has been told.
#[derive(Clone, Copy, Debug)]
struct ToldTo {
    /// The number of the last message that it was told on this line.
    number: u64,
    /// That of the last one that it had received before: of those up to it only open orders are told again.
    received: u64,
}

impl Line {
    fn has_news(&self, drone: &Arc<str>) {
        let reader = {
            let mut state = lock(&self.state);
            state.news.insert(drone.clone());
            state.reader.take()
        };
        reader.iter().for_each(Waker::wake_by_ref);
    }

    /// A drone is told elsewhere from now on.
    pub(crate) fn lose(&self, drone: &str, ended: wire::EndedSession<'static>) {
        let reader = {
            let mut state = lock(&self.state);
            state.drones.remove(drone);
            state.ended.push_back(ended);
            state.reader.take()
        };
        reader.iter().for_each(Waker::wake_by_ref);
    }

    /// How many drones are on it.
    pub(crate) fn len(&self) -> usize {
        lock(&self.state).drones.len()
    }
}

impl Lines {
    pub(crate) fn new(first: Arc<Snapshot>, clock: ClockKind) -> Self {
        Self {
            told: ArcSwap::new(first.clone()),
            newest: ArcSwap::new(first),
            tells_at_once: clock == ClockKind::External,
            by_drone: Mutex::default(),
        }
    }

    /// Takes the newest snapshot, which is to be told once it is stored.
    pub(crate) fn publish(&self, snapshot: &Arc<Snapshot>) {
        self.newest.store(snapshot.clone());
        if self.tells_at_once {
            self.tell(snapshot);
        }
    }

    /// A snapshot is stored.
    pub(crate) fn stored(&self, snapshot: &Arc<Snapshot>) {
        if !self.tells_at_once {
            self.tell(snapshot);
        }
    }

    /// Tells the newest mail, stored or not.
    pub(crate) fn tell_newest(&self) {
        self.tell(&self.newest.load_full());
    }

    /// Tells the mail of a snapshot. Costs what has changed since the last one.
    fn tell(&self, snapshot: &Arc<Snapshot>) {
        let before = self.told.swap(snapshot.clone());
        let mut drones: BTreeSet<&Arc<str>> = BTreeSet::new();
        for item in before.mail.diff(&snapshot.mail) {
            match item {
                DiffItem::Add((drone, _), _)
                | DiffItem::Update {
                    new: ((drone, _), _),
                    ..
                } => drones.insert(drone),
                DiffItem::Remove(..) => continue,
            };
        }
        if drones.is_empty() {
            return;
        }
        let by_drone = lock(&self.by_drone);
        for drone in drones {
            for line in by_drone.get(drone).into_iter().flatten() {
                line.has_news(drone);
            }
        }
    }

    /// Puts a drone on a line that has received its messages up to one.
    pub(crate) fn join(&self, line: &Arc<Line>, drone: &Arc<str>, received: u64) {
        let told = ToldTo {
            number: 0,
            received,
        };
        lock(&line.state).drones.insert(drone.clone(), told);
        let mut by_drone = lock(&self.by_drone);
        let lines = by_drone.entry(drone.clone()).or_default();
        if !lines.iter().any(|other| Arc::ptr_eq(other, line)) {
            lines.push(line.clone());
        }
        drop(by_drone);
        line.has_news(drone);
    }

    /// Takes a drone off a line.
    pub(crate) fn leave(&self, line: &Arc<Line>, drone: &str) {
        lock(&line.state).drones.remove(drone);
        let mut by_drone = lock(&self.by_drone);
        if let Some(lines) = by_drone.get_mut(drone) {
            lines.retain(|other| !Arc::ptr_eq(other, line));
            if lines.is_empty() {
                by_drone.remove(drone);
            }
        }
    }

    /// Takes all drones off a line, and names them.
    pub(crate) fn close(&self, line: &Arc<Line>) -> Vec<Arc<str>> {
        let drones: Vec<Arc<str>> = lock(&line.state).drones.keys().cloned().collect();
        for drone in &drones {
            self.leave(line, drone);
        }
        drones
    }

    /// What a line is told next; where there is nothing its reader is woken when there is.
    pub(crate) fn next(&self, line: &Line, reader: &Waker) -> Poll<Next> {
        loop {
            let mut state = lock(&line.state);
            if let Some(ended) = state.ended.pop_front() {
                return Poll::Ready(Next::Ended(ended));
            }
            let Some(drone) = state.news.pop_first() else {
                state.reader = Some(reader.clone());
                return Poll::Pending;
            };
            let Some(told) = state.drones.get_mut(&drone) else {
                continue;
            };
            let snapshot = self.told.load_full();
            let is_due = |entry: &&Arc<MailEntry>| {
                let plan = || snapshot.plans.get(&entry.plan).map(|plan| &**plan);
                entry.number > told.received || entry.is_open_order(plan())
            };
            let next = snapshot.mail_of(&drone, told.number).find(is_due).cloned();
            if let Some(entry) = next {
                told.number = entry.number;
                // There may be more; it is asked for once this one is taken.
                state.news.insert(drone);
                return Poll::Ready(Next::Message(snapshot, entry));
            }
        }
    }
}

/// What a line is told next.
pub(crate) enum Next {
    Message(Arc<Snapshot>, Arc<MailEntry>),
    Ended(wire::EndedSession<'static>),
}
