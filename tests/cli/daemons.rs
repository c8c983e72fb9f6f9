//! What daemons ask of the system that they run on.

use crate::binary::{Desk, Server};

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
