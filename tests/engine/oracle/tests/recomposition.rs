//! The whole recomposition by hand: runs of closed legs, fallbacks, and what is reported.

use super::*;

/// A report on A -> B with D as the destination; nodes and segments that were closed before.
fn report<'a>(network: &'a OracleNetwork, nodes: &[&str], segments: &[(&str, &str)]) -> Report<'a> {
    let between = |&(a, b): &(&str, &str)| network.segments_between(at(network, a), at(network, b));
    Report {
        network,
        standing_closed_nodes: all(network, nodes),
        standing_closed_segments: segments.iter().flat_map(between).collect(),
        failed: (at(network, "A"), at(network, "B")),
        destination: at(network, "D"),
    }
}

fn pairs(answer: &OracleAnswer) -> Vec<(usize, usize, bool)> {
    let tried = |repair: &Repair| (repair.from, repair.to, repair.answer.path.is_some());
    answer.repairs.iter().map(tried).collect()
}

/// A, B, C, D along x, 100 m apart (indices 0 to 3), and other nodes.
fn plan_along_x(others: &[(&str, f64, f64)], ways: &[(&str, &str)]) -> OracleNetwork {
    let nodes = [
        &[
            ("A", 0.0, 0.0),
            ("B", 100.0, 0.0),
            ("C", 200.0, 0.0),
            ("D", 300.0, 0.0),
        ],
        others,
    ]
    .concat();
    network(
        &nodes,
        &[&[("A", "B"), ("B", "C"), ("C", "D")], ways].concat(),
    )
}

#[test]
fn one_leg_is_repaired_and_the_old_plan_kept() {
    // A - E - B is 2 x 55.902 = 111.803; then B - C - D, 200. A - E - D is shorter, which only the
    // exact answer takes. Circle about (50, 0), r = 100: A, B, E.
    let network = plan_along_x(&[("E", 50.0, 25.0)], &[("A", "E"), ("E", "B"), ("D", "E")]);
    let report = report(&network, &[], &[]);
    assert_eq!(old_plan(&report), Some(vec![0, 1, 2, 3]));
    let answer = recompose(&report, None, Strategy::Radius);
    assert_eq!(answer.path, path(&network, &["A", "E", "B", "C", "D"]));
    assert_length(answer.recomposed_length_m, 111.803);
    assert_length(answer.remaining_length_m, 311.803);
    assert_length(answer.local_optimum_m, 111.803);
    // 55.902 + sqrt(250^2 + 25^2) = 55.902 + 251.247.
    assert_length(answer.global_optimum_m, 307.149);
    assert_eq!(
        (answer.stage, answer.searches, answer.area_segments),
        ("circle", 1, 2)
    );
    assert_eq!(
        (answer.area, answer.fallback),
        (all(&network, &["A", "B", "E"]), None)
    );

    let exact = recompose(&report, None, Strategy::Exact);
    assert_eq!(exact.path, path(&network, &["A", "E", "D"]));
    assert_length(exact.recomposed_length_m, 307.149);
    // Open are B-C, C-D, A-E, E-B and E-D.
    assert_eq!(
        (
            exact.stage,
            exact.searches,
            exact.area.len(),
            exact.area_segments
        ),
        ("global", 1, 5, 5)
    );
}

#[test]
fn a_closed_run_is_repaired_from_its_first_to_its_last_node() {
    // The plan came before B-C closed: legs 1 and 2 are one run, A -> C. Circle about (100, 0), r =
    // 200: everything but D lies at most 100 off, D exactly 200.
    let network = plan_along_x(&[("E", 100.0, 50.0)], &[("A", "E"), ("E", "C"), ("E", "B")]);
    let report = report(&network, &[], &[("B", "C")]);
    let answer = recompose_plan(&report, &[0, 1, 2, 3], Strategy::Radius);
    assert_eq!(pairs(&answer), [(0, 2, true)]);
    assert_eq!(answer.path, path(&network, &["A", "E", "C", "D"]));
    assert_eq!((answer.searches, answer.area.len()), (1, 5));
    // 2 sqrt(100^2 + 50^2) = 223.607, and C - D.
    assert_length(answer.recomposed_length_m, 223.607);
    assert_length(answer.remaining_length_m, 323.607);
    // Without a plan given, the old one is the shortest over what was open: A, B, E, C, D.
    assert_eq!(
        old_plan(&report),
        path(&network, &["A", "B", "E", "C", "D"])
    );
    // A closed B makes the same run.
    let mut closed_node = report.clone();
    closed_node.standing_closed_segments.clear();
    closed_node.standing_closed_nodes.insert(1);
    let answer = recompose(&closed_node, Some(vec![0, 1, 2, 3]), Strategy::Radius);
    assert_eq!((pairs(&answer), answer.area.len()), (vec![(0, 2, true)], 4));
}

#[test]
fn a_closed_start_is_left_by_its_own_segments() {
    // A is closed, and so is X; A - X - B is no way, A - E - B is. Open within {A, B, E}: A-E and
    // E-B.
    let network = plan_along_x(
        &[("E", 50.0, 40.0), ("X", 50.0, 10.0)],
        &[("A", "E"), ("E", "B"), ("A", "X"), ("X", "B")],
    );
    let report = report(&network, &["A", "X"], &[]);
    let by_phases = Strategy::TwoPhased {
        val_ratio: 0.5,
        stage_skipping: true,
    };
    let answer = recompose(&report, None, by_phases);
    assert_eq!(answer.path, path(&network, &["A", "E", "B", "C", "D"]));
    assert_eq!(
        (answer.stage, answer.searches, answer.area_segments),
        ("triangle", 1, 2)
    );
    assert_eq!(answer.area, all(&network, &["A", "B", "E"]));
}

#[test]
fn two_runs_are_two_repairs() {
    // A - E - B and C - F - D. The circles about (50, 0) and (250, 0), r = 100, hold A, B, E and C,
    // D, F: C and B lie 150 off the other's centre.
    let network = plan_along_x(
        &[("E", 50.0, 25.0), ("F", 250.0, 25.0)],
        &[("A", "E"), ("E", "B"), ("C", "F"), ("F", "D")],
    );
    let report = report(&network, &[], &[("C", "D")]);
    let answer = recompose_plan(&report, &[0, 1, 2, 3], Strategy::Radius);
    assert_eq!(pairs(&answer), [(0, 1, true), (2, 3, true)]);
    assert_eq!(answer.path, path(&network, &["A", "E", "B", "C", "F", "D"]));
    // The union holds all 6 nodes and, besides the repairs' 4 segments, the open B-C between their
    // areas.
    assert_eq!(
        (answer.searches, answer.area.len(), answer.area_segments),
        (2, 6, 5)
    );
    assert_length(answer.recomposed_length_m, 223.607);
    assert_length(answer.remaining_length_m, 323.607);
}

#[test]
fn a_failed_repair_goes_on_to_the_next_open_node() {
    // B and C are an island once A-B and C-D are closed; A - E - D is left. Size 300. A -> B: r =
    // 100 without E (141 off), 160 > 150: global, 2 searches. A -> C: r = 200, 260 > 150: global, 2
    // searches. A -> D: r = 300, found, 1 search. 2 sqrt(150^2 + 100^2) = 360.555.
    let network = plan_along_x(&[("E", 150.0, 100.0)], &[("A", "E"), ("E", "D")]);
    let report = report(&network, &[], &[("C", "D")]);
    let answer = recompose_plan(&report, &[0, 1, 2, 3], Strategy::Radius);
    assert_eq!(pairs(&answer), [(0, 1, false), (0, 2, false), (0, 3, true)]);
    assert_eq!(answer.path, path(&network, &["A", "E", "D"]));
    assert_eq!(
        (answer.strategy_used, answer.fallback),
        (Strategy::Radius, None)
    );
    assert_eq!(
        (answer.stage, answer.searches, answer.area.len()),
        ("circle", 5, 5)
    );
    assert_length(answer.remaining_length_m, 360.555);
    // With C closed too it is not tried, and no area counts it.
    let mut closed = report.clone();
    closed.standing_closed_nodes.insert(2);
    let answer = recompose(&closed, Some(vec![0, 1, 2, 3]), Strategy::Radius);
    assert_eq!(pairs(&answer), [(0, 3, true)]);
}

#[test]
fn without_any_path_the_figures_are_those_of_the_attempts() {
    // Only the plan itself: A is cut off. A -> B, A -> C: 2 searches each; A -> D: r = 300 > 150
    // already, searched all the same, then 360: global, 2 searches.
    let network = plan_along_x(&[], &[]);
    let answer = recompose(&report(&network, &[], &[]), None, Strategy::Radius);
    assert_eq!(
        (answer.path.as_ref(), answer.remaining_length_m),
        (None, None)
    );
    assert_eq!(
        pairs(&answer),
        [(0, 1, false), (0, 2, false), (0, 3, false)]
    );
    assert_eq!(
        (answer.strategy_used, answer.fallback),
        (Strategy::Radius, Some(Fallback::NoRepair))
    );
    assert_eq!(
        (
            answer.stage,
            answer.searches,
            answer.area.len(),
            answer.area_segments
        ),
        ("global", 6, 4, 2)
    );
    let exact = recompose(&report(&network, &[], &[]), None, Strategy::Exact);
    assert_eq!(
        (exact.path, exact.searches, exact.area_segments),
        (None, 1, 2)
    );
}

#[test]
fn ends_in_one_place_are_answered_exactly() {
    // B lies where A is, and 5 m are stated between them.
    let nodes = [
        ("A", 0.0, 0.0),
        ("B", 0.0, 0.0),
        ("D", 300.0, 0.0),
        ("E", 150.0, 50.0),
    ];
    let mut network = network(&nodes, &[("A", "B"), ("B", "D"), ("A", "E"), ("E", "D")]);
    network.segments[0].length_m = 5.0;
    let answer = recompose(
        &report(&network, &[], &[]),
        None,
        Strategy::CellDensity {
            cell_m: None,
            slices: false,
        },
    );
    assert_eq!(
        (answer.strategy_used, answer.fallback),
        (Strategy::Exact, Some(Fallback::EndsCoincide))
    );
    assert_eq!(answer.path, path(&network, &["A", "E", "D"]));
    assert_eq!(
        (answer.stage, answer.searches, answer.repairs.len()),
        ("global", 1, 0)
    );
    // A baseline lays out no area: A - E - D - B is its repair.
    let answer = recompose(&report(&network, &[], &[]), None, Strategy::LocalBaseline);
    assert_eq!(answer.path, path(&network, &["A", "E", "D", "B", "D"]));
    assert_eq!(
        (answer.stage, answer.searches, answer.area.len()),
        ("local", 1, 4)
    );
    let world = report(&network, &[], &[]).world_now();
    assert_eq!(answer.repairs[0].answer, local_baseline(&world, 0, 1));
}

#[test]
fn a_network_without_size_is_answered_exactly() {
    let nodes = [("A", 7.0, 7.0), ("B", 7.0, 7.0), ("D", 7.0, 7.0)];
    let mut network = network(&nodes, &[("A", "B"), ("B", "D"), ("A", "D")]);
    for segment in &mut network.segments {
        segment.length_m = 5.0;
    }
    let answer = recompose(&report(&network, &[], &[]), None, Strategy::Radius);
    assert_eq!(
        (answer.fallback, answer.path),
        (Some(Fallback::NetworkHasNoSize), Some(vec![0, 2]))
    );
}

#[test]
fn an_exact_answer_after_failed_attempts_counts_them() {
    // The leg was closed before, B leads nowhere, so that the plan ends at B: A -> B fails (r = 100
    // and global, 300 of size), and the exact answer A - D is one search more.
    let nodes = [("A", 0.0, 0.0), ("B", 100.0, 0.0), ("D", 300.0, 0.0)];
    let network = network(&nodes, &[("A", "B"), ("A", "D")]);
    let report = report(&network, &[], &[("A", "B")]);
    assert_eq!(old_plan(&report), None);
    let answer = recompose(&report, None, Strategy::Radius);
    assert_eq!(
        (answer.strategy_used, answer.fallback),
        (Strategy::Exact, Some(Fallback::NoRepair))
    );
    assert_eq!(
        (answer.path, answer.stage, answer.searches),
        (Some(vec![0, 2]), "global", 3)
    );
    assert_eq!((answer.area.len(), answer.area_segments), (3, 1));
}

#[test]
fn a_repaired_plan_that_ends_early_is_left_for_the_exact_one() {
    // The repair A - E - B goes well within its circle, yet C is no destination: its search counts,
    // 1 + 1.
    let network = plan_along_x(&[("E", 50.0, 25.0)], &[("A", "E"), ("E", "B")]);
    let report = report(&network, &[], &[]);
    let answer = recompose(&report, Some(vec![0, 1, 2]), Strategy::Radius);
    assert_eq!((answer.searches, pairs(&answer)), (2, vec![(0, 1, true)]));
    assert_eq!(
        (answer.strategy_used, answer.fallback),
        (Strategy::Exact, Some(Fallback::PlanEndsEarly))
    );
    assert_eq!(answer.path, path(&network, &["A", "E", "B", "C", "D"]));
}

#[test]
fn a_closed_node_further_on_is_not_tried() {
    // A, B, C, X, D with X closed: legs A-B and C-X-D are closed, B and C are an island. B and C
    // are tried, X is not, D is reached over E.
    let network = plan_along_x(
        &[("E", 150.0, 100.0), ("X", 250.0, 0.0)],
        &[("C", "X"), ("X", "D"), ("A", "E"), ("E", "D")],
    );
    let report = report(&network, &["X"], &[("C", "D")]);
    let answer = recompose_plan(&report, &[0, 1, 2, 5, 3], Strategy::Radius);
    assert_eq!(pairs(&answer), [(0, 1, false), (0, 2, false), (0, 3, true)]);
}

#[test]
fn the_first_node_of_a_plan_need_not_be_open() {
    // A plan that does not fly the failed leg, from a closed A: there is nothing to repair.
    let network = plan_along_x(&[("E", 150.0, 100.0)], &[("A", "E"), ("E", "D")]);
    let answer = recompose_plan(&report(&network, &["A"], &[]), &[0, 4, 3], Strategy::Radius);
    assert_eq!(
        (answer.path, answer.repairs.len()),
        (Some(vec![0, 4, 3]), 0)
    );
}

#[test]
fn ends_in_one_place_further_on_leave_the_figures_of_the_exact_answer_alone() {
    // A - B is repaired over E; C and D lie in one place and C-D was closed before: all of it is
    // answered exactly, the repair that went well is dropped. 1 search over all 6 nodes and the open
    // A-E, E-B, B-C, C-F and F-D: 2 x 55.902 + 100 + 2 x 50 = 311.803, all of it new.
    let nodes = [
        ("A", 0.0, 0.0),
        ("B", 100.0, 0.0),
        ("C", 200.0, 0.0),
        ("D", 200.0, 0.0),
    ];
    let nodes = [&nodes[..], &[("E", 50.0, 25.0), ("F", 250.0, 0.0)]].concat();
    let ways = [
        ("A", "B"),
        ("B", "C"),
        ("A", "E"),
        ("E", "B"),
        ("C", "F"),
        ("F", "D"),
    ];
    let network = network(&nodes, &[&ways[..], &[("C", "D")]].concat());
    let report = report(&network, &[], &[("C", "D")]);
    let answer = recompose_plan(&report, &[0, 1, 2, 3], Strategy::Radius);
    assert_eq!(answer.path, path(&network, &["A", "E", "B", "C", "F", "D"]));
    assert_eq!(answer.fallback, Some(Fallback::EndsCoincide));
    assert_eq!(
        (answer.strategy_used, answer.stage),
        (Strategy::Exact, "global")
    );
    assert_eq!((answer.searches, pairs(&answer)), (1, vec![]));
    assert_eq!((answer.area.len(), answer.area_segments), (6, 5));
    assert_length(answer.recomposed_length_m, 311.803);
    assert_length(answer.remaining_length_m, 311.803);
}
