//! The starts by distance against a naive oracle: which ways back into the network are offered, over which lengths, with
//! which flags and overrun.
//!
//! Seeds give planar networks with zones, closures, causes and drones anywhere. What lies too near to a boundary for the
//! oracle's steps is left out, and counted.

mod ground;
mod rules;
mod world;

use crate::strategies::cases;
use ground::Doubt;
use rules::{Expected, PlainWay, expected};
use skyway::airspace::{Airspace, Change, Closure, Hits, Zone, ZoneDraft, ZoneGeometry};
use skyway::flight::{Circumstances, FailureReport, FailureType, Location, Reentry, StretchKind};
use skyway::geo::{AltitudeBand, Point};
use skyway::network::{NetworkDraft, NodeDraft, SegmentDraft, Topology};
use skyway::recompose::{BroughtZone, ReentryPoints, Request, Scratch, World, reentry_points};
use std::collections::BTreeMap;
use std::sync::Arc;
use world::{Ground, Place, PlainWorld, PlainZone, Spot};

/// Worlds per run; `SKYWAY_CASES` multiplies it.
const WORLDS: u64 = 600;

/// Lengths this much apart, in metres, are the same.
const SAME_M: f64 = 1e-3;
/// The least bad place lies about so far outside a zone.
const OUTSIDE_M: f64 = 1.5;

fn point(spot: Spot) -> Point {
    Point::new(spot.0, spot.1)
}

fn topology(world: &PlainWorld) -> Topology {
    let nodes = world.nodes.iter().enumerate();
    let segments = world.segments.iter();
    let draft = NetworkDraft {
        nodes: nodes
            .map(|(number, &(x, y))| NodeDraft {
                id: number.to_string(),
                position: [x, y],
                ..NodeDraft::default()
            })
            .collect(),
        segments: segments
            .map(|&(from, to, length_m)| SegmentDraft {
                from: from.to_string(),
                to: to.to_string(),
                length_m: Some(length_m),
                ..SegmentDraft::default()
            })
            .collect(),
        ..NetworkDraft::default()
    };
    Topology::build(draft, [0; 32]).expect("a network")
}

fn zone(topology: &Topology, number: usize, plain: &PlainZone) -> Arc<Zone> {
    let geometry = match plain.ground {
        Ground::Circle { centre, radius_m } => ZoneGeometry::Circle {
            centre: [centre.0, centre.1],
            radius_m,
        },
        Ground::Box { low, high } => ZoneGeometry::Polygon(vec![vec![
            [low.0, low.1],
            [high.0, low.1],
            [high.0, high.1],
            [low.0, high.1],
            [low.0, low.1],
        ]]),
    };
    let draft = ZoneDraft {
        id: format!("zone {number}"),
        name: None,
        reason: None,
        authority: None,
        geometry,
        band: AltitudeBand::UNLIMITED,
        windows: Vec::new(),
        margin_m: plain.margin_m,
        terms: Default::default(),
    };
    Arc::new(Zone::new(draft, topology.frame()).expect("a zone"))
}

/// What the engine offers.
fn offered(plain: &PlainWorld, topology: &Arc<Topology>) -> ReentryPoints {
    let node = |number: usize| topology.node(&number.to_string()).expect("a node");
    let now = jiff::Timestamp::UNIX_EPOCH;
    let horizon = jiff::SignedDuration::from_mins(60);
    let open = Airspace::open(topology.clone(), 1, now, horizon);
    let mut changes = Vec::new();
    let mut brought = None;
    for (number, plain_zone) in plain.zones.iter().enumerate() {
        let zone = zone(topology, number, plain_zone);
        match plain.brought == Some(number) {
            true => {
                brought = Some(BroughtZone {
                    hits: Hits::of(topology, &zone),
                    zone,
                });
            }
            false => changes.push(Change::Put(Arc::new(Closure::of_zone(topology, zone)))),
        }
    }
    let between = |&segment: &usize| {
        let (from, to, _) = plain.segments[segment];
        topology
            .segment_between(node(from), node(to))
            .expect("a segment")
    };
    changes.push(Change::Put(Arc::new(Closure::of_operator(
        "by hand".to_owned(),
        "drawn".to_owned(),
        plain
            .closed_nodes
            .iter()
            .map(|&closed| node(closed))
            .collect(),
        plain.closed_segments.iter().map(between).collect(),
    ))));
    let airspace = open.apply(&changes, now);
    let failure = match (plain.closes_leg, &brought) {
        (true, Some(_)) => FailureType::Regulatory,
        (true, None) => FailureType::Navigational,
        (false, _) => FailureType::ServiceLevel,
    };
    let report = FailureReport {
        failure,
        leg: (node(plain.leg.0), node(plain.leg.1)),
        location: match plain.place {
            Place::AtStart => Location::LegStart,
            Place::At(spot) => Location::At(point(spot)),
            Place::Unknown => Location::Unknown,
        },
        cause_location: plain.cause.map(point),
        destination: node(0),
        remaining_path: None,
    };
    let request = Request {
        zone: brought,
        circumstances: Circumstances {
            speed_mps: plain.speed_mps,
            place_age_s: plain.age_s,
            ..Circumstances::default()
        },
        ..Request::exact(report)
    };
    let world = World {
        airspace: &airspace,
        trees: None,
    };
    reentry_points(&world, &request, &mut Scratch::new(topology))
}

fn as_plain(way: &Reentry, topology: &Topology) -> PlainWay {
    let stretch = &way.stretch;
    PlainWay {
        node: topology.node_id(way.node).parse().expect("a number"),
        length_m: stretch.length_m,
        overrun_m: stretch.overrun_m,
        is_straight: stretch.kind == StretchKind::Straight,
        fraction: stretch.leg.map(|leg| leg.fraction),
    }
}

fn is_same_way(one: &PlainWay, other: &PlainWay) -> bool {
    let is_same = |one: f64, other: f64| (one - other).abs() <= SAME_M;
    let is_same_fraction = match (one.fraction, other.fraction) {
        (Some(one), Some(other)) => (one - other).abs() <= 1e-6,
        (one, other) => one.is_none() && other.is_none(),
    };
    // A drone that is at the node already flies no straight line.
    let is_same_kind = one.is_straight == other.is_straight || one.length_m <= SAME_M;
    one.node == other.node
        && is_same(one.length_m, other.length_m)
        && is_same(one.overrun_m, other.overrun_m)
        && is_same_kind
        && is_same_fraction
}

/// What differs between the two; empty where nothing does.
fn difference(wanted: &Expected, found: &ReentryPoints, topology: &Topology) -> Vec<&'static str> {
    let ways: Vec<PlainWay> = found
        .ways
        .iter()
        .map(|way| as_plain(way, topology))
        .collect();
    let spare = found.spare.map(|way| as_plain(&way, topology));
    let same_spare = match (&wanted.spare, &spare) {
        (Some(one), Some(other)) => is_same_way(one, other),
        (one, other) => one.is_none() && other.is_none(),
    };
    let pairs = wanted.ways.iter().zip(&ways);
    let same_ways = wanted.ways.len() == ways.len()
        && pairs
            .into_iter()
            .all(|(one, other)| is_same_way(one, other));
    if wanted.either_way {
        let is_either = |way: &PlainWay| wanted.ways.iter().any(|one| is_same_way(one, way));
        let are_either = ways.iter().chain(&spare).all(is_either);
        let differs = !are_either || !found.cannot_stop;
        return differs.then_some("either way").into_iter().collect();
    }
    let least_bad_m = found.least_bad.as_ref().map(|way| way.length_m);
    let same_least_bad = match (wanted.least_bad_m, least_bad_m) {
        (Some(one), Some(other)) => (one - other).abs() <= OUTSIDE_M,
        (one, other) => one.is_none() && other.is_none(),
    };
    let looked_at = [
        ("ways", same_ways),
        ("spare", same_spare),
        ("off_leg", wanted.off_leg == found.off_leg),
        ("leaves_zone", wanted.leaves_zone == found.leaves_zone),
        ("cannot_stop", wanted.cannot_stop == found.cannot_stop),
        ("least_bad", same_least_bad),
    ];
    let different = looked_at.iter().filter(|(_, is_same)| !is_same);
    different.map(|(name, _)| *name).collect()
}

/// What a case was an instance of.
fn kind(wanted: &Expected) -> &'static str {
    match wanted {
        _ if wanted.either_way => "cannot stop, and on is out",
        _ if wanted.cannot_stop => "cannot stop",
        _ if wanted.ways.is_empty() => "no way",
        _ if wanted.ways[0].is_straight && wanted.leaves_zone => "straight out of a zone",
        _ if wanted.ways[0].is_straight => "off its leg",
        _ if wanted.spare.is_some() => "out of a zone, both ways",
        _ if wanted.leaves_zone => "out of a zone",
        _ if wanted.ways.len() == 2 => "back or on",
        _ if wanted.ways[0].overrun_m == 0.0 && wanted.ways[0].length_m == 0.0 => "at a node",
        _ => "one way",
    }
}

/// One world, read and asked: what it was an instance of, and what differs.
fn look(seed: u64) -> Result<(&'static str, Vec<&'static str>, String), Doubt> {
    let plain = PlainWorld::draw(seed);
    let wanted = expected(&plain)?;
    let topology = Arc::new(topology(&plain));
    let found = offered(&plain, &topology);
    let different = difference(&wanted, &found, &topology);
    let told = format!("wanted {wanted:#?}\nfound {found:#?}\nin {plain:#?}");
    Ok((kind(&wanted), different, told))
}

#[test]
fn starts_are_those_of_the_rules() {
    let mut kinds: BTreeMap<&str, u64> = BTreeMap::new();
    let mut doubts: BTreeMap<&str, u64> = BTreeMap::new();
    let worlds = WORLDS * cases();
    for seed in 0..worlds {
        match look(seed) {
            Err(doubt) => *doubts.entry(doubt).or_default() += 1,
            Ok((kind, different, told)) => {
                assert!(
                    different.is_empty(),
                    "seed {seed}: {different:?} differ\n{told}"
                );
                *kinds.entry(kind).or_default() += 1;
            }
        }
    }
    let compared: u64 = kinds.values().sum();
    assert!(
        compared > worlds * 3 / 4,
        "only {compared} of {worlds} from seed 0 on were clear cut: {doubts:?}"
    );
    assert_eq!(kinds.len(), 10, "{kinds:?}");
    assert!(
        kinds.values().all(|count| *count >= worlds / 300),
        "{kinds:?}"
    );
}

#[cfg(feature = "planted")]
#[test]
fn a_planted_fault_in_the_starts_is_found() {
    use skyway::planted::{Bug, here};
    for bug in [
        Bug::DroppedCause,
        Bug::RemovedLegOpen,
        Bug::ClosedNodeEntered,
    ] {
        let found = here(bug, || {
            let differs =
                |seed: &u64| look(*seed).is_ok_and(|(_, different, _)| !different.is_empty());
            (0..WORLDS).filter(differs).count()
        });
        assert!(found > 0, "{bug:?} was not found in {WORLDS} worlds");
    }
}
