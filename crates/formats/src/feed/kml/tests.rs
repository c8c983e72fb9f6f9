//! What is imported from KML, and what is refused with its place.

use crate::airspace::{Zone, ZoneKind};
use crate::feed::{FeedFormat, FeedTerms, MAX_FEED_ZONES, ZoneFeed, read_feed};
use crate::geo::{AltitudeReference, Frame, LocalPlane};
use crate::zones::ZoneProblem;
use serde_json::{Value, json};

const SQUARE: &str = "151.2,-33.87,0 151.21,-33.87,0 151.21,-33.86,0 151.2,-33.86,0 151.2,-33.87,0";

fn read(text: &str) -> Result<ZoneFeed, ZoneProblem> {
    let terms = FeedTerms {
        feed: "drawn",
        prefix: "k-",
        margin_m: 10.0,
    };
    let frame = Frame::Geographic(LocalPlane::about(151.2, -33.87));
    read_feed(text, &terms, &frame)
}

fn file(placemarks: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Document>{placemarks}</Document></kml>"
    )
}

fn polygon(heights: &str, coordinates: &str) -> String {
    format!(
        "<Polygon>{heights}<outerBoundaryIs><LinearRing><coordinates>{coordinates}</coordinates></LinearRing></outerBoundaryIs></Polygon>"
    )
}

fn placemark(content: &str) -> String {
    format!("<Placemark id=\"z\">{content}</Placemark>")
}

fn raised(coordinates: &str, height: &str) -> String {
    coordinates.replace(",0", &format!(",{height}"))
}

/// The zones of the only Placemark.
fn zones(content: &str) -> Vec<Zone> {
    let feed = read(&file(&placemark(content))).expect("a feed");
    assert_eq!(feed.format, FeedFormat::Kml);
    assert_eq!(feed.zones.len(), 1, "{content}");
    let outcome = feed.zones.into_iter().next().expect("a zone").outcome;
    outcome.expect(content)
}

fn notes(content: &str) -> Vec<String> {
    let feed = read(&file(&placemark(content))).expect("a feed");
    let told = feed.notes.into_iter();
    told.map(|note| format!("{}: {}", note.pointer, note.message))
        .collect()
}

/// Asserts that the only Placemark is refused for this one reason, with a remedy.
fn assert_refused(content: &str, code: &str, within: &str) {
    let feed = read(&file(&placemark(content))).expect("a feed");
    let zone = &feed.zones[0];
    assert_eq!(zone.identifier.as_deref(), Some("z"));
    let problems = zone.outcome.as_ref().expect_err(content);
    let found: Vec<(&str, &str)> = problems
        .iter()
        .map(|problem| (problem.code, problem.pointer.as_str()))
        .collect();
    let place = format!("/kml/Document/0/Placemark/0{within}");
    assert_eq!(found, [(code, place.as_str())], "{content}: {problems:?}");
    assert!(problems[0].hint.is_some(), "{problems:?}");
}

#[test]
fn a_placemark_is_a_prohibited_zone_with_its_id_its_name_and_what_is_said_of_it() {
    let zone = &zones(&format!(
        "<name>Concert</name><description><![CDATA[<b>loud</b>]]></description><styleUrl>#red</styleUrl>
         <ExtendedData><Data name=\"owner\"><value>city</value></Data>
         <SchemaData schemaUrl=\"#s\"><SimpleData name=\"FID\">7</SimpleData><SimpleData name=\"none\"/></SchemaData></ExtendedData>{}",
        polygon("", SQUARE)
    ))[0];
    assert_eq!(zone.id(), "k-z");
    assert_eq!(zone.name(), Some("Concert"));
    let terms = zone.terms();
    assert_eq!(terms.kind, ZoneKind::Prohibited);
    let source = terms.source.as_ref().expect("a source");
    assert_eq!((source.feed.as_str(), source.id.as_str()), ("drawn", "z"));
    let record: Value =
        serde_json::from_str(terms.record.as_deref().expect("a record")).expect("JSON");
    let kept = json!({"description": "<b>loud</b>", "ExtendedData": {"owner": "city", "FID": "7"}});
    assert_eq!(record["extendedProperties"], kept);
    assert!(zone.windows().is_empty());
    assert_eq!(zone.band().lower.or(zone.band().upper), None);
}

#[test]
fn heights_close_from_the_ground_up_to_what_is_extruded() {
    let with = |mode: &str, extrude: &str, height: &str| {
        let mode = format!("<extrude>{extrude}</extrude><altitudeMode>{mode}</altitudeMode>");
        polygon(&mode, &raised(SQUARE, height))
    };
    for (mode, height, reference) in [
        ("relativeToGround", "120", AltitudeReference::Agl),
        ("absolute", "350.5", AltitudeReference::Amsl),
    ] {
        let band = *zones(&with(mode, "1", height))[0].band();
        let upper = band.upper.expect("a ceiling");
        assert_eq!(upper.value_m.to_string(), height);
        assert_eq!((upper.reference, band.lower), (reference, None));
        assert_refused(
            &with(mode, "0", height),
            "zone_altitude_invalid",
            "/Polygon",
        );
        assert_refused(
            &with(mode, "yes", height),
            "zone_unknown_value",
            "/Polygon/extrude",
        );
    }
    for unlimited in [
        with("clampToGround", "1", "120"),
        with("relativeToGround", "0", "0"),
    ] {
        assert_eq!(zones(&unlimited)[0].band().upper, None);
        assert_eq!(notes(&unlimited).len(), 1, "{unlimited}");
    }
    assert_refused(
        &with("relativeToGround", "1", "-5"),
        "zone_altitude_invalid",
        "/Polygon",
    );
    assert_refused(
        &with("clampToSeaFloor", "1", "9"),
        "zone_unknown_value",
        "/Polygon/altitudeMode",
    );
    let mode = "<extrude>1</extrude><altitudeMode>absolute</altitudeMode>";
    let sloped = SQUARE.replacen(",0", ",90", 2);
    assert_refused(&polygon(mode, &sloped), "zone_altitude_invalid", "/Polygon");
    let flat = raised(SQUARE, "");
    let without = flat.replace(", ", " ").trim_end_matches(',').to_owned();
    assert_refused(
        &polygon(mode, &without),
        "zone_altitude_invalid",
        "/Polygon",
    );
}

#[test]
fn holes_and_several_polygons_are_read_where_they_stand() {
    let hole = "<innerBoundaryIs><LinearRing><coordinates>151.202,-33.868 151.204,-33.868 151.204,-33.866 151.202,-33.868</coordinates></LinearRing></innerBoundaryIs>";
    let holed = polygon("", SQUARE).replace("</Polygon>", &format!("{hole}</Polygon>"));
    let crate::airspace::ZoneGeometry::Polygon(rings) = zones(&holed)[0].geometry().clone() else {
        panic!("no polygon");
    };
    assert_eq!((rings.len(), rings[1].len()), (2, 4));
    let outside = holed.replace("-33.868", "-33.898");
    assert_refused(&outside, "zone_rings_meet", "/Polygon/1/2");

    let label = "<Point><coordinates>151.2,-33.86</coordinates></Point>";
    let far = SQUARE.replace("151.2", "151.4");
    let both = format!(
        "<MultiGeometry>{}{label}<MultiGeometry>{}</MultiGeometry></MultiGeometry>",
        polygon("", SQUARE),
        polygon("", &far)
    );
    let ids: Vec<String> = zones(&both)
        .iter()
        .map(|zone| zone.id().to_owned())
        .collect();
    assert_eq!(ids, ["k-z~1", "k-z~2"]);
    let place = "/kml/Document/0/Placemark/0/MultiGeometry/Point/0: not imported";
    assert!(notes(&both)[0].starts_with(place), "{:?}", notes(&both));
    let bent = both.replace("151.4,-33.87,0 ", "151.4;-33.87;0 ");
    let within = "/MultiGeometry/MultiGeometry/0/Polygon/0/0/0";
    assert_refused(&bent, "zone_position_not_pair", within);
}

#[test]
fn positions_are_longitude_latitude_and_height() {
    let open = SQUARE.rsplit_once(' ').expect("positions").0;
    let told = notes(&polygon("", open));
    assert_eq!(
        told,
        ["/kml/Document/0/Placemark/0/Polygon/0: the ring was closed"]
    );
    for (written, code, within) in [
        (
            "151.2,-33.87,0 151.21",
            "zone_position_not_pair",
            "/Polygon/0/1",
        ),
        ("151.2,-33.87,0,1", "zone_position_not_pair", "/Polygon/0/0"),
        ("151.2, -33.87", "zone_position_not_pair", "/Polygon/0/0"),
        ("NaN,-33.87", "zone_position_not_pair", "/Polygon/0/0"),
        ("-33.87,151.2", "zone_latitude_out_of_range", "/Polygon/0/0"),
        ("", "zone_too_few_points", "/Polygon/0"),
    ] {
        let content = polygon("", written);
        let feed = read(&file(&placemark(&content))).expect("a feed");
        let problems = feed.zones[0].outcome.as_ref().expect_err(written);
        assert_eq!(problems[0].code, code, "{written}: {problems:?}");
        let place = format!("/kml/Document/0/Placemark/0{within}");
        assert_eq!(problems[0].pointer, place, "{written}: {problems:?}");
    }
}

#[test]
fn what_is_no_polygon_is_refused_by_its_id() {
    let line = "<LineString><coordinates>151.2,-33.87 151.21,-33.87</coordinates></LineString>";
    let point = "<Point><coordinates>151.2,-33.87</coordinates></Point>";
    let unsupported = "zone_geometry_unsupported";
    assert_refused(line, unsupported, "/LineString");
    assert_refused(point, unsupported, "/Point");
    assert_refused("<Model/>", unsupported, "/Model");
    assert_refused(&format!("{line}{point}"), unsupported, "");
    let both = format!(
        "<MultiGeometry>{}{line}</MultiGeometry>",
        polygon("", SQUARE)
    );
    assert_refused(&both, unsupported, "/MultiGeometry/LineString/0");
    for nothing in ["", &format!("<MultiGeometry>{point}</MultiGeometry>")] {
        assert_refused(nothing, "zone_geometry_empty", "");
    }
    assert_refused(
        "<Polygon/>",
        "zone_missing_field",
        "/Polygon/outerBoundaryIs",
    );
    let empty = "/Polygon/innerBoundaryIs/LinearRing";
    let hollow = polygon("<innerBoundaryIs/>", SQUARE);
    assert_refused(&hollow, "zone_missing_field", empty);
    let moved = polygon("<altitudeOffset>9</altitudeOffset>", SQUARE);
    let place = "/Polygon/altitudeOffset";
    assert_refused(&moved, "zone_unknown_field", place);
    let square = polygon("", SQUARE);
    let twice = square.replace("</Polygon>", "<extrude>0</extrude><altitudeMode>absolute</altitudeMode><altitudeMode>clampToGround</altitudeMode></Polygon>");
    let feed = read(&file(&placemark(&twice))).expect("a feed");
    let problems = feed.zones[0]
        .outcome
        .as_ref()
        .expect_err("it is there twice");
    assert_eq!(
        problems[0].pointer,
        "/kml/Document/0/Placemark/0/Polygon/altitudeMode"
    );

    // One that is refused keeps no other out; one without a name of any kind is refused as well.
    let link = "<NetworkLink id=\"l\"><Link><href>more.kml</href></Link></NetworkLink>";
    let others = format!(
        "{}<Folder><Placemark><name> Old pier </name>{square}</Placemark><Placemark>{square}</Placemark>{link}</Folder>",
        placemark(line)
    );
    let feed = read(&file(&others)).expect("a feed");
    let told: Vec<(Option<&str>, bool, &str)> = feed
        .zones
        .iter()
        .map(|zone| {
            let is_imported = zone.outcome.is_ok();
            (
                zone.identifier.as_deref(),
                is_imported,
                zone.pointer.as_str(),
            )
        })
        .collect();
    let expected = [
        (Some("z"), false, "/kml/Document/0/Placemark/0"),
        (
            Some("Old pier"),
            true,
            "/kml/Document/0/Folder/0/Placemark/0",
        ),
        (None, false, "/kml/Document/0/Folder/0/Placemark/1"),
        (Some("l"), false, "/kml/Document/0/Folder/0/NetworkLink/0"),
    ];
    assert_eq!(told, expected);
}

#[test]
fn a_span_is_the_time_in_force_and_nothing_else_is() {
    let square = polygon("", SQUARE);
    let span = |content: &str| format!("<TimeSpan>{content}</TimeSpan>{square}");
    let spans = "<begin>2026-11-01T00:00:00Z</begin><end>2026-11-02T12:00:00+01:00</end>";
    let zone = &zones(&span(spans))[0];
    let window = zone.windows()[0];
    let ends = [window.from(), window.until()].map(|end| end.expect("an end").to_string());
    assert_eq!(ends, ["2026-11-01T00:00:00Z", "2026-11-02T11:00:00Z"]);
    let begins = zones(&span("<begin>2026-11-01T00:00:00Z</begin>"));
    assert_eq!(begins[0].windows()[0].until(), None);
    assert!(zones(&span(""))[0].windows().is_empty());
    assert_refused(
        &span("<begin>2026-11</begin>"),
        "zone_time_invalid",
        "/TimeSpan/begin",
    );
    let reversed = "<begin>2026-11-02T00:00:00Z</begin><end>2026-11-01T00:00:00Z</end>";
    assert_refused(&span(reversed), "zone_window_reversed", "/TimeSpan/end");
    let stamp = format!("<TimeStamp><when>2026-11-01T00:00:00Z</when></TimeStamp>{square}");
    assert_refused(&stamp, "zone_time_invalid", "/TimeStamp");
    let around = format!("<TimeSpan>{spans}</TimeSpan>{}", placemark(&square));
    let feed = read(&file(&around)).expect("a feed");
    let problems = feed.zones[0]
        .outcome
        .as_ref()
        .expect_err("its time is unclear");
    assert_eq!(problems[0].code, "zone_time_invalid");
    let own = format!("<TimeSpan>{spans}</TimeSpan>{}", placemark(&span(spans)));
    assert!(read(&file(&own)).expect("a feed").zones[0].outcome.is_ok());
}

#[test]
fn what_is_no_kml_is_refused_as_a_whole_and_what_is_too_much_too() {
    let code = |text: &str| read(text).err().map(|problem| problem.code);
    let square = placemark(&polygon("", SQUARE));
    let marked = format!("\u{feff}{}", file(&square));
    assert_eq!(read(&marked).expect("a feed").zones.len(), 1);
    let prefixed = format!(
        "<k:kml xmlns:k=\"http://earth.google.com/kml/2.1\">{}</k:kml>",
        "<k:Document/>"
    );
    assert_eq!(
        code(&prefixed.replace("<k:kml", "<!-- <kml --><k:kml")),
        None
    );
    assert_eq!(code("<gpx/>"), Some("zone_format_foreign"));
    assert_eq!(code("<!-- <kml --><other/>"), Some("zone_format_foreign"));
    assert_eq!(code("<kml><Document></kml>"), Some("zone_not_xml"));
    let entities = "<!DOCTYPE kml [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;\">]><kml>&b;</kml>";
    assert_eq!(code(entities), Some("zone_not_xml"));
    let deep = format!(
        "<kml>{}{}</kml>",
        "<Folder>".repeat(99),
        "</Folder>".repeat(99)
    );
    assert_eq!(code(&deep), Some("zone_text_too_long"));
    let deep = format!(
        "<kml>{}{}</kml>",
        "<a>".repeat(400_000),
        "</a>".repeat(400_000)
    );
    assert_eq!(code(&deep), None);
    let attributes: String = (0..60_000).map(|it| format!(" a{it}='>'")).collect();
    assert_eq!(
        code(&file(&format!("<a{attributes}/>"))),
        Some("zone_text_too_long")
    );
    let nested: String = (0..2_000)
        .map(|it| format!("<a xmlns:n{it}=\"u\">"))
        .collect();
    assert_eq!(code(&file(&nested)), Some("zone_text_too_long"));
    let beside = "<a xmlns:n=\"u\" b='>'/><!-- <a --><![CDATA[<a x=\"\">]]>".repeat(40);
    assert_eq!(code(&file(&beside)), None);
    let many = file(&"<Placemark/>".repeat(MAX_FEED_ZONES + 1));
    assert_eq!(code(&many), Some("zone_text_too_long"));
    let pieces = file(&"<a/>".repeat(2_000_001));
    assert_eq!(code(&pieces), Some("zone_text_too_long"));
    let planar = read_feed(
        &file(&square),
        &FeedTerms {
            feed: "drawn",
            prefix: "",
            margin_m: 0.0,
        },
        &Frame::Planar,
    );
    assert_eq!(
        planar.err().map(|problem| problem.code),
        Some("zone_format_foreign")
    );
}
