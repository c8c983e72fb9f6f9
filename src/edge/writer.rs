//! The single writer: it carries out orders in batches and publishes what comes of them.
//!
//! Requests never wait for it unless they have to know what became of their order. As a thread it sleeps until
//! the next order or the next instant at which something happens by itself; in place it works whenever an order
//! is handed in, on the thread of whoever hands it in, so that a simulation has one thread and one order of events.

use super::background::{begin_turn, give_way};
use super::events::Events;
use super::offers::Opened;
use super::orders::{Order, Reply};
use super::snapshot::Snapshot;
use super::state::State;
use super::store::{Store, Waiting};
use super::tables::Tables;
use crate::clock::Clock;
use crate::refusal::{Code, Refusal};
use arc_swap::ArcSwap;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::oneshot;

/// At most this many orders wait.
const QUEUE: usize = 4_096;
/// At most this many orders make one snapshot.
const BATCH: usize = 256;
/// The writer looks at the clock at least this often, as a clock may be set.
const LONGEST_SLEEP: Duration = Duration::from_secs(1);

/// An order, and who waits for what becomes of it.
#[derive(Debug)]
pub(super) struct Letter {
    order: Order,
    reply: Option<oneshot::Sender<(Reply, Arc<Snapshot>)>>,
}

/// Where orders are handed in.
#[derive(Clone, Debug)]
pub(super) enum Writer {
    /// A thread takes them.
    Thread(SyncSender<Letter>),
    /// They are carried out at once.
    InPlace(Arc<Mutex<Desk>>),
}

/// What the writer publishes to.
#[derive(Debug)]
pub(super) struct Desk {
    pub(super) state: State,
    pub(super) store: Store,
    pub(super) clock: Clock,
    pub(super) world: Arc<ArcSwap<Snapshot>>,
    pub(super) events: Arc<Events>,
    pub(super) tables: Tables,
    /// Where better plans are looked for, if anywhere.
    pub(super) opened: Option<Opened>,
}

impl Writer {
    /// Starts the thread. It ends when the last handle to it is dropped.
    pub(super) fn start(desk: Desk) -> std::io::Result<Self> {
        let (orders, inbox) = sync_channel(QUEUE);
        let builder = std::thread::Builder::new().name("skyway-writer".to_owned());
        builder.spawn(move || desk.work(&inbox))?;
        Ok(Self::Thread(orders))
    }

    /// A writer without a thread: what is due happens with the next order.
    pub(super) fn in_place(desk: Desk) -> Self {
        Self::InPlace(Arc::new(Mutex::new(desk)))
    }

    /// Hands in an order and waits for what becomes of it.
    pub(super) async fn ask(&self, order: Order) -> Result<(Reply, Arc<Snapshot>), Refusal> {
        let (reply, answer) = oneshot::channel();
        self.send(Letter {
            order,
            reply: Some(reply),
        })?;
        answer.await.map_err(|_| stopped())
    }

    /// Hands in an order that nobody waits for.
    pub(super) fn tell(&self, order: Order) -> Result<(), Refusal> {
        self.send(Letter { order, reply: None })
    }

    fn send(&self, letter: Letter) -> Result<(), Refusal> {
        let orders = match self {
            Self::Thread(orders) => orders,
            Self::InPlace(desk) => {
                // A batch is applied whole or panics before it is published.
                let mut desk = desk.lock().unwrap_or_else(PoisonError::into_inner);
                desk.carry_out(vec![letter]);
                return Ok(());
            }
        };
        orders.try_send(letter).map_err(|error| match error {
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

impl Desk {
    fn work(mut self, inbox: &Receiver<Letter>) {
        loop {
            let mut letters = match inbox.recv_timeout(self.patience()) {
                Ok(letter) => vec![letter],
                Err(RecvTimeoutError::Timeout) => Vec::new(),
                Err(RecvTimeoutError::Disconnected) => return,
            };
            letters.extend(inbox.try_iter().take(BATCH - 1));
            let reading = self.clock.reading();
            let is_due = self.state.has_clock_news(&reading)
                || self.state.next_due().is_some_and(|due| due <= reading.now);
            if !letters.is_empty() || is_due {
                self.carry_out(letters);
            }
        }
    }

    /// How long nothing can happen by itself.
    fn patience(&self) -> Duration {
        let due = self.state.next_due();
        let until = due.and_then(|instant| self.clock.real_duration_until(instant));
        until.map_or(LONGEST_SLEEP, |until| until.min(LONGEST_SLEEP))
    }

    /// Carries out letters in batches: one, unless some of them replace the network, which begin batches of their own.
    fn carry_out(&mut self, mut letters: Vec<Letter>) {
        let replaces = |letter: &Letter| letter.order.replaces_network();
        while let Some(place) = letters.iter().skip(1).position(replaces) {
            let rest = letters.split_off(place + 1);
            self.carry_out_batch(std::mem::replace(&mut letters, rest));
        }
        self.carry_out_batch(letters);
    }

    fn carry_out_batch(&mut self, letters: Vec<Letter>) {
        begin_turn();
        let reading = self.clock.reading();
        self.state.hear_clock(&reading);
        let now = reading.now;
        let (orders, askers): (Vec<Order>, Vec<_>) = letters
            .into_iter()
            .map(|letter| {
                let changes = letter.order.changes_by_request();
                (letter.order, letter.reply.map(|asker| (asker, changes)))
            })
            .unzip();
        let batch = self.state.apply(orders, now);
        // Enforced before stored, and acknowledged after both: nothing waits for a disk to be safe.
        self.world.store(batch.snapshot.clone());
        give_way();
        if batch.airspace_changed {
            self.tables.renew();
        }
        if let Some(opened) = self.opened.as_ref().filter(|_| batch.has_opened) {
            opened.tell();
        }
        self.events.add(batch.events, now, &batch.snapshot.revision);
        let (mut answers, mut at_once) = (Vec::new(), Vec::new());
        for (reply, asker) in batch.replies.into_iter().zip(askers) {
            match asker {
                Some((asker, true)) if reply.is_ok() => answers.push((asker, reply)),
                Some((asker, _)) => at_once.push((asker, reply)),
                None => {}
            }
        }
        self.store.publish(Waiting {
            answers,
            snapshot: batch.snapshot.clone(),
        });
        for (asker, reply) in at_once {
            // Nothing of it is to be stored. Whoever asked may have gone at its deadline.
            let _ = asker.send((reply, batch.snapshot.clone()));
        }
    }
}
