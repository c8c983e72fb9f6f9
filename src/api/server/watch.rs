//! What a connection is doing, as far as it can be told from outside, and for how long it may.
//!
//! hyper's own deadline for heads sets a timer for every request. Here requests only count; a look about
//! once a second compares the counts with those of the last look, so that the way of a request has no clock.

use crate::api::metrics::CloseReason;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, AtomicU64, Ordering::Relaxed};
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::Instant;

/// What every HTTP/2 connection begins with (RFC 9113, 3.4).
const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

/// How often a connection is looked at; a deadline may pass by this much.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// How long an idle connection has to leave once asked, and an unfinished head during a drain.
const LEAVE_WITHIN: Duration = Duration::from_secs(1);

const UNDECIDED: u8 = 0;
const HTTP_1: u8 = 1;
const HTTP_2: u8 = 2;

/// What a connection's socket and service count.
#[derive(Debug, Default)]
pub(crate) struct ConnectionActivity {
    protocol: AtomicU8,
    reads: AtomicU64,
    writes: AtomicU64,
    write_waits: AtomicBool,
    in_flight: AtomicU32,
    requests: AtomicU64,
    /// `reads` when the last request ended: more than that is the beginning of the next head.
    reads_when_quiet: AtomicU64,
}

/// A request in flight, until its answer is out or dropped.
#[derive(Debug)]
pub(crate) struct InFlight {
    pulse: Arc<ConnectionActivity>,
}

impl InFlight {
    pub(crate) fn begin(pulse: &Arc<ConnectionActivity>) -> Self {
        pulse.in_flight.fetch_add(1, Relaxed);
        pulse.requests.fetch_add(1, Relaxed);
        Self {
            pulse: Arc::clone(pulse),
        }
    }
}

impl Drop for InFlight {
    fn drop(&mut self) {
        let reads = self.pulse.reads.load(Relaxed);
        self.pulse.reads_when_quiet.store(reads, Relaxed);
        self.pulse.in_flight.fetch_sub(1, Relaxed);
    }
}

/// A socket that counts.
#[derive(Debug)]
pub(crate) struct WatchedStream {
    stream: TcpStream,
    pulse: Arc<ConnectionActivity>,
    /// How many bytes agreed with the preface so far.
    agreed: usize,
}

impl WatchedStream {
    pub(crate) fn new(stream: TcpStream, pulse: Arc<ConnectionActivity>) -> Self {
        Self {
            stream,
            pulse,
            agreed: 0,
        }
    }

    fn note_read(&mut self, bytes: &[u8]) {
        self.pulse.reads.fetch_add(1, Relaxed);
        if self.pulse.protocol.load(Relaxed) != UNDECIDED {
            return;
        }
        let awaited = &PREFACE[self.agreed..];
        let common = awaited.len().min(bytes.len());
        if bytes[..common] != awaited[..common] {
            self.pulse.protocol.store(HTTP_1, Relaxed);
            return;
        }
        self.agreed += common;
        if self.agreed == PREFACE.len() {
            self.pulse.protocol.store(HTTP_2, Relaxed);
        }
    }

    fn note_write<T>(&self, polled: &Poll<T>) {
        if polled.is_ready() {
            self.pulse.writes.fetch_add(1, Relaxed);
        }
        self.pulse.write_waits.store(polled.is_pending(), Relaxed);
    }
}

impl AsyncRead for WatchedStream {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<std::io::Result<()>> {
        let filled_before = buffer.filled().len();
        let polled = Pin::new(&mut self.stream).poll_read(context, buffer);
        let fresh = &buffer.filled()[filled_before..];
        if !fresh.is_empty() {
            self.note_read(fresh);
        }
        polled
    }
}

impl AsyncWrite for WatchedStream {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<std::io::Result<usize>> {
        let polled = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.note_write(&polled);
        polled
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffers: &[std::io::IoSlice<'_>],
    ) -> Poll<std::io::Result<usize>> {
        let polled = Pin::new(&mut self.stream).poll_write_vectored(context, buffers);
        self.note_write(&polled);
        polled
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<std::io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<std::io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

/// How long a connection may be at what it is doing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Deadlines {
    pub(crate) preface: Duration,
    pub(crate) header: Duration,
    pub(crate) idle: Duration,
    pub(crate) write: Duration,
}

/// What a connection is doing. Two equal ones, at two looks, mean that nothing has happened in between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Doing {
    Preface,
    Head { request: u64 },
    Idle { requests: u64 },
    Request,
    Stalled { writes: u64 },
}

/// What to do about a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Look again then.
    LookAt(Instant),
    /// Ask it to leave, and look again.
    AskToLeave,
    /// Cut it.
    Cut(CloseReason),
}

/// The looks at one connection.
#[derive(Debug)]
pub(crate) struct Watch {
    deadlines: Deadlines,
    doing: Doing,
    since: Instant,
    opened: Instant,
    leaving: bool,
}

impl Watch {
    pub(crate) fn new(deadlines: Deadlines, opened: Instant) -> Self {
        Self {
            deadlines,
            doing: Doing::Preface,
            since: opened,
            opened,
            leaving: false,
        }
    }

    /// When to look for the first time.
    pub(crate) fn first_look(&self) -> Instant {
        self.opened + LOOK_EVERY.min(self.deadlines.preface)
    }

    /// The connection was asked to leave: from now on it may finish requests, and nothing else.
    pub(crate) fn leave(&mut self, now: Instant) {
        self.leaving = true;
        self.since = now;
        self.deadlines.preface = LEAVE_WITHIN;
        self.deadlines.header = LEAVE_WITHIN;
        self.deadlines.idle = LEAVE_WITHIN;
    }

    pub(crate) fn look(&mut self, pulse: &ConnectionActivity, now: Instant) -> Verdict {
        let doing = doing(pulse);
        if doing != self.doing {
            // The first head began when the connection did; of what came later, only the last look is known.
            let is_first_head = doing == Doing::Head { request: 0 };
            self.since = if is_first_head && !self.leaving {
                self.opened
            } else {
                now
            };
            self.doing = doing;
        }
        let (limit, reason) = match doing {
            Doing::Request => return Verdict::LookAt(now + LOOK_EVERY),
            Doing::Preface => (self.deadlines.preface, CloseReason::Preface),
            Doing::Head { .. } => (self.deadlines.header, CloseReason::Header),
            Doing::Idle { .. } => (self.deadlines.idle, CloseReason::Idle),
            Doing::Stalled { .. } => (self.deadlines.write, CloseReason::Stalled),
        };
        let end = self.since + limit;
        if now < end {
            return Verdict::LookAt(end.min(now + LOOK_EVERY));
        }
        if reason == CloseReason::Idle && !self.leaving {
            return Verdict::AskToLeave;
        }
        Verdict::Cut(reason)
    }
}

fn doing(pulse: &ConnectionActivity) -> Doing {
    let requests = pulse.requests.load(Relaxed);
    if pulse.write_waits.load(Relaxed) {
        let writes = pulse.writes.load(Relaxed);
        return Doing::Stalled { writes };
    }
    if pulse.in_flight.load(Relaxed) > 0 {
        return Doing::Request;
    }
    match pulse.protocol.load(Relaxed) {
        UNDECIDED => Doing::Preface,
        HTTP_1 if pulse.reads.load(Relaxed) > pulse.reads_when_quiet.load(Relaxed) => {
            Doing::Head { request: requests }
        }
        _ => Doing::Idle { requests },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEADLINES: Deadlines = Deadlines {
        preface: Duration::from_secs(3),
        header: Duration::from_secs(5),
        idle: Duration::from_secs(60),
        write: Duration::from_secs(30),
    };

    /// Looks as often as the watch wants; answers what ended it and after how many seconds.
    fn ends(watch: &mut Watch, pulse: &ConnectionActivity, from: Instant) -> (Verdict, f64) {
        let mut now = from;
        for _ in 0..1000 {
            match watch.look(pulse, now) {
                Verdict::LookAt(next) => {
                    assert!(next > now && next - now <= LOOK_EVERY);
                    now = next;
                }
                verdict => return (verdict, (now - from).as_secs_f64()),
            }
        }
        panic!("nothing ended in 1000 looks at {pulse:?}");
    }

    fn open() -> (Watch, Arc<ConnectionActivity>, Instant) {
        let opened = Instant::now();
        (Watch::new(DEADLINES, opened), Arc::default(), opened)
    }

    #[test]
    fn silence_ends_at_the_preface_deadline() {
        let (mut watch, pulse, opened) = open();
        let end = ends(&mut watch, &pulse, opened);
        assert_eq!(end, (Verdict::Cut(CloseReason::Preface), 3.0));
    }

    #[test]
    fn a_first_head_counts_from_the_opening_however_it_dribbles() {
        let (mut watch, pulse, opened) = open();
        let mut now = watch.first_look();
        pulse.protocol.store(HTTP_1, Relaxed);
        let end = loop {
            pulse.reads.fetch_add(1, Relaxed);
            match watch.look(&pulse, now) {
                Verdict::LookAt(next) => now = next,
                verdict => break verdict,
            }
        };
        assert_eq!(end, Verdict::Cut(CloseReason::Header));
        assert_eq!((now - opened).as_secs_f64(), 5.0);
    }

    #[test]
    fn a_later_head_counts_from_the_look_that_saw_it() {
        let (mut watch, pulse, opened) = open();
        pulse.protocol.store(HTTP_1, Relaxed);
        pulse.reads.store(1, Relaxed);
        drop(InFlight::begin(&pulse));
        let later = opened + Duration::from_secs(20);
        assert_eq!(
            watch.look(&pulse, later),
            Verdict::LookAt(later + LOOK_EVERY)
        );
        pulse.reads.store(2, Relaxed);
        assert_eq!(
            ends(&mut watch, &pulse, later),
            (Verdict::Cut(CloseReason::Header), 5.0)
        );
    }

    #[test]
    fn an_idle_connection_is_asked_to_leave_and_then_cut() {
        let (mut watch, pulse, opened) = open();
        pulse.protocol.store(HTTP_2, Relaxed);
        assert_eq!(
            ends(&mut watch, &pulse, opened),
            (Verdict::AskToLeave, 60.0)
        );
        let asked = opened + Duration::from_secs(60);
        watch.leave(asked);
        assert_eq!(
            ends(&mut watch, &pulse, asked),
            (Verdict::Cut(CloseReason::Idle), 1.0)
        );
    }

    #[test]
    fn a_request_may_take_its_time_even_while_leaving() {
        let (mut watch, pulse, opened) = open();
        pulse.protocol.store(HTTP_1, Relaxed);
        let visit = InFlight::begin(&pulse);
        for second in 0..1000 {
            let now = opened + Duration::from_secs(second);
            if second == 500 {
                watch.leave(now);
            }
            assert_eq!(watch.look(&pulse, now), Verdict::LookAt(now + LOOK_EVERY));
        }
        drop(visit);
        let (verdict, after_s) = ends(&mut watch, &pulse, opened + Duration::from_secs(1000));
        assert_eq!((verdict, after_s), (Verdict::Cut(CloseReason::Idle), 1.0));
    }

    #[test]
    fn a_stalled_reader_is_cut_and_a_slow_one_is_not() {
        let (mut watch, pulse, opened) = open();
        let _visit = InFlight::begin(&pulse);
        pulse.write_waits.store(true, Relaxed);
        let mut now = opened;
        for _ in 0..100 {
            pulse.writes.fetch_add(1, Relaxed);
            now += LOOK_EVERY;
            assert_eq!(watch.look(&pulse, now), Verdict::LookAt(now + LOOK_EVERY));
        }
        assert_eq!(
            ends(&mut watch, &pulse, now),
            (Verdict::Cut(CloseReason::Stalled), 30.0)
        );
    }
}
