//! That nothing is left out: a stall is in the times of all that was due meanwhile, and what cannot be sent is counted.

use crate::load::{self, Asked, Flow, Pace, Ran, Reading, Source, Stop};
use crate::measures::{Recorder, Seen, Tally};
use crate::requests::get;
use crate::scenario::Arrivals;
use crate::transport::{Connections, Told};
use crate::watch::Watch;
use std::cell::Cell;
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::oneshot;
use tokio::task::LocalSet;
use tokio::time::sleep;

const ANSWER: &[u8] = b"HTTP/1.1 200 OK\r\ncontent-length: 2\r\n\r\n{}";
const REFUSAL: &[u8] = b"HTTP/1.1 503 Service Unavailable\r\ncontent-length: 2\r\n\r\n{}";

/// What a server does with requests.
#[derive(Clone, Copy)]
enum Conduct {
    /// Answers at once, but for one request, for which it takes this long.
    Stalls { at: u64, length: Duration },
    /// Refuses two of three.
    Sheds,
    /// Says nothing.
    IsSilent,
    /// Closes the connection in place of an answer.
    BreaksOff,
}

/// Serves HTTP/1.1 until the listener is dropped.
async fn serve(listener: TcpListener, conduct: Conduct) {
    let number = Rc::new(Cell::new(0_u64));
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            return;
        };
        tokio::task::spawn_local(answer(stream, conduct, number.clone()));
    }
}

async fn answer(mut stream: TcpStream, conduct: Conduct, number: Rc<Cell<u64>>) {
    let mut received = Vec::new();
    // How a connection ended is its client's affair.
    while let Ok(1..) = stream.read_buf(&mut received).await {
        if !received.ends_with(b"\r\n\r\n") {
            continue;
        }
        received.clear();
        number.set(number.get() + 1);
        let text = match conduct {
            Conduct::Stalls { at, length } => {
                if number.get() == at {
                    sleep(length).await;
                }
                ANSWER
            }
            Conduct::Sheds if number.get().is_multiple_of(3) => ANSWER,
            Conduct::Sheds => REFUSAL,
            Conduct::IsSilent => std::future::pending().await,
            Conduct::BreaksOff => return,
        };
        if stream.write_all(text).await.is_err() {
            return;
        }
    }
}

/// Asks the same again and again.
struct Same;

impl Source for Same {
    fn next(&self) -> Asked {
        Asked {
            name: "same",
            wanted: get("/"),
            reading: Reading::Nothing,
        }
    }

    fn read(&self, _: &Asked, _: &Told) -> Seen {
        Seen::default()
    }

    fn had_no_success(&self, _: Asked) {}
}

fn pace(rate_per_s: f64, measured: Duration) -> Pace {
    Pace {
        flow: Flow::Open {
            arrivals: Arrivals::Constant,
            rate_per_s,
            seed: 1,
        },
        warm_up: Duration::ZERO,
        measured,
        in_flight: 10_000,
        timeout: Duration::from_secs(30),
        interval: Duration::from_millis(100),
        spins: false,
    }
}

/// What is counted of a load on a server of this conduct, over a number of connections.
fn counted(conduct: Conduct, pace: Pace, connections: usize) -> Recorder {
    let load = move |address: SocketAddr| async move {
        let connections = Rc::new(Connections::new(address, connections, 1));
        let mut watch = Watch::new("test".to_owned(), None);
        let stop = Stop::new(Cell::new(false));
        load::run(Rc::new(Same), connections, pace, stop, &mut watch)
            .await
            .recorder
    };
    let (told, address) = oneshot::channel();
    let server = std::thread::spawn(move || {
        current_thread(async move {
            let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
            let address = listener.local_addr().expect("an address");
            let (ended, end) = oneshot::channel::<()>();
            told.send((address, ended)).expect("somebody who loads");
            tokio::select! {
                () = serve(listener, conduct) => {}
                _ = end => {}
            }
        });
    });
    let (address, ended) = address.blocking_recv().expect("a server");
    let recorder = current_thread(load(address));
    drop(ended);
    server.join().expect("a server that ends");
    recorder
}

fn current_thread<T>(future: impl Future<Output = T>) -> T {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .expect("a runtime");
    LocalSet::new().block_on(&runtime, future)
}

#[track_caller]
fn is_complete(tally: &Tally, scheduled: u64) {
    assert_eq!(tally.scheduled(), scheduled, "requests are left out");
}

/// A fifth of all requests are due while the server stalls, so p99 is nearly as long as the stall. On its one connection
/// a closed loop would have had one slow request of eight hundred, and a p99 of less than a millisecond.
#[test]
fn a_stall_is_in_p99() {
    let conduct = Conduct::Stalls {
        at: 250,
        length: Duration::from_millis(400),
    };
    let recorder = counted(conduct, pace(500.0, Duration::from_secs(2)), 1);
    let tally = recorder.all();
    is_complete(&tally, 999);
    assert_eq!(tally.answered, 999);
    // The first quarter of those due during the stall waited at least this long.
    let p99_ms = tally.from_intended.at_ms(0.99);
    assert!(p99_ms >= 300.0, "p99 is {p99_ms} ms");
}

#[test]
fn what_warms_up_is_left_out() {
    let conduct = Conduct::Sheds;
    let pace = Pace {
        warm_up: Duration::from_millis(300),
        ..pace(1000.0, Duration::from_millis(300))
    };
    let recorder = counted(conduct, pace, 8);
    // At 1,000 a second those of the 300th millisecond and after, until before the 600th.
    is_complete(&recorder.all(), 300);
}

#[test]
fn what_is_shed_is_no_error_and_no_answer() {
    let recorder = counted(Conduct::Sheds, pace(300.0, Duration::from_secs(1)), 1);
    let tally = recorder.all();
    is_complete(&tally, 299);
    assert_eq!((tally.answered, tally.shed, tally.failed()), (99, 200, 0));
    assert_eq!(tally.problems.get("503"), Some(&200));
}

/// Eight are under way and never answered; every other one is counted as what it is.
#[test]
fn what_cannot_be_sent_is_counted() {
    let pace = Pace {
        in_flight: 8,
        timeout: Duration::from_secs(2),
        ..pace(200.0, Duration::from_secs(1))
    };
    let recorder = counted(Conduct::IsSilent, pace, 4);
    let tally = recorder.all();
    is_complete(&tally, 199);
    assert_eq!((tally.timed_out, tally.unsent), (8, 191));
    // What was waited in vain counts as at least as long as was waited.
    assert!(tally.from_intended.at_ms(0.5) >= 2000.0);
    let failed: u64 = recorder
        .intervals
        .iter()
        .map(|interval| interval.failed)
        .sum();
    assert_eq!(failed, 199);
}

#[test]
fn broken_connections_are_counted_and_made_anew() {
    let recorder = counted(Conduct::BreaksOff, pace(100.0, Duration::from_secs(1)), 2);
    let tally = recorder.all();
    is_complete(&tally, 99);
    assert_eq!(tally.broken, 99, "{:?}", tally.problems);
}

/// Nothing is unsent where requests wait for room.
#[test]
fn a_full_load_sends_when_there_is_room() {
    let pace = Pace {
        flow: Flow::Full,
        in_flight: 4,
        ..pace(1.0, Duration::from_millis(300))
    };
    let tally = counted(Conduct::Sheds, pace, 4).all();
    assert!(tally.answered > 0);
    assert_eq!(tally.failed(), 0);
}

/// A run that is told to stop counts what was due up to then.
#[test]
fn a_run_that_is_stopped_ends_early() {
    let Ran {
        recorder, measured, ..
    } = current_thread(async {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let address = listener.local_addr().expect("an address");
        tokio::task::spawn_local(serve(listener, Conduct::Sheds));
        let stop = Stop::new(Cell::new(false));
        let stopping = stop.clone();
        tokio::task::spawn_local(async move {
            sleep(Duration::from_millis(200)).await;
            stopping.set(true);
        });
        let connections = Rc::new(Connections::new(address, 4, 1));
        let mut watch = Watch::new("test".to_owned(), None);
        let pace = pace(200.0, Duration::from_secs(600));
        load::run(Rc::new(Same), connections, pace, stop, &mut watch).await
    });
    assert!(measured < Duration::from_secs(600));
    assert!(recorder.all().scheduled() >= 1);
}
