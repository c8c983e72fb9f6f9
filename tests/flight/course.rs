//! Legs through the air: their corners, how long they are there, and how long a steep one takes.

use skyway::flight::{Airframe, FlightLegs, FlightRules, LegCourse, WindField};
use skyway::geo::{Altitude, AltitudeBand, AltitudeReference};
use skyway::network::{NetworkDraft, NodeDraft, SegmentDraft, Topology};

/// Two roofs 100 m apart over ground, and the altitudes between which their segment is flown.
fn two_roofs(roofs_m: [Option<f64>; 2], band_m: (f64, f64)) -> Topology {
    let nodes = roofs_m
        .into_iter()
        .enumerate()
        .map(|(number, roof_m)| NodeDraft {
            id: number.to_string(),
            position: [100.0 * number as f64, 0.0],
            altitude: roof_m.map(Altitude::agl),
            ..NodeDraft::default()
        });
    let segment = SegmentDraft {
        from: "0".to_owned(),
        to: "1".to_owned(),
        band: AltitudeBand {
            lower: Some(Altitude::agl(band_m.0)),
            upper: Some(Altitude::agl(band_m.1)),
        },
        ..SegmentDraft::default()
    };
    let draft = NetworkDraft {
        name: "roofs".to_owned(),
        nodes: nodes.collect(),
        segments: vec![segment],
        ..NetworkDraft::default()
    };
    Topology::build(draft, [0; 32]).expect("it is valid")
}

fn course(topology: &Topology, from: &str, to: &str) -> LegCourse {
    let node = |id: &str| topology.node(id).expect("it is there");
    let segment = topology.find_segment("0-1").expect("it is there");
    LegCourse::of(topology, node(from), node(to), segment)
}

#[test]
fn a_course_goes_from_crossing_altitude_to_crossing_altitude() {
    // One roof is under the band, one above it.
    let topology = two_roofs([Some(20.0), Some(150.0)], (60.0, 120.0));
    let up = course(&topology, "0", "1");
    let heights: Vec<Option<f64>> = up.corners.iter().map(|corner| corner.height_m).collect();
    assert_eq!(heights, [Some(60.0), Some(120.0), Some(150.0)]);
    assert_eq!(up.reference, Some(AltitudeReference::Agl));
    assert_eq!(up.climb_m, 90.0);
    assert!((up.length_air_m - (100.0_f64.hypot(60.0) + 30.0)).abs() < 1e-9);
    let down = course(&topology, "1", "0");
    assert_eq!((down.climb_m, down.length_air_m), (0.0, up.length_air_m));
    assert_eq!(down.corners.first(), up.corners.last());
}

#[test]
fn a_course_without_altitudes_has_no_heights() {
    let unknown = course(&two_roofs([Some(20.0), None], (60.0, 120.0)), "0", "1");
    assert!(
        unknown
            .corners
            .iter()
            .all(|corner| corner.height_m.is_none())
    );
    assert_eq!((unknown.reference, unknown.climb_m), (None, 0.0));
    assert_eq!(unknown.length_air_m, 100.0);
}

#[test]
fn a_leg_that_is_steeper_than_the_airframe_climbs_takes_the_time_of_the_climb() {
    let topology = two_roofs([Some(60.0), Some(120.0)], (60.0, 120.0));
    let airframe = Airframe {
        climb_mps: Some(2.0),
        descent_mps: Some(4.0),
        ..Airframe::phantom3()
    };
    let time_s = |from: &str| {
        let rules = FlightRules::default();
        let legs = FlightLegs::of(&topology, &airframe, 0.0, &WindField::default(), &rules);
        let from = topology.node(from).expect("it is there");
        let leg = legs.from(from).next().expect("one leg");
        legs.leg(leg).least.time_s
    };
    // 100 m over ground are 6.25 s at 16 m/s.
    assert_eq!(time_s("0"), 30.0);
    assert_eq!(time_s("1"), 15.0);
}

#[test]
fn stopping_takes_the_reaction_and_the_braking() {
    let phantom = Airframe::phantom3();
    assert!((phantom.stopping_m(16.0) - (32.0 + 256.0 / 7.0)).abs() < 1e-12);
    let text = include_str!("../../data/airframes/m100.json");
    assert_eq!(Airframe::from_json(text), Ok(Airframe::m100()));
    // Files of before say nothing of it.
    let lines = text.lines().filter(|line| {
        let new = ["climb_mps", "descent_mps", "acceleration", "reaction"];
        !new.iter().any(|name| line.contains(name))
    });
    let before = Airframe::from_json(&lines.collect::<String>()).expect("readable");
    assert_eq!(before.climb_speed_mps(), before.vertical_speed_mps);
    assert_eq!(before.stopping_m(12.0), Airframe::m100().stopping_m(12.0));
}
