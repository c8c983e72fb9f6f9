//! The storekeeper: a task that writes what has changed, and then lets acknowledgements go.

use super::ahead::Ahead;
use super::decisions::{StoredDecision, read_decision};
use super::difference::difference;
use super::file::{StoreFault, StoreFile, Transaction};
use super::health::{Health, StoreStatus};
use super::journal::{ENTRIES_MAX, Entry, Journal};
use super::patience::{patiently, sleep};
use crate::background::begin_turn;
use crate::failures::records::AnswerRecord;
use crate::line::Lines;
use crate::settings::Settings;
use crate::snapshot::Snapshot;
use crate::standing::Staleness;
use crate::writer::commands::{Outcome, Reply};
use skyway_planted::{self as planted, Bug};
use skyway_service::clock::Clock;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::{Notify, oneshot};

/// How long to wait after a failure; each further time twice as long.
const FIRST_PAUSE: Duration = Duration::from_millis(250);
/// At most so long.
const LONGEST_PAUSE: Duration = Duration::from_secs(4);

/// Someone who waits for what became of an order.
pub(crate) type Asker = oneshot::Sender<(Reply, Arc<Snapshot>)>;

/// The answers to a batch, and who waits for them.
#[derive(Debug)]
pub(crate) struct Waiting {
    pub(crate) answers: Vec<(Asker, Reply)>,
    pub(crate) snapshot: Arc<Snapshot>,
    /// Dropped once the snapshot is stored, or the store fails.
    pub(crate) ahead: Ahead,
}

impl Waiting {
    /// A snapshot that answers no command.
    pub(crate) fn without_answers(snapshot: Arc<Snapshot>) -> Self {
        Self {
            answers: Vec::new(),
            snapshot,
            ahead: Ahead::default(),
        }
    }

    /// Gives the answers, each with whether it survives a restart.
    pub(super) fn release(self, durable: bool) {
        for (asker, reply) in self.answers {
            let reply = reply.map(|outcome| Outcome { durable, ..outcome });
            // The caller may have gone at its deadline.
            let _ = asker.send((reply, self.snapshot.clone()));
        }
        drop(self.ahead);
    }
}

/// Someone asks what is kept of an answer.
#[derive(Debug)]
struct Question {
    id: String,
    asker: oneshot::Sender<Result<Option<StoredDecision>, StoreFault>>,
}

#[derive(Debug, Default)]
pub(super) struct Inbox {
    /// The newest snapshot, where it is newer than the one taken last.
    newest: Option<Arc<Snapshot>>,
    waiting: Vec<Waiting>,
    pub(super) journal: Vec<Entry>,
    questions: Vec<Question>,
    is_closing: bool,
    /// The storekeeper is gone: nothing is taken out any more.
    has_ended: bool,
}

impl Inbox {
    /// Whether there is something that cannot wait a moment.
    pub(super) fn has_work(&self) -> bool {
        self.newest.is_some() || !self.questions.is_empty() || self.is_closing
    }
}

/// What the writer and the storekeeper share.
#[derive(Debug)]
pub(super) struct Shared {
    clock: Clock,
    pub(super) health: Arc<Health>,
    /// Where drones are told what is stored.
    lines: Arc<Lines>,
    inbox: Mutex<Inbox>,
    pub(super) wake: Notify,
    /// A write that takes longer counts as failing.
    pub(super) patience: Duration,
}

impl Shared {
    // The inbox is whole after every statement, so a panic elsewhere cannot spoil it.
    pub(super) fn inbox(&self) -> MutexGuard<'_, Inbox> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Answers all who wait, and tells all that drones wait for.
    pub(super) fn release_all(&self, durable: bool) {
        self.lines.tell_newest();
        let waiting = std::mem::take(&mut self.inbox().waiting);
        for waiting in waiting {
            waiting.release(durable);
        }
    }

    fn close(&self) {
        self.inbox().is_closing = true;
        self.wake.notify_one();
    }
}

/// Where the writer hands in what is in force. The storekeeper ends with the last handle.
#[derive(Clone, Debug)]
pub(crate) struct Store {
    health: Arc<Health>,
    lines: Arc<Lines>,
    keeper: Option<Arc<Handle>>,
}

#[derive(Debug)]
struct Handle(Arc<Shared>);

impl Drop for Handle {
    fn drop(&mut self) {
        self.0.close();
    }
}

impl Store {
    /// Nothing is kept, and drones are told at once.
    pub(crate) fn without_file(lines: Arc<Lines>) -> Self {
        Self {
            health: Arc::default(),
            lines,
            keeper: None,
        }
    }

    /// Whether anything is kept.
    pub(crate) fn is_kept(&self) -> bool {
        self.keeper.is_some()
    }

    pub(crate) fn health(&self) -> &Arc<Health> {
        &self.health
    }

    /// Whether a change for the registry may be told: a restart would begin with it, or the store fails.
    pub(crate) fn begins_with(&self, number: u64) -> bool {
        self.keeper.is_none() || self.health.begins_with(number)
    }

    /// Up to which number news may be told to the registry: up to the last that is stored; all where nothing is kept, or
    /// the store fails.
    pub(crate) fn news_through(&self) -> Option<u64> {
        match self.keeper.is_none() || self.health.is_failing() {
            true => Some(u64::MAX),
            false => *self.health.last_news().borrow(),
        }
    }

    pub(crate) fn status(&self) -> StoreStatus {
        self.health.status()
    }

    /// Takes what is in force now. Answers are given once it is stored; at once where nothing is kept.
    pub(crate) fn publish(&self, waiting: Waiting) {
        self.lines.publish(&waiting.snapshot);
        let Some(Handle(shared)) = self.keeper.as_deref() else {
            self.lines.tell_newest();
            self.health.stored_news(waiting.snapshot.news.last());
            waiting.release(false);
            return;
        };
        shared.health.published(&shared.clock);
        let mut inbox = shared.inbox();
        if inbox.has_ended {
            drop(inbox);
            self.lines.tell_newest();
            waiting.release(false);
            return;
        }
        inbox.newest = Some(waiting.snapshot.clone());
        if planted::is(Bug::AcknowledgeBeforeCommit) {
            waiting.release(true);
        } else if !waiting.answers.is_empty() || waiting.ahead.is_counted() {
            inbox.waiting.push(waiting);
        }
        drop(inbox);
        shared.wake.notify_one();
    }

    /// Takes something for the journal. No request waits for it.
    pub(crate) fn note(&self, entry: Entry) {
        let Some(Handle(shared)) = self.keeper.as_deref() else {
            return;
        };
        let mut inbox = shared.inbox();
        if inbox.journal.len() >= ENTRIES_MAX || inbox.has_ended {
            drop(inbox);
            shared.health.lost(1);
            return;
        }
        inbox.journal.push(entry);
        let is_first = inbox.journal.len() == 1;
        drop(inbox);
        // A keeper that is awake looks for more by itself.
        if is_first {
            shared.wake.notify_one();
        }
    }

    /// Takes what a failure report was answered.
    pub(crate) fn note_decision(&self, record: &Arc<AnswerRecord>, standing: Staleness) {
        if self.keeper.is_some() {
            let record = record.clone();
            self.note(Entry::Decision { record, standing });
        }
    }

    /// What the file has of an answer; none where it has nothing, or there is no file.
    pub(crate) async fn decision(&self, id: &str) -> Result<Option<StoredDecision>, StoreFault> {
        let Some(Handle(shared)) = self.keeper.as_deref() else {
            return Ok(None);
        };
        let (asker, answer) = oneshot::channel();
        let id = id.to_owned();
        {
            let mut inbox = shared.inbox();
            // Without a storekeeper the asker is dropped here, which is an answer too.
            if !inbox.has_ended {
                inbox.questions.push(Question { id, asker });
            }
        }
        shared.wake.notify_one();
        let gone = |_| StoreFault::Unavailable {
            message: "it is closed".to_owned(),
        };
        answer.await.map_err(gone)?
    }

    /// Ends the storekeeper once all is stored that can be.
    pub(crate) fn close(&self) {
        if let Some(Handle(shared)) = self.keeper.as_deref() {
            shared.close();
        }
    }
}

/// The storekeeper.
#[derive(Debug)]
pub(crate) struct Keeper {
    shared: Arc<Shared>,
    file: Box<dyn StoreFile>,
    /// The number of the last transaction in the file.
    number: u64,
    /// What the file has.
    stored: Arc<Snapshot>,
    /// What it is to have.
    newest: Arc<Snapshot>,
    /// Set after a failure: it is unknown whether the transaction with this snapshot is in the file.
    doubtful: Option<Arc<Snapshot>>,
    journal: Journal,
    /// What is to go into the journal.
    entries: Vec<Entry>,
    pause: Duration,
}

impl Keeper {
    /// A storekeeper over a file that has this snapshot, and the handle to it.
    pub(crate) fn new(
        file: Box<dyn StoreFile>,
        (number, stored): (u64, Arc<Snapshot>),
        lines: Arc<Lines>,
        clock: Clock,
        settings: &Settings,
    ) -> (Self, Store) {
        let health = Arc::new(Health::default());
        health.begin();
        health.stored(first_change(&stored));
        health.stored_news(stored.news.last());
        let shared = Arc::new(Shared {
            clock,
            health: health.clone(),
            lines: lines.clone(),
            inbox: Mutex::default(),
            wake: Notify::new(),
            patience: settings.commit_within,
        });
        let store = Store {
            health,
            lines,
            keeper: Some(Arc::new(Handle(shared.clone()))),
        };
        let keeper = Self {
            shared,
            file,
            number,
            newest: stored.clone(),
            stored,
            doubtful: None,
            journal: Journal::new(settings),
            entries: Vec::new(),
            pause: FIRST_PAUSE,
        };
        (keeper, store)
    }

    /// Works until the last handle is gone.
    pub(crate) async fn run(mut self) {
        let _end = End(self.shared.clone());
        loop {
            sleep(&self.shared, self.pause).await;
            let mut taken = std::mem::take(&mut *self.shared.inbox());
            self.shared.inbox().is_closing |= taken.is_closing;
            if let Some(newest) = taken.newest.take() {
                self.newest = newest;
            }
            self.gather(taken.journal);
            begin_turn();
            if planted::is(Bug::AcknowledgeBeforeCommit) {
                tokio::time::sleep(planted::COMMITS_LATER).await;
            }
            self.store(taken.waiting).await;
            self.answer(taken.questions).await;
            if taken.is_closing && self.shared.inbox().newest.is_none() {
                break;
            }
        }
        self.file.close().await;
    }

    /// Takes entries of the journal, as many as may wait.
    fn gather(&mut self, entries: Vec<Entry>) {
        self.entries.extend(entries);
        let lost = self.entries.len().saturating_sub(ENTRIES_MAX);
        self.entries.truncate(ENTRIES_MAX);
        self.shared.health.lost(lost as u64);
    }

    async fn store(&mut self, mut waiting: Vec<Waiting>) {
        let stopwatch = self.shared.clock.stopwatch();
        match self.write(&mut waiting).await {
            Ok(has_written) => {
                self.shared.lines.stored(&self.stored);
                if has_written {
                    let seconds = stopwatch.elapsed().as_secs_f64();
                    if self.shared.health.is_failing() {
                        tracing::info!("the store works again; all that is in force is stored");
                    }
                    self.shared.health.committed(seconds);
                }
                self.pause = FIRST_PAUSE;
                if self.shared.inbox().newest.is_none() {
                    self.shared.health.caught_up();
                }
            }
            Err(_) if planted::is(Bug::IgnoreFailedCommit) => {}
            Err(fault) => {
                if !self.shared.health.is_failing() {
                    tracing::error!(%fault, "the store fails; what is in force stays so in memory");
                }
                self.shared.health.failed(fault.to_string());
                self.shared.lines.tell_newest();
                self.pause = (self.pause * 2).min(LONGEST_PAUSE);
                for waiting in waiting.drain(..) {
                    waiting.release(false);
                }
            }
        }
        for waiting in waiting {
            waiting.release(true);
        }
    }

    /// Writes what is not stored; tells whether there was anything.
    async fn write(&mut self, waiting: &mut Vec<Waiting>) -> Result<bool, StoreFault> {
        if let Some(attempted) = self.doubtful.clone() {
            let found = patiently(&self.shared, waiting, self.file.reopen()).await?;
            if found == (self.number + 1, self.stored.epoch) {
                self.number += 1;
                self.shared.health.stored(first_change(&attempted));
                self.shared.health.stored_news(attempted.news.last());
                self.stored = attempted;
            } else if found != (self.number, self.stored.epoch) {
                return Err(StoreFault::Taken);
            }
            self.doubtful = None;
        }
        let mut rows = difference(&self.stored, &self.newest);
        if !self.entries.is_empty() {
            self.write_journal(waiting).await;
        }
        // Where it was failing, even nothing is written, to find out whether it still does.
        if rows.is_empty() && self.journal.is_saved() && !self.shared.health.is_failing() {
            self.stored = self.newest.clone();
            return Ok(false);
        }
        let state_rows = rows.len();
        rows.extend(self.journal.take());
        let mut transaction = Transaction {
            number: self.number + 1,
            writer: self.stored.epoch,
            rows,
        };
        self.doubtful = Some(self.newest.clone());
        let done = patiently(&self.shared, waiting, self.file.commit(&transaction)).await;
        if let Err(fault) = done {
            let lost = self
                .journal
                .give_back(transaction.rows.split_off(state_rows));
            self.shared.health.lost(lost);
            return Err(fault);
        }
        self.doubtful = None;
        self.number = transaction.number;
        self.stored = self.newest.clone();
        self.shared.health.stored(first_change(&self.stored));
        self.shared.health.stored_news(self.stored.news.last());
        Ok(true)
    }

    /// Makes rows of the journal. What goes wrong here costs entries, and nothing else.
    async fn write_journal(&mut self, waiting: &mut Vec<Waiting>) {
        let entries = std::mem::take(&mut self.entries);
        let now = self.shared.clock.now();
        let count = entries.len() as u64;
        let encoding = self.journal.encode(&mut *self.file, entries, now);
        if let Err(fault) = patiently(&self.shared, waiting, encoding).await {
            tracing::warn!(%fault, "what was answered could not be noted");
            self.shared.health.lost(count);
        }
    }

    async fn answer(&mut self, questions: Vec<Question>) {
        for Question { id, asker } in questions {
            let reading = read_decision(&mut *self.file, &id);
            let found = patiently(&self.shared, &mut Vec::new(), reading).await;
            // The caller may have gone at its deadline.
            let _ = asker.send(found);
        }
    }
}

/// The change that a snapshot has to tell the registry first.
fn first_change(snapshot: &Snapshot) -> Option<u64> {
    snapshot.outbox.get_min().map(|(number, _)| *number)
}

/// Tells those who wait that nothing is stored any more, whatever has ended the storekeeper.
#[derive(Debug)]
struct End(Arc<Shared>);

impl Drop for End {
    fn drop(&mut self) {
        let message = "the storekeeper has ended".to_owned();
        self.0
            .health
            .failed(StoreFault::Unavailable { message }.to_string());
        let left = {
            let mut inbox = self.0.inbox();
            inbox.has_ended = true;
            inbox.questions.clear();
            std::mem::take(&mut inbox.waiting)
        };
        for waiting in left {
            waiting.release(false);
        }
    }
}
