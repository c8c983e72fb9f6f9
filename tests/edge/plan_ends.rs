//! How plans end: by what is said of them, never by their planned times.

use crate::memory_disk::MemoryDisk;
use crate::stage::{Stage, circle};
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::edge::{Code, Idempotency, PageRequest, PlanFilter};
use skyway::wire::{self, EndedAs, EventKind, PlanFlag, PlanState};
use tokio_stream::StreamExt;

impl Stage {
    async fn complete(&self, id: &str, body: Value) -> wire::Plan<'static> {
        let completion = serde_json::from_value(body).expect("a completion");
        let ended = self.edge.complete_plan(&self.caller, id, completion).await;
        ended.expect("ended")
    }

    async fn release(&self, id: &str, ended_as: EndedAs) -> wire::Plan<'static> {
        let release = wire::Release { ended_as };
        let ended = self.edge.release_plan(&self.caller, id, release).await;
        ended.expect("released")
    }

    /// A drone on the ladder tells where it is, and whatever else.
    async fn tells(&self, drone: &str, x: f64, more: Value) {
        let mut position = json!({"drone_id": drone, "location": {"x": x, "y": 0.0}});
        let fields = more.as_object().expect("an object").clone();
        position.as_object_mut().expect("an object").extend(fields);
        let positions = vec![position];
        let told = self
            .edge
            .telemetry(&self.caller, wire::Telemetry { positions });
        assert!(told.await.expect("telemetry").positions[0].accepted);
        self.settle().await;
    }
}

#[tokio::test]
async fn planned_times_end_nothing_and_an_overdue_plan_is_told_once() {
    let stage = Stage::set();
    stage.compose("p1", "d1", "a0", "a3").await;
    assert_eq!(stage.plan("p1").state, PlanState::Accepted);
    let mut events = stage.edge.events(None).expect("a stream");
    stage.pass(SignedDuration::from_secs(30 + 59)).await;
    let plan = stage.plan("p1");
    assert_eq!((plan.state, plan.flags.len()), (PlanState::Activated, 0));
    stage.pass(SignedDuration::from_secs(2)).await;
    stage.pass(SignedDuration::from_mins(40)).await;
    let plan = stage.plan("p1");
    assert_eq!(plan.state, PlanState::Activated);
    assert_eq!(plan.flags, [PlanFlag::Overdue]);
    stage.complete("p1", json!({})).await;
    let overdue = events.next().await.expect("more").expect("no gap");
    assert_eq!(overdue.kind, EventKind::PlanOverdue);
    let ended = events.next().await.expect("more").expect("no gap");
    assert_eq!(ended.kind, EventKind::PlanEnded);
    assert_eq!(ended.event.data["plan"]["ended_as"], "delivered");
}

#[tokio::test]
async fn a_plan_that_is_late_is_still_in_the_way_of_others() {
    let stage = Stage::set();
    stage.compose("late", "d1", "a0", "a3").await;
    stage.pass(SignedDuration::from_mins(20)).await;
    let request = json!({"drone_id": "d1", "source": "a3", "destination": "a0"});
    let request = serde_json::from_value(request).expect("a request");
    let second = stage
        .edge
        .compose_plan(&stage.caller, request, Default::default());
    let refused = second
        .await
        .expect_err("its drone has not said that it has landed");
    assert_eq!(refused.code, Code::PlanStateConflict);
    stage.complete("late", json!({})).await;
    stage.compose("next", "d1", "a3", "a0").await;
    let filter = PlanFilter {
        drone_id: Some("d1".to_owned()),
        ..PlanFilter::default()
    };
    let plans = stage
        .edge
        .plans(&stage.caller, &PageRequest::default(), &filter);
    assert_eq!(plans.expect("a list").plans.len(), 2);
}

#[tokio::test]
async fn a_drone_that_has_landed_says_so_as_often_as_it_likes() {
    let stage = Stage::set();
    for (id, place, expected) in [
        (
            "there",
            json!({"location": {"node": "a3"}}),
            EndedAs::Delivered,
        ),
        ("silent", json!({}), EndedAs::Delivered),
        (
            "elsewhere",
            json!({"location": {"node": "b1"}}),
            EndedAs::Diverted,
        ),
    ] {
        stage.compose(id, id, "a0", "a3").await;
        stage.pass(SignedDuration::from_secs(30)).await;
        let ended = stage.complete(id, place.clone()).await;
        assert_eq!(
            (ended.state, ended.ended_as),
            (PlanState::Ended, Some(expected))
        );
        assert!(ended.versions.is_empty());
        let again = stage.complete(id, place).await;
        assert_eq!(again.ended_as, Some(expected), "{id}");
    }
    assert_eq!(stage.edge.status().active_plans, 0);
}

#[tokio::test]
async fn telemetry_at_rest_at_the_last_node_ends_a_plan() {
    let resting = [
        json!({"ground_speed_mps": 0.4, "airborne": false}),
        // By two places of one second each.
        json!({"airborne": false}),
    ];
    for more in resting {
        let stage = Stage::set();
        stage.compose("p1", "d1", "a0", "a3").await;
        stage.pass(SignedDuration::from_secs(10)).await;
        stage.tells("d1", 100.0, json!({"airborne": true})).await;
        stage.pass(SignedDuration::from_secs(20)).await;
        stage.tells("d1", 300.0, more.clone()).await;
        for _ in 0..4 {
            stage.pass(SignedDuration::from_secs(1)).await;
            stage.tells("d1", 300.0, more.clone()).await;
        }
        assert_eq!(stage.plan("p1").ended_as, None, "not yet for five seconds");
        stage.pass(SignedDuration::from_secs(2)).await;
        stage.tells("d1", 300.0, more.clone()).await;
        assert_eq!(
            stage.plan("p1").ended_as,
            Some(EndedAs::Delivered),
            "{more}"
        );
    }
}

#[tokio::test]
async fn a_drone_that_flies_by_or_hovers_or_rests_elsewhere_has_not_landed() {
    let not_landed = [
        (300.0, json!({"ground_speed_mps": 0.0, "airborne": true})),
        (300.0, json!({"ground_speed_mps": 9.0, "airborne": false})),
        (284.0, json!({"ground_speed_mps": 0.0, "airborne": false})),
        (100.0, json!({"ground_speed_mps": 0.0, "airborne": false})),
        // The node's height is unknown.
        (300.0, json!({"ground_speed_mps": 0.0, "altitude_m": 1.0})),
        (300.0, json!({"ground_speed_mps": 0.0})),
    ];
    for (x, more) in not_landed {
        let stage = Stage::set();
        stage.compose("p1", "d1", "a0", "a3").await;
        for _ in 0..10 {
            stage.pass(SignedDuration::from_secs(3)).await;
            stage.tells("d1", x, more.clone()).await;
        }
        assert_eq!(stage.plan("p1").ended_as, None, "{x} {more}");
    }
}

#[tokio::test]
async fn a_plan_without_a_sign_is_lost_and_one_that_is_heard_of_is_not() {
    let stage = Stage::set();
    stage.compose("silent", "d1", "a0", "a3").await;
    stage.compose("heard", "d2", "b0", "b3").await;
    stage.pass(SignedDuration::from_mins(50)).await;
    stage.tells("d2", 150.0, json!({})).await;
    stage.pass(SignedDuration::from_mins(11)).await;
    let lost = stage.plan("silent");
    assert_eq!(
        (lost.state, lost.ended_as),
        (PlanState::Ended, Some(EndedAs::Lost))
    );
    assert_eq!(stage.plan("heard").ended_as, None);
    stage.pass(SignedDuration::from_mins(50)).await;
    assert_eq!(
        stage.plan("heard").ended_as,
        Some(EndedAs::Lost),
        "an hour after its last sign"
    );
    assert_eq!(
        stage.complete("silent", json!({})).await.ended_as,
        Some(EndedAs::Delivered)
    );
    assert_eq!(
        stage.release("heard", EndedAs::Cancelled).await.ended_as,
        Some(EndedAs::Cancelled)
    );
}

#[tokio::test]
async fn a_plan_deleted_in_flight_without_a_place_keeps_its_air() {
    for is_seen in [false, true] {
        let stage = Stage::set();
        stage.compose("east", "d1", "a0", "a3").await;
        stage.compose("west", "d2", "a3", "a0").await;
        let conflicts = || stage.plan("west").conflicts.len();
        assert!(conflicts() > 0);
        stage.pass(SignedDuration::from_secs(5)).await;
        if is_seen {
            stage.tells("d1", 50.0, json!({})).await;
        }
        let ended = stage
            .edge
            .cancel_plan(&stage.caller, "east", Default::default())
            .await;
        assert_eq!(ended.expect("ended").ended_as, Some(EndedAs::Cancelled));
        assert_eq!(conflicts() == 0, is_seen);
        stage.release("east", EndedAs::Cancelled).await;
        assert_eq!(conflicts(), 0);
    }
}

#[tokio::test]
async fn a_plan_that_nobody_flies_ends_by_itself() {
    let stage = Stage::set();
    let request = json!({"id": "quote", "source": "a0", "destination": "a3", "airspeed_mps": 10.0});
    let request = serde_json::from_value(request).expect("a request");
    let plan = stage
        .edge
        .compose_plan(&stage.caller, request, Default::default());
    plan.await.expect("a plan");
    stage.pass(SignedDuration::from_secs(301)).await;
    assert_eq!(stage.plan("quote").ended_as, Some(EndedAs::Cancelled));
}

#[tokio::test]
async fn quotes_take_no_place_from_plans() {
    let stage = Stage::with(skyway::edge::Settings {
        plans_max: 2,
        ..Default::default()
    });
    let quote = |id: &str| {
        let request = json!({"id": id, "source": "a0", "destination": "a3"});
        serde_json::from_value(request).expect("a request")
    };
    for id in ["q1", "q2"] {
        let plan = stage
            .edge
            .compose_plan(&stage.caller, quote(id), Default::default());
        plan.await.expect("a quote");
    }
    stage.compose("p1", "d1", "a0", "a3").await;
    assert_eq!(stage.plan("q1").state, PlanState::Ended);
    assert_eq!(stage.plan("q2").state, PlanState::Accepted);
    stage.compose("p2", "d2", "b0", "b3").await;
    let third = stage
        .edge
        .compose_plan(&stage.caller, quote("q3"), Default::default());
    assert_eq!(third.await.expect_err("full").code, Code::LimitReached);
}

#[tokio::test]
async fn what_a_plan_has_come_to_survives_a_restart() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    stage.compose("overdue", "d1", "a0", "a3").await;
    stage.compose("delivered", "d2", "b0", "b3").await;
    stage.pass(SignedDuration::from_mins(5)).await;
    stage.complete("delivered", json!({})).await;
    let before = ["overdue", "delivered"].map(|id| stage.plan(id));
    stage.edge.end().await;
    let stage = stage.again(disk.open()).await;
    for plan in before {
        let after = stage.plan(&plan.id);
        assert_eq!(
            (after.state, after.ended_as, after.flags),
            (plan.state, plan.ended_as, plan.flags)
        );
    }
    stage.pass(SignedDuration::from_mins(60)).await;
    assert_eq!(stage.plan("overdue").ended_as, Some(EndedAs::Lost));
    assert_eq!(stage.plan("delivered").ended_as, Some(EndedAs::Delivered));
}

#[tokio::test]
async fn a_plan_that_was_cancelled_before_its_request_came_is_refused() {
    let stage = Stage::set();
    let cancel = stage
        .edge
        .cancel_plan(&stage.caller, "late", wire::Cancellation::default());
    assert_eq!(cancel.await.expect_err("unknown").code, Code::NotFound);
    let ask = async |id: &str| {
        let request = json!({"id": id, "drone_id": "d1", "source": "a0", "destination": "a3", "airspeed_mps": 10.0});
        let request = serde_json::from_value(request).expect("a request");
        let composed = stage
            .edge
            .compose_plan(&stage.caller, request, Idempotency::default());
        composed.await
    };
    let refused = ask("late").await.expect_err("it was cancelled");
    assert_eq!(refused.code, Code::PlanStateConflict, "{refused:?}");
    ask("another").await.expect("a plan");
}

#[tokio::test]
async fn a_plan_is_cancelled_before_departure_only_while_its_drone_has_not_departed() {
    let stage = Stage::set();
    let cancel = async |id: &str| {
        let cancellation = wire::Cancellation {
            before_departure: true,
            ..wire::Cancellation::default()
        };
        let cancelled = stage.edge.cancel_plan(&stage.caller, id, cancellation);
        cancelled
            .await
            .map(|plan| plan.ended_as)
            .map_err(|refusal| refusal.code)
    };
    let ask = async |id: &str, drone: &str| {
        let start = stage.edge.clock().now() + SignedDuration::from_secs(60);
        let request = json!({"id": id, "drone_id": drone, "source": "a0", "destination": "a3",
            "start_time": start.to_string(), "airspeed_mps": 10.0});
        stage.deliver(request).await.expect("a plan");
    };
    ask("waits", "d1").await;
    assert_eq!(cancel("waits").await, Ok(Some(EndedAs::Cancelled)));
    // It says so before its time has come.
    ask("early", "d2").await;
    stage.tells("d2", 0.0, json!({"airborne": true})).await;
    assert_eq!(cancel("early").await, Err(Code::PlanStateConflict));
    // Its time comes, and it is silent.
    ask("silent", "d3").await;
    stage.pass(SignedDuration::from_secs(61)).await;
    assert_eq!(cancel("silent").await, Err(Code::PlanStateConflict));
    for id in ["early", "silent"] {
        assert_eq!(stage.plan(id).state, PlanState::Activated, "{id}");
    }
}

#[tokio::test]
async fn telemetry_ends_a_plan_of_which_only_a_first_stretch_is_left() {
    let stage = Stage::set();
    stage.compose("p", "d1", "a0", "a3").await;
    stage.pass(SignedDuration::from_secs(25)).await;
    stage.tells("d1", 250.0, json!({"airborne": true})).await;
    // It is in the zone, and flies on to get out of it.
    stage.zone(circle("around", 245.0, 0.0, 20.0)).await;
    stage.settle().await;
    let ack = json!({"version": 2, "location": {"x": 250.0, "y": 0.0}});
    let ack = serde_json::from_value(ack).expect("an acknowledgement");
    let taken = stage.edge.acknowledge_plan(&stage.caller, "p", ack).await;
    assert_eq!(taken.expect("taken over").reported.path.nodes.len(), 1);
    stage.pass(SignedDuration::from_secs(60)).await;
    for _ in 0..8 {
        stage.pass(SignedDuration::from_secs(1)).await;
        stage
            .tells(
                "d1",
                300.0,
                json!({"airborne": false, "ground_speed_mps": 0.0}),
            )
            .await;
    }
    assert_eq!(stage.plan("p").ended_as, Some(EndedAs::Delivered));
}

#[tokio::test]
async fn one_that_was_heard_of_before_a_restart_is_not_lost_by_it() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    stage.compose("p", "d", "a0", "a3").await;
    // Later than it was planned to arrive, it is still on its way.
    for _ in 0..70 {
        stage.pass(SignedDuration::from_mins(1)).await;
        stage.tells("d", 150.0, json!({"airborne": true})).await;
    }
    assert_eq!(stage.plan("p").ended_as, None);
    let stage = stage.again(disk.open()).await;
    stage.settle().await;
    assert_eq!(stage.plan("p").ended_as, None);
    stage.pass(SignedDuration::from_mins(61)).await;
    assert_eq!(stage.plan("p").ended_as, Some(EndedAs::Lost));
    stage.complete("p", json!({})).await;
    let page = PageRequest::default();
    let alarms = stage.edge.alarms(&stage.caller, &page, Default::default());
    let open = alarms.expect("alarms").alarms.into_iter();
    let open: Vec<_> = open.filter(|alarm| alarm.ended_at.is_none()).collect();
    assert!(open.is_empty(), "it is found: {open:?}");
}
