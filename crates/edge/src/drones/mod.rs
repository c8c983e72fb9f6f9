//! Drones: what is last known of each, and in this folder how telemetry is read, judged and held against plans.
//!
//! Positions change all the time and close nothing, so they lie beside the snapshots.

mod agreement;
pub(crate) mod answered_lately;
mod conformance;
mod deviation;
mod off_plan;
pub(crate) mod places;
pub(crate) mod positions;
pub(crate) mod progress;
pub(crate) mod telemetry;

use agreement::{Agreement, Conformance, Deviation};
use jiff::{SignedDuration, Timestamp};
use skyway_engine::geo::{AltitudeReference, Frame, Point};
use std::collections::BTreeMap;
use std::ops::Bound;
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// The longest id of a drone, in bytes.
pub(crate) const DRONE_ID_BYTES_MAX: usize = 128;

/// A drone that is slower, in metres per second, rests.
const RESTS_BELOW_MPS: f64 = 1.0;

/// For so long a battery is about what was said of it: a flight draws a part in a thousand in a second.
const BATTERY_HOLDS_FOR: SignedDuration = SignedDuration::from_secs(10);

/// For so long a drone is in the air, or on the ground, as it said last.
const AIRBORNE_HOLDS_FOR: SignedDuration = SignedDuration::from_secs(15);

/// What is last known of a drone.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sighting {
    /// As the drone wrote it: degrees, or metres on a planar network.
    pub(crate) coordinates: [f64; 2],
    pub(crate) seen_at: Timestamp,
    pub(crate) altitude_m: Option<f64>,
    /// What it last said of its battery, perhaps before it was here.
    pub(crate) battery: Option<BatterySeen>,
    pub(crate) ground_speed_mps: Option<f64>,
    pub(crate) heading_deg: Option<f64>,
    /// What the altitude is measured from.
    pub(crate) altitude_reference: Option<AltitudeReference>,
    /// Whether it says that it is in the air.
    pub(crate) airborne: Option<bool>,
    /// How far it has come on a version of its plan.
    pub(crate) flown: Option<Flown>,
    /// Since when it rests at the end of its plan, if it does.
    pub(crate) rests: Option<Rest>,
    /// At which stop of its delivery it is, if at any.
    pub(crate) at_stop: Option<AtStop>,
    /// How its positions agree with its plan, in flight.
    pub(crate) agreement: Option<Agreement>,
}

/// What a drone said of its battery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BatterySeen {
    pub(crate) fraction: f64,
    pub(crate) at: Timestamp,
}

/// How far a drone has come on a version of its plan.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Flown {
    pub(crate) plan: Arc<str>,
    pub(crate) version: u32,
    pub(crate) at_m: f64,
    /// When it was seen to have come so far.
    pub(crate) at: Timestamp,
}

/// A drone rests at the end of a version of its plan.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Rest {
    pub(crate) plan: Arc<str>,
    pub(crate) version: u32,
    pub(crate) since: Timestamp,
}

/// A drone is at the stop where its delivery is served next.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AtStop {
    pub(crate) plan: Arc<str>,
    /// How many stops were served before.
    pub(crate) stop: u32,
    pub(crate) since: Timestamp,
    /// Whether it was slow there, and did not only fly over.
    pub(crate) rested: bool,
}

impl Sighting {
    /// A drone of which nothing but its place is known.
    pub(crate) fn at(coordinates: [f64; 2], seen_at: Timestamp) -> Self {
        Self {
            coordinates,
            seen_at,
            altitude_m: None,
            battery: None,
            ground_speed_mps: None,
            heading_deg: None,
            altitude_reference: None,
            airborne: None,
            flown: None,
            rests: None,
            at_stop: None,
            agreement: None,
        }
    }

    /// Its battery where it was seen; `None` where it said that long before, somewhere else.
    pub(crate) fn battery_here(&self) -> Option<f64> {
        let is_here =
            |battery: &BatterySeen| self.seen_at.duration_since(battery.at) <= BATTERY_HOLDS_FOR;
        let here = self.battery.filter(is_here);
        here.map(|battery| battery.fraction)
    }

    /// Whether it is in the air, as it said just now.
    pub(crate) fn airborne_now(&self, now: Timestamp) -> Option<bool> {
        let age = now.duration_since(self.seen_at);
        self.airborne.filter(|_| age <= AIRBORNE_HOLDS_FOR)
    }

    /// How far it has come on a version of a plan, in metres from where that begins, as far as its places have shown.
    pub(crate) fn flown_m(&self, plan: &str, version: u32) -> f64 {
        let flown = self.flown.as_ref();
        let flown = flown.filter(|flown| &*flown.plan == plan && flown.version == version);
        flown.map_or(0.0, |flown| flown.at_m)
    }

    /// Whether it was made in flight on a plan.
    pub(crate) fn is_on(&self, plan: &str) -> bool {
        let agreement = self.agreement.as_ref();
        agreement.is_some_and(|agreement| agreement.is_of(plan))
    }

    /// Whether it shows, with those before it, that the drone is elsewhere than its plan has it, and not only at another
    /// time.
    pub(crate) fn is_elsewhere(&self) -> bool {
        self.agreement.as_ref().is_some_and(|agreement| {
            let deviates = agreement.conformance(self.seen_at) == Conformance::Deviates;
            deviates
                && agreement
                    .newest
                    .is_some_and(|newest| newest != Deviation::Time)
        })
    }

    /// Whether the drone hardly moved: by what it says, else by how far it has come since it was seen last.
    pub(crate) fn is_slow(&self, frame: &Frame, before: Option<&Self>) -> bool {
        if let Some(speed_mps) = self.ground_speed_mps {
            return speed_mps < RESTS_BELOW_MPS;
        }
        let Some(before) = before else {
            return false;
        };
        let elapsed_s = self.seen_at.duration_since(before.seen_at).as_secs_f64();
        let [here, there] = [self, before].map(|seen| seen.position(frame));
        elapsed_s > 0.0 && here.distance_m(there) < RESTS_BELOW_MPS * elapsed_s
    }

    /// Where the drone was, on a network's plane; it may be laid on another one than when the drone was seen.
    pub(crate) fn position(&self, frame: &Frame) -> Point {
        frame.to_plane(self.coordinates)
    }
}

/// Places of a drone at which it cannot be, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Doubt {
    /// How many of them agree with each other, the last one included.
    pub(crate) in_a_row: u32,
    pub(crate) last: Sighting,
}

impl Doubt {
    pub(crate) fn first(last: Sighting) -> Self {
        Self { in_a_row: 1, last }
    }
}

/// A sighting with its place in the order in which they came.
#[derive(Debug)]
struct Held {
    serial: u64,
    sighting: Sighting,
}

#[derive(Debug, Default)]
struct Known {
    by_id: BTreeMap<Arc<str>, Held>,
    /// The doubtful places of drones since their last accepted ones.
    doubts: BTreeMap<Arc<str>, Doubt>,
    /// By serial, that of which nothing has come for longest first, for forgetting.
    order: BTreeMap<u64, Arc<str>>,
    next: u64,
}

impl Known {
    fn put(&mut self, id: Arc<str>, sighting: Sighting) {
        self.next += 1;
        let serial = self.next;
        self.order.insert(serial, id.clone());
        if let Some(before) = self.by_id.insert(id, Held { serial, sighting }) {
            self.order.remove(&before.serial);
        }
    }

    fn remove(&mut self, id: &str) {
        if let Some(held) = self.by_id.remove(id) {
            self.order.remove(&held.serial);
        }
    }

    /// Forgets the drone of which nothing has come for longest among those that fly no plan: however many others are told of,
    /// one that flies a plan is not taken to be silent for it. Those that do are looked at again after all others.
    fn forget_one(&mut self, flies: impl Fn(&str) -> bool) {
        for _ in 0..self.by_id.len() {
            let Some((_, oldest)) = self.order.pop_first() else {
                return;
            };
            let Some(held) = self.by_id.get_mut(&oldest).filter(|_| flies(&oldest)) else {
                self.by_id.remove(&oldest);
                return;
            };
            self.next += 1;
            held.serial = self.next;
            self.order.insert(self.next, oldest);
        }
        if let Some((_, oldest)) = self.order.pop_first() {
            self.by_id.remove(&oldest);
        }
    }
}

/// The drones seen, up to a bound.
#[derive(Debug)]
pub(crate) struct Drones {
    capacity: usize,
    known: RwLock<Known>,
}

impl Drones {
    pub(crate) fn new(capacity: usize) -> Self {
        Self {
            capacity,
            known: RwLock::default(),
        }
    }

    /// Takes a sighting, unless a later one is known; tells whether it was taken. Beyond the bound one of those is forgotten
    /// that do not fly a plan.
    pub(crate) fn see(&self, id: &str, sighting: Sighting, flies: impl Fn(&str) -> bool) -> bool {
        let mut known = self.write();
        let before = known.by_id.get_key_value(id);
        if before.is_some_and(|(_, before)| before.sighting.seen_at > sighting.seen_at) {
            return false;
        }
        let id = before.map_or_else(|| Arc::from(id), |(id, _)| id.clone());
        known.doubts.remove(&id);
        known.put(id, sighting);
        if known.by_id.len() > self.capacity {
            known.forget_one(flies);
        }
        true
    }

    /// The version of a plan that a drone flies begins so many metres later than it did.
    pub(crate) fn begin_later(&self, id: &str, (plan, version): (&str, u32), by_m: f64) {
        let mut known = self.write();
        let held = known.by_id.get_mut(id);
        let flown = held.and_then(|held| held.sighting.flown.as_mut());
        if let Some(flown) = flown.filter(|it| &*it.plan == plan && it.version == version) {
            flown.at_m = (flown.at_m - by_m).max(0.0);
        }
    }

    /// Forgets what was seen after an instant: by a clock that has been set back since.
    pub(crate) fn forget_after(&self, now: Timestamp) {
        let mut known = self.write();
        known.doubts.retain(|_, doubt| doubt.last.seen_at <= now);
        let is_ahead = |held: &Held| held.sighting.seen_at > now;
        let ahead = known.by_id.iter().filter(|(_, held)| is_ahead(held));
        for id in ahead.map(|(id, _)| id.clone()).collect::<Vec<_>>() {
            known.remove(&id);
        }
    }

    /// Notes a doubtful place after those noted before; tells how many agree with each other now.
    pub(crate) fn doubt(&self, id: &str, next: impl FnOnce(Option<&Doubt>) -> Doubt) -> u32 {
        let mut known = self.write();
        let doubt = next(known.doubts.get(id));
        let in_a_row = doubt.in_a_row;
        if known.doubts.len() >= self.capacity && !known.doubts.contains_key(id) {
            // Invented drones fill it: true ones count from one again.
            known.doubts.clear();
        }
        known.doubts.insert(Arc::from(id), doubt);
        in_a_row
    }

    /// What is last known of a drone.
    pub(crate) fn last(&self, id: &str) -> Option<Sighting> {
        let known = self.read();
        known.by_id.get(id).map(|held| held.sighting.clone())
    }

    /// A page of drones by id, after one, of those that pass a test; and whether more come after it.
    pub(crate) fn page(
        &self,
        after: Option<&str>,
        size: usize,
        passes: impl Fn(&str) -> bool,
    ) -> (Vec<(Arc<str>, Sighting)>, bool) {
        let known = self.read();
        let from = after.map_or(Bound::Unbounded, Bound::Excluded);
        let drones = known.by_id.range::<str, _>((from, Bound::Unbounded));
        let mut drones = drones.filter(|(id, _)| passes(id));
        let page = drones.by_ref().take(size);
        let page = page
            .map(|(id, held)| (id.clone(), held.sighting.clone()))
            .collect();
        (page, drones.next().is_some())
    }

    /// How many are known.
    pub(crate) fn count(&self) -> usize {
        self.read().by_id.len()
    }

    // The maps are whole after every call, so a panic elsewhere cannot spoil them.
    fn read(&self) -> RwLockReadGuard<'_, Known> {
        self.known.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self) -> RwLockWriteGuard<'_, Known> {
        self.known.write().unwrap_or_else(PoisonError::into_inner)
    }
}
