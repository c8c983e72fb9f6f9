//! The radius-based strategy by hand.

use super::*;

/// The bypass of A-B over C, C at a height of `c_y`; Z sets the network size to 1000.
fn under_c(c_y: f64) -> OracleNetwork {
    network(
        &[
            ("A", 0.0, 0.0),
            ("B", 100.0, 0.0),
            ("C", 50.0, c_y),
            ("Z", 1000.0, 0.0),
        ],
        &[("A", "B"), ("A", "C"), ("C", "B")],
    )
}

#[test]
fn radius_finds_the_way_in_the_first_circle() {
    // Circle about (50, 0), r = 100: C is 50 off, Z 950. Length 2 sqrt(50^2 + 50^2) = 141.421.
    let network = under_c(50.0);
    let answer = radius(&world(&network, &[]), 0, 1);
    assert_eq!(answer.path, path(&network, &["A", "C", "B"]));
    assert_length(answer.length_m, 141.421);
    assert_eq!(
        (answer.stage, answer.searches, answer.area_segments),
        ("circle", 1, 2)
    );
    assert_eq!(answer.area, all(&network, &["A", "B", "C"]));
}

#[test]
fn radius_grows_by_a_fifth_of_the_size_and_the_boundary_is_inside() {
    // r = 100, then 100 + 0.2 x 1000 = 300 <= 500; C is exactly 300 off.
    let network = under_c(300.0);
    let answer = radius(&world(&network, &[]), 0, 1);
    assert_eq!((answer.stage, answer.searches), ("circle", 2));
    assert_eq!(answer.area, all(&network, &["A", "B", "C"]));
}

#[test]
fn radius_goes_global_above_half_the_size_only() {
    // r = 100, 300, 500 (not above 500, searched), 700: global. C is 600 off.
    let network = under_c(600.0);
    let answer = radius(&world(&network, &[]), 0, 1);
    assert_eq!((answer.stage, answer.searches), ("global", 4));
    assert_eq!(answer.area.len(), 4);
    // With C closed there is no path, N = 3 and no open segment is left.
    let answer = radius(&world(&network, &["C"]), 0, 1);
    assert_eq!(
        (answer.path, answer.stage, answer.searches),
        (None, "global", 4)
    );
    assert_eq!(
        (answer.area, answer.area_segments),
        (all(&network, &["A", "B", "Z"]), 0)
    );
}

#[test]
fn a_closed_start_is_left_and_a_closed_end_is_not_entered() {
    let network = under_c(50.0);
    let answer = radius(&world(&network, &["A"]), 0, 1);
    assert_eq!(answer.path, path(&network, &["A", "C", "B"]));
    assert_eq!(answer.area_segments, 2);
    let answer = radius(&world(&network, &["B"]), 0, 1);
    assert_eq!((answer.path, answer.stage), (None, "global"));
    // N counts the closed B; of the open segments A-C is left.
    assert_eq!((answer.area.len(), answer.area_segments), (4, 1));
    // From a closed A to a closed C no segment is open.
    let answer = radius(&world(&network, &["A", "C"]), 0, 1);
    assert_eq!((answer.path, answer.area_segments), (None, 0));
}

#[test]
fn inside_reaches_a_millionth_of_a_metre_over_the_boundary() {
    // r = 100 about (50, 0): C at 100 + 5e-7 is inside, at 100 + 2e-6 it is found in the next
    // circle.
    let network = under_c(100.0 + 5e-7);
    assert_eq!(radius(&world(&network, &[]), 0, 1).searches, 1);
    let network = under_c(100.0 + 2e-6);
    assert_eq!(radius(&world(&network, &[]), 0, 1).searches, 2);
}
