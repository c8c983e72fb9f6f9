//! A fault of each kind by distance is found, and what holds passes.

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

#[test]
fn what_holds_passes() {
    assert_eq!(Story::around().checked(), Ok(()));
    assert_eq!(Story::on().checked(), Ok(()));
    let bare = Story {
        told: Told::NoRoute,
        ids: "",
        ..Story::around()
    };
    assert_eq!(bare.checked(), Ok(()));
}

#[test]
fn a_path_begins_where_the_drone_is() {
    let mut swapped = Story::around();
    swapped.stretch.length_m = 300.0;
    swapped.length_m = 1_500.0;
    assert_eq!(swapped.rule(), Rule::Length);
    let mut forgotten = Story::around();
    forgotten.stretch.length_m = 0.0;
    forgotten.stretch.kind = StretchKind::None;
    forgotten.length_m = 1_200.0;
    assert_eq!(forgotten.rule(), Rule::BeginsAtDrone);
    let mut other = Story::around();
    other.stretch.enters = node(&other.topology, "D");
    assert_eq!(other.rule(), Rule::BeginsAtDrone);
}

#[test]
fn lengths_add_up() {
    let mut short = Story::around();
    short.length_m = 1_200.0;
    assert_eq!(short.rule(), Rule::Length);
    short.length_m = f64::NAN;
    assert_eq!(short.rule(), Rule::Length);
}

#[test]
fn the_first_stretch_passes_no_cause() {
    // Its own failure lies ahead, or nobody knows where.
    let failed = Story {
        told: Told::Rerouted,
        closes_leg: true,
        ..Story::on()
    };
    assert_eq!(failed.rule(), Rule::PassesCause);
    let ahead = Story {
        cause: Some(Point::new(400.0, 0.0)),
        ..failed
    };
    assert_eq!(ahead.rule(), Rule::PassesCause);
    let behind = Story {
        cause: Some(Point::new(100.0, 0.0)),
        ..ahead
    };
    assert_eq!(behind.checked(), Ok(()));
    let back = Story {
        cause: Some(Point::new(100.0, 0.0)),
        ..Story::around()
    };
    assert_eq!(back.rule(), Rule::PassesCause);
}

#[test]
fn closures_of_operators_and_reports_lie_ahead() {
    let story = Story::on();
    let segment = story.topology.segment_between(story.leg.0, story.leg.1);
    let closure = Closure {
        cause: Cause::Report {
            report: "r".to_owned(),
        },
        id: "r".to_owned(),
        windows: Vec::new(),
        hits: Hits::new(segment.into_iter().collect(), Vec::new()),
        pads: Vec::new(),
    };
    let closed = story.closing(&[Change::Put(Arc::new(closure))]);
    assert_eq!(closed.rule(), Rule::PassesCause);
}

#[test]
fn a_removed_leg_is_no_way_on() {
    // A - C has no segment.
    let story = Story::on();
    let leg = (node(&story.topology, "A"), node(&story.topology, "C"));
    let removed = Story {
        leg,
        ids: "C",
        told: Told::Rerouted,
        stretch: Stretch {
            leg: Some(leg),
            enters: leg.1,
            length_m: 800.0,
            ..story.stretch
        },
        ..story
    };
    assert_eq!(removed.rule(), Rule::PassesCause);
}

#[test]
fn the_first_stretch_enters_no_zone_and_leaves_the_one_around_it() {
    let story = Story::on();
    let zone = circle(&story.topology, 400.0, 0.0, 20.0);
    assert_eq!(story.closing(&[zone]).rule(), Rule::EntersZone);
    let story = Story::around();
    let zone = circle(&story.topology, 100.0, 0.0, 20.0);
    assert_eq!(story.closing(&[zone]).rule(), Rule::EntersZone);
    let story = Story::around();
    let zone = circle(&story.topology, 200.0, 0.0, 30.0);
    let inside = story.closing(&[zone]);
    assert_eq!(inside.rule(), Rule::FlagMissing(Flag::LeavingZone));
    let flagged = Story {
        flags: Flags::default().with(Flag::LeavingZone),
        ..inside
    };
    assert_eq!(flagged.checked(), Ok(()));
}

#[test]
fn closed_nodes_and_segments_are_not_flown() {
    let close = |story: Story, nodes: &[&str], segments: &[&str]| {
        let topology = story.topology.clone();
        let nodes = nodes.iter().map(|id| node(&topology, id)).collect();
        let segments = segments
            .iter()
            .map(|ids| way(&topology, ids).1[0])
            .collect();
        let closure = Closure::of_operator("o".to_owned(), String::new(), nodes, segments);
        story.closing(&[Change::Put(Arc::new(closure))])
    };
    assert_eq!(
        close(Story::around(), &[], &["DE"]).rule(),
        Rule::ClosedSegment
    );
    assert_eq!(close(Story::around(), &["E"], &[]).rule(), Rule::ClosedNode);
    // Where it begins, too: it is not there yet.
    assert_eq!(close(Story::around(), &["A"], &[]).rule(), Rule::ClosedNode);
    let mut at_node = Story::around();
    at_node.at = Whereabouts::LegStart;
    at_node.stretch.kind = StretchKind::None;
    at_node.stretch.length_m = 0.0;
    at_node.length_m = 1_200.0;
    assert_eq!(close(at_node, &["A"], &[]).checked(), Ok(()));
}

#[test]
fn straight_lines_are_for_those_off_their_leg_and_flagged() {
    let story = Story::around();
    let enters = node(&story.topology, "D");
    let mut straight = Story {
        ids: "DEBC",
        at: Whereabouts::At(Point::new(200.0, -100.0)),
        flags: Flags::default().with(Flag::Unverified),
        stretch: Stretch {
            kind: StretchKind::Straight,
            leg: None,
            enters,
            length_m: 200.0_f64.hypot(200.0),
            overrun_m: 0.0,
        },
        ..story
    };
    straight.length_m = straight.stretch.length_m + 1_100.0;
    assert_eq!(straight.checked(), Ok(()));
    straight.flags = Flags::default();
    assert_eq!(straight.rule(), Rule::FlagMissing(Flag::Unverified));
    straight.flags = Flags::default().with(Flag::Unverified);
    let zone = circle(&straight.topology, 100.0, 0.0, 20.0);
    assert_eq!(straight.closing(&[zone]).rule(), Rule::EntersZone);
    // On its leg nobody flies straight over roofs.
    let mut on_leg = Story::around();
    on_leg.stretch.kind = StretchKind::Straight;
    on_leg.stretch.leg = None;
    on_leg.flags = Flags::default().with(Flag::Unverified);
    assert_eq!(on_leg.rule(), Rule::FlagWithoutGround(Flag::Unverified));
}

#[test]
fn flags_have_their_ground() {
    for flag in Flag::ALL {
        let flagged = Story {
            flags: Flags::default().with(flag),
            ..Story::around()
        };
        assert_eq!(flagged.rule(), Rule::FlagWithoutGround(flag));
    }
}

#[test]
fn who_cannot_turn_before_a_zone_says_so() {
    let mut story = Story::around();
    story.stretch.overrun_m = 69.0;
    story.stretch.length_m = 200.0 + 2.0 * 69.0;
    story.length_m += 2.0 * 69.0;
    assert_eq!(story.checked(), Ok(()));
    let zone = circle(&story.topology, 300.0, 0.0, 50.0);
    let mut entering = story.closing(&[zone]);
    assert_eq!(entering.rule(), Rule::FlagMissing(Flag::CannotStop));
    entering.flags = Flags::default().with(Flag::CannotStop);
    assert_eq!(entering.checked(), Ok(()));
    // Farther than it needs.
    entering.stretch.overrun_m = 90.0;
    assert_eq!(entering.rule(), Rule::BeginsAtDrone);
}

#[test]
fn an_outcome_says_what_the_path_does() {
    let elsewhere = Story {
        destination: node(&world(), "E"),
        ..Story::around()
    };
    assert_eq!(elsewhere.rule(), Rule::Outcome);
    let story = Story::on();
    let planned = way(&story.topology, "ABEDA").0;
    let other_plan = Story {
        planned: Some(planned),
        ..story
    };
    assert_eq!(other_plan.rule(), Rule::Outcome);
    let diverted = Story {
        told: Told::Diverted,
        ..Story::around()
    };
    assert_eq!(diverted.rule(), Rule::Pad);
    let mut to_pad = Story {
        told: Told::Diverted,
        ids: "ADE",
        length_m: 800.0,
        ..Story::around()
    };
    assert_eq!(to_pad.checked(), Ok(()));
    to_pad.need = Need::Ground;
    assert_eq!(to_pad.checked(), Ok(()));
    let flies_on = Story {
        need: Need::Pad { shown: false },
        ..Story::on()
    };
    assert_eq!(flies_on.rule(), Rule::Outcome);
}

#[test]
fn a_drone_on_the_ground_in_a_zone_stays() {
    let topology = world();
    let pad = node(&topology, "B");
    let leg = (pad, node(&topology, "C"));
    let story = Story {
        leg,
        stands_at: Some(pad),
        at: Whereabouts::LegStart,
        ids: "BC",
        length_m: 500.0,
        closes_leg: false,
        stretch: Stretch {
            kind: StretchKind::None,
            leg: Some(leg),
            enters: pad,
            length_m: 0.0,
            overrun_m: 0.0,
        },
        topology: topology.clone(),
        airspace: open(&topology),
        ..Story::around()
    };
    assert_eq!(story.checked(), Ok(()));
    let mut zoned = story.closing(&[circle(&topology, 500.0, 0.0, 40.0)]);
    assert_eq!(zoned.rule(), Rule::SentUp);
    zoned.told = Told::Hold;
    zoned.ids = "B";
    zoned.length_m = 0.0;
    assert_eq!(zoned.checked(), Ok(()));
}
