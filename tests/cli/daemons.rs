//! What daemons ask of the system that they run on.

use crate::binary::{Desk, Server, command};

#[test]
fn no_request_waits_for_a_huge_page() {
    for role in ["edge", "registry"] {
        let desk = Desk::new();
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

/// Starts an edge over a store by one of its names; gives what it says as it ends, or nothing where it serves.
fn starts_over(desk: &Desk, store: &str) -> Option<(i32, String)> {
    let ports = desk.path("other-ports.json");
    let log = std::fs::File::create(desk.path("other-log")).expect("a file");
    let anywhere = ["--listen", "127.0.0.1:0", "--admin-listen", "127.0.0.1:0"];
    let mut edge = command(&["edge", "--store", store]);
    edge.args(anywhere).args(["--ports-file", &ports]);
    edge.stdin(std::process::Stdio::null()).stderr(log);
    let mut edge = edge.spawn().expect("a binary that starts");
    loop {
        if let Some(status) = edge.try_wait().expect("a child") {
            let code = status.code().expect("no signal");
            return Some((code, desk.read("other-log")));
        }
        if !std::fs::read(&ports).unwrap_or_default().is_empty() {
            edge.kill().expect("a child");
            edge.wait().expect("a child");
            return None;
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
}

#[test]
#[cfg(unix)]
fn a_store_has_one_edge_whatever_it_is_called() {
    let desk = Desk::new();
    let (store, link, chain) = (
        desk.path("e1.db"),
        desk.path("link.db"),
        desk.path("chain.db"),
    );
    std::os::unix::fs::symlink("e1.db", &link).expect("a link");
    std::os::unix::fs::symlink(&link, &chain).expect("a link to a link");
    // By its link first, when there is no file yet.
    let edge = Server::start(&desk, &["edge", "--store", &link]);
    for name in [&store, &link, &chain] {
        let (code, told) = starts_over(&desk, name).expect("it does not serve");
        assert_ne!(code, 0);
        assert!(told.contains("another edge"), "{name}: {told}");
    }
    assert_eq!(edge.end(), 0);
    // SQLite keeps its log beside one name of a file: two names are two logs.
    std::fs::hard_link(&store, desk.path("twin.db")).expect("a link");
    let (code, told) = starts_over(&desk, &desk.path("twin.db")).expect("it does not serve");
    assert_ne!(code, 0);
    assert!(told.contains("2 names"), "{told}");
}
