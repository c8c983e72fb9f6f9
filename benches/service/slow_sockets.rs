//! A client that asks steadily, alone and beside sockets that hold connections without asking anything.
//!
//! Half of them are silent; the others send a header byte by byte. Whichever the edge closes is opened again at
//! once. The client's times count from the moment at which it meant to send.

use crate::pairs::ask;
use crate::rest_load;
use crate::servers::Server;
use crate::workload::Workload;
use crate::{Extent, Result};
use std::cell::Cell;
use std::convert::Infallible;
use std::io;
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::oneshot;
use tokio::task::{JoinSet, LocalSet};
use tokio::time::{interval, sleep};

/// 200 requests a second.
const PACE: Duration = Duration::from_millis(5);
/// A socket that dribbles sends a byte this often.
const DRIBBLE_PACE: Duration = Duration::from_millis(250);
/// How long to wait where a connection could not be opened.
const BACK_OFF: Duration = Duration::from_millis(10);

/// Sorted times of a client's requests, in microseconds.
struct Times(Vec<f64>);

impl Times {
    fn at_us(&self, share: f64) -> f64 {
        let last = self.0.len().saturating_sub(1);
        let place = (share * last as f64).round() as usize;
        self.0.get(place).copied().unwrap_or(f64::NAN)
    }
}

/// Measures the client, alone and beside slow sockets.
pub(crate) fn measure(edge: &Server, workload: &Workload, extent: Extent) -> Result<()> {
    let requests = rest_load::requests(edge.address, &workload.reports);
    let busy = |times: Times, before: Duration| -> Result<(Times, f64)> {
        let worked = edge.processor_time()? - before;
        Ok((times, worked.as_secs_f64() / extent.paced.as_secs_f64()))
    };
    let before = edge.processor_time()?;
    let quiet = busy(paced(edge.address, &requests, extent.paced)?, before)?;
    let opened = Rc::new(Cell::new(0));
    let (times, before) = beside_slow(edge, requests, extent, &opened)?;
    let beside = busy(times, before)?;
    println!(
        "\n| REST, one client, {} requests/s | requests | p50 µs | p99 µs | max µs | server busy |\n|---|---:|---:|---:|---:|---:|",
        1_000 / PACE.as_millis()
    );
    let count = extent.slow_sockets;
    for (name, (times, share)) in [
        ("alone".to_owned(), quiet),
        (
            format!("beside {count} silent and {count} dribbling sockets"),
            beside,
        ),
    ] {
        println!(
            "| {name} | {} | {:.0} | {:.0} | {:.0} | {:.1} % |",
            times.0.len(),
            times.at_us(0.5),
            times.at_us(0.99),
            times.at_us(1.0),
            100.0 * share
        );
    }
    println!(
        "\n{} sockets were opened for the {} slow ones: the edge closes them at its deadlines.",
        opened.get(),
        2 * count
    );
    Ok(())
}

/// The client's times beside slow sockets, and what the server had worked before they were taken.
fn beside_slow(
    edge: &Server,
    requests: Vec<Vec<u8>>,
    extent: Extent,
    opened: &Rc<Cell<u64>>,
) -> Result<(Times, Duration)> {
    let address = edge.address;
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let local = LocalSet::new();
    local.block_on(&runtime, async {
        let mut slow = JoinSet::new();
        for _ in 0..extent.slow_sockets {
            slow.spawn_local(silent(address, opened.clone()));
            slow.spawn_local(dribbling(address, opened.clone()));
        }
        sleep(extent.slow_before).await;
        let before = edge.processor_time()?;
        let (done, measured) = oneshot::channel();
        // A thread of its own: the client is not to wait for the slow sockets' tasks.
        std::thread::spawn(move || {
            let times = paced(address, &requests, extent.paced);
            // No client waits for it any more where the run has ended.
            let _ = done.send(times.map_err(|error| error.to_string()));
        });
        Ok((measured.await??, before))
    })
}

/// One request after the other, each at its time or as soon as the one before is answered.
fn paced(address: SocketAddr, requests: &[Vec<u8>], measured: Duration) -> Result<Times> {
    let mut stream = std::net::TcpStream::connect(address)?;
    stream.set_nodelay(true)?;
    let count = (measured.as_secs_f64() / PACE.as_secs_f64()) as u32;
    let begun = Instant::now();
    let mut times_us = Vec::with_capacity(count as usize);
    for (number, request) in (0..count).zip(requests.iter().cycle()) {
        let meant = begun + number * PACE;
        std::thread::sleep(meant.saturating_duration_since(Instant::now()));
        let (head, _) = ask(&mut stream, request)?;
        if !head.is_ok {
            return Err("the paced client was refused".into());
        }
        times_us.push(meant.elapsed().as_secs_f64() * 1e6);
    }
    times_us.sort_by(f64::total_cmp);
    Ok(Times(times_us))
}

/// Opens a connection, again and again if need be.
async fn open(address: SocketAddr, opened: &Cell<u64>) -> TcpStream {
    loop {
        match TcpStream::connect(address).await {
            Ok(stream) => {
                opened.set(opened.get() + 1);
                return stream;
            }
            Err(_) => sleep(BACK_OFF).await,
        }
    }
}

async fn silent(address: SocketAddr, opened: Rc<Cell<u64>>) -> Infallible {
    loop {
        let mut stream = open(address, &opened).await;
        // However it ends, it is opened again.
        let _ = stream.read_to_end(&mut Vec::new()).await;
    }
}

async fn dribbling(address: SocketAddr, opened: Rc<Cell<u64>>) -> Infallible {
    loop {
        let stream = open(address, &opened).await;
        // However it ends, it is opened again.
        let _ = dribble(stream).await;
    }
}

async fn dribble(mut stream: TcpStream) -> io::Result<()> {
    stream
        .write_all(b"POST /v1/failures HTTP/1.1\r\nx: ")
        .await?;
    let (mut reading, mut writing) = stream.split();
    let mut pace = interval(DRIBBLE_PACE);
    let mut rest = Vec::new();
    let closed = reading.read_to_end(&mut rest);
    tokio::pin!(closed);
    loop {
        tokio::select! {
            _ = &mut closed => return Ok(()),
            _ = pace.tick() => writing.write_all(b"y").await?,
        }
    }
}
