//! Networks through every format, to the byte; what is lost is told, and what is no network is called by its name.

#[cfg(unix)]
use crate::binary::skyway_on_a_full_disk;
use crate::binary::{Workspace, read, repository, skyway};
#[cfg(feature = "edge")]
use crate::binary::{read_bytes, skyway_with_input};
use serde_json::json;

fn convert(network: &str, output: &str) -> String {
    let arguments = [
        "network",
        "convert",
        "--quiet",
        "--network",
        network,
        "--output",
        output,
    ];
    skyway(&arguments).exits(0).stderr
}

/// Sydney through a file of this name, and back to GeoJSON.
fn through(desk: &Workspace, name: &str) -> String {
    let (there, back) = (desk.path(name), desk.path("back.geojson"));
    assert_eq!(convert("sydney", &there), "");
    assert_eq!(convert(&there, &back), "");
    desk.read("back.geojson")
}

#[test]
fn a_network_survives_graphml_to_the_byte() {
    let desk = Workspace::new();
    let bundled = read(&repository("data/sydney-cbd.geojson"));
    assert!(
        through(&desk, "sydney.graphml") == bundled,
        "not the same bytes"
    );
    assert!(
        through(&desk, "sydney.graphml.gz") == bundled,
        "not the same bytes"
    );
    assert!(desk.is_gzip("sydney.graphml.gz"));
}

#[cfg(feature = "edge")]
#[test]
fn a_network_survives_geopackage_to_the_byte() {
    let desk = Workspace::new();
    let bundled = read(&repository("data/sydney-cbd.geojson"));
    assert!(
        through(&desk, "sydney.gpkg") == bundled,
        "not the same bytes"
    );
    assert!(
        through(&desk, "sydney.gpkg.gz") == bundled,
        "not the same bytes"
    );
    // Lengths that were not stated are from the first conversion on.
    let drawn = skyway(&["network", "generate", "--nodes", "40", "--quiet"]).exits(0);
    let drawn = desk.write("drawn.geojson", drawn.stdout);
    let [planar, stated, again] =
        ["planar.gpkg", "stated.geojson", "again.geojson"].map(|name| desk.path(name));
    convert(&drawn, &stated);
    convert(&drawn, &planar);
    convert(&planar, &again);
    assert!(
        desk.read("again.geojson")
            .contains(r#""coordinates":"planar""#)
    );
    assert!(
        desk.read("again.geojson") == desk.read("stated.geojson"),
        "not the same bytes"
    );
    let run = skyway(&["edge", "--no-store", "--network", &planar]).exits(1);
    assert!(
        run.stderr
            .contains("make one of it with skyway network convert"),
        "{run:?}"
    );
}

#[cfg(feature = "edge")]
#[test]
fn a_geopackage_of_something_else_says_what_it_lacks() {
    let desk = Workspace::new();
    let broken = desk.path("broken.gpkg");
    convert("sydney", &broken);
    let told = |bytes: &[u8]| {
        let arguments = ["network", "info", "--quiet", "--network", "-"];
        skyway_with_input(&arguments, bytes).exits(1).stderr
    };
    let whole = read_bytes(&broken);
    let cut = told(&whole[..whole.len() / 2]);
    assert!(cut.contains("- cannot be read: "), "{cut}");
    let renamed = replaced(&whole, b"segments", b"sections");
    let lacking = told(&renamed);
    let expected = "has the layers nodes, sections; a network has the layers nodes (points) and segments (lines)";
    assert!(lacking.contains(expected), "{lacking}");
}

/// The bytes with every occurrence of some replaced by as many others.
#[cfg(feature = "edge")]
fn replaced(bytes: &[u8], original: &[u8], other: &[u8]) -> Vec<u8> {
    assert_eq!(original.len(), other.len());
    let mut replaced = bytes.to_vec();
    for place in 0..bytes.len() - original.len() {
        if bytes[place..].starts_with(original) {
            replaced[place..place + other.len()].copy_from_slice(other);
        }
    }
    replaced
}

#[test]
fn what_a_network_has_no_place_for_is_told() {
    let desk = Workspace::new();
    let graph = json!({
        "graph": {"created": "today"},
        "nodes": [{"id": 1, "x": 0, "y": 0, "colour": "red"}, {"id": 2, "x": 9, "y": 0}],
        "links": [{"source": 1, "target": 2, "lanes": 2}],
    });
    let network = desk.write("graph.json", graph.to_string());
    let told = convert(&network, &desk.path("graph.graphml"));
    for kind in ["the network: created", "nodes: colour", "segments: lanes"] {
        let line = format!("warning: a network has no place for some attributes of {kind}\n");
        assert!(told.contains(&line), "{told}");
    }
    let info = skyway(&[
        "network",
        "info",
        "--json",
        "--quiet",
        "--network",
        &network,
    ])
    .exits(0);
    assert_eq!(info.json()["not_read"][1], "attributes of nodes: colour");
    let nodes = desk.write("town_nodes.csv", "id,x,y,floor\n1,0,0,7\n2,9,0,8\n");
    desk.write("town_edges.csv", "u,v\n1,2\n");
    let told = convert(&nodes, &desk.path("town.geojson"));
    assert!(told.ends_with("attributes of nodes: floor\n"), "{told}");
}

#[test]
fn the_format_is_named_by_the_output_or_asked_for() {
    let desk = Workspace::new();
    let output = desk.path("sydney.json");
    for name in [output.as_str(), "-"] {
        let run = skyway(&["network", "convert", "--output", name]).exits(2);
        let asks = "says nothing of a format; name one with --to";
        assert!(run.stderr.contains(asks), "{run:?}");
    }
    let stated = [
        "network", "convert", "--quiet", "--to", "graphml", "--output", &output,
    ];
    skyway(&stated).exits(0);
    assert!(desk.read("sydney.json").starts_with("<?xml"));
}

#[test]
fn what_is_no_text_is_called_by_its_name() {
    let desk = Workspace::new();
    let database = [b"SQLite format 3\0".as_slice(), &[0; 84]].concat();
    for (bytes, expected) in [
        (
            b"\0\0\0\x0d\x0a\x09OSMHeader\x18\x01".to_vec(),
            "is an OSM extract (.osm.pbf), which has a map: skyway network build makes a network of the buildings in it",
        ),
        (
            b"PK\x03\x04".to_vec(),
            "is a zip archive, which is not read here: unpack it, as a KMZ too, and name the file that is in it",
        ),
        (
            database,
            "is a database of SQLite, which is not read here: convert it with ogr2ogr -f GeoJSON",
        ),
    ] {
        let file = desk.write("network", bytes);
        let run = skyway(&["network", "info", "--quiet", "--network", &file]).exits(1);
        assert!(run.stderr.ends_with(&format!("{expected}\n")), "{run:?}");
        let run = skyway(&[
            "compose",
            "--source=379",
            "--destination=450",
            "--zones",
            &file,
        ]);
        assert!(run.exits(1).stderr.contains(expected));
    }
    let osm = desk.write("map.osm", "<?xml version='1.0'?><osm version='0.6'></osm>");
    let run = skyway(&["network", "info", "--quiet", "--network", &osm]).exits(1);
    assert!(
        run.stderr
            .contains("make it a .osm.pbf, as osmium cat does"),
        "{run:?}"
    );
    let graph = desk.write("graph.xml", "<graphml><graph/></graphml>");
    let run = skyway(&[
        "compose",
        "--source=379",
        "--destination=450",
        "--zones",
        &graph,
    ])
    .exits(1);
    assert!(run.stderr.contains("a GraphML file"), "{run:?}");
    assert!(run.stderr.contains("give it with --network"), "{run:?}");
}

#[test]
fn a_box_goes_with_an_extract() {
    let buildings = repository("data/sydney/buildings.geojson");
    let buildings = buildings.to_str().expect("UTF-8");
    let run = skyway(&["network", "build", buildings, "--bbox", "151,-34,152,-33"]).exits(2);
    assert!(
        run.stderr.contains("--bbox takes a part of an OSM extract"),
        "{run:?}"
    );
    for turned in [
        "152,-34,151,-33",
        "-190,0,1,1",
        "1,2,3",
        "a,b,c,d",
        "0,0,0,0",
    ] {
        let run = skyway(&["network", "build", buildings, "--bbox", turned]).exits(2);
        assert!(run.stderr.contains("invalid value"), "{run:?}");
    }
}

#[cfg(unix)]
#[test]
fn a_file_is_written_whole_or_stays_as_it_was() {
    let desk = Workspace::new();
    let picture = desk.write("sydney.svg", "the one before");
    let draw = ["network", "draw", "--quiet", "--output", &picture];
    let full = skyway_on_a_full_disk(&draw).exits(1);
    assert!(full.stderr.contains("cannot write"), "{full:?}");
    assert_eq!(desk.read("sydney.svg"), "the one before");
    assert_eq!(desk.list(""), ["sydney.svg"]);
    skyway(&draw).exits(0);
    let drawn = desk.read("sydney.svg");
    assert!(drawn.starts_with("<svg"));
    let draw = ["network", "draw", "--quiet", "--output", "/dev/stdout"];
    assert_eq!(skyway(&draw).exits(0).stdout, drawn);
}

#[cfg(all(unix, feature = "edge"))]
#[test]
fn a_link_to_a_file_stays_a_link() {
    let desk = Workspace::new();
    let picture = desk.write("sydney.svg", "the one before");
    desk.link("latest.svg", &picture);
    let link = desk.path("latest.svg");
    skyway(&["network", "draw", "--quiet", "--output", &link]).exits(0);
    assert!(desk.read("sydney.svg").starts_with("<svg"));
}
