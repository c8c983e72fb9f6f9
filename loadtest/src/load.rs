//! The open loop: requests are sent when they are due, whether earlier ones are answered or not.
//!
//! A closed loop waits for an answer before it asks again. While a server stalls it asks nothing, and so the stall
//! is in one of its times only. Here all that was due meanwhile is in the histogram, each with the time since it
//! was due.

use crate::arrivals::Schedule;
use crate::measures::{Ending, Moments, Recorder, Seen};
use crate::scenario::Arrivals;
use crate::transport::{Connections, Told, Wanted};
use crate::watch::Watch;
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::time::{Duration, Instant};
use tokio::task::{spawn_local, yield_now};
use tokio::time::{sleep, timeout_at};

/// From the start of a run to the first request.
const HEAD_START: Duration = Duration::from_millis(2);
/// A pass over everything that is ready, in which nothing was, takes less than this; one that reads an answer takes longer.
const IDLE_PASS: Duration = Duration::from_micros(4);
/// What a timer may be late, which is left to looking at the clock.
const TIMER_SLACK: Duration = Duration::from_millis(2);

/// What is sent next, and what becomes of its answer.
pub(crate) trait Source {
    /// The next request: its name in the report, and what goes over the wire.
    fn next(&self) -> Asked;
    /// Reads an answer with success.
    fn read(&self, asked: &Asked, told: &Told) -> Seen;
    /// A request had no success, or was never sent: what it was about is as before.
    fn had_no_success(&self, asked: Asked);
}

/// A request to send.
pub(crate) struct Asked {
    pub(crate) name: &'static str,
    pub(crate) wanted: Wanted,
    pub(crate) reading: Reading,
}

/// What is done with an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Reading {
    /// Nothing: that it is there is enough.
    Nothing,
    /// One of many is read: where it leads, and how fresh it is.
    Recomposition,
    /// The same of a batch.
    Batch,
    /// All are read: what was closed is opened again later.
    Publication,
    /// The plan stands from now on.
    Composed { plan: String },
    /// The zone stands from now on.
    Posted { zone: String },
    /// What stood is to be gone; it stands on where that had no success.
    Removed(Standing),
}

/// Something that was made earlier and is to be removed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Standing {
    Plan(String),
    Zone { id: String, etag: String },
    Closure(String),
}

/// When requests are due.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Flow {
    /// By a schedule, whatever the server does.
    Open {
        arrivals: Arrivals,
        rate_per_s: f64,
        seed: u64,
    },
    /// As soon as there is room: a closed loop. It finds how much is answered, and its times say nothing.
    Full,
}

/// How fast, for how long, and how much at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    pub(crate) flow: Flow,
    pub(crate) warm_up: Duration,
    pub(crate) measured: Duration,
    pub(crate) in_flight: usize,
    pub(crate) timeout: Duration,
    pub(crate) interval: Duration,
    /// Look at the clock without end rather than sleep: for a load with a core of its own. A server has to wake a
    /// client that sleeps, which is dear in a virtual machine.
    pub(crate) spins: bool,
}

/// What a run has in common with its requests.
struct Shared<S> {
    source: Rc<S>,
    connections: Rc<Connections>,
    recorder: RefCell<Recorder>,
    in_flight: Cell<usize>,
    timeout: Duration,
    spins: bool,
    measured_from: Instant,
    /// Passes in which there was nothing to do, together.
    idle: Cell<Duration>,
}

/// What a run came to.
pub(crate) struct Ran {
    pub(crate) recorder: Recorder,
    /// For how long was measured.
    pub(crate) measured: Duration,
    /// Which part of that the load itself worked, where it never sleeps: near 1 it is the load that is measured.
    pub(crate) load_share: Option<f64>,
}

/// Ends a run before its time.
pub(crate) type Stop = Rc<Cell<bool>>;

/// Sends what is due until the end, waits for what is under way, and gives what was counted. Has to be called within a
/// `LocalSet`.
pub(crate) async fn run<S: Source + 'static>(
    source: Rc<S>,
    connections: Rc<Connections>,
    pace: Pace,
    stop: Stop,
    watch: &mut Watch,
) -> Ran {
    let begin = Instant::now() + HEAD_START;
    let measured_from = begin + pace.warm_up;
    let end = measured_from + pace.measured;
    let recorder = || Recorder::new(measured_from, end, pace.interval);
    let shared = Rc::new(Shared {
        source,
        connections,
        recorder: RefCell::new(recorder()),
        in_flight: Cell::new(0),
        timeout: pace.timeout,
        spins: pace.spins,
        measured_from,
        idle: Cell::new(Duration::ZERO),
    });
    let mut measured_until = end;
    let mut dues = Dues::new(pace.flow, begin);
    loop {
        let due = dues.next(&shared, pace.in_flight).await;
        if stop.get() {
            measured_until = due.min(end);
            break;
        }
        if due >= end {
            break;
        }
        shared.wait_until(due).await;
        send(&shared, due, pace.in_flight);
        watch.look(due, &shared.recorder);
    }
    shared.wait_until(measured_until).await;
    watch.measured();
    let measured = measured_until.saturating_duration_since(measured_from);
    let idle_share = shared.idle.get().as_secs_f64() / measured.as_secs_f64().max(1e-9);
    while shared.in_flight.get() > 0 {
        shared.rest().await;
    }
    watch.ended();
    Ran {
        recorder: shared.recorder.replace(recorder()),
        measured,
        load_share: pace.spins.then_some(1.0 - idle_share),
    }
}

/// The moments at which requests are due.
enum Dues {
    Scheduled {
        schedule: Box<Schedule>,
        begin: Instant,
    },
    WhenThereIsRoom,
}

impl Dues {
    fn new(flow: Flow, begin: Instant) -> Self {
        match flow {
            Flow::Full => Self::WhenThereIsRoom,
            Flow::Open {
                arrivals,
                rate_per_s,
                seed,
            } => Self::Scheduled {
                schedule: Box::new(Schedule::new(arrivals, rate_per_s, seed)),
                begin,
            },
        }
    }

    async fn next<S>(&mut self, shared: &Shared<S>, most: usize) -> Instant {
        match self {
            Self::Scheduled { schedule, begin } => *begin + schedule.next_offset(),
            Self::WhenThereIsRoom => {
                while shared.in_flight.get() >= most {
                    shared.rest().await;
                }
                Instant::now()
            }
        }
    }
}

impl<S> Shared<S> {
    /// Lets others run until a moment has come. Answers are read also where the load is behind its schedule.
    async fn wait_until(&self, moment: Instant) {
        loop {
            self.pass().await;
            let Some(left) = moment.checked_duration_since(Instant::now()) else {
                return;
            };
            if !self.spins && left > TIMER_SLACK {
                sleep(left - TIMER_SLACK).await;
            }
        }
    }

    /// Waits a little for answers.
    async fn rest(&self) {
        match self.spins {
            true => self.pass().await,
            false => sleep(TIMER_SLACK).await,
        }
    }

    /// Lets everything run that is ready.
    async fn pass(&self) {
        let begun = Instant::now();
        yield_now().await;
        let took = begun.elapsed();
        if took < IDLE_PASS && begun >= self.measured_from {
            self.idle.set(self.idle.get() + took);
        }
    }
}

fn send<S: Source + 'static>(shared: &Rc<Shared<S>>, intended: Instant, most: usize) {
    if shared.in_flight.get() >= most {
        let now = Instant::now();
        let moments = Moments {
            intended,
            begun: now,
            sent: now,
            ended: now,
        };
        let asked = shared.source.next();
        let mut recorder = shared.recorder.borrow_mut();
        recorder.record(asked.name, moments, Ending::Unsent, None);
        return shared.source.had_no_success(asked);
    }
    shared.in_flight.set(shared.in_flight.get() + 1);
    let asked = shared.source.next();
    let shared = shared.clone();
    spawn_local(async move {
        exchange(&shared, asked, intended).await;
        shared.in_flight.set(shared.in_flight.get() - 1);
    });
}

async fn exchange<S: Source>(shared: &Shared<S>, asked: Asked, intended: Instant) {
    let begun = Instant::now();
    let sent = Cell::new(begun);
    let deadline = intended + shared.timeout;
    let asking = shared.connections.ask_telling(&asked.wanted, &sent);
    let told = timeout_at(deadline.into(), asking).await;
    let moments = Moments {
        intended,
        begun,
        sent: sent.get(),
        ended: Instant::now(),
    };
    let (ending, problem) = match &told {
        Err(_) => (Ending::TimedOut, None),
        Ok(Err(broken)) => (Ending::Broken, Some(broken.to_string())),
        Ok(Ok(told)) if told.status.is_success() => (Ending::Answered, None),
        Ok(Ok(told)) if told.status.is_shed() => (Ending::Shed, Some(told.status.text())),
        Ok(Ok(told)) => (Ending::Refused, Some(told.status.text())),
    };
    let mut recorder = shared.recorder.borrow_mut();
    recorder.record(asked.name, moments, ending, problem);
    if let (Ending::Answered, Ok(Ok(told))) = (ending, &told) {
        let seen = shared.source.read(&asked, told);
        return recorder.see(asked.name, intended, seen);
    }
    shared.source.had_no_success(asked);
}
