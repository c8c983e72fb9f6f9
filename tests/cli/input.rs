//! What comes in wrong: unknown ids, ids that hold commas, files that cannot be read or make no sense.

use crate::binary::{Workspace, skyway};
use serde_json::{Value, json};

#[test]
fn an_unknown_node_is_refused_with_what_there_is() {
    let error = |arguments: &[&str]| skyway(arguments).exits(2).stderr;
    let reroute = |service: &str| error(&["reroute", "--quiet", "--service", service]);
    assert_eq!(
        reroute("1,999"),
        "error: the network 'Sydney CBD' has no node '999'; ids run from '1' to '476'\n"
    );
    assert_eq!(
        reroute("12"),
        "error: '12' is no leg: give the ids of two nodes, as A,B\n"
    );
    let close = |what: &str| error(&["reroute", "--quiet", "--service", "1,3", "--close", what]);
    assert_eq!(
        close("1,450"),
        "error: nodes '1' and '450' have no segment between them\n"
    );
    let place = |place: &str| error(&["reroute", "-q", "--service", "1,3", "--location", place]);
    assert_eq!(
        place("-33.86,151.2"),
        "error: '-33.86,151.2' is not on Earth; longitude comes first: were longitude and latitude swapped?\n"
    );
    assert_eq!(
        place("-122.4,37.7"),
        "error: --location is 26532 km away, beyond the network; say unknown where it is not known\n"
    );
    assert_eq!(
        place("here"),
        "error: 'here' is no place: give LON,LAT (longitude and latitude in degrees) or the id of a node\n"
    );
}

/// A square of nodes with these ids; neighbours are joined.
fn square(ids: [&str; 4]) -> String {
    let corners = [(0, 0), (100, 0), (100, 100), (0, 100)];
    let nodes = ids.iter().zip(corners);
    let nodes: Vec<Value> = nodes
        .map(|(id, (x, y))| json!({"id": id, "x": x, "y": y, "pads": 1}))
        .collect();
    let links: Vec<Value> = (0..4)
        .map(|place| json!({"source": ids[place], "target": ids[(place + 1) % 4]}))
        .collect();
    json!({"nodes": nodes, "links": links}).to_string()
}

#[test]
fn ids_may_hold_commas() {
    let desk = Workspace::new();
    let network = desk.write("square.json", square(["a,b", "c", "north,east", "d"]));
    let reroute = |arguments: &[&str]| {
        let common = ["reroute", "--json", "--quiet", "--network", &network];
        skyway(&[&common, arguments].concat())
    };
    let path = |arguments: &[&str]| reroute(arguments).exits(0).json()["path"]["nodes"].clone();
    assert_eq!(
        path(&["--service", "a,b,c"]),
        json!(["a,b", "d", "north,east", "c"])
    );
    assert_eq!(
        path(&["--service", "c,north,east"]),
        json!(["c", "a,b", "d", "north,east"])
    );
    let closed = ["--service", "a,b,c", "--close", "north,east,d"];
    assert_eq!(reroute(&closed).exits(0).json()["outcome"], "diverted");
    let run = reroute(&["--service", "a,b,nort,east"]).exits(2);
    assert!(run.stderr.contains("give the ids of two nodes"), "{run:?}");
    let run = reroute(&["--service", "a,b,c", "--destination", "north,esat"]).exits(2);
    assert!(run.stderr.contains("did you mean 'north,east'?"), "{run:?}");
}

#[test]
fn what_can_be_read_in_two_ways_is_refused() {
    let desk = Workspace::new();
    let network = desk.write("square.json", square(["a", "b,c", "a,b", "c"]));
    let common = ["reroute", "-q", "--network", &network, "--service"];
    let both_joined = skyway(&[&common[..], &["a,b,c"]].concat()).exits(2);
    assert!(
        both_joined.stderr.contains("more than one way"),
        "{both_joined:?}"
    );
    let closing = [&common[..], &["a,c", "--close", "a,b,c"]].concat();
    let run = skyway(&closing).exits(2);
    assert!(run.stderr.contains("more than one way"), "{run:?}");
    // By its id a segment has one name.
    let closing = [&common[..], &["a,c", "--close", "a,b-c"]].concat();
    skyway(&closing).exits(0);
}

#[test]
fn a_network_that_makes_no_sense_is_refused_with_every_error() {
    let desk = Workspace::new();
    let refused = |name: &str, contents: &str| {
        let file = desk.write(name, contents);
        let run = skyway(&["network", "info", "--network", &file]).exits(1);
        assert_eq!(run.stdout, "");
        run.stderr.replace(&file, name)
    };
    desk.write("town_edges.csv", "u,v\n1,2\n");
    let nodes = json!([{"id": 1, "x": 0, "y": 0}, {"id": 1, "x": 5, "y": "7"}, {"x": 1}]);
    let links = json!([{"source": 1, "target": 2}]);
    let graph = json!({"nodes": nodes, "links": links}).to_string();
    insta::assert_snapshot!(
        [
            refused("graph.json", &graph),
            refused("empty.geojson", ""),
            refused(
                "truncated.geojson",
                "{\"type\": \"FeatureCollection\", \"features\": ["
            ),
            refused("list.json", "[]"),
            refused("town_nodes.csv", "id,lon,lat\n1,0,0\n2,far,0\n"),
        ]
        .concat()
    );
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let desk = Workspace::new();
    let error = |arguments: &[&str]| skyway(arguments).exits(1).stderr;
    let missing = desk.path("missing.geojson");
    let message = format!("error: cannot read {missing}: No such file or directory (os error 2)\n");
    assert_eq!(error(&["network", "info", "--network", &missing]), message);
    assert_eq!(
        error(&["network", "info", "--network", "sidney"]),
        "error: there is no file sidney; the bundled networks are sydney and corridor\n"
    );
    let latin = desk.write("latin.geojson", b"{\"name\": \"caf\xe9\"}");
    let message = format!("error: {latin} is not UTF-8 text: see byte 13\n");
    assert_eq!(error(&["network", "info", "--network", &latin]), message);
    let cut_short = desk.write("cut.geojson.gz", [0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3, 1]);
    let told = error(&["network", "info", "--network", &cut_short]);
    assert!(
        told.starts_with(&format!("error: cannot read {cut_short}: ")),
        "{told}"
    );
    let told = error(&["reroute", "--requests", &missing, "--quiet"]);
    assert!(told.starts_with("error: cannot read "), "{told}");
    let nowhere = desk.path("no/such/directory.svg");
    let told = error(&["network", "draw", "--quiet", "--output", &nowhere]);
    assert!(told.starts_with("error: cannot write "), "{told}");
}

#[test]
fn zones_that_make_no_sense_are_refused_with_every_error() {
    let desk = Workspace::new();
    let circle = |id: &str, radius_m: f64| {
        json!({
            "type": "Feature",
            "id": id,
            "geometry": {"type": "Point", "coordinates": [151.21, -33.86]},
            "properties": {"radius_m": radius_m, "colour": "red"},
        })
    };
    let features = [circle("a", -1.0), circle("a", 50.0)];
    let zones = json!({"type": "FeatureCollection", "features": features}).to_string();
    let file = desk.write("zones.geojson", zones);
    let run = skyway(&["reroute", "-q", "--service", "1,3", "--zones", &file]).exits(1);
    insta::assert_snapshot!(run.stderr.replace(&file, "zones.geojson"));

    let mut valid = circle("a", 50.0);
    valid["properties"] = json!({"radius_m": 50});
    let one = desk.write("one.geojson", valid.to_string());
    let two = desk.write("two.geojson", valid.to_string());
    let arguments = [
        "reroute",
        "-q",
        "--service",
        "1,3",
        "--zones",
        &one,
        "--zones",
        &two,
    ];
    let run = skyway(&arguments).exits(1);
    assert!(
        run.stderr
            .contains("the id 'a' is that of a zone of another file"),
        "{run:?}"
    );
}
