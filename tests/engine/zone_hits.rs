//! What a zone closes, against asking every segment and every node; and when it counts.

use super::shape_cases::{below, star, uniform};
use jiff::{SignedDuration, Timestamp};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use skyway::airspace::{Hits, Window, Zone, ZoneDraft, ZoneGeometry};
use skyway::geo::{Altitude, AltitudeBand, Point};
use skyway::network::{NetworkDraft, NodeDraft, SegmentDraft, Topology};

fn draft(geometry: ZoneGeometry) -> ZoneDraft {
    ZoneDraft {
        id: "zone".to_owned(),
        name: None,
        reason: None,
        authority: None,
        geometry,
        band: AltitudeBand::UNLIMITED,
        windows: Vec::new(),
        margin_m: 10.0,
        terms: Default::default(),
    }
}

fn at_most(upper_m: f64) -> AltitudeBand {
    AltitudeBand {
        lower: None,
        upper: Some(Altitude::agl(upper_m)),
    }
}

/// Nodes anywhere in a square of 2,000 m, some at 50 m of altitude; segments between any two near in number.
fn random_network(random: &mut ChaCha8Rng) -> Topology {
    let count = 400;
    let nodes = (0..count).map(|index| NodeDraft {
        id: index.to_string(),
        position: [uniform(random, 0.0, 2_000.0), uniform(random, 0.0, 2_000.0)],
        altitude: (below(random, 2) == 0).then_some(Altitude::agl(50.0)),
        ..NodeDraft::default()
    });
    let nodes: Vec<NodeDraft> = nodes.collect();
    let mut segments = Vec::new();
    for from in 0..count {
        for step in 1..4 {
            let band = match below(random, 3) {
                0 => AltitudeBand::UNLIMITED,
                1 => at_most(30.0),
                _ => AltitudeBand::at(Some(Altitude::agl(80.0))),
            };
            segments.push(SegmentDraft {
                from: from.to_string(),
                to: ((from + step) % count).to_string(),
                band,
                ..SegmentDraft::default()
            });
        }
    }
    let draft = NetworkDraft {
        nodes,
        segments,
        ..NetworkDraft::default()
    };
    Topology::build(draft, [0; 32]).expect("a network")
}

fn random_zone(random: &mut ChaCha8Rng, topology: &Topology) -> Zone {
    let centre = Point::new(uniform(random, 0.0, 2_000.0), uniform(random, 0.0, 2_000.0));
    let geometry = if below(random, 4) == 0 {
        ZoneGeometry::Circle {
            centre: [centre.x, centre.y],
            radius_m: uniform(random, 1.0, 900.0),
        }
    } else {
        let corners = 5 + below(random, 60) as usize;
        let outer = star(random, centre, (80.0, 900.0), corners);
        let hole = star(random, centre, (2.0, 20.0), 7);
        let written = |ring: Vec<Point>| ring.iter().map(|point| [point.x, point.y]).collect();
        ZoneGeometry::Polygon(vec![written(outer), written(hole)])
    };
    let band = match below(random, 3) {
        0 => AltitudeBand::UNLIMITED,
        1 => at_most(40.0),
        _ => AltitudeBand {
            lower: Some(Altitude::agl(60.0)),
            upper: None,
        },
    };
    let margin_m = uniform(random, 0.0, 60.0);
    let draft = ZoneDraft {
        band,
        margin_m,
        ..draft(geometry)
    };
    Zone::new(draft, topology.frame()).expect("a zone")
}

#[test]
fn a_zone_closes_exactly_what_asking_everything_finds() {
    let mut random = ChaCha8Rng::seed_from_u64(21);
    let mut closed = (0, 0);
    for case in 0..20 {
        let topology = random_network(&mut random);
        for _ in 0..20 {
            let zone = random_zone(&mut random, &topology);
            let (shape, margin_m) = (zone.shape(), zone.margin_m());
            let segments = topology.segments().filter(|&segment| {
                let (from, to) = topology.segment_ends(segment);
                let band = topology.segment_band(segment);
                band.may_meet(zone.band()) && shape.meets_segment(from, to, margin_m)
            });
            let nodes = topology.nodes().filter(|&node| {
                let band = AltitudeBand::at(topology.node_altitude(node));
                let position = topology.position(node);
                band.may_meet(zone.band()) && shape.covers_point(position, margin_m)
            });
            let expected = Hits::new(segments.collect(), nodes.collect());
            let found = Hits::of(&topology, &zone);
            assert_eq!(
                found,
                expected,
                "seed 21, network {case}: {:?}",
                zone.geometry()
            );
            closed.0 += found.segments.len();
            closed.1 += found.nodes.len();
        }
    }
    assert!(closed.0 > 10_000 && closed.1 > 5_000, "{closed:?}");
}

#[test]
fn limits_that_cannot_be_compared_count_as_reaching() {
    let nodes = [[0.0, 0.0], [100.0, 0.0]].map(|position| NodeDraft {
        id: position[0].to_string(),
        position,
        altitude: Some(Altitude::agl(200.0)),
        ..NodeDraft::default()
    });
    let segment = SegmentDraft {
        from: "0".to_owned(),
        to: "100".to_owned(),
        band: AltitudeBand::at(Some(Altitude::agl(200.0))),
        ..SegmentDraft::default()
    };
    let network = NetworkDraft {
        nodes: nodes.to_vec(),
        segments: vec![segment],
        ..NetworkDraft::default()
    };
    let topology = Topology::build(network, [0; 32]).expect("a network");
    let hit = |upper: Altitude| {
        let band = AltitudeBand {
            lower: None,
            upper: Some(upper),
        };
        let geometry = ZoneGeometry::Circle {
            centre: [50.0, 0.0],
            radius_m: 200.0,
        };
        let zone = ZoneDraft {
            band,
            ..draft(geometry)
        };
        let zone = Zone::new(zone, topology.frame()).expect("a zone");
        let hits = Hits::of(&topology, &zone);
        (hits.segments.len(), hits.nodes.len())
    };
    assert_eq!(hit(Altitude::agl(120.0)), (0, 0));
    assert_eq!(hit(Altitude::agl(200.0)), (1, 2), "touching limits meet");
    let amsl = Altitude {
        reference: skyway::geo::AltitudeReference::Amsl,
        ..Altitude::agl(120.0)
    };
    assert_eq!(hit(amsl), (1, 2), "nothing is known of the ground");
}

#[test]
fn a_window_counts_from_the_horizon_before_it_to_its_last_nanosecond() {
    let at = |second: i64| Timestamp::from_second(second).expect("an instant");
    let hour = SignedDuration::from_hours(1);
    let nanosecond = SignedDuration::from_nanos(1);
    let window = Window::new(Some(at(10_000)), Some(at(20_000))).expect("a window");
    let counts = |second: i64| window.counts(at(second), hour);
    assert_eq!((counts(6_399), counts(6_400)), (false, true));
    assert_eq!((counts(20_000), counts(20_001)), (true, false));
    assert_eq!(window.next_change_after(at(0), hour), Some(at(6_400)));
    let ended = at(20_000).checked_add(nanosecond).expect("an instant");
    assert_eq!(window.next_change_after(at(6_400), hour), Some(ended));
    assert_eq!(window.next_change_after(at(20_000), hour), Some(ended));
    assert!(!window.counts(ended, hour));
    assert_eq!(window.next_change_after(ended, hour), None);

    let always = Window::new(None, None).expect("open at both ends");
    assert!(always.counts(Timestamp::MAX, hour) && always.counts(Timestamp::MIN, hour));
    assert_eq!(always.next_change_after(at(0), hour), None);
    let forever = Window::new(Some(at(0)), Some(Timestamp::MAX)).expect("a window");
    assert_eq!(forever.next_change_after(at(0), hour), None);
    assert!(Window::new(Some(at(5)), Some(at(5))).is_err());
    assert!(Window::new(Some(at(6)), Some(at(5))).is_err());
}

#[test]
fn a_zone_counts_when_any_of_its_windows_does_or_it_has_none() {
    let at = |second: i64| Timestamp::from_second(second).expect("an instant");
    let window = |from, until| Window::new(Some(at(from)), Some(at(until))).expect("a window");
    let circle = ZoneGeometry::Circle {
        centre: [0.0, 0.0],
        radius_m: 5.0,
    };
    let frame = skyway::geo::Frame::Planar;
    let always = Zone::new(draft(circle), &frame).expect("a zone");
    let windows = vec![window(500, 600), window(100, 200)];
    let zone = ZoneDraft {
        windows,
        ..draft(always.geometry().clone())
    };
    let zone = Zone::new(zone, &frame).expect("a zone");
    let now = SignedDuration::ZERO;
    let counts: Vec<bool> = [50, 150, 300, 550, 700]
        .map(|second| zone.counts_at(at(second), now))
        .to_vec();
    assert_eq!(counts, [false, true, false, true, false]);
    assert!(always.counts_at(at(300), now));
    assert_eq!(zone.next_change_after(at(50), now), Some(at(100)));
    assert_eq!(zone.next_change_after(at(300), now), Some(at(500)));
    assert_eq!(zone.next_change_after(at(700), now), None);
    assert_eq!(always.next_change_after(at(50), now), None);
}
