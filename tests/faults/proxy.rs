//! A line that can be bad: a proxy that swallows, resets, slows down, cuts and bends what goes through it.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests of faults tell how long things took"
)]

use crate::daemon::Address;
use crate::rounds::Chance;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream, UnixStream};
use tokio::sync::watch;
use tokio::task::JoinHandle;

/// What a line does with what goes through it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    /// Nothing else.
    Good,
    /// Nothing arrives as long as it lasts, and no end is told.
    BlackHole,
    /// Connections are reset.
    Reset,
    /// A byte a second.
    Slow,
    /// Answers end after some bytes.
    Cut,
    /// Answers have another bit here and there.
    Bent,
}

/// The whole answer is asked for again where one byte takes this long.
const SLOW: Duration = Duration::from_secs(1);

/// How often a black hole looks whether it still is one.
const STEP: Duration = Duration::from_millis(5);

/// Where a line leads.
#[derive(Clone, Debug)]
pub(crate) enum End {
    /// To a daemon, wherever it is at the moment.
    Daemon(Address),
    /// To a socket in the file system.
    Socket(PathBuf),
}

/// A proxy. It ends when it is dropped.
#[derive(Debug)]
pub(crate) struct Proxy {
    /// Where it listens, as an address of what is behind it.
    pub(crate) address: Address,
    shared: Arc<Shared>,
    accepting: JoinHandle<()>,
}

#[derive(Debug)]
struct Shared {
    line: Mutex<Line>,
    end: Mutex<End>,
    chance: Mutex<Chance>,
    accepted: AtomicU64,
    /// How often it was turned to another end.
    turns: watch::Sender<u64>,
    /// When something was asked.
    asked: Mutex<Vec<Instant>>,
}

impl Shared {
    fn line(&self) -> Line {
        *self.line.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn end(&self) -> End {
        self.end
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// Returns once the line is no black hole any more: what went in comes out then, as it was never acknowledged.
    async fn healed(&self) {
        while self.line() == Line::BlackHole {
            tokio::time::sleep(STEP).await;
        }
    }

    fn chance(&self) -> MutexGuard<'_, Chance> {
        self.chance.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Proxy {
    pub(crate) async fn to(end: End, seed: u64) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let shared = Arc::new(Shared {
            line: Mutex::new(Line::Good),
            end: Mutex::new(end),
            chance: Mutex::new(Chance::of(seed, 5_000)),
            accepted: AtomicU64::new(0),
            turns: watch::Sender::new(0),
            asked: Mutex::default(),
        });
        let here = listener.local_addr().expect("an address");
        let accepting = tokio::spawn(accept(listener, shared.clone()));
        Self {
            address: Address::at(here),
            shared,
            accepting,
        }
    }

    pub(crate) fn becomes(&self, line: Line) {
        let mut now = self.shared.line.lock();
        *now.as_deref_mut().expect("no thread panics with it") = line;
    }

    /// New connections lead there; those that are there are cut.
    pub(crate) fn leads_to(&self, end: End) {
        let mut now = self.shared.end.lock();
        *now.as_deref_mut().expect("no thread panics with it") = end;
        self.shared.turns.send_modify(|turns| *turns += 1);
    }

    pub(crate) fn socket(&self) -> SocketAddr {
        self.address.get().expect("it listens")
    }

    /// When something was asked through it.
    pub(crate) fn asked(&self) -> Vec<Instant> {
        let asked = self.shared.asked.lock();
        asked.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// How many connections were made.
    pub(crate) fn accepted(&self) -> u64 {
        self.shared.accepted.load(Ordering::Relaxed)
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.accepting.abort();
    }
}

async fn accept(listener: TcpListener, shared: Arc<Shared>) {
    while let Ok((near, _)) = listener.accept().await {
        shared.accepted.fetch_add(1, Ordering::Relaxed);
        tokio::spawn(carry(near, shared.clone()));
    }
}

/// Carries a connection until either side ends.
async fn carry(near: TcpStream, shared: Arc<Shared>) {
    if shared.line() == Line::Reset {
        reset(&near);
        return;
    }
    shared.healed().await;
    let end = shared.end();
    match &end {
        End::Daemon(address) => {
            let Some(address) = address.get() else {
                return;
            };
            if let Ok(far) = TcpStream::connect(address).await {
                both(near, far, &shared).await;
            }
        }
        End::Socket(path) => {
            if let Ok(far) = UnixStream::connect(path).await {
                both(near, far, &shared).await;
            }
        }
    }
}

/// The other side is told at once, and not that all is well.
fn reset(near: &TcpStream) {
    let _ = near.set_zero_linger();
}

async fn both<F: AsyncRead + AsyncWrite>(mut near: TcpStream, far: F, shared: &Shared) {
    let (far_out, far_in) = tokio::io::split(far);
    let mut turns = shared.turns.subscribe();
    {
        let (near_out, near_in) = near.split();
        tokio::select! {
            _ = turns.changed() => {}
            () = pump(near_out, far_in, shared, false) => {}
            () = pump(far_out, near_in, shared, true) => {}
        }
    }
    if shared.line() == Line::Reset {
        reset(&near);
    }
}

/// Carries one direction.
async fn pump(
    mut from: impl AsyncRead + Unpin,
    mut to: impl AsyncWrite + Unpin,
    shared: &Shared,
    is_answer: bool,
) {
    let mut buffer = [0_u8; 8_192];
    loop {
        let Ok(count) = from.read(&mut buffer).await else {
            return;
        };
        if count == 0 {
            return;
        }
        let bytes = &mut buffer[..count];
        if !is_answer {
            let asked = shared.asked.lock();
            asked
                .unwrap_or_else(PoisonError::into_inner)
                .push(Instant::now());
        }
        let written = match shared.line() {
            Line::Good => to.write_all(bytes).await,
            Line::BlackHole => {
                shared.healed().await;
                to.write_all(bytes).await
            }
            Line::Reset => return,
            Line::Slow => slowly(&mut to, bytes, shared).await,
            Line::Cut if is_answer => {
                let kept = usize::try_from(shared.chance().below(count as u64)).unwrap_or_default();
                let _ = to.write_all(&bytes[..kept]).await;
                return;
            }
            Line::Bent if is_answer => {
                bend(bytes, shared);
                to.write_all(bytes).await
            }
            Line::Cut | Line::Bent => to.write_all(bytes).await,
        };
        if written.is_err() {
            return;
        }
    }
}

fn bend(bytes: &mut [u8], shared: &Shared) {
    let mut chance = shared.chance();
    for _ in 0..chance.below(3) {
        let place = usize::try_from(chance.below(bytes.len() as u64)).unwrap_or_default();
        bytes[place] ^= 1 << chance.below(8);
    }
}

async fn slowly(
    to: &mut (impl AsyncWrite + Unpin),
    bytes: &[u8],
    shared: &Shared,
) -> std::io::Result<()> {
    for (place, byte) in bytes.iter().enumerate() {
        if shared.line() != Line::Slow {
            return to.write_all(&bytes[place..]).await;
        }
        to.write_all(&[*byte]).await?;
        tokio::time::sleep(SLOW).await;
    }
    Ok(())
}
