//! The single writer: it carries out commands in batches and publishes what comes of them.
//!
//! Requests never wait for it unless they have to know what became of their order. As a thread it sleeps until
//! the next command or the next instant at which something happens by itself; in place it works whenever a command
//! is handed in, on the thread of whoever hands it in, so that a simulation has one thread and one order of events.

use super::background::{begin_turn, give_way, in_place};
use super::commands::{Command, Reply};
use super::events::Events;
use super::fleet::Detour;
use super::opened::Opened;
use super::snapshot::Snapshot;
use super::state::State;
use super::store::{Store, Waiting};
use super::tables::Tables;
use crate::clock::Clock;
use crate::planted::{self, Bug};
use crate::refusal::{Code, Refusal};
use arc_swap::ArcSwap;
use jiff::Timestamp;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::time::Duration;
use tokio::sync::{Mutex, oneshot};

/// At most this many commands wait.
const QUEUE: usize = 4_096;
/// At most this many commands make one snapshot.
const BATCH: usize = 256;
/// The writer looks at the clock at least this often, as a clock may be set.
const LONGEST_SLEEP: Duration = Duration::from_secs(1);

/// A command, and who waits for what becomes of it.
#[derive(Debug)]
pub(super) struct QueuedCommand {
    command: Command,
    reply: Option<Asker>,
}

/// Where commands are handed in.
#[derive(Clone, Debug)]
pub(super) enum Writer {
    /// A thread takes them.
    Thread(SyncSender<QueuedCommand>),
    /// They are carried out at once.
    InPlace(Arc<Mutex<WriterLoop>>),
}

/// Where the writer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WriterStep {
    /// What a batch of commands has changed is in force; no plan has been looked at.
    Enforced,
    /// A plan has been looked at.
    LookedAtPlan,
}

/// Who watches the writer: tests, which hold it back.
#[derive(Clone, Default)]
pub(super) struct Watch(pub(super) Option<Arc<dyn Fn(WriterStep) + Send + Sync>>);

impl Watch {
    fn tell(&self, step: WriterStep) {
        if let Some(watch) = &self.0 {
            watch(step);
        }
    }
}

impl std::fmt::Debug for Watch {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(if self.0.is_some() {
            "Watch(..)"
        } else {
            "Watch"
        })
    }
}

/// Who waits for the answer to a command.
type Asker = oneshot::Sender<(Reply, Arc<Snapshot>)>;

/// What the writer publishes to.
#[derive(Debug)]
pub(super) struct WriterLoop {
    pub(super) state: State,
    pub(super) store: Store,
    pub(super) clock: Clock,
    pub(super) world: Arc<ArcSwap<Snapshot>>,
    pub(super) events: Arc<Events>,
    pub(super) tables: Tables,
    /// Where better plans are looked for, if anywhere.
    pub(super) opened: Option<Opened>,
    pub(super) watch: Watch,
    pub(super) waiting: Unanswered,
}

/// What the writer has yet to come to.
#[derive(Debug, Default)]
pub(super) struct Unanswered {
    /// Orders that came in while plans were replanned.
    letters: Vec<QueuedCommand>,
    /// Who waits until all plans are.
    for_all_plans: Vec<(Asker, Reply)>,
}

impl Writer {
    /// Starts the thread. It ends when the last handle to it is dropped.
    pub(super) fn start(desk: WriterLoop) -> std::io::Result<Self> {
        let (commands, inbox) = sync_channel(QUEUE);
        let builder = std::thread::Builder::new().name("skyway-writer".to_owned());
        builder.spawn(move || desk.work(&inbox))?;
        Ok(Self::Thread(commands))
    }

    /// A writer without a thread: what is due happens with the next command.
    pub(super) fn in_place(desk: WriterLoop) -> Self {
        Self::InPlace(Arc::new(Mutex::new(desk)))
    }

    /// Hands in a command and waits for what becomes of it.
    pub(super) async fn ask(&self, command: Command) -> Result<(Reply, Arc<Snapshot>), Refusal> {
        let (reply, answer) = oneshot::channel();
        self.send(QueuedCommand {
            command,
            reply: Some(reply),
        })?;
        answer.await.map_err(|_| stopped())
    }

    /// Hands in a command that nobody waits for.
    pub(super) fn tell(&self, command: Command) -> Result<(), Refusal> {
        self.send(QueuedCommand {
            command,
            reply: None,
        })
    }

    fn send(&self, letter: QueuedCommand) -> Result<(), Refusal> {
        let commands = match self {
            Self::Thread(commands) => commands,
            Self::InPlace(desk) => {
                in_place(|| {
                    // Nobody overtakes who waits for it.
                    let free = desk.try_lock();
                    let mut desk = free.unwrap_or_else(|_| desk.blocking_lock());
                    desk.carry_out(vec![letter], None);
                });
                return Ok(());
            }
        };
        commands.try_send(letter).map_err(|error| match error {
            TrySendError::Full(_) => {
                let detail = format!("{QUEUE} changes are waiting already");
                Refusal::new(Code::Overloaded, detail).retry_after_s(1)
            }
            TrySendError::Disconnected(_) => stopped(),
        })
    }
}

fn stopped() -> Refusal {
    Refusal::new(
        Code::ShuttingDown,
        "the edge is stopping and takes no more changes",
    )
}

impl WriterLoop {
    fn work(mut self, inbox: &Receiver<QueuedCommand>) {
        loop {
            let mut letters = std::mem::take(&mut self.waiting.letters);
            if letters.is_empty() {
                match inbox.recv_timeout(self.patience()) {
                    Ok(letter) => letters.push(letter),
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => return,
                }
            }
            let room = BATCH.saturating_sub(letters.len());
            letters.extend(inbox.try_iter().take(room));
            let reading = self.clock.reading();
            let is_due = self.state.has_clock_news(&reading)
                || self.state.next_due().is_some_and(|due| due <= reading.now);
            if !letters.is_empty() || is_due || self.state.has_waiting() {
                self.carry_out(letters, Some(inbox));
            }
        }
    }

    /// How long nothing can happen by itself.
    fn patience(&self) -> Duration {
        if self.state.has_waiting() {
            return Duration::ZERO;
        }
        let due = self.state.next_due();
        let until = due.and_then(|instant| self.clock.real_duration_until(instant));
        until.map_or(LONGEST_SLEEP, |until| until.min(LONGEST_SLEEP))
    }

    /// Carries out letters in batches: one, unless some of them replace the network, which begin batches of their own.
    fn carry_out(
        &mut self,
        mut letters: Vec<QueuedCommand>,
        inbox: Option<&Receiver<QueuedCommand>>,
    ) {
        let replaces = |letter: &QueuedCommand| letter.command.replaces_network();
        while let Some(place) = letters.iter().skip(1).position(replaces) {
            let rest = letters.split_off(place + 1);
            self.carry_out_batch(std::mem::replace(&mut letters, rest), inbox);
        }
        self.carry_out_batch(letters, inbox);
    }

    /// Carries out letters, enforces what they change, and only then looks at plans: so many that the answers tell
    /// something of them, and no more while other letters wait.
    fn carry_out_batch(
        &mut self,
        letters: Vec<QueuedCommand>,
        inbox: Option<&Receiver<QueuedCommand>>,
    ) {
        begin_turn();
        if let Some(Command::AdvanceTo(to)) = letters.first().map(|letter| &letter.command) {
            // Everything happens at its own instant: the clock never passes the next one.
            let due = self.state.next_due().unwrap_or(*to);
            self.clock.move_to(due.min(*to));
        }
        let reading = self.clock.reading();
        self.state.hear_clock(&reading);
        let now = reading.now;
        let mut commands = Vec::with_capacity(letters.len());
        let mut askers = Vec::with_capacity(letters.len());
        for letter in letters {
            let waits_for_plans = matches!(letter.command, Command::Settle);
            askers.push((
                letter.reply,
                letter.command.changes_by_request(),
                waits_for_plans,
            ));
            commands.push(letter.command);
        }
        let enforced = self.state.enforce(commands, now);
        // Enforced before stored, and acknowledged after both: nothing waits for a disk, or for plans, to be safe.
        let mut snapshot = match planted::is(Bug::PlansFirst) {
            true => None,
            false => Some(self.publish(now)),
        };
        self.watch.tell(WriterStep::Enforced);
        self.state.look_up(&enforced.look, now);
        let detours = self.replan(now, inbox, &mut snapshot);
        if enforced.airspace_changed {
            self.tables.renew();
        }
        if let Some(opened) = self.opened.as_ref().filter(|_| enforced.has_opened) {
            opened.tell();
        }
        let snapshot = snapshot.unwrap_or_else(|| self.publish(now));
        let replies = self.state.replies(enforced.done, detours);
        self.answer(replies, askers, snapshot);
        // On the thread of whoever hands in commands, nobody else would go on with it.
        while inbox.is_none() && self.state.has_waiting() {
            let mut later = None;
            self.replan(now, None, &mut later);
            if let Some(snapshot) = later {
                self.answer(Vec::new(), Vec::new(), snapshot);
            }
        }
    }

    /// A slice of the plans that wait, and the state after it where anything has changed.
    fn replan(
        &mut self,
        now: Timestamp,
        inbox: Option<&Receiver<QueuedCommand>>,
        snapshot: &mut Option<Arc<Snapshot>>,
    ) -> Vec<Detour> {
        if !self.state.has_waiting() {
            return Vec::new();
        }
        if snapshot.is_some() {
            // The plans that something meets are shown as affected before any is recomposed.
            *snapshot = Some(self.publish(now));
        }
        let (watch, letters) = (&self.watch, &mut self.waiting.letters);
        let mut may_go_on = || {
            watch.tell(WriterStep::LookedAtPlan);
            give_way();
            let letter = inbox.and_then(|inbox| inbox.try_recv().ok());
            let is_alone = letter.is_none();
            letters.extend(letter);
            is_alone
        };
        let detours = self.state.replan(now, &mut may_go_on);
        *snapshot = Some(self.publish(now));
        detours
    }

    /// Makes the state as it is what everybody sees, and tells what has happened.
    fn publish(&mut self, now: Timestamp) -> Arc<Snapshot> {
        let (snapshot, events) = self.state.told();
        self.world.store(snapshot.clone());
        give_way();
        self.events.add(events, now, &snapshot.revision);
        snapshot
    }

    /// Answers those who have asked: for what is to survive a restart once it is stored, and those who wait for all
    /// plans once all are replanned.
    fn answer(
        &mut self,
        replies: Vec<Reply>,
        askers: Vec<(Option<Asker>, bool, bool)>,
        snapshot: Arc<Snapshot>,
    ) {
        let (mut answers, mut at_once) = (Vec::new(), Vec::new());
        for (reply, (asker, is_change, waits_for_plans)) in replies.into_iter().zip(askers) {
            match asker {
                Some(asker) if waits_for_plans => self.waiting.for_all_plans.push((asker, reply)),
                Some(asker) if is_change && reply.is_ok() => answers.push((asker, reply)),
                Some(asker) => at_once.push((asker, reply)),
                None => {}
            }
        }
        self.store.publish(Waiting {
            answers,
            snapshot: snapshot.clone(),
        });
        if !self.state.has_waiting() {
            at_once.append(&mut self.waiting.for_all_plans);
        }
        for (asker, reply) in at_once {
            // Nothing of it is to be stored. Whoever asked may have gone at its deadline.
            let _ = asker.send((reply, snapshot.clone()));
        }
    }
}
