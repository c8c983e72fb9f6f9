//! What closes is in force before any plan is looked at; plans are then replanned in their order, a few at a time.

use crate::flights_change::acknowledge;
use crate::flying;
use crate::memory_disk::MemoryDisk;
use crate::stage::{Stage, circle, names};
use jiff::SignedDuration;
use serde_json::{Value, json};
use skyway::clock::ManualClock;
use skyway::edge::{
    Caller, Edge, EventRecord, FeedImport, PageRequest, PlanFilter, Settings, WriterStep, ZoneWrite,
};
use skyway::formats::parse_report;
#[cfg(feature = "planted")]
use skyway::planted::{Bug, here};
use skyway::wire::{self, EventKind, PlanFlag, PlanState};
use std::pin::pin;
use std::sync::{Arc, Mutex, OnceLock};
use std::task::{Context, Poll, Waker};
use tokio_stream::StreamExt;

fn by_distance() -> Settings {
    Settings {
        closed_fraction_max: 0.2,
        ..Settings::default()
    }
}

/// What a future gives that waits for nothing.
fn at_once<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    match future
        .as_mut()
        .poll(&mut Context::from_waker(Waker::noop()))
    {
        Poll::Ready(done) => done,
        Poll::Pending => panic!("it waits"),
    }
}

/// The way that a drone without a plan is told along the row that the zone lies on.
fn bystander(edge: &Arc<Edge>) -> Vec<String> {
    let body = json!({"type": "service_level", "service": {"from": "a0", "to": "a1"}, "destination": "a7",
        "location": {"node": "a0"}, "airborne": true, "dry_run": true, "drone": {"id": "by", "battery_fraction": 1.0}});
    let parsed = parse_report(body.to_string().as_bytes()).expect("a report");
    let answered = at_once(edge.report_failure(&Caller::anyone(), parsed)).expect("an outcome");
    names(&answered.to_wire().answer.path.nodes)
}

fn affected_by(edge: &Arc<Edge>, closure: &str) -> usize {
    let page = PageRequest {
        size: Some(1_000),
        token: None,
    };
    let filter = PlanFilter {
        affected_by: Some(closure.to_owned()),
        ..PlanFilter::default()
    };
    let listed = edge
        .plans(&Caller::anyone(), &page, &filter)
        .expect("plans");
    let is_affected = |plan: &&wire::Plan<'_>| plan.flags.contains(&PlanFlag::Affected);
    listed.plans.iter().filter(is_affected).count()
}

pub(crate) async fn told(edge: &Arc<Edge>) -> Vec<Arc<EventRecord>> {
    let mut stream = edge.events(Some("7-0")).expect("a stream");
    let latest = edge.latest_event_id();
    let mut told = Vec::new();
    loop {
        let event = stream
            .next()
            .await
            .expect("an event")
            .expect("none is missed");
        let is_last = event.id == latest;
        told.push(event);
        if is_last {
            return told;
        }
    }
}

pub(crate) fn of_kind(told: &[Arc<EventRecord>], kind: EventKind) -> Vec<&Value> {
    let events = told.iter().filter(|event| event.kind == kind);
    events.map(|event| &event.event.data).collect()
}

/// What happened as the writer was watched: steps, each with what a bystander was told or how many plans show as affected.
type Seen = Arc<Mutex<Vec<(WriterStep, bool, usize)>>>;

/// Posts a zone over a fleet and looks at the edge whenever the writer says where it is.
async fn zone_over_fleet(
    settings: Settings,
    plans: usize,
) -> (Stage, Seen, wire::ZoneAck<'static>) {
    let seen: Seen = Arc::default();
    let noted = seen.clone();
    let stage = Stage::watched(settings, true, move |edge, step| {
        let avoids = !bystander(edge).contains(&"a4".to_owned());
        let shown = affected_by(edge, "z");
        noted.lock().expect("whole").push((step, avoids, shown));
    });
    for number in 0..plans {
        let (from, to) = if number % 2 == 0 {
            ("a0", "a7")
        } else {
            ("a7", "a0")
        };
        let start =
            stage.edge.clock().now() + SignedDuration::from_secs(300 * number as i64 % 3_000);
        let request = json!({"id": format!("p{number}"), "drone_id": format!("d{number}"), "source": from, "destination": to,
            "start_time": start.to_string()});
        stage.deliver(request).await.expect("a plan");
    }
    seen.lock().expect("whole").clear();
    let ack = stage.zone(circle("z", 400.0, 0.0, 10.0)).await;
    (stage, seen, ack)
}

#[tokio::test]
async fn a_bystander_avoids_a_zone_before_any_plan_is_looked_at() {
    for settings in [by_distance(), flying::settings()] {
        let (_stage, seen, ack) = zone_over_fleet(settings, 2).await;
        assert!(
            ack.enforced && ack.effect.plan_count > 0,
            "{:?}",
            ack.effect
        );
        let seen = seen.lock().expect("whole");
        let (step, avoids, shown) = seen[0];
        assert_eq!(
            (step, avoids, shown),
            (WriterStep::Enforced, true, 0),
            "{seen:?}"
        );
        let looked = seen
            .iter()
            .filter(|(step, ..)| *step == WriterStep::LookedAtPlan);
        assert!(looked.count() >= ack.effect.plan_count, "{seen:?}");
    }
}

#[tokio::test]
async fn a_zone_that_is_only_added_frees_no_plan_and_one_that_is_lifted_may() {
    let (stage, seen, _) = zone_over_fleet(flying::settings(), 2).await;
    assert_eq!(affected_by(&stage.edge, "z"), 2);
    let looked = || {
        let seen = std::mem::take(&mut *seen.lock().expect("whole"));
        let looked = seen.iter();
        looked
            .filter(|(step, ..)| *step == WriterStep::LookedAtPlan)
            .count()
    };
    looked();
    stage.zone(circle("far", -3_000.0, -3_000.0, 10.0)).await;
    assert_eq!(looked(), 0);
    let write = ZoneWrite {
        id: Some("far".to_owned()),
        if_match: Some("*".to_owned()),
        validate_only: false,
    };
    let lifted = stage.edge.delete_zone(&stage.caller, write, None).await;
    lifted.expect("a zone that was there");
    assert_eq!(looked(), 2);
}

#[cfg(feature = "planted")]
#[test]
fn an_edge_that_looks_at_plans_first_is_found() {
    for settings in [by_distance(), flying::settings()] {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .expect("a runtime");
        let story = zone_over_fleet(settings, 2);
        let (_stage, seen, _) = here(Bug::PlansFirst, || runtime.block_on(story));
        let seen = seen.lock().expect("whole");
        assert_eq!(
            (seen[0].0, seen[0].1),
            (WriterStep::Enforced, false),
            "{seen:?}"
        );
    }
}

#[tokio::test]
async fn plans_that_are_met_are_shown_as_affected_until_all_are_told() {
    let count = 150;
    let (stage, seen, ack) = zone_over_fleet(by_distance(), count).await;
    let effect = &ack.effect;
    assert_eq!(effect.plan_count, count);
    assert!(
        effect.pending > 0 && effect.plans.len() < count,
        "{}",
        effect.pending
    );
    assert_eq!(effect.plans.len() + effect.pending, count);
    assert_eq!(effect.next.as_deref(), Some("/v1/plans?affected_by=z"));
    let seen = seen.lock().expect("whole").clone();
    assert_eq!(
        seen.iter()
            .filter(|(step, ..)| *step == WriterStep::LookedAtPlan)
            .count(),
        count
    );
    for (step, avoids, shown) in seen {
        let expected = if step == WriterStep::Enforced {
            0
        } else {
            count
        };
        assert_eq!((avoids, shown), (true, expected), "{step:?}");
    }
    let told = told(&stage.edge).await;
    let affected = of_kind(&told, EventKind::PlanAffected);
    assert_eq!(affected.len(), count);
    for data in affected {
        assert_eq!(
            (&data["outcome"], &data["causes"]),
            (&json!("rerouted"), &json!(["z"]))
        );
    }
    let last = told.last().expect("events");
    assert_eq!(last.kind, EventKind::Replanned);
    let expected = json!({"closure_id": "z", "plan_count": count, "outcomes": {"rerouted": count}});
    assert_eq!(last.event.data, expected);
}

/// What 40 flown plans that take the same pads and segments are to fly after a zone, each way and its stays.
async fn flown_after_zone(is_in_place: bool) -> Vec<Value> {
    let stage = Stage::watched(flying::settings(), is_in_place, |_, _| {});
    for number in 0..40 {
        let (from, to) = [("a0", "a7"), ("a7", "a0")][number % 2];
        let start = stage.edge.clock().now() + SignedDuration::from_secs(20 * number as i64);
        let request = json!({"id": format!("p{number:02}"), "drone_id": format!("d{number}"), "source": from,
            "destination": to, "start_time": start.to_string()});
        // Some have no way among the others: the same ones in both.
        let _ = stage.deliver(request).await;
    }
    stage.zone(circle("z", 400.0, 0.0, 10.0)).await;
    stage.settle().await;
    let page = PageRequest::default();
    let plans = stage
        .edge
        .plans(&stage.caller, &page, &PlanFilter::default())
        .expect("a page");
    let plans = plans.plans.iter().map(|plan| {
        let wanted = plan.wanted.as_ref();
        let wanted =
            wanted.map(|wanted| json!([wanted.outcome, wanted.path, wanted.legs, wanted.flight]));
        json!([plan.id, plan.affected_by, wanted])
    });
    plans.collect()
}

#[tokio::test]
async fn what_comes_of_waves_does_not_depend_on_threads() {
    let in_place = flown_after_zone(true).await;
    let with_threads = flown_after_zone(false).await;
    let told = in_place.iter().filter(|plan| !plan[2].is_null()).count();
    assert!(told > 10, "{told} of {} are told", in_place.len());
    assert_eq!(in_place, with_threads);
}

#[tokio::test]
async fn those_in_the_air_come_first_and_then_those_who_reach_the_zone_first() {
    let stage = Stage::set();
    let later = stage.edge.clock().now() + SignedDuration::from_secs(600);
    let waiting = json!({"id": "waiting", "drone_id": "d0", "source": "a5", "destination": "a7", "start_time": later.to_string()});
    stage.deliver(waiting).await.expect("a plan");
    stage.compose("far", "d1", "a0", "a7").await;
    stage.compose("near", "d2", "a4", "a7").await;
    stage.compose("middle", "d3", "a2", "a7").await;
    stage.pass(SignedDuration::from_secs(2)).await;
    stage.zone(circle("z", 600.0, 0.0, 10.0)).await;
    let told = told(&stage.edge).await;
    let affected = of_kind(&told, EventKind::PlanAffected);
    let order: Vec<&Value> = affected.iter().map(|data| &data["plan"]["id"]).collect();
    assert_eq!(order, ["near", "middle", "far", "waiting"]);
}

#[tokio::test]
async fn who_is_to_start_later_starts_no_sooner_around_a_zone() {
    let stage = Stage::set();
    let later = stage.edge.clock().now() + SignedDuration::from_hours(10);
    let waiting = json!({"id": "p", "drone_id": "d", "source": "a0", "destination": "a7", "start_time": later.to_string()});
    stage.deliver(waiting).await.expect("a plan");
    stage.zone(circle("z", 400.0, 0.0, 10.0)).await;
    let wanted = stage.plan("p").wanted.expect("a way around");
    assert_eq!(wanted.departs_at, later.to_string());
    acknowledge(&stage, "p", wanted.version).await;
    stage.pass(SignedDuration::from_hours(9)).await;
    let plan = stage.plan("p");
    assert_eq!((plan.state, plan.ended_as), (PlanState::Accepted, None));
    assert!(!plan.flags.contains(&PlanFlag::Overdue), "{:?}", plan.flags);
}

#[tokio::test]
async fn new_orders_are_in_force_between_two_plans() {
    let seen: Arc<Mutex<Vec<(WriterStep, usize, bool)>>> = Arc::default();
    let noted = seen.clone();
    let stage = Stage::watched(by_distance(), false, move |edge, step| {
        let snapshot = edge.snapshot();
        let closures = snapshot.airspace().closure_count();
        let is_first = {
            let mut noted = noted.lock().expect("whole");
            noted.push((step, closures, snapshot.airspace().is_in_force("z")));
            let looked = noted
                .iter()
                .filter(|(step, _, zone)| *step == WriterStep::LookedAtPlan && *zone);
            step == WriterStep::LookedAtPlan && looked.count() == 1
        };
        if is_first {
            // While plans are replanned, a drone reports what is ahead of it: its order waits in the queue.
            let body = json!({"type": "navigational", "service": {"plan_id": "other", "leg": 0}, "drone": {"id": "do"}});
            let parsed = parse_report(body.to_string().as_bytes()).expect("a report");
            at_once(edge.report_failure(&Caller::anyone(), parsed)).expect("an outcome");
        }
    });
    for number in 0..40 {
        stage
            .compose(&format!("p{number}"), &format!("d{number}"), "a0", "a7")
            .await;
    }
    stage.compose("other", "do", "b0", "b3").await;
    stage.settle().await;
    let ack = stage.zone(circle("z", 400.0, 0.0, 10.0)).await;
    assert!(ack.effect.pending > 30, "{}", ack.effect.pending);
    stage.settle().await;
    let seen = seen.lock().expect("whole").clone();
    let looked =
        |entry: &&(WriterStep, usize, bool)| entry.0 == WriterStep::LookedAtPlan && entry.2;
    assert!(seen.iter().filter(looked).count() >= 40);
    let before = seen
        .iter()
        .filter(looked)
        .filter(|(_, closures, _)| *closures == 1);
    assert_eq!(
        before.count(),
        1,
        "the report's closure is in force before the next plan: {seen:?}"
    );
    assert_eq!(affected_by(&stage.edge, "z"), 40);
}

#[tokio::test]
async fn what_meets_plans_while_they_are_looked_at_is_shown_until_they_are_looked_at_again() {
    let shown: Arc<Mutex<Vec<usize>>> = Arc::default();
    let noted = shown.clone();
    let stage = Stage::watched(by_distance(), false, move |edge, step| {
        if step != WriterStep::LookedAtPlan || !edge.snapshot().airspace().is_in_force("z") {
            return;
        }
        let mut noted = noted.lock().expect("whole");
        if noted.is_empty() {
            let body = json!({"type": "navigational", "service": {"plan_id": "p9", "leg": 6}, "drone": {"id": "d9"}});
            let parsed = parse_report(body.to_string().as_bytes()).expect("a report");
            at_once(edge.report_failure(&Caller::anyone(), parsed)).expect("an outcome");
        }
        noted.push(affected_by(edge, "report:a6-a7"));
    });
    for number in 0..20 {
        let (plan, drone) = (format!("p{number}"), format!("d{number}"));
        stage.compose(&plan, &drone, "a0", "a7").await;
    }
    stage.settle().await;
    stage.zone(circle("z", 250.0, 0.0, 10.0)).await;
    stage.settle().await;
    let shown = shown.lock().expect("whole").clone();
    assert_eq!(affected_by(&stage.edge, "report:a6-a7"), 20);
    let met = shown.iter().skip_while(|count| **count == 0);
    assert!(met.clone().count() >= 20, "{shown:?}");
    // The first has been told already, and meets the leg on its new way, too.
    assert!(met.clone().all(|count| *count == 20), "{shown:?}");
}

#[tokio::test]
async fn what_closes_behind_a_drone_gives_it_nothing_to_take_over() {
    let stage = Stage::set();
    stage.compose("p", "d", "a0", "a7").await;
    stage.pass(SignedDuration::from_secs(8)).await;
    stage.see("d", 83.0, 2.0).await;
    let ack = stage.zone(circle("z", 30.0, 0.0, 10.0)).await;
    let told_of: Vec<_> = ack
        .effect
        .plans
        .iter()
        .map(|plan| (plan.outcome, plan.version, plan.extra_m))
        .collect();
    assert_eq!(told_of, [(wire::Outcome::Unaffected, None, Some(0.0))]);
    let plan = stage.plan("p");
    assert!(
        plan.wanted.is_none() && plan.flags.is_empty(),
        "{:?}",
        plan.flags
    );
    let told = told(&stage.edge).await;
    assert!(of_kind(&told, EventKind::PlanAffected).is_empty());
    let relieved = of_kind(&told, EventKind::PlanRelieved);
    assert_eq!(relieved.len(), 1);
    assert_eq!(
        (&relieved[0]["outcome"], &relieved[0]["causes"]),
        (&json!("unaffected"), &json!(["z"]))
    );
    assert_eq!(
        of_kind(&told, EventKind::Replanned)[0]["outcomes"],
        json!({"unaffected": 1})
    );
}

#[tokio::test]
async fn what_a_drone_has_passed_before_its_turn_came_is_named_too() {
    let hand: Arc<OnceLock<Arc<ManualClock>>> = Arc::default();
    let (clock, has_flown) = (hand.clone(), OnceLock::new());
    let stage = Stage::watched(by_distance(), false, move |_, step| {
        if let (WriterStep::LookedAtPlan, Some(hand)) = (step, clock.get()) {
            // All fly on while some have had their turn.
            has_flown.get_or_init(|| hand.advance(SignedDuration::from_secs(15)));
        }
    });
    for number in 0..40 {
        let (plan, drone) = (format!("p{number}"), format!("d{number}"));
        stage.compose(&plan, &drone, "a0", "a7").await;
    }
    stage.pass(SignedDuration::from_secs(8)).await;
    assert!(hand.set(stage.hand.clone()).is_ok(), "once");
    let zones = [("near", 130.0), ("far", 450.0)].map(|(id, x)| circle(id, x, 0.0, 10.0));
    let feed = json!({"type": "FeatureCollection", "features": zones}).to_string();
    let import = FeedImport {
        feed: "city".to_owned(),
        ..FeedImport::default()
    };
    let imported = stage.edge.import_zones(&stage.caller, feed, import);
    imported.await.expect("zones");
    stage.settle().await;
    let told = told(&stage.edge).await;
    let relieved = of_kind(&told, EventKind::PlanRelieved);
    assert!(!relieved.is_empty() && relieved.len() < 40, "{relieved:?}");
    let both = |event: &&Value| event["causes"] == json!(["far", "near"]);
    let affected = of_kind(&told, EventKind::PlanAffected);
    assert_eq!(
        affected.iter().filter(|event| both(event)).count() + relieved.len(),
        40
    );
    for event in relieved {
        assert_eq!(event["causes"], json!(["near"]));
        assert_eq!(event["plan"]["affected_by"], json!(["far"]));
        assert_eq!(event["plan"]["flags"], json!(["affected"]));
    }
}

#[tokio::test]
async fn plans_that_were_met_and_not_told_are_found_again_after_a_restart() {
    let disk = MemoryDisk::default();
    let stage = Stage::over(disk.open()).await;
    for number in 0..150 {
        stage
            .compose(&format!("p{number}"), &format!("d{number}"), "a0", "a7")
            .await;
    }
    let ack = stage.zone(circle("z", 400.0, 0.0, 10.0)).await;
    // Stored with the first of them: the power goes before the others are told.
    assert!(
        ack.durable && ack.effect.pending > 0,
        "{}",
        ack.effect.pending
    );
    disk.crash();
    let stage = stage.again(disk.open()).await;
    stage.settle().await;
    assert_eq!(affected_by(&stage.edge, "z"), 150);
    let all = PageRequest {
        size: Some(1_000),
        token: None,
    };
    let plans = stage
        .edge
        .plans(&stage.caller, &all, &PlanFilter::default())
        .expect("plans");
    let told = plans.plans.iter().filter(|plan| plan.wanted.is_some());
    assert_eq!(told.count(), 150);
}
