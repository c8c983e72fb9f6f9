//! How long requests wait for a worker, and whom to refuse where that stands.
//!
//! A handler that never waits is done as soon as it is polled, so that no count of requests in flight tells an overload: what
//! is not answered yet lies in sockets that no worker has come round to. A probe shows how long
//! that takes: a byte sent to a socket of one's own goes the way of every request, through the
//! system's list of ready sockets and the workers' queue.

use super::shares::{EVERY, SHED_IN_ORDER, Shares};
use crate::api::operations::Class;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::Registry;
use std::io;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering::Relaxed};
use std::time::Duration;
use tokio::time::{Instant, sleep_until};

/// How often the probe is sent while nothing is asked.
const IDLE_EVERY: Duration = Duration::from_millis(20);

/// Where fewer requests left meanwhile that could have been shed, a probe waited for the machine or for others as much as for them:
/// its wait counts by as many parts as there were of them.
const CROWD: u32 = 8;

/// 2^64 divided by the golden ratio: its multiples, taken modulo 2^64, are spread evenly and without a period.
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// The wait of a process, shared by its gates.
#[derive(Debug)]
pub struct QueueWait {
    /// Since when times are counted, in microseconds.
    began: Instant,
    /// How many requests of each class have come.
    arrived: [AtomicU64; SHED_IN_ORDER.len()],
    /// How many of them have left, of all classes together.
    left: AtomicU64,
    /// When the next probe is due, or the one that is under way was; 0 where there is none.
    probe_us: AtomicU64,
    /// How many requests had left when that was decided.
    left_before: AtomicU64,
    /// How long the last probe waited behind requests.
    waited_us: AtomicU64,
    /// When the shares are due.
    look_at_us: AtomicU64,
    /// None where nothing is shed for waiting.
    controller: Option<Mutex<Controller>>,
    /// The share to shed of each class, of 2^32.
    shares: [AtomicU32; SHED_IN_ORDER.len()],
    shown_s: Gauge<f64, AtomicU64>,
}

#[derive(Debug)]
struct Controller {
    shares: Shares,
    looked_us: u64,
    /// How many requests of each class had come then.
    counted: [u64; SHED_IN_ORDER.len()],
}

impl QueueWait {
    /// With the wait at which requests are shed where it stands; zero for never.
    pub fn new(target: Duration) -> Self {
        let controller = (!target.is_zero()).then(|| {
            Mutex::new(Controller {
                shares: Shares::new(target),
                looked_us: 0,
                counted: Default::default(),
            })
        });
        Self {
            began: Instant::now(),
            arrived: Default::default(),
            left: AtomicU64::new(0),
            probe_us: AtomicU64::new(0),
            left_before: AtomicU64::new(0),
            waited_us: AtomicU64::new(0),
            look_at_us: AtomicU64::new(0),
            controller,
            shares: Default::default(),
            shown_s: Gauge::default(),
        }
    }

    /// Nothing is shed for waiting.
    pub fn unbounded() -> Self {
        Self::new(Duration::ZERO)
    }

    /// Registers what the probe finds.
    pub fn register(&self, registry: &mut Registry) {
        registry.register(
            "queue_wait_seconds",
            "How long the last probe waited for a worker behind requests",
            self.shown_s.clone(),
        );
    }

    /// A request has come: whether it is one of those to shed now.
    pub(crate) fn sheds(&self, class: Class, now: Instant) -> bool {
        let Some(controller) = &self.controller else {
            return false;
        };
        let Some(place) = SHED_IN_ORDER.iter().position(|shed| *shed == class) else {
            return false;
        };
        let number = self.arrived[place].fetch_add(1, Relaxed);
        let now_us = self.us(now);
        if now_us >= self.look_at_us.load(Relaxed) {
            self.look(controller, now_us);
        }
        let share = self.shares[place].load(Relaxed);
        // The upper half is as good as drawn at random, so that no client is refused again and again because of its rhythm.
        let drawn = (number.wrapping_mul(GOLDEN) >> u32::BITS) as u32;
        drawn < share
    }

    /// A request has been answered, or refused.
    pub(crate) fn leaves(&self, class: Class) {
        if self.controller.is_some() && SHED_IN_ORDER.contains(&class) {
            self.left.fetch_add(1, Relaxed);
        }
    }

    /// How long requests wait, as far as it is known: what the last probe found, or what the one under way has waited already.
    pub(crate) fn wait(&self, now: Instant) -> Duration {
        Duration::from_micros(self.wait_us(self.us(now)))
    }

    fn wait_us(&self, now_us: u64) -> u64 {
        let found_us = self.waited_us.load(Relaxed);
        match self.probe_us.load(Relaxed) {
            0 => found_us,
            probe_us => {
                let waiting = Duration::from_micros(now_us.saturating_sub(probe_us));
                found_us.max(self.behind_requests(waiting).as_micros() as u64)
            }
        }
    }

    /// What of the wait of the last probe was for requests that may be shed.
    fn behind_requests(&self, waited: Duration) -> Duration {
        let left = self.left.load(Relaxed);
        let meanwhile = left.saturating_sub(self.left_before.load(Relaxed));
        let counted = u32::try_from(meanwhile).unwrap_or(CROWD).min(CROWD);
        waited * counted / CROWD
    }

    /// Works out the shares; a request that comes meanwhile goes by the old ones.
    fn look(&self, controller: &Mutex<Controller>, now_us: u64) {
        let Ok(mut controller) = controller.try_lock() else {
            return;
        };
        let since = Duration::from_micros(now_us.saturating_sub(controller.looked_us));
        if since < EVERY {
            return;
        }
        controller.looked_us = now_us;
        let wait = Duration::from_micros(self.wait_us(now_us));
        let arrived = self.arrived.each_ref().map(|count| count.load(Relaxed));
        let counted = std::mem::replace(&mut controller.counted, arrived);
        let came = std::array::from_fn(|place| arrived[place] - counted[place]);
        controller.shares.look(wait, since, came);
        let shares = controller.shares.of_classes();
        for (place, share) in self.shares.iter().zip(shares) {
            // From 0 to 1, so that it fits.
            place.store((share * f64::from(u32::MAX)) as u32, Relaxed);
        }
        self.look_at_us
            .store(now_us + EVERY.as_micros() as u64, Relaxed);
    }

    /// Sends the probe again and again; ends only with an error, or at once where nothing is shed for waiting.
    ///
    /// # Errors
    /// The system has no sockets for it.
    #[cfg(unix)]
    pub async fn probe(&self) -> io::Result<()> {
        if self.controller.is_none() {
            return Ok(());
        }
        let (near, far) = tokio::net::UnixDatagram::pair()?;
        let _known = Known(self);
        let mut pause = IDLE_EVERY;
        loop {
            // It waits from when it is due: a worker that comes round late to its timer is late for all.
            let due = Instant::now() + pause;
            let before = self.left.load(Relaxed);
            self.left_before.store(before, Relaxed);
            self.probe_us.store(self.us(due), Relaxed);
            sleep_until(due).await;
            near.send(&[0]).await?;
            far.recv(&mut [0]).await?;
            // The runtime takes a socket for readable until a read finds nothing: without this the next probe would not wait.
            while far.try_recv(&mut [0]).is_ok() {}
            let waited = self.behind_requests(due.elapsed());
            self.waited_us.store(waited.as_micros() as u64, Relaxed);
            self.shown_s.set(waited.as_secs_f64());
            let is_idle = self.left.load(Relaxed) == before;
            pause = if is_idle { IDLE_EVERY } else { EVERY };
        }
    }

    /// There is no such socket on this system: nothing is shed for waiting.
    ///
    /// # Errors
    /// None.
    #[cfg(not(unix))]
    pub async fn probe(&self) -> io::Result<()> {
        Ok(())
    }

    fn us(&self, now: Instant) -> u64 {
        now.saturating_duration_since(self.began).as_micros() as u64
    }
}

/// While this lives there is a probe; without one nothing is known, and nothing is shed.
#[cfg(unix)]
struct Known<'a>(&'a QueueWait);

#[cfg(unix)]
impl Drop for Known<'_> {
    fn drop(&mut self) {
        self.0.probe_us.store(0, Relaxed);
        self.0.waited_us.store(0, Relaxed);
        self.0.shown_s.set(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TARGET: Duration = Duration::from_millis(5);
    const LONG: Duration = Duration::from_secs(1);

    /// With a probe that was due a second ago and does not return.
    fn waiting() -> (QueueWait, Instant) {
        let queue = QueueWait::new(TARGET);
        queue.probe_us.store(1, Relaxed);
        let now = queue.began + LONG;
        (queue, now)
    }

    #[test]
    fn a_probe_that_waits_tells_how_long_requests_do() {
        let (queue, now) = waiting();
        assert_eq!(
            queue.wait(now),
            Duration::ZERO,
            "no request waits before it"
        );
        for _ in 0..CROWD / 2 {
            queue.leaves(Class::Read);
        }
        let half = queue.wait(now);
        assert!(LONG / 3 < half && half < LONG * 2 / 3, "{half:?}");
        for _ in 0..CROWD {
            queue.leaves(Class::Failure);
        }
        assert!(queue.wait(now) > LONG * 9 / 10);
        drop(Known(&queue));
        assert_eq!(
            queue.wait(now),
            Duration::ZERO,
            "there is no probe any more"
        );
    }

    #[test]
    fn a_flood_of_what_is_never_shed_sheds_nothing() {
        let (queue, now) = waiting();
        for turn in 0..1_000 {
            let now = now + EVERY * turn;
            for class in [Class::Health, Class::ZoneWrite, Class::Stream] {
                assert!(!queue.sheds(class, now));
                queue.leaves(class);
            }
        }
        assert_eq!(queue.wait(now + LONG), Duration::ZERO);
    }

    #[test]
    fn the_share_that_is_shed_is_spread_evenly() {
        let queue = QueueWait::new(TARGET);
        // Not due for a while, so that the shares stay.
        queue.look_at_us.store(u64::MAX, Relaxed);
        queue.shares[0].store(u32::MAX / 2, Relaxed);
        let shed: Vec<bool> = (0..10_000)
            .map(|_| queue.sheds(Class::Read, queue.began))
            .collect();
        for every in 1..8 {
            for first in 0..every {
                let mine: Vec<&bool> = shed.iter().skip(first).step_by(every).collect();
                let share = mine.iter().filter(|shed| ***shed).count() as f64 / mine.len() as f64;
                assert!((0.45..0.55).contains(&share), "{first} of {every}: {share}");
            }
        }
    }
}
