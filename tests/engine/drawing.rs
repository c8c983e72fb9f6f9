//! Pictures: the text of one as a whole, and what holds for all of them.

use jiff::{SignedDuration, Timestamp};
use skyway::airspace::{Airspace, Hits, Zone, ZoneDraft, ZoneGeometry};
use skyway::draw::{Crop, DrawnRecomposition, GroundPlan, Labels, Picture, PictureOptions, svg};
use skyway::flight::{FailureReport, FailureType, Location};
use skyway::geo::{AltitudeBand, Bounds, Frame, Point};
use skyway::network::{
    Coordinates, Generated, Joining, NetworkDraft, NodeDraft, NodeIx, SegmentDraft, Topology,
    sketch,
};
use skyway::recompose::{
    AreaShape, Outcome, Recomposition, Request, Scratch, Stage, StageRecord, Strategy, World,
    recompose,
};
use std::sync::Arc;

/// A road of four nodes, A to D, with a way round B - C on either side.
fn street() -> Arc<Topology> {
    let drawing = "
  E F
A B C D
  G H
";
    let segments = ["AB", "BC", "CD", "BE", "EF", "FC", "AG", "GH", "HC", "FD"];
    let ends: Vec<(&str, &str)> = segments.iter().map(|pair| pair.split_at(1)).collect();
    Arc::new(sketch(drawing, &ends))
}

fn nodes(topology: &Topology, ids: &[&str]) -> Vec<NodeIx> {
    let named = |id: &&str| topology.node(id).expect("a node of the sketch");
    ids.iter().map(named).collect()
}

/// The answer to a failure on B - C of the way A, B, C, D, with all its stages.
fn answer_on_street(topology: &Arc<Topology>, strategy: Strategy) -> Recomposition {
    let path = nodes(topology, &["B", "C", "D"]);
    let now = Timestamp::UNIX_EPOCH;
    let airspace = Airspace::open(topology.clone(), 1, now, SignedDuration::ZERO);
    let world = World {
        airspace: &airspace,
        trees: None,
    };
    let report = FailureReport {
        failure: FailureType::Environmental,
        leg: (path[0], path[1]),
        location: Location::LegStart,
        cause_location: None,
        destination: path[2],
        remaining_path: Some(path),
    };
    let request = Request {
        strategy,
        explain: true,
        ..Request::exact(report)
    };
    recompose(&world, &request, &mut Scratch::new(topology))
}

fn circle_zone(name: &str, centre: [f64; 2], radius_m: f64) -> Arc<Zone> {
    let draft = ZoneDraft {
        id: "zone-1".to_owned(),
        name: Some(name.to_owned()),
        reason: None,
        authority: None,
        geometry: ZoneGeometry::Circle { centre, radius_m },
        band: AltitudeBand::UNLIMITED,
        windows: Vec::new(),
        margin_m: 10.0,
        terms: Default::default(),
    };
    Arc::new(Zone::new(draft, &Frame::Planar).expect("a zone"))
}

fn house(x: f64, y: f64, side_m: f64, height_m: Option<f64>) -> GroundPlan {
    let corners = [(0.0, 0.0), (side_m, 0.0), (side_m, side_m), (0.0, side_m)];
    let ring = corners.map(|(east, north)| Point::new(x + east, y + north));
    GroundPlan {
        polygons: vec![vec![ring.to_vec()]],
        height_m,
    }
}

/// Elements closed in order, attributes in quotes, nothing that XML would not take; the names of all elements.
fn elements_of(text: &str) -> Vec<String> {
    let mut open: Vec<String> = Vec::new();
    let mut names = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        check_words(&rest[..start]);
        let end = start + rest[start..].find('>').expect("a tag ends");
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "closed in order");
            continue;
        }
        let quotes = tag.matches('"').count();
        assert!(
            quotes.is_multiple_of(2) && !tag.contains('<'),
            "attributes in quotes: {tag}"
        );
        let name: String = tag
            .chars()
            .take_while(char::is_ascii_alphanumeric)
            .collect();
        assert!(!name.is_empty(), "a tag has a name: <{tag}>");
        if !tag.ends_with('/') {
            open.push(name.clone());
        }
        names.push(name);
    }
    assert!(
        open.is_empty() && rest.trim().is_empty(),
        "everything is closed: {open:?}"
    );
    names
}

fn check_words(words: &str) {
    let entities = ["&amp;", "&lt;", "&gt;", "&quot;", "&#39;"];
    for (place, _) in words.match_indices('&') {
        let known = entities
            .iter()
            .any(|entity| words[place..].starts_with(entity));
        assert!(known, "an escaped ampersand: {words}");
    }
    assert!(!words.contains('>'), "an escaped bracket: {words}");
    let unwritable = |letter: char| letter < ' ' && letter != '\n';
    assert!(
        !words.contains(unwritable),
        "no control characters: {words:?}"
    );
}

fn assert_sound(text: &str) {
    elements_of(text);
    for bad in ["NaN", "inf", "-0 ", "<script", "href", "<image"] {
        assert!(!text.contains(bad), "{bad} in {text}");
    }
    let addresses: Vec<_> = text.match_indices("http").collect();
    assert_eq!(addresses.len(), 1, "only the namespace has an address");
}

// -- the text as a whole --

#[test]
fn a_recomposition_is_drawn_with_everything_around_it() {
    let topology = street();
    let answer = answer_on_street(&topology, Strategy::TwoPhased);
    let path = nodes(&topology, &["B", "C", "D"]);
    let zone = circle_zone("Fire & <smoke>", [300.0, 30.0], 30.0);
    let closed = Hits::of(&topology, &zone);
    let picture = Picture {
        buildings: &[
            house(40.0, 40.0, 30.0, Some(20.0)),
            house(240.0, 240.0, 20.0, None),
        ],
        zones: &[zone],
        closed: &closed,
        recomposition: Some(DrawnRecomposition {
            old_path: &path,
            failed_leg: (path[0], path[1]),
            drone: Some(Point::new(240.0, 100.0)),
            answer: &answer,
        }),
        options: PictureOptions {
            width_px: 480,
            labels: Labels::All,
            ..PictureOptions::default()
        },
        ..Picture::of(&topology)
    };
    let text = svg(&picture);
    assert_sound(&text);
    assert_eq!(text, svg(&picture), "the same picture is the same text");
    insta::assert_snapshot!(text);
}

#[test]
fn a_legend_lists_what_is_drawn_and_nothing_else() {
    let topology = street();
    let alone = svg(&Picture::of(&topology));
    assert_sound(&alone);
    assert!(alone.contains(">skyway segment<") && alone.contains(">node<"));
    let absent = [
        "zone", "closed", "path", "leg", "search", "building", "start", "drone", ">N<",
    ];
    for words in absent {
        assert!(
            !alone.contains(&format!(">{words}")),
            "{words} in the legend"
        );
    }
    assert!(!alone.contains("failed leg"));
}

// -- what comes from files --

#[test]
fn ids_and_names_from_files_are_escaped() {
    let node = |id: &str, x: f64| NodeDraft {
        id: id.to_owned(),
        position: [151.2 + x, -33.8],
        name: Some("\u{1}\u{fffe}</text><script>alert('1')</script>".to_owned()),
        pads: 3,
        ..NodeDraft::default()
    };
    let draft = NetworkDraft {
        name: "\"Sydney\" & <b>".to_owned(),
        attribution: "© someone & <somebody>".to_owned(),
        coordinates: Coordinates::Geographic,
        nodes: vec![node("<&>", 0.0), node("\"'", 0.01)],
        segments: vec![SegmentDraft {
            from: "<&>".to_owned(),
            to: "\"'".to_owned(),
            ..SegmentDraft::default()
        }],
        ..NetworkDraft::default()
    };
    let topology = Topology::build(draft, [0; 32]).expect("a network");
    let mut picture = Picture::of(&topology);
    picture.options.labels = Labels::All;
    let text = svg(&picture);
    assert_sound(&text);
    assert!(text.contains("&quot;Sydney&quot; &amp; &lt;b&gt;"));
    assert!(text.contains("© someone &amp; &lt;somebody&gt;"));
    assert!(text.contains("\u{fffd}\u{fffd}&lt;/text&gt;&lt;script&gt;"));
    assert!(text.contains(">N<") && text.contains("° E<") && text.contains("° S<"));
}

#[test]
fn what_is_no_number_does_not_break_a_picture() {
    let topology = street();
    let nowhere = Point::new(f64::NAN, f64::INFINITY);
    let mut answer = answer_on_street(&topology, Strategy::Radius);
    let path = nodes(&topology, &["B", "C", "D"]);
    let (low, high) = (Point::new(0.0, 0.0), Point::new(100.0, 100.0));
    let between = |min: Point, max: Point| Crop::Box(Bounds { min, max });
    answer.outcome = Outcome::Diverted;
    let mut texts = Vec::new();
    for crop in [
        Crop::Auto,
        between(low, nowhere),
        between(high, low),
        between(low, low),
        between(low, Point::new(f64::INFINITY, f64::INFINITY)),
    ] {
        let mut hole = house(0.0, 0.0, 10.0, Some(f64::NAN));
        hole.polygons[0].push(vec![nowhere]);
        let picture = Picture {
            buildings: &[hole],
            recomposition: Some(DrawnRecomposition {
                old_path: &path,
                failed_leg: (path[0], path[1]),
                drone: Some(nowhere),
                answer: &answer,
            }),
            options: PictureOptions {
                width_px: 0,
                title: Some(String::new()),
                crop,
                margin: f64::NAN,
                ..PictureOptions::default()
            },
            ..Picture::of(&topology)
        };
        let text = svg(&picture);
        assert_sound(&text);
        assert!(
            text.contains("viewBox=\"0 0 320 "),
            "the smallest width: {text}"
        );
        texts.push(text);
    }
    texts.dedup();
    assert_eq!(
        texts.len(),
        1,
        "a box without an extent shows what is shown without one"
    );
}

#[test]
fn a_single_node_is_a_picture_too() {
    let text = svg(&Picture::of(&sketch("A", &[])));
    assert_sound(&text);
    assert!(text.contains(">node<") && !text.contains("skyway segment"));
}

// -- search areas --

/// The picture of an answer with other stages than it had.
fn with_stages(topology: &Topology, mut answer: Recomposition, shapes: Vec<AreaShape>) -> String {
    let record = |shape| StageRecord {
        stage: Stage::Cells,
        skipped: false,
        nodes: topology.nodes().collect(),
        shape,
        searched: true,
        path_found: false,
    };
    answer.stages = shapes.into_iter().map(record).collect();
    let path = nodes(topology, &["B", "C", "D"]);
    let text = svg(&Picture {
        recomposition: Some(DrawnRecomposition {
            old_path: &path,
            failed_leg: (path[0], path[1]),
            drone: None,
            answer: &answer,
        }),
        ..Picture::of(topology)
    });
    assert_sound(&text);
    text
}

/// The filled areas on the map: their path data.
fn filled_areas(text: &str) -> Vec<&str> {
    let paths = text
        .lines()
        .filter(|line| line.contains("<path") && line.contains("fill-opacity=\"0.16\" stroke"));
    paths
        .map(|line| line.split("d=\"").nth(1).unwrap_or_default())
        .collect()
}

#[test]
fn squares_are_drawn_as_their_union() {
    let topology = street();
    let answer = answer_on_street(&topology, Strategy::CellDensity);
    let square = |x: f64| (Point::new(x, 100.0), 50.0);
    let together = AreaShape::Squares {
        squares: vec![square(200.0), square(260.0)],
    };
    let apart = AreaShape::Squares {
        squares: vec![square(100.0), square(260.0)],
    };
    for (shape, rings) in [(together, 1), (apart, 2)] {
        let text = with_stages(&topology, answer.clone(), vec![shape]);
        let areas = filled_areas(&text);
        assert_eq!(areas.len(), 1, "{text}");
        assert_eq!(areas[0].matches('M').count(), rings, "{}", areas[0]);
        assert!(text.contains(">search area: cells<"));
    }
}

#[test]
fn every_shape_of_area_is_drawn_and_the_whole_network_is_none() {
    let topology = street();
    let answer = answer_on_street(&topology, Strategy::Radius);
    let corners = [(0.0, 0.0), (300.0, 0.0), (150.0, 200.0)]
        .map(|(x, y)| Point::new(x, y))
        .to_vec();
    let shapes = vec![
        AreaShape::Circle {
            centre: Point::new(150.0, 100.0),
            radius_m: 80.0,
        },
        AreaShape::Polygon {
            corners: corners.clone(),
        },
        AreaShape::Grown {
            corners,
            added: nodes(&topology, &["E", "F"]),
        },
    ];
    for shape in shapes {
        let text = with_stages(&topology, answer.clone(), vec![shape.clone()]);
        assert_eq!(filled_areas(&text).len(), 1, "{shape:?}");
        assert!(text.contains(">8 nodes of the search area<"), "{shape:?}");
        // Next to another, it is an outline.
        let text = with_stages(
            &topology,
            answer.clone(),
            vec![shape.clone(), AreaShape::Everything],
        );
        assert_eq!(filled_areas(&text).len(), 0, "{shape:?}");
        assert!(text.contains(">searched before: cells<"), "{shape:?}");
        assert!(!text.contains("of the search area<"), "{shape:?}");
    }
}

// -- size --

#[test]
fn a_large_network_is_a_reasonable_document() {
    let draft = Generated {
        nodes: 5_000,
        max_neighbours: 20,
        map_size_m: 10_000.0,
        reach_fraction: 0.1,
        joining: Joining::Nearest,
        seed: 7,
    };
    let draft = draft.network().expect("a network");
    let topology = Topology::build(draft, [0; 32]).expect("a network");
    let text = svg(&Picture::of(&topology));
    let elements = elements_of(&text).len();
    let (nodes, segments) = (topology.node_count(), topology.segment_count());
    assert!(
        text.len() < 25 * (segments + 2 * nodes),
        "{} bytes",
        text.len()
    );
    assert!(
        elements < 100,
        "{elements} elements for {nodes} nodes and {segments} segments"
    );
}
