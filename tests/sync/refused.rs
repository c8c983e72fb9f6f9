//! What the registry will never take: refused here where that is known, else held, and nothing waits behind it.

use crate::stage::{Central, NETWORK, Outpost, circle, manner, up_to};
use jiff::SignedDuration;
use skyway::edge::{Code, Decision, Idempotency, Refusal, ZoneWrite};
use skyway::registry::Settings;
use skyway::wire::{ClosureDraft, EventKind, PublishedClosure};

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

    /// Puts `x` of a radius, which the registry refuses.
    async fn put_in_vain(&self, central: &Central, radius_m: f64) {
        let refused = self.sync().forwards_refused;
        self.line.refuse_next_write();
        self.put_zone("x", 150.0, 0.0, radius_m).await;
        self.until("it is refused", async || {
            self.sync().forwards_refused > refused
        })
        .await;
        self.settle(central).await;
    }

    /// The radii that wait for an operator.
    fn held_m(&self) -> Vec<f64> {
        let holds = self.holds();
        let ours = holds.iter().filter_map(|hold| hold.ours.as_ref());
        let radius_m = ours.map(|ours| ours["properties"]["radius_m"].as_f64());
        radius_m
            .map(|radius_m| radius_m.expect("a circle"))
            .collect()
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
        let put = north.edge.put_zone(&north.caller, feature.clone(), write);
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
    assert_eq!(
        (&*hold.reason, north.sync().forwards_refused),
        ("refused_there", 1)
    );
    north.decide(&hold, Decision::Accept).await;
    north.settle(&central).await;
    assert_eq!(central.zones().await, north.zones());
    north.end().await;
}

#[tokio::test]
async fn of_what_is_refused_again_and_again_the_last_waits() {
    let (central, north) = Outpost::alone().await;
    for radius_m in [5.0, 6.0, 7.0] {
        north.put_in_vain(&central, radius_m).await;
    }
    assert_eq!(north.held_m(), [7.0]);
    north.decide(&north.holds()[0], Decision::Accept).await;
    north.settle(&central).await;
    assert_eq!(central.zones().await, [("x".to_owned(), 7.0)]);
    assert!(north.holds().is_empty());
    north.end().await;
}

#[tokio::test]
async fn what_was_refused_waits_no_more_once_it_is_changed() {
    let (central, north) = Outpost::alone().await;
    let mut events = north.events();
    north.put_in_vain(&central, 5.0).await;
    north.put_zone("x", 150.0, 0.0, 6.0).await;
    assert!(north.holds().is_empty(), "{:?}", north.holds());
    let told = up_to(&mut events, EventKind::HoldDecided).await;
    assert_eq!(told.last().expect("an event").1["decision"], "overtaken");
    north.settle(&central).await;
    assert_eq!(central.zones().await, [("x".to_owned(), 6.0)]);
    // Lifted, too, though the registry never knew it.
    north.lift_zone("x").await;
    north.settle(&central).await;
    north.put_in_vain(&central, 7.0).await;
    north.lift_zone("x").await;
    assert!(north.holds().is_empty(), "{:?}", north.holds());
    north.end().await;
}

#[tokio::test]
async fn a_refused_removal_waits_no_more_once_the_zone_is_put_anew() {
    let (central, north) = Outpost::alone().await;
    north.put_zone("x", 150.0, 0.0, 5.0).await;
    north.settle(&central).await;
    north.line.refuse_next_write();
    north.lift_zone("x").await;
    north
        .until("it is held", async || north.holds().len() == 1)
        .await;
    north.put_zone("x", 150.0, 0.0, 6.0).await;
    assert!(north.holds().is_empty(), "{:?}", north.holds());
    north.end().await;
}

#[tokio::test]
async fn what_is_refused_when_it_was_changed_already_does_not_wait() {
    let (central, north) = Outpost::alone().await;
    north.line.take_no_writes(true);
    north.put_zone("x", 150.0, 0.0, 5.0).await;
    north.put_zone("x", 150.0, 0.0, 6.0).await;
    north.line.refuse_next_write();
    north.line.take_no_writes(false);
    north.settle(&central).await;
    assert_eq!(central.zones().await, [("x".to_owned(), 6.0)]);
    assert_eq!((north.sync().forwards_refused, north.holds().len()), (1, 0));
    north.end().await;
}
