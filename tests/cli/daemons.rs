//! What daemons ask of the system that they run on.

use crate::binary::{Desk, Server, starts_over};

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

#[test]
#[cfg(unix)]
fn a_store_has_one_edge_whatever_it_is_called() {
    let desk = Desk::new();
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
