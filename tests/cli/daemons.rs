//! What daemons ask of the system that they run on.

use crate::binary::{Desk, Server};

#[test]
fn no_request_waits_for_a_huge_page() {
    let desk = Desk::new();
    let store = desk.path("registry.db");
    for arguments in [
        &["edge", "--no-store"][..],
        &["registry", "--store", &store],
    ] {
        let daemon = Server::start(&desk, arguments);
        // A system without huge pages does not tell.
        let huge_pages = daemon.status("THP_enabled");
        assert!(
            matches!(huge_pages.as_deref(), None | Some("0")),
            "{huge_pages:?}"
        );
        assert_eq!(daemon.end(), 0);
    }
}
