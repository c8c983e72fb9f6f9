//! The flight model of an edge: what a drone flies in, for any state of the edge, compiled once and shared.
//!
//! All seconds here count from one instant, the edge's start, so that tables of legs in a wind that changes outlive the states
//! of the airspace. What is kept of a plan counts from its departure instead: [`FlownVersion`].

mod answered;
mod answering;
mod assumed;
mod carrying;
mod causes;
mod checked;
mod composing;
mod expected;
mod flown_version;
mod keeping_apart;
mod kept;
mod known;
mod planner;
mod reported;
mod terms;
mod told;

pub(crate) use assumed::Assumed;
pub(crate) use flown_version::{DetourEnd, DetourStop, FlownVersion, LegEnds};
pub(super) use planner::Flown;
pub(crate) use reported::Flight;
pub(crate) use terms::{FlightOrder, FlightTerms};

use super::{Own, Scene};
use crate::background::give_way;
use crate::settings::{FlightSettings, Settings};
use jiff::Timestamp;
use skyway_engine::airspace::Airspace;
use skyway_engine::checker::ClosedTimes;
use skyway_engine::delivery::{
    DeliveryScratch, DeliveryWorld, FlightEnvironment, FlightTables, OtherPlans,
};
use skyway_engine::flight::{Airframe, Situation, WindField};
use skyway_engine::itinerary::{FlightSetting, Limits, Objective, OthersOccupancy};
use skyway_engine::network::{NodeIx, Topology};
use skyway_formats::wind_field;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use terms::DroneKind;

/// Bytes that the tables of destinations of all kinds of drones may take.
const TABLE_BYTES: usize = 512 << 20;
/// At most this many kinds of drones, with payload and wind, are kept compiled.
const KINDS_KEPT: usize = 16;
/// At most this many states of the airspace are kept compiled: the one in service, those that waves look at and commits check
/// against while zones come one after the other, and those imagined lately. They share what they have in common.
const SKIES_KEPT: usize = 16;
/// At most this many scratch memories are kept while nobody uses them.
const SCRATCHES_KEPT: usize = 16;

/// A kind of drone in a wind, on a network.
#[derive(Debug)]
struct Compiled {
    kind: DroneKind,
    topology: Arc<Topology>,
    weather: Option<Arc<str>>,
    /// With nothing in the way.
    setting: FlightSetting,
}

/// A state of the airspace without any plans.
#[derive(Debug)]
struct Sky {
    airspace: Arc<Airspace>,
    skies: FlightEnvironment,
    /// What is closed when, for the checker.
    closed_times: OnceLock<Arc<ClosedTimes>>,
    /// When something closes or opens that is closed or open now.
    until: Option<Timestamp>,
}

#[derive(Debug, Default)]
struct FlightCaches {
    /// Latest used last.
    compiled: VecDeque<Arc<Compiled>>,
    /// Latest made last.
    skies: VecDeque<Arc<Sky>>,
    /// The airspace whose times the checker asked for last, with them.
    closed_times: Option<(Arc<Airspace>, Arc<ClosedTimes>)>,
}

/// The flight model of an edge.
#[derive(Debug)]
pub(super) struct Flights {
    pub(super) settings: FlightSettings,
    /// Second 0.
    zero: Timestamp,
    /// Whether no other edge gives away the same pads.
    is_alone: bool,
    kept: Mutex<FlightCaches>,
    tables: Arc<FlightTables>,
    scratches: Mutex<Vec<DeliveryScratch>>,
}

/// What a drone flies in at a moment: everything that a delivery is computed in.
#[derive(Debug)]
pub(super) struct Ground {
    compiled: Arc<Compiled>,
    tables: Arc<FlightTables>,
    pub(super) skies: FlightEnvironment,
    pub(super) setting: FlightSetting,
    settings: FlightSettings,
    limits: Limits<'static>,
    is_alone: bool,
}

/// Who waits for a search, and so how long it may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Budget {
    /// A client, for one answer.
    Request(Objective),
    /// The drones of many plans, each for its own.
    Wave,
}

/// In the middle of a search a thread beside those that answer gives way to them; none ends sooner for that.
fn gives_way() -> bool {
    give_way();
    false
}

impl Flights {
    /// The flight model of an edge that begins at an instant; `None` where it is off.
    pub(super) fn of(settings: &Settings, zero: Timestamp) -> Option<Self> {
        let mut flight = settings.flight.clone()?;
        flight.rules.headway_s = settings.headway_s;
        flight.rules.node_headway_s = settings.node_headway_s;
        flight.rules.crossing_m = settings.crossing_m;
        Some(Self {
            settings: flight,
            zero,
            is_alone: !settings.follows_registry,
            kept: Mutex::default(),
            tables: Arc::new(FlightTables::new(TABLE_BYTES)),
            scratches: Mutex::default(),
        })
    }

    /// The airframe of a name, cruising at an airspeed of its own where one is given; `None` where the name is not known.
    pub(super) fn airframe(
        &self,
        name: Option<&str>,
        airspeed_mps: Option<f64>,
    ) -> Option<Arc<Airframe>> {
        let airframe = match name {
            Some(name) => self.settings.airframe(name)?,
            None => &self.settings.airframe,
        };
        Some(match airspeed_mps {
            Some(airspeed_mps) if airspeed_mps != airframe.airspeed_mps => Arc::new(Airframe {
                airspeed_mps,
                ..(**airframe).clone()
            }),
            _ => airframe.clone(),
        })
    }

    /// An instant in seconds.
    pub(super) fn seconds(&self, instant: Timestamp) -> f64 {
        instant.duration_since(self.zero).as_secs_f64()
    }

    /// What a drone flies in at a moment: an airspace, which may be an imagined one, the wind, and
    /// the plans of the scene but its own.
    fn ground(&self, scene: Scene<'_>, kind: &DroneKind, own: Own<'_>, budget: Budget) -> Ground {
        let sky = self.sky(scene);
        let compiled = self.compiled(scene, kind);
        let others = scene.traffic.others(own, self.zero);
        Ground {
            setting: compiled.setting.among(sky.skies.closed(), others.clone()),
            skies: sky.skies.among(others),
            compiled,
            tables: self.tables.clone(),
            settings: self.settings.clone(),
            limits: self.limits(budget),
            is_alone: self.is_alone,
        }
    }

    /// What bounds each search.
    fn limits(&self, budget: Budget) -> Limits<'static> {
        let checks_per_s = self.settings.checks_per_s;
        let limits = match budget {
            Budget::Request(objective) => Limits::of_request(objective, checks_per_s),
            Budget::Wave => Limits::of_replanning(checks_per_s),
        };
        Limits {
            is_over: Some(&gives_way),
            ..limits
        }
    }

    /// A kind of drone in an airspace where no other plan is flown.
    fn bare(&self, scene: Scene<'_>, kind: &DroneKind) -> (Arc<Sky>, FlightSetting) {
        let sky = self.sky(scene);
        let compiled = self.compiled(scene, kind);
        let alone = OthersOccupancy::default();
        let setting = compiled.setting.among(sky.skies.closed(), alone);
        (sky, setting)
    }

    /// The state of an airspace at a moment.
    fn sky(&self, scene: Scene<'_>) -> Arc<Sky> {
        let Scene { airspace, now, .. } = scene;
        let at = now.max(airspace.as_of());
        let is_it = |sky: &&Arc<Sky>| {
            let has_turned = sky.until.is_some_and(|until| until <= now);
            Arc::ptr_eq(&sky.airspace, airspace) && !has_turned
        };
        let last = {
            let kept = self.lock();
            if let Some(sky) = kept.skies.iter().rev().find(is_it) {
                return sky.clone();
            }
            // Threads do not see the time in one order.
            let is_earlier = |sky: &&Arc<Sky>| sky.skies.airspace().as_of() <= at;
            kept.skies.iter().rev().find(is_earlier).cloned()
        };
        // Outside the lock: two threads may do the same work, but none waits for another one's.
        let at_now = airspace.apply(&[], at);
        let followed = last.and_then(|last| last.skies.followed_by(&at_now));
        let skies = followed.unwrap_or_else(|| {
            let nodes = OtherPlans {
                swap_stations: self.swap_stations(airspace.topology()),
                ..OtherPlans::default()
            };
            FlightEnvironment::since(self.zero, &at_now, nodes, &self.settings.rules)
        });
        let sky = Arc::new(Sky {
            airspace: airspace.clone(),
            until: skies.now().next_change(),
            skies,
            closed_times: OnceLock::new(),
        });
        let mut kept = self.lock();
        kept.skies
            .retain(|other| !Arc::ptr_eq(&other.airspace, airspace));
        if kept.skies.len() >= SKIES_KEPT {
            kept.skies.pop_front();
        }
        kept.skies.push_back(sky.clone());
        sky
    }

    /// What is closed when in an airspace, for the checker.
    fn closed_times(&self, sky: &Sky) -> Arc<ClosedTimes> {
        if let Some(times) = sky.closed_times.get() {
            return times.clone();
        }
        let airspace = sky.skies.airspace();
        let last = self.lock().closed_times.clone();
        let last = last.filter(|(last, _)| Arc::ptr_eq(last.topology(), airspace.topology()));
        let times = Arc::new(match last {
            Some((last, times)) => times.after(&last, airspace),
            None => ClosedTimes::of(airspace, self.zero),
        });
        self.lock().closed_times = Some((airspace.clone(), times.clone()));
        sky.closed_times.get_or_init(|| times).clone()
    }

    /// The nodes of a network that swap batteries.
    fn swap_stations(&self, topology: &Topology) -> Vec<NodeIx> {
        let stations = self.settings.swap_stations.iter();
        stations.filter_map(|id| topology.node(id)).collect()
    }

    /// A kind of drone in the wind of a weather.
    fn compiled(&self, scene: Scene<'_>, kind: &DroneKind) -> Arc<Compiled> {
        let (topology, weather) = (scene.topology(), scene.weather);
        let is_it = |compiled: &Arc<Compiled>| {
            Arc::ptr_eq(&compiled.topology, topology)
                && compiled.kind == *kind
                && compiled.weather.as_ref() == weather
        };
        let other = {
            let mut kept = self.lock();
            if let Some(place) = kept.compiled.iter().position(is_it)
                && let Some(found) = kept.compiled.remove(place)
            {
                kept.compiled.push_back(found.clone());
                return found;
            }
            let mut others = kept.compiled.iter();
            others
                .rfind(|other| Arc::ptr_eq(&other.topology, topology))
                .cloned()
        };
        // Outside the lock: two threads may do the same work, but none waits for another one's.
        let (airframe, wind) = ((*kind.airframe).clone(), self.wind(weather, topology));
        let compiled = Arc::new(Compiled {
            setting: match other {
                Some(other) => other.setting.with_drone(airframe, kind.payload_kg, wind),
                None => FlightSetting::new(
                    topology.clone(),
                    airframe,
                    kind.payload_kg,
                    wind,
                    self.settings.rules,
                    &Situation {
                        swap_stations: self.swap_stations(topology),
                        ..Situation::default()
                    },
                ),
            },
            kind: kind.clone(),
            topology: topology.clone(),
            weather: weather.cloned(),
        });
        let mut kept = self.lock();
        if kept.compiled.len() >= KINDS_KEPT {
            kept.compiled.pop_front();
        }
        kept.compiled.push_back(compiled.clone());
        compiled
    }

    fn wind(&self, weather: Option<&Arc<str>>, topology: &Topology) -> WindField {
        let weather = weather.map(|text| &**text);
        let base = self.settings.base_wind;
        wind_field(weather, base, topology.frame(), self.zero)
    }

    /// Works with a scratch memory.
    pub(super) fn with_scratch<T>(
        &self,
        topology: &Topology,
        work: impl FnOnce(&mut DeliveryScratch) -> T,
    ) -> T {
        let scratches = || {
            self.scratches
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
        };
        let idle = scratches().pop();
        let mut scratch = idle.unwrap_or_else(|| DeliveryScratch::new(topology));
        let done = work(&mut scratch);
        let mut scratches = scratches();
        if scratches.len() < SCRATCHES_KEPT {
            scratches.push(scratch);
        }
        done
    }

    // All of it is whole after every call, so a panic elsewhere cannot spoil them.
    fn lock(&self) -> MutexGuard<'_, FlightCaches> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Ground {
    /// The same without tables, so that nothing which was worked out before counts.
    pub(super) fn without_tables(self) -> Self {
        Self {
            tables: Arc::new(FlightTables::new(TABLE_BYTES)),
            ..self
        }
    }

    /// What deliveries are computed in.
    pub(super) fn world(&self) -> DeliveryWorld<'_> {
        DeliveryWorld {
            skies: &self.skies,
            setting: &self.setting,
            tables: &self.tables,
            tariff: self.settings.tariff,
            refuge_stay_s: self.settings.refuge_stay_s,
            limits: self.limits,
            with_contingencies: false,
        }
    }

    /// What flies.
    pub(super) fn kind(&self) -> &DroneKind {
        &self.compiled.kind
    }
}
