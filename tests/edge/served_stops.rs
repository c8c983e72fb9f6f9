//! At which of its stops a delivery was served, by what is seen of its drone.

use crate::deliveries::{EVERY, Pilot, flights, following, order, town};
use crate::flying::{instant, on_with};
use crate::stage::circle;
use jiff::SignedDuration;
use serde_json::json;
use skyway::wire::{self, EndedAs};

#[tokio::test]
async fn without_telemetry_only_who_had_the_time_has_served_its_stops() {
    for (is_late, served) in [(true, 2), (false, 0)] {
        let stage = on_with(&town(), following());
        let plan = stage.deliver(order()).await.expect("a plan");
        let departs = instant(&plan.reported.departs_at);
        let arrives = instant(&plan.reported.arrives_at);
        let flown = match is_late {
            true => arrives.duration_since(departs),
            false => SignedDuration::from_secs(60),
        };
        stage.pass(flown).await;
        // The clock alone has served nothing.
        assert_eq!(flights(&stage).pop().map(|it| it.stops_served), Some(0));
        let landed = wire::Completion::default();
        let ended = stage.edge.complete_plan(&stage.caller, "p", landed).await;
        ended.expect("ended");
        let last = flights(&stage).pop().expect("news");
        assert_eq!(last.ended_as, Some(EndedAs::Delivered));
        assert_eq!(last.stops_served, served, "{last:?}");
    }
}

#[tokio::test]
async fn who_turns_back_before_the_stop_has_not_served_it() {
    for service_s in [0.0, 60.0] {
        turns_back(service_s).await;
    }
}

async fn turns_back(service_s: f64) {
    let draft = town();
    let stage = on_with(&draft, following());
    let mut order = order();
    for stop in order["stops"].as_array_mut().expect("stops") {
        stop["service_s"] = json!(service_s);
    }
    let plan = stage.deliver(order).await.expect("a plan");
    let pilot = Pilot::of(&stage, &draft);
    for x in [100.0, 300.0, 500.0, 700.0, 500.0, 300.0, 100.0] {
        stage.pass(SignedDuration::from_secs(13)).await;
        pilot.tell([x, 0.0], true).await;
    }
    let arrives = instant(&plan.reported.arrives_at);
    while stage.edge.clock().now() < arrives + SignedDuration::from_secs(20) {
        stage.pass(EVERY).await;
        pilot.tell([0.0, 0.0], false).await;
    }
    let served: Vec<u32> = flights(&stage).iter().map(|it| it.stops_served).collect();
    assert!(served.iter().all(|served| *served == 0), "{served:?}");
}

/// Its way out leads around what its way back will lead through, and that is where it is seen before it has turned.
#[tokio::test]
async fn who_is_seen_off_its_way_where_it_will_come_back_has_not_served_its_stops() {
    let mut draft = town();
    // Nowhere to wait for the way to open.
    draft.nodes[1].pads = 0;
    let stage = on_with(&draft, following());
    let plan = stage.deliver(order()).await.expect("a plan");
    let pilot = Pilot::of(&stage, &draft);
    let passes = instant(&plan.reported.legs[1].departs_at);
    pilot.fly_until(&plan.reported, passes).await;
    let opens = stage.edge.clock().now() + SignedDuration::from_mins(3);
    let mut crane = circle("crane", 1_600.0, 0.0, 50.0);
    crane["properties"]["windows"] = json!([{"until": opens.to_string()}]);
    stage.zone(crane).await;
    stage.settle().await;
    let wanted = stage.plan("p").wanted.expect("a way around");
    let nodes: Vec<&str> = wanted.path.nodes.iter().map(wire::Id::text).collect();
    assert_eq!(nodes, ["s1", "u1", "s2", "s3", "s2", "s1", "s0"]);
    let version = pilot.acknowledge(wanted.version).await.version;
    for x in [1_300.0, 1_350.0, 1_400.0] {
        stage.pass(EVERY).await;
        pilot.tell([x, 0.0], true).await;
        let newest = stage.plan("p");
        let newest = newest.wanted.unwrap_or(newest.reported);
        if newest.version > version {
            pilot.acknowledge(newest.version).await;
        }
    }
    assert_eq!(stage.plan("p").stops.len(), 2, "all are ahead");
    let served: Vec<u32> = flights(&stage).iter().map(|it| it.stops_served).collect();
    assert!(served.iter().all(|served| *served == 0), "{served:?}");
}

#[tokio::test]
async fn who_only_flies_over_the_stop_has_not_served_it() {
    let draft = town();
    let stage = on_with(&draft, following());
    stage.deliver(order()).await.expect("a plan");
    let pilot = Pilot::of(&stage, &draft);
    for step in 1..40 {
        stage.pass(EVERY).await;
        let x = f64::from(step) * 75.0;
        pilot.tell([x.min(3_000.0), 0.0], true).await;
    }
    assert_eq!(flights(&stage).pop().map(|it| it.stops_served), Some(0));

    // Nor because it is told another way home.
    for x in [2_900.0, 2_800.0, 2_700.0] {
        stage.pass(EVERY).await;
        pilot.tell([x, 0.0], true).await;
    }
    stage.zone(circle("crane", 1_500.0, 0.0, 50.0)).await;
    stage.settle().await;
    let wanted = stage.plan("p").wanted.expect("another way");
    pilot.acknowledge(wanted.version).await;
    assert_eq!(stage.plan("p").stops.len(), 2, "it is led back to them");
    assert_eq!(flights(&stage).pop().map(|it| it.stops_served), Some(0));
}
