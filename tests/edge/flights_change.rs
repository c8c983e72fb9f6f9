//! Plans that are flown while the world changes: zones, closed pads, another network, a restart, something that opens early.

use crate::flying::{at, corridor, instant, on, settings, stops, street, windowed};
use crate::memory_disk::MemoryDisk;
use crate::offers::block;
use crate::stage::{DAWN, Stage, circle, loaded, names, node, segment, without};
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::clock::Clock;
use skyway::edge::{Idempotency, Settings, Table, ZoneWrite};
use skyway::network::NetworkDraft;
use skyway::wire::{self, PlanFlag};

pub(crate) async fn lift(stage: &Stage, ack: &wire::ZoneAck<'_>, id: &str) {
    let write = ZoneWrite {
        id: Some(id.to_owned()),
        if_match: ack.etag.as_deref().map(str::to_owned),
        ..ZoneWrite::default()
    };
    let deleted = stage.edge.delete_zone(&stage.caller, write, None).await;
    deleted.expect("deleted");
}

pub(crate) async fn acknowledge(stage: &Stage, id: &str, version: u32) -> wire::Plan<'static> {
    let ack = wire::Ack {
        version,
        ..wire::Ack::default()
    };
    let taken = stage.edge.acknowledge_plan(&stage.caller, id, ack).await;
    taken.expect("taken over")
}

#[tokio::test]
async fn a_zone_affects_the_plans_that_are_there_in_its_window_and_no_others() {
    let stage = on(&street(&[1, 1, 1, 1]));
    let delivery = |id: &str, start: &str| {
        let start = at(start).to_string();
        json!({"id": id, "source": "s0", "destination": "s3", "start_time": start})
    };
    for (id, start) in [("before", "08:00"), ("during", "09:05"), ("after", "10:00")] {
        stage.deliver(delivery(id, start)).await.expect("a plan");
    }
    let zone = windowed(circle("match", 2_500.0, 0.0, 50.0), "09:00", "09:30");
    let preview = stage.edge.preview_zone(&stage.caller, zone.clone());
    let preview = preview.await.expect("a preview").effect;
    assert!(!preview.in_force, "it is hours away");
    let ack = stage.zone(zone).await;
    let met = &ack.effect.plans;
    let ids: Vec<&str> = met.iter().map(|plan| &*plan.plan_id).collect();
    assert_eq!(ids, ["during"], "{met:?}");
    assert_eq!(preview.plans[0].outcome, met[0].outcome);
    assert_eq!(preview.plans[0].path, met[0].path);
    for id in ["before", "after"] {
        assert!(stage.plan(id).flags.is_empty(), "{id}");
    }
    let during = stage.plan("during");
    assert_eq!(during.flags, [PlanFlag::Affected]);
    assert_eq!(during.affected_by, ["match"]);
    let proposed = during.wanted.as_ref().expect("a version is ready");
    let waits = stops(proposed);
    assert!(instant(waits[0].3) > at("09:30"), "{waits:?}");
    stage
        .check_version(&during, proposed, &[])
        .expect("it can be flown");
    assert!(
        stage.check(&during, &[]).is_err(),
        "the checker sees the zone in the way of the version before"
    );

    lift(&stage, &ack, "match").await;
    let free = stage.plan("during");
    assert_eq!((free.flags.len(), free.wanted), (0, None));
}

#[tokio::test]
async fn until_a_new_version_is_taken_over_both_keep_their_pads() {
    let stage = on(&street(&[1, 1, 2, 1]));
    let delivery = |id: &str, from: &str, to: &str| json!({"id": id, "source": from, "destination": to, "start_time": "2026-11-21T07:00:00Z"});
    stage
        .deliver(delivery("first", "s0", "s3"))
        .await
        .expect("a plan");
    let zone = windowed(circle("match", 2_500.0, 0.0, 50.0), "06:55", "07:30");
    stage.zone(zone).await;
    let first = stage.plan("first");
    let proposed = first.wanted.clone().expect("a version");
    let second = stage
        .deliver(delivery("second", "s0", "s3"))
        .await
        .expect("a plan");
    let both = [&first.reported, &proposed];
    stage
        .check_version(&second, &second.reported, &both)
        .expect("it keeps off both");
    let taken = acknowledge(&stage, "first", proposed.version).await;
    assert_eq!(stops(&taken.reported), stops(&proposed));
    let third = stage
        .deliver(delivery("third", "s2", "s0"))
        .await
        .expect("a plan");
    let flown = [&taken.reported, &second.reported];
    stage
        .check_version(&third, &third.reported, &flown)
        .expect("it keeps off what is flown");
}

#[tokio::test]
async fn pads_that_close_affect_the_plans_that_stop_there() {
    let stage = corridor();
    let request = json!({
        "id": "long", "source": 1, "destination": 280, "payload_kg": 0.25,
        "start_time": "2026-11-21T07:00:00Z", "deadline": "2026-11-21T21:00:00Z",
    });
    let plan = stage.deliver(request).await.expect("a plan");
    let third = stops(&plan.reported)[3].0.clone();
    let draft = json!({"id": "works", "pads": [third.parse::<i64>().expect("a number")]});
    let draft = serde_json::from_value(draft).expect("a closure");
    let closed = stage
        .edge
        .close(&stage.caller, draft, Idempotency::default());
    closed.await.expect("closed");
    let plan = stage.plan("long");
    assert_eq!(plan.flags, [PlanFlag::Affected]);
    assert_eq!(plan.affected_by, ["works"]);
    let proposed = plan.wanted.as_ref().expect("a version");
    let there = |stop: &(String, u16, &str, &str)| stop.0 == third;
    assert!(!stops(proposed).iter().any(there), "{proposed:?}");
    stage
        .check_version(&plan, proposed, &[])
        .expect("it can be flown");
}

/// States that it blows from the south-west, over everything and all day.
async fn blow(stage: &Stage, speed_mps: f64) {
    let before = stage.edge.weather(&stage.caller).etag;
    let weather = json!({"wind": [{
        "from": "2026-11-20T00:00:00Z", "until": "2026-11-23T00:00:00Z", "speed_mps": speed_mps, "from_deg": 225.0,
    }]});
    let weather = serde_json::from_value(weather).expect("a weather");
    let stated =
        stage
            .edge
            .put_weather(&stage.caller, weather, before.map(|etag| etag.into_owned()));
    stated.await.expect("stated");
}

#[tokio::test]
async fn a_wind_that_turns_affects_the_plans_that_it_leaves_short() {
    let stage = corridor();
    let delivery = |id: &str, from: u32, to: u32| {
        json!({
            "id": id, "source": from, "destination": to, "payload_kg": 0.25,
            "start_time": "2026-11-21T07:00:00Z", "deadline": "2026-11-21T21:00:00Z",
        })
    };
    // One against the wind that will come, and one with it.
    stage
        .deliver(delivery("there", 1, 280))
        .await
        .expect("a plan");
    stage
        .deliver(delivery("back", 280, 1))
        .await
        .expect("a plan");
    blow(&stage, 0.2).await;
    for id in ["there", "back"] {
        let plan = stage.plan(id);
        assert_eq!(
            plan.flags.len(),
            0,
            "{id}: it is less than telemetry may be off"
        );
    }

    blow(&stage, 7.0).await;
    assert!(stage.plan("back").flags.is_empty());
    let there = stage.plan("there");
    assert_eq!(there.flags, [PlanFlag::Affected]);
    assert!(there.affected_by.is_empty(), "no closure does");
    let short = stage.check(&there, &[]);
    assert!(short.is_err(), "the checker says so too");
    let proposed = there.wanted.as_ref().expect("a version for this wind");
    let back = stage.plan("back");
    stage
        .check_version(&there, proposed, &[&back.reported])
        .expect("it can be flown");
    assert!(stops(proposed).len() > stops(&there.reported).len());

    blow(&stage, 0.2).await;
    let calm = stage.plan("there");
    assert_eq!((calm.flags.len(), calm.wanted), (0, None));

    // More than the airframe stands: everybody stays where they are.
    blow(&stage, 12.0).await;
    for id in ["there", "back"] {
        let grounded = stage.plan(id);
        assert_eq!(grounded.flags, [PlanFlag::Affected], "{id}");
        let proposed = grounded.wanted.as_ref().expect("what to do");
        assert!(proposed.legs.is_empty(), "{id}: {proposed:?}");
    }
}

#[tokio::test]
async fn a_drone_in_flight_goes_on_with_the_battery_that_it_has() {
    let stage = on(&street(&[1, 1, 1, 1, 1, 1]));
    let request = json!({"id": "p", "drone_id": "d", "source": "s0", "destination": "s5"});
    let plan = stage.deliver(request).await.expect("a plan");
    stage.pass(SignedDuration::from_secs(100)).await;
    stage.see("d", 1_300.0, 0.0).await;
    let zone = windowed(circle("match", 4_500.0, 0.0, 50.0), "06:00", "06:40");
    stage.zone(zone).await;
    let met = stage.plan("p");
    let proposed = met.wanted.as_ref().expect("a version");
    let flight = proposed.flight.as_ref().expect("a flight");
    let full = plan.reported.flight.as_ref().expect("a flight");
    assert!(
        flight.battery_at_departure_fraction < full.battery_at_departure_fraction - 0.02,
        "{flight:?}"
    );
    assert!(!flight.stops.is_empty(), "it waits somewhere: {flight:?}");
    assert!(instant(&proposed.arrives_at) > at("06:40"));
    assert_eq!(met.energy, "assumed");
}

#[tokio::test]
async fn flights_and_their_pads_survive_a_restart() {
    let disk = MemoryDisk::default();
    let stage = Stage::over_with(disk.open(), settings()).await;
    let cut = windowed(circle("cut", 350.0, 50.0, 80.0), "05:00", "06:30");
    stage.zone(cut).await;
    let request = json!({"id": "p1", "source": "a0", "destination": "a7", "objective": "time"});
    let before = stage.deliver(request).await.expect("a plan");
    assert!(!stops(&before.reported).is_empty(), "{before:?}");
    stage.edge.end().await;
    let stage = stage.again(disk.open()).await;
    let after = stage.plan("p1");
    let told = |plan: &wire::Plan<'_>| {
        let mut told = serde_json::to_value(plan).expect("JSON");
        told.as_object_mut().expect("an object").remove("revision");
        told
    };
    assert_eq!(told(&before), told(&after));
    let request = json!({"id": "p2", "source": "a0", "destination": "a7"});
    let second = stage.deliver(request).await.expect("a plan");
    stage
        .check(&second, &[&after])
        .expect("it keeps off what was reserved before the restart");
    stage.edge.end().await;
}

#[tokio::test]
async fn plans_of_an_edge_without_the_flight_model_are_read_by_one_with_it() {
    let disk = MemoryDisk::default();
    let without = Settings {
        flight: None,
        ..settings()
    };
    let stage = Stage::over_with(disk.open(), without).await;
    stage.compose("old", "d1", "a0", "a4").await;
    stage.edge.end().await;
    let rows = disk.rows(Table::Plans);
    let row: Value = serde_json::from_str(&rows[0].1).expect("JSON");
    // As it was written before there were flights.
    assert!(row.get("order").is_none() && row["reported"].get("flight").is_none());
    let stage = stage.again_with(disk.open(), settings()).await;
    let old = stage.plan("old");
    assert_eq!((&*old.energy, &*old.times), ("unchecked", "nominal"));
    let request = json!({"id": "new", "source": "a4", "destination": "a0"});
    let new = stage.deliver(request).await.expect("a plan");
    assert_eq!(new.times, "computed");
    assert!(new.conflicts.is_empty(), "it keeps off the old plan");
    stage.edge.end().await;
}

#[tokio::test]
async fn a_flight_goes_on_over_another_network_unless_its_pad_is_gone() {
    let stage = on(&street(&[1, 1, 1, 1]));
    let zone = windowed(circle("match", 2_500.0, 0.0, 50.0), "06:55", "07:30");
    stage.zone(zone).await;
    let request = json!({"id": "p", "source": "s0", "destination": "s3", "start_time": "2026-11-21T07:00:00Z"});
    let before = stage.deliver(request).await.expect("a plan");
    let waits = stops(&before.reported)[0].0.clone();
    stage
        .rebuild(|draft| {
            draft.nodes.insert(0, node("new", 0.0, 900.0));
            draft.segments.insert(0, segment("new", "s0"));
        })
        .await;
    let after = stage.plan("p");
    assert_eq!(stops(&after.reported), stops(&before.reported));
    assert_eq!(after.reported.arrives_at, before.reported.arrives_at);
    assert!(after.flags.is_empty());
    stage.check(&after, &[]).expect("it can be flown still");
    let closed = |draft: &mut NetworkDraft| {
        let mut nodes = draft.nodes.iter_mut();
        let there = nodes.find(|node| node.id == waits);
        there.expect("the node").pads = 0;
    };
    stage.rebuild(closed).await;
    let moved = stage.plan("p");
    assert_eq!(moved.flags, [PlanFlag::Affected], "{moved:?}");
    let proposed = moved.wanted.as_ref().expect("a version");
    assert_ne!(stops(proposed)[0].0, waits);
    stage
        .check_version(&moved, proposed, &[])
        .expect("it can be flown");
}

#[tokio::test]
async fn a_lower_speed_limit_on_another_network_affects_the_flights_that_come_there() {
    let stage = on(&street(&[1, 1, 1, 1]));
    let request = json!({"id": "p", "source": "s0", "destination": "s3", "start_time": "2026-11-21T07:00:00Z"});
    let before = stage.deliver(request).await.expect("a plan");
    stage
        .rebuild(|draft| draft.segments[1].speed_limit_mps = Some(4.0))
        .await;
    let after = stage.plan("p");
    assert_eq!(after.flags, [PlanFlag::Affected], "{after:?}");
    let slower = after.wanted.as_ref().expect("a version");
    assert!(instant(&slower.arrives_at) > instant(&before.reported.arrives_at));
    stage
        .check_version(&after, slower, &[])
        .expect("it can be flown");
}

/// What it takes is printed, as a machine that is busy says nothing about an edge.
#[tokio::test]
async fn many_plans_that_a_zone_meets_keep_off_each_other_afterwards() {
    let stage = corridor();
    for number in 0..10 {
        let (hour, minute) = (7 + number / 6, 10 * (number % 6));
        let request = json!({
            "id": format!("p{number}"), "source": 1, "destination": 280, "payload_kg": 0.25,
            "start_time": format!("2026-11-21T{hour:02}:{minute:02}:00Z"),
            "deadline": "2026-11-22T02:00:00Z",
        });
        stage.deliver(request).await.expect("a plan");
    }
    let ids: Vec<String> = (0..10).map(|number| format!("p{number}")).collect();
    let first = stage.plan("p0");
    let middle = &first.reported.legs[first.reported.legs.len() / 2];
    let draft = json!({
        "id": "works", "segments": [middle.segment],
        "until": "2026-11-21T11:00:00Z",
    });
    let draft = serde_json::from_value(draft).expect("a closure");
    let watch = Clock::real().stopwatch();
    let closed = stage
        .edge
        .close(&stage.caller, draft, Idempotency::default());
    closed.await.expect("closed");
    // Two that took the same pad: the later one is in the next wave.
    stage.settle().await;
    let took_s = watch.elapsed().as_secs_f64();
    let plans: Vec<wire::Plan<'_>> = ids.iter().map(|id| stage.plan(id)).collect();
    let affected: Vec<&wire::Plan<'_>> = plans
        .iter()
        .filter(|plan| plan.flags == [PlanFlag::Affected])
        .collect();
    assert!(affected.len() > 2, "{} plans are met", affected.len());
    for plan in &affected {
        let proposed = plan.wanted.as_ref().expect("a version");
        let others = plans.iter().filter(|other| other.id != plan.id);
        let counting: Vec<&wire::PlanVersion<'_>> = others
            .flat_map(|other| std::iter::once(&other.reported).chain(&other.wanted))
            .collect();
        stage
            .check_version(plan, proposed, &counting)
            .expect("it keeps off all that count");
    }
    println!("{} of 10 plans recomposed in {took_s:.3} s", affected.len());
}

#[tokio::test]
async fn a_closure_is_in_force_before_many_drones_have_been_answered() {
    let stage = on(&block());
    for number in 0..40 {
        let (hour, minute) = (8 + number / 12, 5 * (number % 12));
        let request = json!({
            "id": format!("p{number}"), "source": "s0", "destination": "s2",
            "start_time": format!("2026-11-21T{hour:02}:{minute:02}:00Z"),
        });
        stage.deliver(request).await.expect("a plan");
    }
    let ack = stage.zone(circle("fire", 1_500.0, 0.0, 50.0)).await;
    assert_eq!(ack.effect.plan_count, 40);
    assert_eq!(
        ack.effect.plans.len(),
        32,
        "as many as are in a wave: {:?}",
        ack.effect.plans
    );
    stage.settle().await;
    for number in 0..40 {
        let plan = stage.plan(&format!("p{number}"));
        assert_eq!(plan.flags, [PlanFlag::Affected]);
        assert_eq!(plan.affected_by, ["fire"]);
        let proposed = plan.wanted.as_ref().expect("a version");
        assert_eq!(names(&proposed.path.nodes), ["s0", "north", "s2"]);
        stage.check_version(&plan, proposed, &[]).expect("flyable");
    }
}

/// What is worked out for a plan ends on the network after the change, where its numbers are those of other nodes.
#[tokio::test]
async fn contingencies_that_come_after_a_change_of_the_network_spoil_nothing() {
    // Beside the street runs another one, for detours.
    let mut streets = street(&[2; 40]);
    for place in 0..40 {
        let aside = format!("t{place}");
        let at_m = 1_000.0 * f64::from(place);
        streets.nodes.push(node(&aside, at_m, 300.0));
        let joined = segment(format!("s{place}"), aside.clone());
        streets.segments.push(joined);
        if place > 0 {
            let along = segment(format!("t{}", place - 1), aside);
            streets.segments.push(along);
        }
    }
    let mut left = streets.clone();
    for place in 0..20 {
        without(&mut left, &format!("s{place}"));
        without(&mut left, &format!("t{place}"));
    }
    for _ in 0..10 {
        let stage = on(&streets);
        let after = loaded(&left);
        for number in 0..6 {
            let start = instant(DAWN) + SignedDuration::from_mins(10 * number);
            let request = json!({
                "id": format!("p{number}"), "drone_id": format!("d{number}"), "source": "s20", "destination": "s27",
                "start_time": start.to_string(),
            });
            let request = serde_json::from_value(request).expect("a delivery request");
            let composed = stage
                .edge
                .compose_plan(&stage.caller, request, Default::default());
            composed.await.expect("a plan");
        }
        let replaced = stage.edge.replace_network(after).await;
        replaced.expect("the network is put into service");
        stage.zone(circle("z", 26_500.0, 0.0, 10.0)).await;
        stage.settle().await;
        assert_eq!(stage.plan("p0").affected_by, ["z"]);
    }
}

#[tokio::test]
async fn pads_that_close_where_a_diversion_ends_affect_it() {
    let stage = on(&street(&[1, 1, 1, 1]));
    let asked = json!({"id": "p", "drone_id": "d", "source": "s0", "destination": "s3", "battery_fraction": 0.9});
    let plan = stage.deliver(asked).await.expect("a plan");
    stage.pass(SignedDuration::from_secs(60)).await;
    stage.see("d", 600.0, 0.0).await;
    let report = json!({"type": "operational", "service": {"plan_id": "p", "leg": 0}, "location": {"x": 600.0, "y": 0.0},
        "drone": {"id": "d", "battery_fraction": 0.15}});
    let answer = stage.answer(report).await;
    assert_eq!(answer["outcome"], "diverted", "{answer}");
    let plan = acknowledge(&stage, &plan.id, 2).await;
    assert!(plan.flags.is_empty());
    let end = plan
        .reported
        .path
        .nodes
        .last()
        .expect("a node")
        .text()
        .to_owned();
    let draft = serde_json::from_value(json!({"id": "works", "pads": [end]}));
    let closed = stage.edge.close(
        &stage.caller,
        draft.expect("a closure"),
        Idempotency::default(),
    );
    closed.await.expect("closed");
    stage.settle().await;
    let plan = stage.plan("p");
    assert_eq!(
        (plan.flags, plan.affected_by),
        (vec![PlanFlag::Affected], vec!["works".into()])
    );
}
