//! What changes on one side is in force on the other: zones, closures, removals, many at once.

use crate::stage::{Central, NETWORK, Outpost, circle, manner, up_to};
use serde_json::json;
use skyway::edge::{Caller, Decision, Role};
use skyway::registry::Follow;
use skyway::wire::{EventKind, Freshness, ObjectKind, PublishedClosure};

#[tokio::test]
async fn an_edge_reads_everything_and_then_follows() {
    let central = Central::open().await;
    for place in 0..7 {
        let x = 50.0 + 100.0 * f64::from(place);
        central.put_zone(&format!("z{place}"), x, 0.0, 5.0).await;
    }
    let outpost = Outpost::set(&central, "north");
    let before = outpost.edge.stamp();
    assert_eq!(before.registry_revision, None);
    assert_eq!(
        before.freshness,
        Freshness::Degraded,
        "it knows nothing yet"
    );
    outpost.settle(&central).await;
    assert_eq!(outpost.blocked(), 7);
    assert_eq!(outpost.line.lists(), 1);
    let stamp = outpost.edge.stamp();
    let head = central.head().await;
    assert_eq!(
        stamp.registry_revision.map(|cursor| cursor.to_string()),
        Some(format!("1-{head}"))
    );
    assert_eq!(stamp.freshness, Freshness::Fresh);
    central.put_zone("z9", 50.0, 100.0, 5.0).await;
    central.lift_zone("z0").await;
    outpost.settle(&central).await;
    let expected: Vec<String> = ["z1", "z2", "z3", "z4", "z5", "z6", "z9"]
        .map(str::to_owned)
        .to_vec();
    assert_eq!(outpost.ids(), expected);
    assert_eq!(outpost.line.lists(), 1, "it only follows");
    assert_eq!(outpost.sync().nacks, 0);
    outpost.end().await;
}

#[tokio::test]
async fn one_page_is_one_revision_however_much_it_brings() {
    let central = Central::open().await;
    let outpost = Outpost::set(&central, "north");
    outpost.settle(&central).await;
    outpost.line.cut();
    let sequence = |text: &str| -> u64 {
        let (_, sequence) = text.split_once('-').expect("two parts");
        sequence.parse().expect("a number")
    };
    let before = sequence(&outpost.edge.stamp().revision);
    for place in 0..6 {
        let x = 50.0 + 100.0 * f64::from(place);
        central.put_zone(&format!("z{place}"), x, 0.0, 5.0).await;
    }
    central.lift_zone("z0").await;
    outpost.line.lead_to(Some(&central.registry));
    outpost.settle(&central).await;
    assert_eq!(sequence(&outpost.edge.stamp().revision), before + 1);
    assert_eq!(outpost.blocked(), 5, "six were put, one was lifted");
    outpost.end().await;
}

#[tokio::test]
async fn a_zone_posted_at_one_edge_closes_at_the_other_and_is_told_once() {
    let (central, north, south) = Outpost::pair().await;
    let (mut at_north, mut at_south) = (north.events(), south.events());
    north.put_zone("concert", 150.0, 0.0, 5.0).await;
    assert_eq!(north.blocked(), 1, "enforced at once");
    south
        .until("it has come", async || south.blocked() == 1)
        .await;
    north.settle(&central).await;
    assert_eq!(north.line.writes().len(), 1);
    south.lift_zone("concert").await;
    north
        .until("it is open", async || north.blocked() == 0)
        .await;
    south.settle(&central).await;
    for events in [&mut at_north, &mut at_south] {
        let told = up_to(events, EventKind::ZoneDeleted).await;
        let kinds: Vec<EventKind> = told.iter().map(|(kind, _)| *kind).collect();
        assert_eq!(kinds, [EventKind::ZonePut, EventKind::ZoneDeleted]);
    }
    assert!(central.zones().await.is_empty());
    north.end().await;
    south.end().await;
}

#[tokio::test]
async fn what_is_changed_while_the_line_is_cut_is_told_in_its_order() {
    let (central, north) = Outpost::alone().await;
    north.line.cut();
    north.put_zone("a", 50.0, 0.0, 5.0).await;
    for radius_m in [6.0, 7.0, 8.0] {
        north.put_zone("a", 50.0, 0.0, radius_m).await;
    }
    north.put_zone("b", 150.0, 0.0, 5.0).await;
    north.lift_zone("b").await;
    north.put_zone("c", 250.0, 0.0, 5.0).await;
    assert_eq!(north.sync().outbox, 5, "of one thing at most two wait");
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    let expected = [("a".to_owned(), 8.0), ("c".to_owned(), 5.0)];
    assert_eq!(central.zones().await, expected);
    assert_eq!(north.zones(), expected);
    let sent: Vec<String> = north
        .line
        .writes()
        .iter()
        .map(|write| write.id.to_string())
        .collect();
    assert_eq!(sent, ["a", "a", "b", "b", "c"]);
    north.end().await;
}

#[tokio::test]
async fn a_change_whose_answer_was_lost_is_recognised_by_the_log() {
    let (central, north) = Outpost::alone().await;
    let mut events = north.events();
    north.line.lose_answers(true);
    north.put_zone("a", 50.0, 0.0, 5.0).await;
    north
        .until("the log has it", async || north.sync().outbox == 0)
        .await;
    north.line.lose_answers(false);
    north.put_zone("a", 50.0, 0.0, 6.0).await;
    north.settle(&central).await;
    assert_eq!(central.zones().await, [("a".to_owned(), 6.0)]);
    assert_eq!(central.head().await, 3, "nothing was written twice");
    north.lift_zone("a").await;
    let told = up_to(&mut events, EventKind::ZoneDeleted).await;
    assert_eq!(told.len(), 3, "put, put, deleted: {told:?}");
    north.end().await;
}

#[tokio::test]
async fn closures_travel_as_zones_do() {
    let (central, north, south) = Outpost::pair().await;
    north.close("crane", "a1-a2").await;
    south
        .until("it has come", async || south.blocked() == 1)
        .await;
    let closure = south.edge.closure(&south.caller, "crane").expect("there");
    // It began by the clock of the north, which may be ahead of this one: then it closes already.
    assert!(closure.confirmed && (closure.in_force || closure.closes_from.is_some()));
    assert_eq!(closure.segments, ["a1-a2"]);
    let lifted = south
        .edge
        .lift_closure(&south.caller, "crane", None, None)
        .await;
    lifted.expect("lifted");
    north
        .until("it is open", async || north.blocked() == 0)
        .await;
    north.settle(&central).await;
    assert!(central.closures().await.is_empty());
    north.end().await;
    south.end().await;
}

#[tokio::test]
async fn a_drones_report_closes_its_leg_at_every_edge_until_it_ends() {
    let (_central, north, south) = Outpost::pair().await;
    let report = async |id: &str, outpost: &Outpost| {
        let telemetry = skyway::wire::Telemetry {
            positions: vec![json!({"drone_id": "d1", "location": {"x": 140.0, "y": 0.0}})],
        };
        let seen = outpost.edge.telemetry(&outpost.caller, telemetry).await;
        seen.expect("seen");
        let body = json!({
            "id": id, "type": "navigational", "service": {"from": "a1", "to": "a2"},
            "destination": "a5", "drone": {"id": "d1"}, "location": {"x": 140.0, "y": 0.0},
            "timestamp": outpost.edge.clock().now().to_string(),
        });
        skyway::formats::parse_report(body.to_string().as_bytes()).expect("a report")
    };
    let parsed = report("r1", &north).await;
    let answered = north.edge.report_failure(&north.caller, parsed).await;
    let answered = serde_json::to_value(answered.expect("an outcome").to_wire()).expect("JSON");
    assert_eq!(answered["publication"]["state"], "published", "{answered}");
    south
        .until("it has come", async || south.blocked() == 1)
        .await;
    let id = "report:a1-a2";
    let closure = south.edge.closure(&south.caller, id).expect("there");
    assert_eq!(closure.reason.as_deref(), Some("navigational"));
    assert_eq!(closure.reported_by.as_deref(), Some("d1"));
    // The same obstacle, seen from the other edge a little later, lasts longer for both.
    south.hand.advance(jiff::SignedDuration::from_mins(5));
    let parsed = report("r2", &south).await;
    let answered = south.edge.report_failure(&south.caller, parsed).await;
    answered.expect("an outcome");
    south.edge.tick().await.expect("the writer works");
    let renewed = south.edge.closure(&south.caller, id).expect("there").until;
    assert_ne!(renewed, closure.until);
    north
        .until("it is renewed", async || {
            north.edge.closure(&north.caller, id).expect("there").until == renewed
        })
        .await;
    // It ends by itself at both, with nothing to be told.
    let writes = south.line.writes().len();
    south.hand.advance(jiff::SignedDuration::from_mins(20));
    south.edge.tick().await.expect("the writer works");
    assert_eq!(south.blocked(), 0);
    assert_eq!(south.line.writes().len(), writes);
    north.end().await;
    south.end().await;
}

#[tokio::test]
async fn weather_is_kept_and_closures_that_are_over_are_not_taken() {
    let central = Central::open().await;
    let weather = json!({"wind": [{
        "from": "2026-11-21T06:00:00Z", "until": "2026-11-21T09:00:00Z",
        "speed_mps": 7.0, "from_deg": 200.0,
    }]});
    let weather = serde_json::from_value(weather).expect("weather");
    let manner = manner(None);
    let put = central.registry.put_weather(NETWORK, weather, &manner);
    put.await.expect("weather");
    let brief = PublishedClosure {
        segments: vec!["a1-a2".to_owned()],
        until: Some("2026-11-21T06:30:00Z".to_owned()),
        ..PublishedClosure::default()
    };
    let put = central
        .registry
        .put_closure(NETWORK, Some("brief"), brief, &manner);
    put.await.expect("a closure");
    let north = Outpost::set(&central, "north");
    north.hand.advance(jiff::SignedDuration::from_hours(1));
    north.settle(&central).await;
    assert_eq!(north.blocked(), 0);
    assert_eq!(north.edge.status().closures, 0);
    north.end().await;
}

#[tokio::test]
async fn many_removals_at_once_wait_for_an_operator() {
    let central = Central::open().await;
    let north = Outpost::set(&central, "north");
    for place in 0..12 {
        let x = 40.0 + 50.0 * f64::from(place);
        central
            .put_zone(&format!("z{place:02}"), x, 50.0, 5.0)
            .await;
    }
    north.settle(&central).await;
    central.lift_zone("z00").await;
    north.settle(&central).await;
    assert_eq!(north.ids().len(), 11, "a few are removed at once");
    north.line.cut();
    for place in 1..12 {
        central.lift_zone(&format!("z{place:02}")).await;
    }
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    assert_eq!(north.ids().len(), 11, "many are held");
    let held = north.holds();
    assert_eq!(held[0].closure_count, 11);
    assert_eq!(held[0].reason, "mass_removal");
    // One of them is put anew meanwhile: it is not to be lifted any more.
    central.put_zone("z05", 290.0, 50.0, 9.0).await;
    north.settle(&central).await;
    assert_eq!(north.holds()[0].closure_count, 10);
    // So is one that is put anew here, whether the registry knows of it yet or not.
    north.put_zone("z06", 340.0, 50.0, 8.0).await;
    north.settle(&central).await;
    north.line.take_no_writes(true);
    north.put_zone("z07", 390.0, 50.0, 7.0).await;
    north.decide(&north.holds()[0], Decision::Accept).await;
    assert_eq!(north.ids(), ["z05", "z06", "z07"]);
    north.line.take_no_writes(false);
    north.settle(&central).await;
    assert_eq!(central.zones().await, north.zones());
    north.end().await;
}

#[tokio::test]
async fn removals_that_an_operator_rejects_are_put_at_the_registry_again() {
    let central = Central::open().await;
    let north = Outpost::set(&central, "north");
    for place in 0..12 {
        let x = 40.0 + 50.0 * f64::from(place);
        central
            .put_zone(&format!("z{place:02}"), x, 50.0, 5.0)
            .await;
    }
    north.settle(&central).await;
    north.line.cut();
    for place in 0..12 {
        central.lift_zone(&format!("z{place:02}")).await;
    }
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    north.decide(&north.holds()[0], Decision::Reject).await;
    north.settle(&central).await;
    assert_eq!(central.zones().await.len(), 12);
    assert_eq!(north.zones(), central.zones().await);
    north.end().await;
}

#[tokio::test]
async fn what_the_registry_will_never_take_is_told_and_held() {
    let (central, north) = Outpost::alone().await;
    let mut events = north.events();
    // An id that no registry takes, as it could not stand in a path.
    north.put_zone("bell\u{7}", 50.0, 0.0, 5.0).await;
    let told = up_to(&mut events, EventKind::HoldMade).await;
    assert!(
        told.iter()
            .any(|(kind, data)| *kind == EventKind::ForwardRefused && data["id"] == "bell\u{7}"),
        "{told:?}"
    );
    assert_eq!(north.blocked(), 1, "it stays in force here");
    assert_eq!(north.sync().forwards_refused, 1);
    assert_eq!(north.holds()[0].reason, "refused_there");
    north.put_zone("b", 150.0, 0.0, 5.0).await;
    north.settle(&central).await;
    assert_eq!(
        central.zones().await.len(),
        1,
        "what comes after it goes on"
    );
    north.decide(&north.holds()[0], Decision::Reject).await;
    assert_eq!(north.blocked(), 2);
    north.end().await;
}

#[tokio::test]
async fn a_cursor_that_is_gone_leads_to_the_list() {
    let central = Central::open().await;
    let north = Outpost::set(&central, "north");
    central.put_zone("old", 50.0, 0.0, 5.0).await;
    north.settle(&central).await;
    north.line.cut();
    north.put_zone("mine", 350.0, 0.0, 5.0).await;
    central.lift_zone("old").await;
    central.put_zone("new", 150.0, 0.0, 5.0).await;
    central.compact().await;
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    assert_eq!(north.line.lists(), 2);
    assert_eq!(north.ids(), ["mine", "new"]);
    assert_eq!(central.zones().await.len(), 2);
    let object = central
        .registry
        .object(NETWORK, ObjectKind::Zone, "mine")
        .await;
    object.expect("it was told");
    north.end().await;
}

#[tokio::test]
async fn a_zone_and_a_closure_of_one_id_are_both_in_force() {
    let (central, north) = Outpost::alone().await;
    north.line.cut();
    north.close("x", "a1-a2").await;
    let (feature, manner) = (circle("x", 350.0, 0.0, 5.0), manner(None));
    let put = central
        .registry
        .put_zone(NETWORK, Some("x"), feature, &manner);
    put.await.expect("a zone");
    north.line.lead_to(Some(&central.registry));
    north.settle(&central).await;
    assert_eq!(north.blocked(), 2);
    assert_eq!(north.ids(), ["x"]);
    let hold = &north.holds()[0];
    assert_eq!(hold.reason, "changed_elsewhere");
    north.decide(hold, Decision::Reject).await;
    assert_eq!(north.blocked(), 1);
    north.end().await;
}

#[tokio::test]
async fn the_log_says_who_made_a_change_at_an_edge() {
    let central = Central::open().await;
    let mut north = Outpost::set(&central, "north");
    north.settle(&central).await;
    north.caller = Caller::local(Role::Operator, "mira");
    north.put_zone("fair", 150.0, 0.0, 20.0).await;
    north.settle(&central).await;
    north.lift_zone("fair").await;
    north.settle(&central).await;
    let follow = Follow {
        after: 1,
        epoch: None,
        limit: None,
        wait: std::time::Duration::ZERO,
        edge: None,
    };
    let page = central
        .registry
        .changes(NETWORK, &follow, std::future::pending());
    let changes = page.await.expect("a page").changes;
    let subjects: Vec<&str> = changes.iter().map(|change| &*change.subject).collect();
    assert_eq!(subjects, ["operator:mira@north"; 2]);
    north.end().await;
}
