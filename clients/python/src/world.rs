//! A network in one state of its airspace, with what searches on it keep between calls.

use crate::ground::Ground;
use crate::question::each;
use crate::refusal::{Kind, Refusal, without_lock};
use jiff::{SignedDuration, Timestamp};
use pyo3::prelude::*;
use rustc_hash::FxHashSet;
use skyway_engine::airspace::{Airspace, Change, Closure, DEFAULT_MARGIN_M, Zone};
use skyway_engine::compose::prepare_table;
use skyway_engine::network::{Generated, Joining, NodeIx};
use skyway_engine::recompose::{self, Scratch};
use skyway_engine::routing::TreeCache;
use skyway_formats::{
    CloseTarget, FeedTerms, ForeignFormat, LoadedNetwork, Unread, fingerprint, load_csv_network,
    load_network, read_feed, read_zones,
};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Bytes that the tables of destinations may take.
const TABLE_BYTES: usize = 256 << 20;
/// One topology is one world, so any number does.
const TOPOLOGY_REVISION: u64 = 1;
/// How long ahead a zone with windows counts, in seconds, where nothing else is said.
const HORIZON_S: f64 = 3_600.0;

/// A network in one state of its airspace. It never changes; closing something makes another one.
#[pyclass(frozen, module = "skyway._skyway")]
pub(crate) struct World {
    pub(crate) ground: Arc<Ground>,
    pub(crate) airspace: Arc<Airspace>,
    pub(crate) tables: TreeCache,
    scratches: Mutex<Vec<Scratch>>,
    asked: Mutex<FxHashSet<NodeIx>>,
}

/// A lock whose holder panicked guards plain data, which is as good as before.
fn hold<T>(lock: &Mutex<T>) -> MutexGuard<'_, T> {
    lock.lock().unwrap_or_else(PoisonError::into_inner)
}

impl World {
    fn over(ground: Arc<Ground>, airspace: Airspace) -> Self {
        Self {
            ground,
            airspace: Arc::new(airspace),
            tables: TreeCache::new(TABLE_BYTES),
            scratches: Mutex::default(),
            asked: Mutex::default(),
        }
    }

    fn of(py: Python<'_>, loaded: LoadedNetwork) -> PyResult<Self> {
        let ground = Arc::new(Ground::new(py, loaded)?);
        let horizon = SignedDuration::from_secs(HORIZON_S as i64);
        // Without zones there is nothing for which it matters when this is.
        let airspace = Airspace::open(
            ground.topology.clone(),
            TOPOLOGY_REVISION,
            Timestamp::UNIX_EPOCH,
            horizon,
        );
        Ok(Self::over(ground, airspace))
    }

    /// Lends a scratch to one call; one whose call panicked is not lent again.
    pub(crate) fn with_scratch<T>(&self, work: impl FnOnce(&mut Scratch) -> T) -> T {
        let lent = hold(&self.scratches).pop();
        let mut scratch = lent.unwrap_or_else(|| Scratch::new(&self.ground.topology));
        let result = work(&mut scratch);
        hold(&self.scratches).push(scratch);
        result
    }

    /// What the engine is asked on.
    pub(crate) fn engine<'a>(&'a self, airspace: &'a Airspace) -> recompose::World<'a> {
        recompose::World {
            airspace,
            trees: Some(&self.tables),
        }
    }

    /// True where the table of a destination is there: then a search takes microseconds.
    pub(crate) fn has_table(&self, destination: NodeIx) -> bool {
        self.tables.holds(destination, TOPOLOGY_REVISION)
    }

    /// Makes the table of a destination that is asked for a second time: once, A\* is faster.
    pub(crate) fn prepare_if_asked_again(&self, destination: NodeIx, scratch: &mut Scratch) {
        if self.has_table(destination) || hold(&self.asked).insert(destination) {
            return;
        }
        prepare_table(
            &self.engine(&self.airspace),
            destination,
            scratch.searcher(),
        );
    }

    /// The airspace with more closed; the same one where that is nothing.
    pub(crate) fn closing(&self, targets: &[CloseTarget]) -> Arc<Airspace> {
        if targets.is_empty() {
            return self.airspace.clone();
        }
        Arc::new(closing(&self.airspace, targets))
    }

    /// What is named to be closed.
    pub(crate) fn targets(&self, close: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<CloseTarget>> {
        let Some(close) = close.filter(|close| !close.is_none()) else {
            return Ok(Vec::new());
        };
        let mut targets = Vec::new();
        for (number, target) in each(close, "close")?.enumerate() {
            targets.push(
                self.ground
                    .close_target(&target?, &format!("close[{number}]"))?,
            );
        }
        Ok(targets)
    }
}

fn closing(airspace: &Airspace, targets: &[CloseTarget]) -> Airspace {
    let (mut nodes, mut segments) = (Vec::new(), Vec::new());
    for target in targets {
        match target {
            CloseTarget::Node(node) => nodes.push(*node),
            CloseTarget::Segment(segment) => segments.push(*segment),
        }
    }
    let mut id = "close".to_owned();
    while airspace.closure(&id).is_some() {
        id.push('\'');
    }
    let closure = Closure::of_operator(id, "closed by the caller".to_owned(), nodes, segments);
    airspace.apply(&[Change::Put(Arc::new(closure))], airspace.as_of())
}

/// The zones of a text: GeoJSON, or a feed of the field, of which none may be refused.
fn zones_of(text: &str, world: &World) -> Result<Vec<Zone>, Refusal> {
    let frame = world.ground.topology.frame();
    if !ForeignFormat::of_text(text).is_some_and(ForeignFormat::has_zones) {
        return read_zones(text, frame).map_err(|problems| Refusal::of_zones(&problems));
    }
    let terms = FeedTerms {
        feed: "zones",
        prefix: "",
        margin_m: DEFAULT_MARGIN_M,
    };
    let feed = read_feed(text, &terms, frame).map_err(|problem| Refusal::of_zone(&problem))?;
    let mut zones = Vec::new();
    for zone in feed.zones {
        zones.extend(
            zone.outcome
                .map_err(|problems| Refusal::of_zones(&problems))?,
        );
    }
    Ok(zones)
}

#[pymethods]
impl World {
    /// The same network with zones and closures; `at` is RFC 3339.
    #[pyo3(signature = (zones, close, at, horizon_s))]
    fn with_closures(
        &self,
        zones: Vec<String>,
        close: Option<&Bound<'_, PyAny>>,
        at: &str,
        horizon_s: Option<f64>,
    ) -> PyResult<Self> {
        let as_of = at.parse::<Timestamp>().map_err(|error| {
            let refusal = Refusal::new(Kind::Airspace, "not_a_time", "at", error.to_string());
            refusal.hint("give RFC 3339, such as 2026-11-27T18:00:00Z")
        })?;
        let horizon = SignedDuration::try_from_secs_f64(horizon_s.unwrap_or(HORIZON_S));
        let horizon = horizon
            .ok()
            .filter(|horizon| !horizon.is_negative())
            .ok_or_else(|| {
                let refusal = Refusal::new(
                    Kind::Airspace,
                    "not_a_duration",
                    "horizon_s",
                    "the horizon is no duration",
                );
                refusal.hint("give seconds, 0 or more")
            })?;
        let topology = &self.ground.topology;
        let open = Airspace::open(topology.clone(), TOPOLOGY_REVISION, as_of, horizon);
        let mut changes: Vec<Change> = self
            .airspace
            .closures()
            .map(|(closure, _)| Change::Put(closure.clone()))
            .collect();
        for text in &zones {
            for zone in zones_of(text, self)? {
                changes.push(Change::Put(Arc::new(Closure::of_zone(
                    topology,
                    Arc::new(zone),
                ))));
            }
        }
        let standing = open.apply(&changes, as_of);
        let targets = self.targets(close)?;
        let airspace = match targets.is_empty() {
            true => standing,
            false => closing(&standing, &targets),
        };
        Ok(Self::over(self.ground.clone(), airspace))
    }
}

/// Loads a network from its text; `edges` is the second table of a network in CSV.
#[pyfunction]
#[pyo3(signature = (text, edges=None))]
pub(crate) fn load(py: Python<'_>, text: &str, edges: Option<&str>) -> PyResult<World> {
    let loaded = without_lock(py, || match edges {
        Some(edges) => load_csv_network(text, edges),
        None => load_network(text),
    })?;
    World::of(py, loaded.map_err(|error| Refusal::of_load(&error))?)
}

/// Generates a network after the paper's Table 1.
#[pyfunction]
pub(crate) fn generate(
    py: Python<'_>,
    nodes: usize,
    max_neighbours: usize,
    map_size_m: f64,
    reach_fraction: f64,
    joining: &str,
    seed: u64,
) -> PyResult<World> {
    let joining = match joining {
        "nearest" => Joining::Nearest,
        "random" => Joining::Random,
        "delaunay" => Joining::Delaunay,
        other => {
            let refusal = Refusal::new(
                Kind::Network,
                "unknown_joining",
                "joining",
                format!("no joining is called '{other}'"),
            );
            return Err(refusal.hint("give nearest, random or delaunay").into());
        }
    };
    let generated = Generated {
        nodes,
        max_neighbours,
        map_size_m,
        reach_fraction,
        joining,
        seed,
    };
    let invalid =
        |message: String| Refusal::new(Kind::Network, "network_invalid", "generated", message);
    let loaded = without_lock(py, || {
        let draft = generated
            .network()
            .map_err(|error| invalid(error.to_string()))?;
        // Nothing but the numbers above decides what it is.
        let written = format!("{generated:?}");
        let topology = skyway_engine::network::Topology::build(draft, fingerprint(&[&written]));
        let topology = topology.map_err(|errors| {
            let first = errors.first().map(ToString::to_string);
            invalid(first.unwrap_or_default())
        })?;
        Ok::<_, Refusal>(LoadedNetwork {
            topology,
            repairs: Vec::new(),
            unread: Unread::default(),
        })
    });
    World::of(py, loaded??)
}

/// The text of a bundled network.
#[pyfunction]
pub(crate) fn bundled(name: &str) -> PyResult<&'static str> {
    use skyway_engine::network::bundled;
    match name {
        "sydney" => Ok(bundled::SYDNEY_CBD),
        "corridor" => Ok(bundled::CORRIDOR),
        other => {
            let message = format!("no bundled network is called '{other}'");
            let refusal = Refusal::new(Kind::Network, "unknown_network", "name", message);
            Err(refusal
                .hint("the bundled ones are sydney and corridor")
                .into())
        }
    }
}
