//! What daemons ask of the system that they run on.

use crate::binary::{Server, Workspace, skyway, starts_over};

#[test]
fn no_request_waits_for_a_huge_page() {
    for role in ["edge", "registry"] {
        let desk = Workspace::new();
        let daemon = Server::start(&desk, &[role, "--store", &desk.path("store.db")]);
        // Systems before Linux 5.0 do not tell.
        let huge_pages = daemon.status("THP_enabled");
        assert!(
            matches!(huge_pages.as_deref(), None | Some("0")),
            "{role}: {huge_pages:?}"
        );
        assert_eq!(daemon.end(), 0);
    }
}

#[test]
#[cfg(unix)]
fn a_store_has_one_edge_whatever_it_is_called() {
    let desk = Workspace::new();
    let (store, link, chain) = (
        desk.path("e1.db"),
        desk.path("link.db"),
        desk.path("chain.db"),
    );
    desk.link("link.db", "e1.db");
    desk.link("chain.db", &link);
    // By its link first, when there is no file yet.
    let edge = Server::start(&desk, &["edge", "--store", &link]);
    for name in [&store, &link, &chain] {
        let (code, told) = starts_over(&desk, name).expect("it does not serve");
        assert_ne!(code, 0);
        assert!(told.contains("another edge"), "{name}: {told}");
    }
    assert_eq!(edge.end(), 0);
    // SQLite keeps its log beside one name of a file: two names are two logs.
    desk.twin("twin.db", "e1.db");
    let (code, told) = starts_over(&desk, &desk.path("twin.db")).expect("it does not serve");
    assert_ne!(code, 0);
    assert!(told.contains("2 names"), "{told}");
}

#[test]
fn an_empty_store_is_not_taken_for_a_new_one() {
    for role in ["edge", "registry"] {
        let desk = Workspace::new();
        let store = desk.write("store.db", "");
        let ports = ["--listen=127.0.0.1:0", "--admin-listen=127.0.0.1:0"];
        let arguments = [&[role, "--quiet", "--store", &store][..], &ports].concat();
        let run = skyway(&arguments).exits(1);
        assert!(run.stderr.contains("it is empty"), "{role}: {run:?}");
        let remedy = "restore it from a backup, or remove the file to begin with a new one";
        assert!(run.stderr.contains(remedy), "{role}: {run:?}");
        assert_eq!(desk.read("store.db"), "", "{role}: it is left as it is");
    }
}

#[test]
fn what_is_not_there_is_told_with_what_to_do() {
    let desk = Workspace::new();
    let store = desk.path("edge.db");
    let nowhere = [
        "edge",
        "--quiet",
        "--network=nothere",
        "--listen=127.0.0.1:0",
        "--store",
        &store,
    ];
    let run = skyway(&nowhere).exits(1);
    assert!(
        run.stderr
            .contains("there is no file nothere; the bundled networks are sydney and corridor"),
        "{run:?}"
    );
    let run = skyway(&["replay", "1-1", "--edge", "http://127.0.0.1:1"]).exits(4);
    assert!(
        run.stderr.contains("start an edge with skyway edge"),
        "{run:?}"
    );
    assert!(run.stderr.contains("--store"), "{run:?}");
    assert_eq!(run.stderr.matches("127.0.0.1:1/").count(), 1, "{run:?}");
}

#[cfg(unix)]
#[test]
fn the_log_says_who_changed_what() {
    let desk = Workspace::new();
    let edge = Server::start(&desk, &["edge", "--no-store"]);
    let zone = r#"{"type":"Feature","id":"fair","geometry":{"type":"Point","coordinates":[151.2086,-33.866]},"properties":{"radius_m":120}}"#;
    Server::ask(edge.address, "POST /v1/zones", "", zone);
    assert_eq!(edge.end(), 0);
    let log = desk.read("log");
    let line = log.lines().find(|line| line.contains("zone_put"));
    let line = line.expect("it is told");
    for part in ["INFO", "subject", "anyone", "fair"] {
        assert!(line.contains(part), "{line}");
    }
}

#[test]
fn a_database_that_is_not_there_is_named_with_the_cause() {
    let arguments = [
        "registry",
        "--store",
        "postgres://keeper:secret@127.0.0.1:1/airspace",
        "--listen",
        "127.0.0.1:0",
        "--admin-listen",
        "127.0.0.1:0",
    ];
    let run = skyway(&arguments);
    assert_ne!(run.code, 0);
    for part in ["127.0.0.1:1", "airspace", "refused"] {
        assert!(run.stderr.contains(part), "{run:#?}");
    }
    assert!(!run.stderr.contains("secret"), "{run:#?}");
}

/// The lines of a page of metrics.
fn metrics(daemon: &Server, accept: &str) -> Vec<String> {
    let headers = format!("accept: {accept}\r\n");
    let page = Server::ask(daemon.admin, "GET /metrics", &headers, "");
    page.lines().map(str::to_owned).collect()
}

#[test]
fn metrics_are_told_in_the_format_that_the_scraper_reads() {
    for (role, prefix) in [("edge", "skyway"), ("registry", "skyway_registry")] {
        let desk = Workspace::new();
        let daemon = Server::start(&desk, &[role, "--store", &desk.path("store.db")]);
        let of_today = metrics(&daemon, "application/openmetrics-text;version=1.0.0");
        assert!(of_today.contains(&format!("# TYPE {prefix}_requests counter")));
        assert_eq!(of_today.last().map(String::as_str), Some("# EOF"));
        let older = metrics(&daemon, "text/plain;version=0.0.4");
        assert!(older.contains(&format!("# TYPE {prefix}_requests_total counter")));
        let has = |begins: &str| older.iter().any(|line| line.starts_with(begins));
        assert!(has(&format!(
            "# HELP {prefix}_requests_total Requests answered"
        )));
        assert!(!has("# EOF") && !has("# UNIT"));
        assert!(has("content-type: text/plain; version=0.0.4"));
        // Each sample has the help and type of its name.
        let named = |kind: &str| -> Vec<String> {
            let named = older.iter().filter_map(|line| line.strip_prefix(kind));
            let names = named.filter_map(|line| line.split(' ').next());
            names.map(str::to_owned).collect()
        };
        let (helps, types) = (named("# HELP "), named("# TYPE "));
        for line in older.iter().filter(|line| line.starts_with("skyway")) {
            let name = line.split(['{', ' ']).next().unwrap_or_default();
            let family = ["_bucket", "_sum", "_count"]
                .iter()
                .find_map(|end| name.strip_suffix(end));
            let is_named = |names: &[String]| {
                names
                    .iter()
                    .any(|of| of == name || Some(of.as_str()) == family)
            };
            assert!(is_named(&helps) && is_named(&types), "{role}: {line}");
        }
        assert_eq!(daemon.end(), 0);
    }
}

#[test]
fn what_is_counted_is_told_before_it_happens() {
    let desk = Workspace::new();
    let away = ["--no-store", "--registry-url", "http://127.0.0.1:1"];
    let edge = Server::start(&desk, &[&["edge"], &away[..]].concat());
    let told = metrics(&edge, "text/plain");
    for line in [
        "skyway_requests_total{operation=\"report_failure\",dialect=\"rest\",status=\"200\"} 0",
        "skyway_requests_total{operation=\"report_failure\",dialect=\"grpc\",status=\"0\"} 0",
        "skyway_shed_total{class=\"failure\",reason=\"slots\"} 0",
        "skyway_connections_closed_total{reason=\"stalled\"} 0",
        "skyway_refusals_total{code=\"not_found\"} 0",
        "skyway_registry_failures_total{reason=\"unreadable\"} 0",
        "skyway_alarms_total{kind=\"no_route\"} 0",
        "skyway_checker_cases_total 0",
    ] {
        assert!(
            told.iter().any(|told| told == line),
            "no {line} in {told:#?}"
        );
    }
    let of_others = told
        .iter()
        .find(|line| line.contains("registry_put_network"));
    assert_eq!(of_others, None, "an edge answers no such request");
    assert_eq!(edge.end(), 0);
}
