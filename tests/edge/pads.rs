//! Pads of drones that have landed: theirs until they are known to have left.

use crate::flying::{instant, on, settings, stops, street, windowed};
use crate::memory_disk::MemoryDisk;
use crate::stage::{Stage, circle, node, segment, without};
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway::edge::Code;
use skyway::network::SegmentDraft;
use skyway::wire::{self, EndedAs, PlanState};

/// s0 without pads, s1 and s2 with one each.
const PADS: [u16; 3] = [0, 1, 1];

/// A drone flies from s2 to s1 and lands there.
async fn landed(stage: &Stage) {
    flown(stage).await;
    let completion = wire::Completion::default();
    let ended = stage.edge.complete_plan(&stage.caller, "first", completion);
    assert_eq!(
        ended.await.expect("ended").ended_as,
        Some(EndedAs::Delivered)
    );
}

async fn flown(stage: &Stage) {
    let request = json!({"id": "first", "drone_id": "d1", "source": "s2", "destination": "s1"});
    stage.deliver(request).await.expect("a plan");
    stage.pass(SignedDuration::from_mins(2)).await;
}

/// Whether there is a pad at s1 for a drone that has to charge there.
async fn is_free(stage: &Stage) -> bool {
    let request =
        json!({"drone_id": "probe", "source": "s0", "destination": "s2", "battery_fraction": 0.28});
    match stage.deliver(request).await {
        Ok(plan) => {
            let flight = plan.reported.flight.as_ref().expect("a flight");
            assert_eq!(flight.stops.len(), 1, "{:?}", flight.stops);
            let cancelled = stage
                .edge
                .cancel_plan(&stage.caller, &plan.id, Default::default());
            cancelled.await.expect("cancelled");
            true
        }
        Err(refusal) => {
            assert_eq!(refusal.code, Code::NoRoute, "{refusal:?}");
            false
        }
    }
}

async fn tells(stage: &Stage, x: f64, more: Value) {
    let mut position = json!({"drone_id": "d1", "location": {"x": x, "y": 0.0}});
    let fields = more.as_object().expect("an object").clone();
    position.as_object_mut().expect("an object").extend(fields);
    let positions = vec![position];
    let told = stage
        .edge
        .telemetry(&stage.caller, wire::Telemetry { positions });
    assert!(told.await.expect("telemetry").positions[0].accepted);
    stage.settle().await;
}

/// The nodes on whose pads drones stand, by drone.
fn standing(stage: &Stage) -> Vec<(String, String)> {
    let drones = stage.edge.drones(&stage.caller, &Default::default());
    let drones = drones.expect("drones").drones.into_iter();
    let standing = drones.filter_map(|drone| {
        let node = drone.stands_at.as_ref()?.text().to_owned();
        Some((drone.id.into_owned(), node))
    });
    standing.collect()
}

fn pair(drone: &str, node: &str) -> (String, String) {
    (drone.to_owned(), node.to_owned())
}

#[tokio::test]
async fn a_drone_that_has_landed_keeps_its_pad_until_telemetry_says_that_it_has_left() {
    for (x, more) in [(1_000.0, json!({"airborne": true})), (1_060.0, json!({}))] {
        let stage = on(&street(&PADS));
        assert!(is_free(&stage).await, "before anything has landed");
        landed(&stage).await;
        assert!(!is_free(&stage).await);
        tells(&stage, 1_000.0, json!({"airborne": false})).await;
        assert_eq!(standing(&stage), [pair("d1", "s1")]);
        stage.pass(SignedDuration::from_mins(600)).await;
        assert!(!is_free(&stage).await, "time alone frees nothing");
        tells(&stage, x, more).await;
        assert!(is_free(&stage).await);
    }
}

/// It has taken off from its pad, and has to land again: nobody else has that pad.
#[tokio::test]
async fn a_drone_without_a_plan_may_land_on_the_pad_that_is_its_own() {
    let stage = on(&street(&PADS));
    landed(&stage).await;
    let report = |drone: &str| {
        json!({"type": "operational", "detail": "battery", "drone": {"id": drone}, "dry_run": true,
            "service": {"from": "s1", "to": "s2"}, "location": {"node": "s1"}, "airborne": true})
    };
    let own = stage.answer(report("d1")).await;
    assert_eq!(own["path"]["nodes"], json!(["s1"]), "{own}");
    let other = stage.answer(report("d2")).await;
    assert_ne!(other["path"]["nodes"], json!(["s1"]), "{other}");
}

#[tokio::test]
async fn the_departure_of_its_next_plan_frees_the_pad_of_a_drone() {
    let stage = on(&street(&PADS));
    landed(&stage).await;
    // It charges on the pad that is its own, and departs when it has.
    let request = json!({
        "id": "next", "drone_id": "d1", "source": "s1", "destination": "s2", "battery_fraction": 0.24,
    });
    let next = stage.deliver(request).await.expect("its pad is its own");
    assert_eq!(next.reported.flight.expect("a flight").stops.len(), 1);
    assert_eq!(stage.plan("next").state, PlanState::Accepted);
    assert!(!is_free(&stage).await);
    tells(&stage, 1_000.0, json!({"airborne": true})).await;
    assert_eq!(stage.plan("next").state, PlanState::Activated);
    assert!(standing(&stage).is_empty());
}

#[tokio::test]
async fn an_operator_frees_the_pad_of_a_drone() {
    let stage = on(&street(&PADS));
    landed(&stage).await;
    assert!(!is_free(&stage).await);
    let release = wire::Release {
        ended_as: EndedAs::Delivered,
    };
    let released = stage.edge.release_plan(&stage.caller, "first", release);
    released.await.expect("released");
    assert!(is_free(&stage).await);
}

#[tokio::test]
async fn the_pad_of_a_drone_that_rests_at_its_end_is_taken_too() {
    let stage = on(&street(&PADS));
    flown(&stage).await;
    let rests = json!({"airborne": false, "ground_speed_mps": 0.0});
    for _ in 0..3 {
        tells(&stage, 1_000.0, rests.clone()).await;
        stage.pass(SignedDuration::from_secs(3)).await;
    }
    assert_eq!(stage.plan("first").ended_as, Some(EndedAs::Delivered));
    assert!(!is_free(&stage).await);
}

/// A drone flies along the ladder and lands on the only pad at its end.
async fn lands_at_the_end(stage: &Stage, drone: &str) {
    let request = json!({"id": drone, "drone_id": drone, "source": "a1", "destination": "a7"});
    stage.deliver(request).await.expect("a plan");
    stage.pass(SignedDuration::from_mins(2)).await;
    let place = json!({"location": {"node": "a7"}});
    let completion = serde_json::from_value(place).expect("a completion");
    let ended = stage.edge.complete_plan(&stage.caller, drone, completion);
    assert_eq!(
        ended.await.expect("ended").ended_as,
        Some(EndedAs::Delivered)
    );
}

#[tokio::test]
async fn a_pad_is_a_drones_after_a_restart_and_on_another_network() {
    let disk = MemoryDisk::default();
    let stage = Stage::over_with(disk.open(), settings()).await;
    lands_at_the_end(&stage, "d1").await;
    assert_eq!(standing(&stage), [pair("d1", "a7")]);
    stage.edge.end().await;
    let stage = stage.again_with(disk.open(), settings()).await;
    // There is one pad, and it is taken: another drone that has landed there has none.
    lands_at_the_end(&stage, "d2").await;
    assert!(standing(&stage).is_empty());
    stage
        .rebuild(|draft| {
            draft.nodes.insert(0, node("west", -100.0, 0.0));
            draft.segments.insert(0, segment("west", "a0"));
        })
        .await;
    lands_at_the_end(&stage, "d3").await;
    assert!(standing(&stage).is_empty());
    // Until the first one says that it has left.
    let place = json!({"drone_id": "d1", "location": {"x": 600.0, "y": 0.0}, "airborne": true});
    let positions = vec![place];
    let told = stage
        .edge
        .telemetry(&stage.caller, wire::Telemetry { positions });
    assert!(told.await.expect("telemetry").positions[0].accepted);
    stage.settle().await;
    lands_at_the_end(&stage, "d4").await;
    assert_eq!(standing(&stage), [pair("d4", "a7")]);
}

/// What it has flown over may go: its drone stands where it has landed.
#[tokio::test]
async fn a_pad_is_a_drones_where_a_leg_that_it_has_flown_is_gone() {
    for gone in [("a2", "a3"), ("a6", "a7")] {
        let stage = Stage::with(settings());
        lands_at_the_end(&stage, "d1").await;
        stage
            .rebuild(|draft| {
                let is_gone = |it: &SegmentDraft| (&*it.from, &*it.to) == gone;
                draft.segments.retain(|it| !is_gone(it));
            })
            .await;
        assert_eq!(standing(&stage), [pair("d1", "a7")], "{gone:?}");
        lands_at_the_end(&stage, "d2").await;
        assert_eq!(standing(&stage), [pair("d1", "a7")], "{gone:?}");
        stage.rebuild(|draft| without(draft, "a1")).await;
        assert_eq!(standing(&stage), [pair("d1", "a7")], "{gone:?}");
        stage.rebuild(|draft| without(draft, "a7")).await;
        assert!(standing(&stage).is_empty(), "{gone:?}");
    }
}

#[tokio::test]
async fn a_pad_that_a_lost_drone_was_to_land_on_is_taken_until_it_is_released() {
    let stage = on(&street(&[0, 1, 1]));
    // Its only pad is where it charges.
    let request = json!({"id": "first", "drone_id": "d1", "source": "s0", "destination": "s2", "battery_fraction": 0.28});
    stage.deliver(request).await.expect("a plan");
    stage.pass(SignedDuration::from_mins(180)).await;
    assert_eq!(stage.plan("first").ended_as, Some(EndedAs::Lost));
    assert!(!is_free(&stage).await);
    let next = json!({"id": "next", "drone_id": "d1", "source": "s2", "destination": "s0"});
    stage.deliver(next).await.expect("a plan");
    stage.pass(SignedDuration::from_mins(1)).await;
    assert!(
        !is_free(&stage).await,
        "that it has another plan says nothing of what was lost"
    );
    let release = wire::Release {
        ended_as: EndedAs::Cancelled,
    };
    let released = stage.edge.release_plan(&stage.caller, "first", release);
    released.await.expect("released");
    stage.pass(SignedDuration::from_mins(3)).await;
    assert!(is_free(&stage).await);
}

async fn completes(stage: &Stage, plan: &str, node: &str) {
    let place = json!({"location": {"node": node}});
    let completion = serde_json::from_value(place).expect("a completion");
    let ended = stage.edge.complete_plan(&stage.caller, plan, completion);
    ended.await.expect("ended");
}

/// A plan along the street whose drone is not heard of.
async fn lost() -> Stage {
    let stage = on(&street(&PADS));
    flown(&stage).await;
    stage.pass(SignedDuration::from_mins(180)).await;
    assert_eq!(stage.plan("first").ended_as, Some(EndedAs::Lost));
    stage
}

#[tokio::test]
async fn late_word_of_a_lost_plan_moves_no_drone_that_has_flown_since() {
    let stage = lost().await;
    let next = json!({"id": "next", "drone_id": "d1", "source": "s0", "destination": "s2"});
    stage.deliver(next).await.expect("a plan");
    stage.pass(SignedDuration::from_mins(3)).await;
    completes(&stage, "next", "s2").await;
    completes(&stage, "first", "s1").await;
    assert_eq!(standing(&stage), [pair("d1", "s2")]);
    assert!(is_free(&stage).await);
}

#[tokio::test]
async fn a_plan_whose_drone_is_found_on_a_pad_after_all_is_not_forgotten() {
    let stage = lost().await;
    let release = wire::Release {
        ended_as: EndedAs::Lost,
    };
    let released = stage.edge.release_plan(&stage.caller, "first", release);
    released.await.expect("released");
    completes(&stage, "first", "s1").await;
    for number in 0..=1_000 {
        let request = json!({"id": format!("p{number}"), "drone_id": "d2", "source": "s0", "destination": "s2"});
        let plan = stage.deliver(request).await.expect("a plan");
        let cancelled = stage
            .edge
            .cancel_plan(&stage.caller, &plan.id, Default::default());
        cancelled.await.expect("cancelled");
    }
    assert_eq!(stage.plan("first").ended_as, Some(EndedAs::Delivered));
    tells(&stage, 1_000.0, json!({"airborne": true})).await;
    assert!(standing(&stage).is_empty());
}

#[tokio::test]
async fn a_plan_that_is_overdue_at_a_full_pad_is_alarmed() {
    let stage = on(&street(&PADS));
    landed(&stage).await;
    let second = json!({"id": "second", "drone_id": "d2", "source": "s2", "destination": "s1"});
    stage.deliver(second).await.expect("a plan");
    let third = json!({"id": "third", "drone_id": "d3", "source": "s1", "destination": "s2"});
    stage.deliver(third).await.expect("a plan");
    stage.pass(SignedDuration::from_mins(20)).await;
    let filter = skyway::edge::AlarmFilter::default();
    let alarms = stage
        .edge
        .alarms(&stage.caller, &Default::default(), filter);
    let alarms = alarms.expect("alarms").alarms;
    let told: Vec<_> = alarms
        .iter()
        .map(|alarm| (alarm.kind, alarm.plan_id.as_deref()))
        .collect();
    assert_eq!(
        told,
        [(wire::AlarmKind::Overdue, Some("second"))],
        "s2 has a free pad"
    );
}

#[tokio::test]
async fn a_drone_that_is_overdue_keeps_its_pad_on_another_network() {
    let stage = on(&street(&[0, 1, 1]));
    let request = json!({"id": "first", "drone_id": "d1", "source": "s0", "destination": "s2", "battery_fraction": 0.28});
    let plan = stage.deliver(request).await.expect("a plan");
    let arrives_at: Timestamp = plan.reported.arrives_at.parse().expect("an instant");
    let flies = arrives_at.duration_since(stage.edge.clock().now());
    stage.pass(flies + SignedDuration::from_mins(5)).await;
    assert!(!is_free(&stage).await, "it may be on the pad yet");
    stage
        .rebuild(|draft| draft.nodes.push(node("far", 0.0, 5_000.0)))
        .await;
    assert!(!is_free(&stage).await, "and is on none other than before");
}

#[tokio::test]
async fn who_lands_after_its_plan_was_cancelled_in_flight_has_its_pad() {
    let stage = on(&street(&PADS));
    flown(&stage).await;
    let cancelled = stage
        .edge
        .cancel_plan(&stage.caller, "first", Default::default());
    cancelled.await.expect("cancelled");
    let completion = serde_json::from_value(json!({"location": {"node": "s1"}}));
    let completion = completion.expect("a completion");
    let landed = stage
        .edge
        .complete_plan(&stage.caller, "first", completion)
        .await;
    assert_eq!(landed.expect("heard").ended_as, Some(EndedAs::Cancelled));
    assert_eq!(standing(&stage), [pair("d1", "s1")]);
    assert!(!is_free(&stage).await);
}

/// It stands on the second pad of s1, and the first one is free.
async fn on_the_second_pad() -> Stage {
    let stage = on(&street(&[0, 2, 2]));
    for (plan, drone) in [("zero", "d0"), ("first", "d1")] {
        let request = json!({"id": plan, "drone_id": drone, "source": "s2", "destination": "s1"});
        stage.deliver(request).await.expect("a plan");
    }
    stage.pass(SignedDuration::from_mins(5)).await;
    for plan in ["zero", "first"] {
        completes(&stage, plan, "s1").await;
    }
    let position =
        json!({"drone_id": "d0", "location": {"x": 1_000.0, "y": 0.0}, "airborne": true});
    let batch = wire::Telemetry {
        positions: vec![position],
    };
    let told = stage.edge.telemetry(&stage.caller, batch).await;
    told.expect("telemetry");
    stage.settle().await;
    stage
}

#[tokio::test]
async fn a_drone_charges_on_the_pad_on_which_it_stands() {
    let stage = on_the_second_pad().await;
    let request = json!({
        "id": "next", "drone_id": "d1", "source": "s1", "destination": "s2", "battery_fraction": 0.24,
    });
    let next = stage.deliver(request).await.expect("a plan");
    assert_eq!(stops(&next.reported)[0].1, 1, "{:?}", stops(&next.reported));
    // It has to wait there for longer.
    let zone = windowed(circle("match", 1_500.0, 0.0, 50.0), "06:00", "07:30");
    stage.zone(zone).await;
    let wanted = stage.plan("next").wanted.expect("a version");
    assert_eq!(stops(&wanted)[0].1, 1, "{:?}", stops(&wanted));
}

#[tokio::test]
async fn a_drone_that_has_just_landed_is_handled_before_it_charges() {
    let stage = on(&street(&PADS));
    let request = json!({"id": "p", "drone_id": "d1", "source": "s0", "destination": "s2", "battery_fraction": 0.28});
    let plan = stage.deliver(request).await.expect("a plan");
    let lands_at = instant(stops(&plan.reported)[0].2);
    let after_landing =
        lands_at.duration_since(stage.edge.clock().now()) + SignedDuration::from_secs(1);
    stage.pass(after_landing).await;
    let zone = windowed(circle("match", 1_500.0, 0.0, 50.0), "06:00", "07:30");
    stage.zone(zone).await;
    let wanted = stage.plan("p").wanted.expect("a version");
    let handled_at = lands_at + SignedDuration::from_secs(60);
    assert_eq!(instant(&wanted.departs_at), handled_at, "{wanted:?}");
}
