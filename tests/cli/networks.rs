//! Networks made, read, converted and refused.

use crate::binary::{Workspace, read, repository, skyway, skyway_with_input};
use serde_json::{Value, json};

fn info(network: &str) -> Value {
    skyway(&["network", "info", "--json", "--network", network])
        .exits(0)
        .json()
}

#[test]
fn the_bundled_networks_are_there_by_name() {
    let sydney = info("sydney");
    assert_eq!(sydney["nodes"], 476);
    assert_eq!(sydney["coordinates"], "geographic");
    let attribution = sydney["attribution"].as_str().expect("text");
    assert!(attribution.contains("OpenStreetMap contributors"));
    assert_eq!(info("corridor")["components"], json!([280]));
    insta::assert_snapshot!(skyway(&["network", "info"]).exits(0).stdout);
}

#[test]
fn a_generated_network_is_that_of_its_seed() {
    let generate = |seed: &str| {
        let variables = [
            "--nodes",
            "150",
            "--max-neighbours",
            "6",
            "--map-size",
            "1000",
        ];
        let rest = ["--reach", "0.2", "--seed", seed];
        let arguments = [&["network", "generate"][..], &variables, &rest].concat();
        skyway(&arguments).exits(0).stdout
    };
    let network = generate("7");
    assert_eq!(network, generate("7"));
    assert_ne!(network, generate("8"));
    let arguments = ["network", "info", "--json", "--network", "-"];
    let figures = skyway_with_input(&arguments, network.as_bytes())
        .exits(0)
        .json();
    assert_eq!(figures["nodes"], 150);
    assert!(figures["degree"]["max"].as_f64().expect("a number") <= 6.0);
    assert!(figures["length_m"]["max"].as_f64().expect("a number") <= 200.0);
}

#[test]
fn sydney_is_built_from_its_buildings_to_the_byte() {
    let desk = Workspace::new();
    let bundled = read(&repository("data/sydney-cbd.geojson"));
    let attribution = info("sydney")["attribution"]
        .as_str()
        .expect("text")
        .to_owned();
    let buildings = repository("data/sydney/buildings.geojson");
    let built = desk.path("built.geojson");
    let run = skyway(&[
        "network",
        "build",
        buildings.to_str().expect("UTF-8"),
        "--extract",
        "north2023",
        "--min-height",
        "10",
        "--name",
        "Sydney CBD",
        "--attribution",
        &attribution,
        "--output",
        &built,
    ]);
    assert_eq!(run.exits(0).stdout, "");
    assert!(
        desk.read("built.geojson") == bundled,
        "the bundled network is another one"
    );
}

#[test]
fn a_network_survives_conversion() {
    let native = skyway(&["network", "convert", "--to", "geojson"])
        .exits(0)
        .stdout;
    assert!(
        native == read(&repository("data/sydney-cbd.geojson")),
        "not the same bytes"
    );

    let desk = Workspace::new();
    let node_link = desk.path("sydney.json");
    skyway(&[
        "network",
        "convert",
        "--to",
        "node-link",
        "--output",
        &node_link,
    ])
    .exits(0);
    let packed = desk.path("sydney.geojson.gz");
    skyway(&[
        "network",
        "convert",
        "--network",
        &node_link,
        "--to",
        "geojson",
        "--output",
        &packed,
    ])
    .exits(0);
    assert!(desk.is_gzip("sydney.geojson.gz"));
    let (sydney, again) = (info("sydney"), info(&packed));
    for figure in [
        "name",
        "attribution",
        "nodes",
        "segments",
        "components",
        "pads",
        "degree",
    ] {
        assert_eq!(again[figure], sydney[figure], "{figure}");
    }
    assert_eq!(again["repairs"], json!([]));
    let converted = [
        "network",
        "convert",
        "--network",
        &packed,
        "--to",
        "geojson",
    ];
    assert_eq!(
        nodes_of(&skyway(&converted).exits(0).json()),
        nodes_of(&serde_json::from_str(&native).expect("JSON"))
    );
}

/// The nodes of a network in the native format, with all that it says of them.
fn nodes_of(network: &Value) -> Vec<&Value> {
    let features = network["features"].as_array().expect("features");
    let nodes = features
        .iter()
        .filter(|feature| feature["properties"]["kind"] == "node");
    nodes.collect()
}

#[test]
fn node_links_say_altitudes_with_their_references() {
    let node = |id: &str, x: f64, reference: &str| {
        json!({
            "type": "Feature",
            "id": id,
            "geometry": {"type": "Point", "coordinates": [x, 0.0]},
            "properties": {"altitude_m": 40.5, "altitude_reference": reference}
        })
    };
    let network = json!({
        "type": "FeatureCollection",
        "skyway": {"format": 1, "coordinates": "planar"},
        "attribution": "the land registry",
        "features": [node("a", 0.0, "agl"), node("b", 9.0, "amsl"), node("c", 19.0, "wgs84")]
    });
    let arguments = ["network", "convert", "--network", "-", "--to", "node-link"];
    let converted = skyway_with_input(&arguments, network.to_string().as_bytes())
        .exits(0)
        .json();
    for (place, reference) in ["agl", "amsl", "wgs84"].into_iter().enumerate() {
        let node = &converted["nodes"][place];
        assert_eq!(node["altitude_m"], 40.5, "{node}");
        assert_eq!(node["altitude_reference"], reference, "{node}");
    }
    assert_eq!(converted["graph"]["attribution"], "the land registry");
}

#[test]
fn a_network_in_csv_finds_its_edges() {
    let desk = Workspace::new();
    let nodes = desk.write(
        "town_nodes.csv",
        "id,x,y,pads\n1,0,0,1\n2,100,0,0\n3,0,100,2\n",
    );
    desk.write(
        "town_edges.csv",
        "u,v,length_m\n1,2,100\n2,3,150\n1,2,120\n",
    );
    let town = info(&nodes);
    assert_eq!((&town["nodes"], &town["segments"]), (&json!(3), &json!(2)));
    let repairs = town["repairs"].as_array().expect("repairs");
    assert_eq!(repairs.len(), 1, "{repairs:?}");
    let run = skyway(&["network", "info", "--network", &nodes]).exits(0);
    assert!(
        run.stderr.contains("1 repair to the data"),
        "{}",
        run.stderr
    );

    let lonely = desk.write("village.csv", "id,x,y\n1,0,0\n2,100,0\n");
    let run = skyway(&["network", "info", "--network", &lonely]).exits(1);
    assert!(
        run.stderr.contains("name the edges with --edges"),
        "{}",
        run.stderr
    );
    let edges = desk.write("elsewhere.csv", "source,target\n1,2\n");
    let run = skyway(&[
        "network",
        "info",
        "--network",
        &lonely,
        "--edges",
        &edges,
        "--json",
    ]);
    assert_eq!(run.exits(0).json()["total_length_m"], 100.0);
}

/// Half a delivery from 1 to 2, 960 m and one minute apart, as each is from 3.
#[test]
fn fractions_of_deliveries_count() {
    let desk = Workspace::new();
    let town = desk.write(
        "town_nodes.csv",
        "id,x,y\n1,0,0\n2,960,0\n3,480,831.3843876\n",
    );
    desk.write("town_edges.csv", "u,v\n1,2\n2,3\n1,3\n");
    let demand = desk.write("demand.csv", "from,to,deliveries\n1,2,0.5\n");
    let question = ["network", "criticality", "--network", &town];
    let run = skyway(&[&question[..], &["--demand", &demand]].concat()).exits(0);
    assert!(run.stderr.contains("0.5 deliveries, 0 without"), "{run:?}");
    let rows = run.stdout.lines().map(str::split_whitespace);
    let rows: Vec<Vec<&str>> = rows.map(Iterator::collect).collect();
    let segment = ["segment", "1-2", "0", "0", "0", "0.5", "0.5", "0.5", "1.00"];
    assert!(rows.contains(&segment.to_vec()), "{}", run.stdout);
}
