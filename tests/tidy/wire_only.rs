//! The load test is a stranger to the daemons: it knows the shapes that go over the wire and nothing else of them.

use crate::repository::File;
use crate::rust::paths;

/// What it may name of the library: the shapes of REST, the messages of gRPC, and how one becomes the other.
const OF_THE_WIRE: &[&str] = &[
    "skyway::wire",
    "skyway::api::grpc::proto",
    "skyway::api::grpc::IntoProto",
];

/// The files of the bench that are compiled into it, too.
const OF_THE_BENCH: &[&str] = &["benches/service/cores.rs", "benches/service/echo.rs"];

pub(crate) fn beyond_the_wire(file: &File) -> Vec<String> {
    let is_load = file.path.starts_with("loadtest/") && file.is_rust();
    if !is_load && !OF_THE_BENCH.contains(&file.path.as_str()) {
        return Vec::new();
    }
    let mut findings = Vec::new();
    for (line, segments) in paths(&file.tokens()) {
        if segments[0] != "skyway" {
            continue;
        }
        let path = segments.join("::");
        let within =
            |allowed: &&&str| path == **allowed || path.starts_with(&format!("{allowed}::"));
        if !OF_THE_WIRE.iter().any(|allowed| within(&allowed)) {
            findings.push(format!(
                "{}:{line}: {path} is not of the wire, which is all that the load test knows",
                file.path
            ));
        }
    }
    findings
}

#[test]
fn what_is_beyond_the_wire_is_found() {
    let findings = |path: &str, text: &str| {
        let file = File {
            path: path.to_owned(),
            executable: false,
            text: text.to_owned(),
        };
        beyond_the_wire(&file).len()
    };
    let allowed = "use skyway::api::grpc::{IntoProto, proto};\nuse skyway::wire::{Id, Plan};";
    assert_eq!(findings("loadtest/src/mix.rs", allowed), 0);
    let engine = "fn f() { skyway::routing::search(); }";
    assert_eq!(findings("loadtest/src/mix.rs", engine), 1);
    let inside = "use skyway::{api::grpc::Limits, wire, edge::Edge};";
    assert_eq!(findings("benches/service/echo.rs", inside), 2);
    assert_eq!(findings("benches/service/workload.rs", engine), 0);
}
