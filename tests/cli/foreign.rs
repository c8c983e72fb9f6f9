//! What other programs write: marks before the text, semicolons, files of other formats, zones that lie elsewhere.

use crate::binary::{Workspace, skyway};
use serde_json::{Value, json};

const BYTE_ORDER_MARK: char = '\u{feff}';

fn circle(id: &str, coordinates: [f64; 2]) -> Value {
    json!({
        "type": "Feature",
        "id": id,
        "geometry": {"type": "Point", "coordinates": coordinates},
        "properties": {"radius_m": 60},
    })
}

fn collection(zone: &Value) -> String {
    json!({"type": "FeatureCollection", "features": [zone]}).to_string()
}

/// What is said of zones where a plan is composed over Sydney.
fn composed_with(desk: &Workspace, zones: &str, code: i32) -> String {
    let file = desk.write("zones.geojson", zones);
    let arguments = [
        "compose",
        "--quiet",
        "--source=379",
        "--destination=450",
        "--zones",
        &file,
    ];
    let run = skyway(&arguments).exits(code);
    run.stderr.replace(&file, "FILE")
}

#[test]
fn a_zone_that_meets_nothing_is_told_with_what_it_was_probably_meant_to_be() {
    let desk = Workspace::new();
    let place = [151.210_855_1, -33.862_204];
    assert_eq!(
        composed_with(&desk, &collection(&circle("z", place)), 0),
        ""
    );
    for (coordinates, slip) in [
        (
            [151.210_855_1, 33.862_204],
            "the latitude has the other sign",
        ),
        (
            [-151.210_855_1, -33.862_204],
            "the longitude has the other sign",
        ),
        (
            [-151.210_855_1, 33.862_204],
            "both coordinates have the other sign",
        ),
        ([-33.862_204, 51.2], ""),
    ] {
        let said = composed_with(&desk, &collection(&circle("z", coordinates)), 0);
        let begins = "warning: zone 'z': it meets no node and no segment: it lies ";
        assert!(said.starts_with(begins), "{said}");
        let meant = "did you mean [151.2108551, -33.862204] in place of [";
        assert_eq!(said.contains(meant), !slip.is_empty(), "{said}");
        assert!(said.contains(slip), "{said}");
    }
    let mut high = circle("high", place);
    high["properties"]["lower_m"] = json!(5_000);
    let said = composed_with(&desk, &collection(&high), 0);
    assert!(
        said.contains("look at its size and its altitudes"),
        "{said}"
    );
}

#[test]
fn a_byte_order_mark_is_passed_over() {
    let desk = Workspace::new();
    let marked = |text: &str| format!("{BYTE_ORDER_MARK}{text}");
    let zones = marked(&collection(&circle("z", [151.210_855_1, -33.862_204])));
    assert_eq!(composed_with(&desk, &zones, 0), "");
    let request = r#"{"service": {"from": 379, "to": 406}, "destination": 450}"#;
    let requests = desk.write("requests.jsonl", marked(request));
    let run = skyway(&["reroute", "--quiet", "--requests", &requests]).exits(0);
    assert_eq!(run.json_lines()[0]["outcome"], "rerouted", "{run:?}");
    let network = r#"{"nodes": [{"id": 1, "x": 0, "y": 0}, {"id": 2, "x": 9, "y": 0}], "links": [{"source": 1, "target": 2}]}"#;
    let network = desk.write("network.json", marked(network));
    skyway(&["network", "info", "--quiet", "--network", &network]).exits(0);
    let edge = desk.write("edge.toml", marked("listen = \"127.0.0.1:0\"\n"));
    #[cfg(feature = "edge")]
    skyway(&["config", "check", "--config", &edge]).exits(0);
    #[cfg(not(feature = "edge"))]
    drop(edge);
}

#[test]
fn tables_with_semicolons_or_tabs_are_read_and_empty_ones_refused() {
    let desk = Workspace::new();
    let info = |nodes: &str, edges: &str| {
        let nodes = desk.write("city_nodes.csv", nodes);
        desk.write("city_edges.csv", edges);
        skyway(&["network", "info", "--json", "--quiet", "--network", &nodes])
    };
    let [nodes, edges] = [
        "id,lon,lat\n1,151.2,-33.8\n2,151.201,-33.8\n",
        "u,v,length_m\n1,2,95\n",
    ];
    for delimiter in [",", ";", "\t"] {
        let with = |table: &str| table.replace(',', delimiter);
        let told = info(&with(nodes), &with(edges)).exits(0).json();
        assert_eq!(told["segments"], 1, "{told}");
    }
    let decimals = nodes.replace(',', ";").replace('.', ",");
    let run = info(&decimals, &edges.replace(',', ";")).exits(1);
    assert!(
        run.stderr.contains("write a point for the decimals"),
        "{run:?}"
    );
    for empty in ["", "u,v,length_m\n"] {
        let run = info(nodes, empty).exits(1);
        assert!(run.stderr.contains("edges: has no rows"), "{run:?}");
        assert!(
            run.stderr.contains("the columns u, v and length_m"),
            "{run:?}"
        );
    }
    let twice = info(&format!("{nodes}2,151.202,-33.8\n"), edges);
    assert_eq!(twice.code, 1, "{twice:?}");
}

/// Files of the field as they begin, and what they are called.
fn foreign() -> [(&'static str, String, &'static str); 7] {
    let ed269 = json!({
        "identifier": "LSXX", "country": "CHE", "type": "COMMON", "restriction": "PROHIBITED",
        "geometry": [{"uomDimensions": "M", "horizontalProjection": {"type": "Circle"}}],
    });
    let ed318 = json!({
        "type": "Feature",
        "geometry": {"type": "Polygon", "coordinates": [], "layer": {"upper": 150}},
        "properties": {"identifier": "FRXX", "country": "FRA", "variant": "COMMON", "zoneAuthority": []},
    });
    let plan = json!({"fileType": "Plan", "geoFence": {}, "mission": {}, "version": 1});
    [
        (
            "an ED-269 file",
            json!({"features": [ed269]}).to_string(),
            "'center' is missing",
        ),
        (
            "an ED-269 file",
            json!({"UASZoneList": [ed269]}).to_string(),
            "'center' is missing",
        ),
        ("an ED-318 file", collection(&ed318), "'type' is missing"),
        (
            "a plan of QGroundControl",
            plan.to_string(),
            "not of version 2",
        ),
        (
            "a list of waypoints",
            "QGC WPL 110\n0\t1\t0\t16\n".to_owned(),
            "no zones",
        ),
        (
            "a KML file",
            "<?xml version=\"1.0\"?><kml><Placemark id=\"a\"><LineString/></Placemark></kml>"
                .to_owned(),
            "draw a Polygon",
        ),
        (
            "a GPX file",
            "<?xml version=\"1.0\"?><gpx></gpx>".to_owned(),
            "ogr2ogr",
        ),
    ]
}

#[test]
fn files_of_other_formats_are_called_by_their_name_with_what_to_do() {
    let desk = Workspace::new();
    for (name, text, remedy) in foreign() {
        let said = composed_with(&desk, &text, 1);
        assert!(said.contains(remedy), "{said}");
        // Those with zones are read, and told zone by zone.
        let has_zones = ["an ED", "a plan", "a KML"]
            .iter()
            .any(|begin| name.starts_with(begin));
        if !has_zones {
            let begins = format!("error: FILE: document: it is {name}");
            assert!(said.starts_with(&begins), "{said}");
            assert_eq!(said.lines().count(), 1, "{said}");
        }
        let file = desk.write("network", &text);
        let run = skyway(&["network", "info", "--quiet", "--network", &file]).exits(1);
        assert!(
            run.stderr.contains(&format!("document: is {name}")),
            "{run:?}"
        );
        assert!(run.stderr.contains(": give a network"), "{run:?}");
        assert_eq!(run.stderr.lines().count(), 1, "{run:?}");
    }
}

#[test]
fn buildings_without_heights_are_counted_where_no_network_comes_of_them() {
    let desk = Workspace::new();
    let square = |east: f64| {
        let [west, east] = [east, east + 0.000_4];
        json!([[
            [west, 0.0],
            [east, 0.0],
            [east, 0.000_4],
            [west, 0.000_4],
            [west, 0.0]
        ]])
    };
    let building = |id: &str, east: f64| {
        json!({
            "type": "Feature", "id": id, "properties": {},
            "geometry": {"type": "Polygon", "coordinates": square(east)},
        })
    };
    let buildings = [
        building("a", 0.0),
        building("b", 0.001),
        building("c", 0.002),
    ];
    let text = json!({"type": "FeatureCollection", "features": buildings}).to_string();
    let file = desk.write("buildings.geojson", text);
    let run = skyway(&["network", "build", &file, "--quiet"]).exits(1);
    assert!(run.stderr.contains("3 of 3 heights are unknown"), "{run:?}");
    assert!(run.stderr.contains("height_m"), "{run:?}");
}

#[test]
fn a_kmz_is_called_a_zip_to_unpack() {
    let desk = Workspace::new();
    let file = desk.write("zones.kmz", "PK\u{3}\u{4}\u{14}");
    let import = ["zone", "import", &file, "--check", "--quiet"];
    let compose = [
        "compose",
        "--quiet",
        "--source=379",
        "--destination=450",
        "--zones",
        &file,
    ];
    for arguments in [&import[..], &compose[..]] {
        let run = skyway(arguments).exits(1);
        assert!(
            run.stderr
                .contains("is a zip archive, which is not read here: unpack it, as a KMZ too"),
            "{run:?}"
        );
    }
}

/// Under one name the second feed would lift the zones of the first.
#[test]
fn a_feed_from_standard_input_has_to_be_named() {
    let nowhere = ["--edge", "http://127.0.0.1:9", "--quiet"];
    let import = [&["zone", "import", "-"][..], &nowhere].concat();
    let run = skyway(&import).exits(2);
    assert!(run.stderr.contains("--feed"), "{run:?}");
    skyway(&[&import[..], &["--feed", "fence"]].concat()).exits(4);
}
