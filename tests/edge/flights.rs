//! Plans with times, battery and pads: composed among others, freed, kept over a restart, held against zones.

use crate::flying::{at, corridor, instant, on, seconds, stops, street, windowed};
use crate::stage::{Stage, circle};
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::edge::Code;
use skyway::wire::{self, PadReservation};

/// From San Marcos to San Antonio.
fn long_delivery(id: &str) -> Value {
    json!({
        "id": id, "drone_id": id, "source": 1, "destination": 280, "payload_kg": 0.25,
        "start_time": "2026-11-21T07:00:00Z", "deadline": "2026-11-21T21:00:00Z",
    })
}

/// Stays that overlap by less, in seconds, are one behind the other.
const TOUCH_S: f64 = 1e-3;

fn overlap(one: &wire::PlanVersion<'_>, other: &wire::PlanVersion<'_>) -> bool {
    let others = stops(other);
    stops(one).iter().any(|(node, pad, lands, takes_off)| {
        others.iter().any(|(at, on, from, until)| {
            (node, pad) == (at, on)
                && seconds(instant(lands), instant(until)) > TOUCH_S
                && seconds(instant(from), instant(takes_off)) > TOUCH_S
        })
    })
}

#[tokio::test]
async fn a_delivery_over_the_corridor_recharges_on_pads_that_the_next_one_keeps_off() {
    let stage = corridor();
    let first = stage.deliver(long_delivery("first")).await.expect("a plan");
    assert_eq!((&*first.energy, &*first.times), ("assumed", "computed"));
    assert_eq!(first.assumed, ["airframe", "battery"]);
    assert_eq!(first.airframe.as_deref(), Some("DJI Phantom 3"));
    let flight = first.reported.flight.as_ref().expect("a flight");
    assert!(flight.stops.len() > 5, "{} stops", flight.stops.len());
    assert!(flight.proved, "{:?}", flight.unproved_reason);
    let confirmed = |stop: &wire::Stop<'_>| stop.reservation == PadReservation::Confirmed;
    assert!(flight.stops.iter().all(confirmed));
    assert_eq!(flight.value, first.reported.length_m);
    stage.check(&first, &[]).expect("it can be flown");

    let second = stage
        .deliver(long_delivery("second"))
        .await
        .expect("a plan");
    stage.check(&second, &[&first]).expect("beside the first");
    assert!(second.conflicts.is_empty(), "{:?}", second.conflicts);
    assert!(!overlap(&first.reported, &second.reported));
    let third = stage.deliver(long_delivery("third")).await.expect("a plan");
    stage
        .check(&third, &[&first, &second])
        .expect("beside both");
    let alone = stage.check(&third, &[]);
    alone.expect("what can be flown among others can be flown");
    println!(
        "{:.1} km in {:.2} h with {} stops; the second takes {:.2} h, the third {:.2} h",
        first.reported.length_m / 1e3,
        first.reported.flight_time_s / 3600.0,
        flight.stops.len(),
        second.reported.flight_time_s / 3600.0,
        third.reported.flight_time_s / 3600.0,
    );
}

#[tokio::test]
async fn energy_is_checked_only_for_what_was_said() {
    // Each drone has a segment of its own.
    let stage = on(&street(&[2; 14]));
    let see = async |drone: u32| {
        let positions = vec![json!({
            "drone_id": format!("p{drone}"), "location": {"x": 2_000 * drone, "y": 0},
            "battery_fraction": 0.8, "airborne": false,
        })];
        let batch = wire::Telemetry { positions };
        let told = stage.edge.telemetry(&stage.caller, batch).await;
        told.expect("telemetry");
    };
    let told = async |drone: u32, more: Value| {
        let (id, from) = (format!("p{drone}"), 2 * drone);
        let mut request = json!({
            "id": id, "drone_id": id, "source": format!("s{from}"), "destination": format!("s{}", from + 1),
        });
        let fields = request.as_object_mut().expect("an object");
        fields.extend(more.as_object().expect("an object").clone());
        let plan = stage.deliver(request).await.expect("a plan");
        let flight = plan.reported.flight.as_ref().expect("a flight");
        let departure = flight.battery_at_departure_fraction;
        (plan.energy.into_owned(), plan.assumed.join(" "), departure)
    };
    let words = |energy: &str, assumed: &str, battery: f64| {
        (energy.to_owned(), assumed.to_owned(), battery)
    };
    assert_eq!(
        told(1, json!({})).await,
        words("assumed", "airframe battery", 0.98)
    );
    let named = json!({"airframe": "phantom3"});
    assert_eq!(
        told(2, named.clone()).await,
        words("assumed", "battery", 0.98)
    );
    let stated = json!({"battery_fraction": 0.7});
    assert_eq!(told(3, stated).await, words("assumed", "airframe", 0.7));
    let both = json!({"airframe": "phantom3", "battery_fraction": 0.7});
    assert_eq!(told(4, both).await, words("checked", "", 0.7));
    see(5).await;
    see(6).await;
    // A position without a battery takes nothing back of what was said of it.
    stage.see("p5", 10_000.0, 0.0).await;
    stage.pass(SignedDuration::from_mins(5)).await;
    assert_eq!(told(5, named.clone()).await, words("checked", "", 0.8));
    stage.pass(SignedDuration::from_secs(1)).await;
    assert_eq!(told(6, named).await, words("assumed", "battery", 0.8));

    // An answer in flight rests on what its plan rests on, and on what the report says.
    let report = |battery: Value| {
        json!({
            "type": "navigational", "dry_run": true, "service": {"plan_id": "p1", "leg": 0},
            "location": {"x": 2_300, "y": 0}, "drone": {"id": "p1", "battery_fraction": battery},
        })
    };
    let told = stage.answer(report(json!(0.9))).await;
    assert_eq!(
        (&told["energy"], &told["assumed"]),
        (&json!("assumed"), &json!(["airframe"]))
    );
    let told = stage.answer(report(Value::Null)).await;
    assert_eq!(told["assumed"], json!(["airframe", "battery"]), "{told}");
}

#[tokio::test]
async fn a_plan_that_is_cancelled_frees_its_pads() {
    let stage = corridor();
    let first = stage.deliver(long_delivery("first")).await.expect("a plan");
    let second = stage
        .deliver(long_delivery("second"))
        .await
        .expect("a plan");
    assert_ne!(
        (&second.reported.path, stops(&second.reported)),
        (&first.reported.path, stops(&first.reported)),
    );
    for id in ["first", "second"] {
        let cancelled = stage
            .edge
            .cancel_plan(&stage.caller, id, Default::default())
            .await;
        cancelled.expect("cancelled");
    }
    let again = stage.deliver(long_delivery("again")).await.expect("a plan");
    assert_eq!(again.reported.legs, first.reported.legs);
    assert_eq!(stops(&again.reported), stops(&first.reported));
}

#[tokio::test]
async fn of_two_plans_that_meet_head_on_the_second_waits() {
    // Of three segments they would meet in the middle of the second.
    let stage = on(&street(&[1, 1, 1, 1]));
    let east = stage
        .deliver(json!({"id": "east", "source": "s0", "destination": "s3"}))
        .await
        .expect("a plan");
    let west = stage
        .deliver(json!({"id": "west", "source": "s3", "destination": "s0"}))
        .await
        .expect("a plan");
    assert!(stops(&east.reported).is_empty(), "{east:?}");
    stage.check(&east, &[]).expect("it can be flown");
    stage.check(&west, &[&east]).expect("it keeps off");
    assert!(
        !stops(&west.reported).is_empty(),
        "there is no way around: {west:?}"
    );
    assert!(west.conflicts.is_empty(), "{:?}", west.conflicts);
    // One that follows keeps the headway.
    let next = stage
        .deliver(json!({"id": "next", "source": "s0", "destination": "s3"}))
        .await
        .expect("a plan");
    stage.check(&next, &[&east, &west]).expect("it keeps off");
    let behind = instant(&next.reported.legs[0].departs_at)
        .duration_since(instant(&east.reported.legs[0].departs_at));
    assert!(behind.as_secs() >= 30, "{behind}");
}

#[tokio::test]
async fn without_headway_plans_may_meet() {
    let mut settings = crate::flying::settings();
    settings.headway_s = 0.0;
    let network = crate::stage::loaded(&street(&[1, 1, 1]));
    let stage = Stage::on(network.topology, network.geojson, settings);
    for (id, from, to) in [
        ("east", "s0", "s2"),
        ("west", "s2", "s0"),
        ("next", "s0", "s2"),
    ] {
        let plan = stage.deliver(json!({"id": id, "source": from, "destination": to}));
        let plan = plan.await.expect("a plan");
        assert!(stops(&plan.reported).is_empty(), "{plan:?}");
    }
}

#[tokio::test]
async fn a_zone_of_half_an_hour_is_flown_through_before_and_waited_out_in_it() {
    let stage = on(&street(&[1, 1, 1, 1]));
    let parade = windowed(circle("parade", 1_500.0, 0.0, 50.0), "12:00", "12:30");
    stage.zone(parade).await;
    let delivery = |id: &str| json!({"id": id, "source": "s0", "destination": "s3"});
    stage.wait_until("11:50").await;
    let before = stage.deliver(delivery("before")).await.expect("a plan");
    stage.check(&before, &[]).expect("it can be flown");
    assert!(stops(&before.reported).is_empty(), "{before:?}");
    assert!(instant(&before.reported.arrives_at) < at("11:55"));
    assert_eq!(
        (before.flags.len(), &before.affected_by),
        (0, &Vec::new()),
        "it is through before the zone begins"
    );

    stage.wait_until("12:10").await;
    let during = stage.deliver(delivery("during")).await.expect("a plan");
    stage.check(&during, &[]).expect("it can be flown");
    let waits = stops(&during.reported);
    assert_eq!(waits.len(), 1, "{waits:?}");
    assert!(instant(waits[0].3) > at("12:30"), "{waits:?}");
    assert!(during.flags.is_empty());
    // And one for the afternoon knows nothing of it.
    let mut late = delivery("late");
    late["start_time"] = json!("2026-11-21T14:00:00Z");
    let late = stage.deliver(late).await.expect("a plan");
    assert!(stops(&late.reported).is_empty(), "{late:?}");
    assert!(late.flags.is_empty());
}

#[tokio::test]
async fn without_a_plan_every_cause_is_named_with_its_times() {
    let stage = on(&street(&[1, 1, 1]));
    let works = windowed(circle("works", 500.0, 0.0, 50.0), "05:00", "09:00");
    stage.zone(works).await;
    let refused = stage
        .deliver(json!({"source": "s0", "destination": "s2"}))
        .await
        .expect_err("the way is closed until after the deadline");
    assert_eq!(refused.code, Code::NoRoute);
    let codes: Vec<&str> = refused.faults.iter().map(|fault| &*fault.code).collect();
    assert_eq!(codes, ["closure", "opens"], "{refused:?}");
    assert!(
        refused.faults[0].message.contains("'works'")
            && refused.faults[0].message.contains("2026-11-21T09:00:00Z"),
        "{refused:?}"
    );
    let opens = &refused.faults[1];
    let latest = opens.hint.as_deref().expect("a hint");
    let latest = latest.split(' ').nth(4).expect("an instant");
    let plan = stage
        .deliver(json!({"source": "s0", "destination": "s2", "deadline": latest}))
        .await
        .expect("the plan that was told");
    stage.check(&plan, &[]).expect("it can be flown");
}

#[tokio::test]
async fn what_is_asked_of_a_flight_is_read_strictly() {
    let stage = on(&street(&[1, 1]));
    let refused = stage
        .deliver(json!({
            "source": "s0", "destination": "s1", "airframe": "zeppelin", "battery_fraction": 87,
            "objective": "beauty", "deadline": "2026-11-21T05:00:00Z",
        }))
        .await
        .expect_err("nothing of it is right");
    assert_eq!(refused.code, Code::PlanInvalid);
    let told: Vec<(&str, &str)> = refused
        .faults
        .iter()
        .map(|fault| (&*fault.pointer, &*fault.code))
        .collect();
    assert_eq!(
        told,
        [
            ("/battery_fraction", "out_of_range"),
            ("/airframe", "unknown_airframe"),
            ("/objective", "unknown_objective"),
            ("/deadline", "deadline_before_start"),
        ]
    );
    assert_eq!(
        refused.faults[0].hint.as_deref(),
        Some("did you mean 0.87?")
    );
    let without = Stage::set();
    let refused = without
        .deliver(json!({"source": "a0", "destination": "a1", "objective": "time"}))
        .await
        .expect_err("there is no flight model");
    assert_eq!(refused.faults[0].code, "flight_model_off");
}

#[tokio::test]
async fn plans_for_the_same_moment_are_composed_one_after_the_other() {
    let stage = corridor();
    let requests = (0..6).map(|number| {
        let (edge, caller) = (stage.edge.clone(), stage.caller.clone());
        let request = serde_json::from_value(long_delivery(&format!("p{number}")));
        tokio::spawn(async move {
            let request = request.expect("a request");
            edge.compose_plan(&caller, request, Default::default())
                .await
        })
    });
    let mut plans = Vec::new();
    for request in requests.collect::<Vec<_>>() {
        plans.push(request.await.expect("no panic").expect("a plan"));
    }
    for (place, plan) in plans.iter().enumerate() {
        let mut others: Vec<&wire::Plan<'_>> = plans.iter().collect();
        others.remove(place);
        stage
            .check(plan, &others)
            .expect("they keep off each other");
    }
}

#[tokio::test]
async fn a_place_that_is_acknowledged_is_no_news_of_the_battery() {
    let stage = on(&street(&[2; 8]));
    let asked = json!({"id": "p", "drone_id": "d", "source": "s0", "destination": "s7", "airframe": "phantom3"});
    stage.deliver(asked).await.expect("a plan");
    stage.pass(SignedDuration::from_secs(20)).await;
    let positions = vec![json!({
        "drone_id": "d", "location": {"x": 40.0, "y": 0.0}, "battery_fraction": 0.97, "airborne": true,
    })];
    let told = stage
        .edge
        .telemetry(&stage.caller, wire::Telemetry { positions })
        .await;
    told.expect("telemetry");
    let report = json!({
        "type": "navigational", "dry_run": true, "service": {"plan_id": "p", "leg": 3},
        "location": {"x": 3_300.0, "y": 0.0}, "drone": {"id": "d"},
    });
    stage.pass(SignedDuration::from_mins(6)).await;
    let ack = json!({"version": 1, "location": {"x": 3_300.0, "y": 0.0}});
    let ack = serde_json::from_value(ack).expect("an acknowledgement");
    let taken = stage.edge.acknowledge_plan(&stage.caller, "p", ack).await;
    taken.expect("it flies that");
    let told = stage.answer(report).await;
    assert_eq!(told["assumed"], json!(["battery"]), "{told}");
}
