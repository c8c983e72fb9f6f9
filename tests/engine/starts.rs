//! Where the new path starts: stories on a small map.
//!
//! ```text
//! C . . . D        A - B is the leg, 400 m; C - D the way around it.
//! . . . . .        A - C, B - D and C - D are open; E hangs on B, with pads.
//! A . . . B . E
//! ```

use skyway::airspace::{Airspace, Change, Closure, Hits, Zone, ZoneDraft, ZoneGeometry};
use skyway::flight::{Aloft, FailureReport, FailureType, Location};
use skyway::geo::{AltitudeBand, Point};
use skyway::network::{NodeIx, Topology, sketch};
use skyway::recompose::{
    BroughtZone, Fallback, Flag, Outcome, Recomposition, Request, Scratch, Severance, Strategy,
    Warning, World, recompose,
};
use std::sync::Arc;

pub(crate) struct Map {
    topology: Arc<Topology>,
    airspace: Airspace,
}

impl Map {
    pub(crate) fn new() -> Self {
        let drawing = "
C...D
.....
A...B.E";
        let segments = [("A", "B"), ("A", "C"), ("C", "D"), ("D", "B"), ("B", "E")];
        let topology = Arc::new(sketch(drawing, &segments));
        let now = jiff::Timestamp::UNIX_EPOCH;
        let horizon = jiff::SignedDuration::from_mins(60);
        let airspace = Airspace::open(topology.clone(), 1, now, horizon);
        Self { topology, airspace }
    }

    pub(crate) fn node(&self, letter: &str) -> NodeIx {
        self.topology.node(letter).expect("a letter of the drawing")
    }

    pub(crate) fn closing(mut self, nodes: &[&str], segments: &[(&str, &str)]) -> Self {
        let between = |(from, to): &(&str, &str)| {
            let found = self
                .topology
                .segment_between(self.node(from), self.node(to));
            found.expect("a line of the drawing")
        };
        let closure = Closure::of_operator(
            "by hand".to_owned(),
            "test".to_owned(),
            nodes.iter().map(|letter| self.node(letter)).collect(),
            segments.iter().map(between).collect(),
        );
        let change = Change::Put(Arc::new(closure));
        self.airspace = self.airspace.apply(&[change], self.airspace.as_of());
        self
    }

    pub(crate) fn with_zone(self, from_x: f64, to_x: f64) -> Self {
        self.with_named_zone("zone", from_x, to_x)
    }

    pub(crate) fn with_named_zone(mut self, id: &str, from_x: f64, to_x: f64) -> Self {
        let zone = Arc::new(self.zone(id, from_x, to_x));
        let change = Change::Put(Arc::new(Closure::of_zone(&self.topology, zone)));
        self.airspace = self.airspace.apply(&[change], self.airspace.as_of());
        self
    }

    /// A zone over the leg A - B from one x to another, reaching no other segment.
    fn zone(&self, id: &str, from_x: f64, to_x: f64) -> Zone {
        let ring = [
            [from_x, -50.0],
            [to_x, -50.0],
            [to_x, 50.0],
            [from_x, 50.0],
            [from_x, -50.0],
        ];
        let draft = ZoneDraft {
            id: id.to_owned(),
            name: None,
            reason: None,
            authority: None,
            geometry: ZoneGeometry::Polygon(vec![ring.to_vec()]),
            band: AltitudeBand::UNLIMITED,
            windows: Vec::new(),
            margin_m: 0.0,
            terms: Default::default(),
        };
        Zone::new(draft, self.topology.frame()).expect("a rectangle")
    }

    pub(crate) fn request(&self, failure: FailureType, location: Location) -> Request {
        Request::exact(FailureReport {
            failure,
            leg: (self.node("A"), self.node("B")),
            location,
            cause_location: None,
            destination: self.node("E"),
            remaining_path: Some(["A", "B", "E"].map(|letter| self.node(letter)).to_vec()),
        })
    }

    pub(crate) fn answer(&self, request: &Request) -> Recomposition {
        let world = World {
            airspace: &self.airspace,
            trees: None,
        };
        recompose(&world, request, &mut Scratch::new(&self.topology))
    }

    pub(crate) fn letters(&self, answer: &Recomposition) -> String {
        let nodes = answer.path.nodes.iter();
        nodes.map(|&node| self.topology.node_id(node)).collect()
    }
}

pub(crate) fn on_leg(x: f64) -> Location {
    Location::At(Point::new(x, 0.0))
}

#[test]
fn an_obstacle_ahead_sends_the_drone_back_to_the_start_of_its_leg() {
    let map = Map::new();
    let answer = map.answer(&map.request(FailureType::Navigational, on_leg(300.0)));
    assert_eq!(answer.outcome, Outcome::Rerouted);
    assert_eq!(map.letters(&answer), "ACDBE");
    assert_eq!(answer.first_stretch_m, 300.0);
    assert_eq!(answer.recomposed_length_m, Some(1_000.0));
    assert_eq!(answer.remaining_length_m, Some(1_300.0));
}

#[test]
fn an_obstacle_behind_lets_it_fly_on() {
    let map = Map::new();
    let mut request = map.request(FailureType::Navigational, on_leg(300.0));
    request.report.cause_location = Some(Point::new(100.0, 3.0));
    let answer = map.answer(&request);
    assert_eq!(answer.outcome, Outcome::Unaffected);
    assert_eq!(map.letters(&answer), "BE");
    assert_eq!(answer.first_stretch_m, 100.0);
    assert_eq!(answer.remaining_length_m, Some(300.0));
}

/// Up to 50 m past or beside the end of its leg it counts as on it, and has to come back all the same.
#[test]
fn past_the_end_of_its_leg_it_comes_back_as_far_as_it_is_away() {
    for (place, stretch_m) in [
        ((430.0, 0.0), 30.0),
        ((400.0, 24.0), 24.0),
        ((424.0, 32.0), 40.0),
    ] {
        let map = Map::new();
        let location = Location::At(Point::new(place.0, place.1));
        let answer = map.answer(&map.request(FailureType::ServiceLevel, location));
        assert_eq!(map.letters(&answer), "BE", "at {place:?}");
        assert_eq!(answer.first_stretch_m, stretch_m, "at {place:?}");
        let begin = answer.reentry.map(|reentry| reentry.stretch.begin);
        assert_eq!(begin, Some(Point::new(place.0, place.1)));
    }
    // One that has landed stands at the node, as near to it as places are exact.
    let map = Map::new();
    let mut landed = map.request(FailureType::ServiceLevel, on_leg(410.0));
    landed.circumstances.aloft = Aloft::Grounded;
    assert_eq!(map.answer(&landed).first_stretch_m, 0.0);
}

/// What has no place lies somewhere on the leg, of which nothing is ahead of who is at its end, or just past it.
#[test]
fn at_the_end_of_its_leg_nothing_lies_ahead_and_the_leg_is_not_flown_again() {
    for (x, stretch_m) in [(400.0, 0.0), (430.0, 30.0)] {
        let map = Map::new();
        let answer = map.answer(&map.request(FailureType::Navigational, on_leg(x)));
        assert_eq!(map.letters(&answer), "BE", "at {x}");
        assert_eq!(answer.first_stretch_m, stretch_m, "at {x}");

        let cut_off = Map::new().closing(&[], &[("D", "B")]);
        let mut request = cut_off.request(FailureType::Navigational, on_leg(x));
        request.report.destination = cut_off.node("C");
        request.report.remaining_path = None;
        assert_eq!(cut_off.answer(&request).outcome, Outcome::NoRoute, "at {x}");
    }
    let map = Map::new();
    let answer = map.answer(&map.request(FailureType::Navigational, on_leg(399.0)));
    assert_eq!(map.letters(&answer), "ACDBE");
}

#[test]
fn a_failure_that_closes_nothing_leaves_the_plan_alone() {
    let map = Map::new();
    for failure in [FailureType::ServiceLevel, FailureType::Infrastructure] {
        let mut request = map.request(failure, on_leg(300.0));
        request.strategy = Strategy::TwoPhased;
        let answer = map.answer(&request);
        assert_eq!(answer.outcome, Outcome::Unaffected, "{failure:?}");
        assert_eq!(answer.strategy_used, Strategy::Exact);
        assert_eq!(answer.fallback, Some(Fallback::NothingClosed));
        assert_eq!(map.letters(&answer), "BE");
        assert_eq!(answer.remaining_length_m, Some(300.0));
    }
}

#[test]
fn a_zone_ahead_on_the_leg_is_the_cause_and_a_zone_behind_is_passed() {
    let ahead = Map::new().with_zone(300.0, 350.0);
    let answer = ahead.answer(&ahead.request(FailureType::Navigational, on_leg(200.0)));
    assert_eq!(ahead.letters(&answer), "ACDBE");

    let behind = Map::new().with_zone(50.0, 100.0);
    let answer = behind.answer(&behind.request(FailureType::ServiceLevel, on_leg(200.0)));
    assert_eq!(behind.letters(&answer), "BE");
    assert_eq!(answer.first_stretch_m, 200.0);
}

#[test]
fn inside_a_zone_the_drone_leaves_by_the_shorter_way_and_is_told() {
    let map = Map::new().with_zone(150.0, 350.0);
    for (x, first, stretch_m) in [(200.0, "A", 200.0), (300.0, "B", 100.0)] {
        let answer = map.answer(&map.request(FailureType::ServiceLevel, on_leg(x)));
        assert_eq!(answer.flags, [Flag::LeavingZone], "at {x}");
        assert!(answer.warnings.contains(&Warning::InsideZone), "at {x}");
        assert!(map.letters(&answer).starts_with(first), "at {x}");
        assert_eq!(answer.first_stretch_m, stretch_m);
    }
}

#[test]
fn a_zone_that_a_report_brings_binds_this_request_alone() {
    let map = Map::new();
    let zone = map.zone("brought", 450.0, 550.0);
    let mut request = map.request(FailureType::Regulatory, on_leg(100.0));
    request.zone = Some(BroughtZone {
        hits: Hits::of(&map.topology, &zone),
        zone: Arc::new(zone),
    });
    // B - E is under the zone: nothing leads to E any more.
    let answer = map.answer(&request);
    assert_eq!(answer.outcome, Outcome::NoRoute);
    assert_eq!(answer.severed_by, [Severance::Report]);
    request.zone = None;
    assert_eq!(map.answer(&request).outcome, Outcome::Rerouted);
}

#[test]
fn nobody_knows_where_the_drone_is_so_the_worst_is_assumed() {
    let map = Map::new();
    let answer = map.answer(&map.request(FailureType::Navigational, Location::Unknown));
    assert_eq!(map.letters(&answer), "ACDBE");
    assert_eq!(answer.first_stretch_m, 400.0);
}

#[test]
fn a_closed_start_is_left_and_flagged() {
    let map = Map::new().closing(&["A"], &[]);
    let answer = map.answer(&map.request(FailureType::Navigational, Location::LegStart));
    assert_eq!(map.letters(&answer), "ACDBE");
    let node = map.node("A");
    assert!(answer.warnings.contains(&Warning::StartClosed { node }));
}

#[test]
fn off_the_leg_the_nearest_nodes_are_offered_unverified() {
    let map = Map::new();
    let above = Location::At(Point::new(390.0, 150.0));
    let mut request = map.request(FailureType::Navigational, above);
    request.strategy = Strategy::Radius;
    let answer = map.answer(&request);
    assert_eq!(answer.fallback, Some(Fallback::OffLeg));
    assert!(matches!(answer.warnings[..], [Warning::Unverified { .. }]));
    // D is 51 m away, B 150 m and the destination 258 m: the whole way decides.
    assert_eq!(map.letters(&answer), "E");
}

#[test]
fn what_cut_the_drone_off_is_named() {
    let map = Map::new().closing(&[], &[("C", "D")]);
    let answer = map.answer(&map.request(FailureType::Navigational, Location::LegStart));
    assert_eq!(answer.outcome, Outcome::NoRoute);
    let by_hand = Severance::Closure("by hand".to_owned());
    assert_eq!(answer.severed_by, [Severance::Report, by_hand]);
    assert!(answer.path.nodes.is_empty());
}
