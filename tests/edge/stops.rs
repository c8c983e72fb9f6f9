//! Deliveries that stop on their way, from the request to the end: what the drone has yet to do is never lost.

use crate::flying::{at, instant, on, settings, street, windowed};
use crate::memory_disk::MemoryDisk;
use crate::stage::{Stage, circle, names, node, segment};
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::edge::{Settings, ZoneWrite};
use skyway::network::NetworkDraft;
use skyway::wire::{self, EndedAs, PlanState};

/// `s0 - s1 - s2 - s3`, a kilometre each, with a pad at each, and a way around each of the last two by `u1` and `u2`.
fn bypassed() -> NetworkDraft {
    let mut draft = street(&[1, 1, 1, 1]);
    draft.nodes.push(node("u1", 1_500.0, 600.0));
    draft.nodes.push(node("u2", 2_500.0, 600.0));
    for (from, to) in [("s1", "u1"), ("u1", "s2"), ("s2", "u2"), ("u2", "s3")] {
        draft.segments.push(segment(from, to));
    }
    draft
}

/// From `s0` to be served at `s2` and `s3`, and home again, from seven o'clock on.
fn round(id: &str) -> Value {
    json!({
        "id": id, "drone_id": "d", "source": "s0", "destination": "s0", "start_time": at("07:00").to_string(),
        "stops": [{"node": "s2", "service_s": 120.0}, {"node": "s3", "service_s": 90.0}],
    })
}

/// Where a version has its delivery served, and for how many seconds the drone stays there.
fn served(version: &wire::PlanVersion<'_>) -> Vec<(String, i64)> {
    let flight = version.flight.as_ref().expect("a flight");
    let stops = flight.stops.iter().filter(|stop| stop.service_s.is_some());
    stops
        .map(|stop| {
            let stay = instant(&stop.takes_off_at).duration_since(instant(&stop.lands_at));
            (stop.node.to_string(), stay.as_secs())
        })
        .collect()
}

fn path(version: &wire::PlanVersion<'_>) -> Vec<String> {
    names(&version.path.nodes)
}

fn wanted(stage: &Stage, id: &str) -> wire::PlanVersion<'static> {
    let plan = stage.plan(id);
    plan.wanted
        .clone()
        .unwrap_or_else(|| panic!("no other version: {plan:#?}"))
}

/// The drone does not fly a version.
async fn decline(stage: &Stage, version: &wire::PlanVersion<'_>) {
    let decline = wire::Decline {
        version: version.version,
        reason: Some("passed".to_owned()),
        ..wire::Decline::default()
    };
    let declined = stage.edge.decline_plan(&stage.caller, "p", decline).await;
    declined.expect("answered");
    stage.settle().await;
}

/// The drone flies a version.
async fn take_over(stage: &Stage, version: &wire::PlanVersion<'_>) -> wire::Plan<'static> {
    let ack = wire::Ack {
        version: version.version,
        ..wire::Ack::default()
    };
    let taken = stage.edge.acknowledge_plan(&stage.caller, "p", ack).await;
    taken.expect("taken over")
}

/// Lets it be so many seconds after a version's departure.
async fn after(stage: &Stage, version: &wire::PlanVersion<'_>, seconds: i64) {
    let then = instant(&version.departs_at) + SignedDuration::from_secs(seconds);
    let span = then.duration_since(stage.edge.clock().now());
    stage.pass(span).await;
}

/// The drone stands at a node.
async fn stands(stage: &Stage, x: f64, y: f64) {
    let positions = vec![json!({
        "drone_id": "d", "location": {"x": x, "y": y}, "airborne": false, "ground_speed_mps": 0.0,
    })];
    let batch = wire::Telemetry { positions };
    let told = stage.edge.telemetry(&stage.caller, batch).await;
    told.expect("telemetry");
    stage.settle().await;
}

#[tokio::test]
async fn it_is_served_in_order_and_ends_where_it_began() {
    let stage = on(&bypassed());
    let plan = stage.deliver(round("p")).await.expect("a plan");
    let version = &plan.reported;
    assert_eq!(path(version), ["s0", "s1", "s2", "s3", "s2", "s1", "s0"]);
    let both = [("s2".to_owned(), 120), ("s3".to_owned(), 90)];
    assert_eq!(served(version), both);
    assert_eq!(
        names(&[plan.stops[0].node.clone(), plan.stops[1].node.clone()]),
        ["s2", "s3"]
    );
    stage.check(&plan, &[]).expect("it can be flown");
    let flight = version.flight.as_ref().expect("a flight");
    assert!(flight.proved, "{:?}", flight.unproved_reason);

    // At its stops, and over the node where it began, it is not at its end.
    let stop = &flight.stops[1];
    after(&stage, version, 1).await;
    let landed = instant(&stop.lands_at).duration_since(instant(&version.departs_at));
    after(&stage, version, landed.as_secs() + 5).await;
    for _ in 0..8 {
        stands(&stage, 3_000.0, 0.0).await;
        stage.pass(SignedDuration::from_secs(1)).await;
    }
    assert_eq!(stage.plan("p").state, PlanState::Activated);
    let arrives = instant(&version.arrives_at).duration_since(instant(&version.departs_at));
    after(&stage, version, arrives.as_secs() + 1).await;
    for _ in 0..8 {
        stands(&stage, 0.0, 0.0).await;
        stage.pass(SignedDuration::from_secs(1)).await;
    }
    assert_eq!(stage.plan("p").ended_as, Some(EndedAs::Delivered));
}

#[tokio::test]
async fn a_zone_ahead_of_both_stops_keeps_both_and_one_after_the_first_only_the_second() {
    let stage = on(&bypassed());
    let plan = stage.deliver(round("p")).await.expect("a plan");
    after(&stage, &plan.reported, 30).await;
    stage.see("d", 400.0, 0.0).await;
    stage.zone(circle("early", 1_500.0, 0.0, 50.0)).await;
    let both = wanted(&stage, "p");
    let around = ["s1", "u1", "s2", "s3", "s2", "u1", "s1", "s0"];
    assert_eq!(path(&both)[path(&both).len() - 8..], around);
    assert_eq!(served(&both).len(), 2);
    let taken = take_over(&stage, &both).await.reported;

    // It has left the first stop.
    let flight = taken.flight.as_ref().expect("a flight");
    let left = instant(&flight.stops[0].takes_off_at).duration_since(instant(&taken.departs_at));
    for (x, y) in [(1_000.0, 0.0), (1_500.0, 600.0), (2_000.0, 0.0)] {
        stage.see("d", x, y).await;
    }
    after(&stage, &taken, left.as_secs() + 20).await;
    stage.see("d", 2_200.0, 0.0).await;
    stage.zone(circle("late", 2_700.0, 0.0, 50.0)).await;
    let one = wanted(&stage, "p");
    assert_eq!(served(&one), [("s3".to_owned(), 90)], "{:?}", path(&one));
    assert_eq!(path(&one).last().map(String::as_str), Some("s0"));
    let left: Vec<String> = stage
        .plan("p")
        .stops
        .iter()
        .map(|stop| stop.node.to_string())
        .collect();
    assert_eq!(left, ["s2", "s3"], "the stops of the version that is flown");
}

#[tokio::test]
async fn who_is_seen_behind_where_it_was_is_not_on_its_way_back() {
    for delivery in [None, Some("order-1")] {
        let stage = on(&bypassed());
        let mut request = round("p");
        request["delivery_id"] = json!(delivery);
        let plan = stage.deliver(request).await.expect("a plan");
        after(&stage, &plan.reported, 50).await;
        stage.see("d", 600.0, 0.0).await;
        after(&stage, &plan.reported, 53).await;
        // The way back leads over this place, too, before which it has been already.
        stage.see("d", 560.0, 0.0).await;
        stage.settle().await;
        stage.zone(circle("z", 2_500.0, 0.0, 30.0)).await;
        let both = [("s2".to_owned(), 120), ("s3".to_owned(), 90)];
        assert_eq!(served(&wanted(&stage, "p")), both, "{delivery:?}");
    }
}

#[tokio::test]
async fn while_it_is_served_it_stays_for_what_is_left_of_that() {
    let stage = on(&bypassed());
    let plan = stage.deliver(round("p")).await.expect("a plan");
    let flight = plan.reported.flight.as_ref().expect("a flight");
    let landed = instant(&flight.stops[0].lands_at);
    let landed = landed.duration_since(instant(&plan.reported.departs_at));
    after(&stage, &plan.reported, landed.as_secs() + 21).await;
    stands(&stage, 2_000.0, 0.0).await;
    stage.zone(circle("next", 2_500.0, 0.0, 50.0)).await;
    let version = wanted(&stage, "p");
    assert_eq!(path(&version), ["s2", "u2", "s3", "u2", "s2", "s1", "s0"]);
    let stays = served(&version);
    assert_eq!(stays[1], ("s3".to_owned(), 90));
    let (first, left_s) = &stays[0];
    assert!(first == "s2" && (98..=100).contains(left_s), "{stays:?}");
    stage
        .check_version(&plan, &version, &[])
        .expect("it can be flown");
}

#[tokio::test]
async fn a_report_is_answered_by_the_stops_that_are_ahead() {
    let stage = on(&bypassed());
    let plan = stage.deliver(round("p")).await.expect("a plan");
    after(&stage, &plan.reported, 150).await;
    let answer = stage
        .answer(json!({
            "type": "navigational", "service": {"plan_id": "p", "leg": 1}, "location": {"x": 1_010.0, "y": 0.0},
        }))
        .await;
    assert_eq!(answer["outcome"], "rerouted", "{answer}");
    let nodes: Vec<&str> = answer["path"]["nodes"]
        .as_array()
        .expect("nodes")
        .iter()
        .filter_map(Value::as_str)
        .collect();
    let onward = ["u1", "s2", "s3", "s2", "u1", "s1", "s0"];
    assert_eq!(nodes[nodes.len() - 7..], onward);
    assert_eq!(served(&wanted(&stage, "p")).len(), 2);
}

#[tokio::test]
async fn where_no_way_leads_on_it_comes_to_its_stop_and_is_told_more_there() {
    let stage = on(&street(&[1, 1, 1, 1]));
    let plan = stage.deliver(round("p")).await.expect("a plan");
    after(&stage, &plan.reported, 30).await;
    stage.see("d", 400.0, 0.0).await;
    let ack = stage.zone(circle("beyond", 2_500.0, 0.0, 50.0)).await;
    let short = wanted(&stage, "p");
    assert_eq!(path(&short).last().map(String::as_str), Some("s2"));
    let codes: Vec<&str> = short.warnings.iter().map(|it| &*it.code).collect();
    assert_eq!(codes, ["ends_at_stop"]);
    let taken = take_over(&stage, &short).await.reported;
    let arrives = instant(&taken.arrives_at).duration_since(instant(&taken.departs_at));
    after(&stage, &taken, arrives.as_secs() - 1).await;
    stage.see("d", 1_990.0, 0.0).await;
    after(&stage, &taken, arrives.as_secs() + 1).await;
    for _ in 0..8 {
        stands(&stage, 2_000.0, 0.0).await;
        stage.pass(SignedDuration::from_secs(1)).await;
    }
    let waiting = stage.plan("p");
    assert_ne!(waiting.state, PlanState::Ended, "it has two stops to make");
    let completed = stage
        .edge
        .complete_plan(&stage.caller, "p", wire::Completion::default())
        .await;
    assert_ne!(completed.expect("heard").state, PlanState::Ended);

    let write = ZoneWrite {
        id: Some("beyond".to_owned()),
        if_match: ack.etag.as_deref().map(str::to_owned),
        ..ZoneWrite::default()
    };
    let lifted = stage.edge.delete_zone(&stage.caller, write, None).await;
    lifted.expect("lifted");
    for _ in 0..16 {
        stands(&stage, 2_000.0, 0.0).await;
        stage.pass(SignedDuration::from_secs(1)).await;
    }
    let on = wanted(&stage, "p");
    assert_eq!(served(&on).last(), Some(&("s3".to_owned(), 90)), "{on:?}");
    assert_eq!(path(&on).last().map(String::as_str), Some("s0"));
}

/// No way leads on from there, so that it stays: no other drone has its pad.
#[tokio::test]
async fn who_comes_to_its_stop_alone_has_a_pad_there() {
    let stage = on(&street(&[1, 1, 1, 1]));
    let plan = stage.deliver(round("p")).await.expect("a plan");
    after(&stage, &plan.reported, 30).await;
    stage.see("d", 400.0, 0.0).await;
    stage.zone(circle("beyond", 2_500.0, 0.0, 50.0)).await;
    let short = wanted(&stage, "p");
    let taken = take_over(&stage, &short).await.reported;
    let stays_from = instant(&taken.arrives_at);
    let other = json!({"id": "other", "source": "s1", "destination": "s1", "stops": [{"node": "s2", "service_s": 600.0}]});
    if let Ok(other) = stage.deliver(other).await {
        let flight = other.reported.flight.expect("a flight");
        let stay = flight.stops.iter().find(|stop| stop.node.text() == "s2");
        let stay = stay.expect("it is served there");
        let has_left = instant(&stay.takes_off_at) <= stays_from;
        let comes_later = instant(&stay.lands_at) > stays_from + SignedDuration::from_mins(10);
        assert!(has_left || comes_later, "from {stays_from}: {stay:?}");
    }
}

#[tokio::test]
async fn who_declines_the_only_way_from_its_stop_is_told_it_again_there() {
    let stage = on(&bypassed());
    let plan = stage.deliver(round("p")).await.expect("a plan");
    let flight = plan.reported.flight.as_ref().expect("a flight");
    let landed = instant(&flight.stops[0].lands_at);
    let landed = landed.duration_since(instant(&plan.reported.departs_at));
    after(&stage, &plan.reported, landed.as_secs() + 21).await;
    stands(&stage, 2_000.0, 0.0).await;
    stage.zone(circle("next", 2_500.0, 0.0, 50.0)).await;
    let around = wanted(&stage, "p");
    decline(&stage, &around).await;
    // Nothing else leads on: it stays, and takes that over.
    let stays = wanted(&stage, "p");
    assert_eq!(path(&stays), ["s2"]);
    take_over(&stage, &stays).await;
    let waited_s = stays_until_told(&stage).await;
    let on = wanted(&stage, "p");
    assert_eq!(path(&on), ["s2", "u2", "s3", "u2", "s2", "s1", "s0"]);
    // Nothing was seen of its service while it held: that is what it is for, as before.
    assert_eq!(served(&on), served(&around), "after {waited_s} s");
    stage
        .check_version(&stage.plan("p"), &on, &[])
        .expect("it can be flown");
    // It declines all that it is told.
    let mut declined = 0;
    while let Some(next) = stage.plan("p").wanted {
        decline(&stage, &next).await;
        declined += 1;
        assert!(declined < 16, "{next:?}");
    }
    stays_until_told(&stage).await;
}

/// The drone stays at `s2` until it is told a way; how many seconds that takes.
async fn stays_until_told(stage: &Stage) -> u32 {
    let mut waited_s = 0;
    while stage.plan("p").wanted.is_none() {
        assert!(
            waited_s < 240,
            "no way is looked for: {:#?}",
            stage.plan("p")
        );
        let completed = wire::Completion::default();
        let completed = stage
            .edge
            .complete_plan(&stage.caller, "p", completed)
            .await;
        assert_ne!(completed.expect("heard").state, PlanState::Ended);
        stage.pass(SignedDuration::from_secs(1)).await;
        stands(stage, 2_000.0, 0.0).await;
        waited_s += 1;
    }
    waited_s
}

#[tokio::test]
async fn who_stays_at_its_stop_is_told_a_way_on_after_a_restart_too() {
    let disk = MemoryDisk::default();
    let stage = Stage::over_with(disk.open(), settings()).await;
    let request = json!({
        "id": "p", "drone_id": "d", "source": "a0", "destination": "a0",
        "stops": [{"node": "a7", "service_s": 120.0}],
    });
    let plan = stage.deliver(request).await.expect("a plan");
    let flight = plan.reported.flight.as_ref().expect("a flight");
    let landed = instant(&flight.stops[0].lands_at);
    let landed = landed.duration_since(instant(&plan.reported.departs_at));
    after(&stage, &plan.reported, landed.as_secs() + 21).await;
    stands(&stage, 700.0, 0.0).await;
    stage.zone(circle("next", 650.0, 0.0, 10.0)).await;
    let mut offered = wanted(&stage, "p");
    while path(&offered).len() > 1 {
        decline(&stage, &offered).await;
        offered = wanted(&stage, "p");
    }
    take_over(&stage, &offered).await;

    let stage = stage.again_with(disk.open(), settings()).await;
    let mut waited_s = 0;
    while stage.plan("p").wanted.is_none() {
        assert!(
            waited_s < 240,
            "no way is looked for: {:#?}",
            stage.plan("p")
        );
        stage.pass(SignedDuration::from_secs(1)).await;
        waited_s += 1;
    }
    let on = wanted(&stage, "p");
    assert_eq!(path(&on).first().map(String::as_str), Some("a7"));
    assert_eq!(path(&on).last().map(String::as_str), Some("a0"));
}

#[tokio::test]
async fn its_stops_survive_a_restart_and_a_new_network() {
    let disk = MemoryDisk::default();
    let stage = Stage::over_with(disk.open(), settings()).await;
    let request = json!({
        "id": "p", "source": "a0", "destination": "a0",
        "stops": [{"node": "a7", "service_s": 120.0}, {"node": "b7", "service_s": 90.0}],
    });
    let plan = stage.deliver(request).await.expect("a plan");
    let stage = stage.again_with(disk.open(), settings()).await;
    let again = stage.plan("p");
    assert_eq!(served(&again.reported), served(&plan.reported));
    assert_eq!(again.stops, plan.stops);
    stage
        .rebuild(|draft| draft.nodes.push(node("far", 9_000.0, 0.0)))
        .await;
    assert_eq!(served(&stage.plan("p").reported), served(&plan.reported));
}

#[tokio::test]
async fn what_cannot_be_is_refused_by_its_place() {
    let stage = on(&street(&[1, 1, 0, 1]));
    let refused = |request: Value| {
        let stage = &stage;
        async move {
            let refusal = stage.deliver(request).await.expect_err("refused");
            let faults = refusal.faults.iter();
            faults
                .map(|fault| format!("{} {}", fault.code, fault.pointer))
                .collect::<Vec<_>>()
        }
    };
    let asked = |stops: Value, destination: Value| {
        let mut request = json!({"id": "p", "source": "s0", "stops": stops});
        if !destination.is_null() {
            request["destination"] = destination;
        }
        request
    };
    let no_pads = asked(json!([{"node": "s2"}]), json!("s3"));
    assert_eq!(refused(no_pads).await, ["no_pads /stops/0/node"]);
    let long = asked(json!([{"node": "s1", "service_s": 4_000.0}]), json!("s3"));
    assert_eq!(refused(long).await, ["out_of_range /stops/0/service_s"]);
    let twice = asked(json!([{"node": "s1"}, {"node": "s1"}]), json!("s3"));
    assert_eq!(refused(twice).await, ["same_node /stops/1/node"]);
    let at_once = asked(json!([{"node": "s0"}]), json!("s3"));
    assert_eq!(refused(at_once).await, ["same_node /stops/0/node"]);
    let at_end = asked(json!([{"node": "s3"}]), json!("s3"));
    assert_eq!(refused(at_end).await, ["same_node /destination"]);
    let many = asked(json!(vec![json!({"node": "s1"}); 17]), json!("s3"));
    assert_eq!(refused(many).await, ["too_many /stops"]);
    let nowhere = asked(json!([]), Value::Null);
    assert_eq!(refused(nowhere).await, ["missing_field /destination"]);

    let near = asked(json!([{"node": "s1", "service_s": 60.0}]), Value::Null);
    let near = stage.deliver(near).await.expect("a plan");
    assert_eq!(near.destination.to_string(), "s1", "its own pad is free");
    let zone = windowed(circle("x", 2_500.0, 0.0, 50.0), "06:00", "06:40");
    stage.zone(zone).await;

    let by_distance = Stage::with(Settings::default());
    let request = json!({"source": "a0", "destination": "a7", "stops": [{"node": "a3"}]});
    let refusal = by_distance.deliver(request).await.expect_err("refused");
    let codes: Vec<&str> = refusal.faults.iter().map(|it| it.code.as_str()).collect();
    assert!(codes.contains(&"flight_model_off"), "{codes:?}");
}

#[tokio::test]
async fn a_late_drone_that_reports_is_served_where_it_has_not_been() {
    let stage = on(&bypassed());
    let plan = stage.deliver(round("p")).await.expect("a plan");
    let flight = plan.reported.flight.as_ref().expect("a flight");
    let departs = instant(&plan.reported.departs_at);
    let first = instant(&flight.stops[0].takes_off_at).duration_since(departs);
    // By the clock it has been served at s2 and is on its way to s3; in truth it has just passed s1.
    after(&stage, &plan.reported, first.as_secs() + 20).await;
    let report = json!({
        "type": "navigational", "airborne": true, "service": {"plan_id": "p", "leg": 1},
        "location": {"x": 1_010.0, "y": 0.0}, "drone": {"id": "d"},
    });
    stage.answer(report).await;
    assert_eq!(served(&wanted(&stage, "p")).len(), 2);
}

#[tokio::test]
async fn a_late_drone_that_reports_the_leg_before_its_pad_is_not_on_it() {
    let stage = on(&bypassed());
    let plan = stage.deliver(round("p")).await.expect("a plan");
    let flight = plan.reported.flight.as_ref().expect("a flight");
    let departs = instant(&plan.reported.departs_at);
    let lands = instant(&flight.stops[0].lands_at).duration_since(departs);
    after(&stage, &plan.reported, lands.as_secs() + 10).await;
    let report = |extra: Value| {
        let mut report = json!({
            "type": "service_level", "service": {"plan_id": "p", "leg": 1}, "drone": {"id": "d"}, "dry_run": true,
        });
        let members = report.as_object_mut().expect("an object");
        members.extend(extra.as_object().expect("an object").clone());
        report
    };
    let late = stage.answer(report(json!({"airborne": true}))).await;
    assert_eq!(late["first_stretch_m"], 1_000.0, "{late}");
    let unsaid = stage.answer(report(json!({}))).await;
    assert_eq!(unsaid["first_stretch_m"], 1_000.0, "{unsaid}");
}
