//! A closed loop of requests in either dialect, and what is counted of it.

use crate::servers::Server;
use crate::workload::Workload;
use crate::{Extent, Result, grpc_load, rest_load};
use skyway::wire::Outcome;
use std::cell::Cell;
use std::convert::Infallible;
use std::io;
use std::rc::Rc;
use std::time::{Duration, Instant};
use tokio::task::{JoinSet, LocalSet};
use tokio::time::sleep;

/// One answer of this many is read as a client would read it; of the others, that they are answers.
const READ_EVERY: u64 = 64;

/// How drones speak to the edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dialect {
    Rest,
    Grpc,
}

impl Dialect {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Grpc => "grpc",
        }
    }

    pub(crate) fn title(self) -> String {
        match self {
            Self::Rest => format!(
                "REST, HTTP/1.1, {} connections kept alive",
                rest_load::CONNECTIONS
            ),
            Self::Grpc => format!(
                "gRPC, HTTP/2 without TLS, {} connections of {} streams",
                grpc_load::CONNECTIONS,
                grpc_load::STREAMS
            ),
        }
    }

    fn connections(self) -> usize {
        match self {
            Self::Rest => rest_load::CONNECTIONS,
            Self::Grpc => grpc_load::CONNECTIONS,
        }
    }
}

/// What has come back so far.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    answered: Cell<u64>,
    refused: Cell<u64>,
    read: Cell<u64>,
    rerouted: Cell<u64>,
}

impl Tally {
    /// Counts an answer; `outcome` reads it, where its turn has come.
    pub(crate) fn answer(&self, outcome: impl FnOnce() -> Option<Outcome>) {
        let number = self.answered.get();
        self.answered.set(number + 1);
        if number.is_multiple_of(READ_EVERY) {
            self.read.set(self.read.get() + 1);
            let is_rerouted = outcome() == Some(Outcome::Rerouted);
            self.rerouted
                .set(self.rerouted.get() + u64::from(is_rerouted));
        }
    }

    /// Counts what is no answer.
    pub(crate) fn refuse(&self) {
        self.refused.set(self.refused.get() + 1);
    }
}

/// What one server did under load.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    pub(crate) requests_per_s: f64,
    /// Processor time of the server for each request, in microseconds, the kernel's part included.
    pub(crate) server_us: f64,
    /// Which part of the time the server worked; well below 1 it is the load that is measured.
    pub(crate) server_share: f64,
    /// Which part of the answers that were read lead on to the destination.
    pub(crate) rerouted_share: f64,
    /// How many requests were refused, in the time to warm up too.
    pub(crate) refused: u64,
}

/// The part of its requests that a server may refuse: at saturation the edge sheds where the machine stalls for longer
/// than its patience. What is refused counts as not answered.
const REFUSED_MOST: f64 = 0.05;

/// The counts and clocks at one moment.
struct Reading {
    at: Instant,
    answered: u64,
    server: Duration,
}

impl Reading {
    fn take(server: &Server, tally: &Tally) -> Result<Self> {
        Ok(Self {
            at: Instant::now(),
            answered: tally.answered.get(),
            server: server.processor_time()?,
        })
    }
}

/// Loads a server, and measures once it is warm.
pub(crate) fn run(
    dialect: Dialect,
    server: &Server,
    workload: &Workload,
    extent: Extent,
) -> Result<Run> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .event_interval(1)
        .build()?;
    let local = LocalSet::new();
    local.block_on(&runtime, async {
        let tally = Rc::new(Tally::default());
        let mut connections = connect_all(dialect, server, workload, &tally);
        connections.spawn_local(stay_awake());
        let measuring = async {
            sleep(extent.warm_up).await;
            let begin = Reading::take(server, &tally)?;
            sleep(extent.measured).await;
            let end = Reading::take(server, &tally)?;
            summed_up(&begin, &end, &tally)
        };
        tokio::select! {
            run = measuring => run,
            ended = connections.join_next() => match ended {
                Some(Ok(Err(error))) => Err(error.into()),
                _ => Err("a connection of the load ended".into()),
            },
        }
    })
}

/// Keeps the load from sleeping. A server has to wake a client that sleeps, which is dear in a virtual machine; how
/// often that happens depends on how slow it is, which exaggerates differences.
async fn stay_awake() -> io::Result<Infallible> {
    loop {
        tokio::task::yield_now().await;
    }
}

fn connect_all(
    dialect: Dialect,
    server: &Server,
    workload: &Workload,
    tally: &Rc<Tally>,
) -> JoinSet<io::Result<Infallible>> {
    let mut connections = JoinSet::new();
    let address = server.address;
    let requests: Rc<Vec<Vec<u8>>> = Rc::new(match dialect {
        Dialect::Rest => rest_load::requests(address, &workload.reports),
        Dialect::Grpc => grpc_load::requests(&workload.reports),
    });
    for number in 0..dialect.connections() {
        // Each connection begins elsewhere, so that no two ask the same at once.
        let first = number * requests.len() / dialect.connections();
        let (requests, tally) = (requests.clone(), tally.clone());
        match dialect {
            Dialect::Rest => {
                connections.spawn_local(rest_load::drive(address, requests, first, tally))
            }
            Dialect::Grpc => {
                connections.spawn_local(grpc_load::drive(address, requests, first, tally))
            }
        };
    }
    connections
}

fn summed_up(begin: &Reading, end: &Reading, tally: &Tally) -> Result<Run> {
    let answered = end.answered - begin.answered;
    let refused = tally.refused.get();
    if answered == 0 || refused as f64 > REFUSED_MOST * answered as f64 {
        return Err(format!("{answered} requests were answered and {refused} refused").into());
    }
    let took_s = (end.at - begin.at).as_secs_f64();
    let server_s = (end.server - begin.server).as_secs_f64();
    Ok(Run {
        requests_per_s: answered as f64 / took_s,
        server_us: server_s * 1e6 / answered as f64,
        server_share: server_s / took_s,
        rerouted_share: tally.rerouted.get() as f64 / tally.read.get() as f64,
        refused,
    })
}
