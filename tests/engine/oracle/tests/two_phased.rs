//! The two-phased strategy by hand: A (0, 0), B (100, 0), val = 50; rhombus: |s - 50| + |t| <= 50.

use super::*;

/// The two-phased strategy as it is by default.
fn by_phases(world: &World) -> LocalAnswer {
    let network = world.network;
    two_phased(world, at(network, "A"), at(network, "B"), 0.5, true)
}

fn stages(answer: &LocalAnswer) -> Vec<(&'static str, bool)> {
    answer
        .stages
        .iter()
        .map(|record: &StageRecord| (record.stage, record.searched))
        .collect()
}

fn along_ab(others: &[(&str, f64, f64)], segments: &[(&str, &str)]) -> OracleNetwork {
    let nodes = [&[("A", 0.0, 0.0), ("B", 100.0, 0.0)], others].concat();
    network(&nodes, &[&[("A", "B")], segments].concat())
}

#[test]
fn two_phased_takes_the_left_half_on_a_tie() {
    // T is 20 to the left, U 20 to the right: halves of 3 nodes each, so the triangle holds A, B,
    // T.
    let others = [("T", 50.0, 20.0), ("U", 50.0, -20.0)];
    let network = along_ab(&others, &[("A", "T"), ("T", "B"), ("A", "U"), ("U", "B")]);
    let answer = by_phases(&world(&network, &[]));
    assert_eq!((answer.stage, answer.searches), ("triangle", 1));
    assert_eq!(answer.area, all(&network, &["A", "B", "T"]));
    // T closed: the right half has more nodes.
    let answer = by_phases(&world(&network, &["T"]));
    assert_eq!(
        (answer.stage, answer.area),
        ("triangle", all(&network, &["A", "B", "U"]))
    );
    // The way over U alone: the triangle with T fails, the rhombus of 4 nodes has it.
    let network = along_ab(&others, &[("A", "U"), ("U", "B")]);
    let answer = by_phases(&world(&network, &[]));
    assert_eq!(
        (answer.stage, answer.searches, answer.area.len()),
        ("rhombus", 2, 4)
    );
    // Seen from B the left is where U is.
    let answer = two_phased(&world(&network, &[]), 1, 0, 0.5, true);
    assert_eq!(
        (answer.stage, answer.area),
        ("triangle", all(&network, &["A", "B", "U"]))
    );
}

#[test]
fn two_phased_knows_a_vertical_line() {
    // v = (0, 100): t of (-20, 50) is (0 x 50 - 100 x (-20)) / 100 = 20, the left.
    let nodes = [
        ("A", 0.0, 0.0),
        ("B", 0.0, 100.0),
        ("T", -20.0, 50.0),
        ("U", 20.0, 50.0),
        ("W", 51.0, 50.0),
    ];
    let network = network(&nodes, &[("A", "B"), ("A", "T"), ("T", "B")]);
    let answer = by_phases(&world(&network, &[]));
    assert_eq!(
        (answer.stage, answer.area),
        ("triangle", all(&network, &["A", "B", "T"]))
    );
    // A ratio of 0.1 makes the rectangle 20 wide, which leaves T out; both ends grow over the 2
    // nodes: N = 5.
    let answer = two_phased(&world(&network, &[]), 0, 1, 0.1, true);
    assert_eq!(answer.stages[2].nodes, all(&network, &["A", "B"]));
    assert_eq!((answer.stage, answer.searches), ("global", 4));
}

#[test]
fn two_phased_searches_the_rectangle_corners_last() {
    // R: |5 - 50| + 45 = 90 > 50 is outside the rhombus. Triangle and rhombus are {A, B}: 4 x 2 >=
    // 3, 2 x 2 >= 3.
    let network = along_ab(&[("R", 5.0, 45.0)], &[("A", "R"), ("R", "B")]);
    let answer = by_phases(&world(&network, &[]));
    assert_eq!(
        stages(&answer),
        [("triangle", true), ("rhombus", true), ("rectangle", true)]
    );
    assert_eq!(
        (answer.stage, answer.searches, answer.area.len()),
        ("rectangle", 3, 3)
    );
    // (0, 50) is a corner of the rectangle, the boundary included; (0, 50.1) is not.
    let network = along_ab(
        &[("R", 0.0, 50.0), ("S", 0.0, 50.1)],
        &[("A", "R"), ("R", "B")],
    );
    assert_eq!(
        by_phases(&world(&network, &[])).area,
        all(&network, &["A", "B", "R"])
    );
}

#[test]
fn two_phased_skips_stages_below_their_share_only() {
    // All others in the corners, |s - 50| + |t| >= 85: triangle and rhombus are {A, B}.
    let corners = [
        ("R", 5.0, 45.0),
        ("c2", 95.0, 45.0),
        ("c3", 5.0, -45.0),
        ("c4", 95.0, -45.0),
        ("c5", 5.0, 40.0),
        ("c6", 95.0, 40.0),
        ("c7", 5.0, -40.0),
    ];
    let ways = [("A", "R"), ("R", "B")];
    // Rectangle of 9: 4 x 2 < 9 and 2 x 2 < 9, both are skipped.
    let network = along_ab(&corners, &ways);
    let answer = by_phases(&world(&network, &[]));
    assert_eq!(
        stages(&answer),
        [("triangle", false), ("rhombus", false), ("rectangle", true)]
    );
    assert_eq!((answer.stages[0].skipped, answer.searches), (true, 1));
    assert_eq!(
        two_phased(&world(&network, &[]), 0, 1, 0.5, false).searches,
        3
    );
    // Rectangle of 8: 4 x 2 = 8 is not fewer, the triangle is searched; closed c7 is not counted.
    let answer = by_phases(&world(&network, &["c7"]));
    assert_eq!(
        stages(&answer),
        [("triangle", true), ("rhombus", false), ("rectangle", true)]
    );
    // Rectangle of 4: 2 x 2 = 4 is not fewer, the rhombus is searched.
    let answer = by_phases(&world(&network, &["c3", "c4", "c5", "c6", "c7"]));
    assert_eq!(
        stages(&answer),
        [("triangle", true), ("rhombus", true), ("rectangle", true)]
    );
}

/// Nodes far off that only count towards N.
const FAR: [(&str, f64, f64); 5] = [
    ("f1", 500.0, 0.0),
    ("f2", 510.0, 0.0),
    ("f3", 520.0, 0.0),
    ("f4", 530.0, 0.0),
    ("f5", 540.0, 0.0),
];

#[test]
fn two_phased_grows_and_goes_global_at_half_the_nodes() {
    // P is out of the rectangle; round 1 adds it from A and from B: 3 nodes of N = 8, 2 x 3 < 8,
    // searched.
    let ways = [("A", "P"), ("P", "B")];
    let network = along_ab(&[&[("P", 50.0, 80.0)], &FAR[..]].concat(), &ways);
    let answer = by_phases(&world(&network, &[]));
    assert_eq!(
        (answer.stage, answer.searches, answer.area.len()),
        ("grown", 4, 3)
    );
    // N = 6 with three far nodes: 2 x 3 >= 6, global at once.
    let answer = by_phases(&world(&network, &["f1", "f2"]));
    assert_eq!(
        (answer.stage, answer.searches, answer.area.len()),
        ("global", 4, 6)
    );
    // P closed: nothing to add, global, no path.
    let answer = by_phases(&world(&network, &["P"]));
    assert_eq!(
        (answer.path, answer.stage, answer.searches),
        (None, "global", 4)
    );
    // A closed A grows too, also where nothing else does: with P-B closed, A alone adds P.
    let mut closed = world(&network, &["A"]);
    closed
        .closed_segments
        .extend(network.segments_between(1, at(&network, "P")));
    let grown = &by_phases(&closed).stages[3];
    assert_eq!(
        (grown.stage, &grown.nodes),
        ("grown", &all(&network, &["A", "B", "P"]))
    );
    let answer = by_phases(&world(&network, &["A"]));
    assert_eq!(
        (answer.stage, answer.searches, answer.area_segments),
        ("grown", 4, 2)
    );
}

#[test]
fn two_phased_grows_by_length_then_node_order_from_the_area_at_the_start() {
    // From A: 9 and 10 are equally far (100), 9 comes first by number; 9's own neighbour 11, much
    // nearer, is not added in the same round. Ids are numbers throughout: A is 1, B is 2.
    let nodes = [
        ("1", 0.0, 0.0),
        ("2", 100.0, 0.0),
        ("10", 0.0, 100.0),
        ("9", 0.0, -100.0),
        ("11", 0.0, -101.0),
        ("21", 500.0, 0.0),
        ("22", 510.0, 0.0),
        ("23", 520.0, 0.0),
        ("24", 530.0, 0.0),
        ("25", 540.0, 0.0),
        ("26", 550.0, 0.0),
        ("27", 560.0, 0.0),
    ];
    let network = network(
        &nodes,
        &[
            ("1", "10"),
            ("1", "9"),
            ("9", "11"),
            ("11", "2"),
            ("10", "2"),
        ],
    );
    // B grows as well: its nearest is 10 (sqrt 2 x 100), before 11 (142.1): after round 1 {1, 2, 9,
    // 10}, 8 < 12, and over 10 there is a way of 100 + 141.421.
    let world = World::open(&network);
    let answer = two_phased(&world, 0, 1, 0.5, true);
    assert_eq!((answer.stage, answer.searches), ("grown", 4));
    assert_eq!(answer.area, all(&network, &["1", "2", "9", "10"]));
    assert_length(answer.length_m, 241.421);
    // Without 10-2, B adds 11: the area of round 1 is {1, 2, 9, 11}; 10 is left for a next round.
    let mut closed = World::open(&network);
    closed.closed_segments.insert(4);
    let answer = two_phased(&closed, 0, 1, 0.5, true);
    assert_eq!(answer.area, all(&network, &["1", "2", "9", "11"]));
    // Without 11-2 either: round 1 {1, 2, 9}, 6 < 12, searched; round 2 adds 11 from 9 and 10, the
    // nearest that is left, from 1: {1, 2, 9, 10, 11}, 10 < 12, searched; round 3 adds nothing:
    // global.
    closed.closed_segments.insert(3);
    let answer = two_phased(&closed, 0, 1, 0.5, true);
    assert_eq!(answer.stages[3].nodes, all(&network, &["1", "2", "9"]));
    assert_eq!(
        answer.stages[4].nodes,
        all(&network, &["1", "2", "9", "10", "11"])
    );
    assert_eq!(
        (answer.path, answer.stage, answer.searches),
        (None, "global", 6)
    );
}

#[test]
fn two_phased_does_not_pass_over_a_neighbour_added_in_the_same_round() {
    // P is the nearest of both ends: A adds it, and B does not go on to Q, which is farther,
    // because P was outside at the start of the round.
    let others = [&[("P", 50.0, 80.0), ("Q", 100.0, 200.0)], &FAR[..]].concat();
    let network = along_ab(&others, &[("A", "P"), ("P", "B"), ("B", "Q")]);
    let answer = by_phases(&world(&network, &[]));
    assert_eq!(
        (answer.stage, answer.area),
        ("grown", all(&network, &["A", "B", "P"]))
    );
}
