//! A fault of each kind by distance is found, and what holds passes.

mod begin;
mod rules;

use super::*;
use crate::airspace::{Airspace, Cause, Change, Closure, Hits, Zone, ZoneDraft, ZoneGeometry};
use crate::geo::{AltitudeBand, Frame, Point};
use crate::network::{NetworkDraft, NodeDraft, NodeIx, SegmentDraft, SegmentIx, Topology};
use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;

/// A - B - C along y = 0, 500 m each; A - D - E - B around it, 100 m above. B and E have pads.
fn world() -> Arc<Topology> {
    let node = |id: &str, x: f64, y: f64, pads: u16| NodeDraft {
        id: id.to_owned(),
        position: [x, y],
        pads,
        ..NodeDraft::default()
    };
    let segment = |from: &str, to: &str| SegmentDraft {
        from: from.to_owned(),
        to: to.to_owned(),
        ..SegmentDraft::default()
    };
    let draft = NetworkDraft {
        name: "ladder".to_owned(),
        nodes: vec![
            node("A", 0.0, 0.0, 0),
            node("B", 500.0, 0.0, 2),
            node("C", 1000.0, 0.0, 0),
            node("D", 0.0, 100.0, 0),
            node("E", 500.0, 100.0, 1),
        ],
        segments: vec![
            segment("A", "B"),
            segment("B", "C"),
            segment("A", "D"),
            segment("D", "E"),
            segment("E", "B"),
        ],
        ..NetworkDraft::default()
    };
    Arc::new(Topology::build(draft, [0; 32]).expect("a network"))
}

fn open(topology: &Arc<Topology>) -> Airspace {
    Airspace::open(
        topology.clone(),
        1,
        Timestamp::UNIX_EPOCH,
        SignedDuration::from_mins(10),
    )
}

fn node(topology: &Topology, id: &str) -> NodeIx {
    topology.node(id).expect("a node")
}

fn way(topology: &Topology, ids: &str) -> (Vec<NodeIx>, Vec<SegmentIx>) {
    let nodes: Vec<NodeIx> = ids
        .chars()
        .map(|id| node(topology, &id.to_string()))
        .collect();
    let pairs = nodes.windows(2);
    let segments = pairs.map(|pair| {
        topology
            .segment_between(pair[0], pair[1])
            .expect("a segment")
    });
    (nodes.clone(), segments.collect())
}

fn circle(topology: &Topology, x: f64, y: f64, radius_m: f64) -> Change {
    let draft = ZoneDraft {
        id: format!("zone-{x}-{y}"),
        name: None,
        reason: None,
        authority: None,
        geometry: ZoneGeometry::Circle {
            centre: [x, y],
            radius_m,
        },
        band: AltitudeBand::UNLIMITED,
        windows: Vec::new(),
        margin_m: 0.0,
        terms: Default::default(),
    };
    let zone = Zone::new(draft, &Frame::Planar).expect("a zone");
    Change::Put(Arc::new(Closure::of_zone(topology, Arc::new(zone))))
}

/// An answer to a drone 200 m along A - B, which reports that leg; each test changes what it is about.
struct Story {
    topology: Arc<Topology>,
    airspace: Airspace,
    told: Told,
    ids: &'static str,
    stretch: Stretch,
    length_m: f64,
    flags: Flags,
    at: Whereabouts,
    closes_leg: bool,
    cause: Option<Point>,
    need: Need,
    stands_at: Option<NodeIx>,
    destination: NodeIx,
    planned: Option<Vec<NodeIx>>,
    leg: (NodeIx, NodeIx),
}

impl Story {
    /// Back to A and around, to C.
    fn around() -> Self {
        let topology = world();
        let leg = (node(&topology, "A"), node(&topology, "B"));
        Self {
            airspace: open(&topology),
            told: Told::Rerouted,
            ids: "ADEBC",
            stretch: Stretch {
                kind: StretchKind::Leg,
                leg: Some(leg),
                enters: leg.0,
                length_m: 200.0,
                overrun_m: 0.0,
            },
            length_m: 200.0 + 100.0 + 500.0 + 100.0 + 500.0,
            flags: Flags::default(),
            at: Whereabouts::At(Point::new(200.0, 0.0)),
            closes_leg: true,
            cause: None,
            need: Need::Nothing,
            stands_at: None,
            destination: node(&topology, "C"),
            planned: None,
            leg,
            topology,
        }
    }

    /// On to B and C.
    fn on() -> Self {
        let around = Self::around();
        Self {
            told: Told::Unaffected,
            ids: "BC",
            stretch: Stretch {
                enters: around.leg.1,
                length_m: 300.0,
                ..around.stretch
            },
            length_m: 800.0,
            closes_leg: false,
            ..around
        }
    }

    fn closing(mut self, changes: &[Change]) -> Self {
        self.airspace = self.airspace.apply(changes, Timestamp::UNIX_EPOCH);
        self
    }

    fn checked(&self) -> Result<(), Fault> {
        let (nodes, segments) = way(&self.topology, self.ids);
        let has_path = !nodes.is_empty();
        let claim = Claim {
            told: self.told,
            stretch: has_path.then_some(self.stretch),
            nodes: &nodes,
            segments: &segments,
            length_m: has_path.then_some(self.length_m),
            flags: self.flags,
            has_unsafe_way: false,
            waits_until: None,
            flight: None,
        };
        let segment = self.topology.segment_between(self.leg.0, self.leg.1);
        let sky = Sky {
            airspace: &self.airspace,
            own: OwnClosures {
                segment: segment.filter(|_| self.closes_leg),
                closes_leg: self.closes_leg,
                cause: self.cause,
                ..OwnClosures::default()
            },
            flight: None,
        };
        let drone = Drone {
            leg: self.leg,
            at: self.at,
            drift_m: 0.0,
            stopping_m: 69.0,
            stands_at: self.stands_at,
            destination: self.destination,
            onward: &[],
            planned: self.planned.as_deref(),
            need: self.need,
            at_s: 0.0,
            battery: None,
        };
        check(&claim, &drone, &sky)
    }

    fn rule(&self) -> Rule {
        self.checked().expect_err("a fault").rule
    }
}
