//! The native format: what is written reads back the same, and every fault names its place.

use super::*;
use crate::error::MAX_FORMAT_ERRORS;
use crate::geo::{Altitude, AltitudeBand, AltitudeReference};
use crate::network::{
    Coordinates, Generated, Joining, NetworkDraft, NodeDraft, Role, SegmentDraft,
};

fn draft() -> NetworkDraft {
    let node = |id: &str, position| NodeDraft {
        id: id.to_owned(),
        position,
        ..NodeDraft::default()
    };
    NetworkDraft {
        name: "two \"roofs\"".to_owned(),
        attribution: "© nobody".to_owned(),
        coordinates: Coordinates::Geographic,
        integer_ids: false,
        nodes: vec![
            NodeDraft {
                altitude: Some(Altitude {
                    value_m: 42.5,
                    reference: AltitudeReference::Amsl,
                }),
                pads: 3,
                role: Role::RechargingStation,
                name: Some("Town\nHall".to_owned()),
                ..node("a", [151.2, -33.86])
            },
            node("b", [151.2012345, -33.8612345]),
        ],
        segments: vec![SegmentDraft {
            id: Some("a to b".to_owned()),
            from: "a".to_owned(),
            to: "b".to_owned(),
            length_m: Some(178.5),
            band: AltitudeBand {
                lower: Some(Altitude::agl(30.0)),
                upper: None,
            },
            speed_limit_mps: Some(12.0),
        }],
        ..NetworkDraft::default()
    }
}

#[test]
fn the_text_is_one_feature_a_line() {
    let expected = r#"{"type":"FeatureCollection","name":"two \"roofs\"","attribution":"© nobody","skyway":{"format":1,"coordinates":"geographic"},"features":[
{"type":"Feature","id":"a","geometry":{"type":"Point","coordinates":[151.2,-33.86]},"properties":{"kind":"node","pads":3,"role":"recharging_station","altitude_m":42.5,"altitude_reference":"amsl","name":"Town\nHall"}},
{"type":"Feature","id":"b","geometry":{"type":"Point","coordinates":[151.2012345,-33.8612345]},"properties":{"kind":"node","pads":0,"role":"both"}},
{"type":"Feature","id":"a to b","geometry":{"type":"LineString","coordinates":[[151.2,-33.86],[151.2012345,-33.8612345]]},"properties":{"kind":"segment","from":"a","to":"b","length_m":178.5,"lower_m":30,"lower_reference":"agl","speed_limit_mps":12}}
]}
"#;
    assert_eq!(write_network(&draft()), expected);
}

#[test]
fn what_is_written_reads_back_the_same() {
    let variables = Generated {
        nodes: 200,
        max_neighbours: 6,
        map_size_m: 5_000.0,
        reach_fraction: 0.2,
        joining: Joining::Nearest,
        seed: 3,
    };
    let generated = variables.network().expect("in range");
    let empty = NetworkDraft::default();
    for network in [draft(), generated, empty] {
        assert_eq!(read_network(&write_network(&network)), Ok(network));
    }
}

#[test]
fn integer_ids_are_written_as_integers_only_where_all_are() {
    let mut network = draft();
    network.integer_ids = true;
    assert!(write_network(&network).contains(r#""from":"a""#));
    let rename = |network: &mut NetworkDraft, ids: [&str; 2]| {
        for (node, id) in network.nodes.iter_mut().zip(ids) {
            node.id = id.to_owned();
        }
        network.segments[0].from = ids[0].to_owned();
        network.segments[0].to = ids[1].to_owned();
    };
    rename(&mut network, ["-7", "18446744073709551615"]);
    let text = write_network(&network);
    assert!(
        text.contains(r#""from":-7,"to":18446744073709551615"#),
        "{text}"
    );
    assert_eq!(read_network(&text), Ok(network.clone()));
    rename(&mut network, ["07", "8"]);
    assert!(write_network(&network).contains(r#""from":"07","to":"8""#));
}

/// The first error of the draft's text with one piece replaced.
fn refused(original: &str, replacement: &str) -> String {
    let text = write_network(&draft());
    assert!(text.contains(original), "{original} is not in {text}");
    let errors = read_network(&text.replacen(original, replacement, 1)).expect_err("at fault");
    assert_eq!(errors.len(), 1, "{errors:?}");
    errors[0].to_string()
}

#[test]
fn faults_of_the_document_name_their_place() {
    assert!(
        refused("{\"type\"", "{type")
            .starts_with("document: cannot be read: key must be a string at line 1")
    );
    assert!(refused("]}\n", "").starts_with("document: cannot be read: EOF while parsing"));
    assert!(
        refused("\n]}\n", "\n]} 1").starts_with("document: cannot be read: trailing characters")
    );
    assert_eq!(
        refused("FeatureCollection", "Features"),
        "type: is not 'FeatureCollection'"
    );
    assert_eq!(
        refused("\"attribution\"", "\"atribution\""),
        "atribution: is not a member that this format has; known here: type, name, attribution, skyway, features, bbox, crs"
    );
    assert_eq!(
        refused("\"attribution\"", "\"name\""),
        "name: is there twice"
    );
    assert_eq!(
        refused("\"format\":1", "\"format\":2"),
        "skyway/format: is 2; this version reads format 1"
    );
    assert_eq!(
        refused("geographic", "polar"),
        "skyway/coordinates: is 'polar'; write 'geographic' or 'planar'"
    );
    assert_eq!(
        refused(
            "\"attribution\"",
            "\"crs\":{\"properties\":{\"name\":\"EPSG:28356\"}},\"attribution\""
        ),
        "crs: is not WGS 84 longitude and latitude; convert to 'urn:ogc:def:crs:OGC:1.3:CRS84' and remove this member"
    );
    let bare = r#"{"type":"FeatureCollection","features":[]}"#;
    let errors = read_network(bare).expect_err("at fault");
    assert!(
        errors[0]
            .to_string()
            .starts_with("document: has no member 'skyway'; add")
    );
    let without = r#"{"type":"FeatureCollection","skyway":{"format":1,"coordinates":"planar"}}"#;
    assert_eq!(
        read_network(without).expect_err("at fault")[0].to_string(),
        "document: has no member 'features'"
    );
    assert!(
        read_network("[]").expect_err("at fault")[0]
            .message
            .contains("expected a GeoJSON FeatureCollection")
    );
}

#[test]
fn faults_of_a_node_name_it_and_their_place() {
    assert_eq!(
        refused("\"pads\":3", "\"pad\":3"),
        "features/0/properties/pad (node 'a'): is not a member that this format has; known here: kind, pads, role, altitude_m, altitude_reference, name"
    );
    assert_eq!(
        refused("\"pads\":3", "\"pads\":70000"),
        "features/0/properties/pads (node 'a'): is 70000, not a whole number from 0 to 65535"
    );
    assert_eq!(
        refused("\"pads\":3", "\"pads\":\"3\""),
        "features/0/properties/pads (node 'a'): is text, not a whole number"
    );
    assert_eq!(
        refused("recharging_station", "charger"),
        "features/0/properties/role (node 'a'): is 'charger'; write 'delivery_target', 'recharging_station' or 'both'"
    );
    assert_eq!(
        refused("\"altitude_m\":42.5,", ""),
        "features/0/properties/altitude_reference (node 'a'): has no 'altitude_m' beside it"
    );
    assert_eq!(
        refused("42.5", "\"42.5\""),
        "features/0/properties/altitude_m (node 'a'): is text, not a number; remove the quotes"
    );
    assert_eq!(
        refused("[151.2,-33.86]", "[151.2,-33.86,12]"),
        "features/0/geometry/coordinates (node 'a'): has three numbers, not two; an altitude belongs in the properties, with its reference"
    );
    assert_eq!(
        refused("\"id\":\"a\",", ""),
        "features/0: has no member 'id'"
    );
    assert_eq!(
        refused("\"id\":\"a\"", "\"id\":1.5"),
        "features/0/id: is 1.5; an id is text or an integer"
    );
    assert_eq!(
        refused("\"id\":\"b\"", "\"id\":2"),
        "features/1/id (node '2'): is an integer, but earlier ids are text; write all ids as integers, or all as text"
    );
    assert_eq!(
        refused("\"Point\"", "\"Polygon\""),
        "features/0/geometry/type: is 'Polygon', not 'Point' or 'LineString'; a node is a Point, a segment a LineString"
    );
    assert_eq!(
        refused("\"kind\":\"node\"", "\"kind\":\"segment\""),
        "features/0/properties/kind (node 'a'): is 'segment', but the geometry is that of a node; a node is a Point, a segment a LineString"
    );
}

#[test]
fn longitude_and_latitude_the_wrong_way_round_are_asked_about() {
    let mut network = draft();
    network.segments.clear();
    network.nodes[0].position = [-33.86, 151.2];
    network.nodes[1].position = [190.0, 0.0];
    let errors = read_network(&write_network(&network)).expect_err("at fault");
    let lines: Vec<String> = errors.iter().map(ToString::to_string).collect();
    assert_eq!(
        lines,
        [
            "features/0/geometry/coordinates (node 'a'): has the latitude 151.2, outside -90..90; longitude comes first; were longitude and latitude swapped?",
            "features/1/geometry/coordinates (node 'b'): has the longitude 190, outside -180..180",
        ]
    );
    network.coordinates = Coordinates::Planar;
    assert_eq!(read_network(&write_network(&network)), Ok(network));
}

#[test]
fn faults_of_a_segment_name_it_and_their_place() {
    assert_eq!(
        refused("\"from\":\"a\",", ""),
        "features/2/properties (segment 'a to b'): has no member 'from'"
    );
    assert_eq!(
        refused("\"to\":\"b\"", "\"to\":\"c\""),
        "features/2/properties/to (segment 'a to b'): names the node 'c', which the file does not have; add the node, or correct the id"
    );
    assert_eq!(
        refused("178.5", "0"),
        "features/2/properties/length_m (segment 'a to b'): is 0; it has to be above 0"
    );
    assert!(refused("178.5", "1e999").starts_with("document: cannot be read: number out of range"));
    assert_eq!(
        refused(
            "\"lower_reference\":\"agl\"",
            "\"lower_reference\":\"agl\",\"upper_m\":20"
        ),
        "features/2/properties/lower_m (segment 'a to b'): is 30 m, above upper_m 20 m; swap them"
    );
    assert_eq!(
        refused("[[151.2,-33.86],", "[[151.2,-33.86],[151.21,-33.86],"),
        "features/2/geometry/coordinates (segment 'a to b'): has 3 positions, not two; a segment is one straight line; put a node at every bend"
    );
    assert_eq!(
        refused(
            "[[151.2,-33.86],[151.2012345,-33.8612345]]",
            "[[151.2012345,-33.8612345],[151.2,-33.86]]"
        ),
        "features/2/geometry/coordinates/0 (segment 'a to b'): is 178.3 m from the node 'a'; the line runs from 'to' to 'from'; turn it round"
    );
    assert_eq!(
        refused("[[151.2,-33.86],", "[[151.2001,-33.86],"),
        "features/2/geometry/coordinates/0 (segment 'a to b'): is 9.3 m from the node 'a'; a segment's line ends at its nodes"
    );
    assert_eq!(
        refused("\"id\":\"a to b\",", "\"name\":1,"),
        "features/2/name: is not a member that this format has; known here: type, id, geometry, properties, bbox"
    );
}

#[test]
fn what_need_not_be_stated_is_not_missed() {
    let text = r#"{"bbox":[0,0,1,1],"features":[
        {"type":"Feature","geometry":{"type":"LineString","coordinates":[[0,0],[3,4]]},"properties":{"from":1,"to":2}},
        {"type":"Feature","id":1,"geometry":{"type":"Point","coordinates":[0,0]},"properties":null},
        {"type":"Feature","id":2,"geometry":{"type":"Point","coordinates":[3,4]},"properties":{"name":null}}
        ],"skyway":{"coordinates":"planar","format":1},"type":"FeatureCollection"}"#;
    let network = read_network(&format!("\u{feff}{text}")).expect("valid");
    assert!(network.integer_ids);
    let ends = network
        .segments
        .iter()
        .map(|segment| (segment.from.as_str(), segment.to.as_str(), segment.length_m));
    assert_eq!(ends.collect::<Vec<_>>(), [("1", "2", None)]);
    assert_eq!(network.nodes[0].role, Role::Both);
}

#[test]
fn no_more_than_so_many_errors_are_collected() {
    let feature = r#"{"type":"Feature","id":1.5,"geometry":{"type":"Point","coordinates":[0,0]},"properties":{}},"#;
    let features = feature.repeat(500);
    let text = format!(
        r#"{{"type":"FeatureCollection","skyway":{{"format":1,"coordinates":"planar"}},"features":[{}]}}"#,
        features.trim_end_matches(',')
    );
    assert_eq!(
        read_network(&text).expect_err("at fault").len(),
        MAX_FORMAT_ERRORS
    );
}
