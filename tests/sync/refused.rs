//! What the registry will never take: refused here where that is known, else held, and nothing waits behind it.

use crate::stage::{Central, NETWORK, Outpost, circle, manner};
use jiff::SignedDuration;
use skyway::edge::{Code, Decision, Idempotency, Refusal, ZoneWrite};
use skyway::registry::Settings;
use skyway::wire::{ClosureDraft, PublishedClosure};

impl Outpost {
    /// Waits until a change that waits is given up, and the one behind it is told.
    async fn goes_on(&self, central: &Central) {
        self.put_zone("behind", 350.0, 0.0, 5.0).await;
        self.until("it is given up", async || {
            self.hand.advance(SignedDuration::from_secs(1));
            self.sync().forwards_refused == 1
        })
        .await;
        self.settle(central).await;
        assert_eq!(central.zones().await, [("behind".to_owned(), 5.0)]);
    }
}

#[track_caller]
fn names_the_id(refusal: &Refusal, code: Code) {
    assert_eq!(refusal.code, code);
    let [fault] = refusal.faults.as_slice() else {
        panic!("{:?}", refusal.faults);
    };
    assert_eq!(fault.pointer, "/id");
    assert!(fault.hint.is_some(), "{fault:?}");
}

/// An address is made without such a step, so that it would be that of something else.
#[tokio::test]
async fn an_id_that_is_a_step_of_a_path_is_refused_on_both_sides() {
    let (central, north) = Outpost::alone().await;
    for id in [".", ".."] {
        let feature = circle(id, 150.0, 0.0, 5.0);
        let write = ZoneWrite {
            id: Some(id.to_owned()),
            if_match: None,
            validate_only: false,
        };
        let put = north
            .edge
            .put_zone(&north.caller, feature.clone(), write);
        names_the_id(&put.await.expect_err("no id"), Code::ZoneInvalid);
        let draft = ClosureDraft {
            id: Some(id.to_owned()),
            segments: vec!["a1-a2".to_owned()],
            ..ClosureDraft::default()
        };
        let closed = north
            .edge
            .close(&north.caller, draft, Idempotency::default());
        names_the_id(&closed.await.expect_err("no id"), Code::ClosureInvalid);

        let (registry, manner) = (&central.registry, manner(None));
        let put = registry.put_zone(NETWORK, Some(id), feature, &manner);
        names_the_id(&put.await.expect_err("no id"), Code::ZoneInvalid);
        let closure = PublishedClosure {
            segments: vec!["a1-a2".to_owned()],
            ..PublishedClosure::default()
        };
        let put = registry.put_closure(NETWORK, Some(id), closure, &manner);
        names_the_id(&put.await.expect_err("no id"), Code::ClosureInvalid);
    }
    north.end().await;
}

#[tokio::test]
async fn what_has_no_address_on_the_way_is_held_and_holds_nothing_up() {
    for status in [404, 405] {
        let (central, north) = Outpost::alone().await;
        north.line.refuse_writes_of("odd", status);
        north.put_zone("odd", 150.0, 0.0, 5.0).await;
        north.goes_on(&central).await;
        assert_eq!(north.blocked(), 2, "it stays in force here");
        assert_eq!(north.holds()[0].reason, "refused_there");
        north.end().await;
    }
}

/// Removals that make room may wait behind it.
#[tokio::test]
async fn a_full_registry_hears_of_removals_all_the_same() {
    let settings = Settings {
        zones_max: 1,
        ..Settings::default()
    };
    let central = Central::with(settings).await;
    central.put_zone("old", 150.0, 0.0, 5.0).await;
    let north = Outpost::set(&central, "north");
    north.settle(&central).await;
    north.line.cut();
    north.put_zone("new", 350.0, 0.0, 5.0).await;
    north.lift_zone("old").await;
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    assert!(central.zones().await.is_empty(), "one was one too many");
    assert_eq!(north.zones(), [("new".to_owned(), 5.0)]);
    let hold = north.holds().remove(0);
    assert_eq!((&*hold.reason, north.sync().forwards_refused), ("refused_there", 1));
    north.decide(&hold, Decision::Accept).await;
    north.settle(&central).await;
    assert_eq!(central.zones().await, north.zones());
    north.end().await;
}
