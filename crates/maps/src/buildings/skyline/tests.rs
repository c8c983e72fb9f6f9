//! Who sees whom: each rule on hand-made boxes; `reckoning` has all of them at once on random ones.

mod reckoning;

use super::*;
use crate::buildings::Outline;
use crate::geo::LocalPlane;
use crate::network::Seeded;
use std::collections::BTreeSet;

/// A box on the plane, in metres: corner, width and depth, height.
#[derive(Clone, Copy, Debug)]
struct Block {
    x: f64,
    y: f64,
    width_m: f64,
    depth_m: f64,
    height_m: Option<f64>,
}

const fn block(x: f64, y: f64, width_m: f64, depth_m: f64, height_m: f64) -> Block {
    let height_m = Some(height_m);
    Block {
        x,
        y,
        width_m,
        depth_m,
        height_m,
    }
}

/// Two roofs of 20 m, 100 m apart; the flight between them is level at 25 m, along y = 10.
const WEST: Block = block(0.0, 0.0, 20.0, 20.0, 20.0);
const EAST: Block = block(120.0, 0.0, 20.0, 20.0, 20.0);

fn plane() -> LocalPlane {
    LocalPlane::about(151.2, -33.86)
}

fn buildings(blocks: &[Block]) -> Vec<Building> {
    let building = |(index, block): (usize, &Block)| {
        let Block {
            x,
            y,
            width_m,
            depth_m,
            height_m,
        } = *block;
        let corners = [
            (x, y),
            (x + width_m, y),
            (x + width_m, y + depth_m),
            (x, y + depth_m),
            (x, y),
        ];
        let ring = corners
            .map(|(x, y)| plane().unproject(Point::new(x, y)))
            .to_vec();
        Building {
            id: index.to_string(),
            name: Some(index.to_string()),
            outline: Outline::new(&[vec![ring]]).expect("a box is valid"),
            height_m,
            min_height_m: None,
            extract: None,
        }
    };
    blocks.iter().enumerate().map(building).collect()
}

const NO_ZONES: KeepOut<'static> = &|_, _, _| false;

fn build(blocks: &[Block], rules: &LineOfSight) -> Result<Skyline, LineOfSightError> {
    rules.build(&buildings(blocks), NO_ZONES, &mut |_, _| {})
}

/// The joined pairs, as places among the blocks, the lower first.
fn pairs(skyline: &Skyline) -> BTreeSet<(usize, usize)> {
    let place = |id: &str| -> usize {
        let node = skyline
            .network
            .nodes
            .iter()
            .find(|node| node.id == id)
            .expect("a node");
        let name = node.name.as_deref().expect("a name");
        name.parse().expect("the place of the block")
    };
    let ends = |segment: &SegmentDraft| (place(&segment.from), place(&segment.to));
    let sorted = |(from, to): (usize, usize)| (from.min(to), from.max(to));
    skyline
        .network
        .segments
        .iter()
        .map(|segment| sorted(ends(segment)))
        .collect()
}

fn sees(blocks: &[Block], from: usize, to: usize) -> bool {
    match build(blocks, &LineOfSight::default()) {
        Ok(skyline) => pairs(&skyline).contains(&(from, to)),
        Err(LineOfSightError::NoSegments { .. }) => false,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn a_wall_blocks_until_the_flight_passes_over_it_with_clearance() {
    let wall = |height_m| block(60.0, -50.0, 2.0, 100.0, height_m);
    assert!(sees(&[WEST, EAST], 0, 1));
    assert!(
        !sees(&[WEST, EAST, wall(60.0)], 0, 1),
        "higher than the flight"
    );
    assert!(
        !sees(&[WEST, EAST, wall(21.0)], 0, 1),
        "below the flight, but by less than 5 m"
    );
    assert!(
        sees(&[WEST, EAST, wall(20.0)], 0, 1),
        "5 m below the flight"
    );
}

#[test]
fn a_wall_blocks_until_the_flight_passes_beside_it_with_clearance() {
    let wall = |from_y: f64| block(60.0, from_y, 2.0, 50.0, 60.0);
    assert!(
        !sees(&[WEST, EAST, wall(14.9)], 0, 1),
        "4.9 m beside the flight"
    );
    assert!(sees(&[WEST, EAST, wall(15.1)], 0, 1), "5.1 m beside it");
}

#[test]
fn a_sloping_flight_is_measured_where_it_passes_the_building() {
    let high = block(0.0, 0.0, 20.0, 20.0, 80.0);
    // From 85 m at x = 10 to 25 m at x = 130: 55 m at x = 70, 37.5 m at x = 105.
    let wall = |x: f64| block(x, -50.0, 2.0, 100.0, 40.0);
    assert!(sees(&[high, EAST, wall(68.0)], 0, 1), "passes over it");
    assert!(
        !sees(&[high, EAST, wall(105.0)], 0, 1),
        "has come down too far"
    );
}

#[test]
fn an_unknown_height_blocks_up_to_the_ceiling() {
    let high = |x: f64| block(x, 0.0, 20.0, 20.0, 115.0);
    let unknown = Block {
        height_m: None,
        ..block(60.0, -50.0, 2.0, 100.0, 0.0)
    };
    assert!(!sees(&[high(0.0), high(120.0), unknown], 0, 1));
}

#[test]
fn the_roof_itself_never_blocks_but_its_podium_does_where_the_line_cuts_it() {
    let tower = block(0.0, 0.0, 20.0, 20.0, 80.0);
    let low = block(60.0, 0.0, 20.0, 20.0, 20.0);
    // From 85 m at x = 10 to 25 m at x = 70: the line is at 75 m where it leaves the tower of 80 m.
    assert!(sees(&[tower, low], 0, 1), "dives past its own edge");
    let podium = |height_m| block(-10.0, -10.0, 60.0, 40.0, height_m);
    // At 45 m where it leaves the podium, at x = 50.
    assert!(
        sees(&[tower, low, podium(44.0)], 0, 1),
        "passes over its podium without clearance"
    );
    assert!(
        !sees(&[tower, low, podium(46.0)], 0, 1),
        "would cut into its podium"
    );
}

#[test]
fn a_taller_part_of_the_same_building_blocks() {
    // A wide roof of 20 m with a thin tower of 200 m at its eastern end: the node sits on what is
    // left of the roof.
    let roof = block(0.0, 0.0, 60.0, 20.0, 20.0);
    let tower = block(50.0, 0.0, 10.0, 20.0, 200.0);
    let west = block(-100.0, 0.0, 20.0, 20.0, 20.0);
    let east = block(150.0, 0.0, 20.0, 20.0, 20.0);
    assert!(
        sees(&[roof, tower, west, east], 0, 2),
        "away from the tower"
    );
    assert!(!sees(&[roof, tower, west, east], 0, 3), "through the tower");
}

#[test]
fn of_roofs_that_overlap_the_highest_is_the_node() {
    let podium = block(0.0, 0.0, 60.0, 40.0, 20.0);
    let tower = block(10.0, 10.0, 20.0, 20.0, 60.0);
    let other = block(150.0, 0.0, 20.0, 20.0, 60.0);
    let skyline = build(&[podium, tower, other], &LineOfSight::default()).expect("a skyway");
    assert_eq!(pairs(&skyline), BTreeSet::from([(1, 2)]));
    assert_eq!(
        (skyline.report.rooftops, skyline.report.overshadowed),
        (2, 1)
    );

    // A tower too high to land on leaves its podium, and the node keeps off the tower.
    let spire = block(0.0, 0.0, 30.0, 40.0, 200.0);
    let skyline = build(&[podium, spire, other], &LineOfSight::default()).expect("a skyway");
    assert_eq!(pairs(&skyline), BTreeSet::from([(0, 2)]));
    let node = &skyline.network.nodes[0];
    let position = plane().project(node.position[0], node.position[1]);
    assert!((position.x - 45.0).abs() < 0.1, "{position:?}");
    assert_eq!(node.pads, 3, "of the 1,200 m² that are left of 2,400");
}

#[test]
fn walls_that_touch_do_not_make_one_building() {
    let neighbour = block(20.0, 0.0, 20.0, 20.0, 20.0);
    let skyline = build(&[WEST, neighbour, EAST], &LineOfSight::default()).expect("a skyway");
    assert_eq!(skyline.report.rooftops, 3);
}

#[test]
fn a_zone_keeps_lines_out_and_hears_where_they_fly() {
    let keep_out = |from: Point, to: Point, band: &AltitudeBand| {
        assert!((from.distance_m(to) - 120.0).abs() < 0.1);
        assert_eq!(*band, AltitudeBand::at(Some(Altitude::agl(25.0))));
        true
    };
    let rules = LineOfSight::default();
    let refused = rules.build(&buildings(&[WEST, EAST]), &keep_out, &mut |_, _| {});
    assert!(matches!(
        refused,
        Err(LineOfSightError::NoSegments { rooftops: 2, .. })
    ));
}

#[test]
fn the_report_counts_what_was_met() {
    let wall = block(60.0, -50.0, 2.0, 100.0, 60.0);
    let north = block(0.0, 150.0, 20.0, 20.0, 30.0);
    let lonely = block(2000.0, 0.0, 20.0, 20.0, 30.0);
    let unknown = Block {
        height_m: None,
        ..block(-300.0, 0.0, 20.0, 20.0, 0.0)
    };
    let zone = |from: Point, to: Point, _: &AltitudeBand| {
        (from.y - to.y).abs() > 100.0 && (from.x - to.x).abs() > 50.0
    };
    let mut heard = Vec::new();
    let rules = LineOfSight {
        min_roof_area_m2: 300.0,
        ..LineOfSight::default()
    };
    let skyline = rules
        .build(
            &buildings(&[WEST, EAST, wall, north, lonely, unknown]),
            &zone,
            &mut |done, total| heard.push((done, total)),
        )
        .expect("a skyway");
    let expected = SkylineReport {
        buildings: 6,
        unknown_heights: 1,
        rooftops: 4,
        overshadowed: 0,
        pairs: 3,
        blocked_by_buildings: 1,
        blocked_by_zones: 1,
        isolated: vec!["1".to_owned(), "4".to_owned()],
    };
    assert_eq!(skyline.report, expected);
    assert_eq!(heard, [(1, 4), (2, 4), (3, 4), (4, 4)]);
}

#[test]
fn nodes_and_segments_state_what_they_are() {
    let high = block(100.0, 30.0, 40.0, 25.0, 50.0);
    let skyline = build(&[high, WEST], &LineOfSight::default()).expect("a skyway");
    let [west, east] = skyline.network.nodes.as_slice() else {
        panic!("two nodes");
    };
    assert_eq!(
        (west.id.as_str(), west.name.as_deref()),
        ("1", Some("1")),
        "numbered from the west"
    );
    assert_eq!(
        (west.altitude, east.altitude),
        (Some(Altitude::agl(20.0)), Some(Altitude::agl(50.0)))
    );
    assert_eq!((west.pads, west.role), (1, Role::Both), "one pad on 400 m²");
    assert_eq!((east.pads, east.role), (2, Role::Both), "two on 1,000 m²");
    let [segment] = skyline.network.segments.as_slice() else {
        panic!("one segment");
    };
    let band = AltitudeBand {
        lower: Some(Altitude::agl(25.0)),
        upper: Some(Altitude::agl(55.0)),
    };
    assert_eq!(segment.band, band);
    let straight_m: f64 = 110.0_f64.powi(2) + 32.5_f64.powi(2);
    let length_m = (straight_m + 30.0_f64.powi(2)).sqrt();
    assert!((segment.length_m.expect("a length") - length_m).abs() < 0.02);

    let small = LineOfSight {
        min_roof_area_m2: 300.0,
        pads: PadRule {
            roof_area_per_pad_m2: 401.0,
            max_pads: 1,
        },
        ..LineOfSight::default()
    };
    let skyline = build(&[high, WEST], &small).expect("a skyway");
    let pads = skyline
        .network
        .nodes
        .iter()
        .map(|node| (node.pads, node.role));
    assert_eq!(
        pads.collect::<Vec<_>>(),
        [(0, Role::DeliveryTarget), (1, Role::Both)]
    );
}

#[test]
fn only_the_extract_gives_nodes_but_everything_is_in_the_way() {
    let wall = block(60.0, -50.0, 4.0, 100.0, 60.0);
    let mut given = buildings(&[WEST, EAST, wall]);
    for building in &mut given[..2] {
        building.extract = Some("north".to_owned());
    }
    let rules = LineOfSight {
        extract: Some("north".to_owned()),
        ..LineOfSight::default()
    };
    let refused = rules.build(&given, NO_ZONES, &mut |_, _| {});
    assert!(matches!(
        refused,
        Err(LineOfSightError::NoSegments { rooftops: 2, .. })
    ));
}

#[test]
fn rules_that_contradict_themselves_are_refused() {
    let refused = |rules: LineOfSight| {
        build(&[WEST, EAST], &rules)
            .expect_err("refused")
            .to_string()
    };
    let rules = LineOfSight::default();
    assert_eq!(
        refused(LineOfSight {
            reach_m: f64::NAN,
            ..rules.clone()
        }),
        "reach_m is NaN; give a finite number above 0"
    );
    assert_eq!(
        refused(LineOfSight {
            max_height_m: 116.0,
            ..rules.clone()
        }),
        "max_height_m 116 plus clearance_m 5 is above ceiling_m 120; lower max_height_m to 115 or less"
    );
    assert_eq!(
        refused(LineOfSight {
            min_height_m: 50.0,
            max_height_m: 40.0,
            ..rules.clone()
        }),
        "min_height_m 50 is above max_height_m 40; swap them"
    );
    assert_eq!(build(&[], &rules), Err(LineOfSightError::NoBuildings));
}

#[test]
fn the_order_of_the_buildings_does_not_matter() {
    let mut seeded = Seeded::new(11);
    let blocks: Vec<Block> = (0..40)
        .map(|_| {
            let (x, y) = (seeded.between(0.0, 400.0), seeded.between(0.0, 400.0));
            block(
                x,
                y,
                seeded.between(10.0, 40.0),
                seeded.between(10.0, 40.0),
                seeded.between(5.0, 110.0).round(),
            )
        })
        .collect();
    let mut given = buildings(&blocks);
    let rules = LineOfSight::default();
    let forwards = rules
        .build(&given, NO_ZONES, &mut |_, _| {})
        .expect("a skyway");
    given.reverse();
    let backwards = rules
        .build(&given, NO_ZONES, &mut |_, _| {})
        .expect("a skyway");
    assert_eq!(forwards, backwards);
}
