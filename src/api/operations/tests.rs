//! The table and its index agree, and let no caller do what it may not.

use super::*;

#[test]
fn the_table_is_in_the_order_of_its_operations() {
    for (place, row) in TABLE.iter().enumerate() {
        assert_eq!(row.operation as usize, place, "{}", row.name);
        assert_eq!(row.operation.row().name, row.name);
    }
}

#[test]
fn every_row_resolves_to_itself_at_its_daemon_and_nowhere_else() {
    for row in TABLE {
        for daemon in [Daemon::Edge, Daemon::Registry] {
            let found = |operation: Option<Operation>| match row.operation.is_of(daemon) {
                true => assert_eq!(operation, Some(row.operation), "{}", row.name),
                false => assert_ne!(operation, Some(row.operation), "{}", row.name),
            };
            for (method, path) in row.rest {
                let filled = path.replace("{id}", "acme:7").replace("{*file}", "a/b.js");
                let filled = filled
                    .replace("{network}", "sydney")
                    .replace("{message}", "m:1");
                found(Operation::of(daemon, method, &filled));
            }
            if let Some(path) = row.grpc {
                found(Operation::of(daemon, &Method::POST, path));
                assert_eq!(Operation::of(daemon, &Method::GET, path), None, "{path}");
            }
        }
    }
}

#[test]
fn a_registry_has_several_ids_in_a_path() {
    let of = |path| Operation::of(Daemon::Registry, &Method::GET, path);
    assert_eq!(of("/v1/networks/a"), Some(Operation::RegistryGetNetwork));
    assert_eq!(
        of("/v1/networks/a/zones"),
        Some(Operation::RegistryListZones)
    );
    assert_eq!(
        of("/v1/networks/a/zones/b"),
        Some(Operation::RegistryGetZone)
    );
    assert_eq!(of("/v1/drones/acme:7"), Some(Operation::GetFleetDrone));
    assert_eq!(of("/v1/services/:search"), Some(Operation::GetService));
    let post = |path| Operation::of(Daemon::Registry, &Method::POST, path);
    assert_eq!(post("/v1/services:search"), Some(Operation::SearchServices));
    assert_eq!(
        post("/v1/webhooks/a/messages/b/resend"),
        Some(Operation::ResendMessage)
    );
    assert_eq!(post("/v1/webhooks/a/messages//resend"), None);
    for path in [
        "/v1/networks/",
        "/v1/networks//zones",
        "/v1/networks/a/",
        "/v1/networks/a/zones/",
        "/v1/networks/a/zones/b/c",
        "/v1/zones",
    ] {
        assert_eq!(of(path), None, "{path}");
    }
}

#[test]
fn what_is_not_in_the_table_is_not_found() {
    let paths = [
        "",
        "*",
        "//",
        "/v1",
        "/v1/",
        "/v2/failures",
        "/v1/failures/",
        "/v1/failures/7",
        "/v1/failures:batch/",
        "/v1/zones/",
        "/v1/zones:previews",
        "/v1/zones/a/b",
        "/v1/plans//ack",
        "/v1/plans/a/b/ack",
        "/v1/plans/7/acks",
        "/skyway.v1.Plans/",
        "/skyway.v1.Plans/CreatePlan/",
        "/docsx",
        "/page/",
        "/v1/failures%3Abatch",
    ];
    for path in paths {
        for method in [Method::GET, Method::POST, Method::DELETE] {
            assert_eq!(
                Operation::of(Daemon::Edge, &method, path),
                None,
                "{method} {path}"
            );
        }
    }
}

#[test]
fn actions_of_a_collection_are_not_ids() {
    let of = |path| Operation::of(Daemon::Edge, &Method::POST, path);
    assert_eq!(of("/v1/failures:batch"), Some(Operation::ReportFailures));
    assert_eq!(of("/v1/zones:preview"), Some(Operation::PreviewZone));
    let get = |path| Operation::of(Daemon::Edge, &Method::GET, path);
    assert_eq!(get("/v1/zones:preview"), None);
    assert_eq!(get("/v1/zones/:preview"), Some(Operation::GetZone));
    assert_eq!(get("/v1/plans/ack"), Some(Operation::GetPlan));
}

#[test]
fn a_known_path_tells_its_methods() {
    let method = |allowed: &str| {
        Err(Unresolved::Method {
            allowed: allowed.to_owned(),
        })
    };
    assert_eq!(
        Operation::of_rest(Daemon::Edge, &Method::GET, "/v1/failures"),
        method("POST")
    );
    assert_eq!(
        Operation::of_rest(Daemon::Edge, &Method::PATCH, "/v1/zones/a"),
        method("PUT, GET, DELETE")
    );
    assert_eq!(
        Operation::of_rest(Daemon::Edge, &Method::HEAD, "/v1/zones/a"),
        Ok(Operation::GetZone)
    );
}

#[test]
fn anyone_may_do_everything_and_drones_write_no_airspace() {
    for row in TABLE {
        assert!(row.operation.allows(Role::Anyone), "{}", row.name);
        if row.class == Class::ZoneWrite && row.operation.is_of(Daemon::Edge) {
            let writers = [Role::Drone, Role::Edge, Role::Metrics];
            assert!(
                !writers.iter().any(|role| row.operation.allows(*role)),
                "{}",
                row.name
            );
            assert!(row.operation.allows(Role::Operator), "{}", row.name);
        }
    }
}

#[test]
fn grpc_has_nothing_that_operators_alone_do() {
    // But for the clock, which simulators move.
    let rows = TABLE.iter().filter(|row| row.grpc.is_some());
    for row in rows.filter(|row| row.operation != Operation::AdvanceClock) {
        let is_for_others = [Role::Drone, Role::Edge]
            .into_iter()
            .any(|role| row.operation.allows(role));
        assert!(is_for_others, "{} is for operators: REST has it", row.name);
    }
}
