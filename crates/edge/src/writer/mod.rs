//! The single writer: it carries out commands in batches and publishes what comes of them.
//!
//! Requests never wait for it unless they have to know what became of their order. As a thread it sleeps until
//! the next command or the next instant at which something happens by itself; in place it works whenever a command
//! is handed in, on the thread of whoever hands it in, so that a simulation has one thread and one order of events.

pub(crate) mod commands;

use crate::background::{begin_turn, give_way, in_place};
use crate::events::Events;
use crate::network::tables::Tables;
use crate::replanning::opened::Opened;
use crate::replanning::waves::{Wave, Workers};
use crate::snapshot::Snapshot;
use crate::state::State;
use crate::store::{Ahead, Store, Waiting, WavesAhead};
use arc_swap::ArcSwap;
use commands::{Command, Done, Reply};
use jiff::Timestamp;
use skyway_planted::{self as planted, Bug};
use skyway_service::clock::Clock;
use skyway_service::refusal::{Code, Refusal};
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

/// What the writer is handed.
#[derive(Debug)]
pub(crate) enum Letter {
    Command(QueuedCommand),
    /// The wave that was begun has ended.
    WaveEnded,
    /// Enough waves are stored that the next may begin.
    Stored,
}

/// A command, and who waits for what becomes of it.
#[derive(Debug)]
pub(crate) struct QueuedCommand {
    command: Command,
    reply: Option<Asker>,
}

/// Where commands are handed in.
#[derive(Clone, Debug)]
pub(crate) enum Writer {
    /// A thread takes them.
    Thread(Arc<SyncSender<Letter>>),
    /// They are carried out at once.
    InPlace(Arc<Mutex<WriterLoop>>),
}

/// Where the writer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WriterStep {
    /// What a batch of commands has changed is in force; no plan has been looked at.
    Enforced,
    /// What was found for a plan has been committed.
    LookedAtPlan,
}

/// Who watches the writer: tests, which hold it back.
#[derive(Clone, Default)]
pub(crate) struct Watch(pub(crate) Option<Arc<dyn Fn(WriterStep) + Send + Sync>>);

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

/// The writer: its state, what waits for it, and where it publishes.
#[derive(Debug)]
pub(crate) struct WriterLoop {
    pub(crate) state: State,
    pub(crate) store: Store,
    pub(crate) clock: Clock,
    pub(crate) world: Arc<ArcSwap<Snapshot>>,
    pub(crate) events: Arc<Events>,
    pub(crate) tables: Tables,
    /// Where better plans are looked for, if anywhere.
    pub(crate) opened: Option<Opened>,
    pub(crate) watch: Watch,
    /// The threads that look at plans; none where the writer works in place.
    pub(crate) workers: Option<Workers>,
    pub(crate) wave: WaveState,
    pub(crate) when_idle: WhenIdle,
    pub(crate) waiting: Unanswered,
    /// The waves that are not stored yet.
    pub(crate) waves_ahead: WavesAhead,
}

/// What is done once no plan waits for the cores.
#[derive(Debug, Default)]
pub(crate) struct WhenIdle {
    /// Whether the airspace has changed since tables were last made.
    has_new_airspace: bool,
    /// Whether anything has opened since better plans were last looked for.
    has_opened: bool,
}

/// The wave that plans are in, if any.
#[derive(Debug, Default)]
pub(crate) enum WaveState {
    #[default]
    Idle,
    /// Threads work on it.
    Begun(Arc<Wave>),
    /// It has ended; what was found is committed from this job on.
    Committing(Arc<Wave>, usize),
}

/// What the writer has yet to come to.
#[derive(Debug, Default)]
pub(crate) struct Unanswered {
    /// Letters that came in while findings were committed.
    letters: Vec<Letter>,
    /// Batches whose answers tell something of the plans that they meet: they wait for the next wave.
    for_next_wave: Vec<Batch>,
    /// And those that wait for the one that has begun.
    for_this_wave: Vec<Batch>,
    /// Who waits until all plans are.
    for_all_plans: Vec<(Asker, Reply)>,
}

/// What a batch of commands came to, and who waits for that.
#[derive(Debug)]
struct Batch {
    done: Vec<Result<Done, Refusal>>,
    askers: Vec<Waiter>,
}

/// Who waits for a command, if anyone.
#[derive(Debug)]
struct Waiter {
    asker: Option<Asker>,
    is_change: bool,
    waits_for_plans: bool,
}

impl Writer {
    /// Starts the thread. It ends when the last handle to it is dropped.
    pub(crate) fn start(mut writer_loop: WriterLoop) -> std::io::Result<Self> {
        let (commands, inbox) = sync_channel(QUEUE);
        let commands = Arc::new(commands);
        // Weak, as the writer ends with the last who may hand in a command.
        let writer = Arc::downgrade(&commands);
        let means = writer_loop.state.means_of_waves();
        writer_loop.workers = Some(Workers::start(&means, move || {
            if let Some(writer) = writer.upgrade() {
                let _ = writer.send(Letter::WaveEnded);
            }
        })?);
        let writer = Arc::downgrade(&commands);
        writer_loop.waves_ahead = WavesAhead::new(move || {
            // A writer that is behind with its letters looks by itself.
            if let Some(writer) = writer.upgrade() {
                let _ = writer.try_send(Letter::Stored);
            }
        });
        let builder = std::thread::Builder::new().name("skyway-writer".to_owned());
        builder.spawn(move || writer_loop.work(&inbox))?;
        Ok(Self::Thread(commands))
    }

    /// A writer without a thread: what is due happens with the next command.
    pub(crate) fn in_place(writer_loop: WriterLoop) -> Self {
        Self::InPlace(Arc::new(Mutex::new(writer_loop)))
    }

    /// Hands in a command and waits for what becomes of it.
    pub(crate) async fn ask(&self, command: Command) -> Result<(Reply, Arc<Snapshot>), Refusal> {
        let (reply, answer) = oneshot::channel();
        self.send(QueuedCommand {
            command,
            reply: Some(reply),
        })?;
        answer.await.map_err(|_| stopped())
    }

    /// Hands in a command that nobody waits for.
    pub(crate) fn tell(&self, command: Command) -> Result<(), Refusal> {
        self.send(QueuedCommand {
            command,
            reply: None,
        })
    }

    fn send(&self, queued: QueuedCommand) -> Result<(), Refusal> {
        let commands = match self {
            Self::Thread(commands) => commands,
            Self::InPlace(writer_loop) => {
                in_place(|| {
                    // Fair: those that wait for it have their turn in order.
                    let free = writer_loop.try_lock();
                    let mut writer_loop = free.unwrap_or_else(|_| writer_loop.blocking_lock());
                    writer_loop.carry_out(vec![queued]);
                });
                return Ok(());
            }
        };
        commands
            .try_send(Letter::Command(queued))
            .map_err(|error| match error {
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
    fn work(mut self, inbox: &Receiver<Letter>) {
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
            let mut commands = Vec::with_capacity(letters.len());
            for letter in letters {
                match letter {
                    Letter::Command(command) => commands.push(command),
                    Letter::WaveEnded => self.end_wave(),
                    Letter::Stored => {}
                }
            }
            let reading = self.clock.reading();
            let is_due = self.state.has_clock_news(&reading)
                || self.state.next_due().is_some_and(|due| due <= reading.now);
            if !commands.is_empty() || is_due {
                self.carry_out(commands);
            }
            self.go_on(inbox);
        }
    }

    /// How long nothing can happen by itself.
    fn patience(&self) -> Duration {
        match self.wave {
            WaveState::Committing(..) => return Duration::ZERO,
            WaveState::Idle if self.state.has_waiting() && !self.waves_ahead.are_many() => {
                return Duration::ZERO;
            }
            WaveState::Idle | WaveState::Begun(_) => {}
        }
        let due = self.state.next_due();
        let until = due.and_then(|instant| self.clock.real_duration_until(instant));
        until.map_or(LONGEST_SLEEP, |until| until.min(LONGEST_SLEEP))
    }

    /// Carries out commands in batches: one, unless some of them replace the network, which begin batches of their own.
    fn carry_out(&mut self, mut commands: Vec<QueuedCommand>) {
        let replaces = |queued: &QueuedCommand| queued.command.replaces_network();
        while let Some(place) = commands.iter().skip(1).position(replaces) {
            let rest = commands.split_off(place + 1);
            self.carry_out_batch(std::mem::replace(&mut commands, rest));
        }
        self.carry_out_batch(commands);
    }

    /// Carries out commands, enforces what they change, and only then looks up the plans that it meets.
    fn carry_out_batch(&mut self, batch: Vec<QueuedCommand>) {
        begin_turn();
        if let Some(Command::AdvanceTo(to)) = batch.first().map(|queued| &queued.command) {
            // Everything happens at its own instant: the clock never passes the next one.
            let due = self.state.next_due().unwrap_or(*to);
            self.clock.move_to(due.min(*to));
        }
        let reading = self.clock.reading();
        self.state.hear_clock(&reading);
        let now = reading.now;
        let mut commands = Vec::with_capacity(batch.len());
        let mut askers = Vec::with_capacity(batch.len());
        for QueuedCommand { command, reply } in batch {
            askers.push(Waiter {
                asker: reply,
                is_change: command.changes_by_request(),
                waits_for_plans: matches!(command, Command::Settle),
            });
            commands.push(command);
        }
        let enforced = self.state.enforce(commands, now);
        // Enforced before stored, and acknowledged after both: nothing waits for a disk, or for plans, to be safe.
        let published = match planted::is(Bug::PlansFirst) {
            true => None,
            false => Some(self.publish(now)),
        };
        self.watch.tell(WriterStep::Enforced);
        let is_next = self.state.fits_next_wave();
        let has_met = self.state.look_up(&enforced.look, now);
        // The plans that something meets are shown as affected before any is recomposed.
        let snapshot = match published {
            Some(snapshot) if !has_met => snapshot,
            _ => self.publish(now),
        };
        self.when_idle.has_new_airspace |= enforced.airspace_changed;
        self.when_idle.has_opened |= enforced.has_opened;
        let batch = Batch {
            done: enforced.done,
            askers,
        };
        if self.workers.is_none() {
            self.replan_in_place(batch, now);
        } else if has_met && is_next {
            // The first are told with the answer. Where many wait before them, the client is answered at once.
            self.waiting.for_next_wave.push(batch);
            self.answer(Vec::new(), Vec::new(), snapshot, Ahead::default());
        } else {
            let replies = self.state.replies(batch.done, Vec::new());
            self.answer(replies, batch.askers, snapshot, Ahead::default());
        }
    }

    /// A first wave, the answers, and then the other waves: on the thread that hands in commands, as no other one
    /// would go on with them.
    fn replan_in_place(&mut self, batch: Batch, now: Timestamp) {
        let watch = &self.watch;
        let detours = self
            .state
            .replan(now, &mut || watch.tell(WriterStep::LookedAtPlan));
        let snapshot = self.publish(now);
        let replies = self.state.replies(batch.done, detours);
        self.answer(replies, batch.askers, snapshot, Ahead::default());
        self.use_idle_cores();
        while self.state.has_waiting() {
            let watch = &self.watch;
            self.state
                .replan(now, &mut || watch.tell(WriterStep::LookedAtPlan));
            let snapshot = self.publish(now);
            self.answer(Vec::new(), Vec::new(), snapshot, Ahead::default());
        }
    }

    fn end_wave(&mut self) {
        if let WaveState::Begun(wave) = std::mem::take(&mut self.wave) {
            self.wave = WaveState::Committing(wave, 0);
        }
    }

    /// Commits what a wave that has ended has found, until other letters come; then begins the next one.
    fn go_on(&mut self, inbox: &Receiver<Letter>) {
        match std::mem::take(&mut self.wave) {
            WaveState::Idle => {}
            WaveState::Committing(wave, from) => self.commit(&wave, from, inbox),
            begun @ WaveState::Begun(_) => self.wave = begun,
        }
        if !matches!(self.wave, WaveState::Idle) {
            return;
        }
        if !self.state.has_waiting() {
            self.use_idle_cores();
        }
        let Some(workers) = &self.workers else {
            return;
        };
        if self.waves_ahead.are_many() {
            return;
        }
        let now = self.clock.reading().now;
        if let Some(wave) = self.state.next_wave(self.world.load_full(), now) {
            let wave = Arc::new(wave);
            workers.begin(&wave);
            self.wave = WaveState::Begun(wave);
            self.waiting.for_this_wave = std::mem::take(&mut self.waiting.for_next_wave);
        }
    }

    /// No plan waits for the cores: tables are made of the airspace as it is, and better plans are looked for.
    fn use_idle_cores(&mut self) {
        let WhenIdle {
            has_new_airspace,
            has_opened,
        } = std::mem::take(&mut self.when_idle);
        if has_new_airspace {
            self.tables.renew();
        }
        if let Some(opened) = &self.opened {
            let is_taken_up = opened.takes_up();
            if has_opened || is_taken_up {
                opened.tell();
            }
        }
    }

    fn commit(&mut self, wave: &Arc<Wave>, from: usize, inbox: &Receiver<Letter>) {
        begin_turn();
        let now = self.clock.reading().now;
        let mut detours = Vec::new();
        let mut next = from;
        while next < wave.jobs().len() && self.waiting.letters.is_empty() {
            self.state.commit(wave, next, now, &mut detours);
            next += 1;
            self.watch.tell(WriterStep::LookedAtPlan);
            give_way();
            self.waiting.letters.extend(inbox.try_recv());
        }
        let mut ahead = Ahead::default();
        if next < wave.jobs().len() {
            self.wave = WaveState::Committing(wave.clone(), next);
        } else if wave.replans() {
            ahead = self.waves_ahead.one_more();
        }
        let snapshot = self.publish(now);
        let batches = std::mem::take(&mut self.waiting.for_this_wave);
        let (mut done, mut askers) = (Vec::new(), Vec::new());
        for batch in batches {
            done.extend(batch.done);
            askers.extend(batch.askers);
        }
        let replies = self.state.replies(done, detours);
        self.answer(replies, askers, snapshot, ahead);
    }

    /// Whether any plan waits for its answer or its contingencies.
    fn has_waiting(&self) -> bool {
        !matches!(self.wave, WaveState::Idle) || self.state.has_waiting()
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
        askers: Vec<Waiter>,
        snapshot: Arc<Snapshot>,
        ahead: Ahead,
    ) {
        let (mut answers, mut at_once) = (Vec::new(), Vec::new());
        for (reply, waiter) in replies.into_iter().zip(askers) {
            match waiter.asker {
                Some(asker) if waiter.waits_for_plans => {
                    self.waiting.for_all_plans.push((asker, reply));
                }
                Some(asker) if waiter.is_change && reply.is_ok() => answers.push((asker, reply)),
                Some(asker) => at_once.push((asker, reply)),
                None => {}
            }
        }
        self.store.publish(Waiting {
            ahead,
            answers,
            snapshot: snapshot.clone(),
        });
        if !self.has_waiting() {
            at_once.append(&mut self.waiting.for_all_plans);
        }
        for (asker, reply) in at_once {
            // Nothing of it is to be stored. Whoever asked may have gone at its deadline.
            let _ = asker.send((reply, snapshot.clone()));
        }
    }
}
