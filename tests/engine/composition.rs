//! Plans with their contingencies and conflicts: stories on a small map, and any network against the oracle.
//!
//! ```text
//! C . . . D               A - B - E is the plan, 400 m each; A - C - D - B the way around its first leg.
//! . . . . .
//! A . . . B . . . E
//! ```

mod against_oracle;
mod conflicts;

use super::oracle::{OracleNetwork, OracleNode, OracleSegment};
use skyway::airspace::{Airspace, Change, Closure};
use skyway::compose::{Alternate, Composition, compose, flight_time_s, with_contingencies};
use skyway::network::{NetworkDraft, NodeDraft, NodeIx, SegmentDraft, Topology};
use skyway::recompose::{Outcome, Scratch, World};
use skyway::routing::{Path, TreeCache};
use std::sync::Arc;

const AIRSPEED_MPS: f64 = 16.0;

/// The network of the oracle with its pads; `limits_mps` are speed limits by place of the segment.
fn topology_with_pads(network: &OracleNetwork, limits_mps: &[(usize, f64)]) -> Topology {
    let id = |index: usize| network.nodes[index].id.clone();
    let nodes = network.nodes.iter().map(|node| NodeDraft {
        id: node.id.clone(),
        position: [node.x, node.y],
        pads: u16::try_from(node.pads).expect("few pads"),
        ..NodeDraft::default()
    });
    let segments = network.segments.iter().enumerate();
    let segments = segments.map(|(place, segment)| SegmentDraft {
        from: id(segment.a),
        to: id(segment.b),
        length_m: Some(segment.length_m),
        speed_limit_mps: limits_mps
            .iter()
            .find(|(limited, _)| *limited == place)
            .map(|&(_, limit_mps)| limit_mps),
        ..SegmentDraft::default()
    });
    let draft = NetworkDraft {
        nodes: nodes.collect(),
        segments: segments.collect(),
        ..NetworkDraft::default()
    };
    Topology::build(draft, [0; 32]).expect("a valid network")
}

fn open_airspace(topology: &Arc<Topology>) -> Airspace {
    let now = jiff::Timestamp::UNIX_EPOCH;
    let horizon = jiff::SignedDuration::from_mins(60);
    Airspace::open(topology.clone(), 1, now, horizon)
}

struct Map {
    topology: Arc<Topology>,
    airspace: Airspace,
}

impl Map {
    /// The map above, with pads at the nodes named.
    fn with_pads(pads: &str) -> Self {
        Self::new(pads, &[])
    }

    fn new(pads: &str, limits_mps: &[(usize, f64)]) -> Self {
        let places = [
            ("A", 0.0, 0.0),
            ("B", 400.0, 0.0),
            ("C", 0.0, 200.0),
            ("D", 400.0, 200.0),
            ("E", 800.0, 0.0),
        ];
        let nodes = places.map(|(id, x, y)| OracleNode {
            id: id.to_owned(),
            x,
            y,
            pads: u32::from(pads.contains(id)),
        });
        let segments = [
            (0, 1, 400.0),
            (0, 2, 200.0),
            (2, 3, 400.0),
            (3, 1, 200.0),
            (1, 4, 400.0),
        ];
        let segments = segments.map(|(a, b, length_m)| OracleSegment { a, b, length_m });
        let network = OracleNetwork::new(nodes.to_vec(), segments.to_vec());
        let topology = Arc::new(topology_with_pads(&network, limits_mps));
        let airspace = open_airspace(&topology);
        Self { topology, airspace }
    }

    fn node(&self, letter: &str) -> NodeIx {
        self.topology.node(letter).expect("a letter of the map")
    }

    fn closing_node(mut self, letter: &str) -> Self {
        let nodes = vec![self.node(letter)];
        let reason = "test".to_owned();
        let closure = Closure::of_operator("by hand".to_owned(), reason, nodes, Vec::new());
        let change = Change::Put(Arc::new(closure));
        self.airspace = self.airspace.apply(&[change], self.airspace.as_of());
        self
    }

    fn compose(&self, source: &str, destination: &str) -> Option<Composition> {
        let tables = TreeCache::new(1 << 20);
        let world = World {
            airspace: &self.airspace,
            trees: Some(&tables),
        };
        let (source, destination) = (self.node(source), self.node(destination));
        let mut scratch = Scratch::new(&self.topology);
        compose(&world, source, destination, AIRSPEED_MPS, &mut scratch)
    }

    fn with_contingencies(
        &self,
        letters: &str,
        first_stretch_m: f64,
        destination: &str,
    ) -> Composition {
        let world = World {
            airspace: &self.airspace,
            trees: None,
        };
        let destination = self.node(destination);
        let mut scratch = Scratch::new(&self.topology);
        let way = self.way(letters);
        with_contingencies(
            &world,
            way,
            first_stretch_m,
            destination,
            AIRSPEED_MPS,
            &mut scratch,
        )
    }

    fn way(&self, letters: &str) -> Path {
        let nodes: Vec<NodeIx> = letters
            .chars()
            .map(|letter| self.node(&letter.to_string()))
            .collect();
        let between = |ends: &[NodeIx]| self.topology.segment_between(ends[0], ends[1]);
        let segments = nodes
            .windows(2)
            .map(|ends| between(ends).expect("a line of the map"));
        Path {
            segments: segments.collect(),
            nodes,
        }
    }

    fn letters(&self, nodes: &[NodeIx]) -> String {
        nodes
            .iter()
            .map(|&node| self.topology.node_id(node))
            .collect()
    }

    fn safe_letters(&self, safe: Option<&Alternate>) -> Option<(String, f64)> {
        let safe = safe?;
        assert_eq!(safe.nodes.last(), Some(&safe.node));
        Some((self.letters(&safe.nodes), safe.length_m))
    }
}

#[test]
fn a_detour_is_told_until_it_meets_the_plan_again() {
    let map = Map::with_pads("");
    let plan = map.compose("A", "E").expect("a way");
    assert_eq!(map.letters(&plan.way.nodes), "ABE");
    assert_eq!((plan.length_m, plan.flight_time_s), (800.0, 50.0));
    let times: Vec<(f64, f64)> = plan
        .legs
        .iter()
        .map(|leg| (leg.departure_s, leg.arrival_s))
        .collect();
    assert_eq!(times, [(0.0, 25.0), (25.0, 50.0)]);

    let first = plan.legs[0].if_closed.as_ref().expect("worked out");
    assert_eq!(first.outcome, Outcome::Rerouted);
    assert_eq!(map.letters(&first.nodes), "ACDB");
    assert_eq!(first.rejoins, Some(map.node("B")));
    assert_eq!(
        (first.remaining_length_m, first.extra_m),
        (Some(1_200.0), Some(400.0))
    );

    let last = plan.legs[1].if_closed.as_ref().expect("worked out");
    assert_eq!(last.outcome, Outcome::NoRoute);
    assert_eq!((last.nodes.as_slice(), last.rejoins), ([].as_slice(), None));
    assert_eq!((last.remaining_length_m, last.extra_m), (None, None));
    assert_eq!(plan.legs[1].safe, None);
}

#[test]
fn a_destination_cut_off_leads_to_the_nearest_alternate() {
    let map = Map::with_pads("AD");
    let plan = map.compose("A", "E").expect("a way");
    let last = plan.legs[1].if_closed.as_ref().expect("worked out");
    assert_eq!(last.outcome, Outcome::Diverted);
    assert_eq!(map.letters(&last.nodes), "BD");
    assert_eq!((last.remaining_length_m, last.extra_m), (Some(200.0), None));
    assert_eq!(last.rejoins, None);
}

#[test]
fn the_way_to_an_alternate_begins_at_the_start_of_the_leg() {
    let first_safe = |pads| {
        let map = Map::with_pads(pads);
        let plan = map.compose("A", "E").expect("a way");
        map.safe_letters(plan.legs[0].safe.as_ref())
    };
    assert_eq!(first_safe("AB"), Some(("A".to_owned(), 0.0)));
    assert_eq!(first_safe("B"), Some(("AB".to_owned(), 400.0)));
    assert_eq!(first_safe("BC"), Some(("AC".to_owned(), 200.0)));
    assert_eq!(first_safe("E"), Some(("ABE".to_owned(), 800.0)));
    assert_eq!(first_safe(""), None);
}

#[test]
fn a_recomposed_way_is_equipped_after_its_first_stretch() {
    let map = Map::with_pads("");
    let plan = map.with_contingencies("ACDBE", 160.0, "E");
    assert_eq!((plan.length_m, plan.flight_time_s), (1_360.0, 85.0));
    assert_eq!(
        (plan.legs[0].departure_s, plan.legs[0].arrival_s),
        (10.0, 22.5)
    );
    // The way around is the longer one: its own detour is the leg it was to avoid, if that has opened.
    let first = plan.legs[0].if_closed.as_ref().expect("worked out");
    assert_eq!(map.letters(&first.nodes), "AB");
    assert_eq!(
        (first.rejoins, first.extra_m),
        (Some(map.node("B")), Some(-400.0))
    );
    let occupied = plan.occupations(1_000.0);
    assert_eq!((occupied[1].leg, occupied[1].from), (1, map.node("C")));
    assert_eq!(
        (occupied[1].enters_s, occupied[1].leaves_s),
        (1_022.5, 1_047.5)
    );
}

#[test]
fn a_way_that_does_not_end_at_the_destination_is_not_rejoined() {
    let map = Map::with_pads("B");
    let first = map
        .with_contingencies("AB", 0.0, "E")
        .legs
        .remove(0)
        .if_closed
        .expect("worked out");
    assert_eq!(first.outcome, Outcome::Rerouted);
    assert_eq!(map.letters(&first.nodes), "ACDBE");
    assert_eq!((first.rejoins, first.extra_m), (None, None));
    assert_eq!(first.remaining_length_m, Some(1_200.0));
}

#[test]
fn a_way_that_comes_to_a_leg_twice_rejoins_after_the_last_time() {
    let map = Map::with_pads("");
    let first = map
        .with_contingencies("ABABE", 0.0, "E")
        .legs
        .remove(0)
        .if_closed
        .expect("worked out");
    assert_eq!(map.letters(&first.nodes), "ACDB");
    assert_eq!(
        (first.remaining_length_m, first.extra_m),
        (Some(1_200.0), Some(-400.0))
    );
}

#[test]
fn speed_limits_slow_a_leg_and_nothing_speeds_it_up() {
    let map = Map::new("", &[(0, 10.0), (4, 100.0)]);
    let plan = map.compose("A", "E").expect("a way");
    assert_eq!(plan.flight_time_s, 40.0 + 25.0);
    let again_s = flight_time_s(&map.topology, &plan.way, 160.0, AIRSPEED_MPS);
    assert_eq!(again_s, 10.0 + 40.0 + 25.0);
}

#[test]
fn a_delivery_to_where_it_starts_has_no_legs() {
    let plan = Map::with_pads("")
        .compose("A", "A")
        .expect("nothing to fly");
    assert!(plan.legs.is_empty() && plan.way.segments.is_empty());
    assert_eq!(
        (plan.way.nodes.len(), plan.length_m, plan.flight_time_s),
        (1, 0.0, 0.0)
    );
    assert!(plan.occupations(5.0).is_empty());
}

#[test]
fn nothing_leads_to_a_closed_destination() {
    let map = Map::with_pads("A").closing_node("E");
    assert_eq!(map.compose("A", "E"), None);
}
