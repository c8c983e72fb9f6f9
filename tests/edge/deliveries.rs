//! Plans that are flown for deliveries of the registry: what it is told of them, and what their drones are.

use crate::flying::{instant, on_with, settings, street};
use crate::memory_disk::MemoryDisk;
use crate::stage::{Stage, circle, node, segment};
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway::edge::{Caller, Code, Role, Settings, ZoneWrite};
use skyway::network::NetworkDraft;
use skyway::wire::{self, EndedAs, FlightNews, MessageKind, NewsEntry, PlanState};
use std::cell::Cell;

/// How often a drone sends where it is.
pub(crate) const EVERY: SignedDuration = SignedDuration::from_secs(5);

pub(crate) fn following() -> Settings {
    Settings {
        follows_registry: true,
        ..settings()
    }
}

/// `s0 - s1 - s2 - s3`, a kilometre each, with a pad at each, and a way around `s1 - s2` by `u1`.
pub(crate) fn town() -> NetworkDraft {
    let mut draft = street(&[1, 1, 1, 1]);
    draft.nodes.push(node("u1", 1_500.0, 600.0));
    for (from, to) in [("s1", "u1"), ("u1", "s2")] {
        draft.segments.push(segment(from, to));
    }
    draft
}

/// From home at `s0` to the pickup at `s2`, to the drop at `s3`, and home.
pub(crate) fn order() -> Value {
    json!({
        "id": "p", "drone_id": "d", "delivery_id": "order-1", "source": "s0", "destination": "s0",
        "stops": [{"node": "s2", "service_s": 60.0}, {"node": "s3", "service_s": 30.0}],
    })
}

fn news(stage: &Stage) -> Vec<NewsEntry> {
    stage.edge.snapshot().news().cloned().collect()
}

pub(crate) fn flights(stage: &Stage) -> Vec<FlightNews> {
    let news = news(stage);
    news.into_iter().filter_map(|entry| entry.flight).collect()
}

/// State, version, outcome, stops served and end of each entry.
fn told(stage: &Stage) -> Vec<(PlanState, u32, String, u32, Option<EndedAs>)> {
    let flights = flights(stage).into_iter();
    flights
        .map(|it| {
            (
                it.state,
                it.version,
                it.outcome,
                it.stops_served,
                it.ended_as,
            )
        })
        .collect()
}

/// A drone that flies what it was told, to the second.
pub(crate) struct Pilot<'a> {
    stage: &'a Stage,
    draft: &'a NetworkDraft,
    /// Where it was told what it flies.
    begins: Cell<[f64; 2]>,
}

/// A place on a straight line, at an instant of a time.
fn between(ends: [[f64; 2]; 2], (from, until): (Timestamp, Timestamp), now: Timestamp) -> [f64; 2] {
    let all_s = until.duration_since(from).as_secs_f64();
    let share = now.duration_since(from).as_secs_f64() / all_s.max(0.001);
    let [begin, end] = ends;
    [0, 1].map(|axis| begin[axis] + (end[axis] - begin[axis]) * share.clamp(0.0, 1.0))
}

impl<'a> Pilot<'a> {
    /// At home.
    pub(crate) fn of(stage: &'a Stage, draft: &'a NetworkDraft) -> Self {
        Self {
            stage,
            draft,
            begins: Cell::new([0.0, 0.0]),
        }
    }
}

impl Pilot<'_> {
    fn place(&self, node: &wire::Id<'_>) -> [f64; 2] {
        let found = self.draft.nodes.iter().find(|it| it.id == node.text());
        found.expect("a node").position
    }

    /// Where it is by a version at an instant, and whether in the air.
    fn at(&self, version: &wire::PlanVersion<'_>, now: Timestamp) -> ([f64; 2], bool) {
        let mut stands = self.place(&version.path.nodes[0]);
        let first = instant(&version.legs[0].departs_at);
        if version.first_stretch.is_some() && now < first {
            let stretch = (instant(&version.departs_at), first);
            return (between([self.begins.get(), stands], stretch, now), true);
        }
        for leg in &version.legs {
            let (departs, arrives) = (instant(&leg.departs_at), instant(&leg.arrives_at));
            if now < departs {
                return (stands, false);
            }
            let [from, to] = [&leg.from, &leg.to].map(|node| self.place(node));
            if now < arrives {
                return (between([from, to], (departs, arrives), now), true);
            }
            stands = to;
        }
        (stands, false)
    }

    pub(crate) async fn tell(&self, [x, y]: [f64; 2], airborne: bool) {
        let positions = vec![json!({
            "drone_id": "d", "location": {"x": x, "y": y}, "airborne": airborne,
            "ground_speed_mps": if airborne { 16.0 } else { 0.0 },
        })];
        let batch = wire::Telemetry { positions };
        let answer = self.stage.edge.telemetry(&self.stage.caller, batch).await;
        let answer = answer.expect("telemetry");
        assert!(answer.positions[0].accepted, "{:?}", answer.positions[0]);
        self.stage.settle().await;
    }

    /// Flies a version until an instant; tells where it is every few seconds.
    pub(crate) async fn fly_until(&self, version: &wire::PlanVersion<'_>, until: Timestamp) {
        while self.stage.edge.clock().now() < until {
            self.stage.pass(EVERY).await;
            let (place, airborne) = self.at(version, self.stage.edge.clock().now());
            self.begins.set(place);
            self.tell(place, airborne).await;
        }
    }

    pub(crate) async fn acknowledge(&self, version: u32) -> wire::PlanVersion<'static> {
        let ack = wire::Ack {
            version,
            ..wire::Ack::default()
        };
        let edge = &self.stage.edge;
        let taken = edge.acknowledge_plan(&self.stage.caller, "p", ack).await;
        self.stage.settle().await;
        taken.expect("taken over").reported
    }
}

#[tokio::test]
async fn the_registry_is_told_of_every_step_of_a_delivery() {
    let draft = town();
    let stage = on_with(&draft, following());
    let plan = stage.deliver(order()).await.expect("a plan");
    assert_eq!(plan.delivery_id.as_deref(), Some("order-1"));
    let version = &plan.reported;
    let flight = version.flight.as_ref().expect("a flight");
    let lands: Vec<&str> = flight.stops.iter().map(|stop| &*stop.lands_at).collect();
    let pilot = Pilot::of(&stage, &draft);
    let end = instant(&version.arrives_at) + SignedDuration::from_secs(20);
    pilot.fly_until(version, end).await;
    let composed = |state, served, ended| (state, 1, "composed".to_owned(), served, ended);
    let steps = [
        composed(PlanState::Accepted, 0, None),
        composed(PlanState::Activated, 0, None),
        composed(PlanState::Activated, 1, None),
        composed(PlanState::Activated, 2, None),
        composed(PlanState::Ended, 2, Some(EndedAs::Delivered)),
    ];
    let mut is = told(&stage);
    // Its pilot does not know how it climbs and slows down.
    is.retain(|(state, ..)| *state != PlanState::Nonconforming);
    is.dedup();
    assert_eq!(is, steps);
    let mut flights = flights(&stage);
    flights.retain(|it| it.state != PlanState::Nonconforming);
    flights.dedup_by_key(|it| (it.state, it.stops_served));
    let expected: Vec<Timestamp> = flights.iter().map(|it| instant(&it.expected_at)).collect();
    let stops = lands[lands.len() - 2..].iter().map(|at| instant(at));
    let stops: Vec<Timestamp> = stops.collect();
    let arrives = instant(&version.arrives_at);
    let close = |one: Timestamp, other: Timestamp| one.duration_since(other).abs().as_secs() < 1;
    for (expected, is) in expected
        .iter()
        .zip([stops[1], stops[1], stops[1], arrives, arrives])
    {
        assert!(close(*expected, is), "{expected} is not {is}");
    }
    let last = flights.last().expect("news");
    assert_eq!(last.landed_on.as_deref(), Some("s0"));
    assert_eq!((last.stops, last.drone_id.as_deref()), (2, Some("d")));
    let entries = news(&stage);
    let numbers: Vec<u64> = entries.iter().map(|entry| entry.number).collect();
    assert!(numbers.is_sorted_by(|one, next| one < next), "{numbers:?}");
    // It is served when it has been there for that long, or has left, and not when the clock says so.
    let there = version.legs.iter().find(|leg| leg.to.text() == "s2");
    let there = instant(&there.expect("a leg to the pickup").arrives_at);
    let served_at = instant(&entries[2].at).duration_since(there).as_secs();
    assert!((60..=70).contains(&served_at), "{served_at}");
}

#[tokio::test]
async fn a_zone_on_its_way_is_told_with_its_causes_and_stops_stay_counted() {
    let draft = town();
    let stage = on_with(&draft, following());
    let plan = stage.deliver(order()).await.expect("a plan");
    let pilot = Pilot::of(&stage, &draft);
    let seconds = SignedDuration::from_secs;
    let departs = instant(&plan.reported.departs_at);
    pilot.fly_until(&plan.reported, departs + seconds(30)).await;
    stage.zone(circle("crane", 1_500.0, 0.0, 50.0)).await;
    stage.settle().await;
    let entry = flights(&stage).pop().expect("news");
    let what = (entry.version, &*entry.outcome, entry.stops_served);
    assert_eq!(what, (2, "rerouted", 0));
    assert_eq!(entry.causes, ["crane"]);
    let second = pilot.acknowledge(2).await;
    let flight = second.flight.as_ref().expect("a flight");
    let pickup = flight.stops.iter().find(|stop| stop.service_s.is_some());
    let left = instant(&pickup.expect("a stop").takes_off_at);
    pilot.fly_until(&second, left + seconds(20)).await;
    assert_eq!(flights(&stage).pop().map(|it| it.stops_served), Some(1));

    // What comes after the first stop leaves it out, and the count stays.
    let (_, etag) = stage.edge.zone(&stage.caller, "crane").expect("a zone");
    let lifted = ZoneWrite {
        id: Some("crane".to_owned()),
        if_match: Some(etag),
        ..ZoneWrite::default()
    };
    let gone = stage.edge.delete_zone(&stage.caller, lifted, None).await;
    gone.expect("lifted");
    stage.zone(circle("parade", 1_500.0, 600.0, 50.0)).await;
    stage.settle().await;
    let third = stage.plan("p").wanted.expect("another way home");
    let third = pilot.acknowledge(third.version).await;
    assert_eq!(stage.plan("p").stops.len(), 1, "the drop alone");
    assert_eq!(flights(&stage).pop().map(|it| it.stops_served), Some(1));
    let end = instant(&third.arrives_at) + seconds(20);
    pilot.fly_until(&third, end).await;
    let last = flights(&stage).pop().expect("news");
    assert_eq!(
        (last.stops_served, last.ended_as),
        (2, Some(EndedAs::Delivered))
    );
}

#[tokio::test]
async fn who_asks_again_for_a_plan_that_there_is_is_told_so() {
    let stage = on_with(&town(), following());
    stage.deliver(order()).await.expect("a plan");
    stage.zone(circle("crane", 500.0, 0.0, 50.0)).await;
    // No other plan could be composed now.
    let mut other = order();
    other["id"] = json!("q");
    other["drone_id"] = json!("e");
    let refused = stage.deliver(other).await.expect_err("no way");
    assert_eq!(refused.code, Code::NoRoute);
    let refused = stage.deliver(order()).await.expect_err("it is there");
    assert_eq!(refused.code, Code::AlreadyExists);
}

#[tokio::test]
async fn its_drone_finds_the_plan_in_its_mailbox() {
    let stage = on_with(&town(), following());
    let mut mail = stage.edge.mail(&stage.caller, "d", None).expect("mail");
    stage.deliver(order()).await.expect("a plan");
    let messages = crate::mailboxes::messages(&mut mail);
    let kinds: Vec<MessageKind> = messages.iter().map(|it| it.kind).collect();
    assert_eq!(kinds, [MessageKind::Assigned, MessageKind::Contingencies]);
    let version = messages[0].version.as_ref().expect("the plan");
    assert_eq!((version.version, &*messages[0].plan_id), (1, "p"));
    assert!(version.flight.is_some());

    // It is told again until it says that it has it.
    let again = || {
        let mut mail = stage.edge.mail(&stage.caller, "d", None).expect("mail");
        let messages = crate::mailboxes::messages(&mut mail);
        messages.iter().map(|it| it.kind).collect::<Vec<_>>()
    };
    assert_eq!(again()[0], MessageKind::Assigned);
    stage.zone(circle("crane", 1_500.0, 0.0, 50.0)).await;
    stage.settle().await;
    let kinds = again();
    let first_two = [kinds[0], kinds[kinds.len() - 1]];
    assert!(kinds.contains(&MessageKind::Version), "{kinds:?}");
    assert_eq!(first_two[0], MessageKind::Assigned, "{kinds:?}");
    // Who flies another version of it knows it.
    let ack = wire::Ack {
        version: 2,
        ..wire::Ack::default()
    };
    let taken = stage.edge.acknowledge_plan(&stage.caller, "p", ack).await;
    taken.expect("taken over");
    stage.settle().await;
    assert!(!again().contains(&MessageKind::Assigned), "{:?}", again());
}

#[tokio::test]
async fn what_it_has_received_or_what_is_over_is_told_no_more() {
    for is_cancelled in [true, false] {
        let stage = on_with(&town(), following());
        stage.deliver(order()).await.expect("a plan");
        let mut mail = stage.edge.mail(&stage.caller, "d", None).expect("mail");
        let assigned = crate::mailboxes::messages(&mut mail).remove(0);
        if is_cancelled {
            let cancelled = wire::Cancellation::default();
            let over = stage.edge.cancel_plan(&stage.caller, "p", cancelled).await;
            over.expect("cancelled");
        } else {
            let through = assigned.id.to_string();
            let received = wire::Received { through };
            let taken = stage.edge.receive_mail(&stage.caller, "d", &received);
            taken.await.expect("received");
        }
        stage.settle().await;
        let mut mail = stage.edge.mail(&stage.caller, "d", None).expect("mail");
        let left = crate::mailboxes::messages(&mut mail);
        let is_it = |message: &wire::DroneMessage<'_>| message.kind == MessageKind::Assigned;
        assert!(!left.iter().any(is_it), "{left:?}");
    }
}

#[tokio::test]
async fn news_and_mail_survive_a_restart() {
    let disk = MemoryDisk::default();
    let stage = Stage::over_with(disk.open(), following()).await;
    let request = json!({
        "id": "p", "drone_id": "d", "delivery_id": "order-1", "source": "a0", "destination": "a0",
        "stops": [{"node": "a7", "service_s": 60.0}, {"node": "b7", "service_s": 30.0}],
    });
    stage.deliver(request).await.expect("a plan");
    stage.pass(SignedDuration::from_secs(2)).await;
    let before = news(&stage);
    assert_eq!(before.len(), 2, "accepted and activated");
    stage.edge.end().await;
    let settings = following();
    let stage = stage.again_with(disk.open(), settings).await;
    assert_eq!(
        news(&stage),
        before,
        "nothing is lost, and nothing told twice"
    );
    assert_eq!(stage.plan("p").delivery_id.as_deref(), Some("order-1"));
    let mut mail = stage.edge.mail(&stage.caller, "d", None).expect("mail");
    let messages = crate::mailboxes::messages(&mut mail);
    assert_eq!(messages[0].kind, MessageKind::Assigned);
    let cancelled = wire::Cancellation::default();
    let over = stage.edge.cancel_plan(&stage.caller, "p", cancelled).await;
    over.expect("cancelled");
    let after = news(&stage);
    assert_eq!(after.len(), 3);
    assert!(after[2].number > after[1].number);
    let last = after[2].flight.as_ref().expect("a flight");
    assert_eq!((last.ended_as, last.stops), (Some(EndedAs::Cancelled), 2));
}

#[tokio::test]
async fn failures_that_drones_report_are_news_and_what_ifs_are_not() {
    let report = |id: &str, dry_run: bool| {
        json!({
            "id": id, "type": "navigational", "service": {"from": "s1", "to": "s2"}, "destination": "s3",
            "location": {"x": 1_200.0, "y": 0.0}, "drone": {"id": "d", "battery_fraction": 0.8}, "dry_run": dry_run,
        })
    };
    let stage = on_with(&town(), following());
    stage.answer(report("if", true)).await;
    assert_eq!(news(&stage), []);
    let answer = stage.answer(report("r", false)).await;
    stage.answer(report("r", false)).await;
    let entries = news(&stage);
    assert_eq!(entries.len(), 1, "once, however often it is sent");
    let failure = entries[0].failure.as_ref().expect("a failure");
    assert_eq!(
        failure.recomposition_id,
        answer["id"].as_str().expect("an id")
    );
    assert_eq!(failure.failure_type, wire::FailureType::Navigational);
    assert_eq!(failure.segment.as_deref(), Some("s1-s2"));
    assert_eq!(failure.outcome, answer["outcome"].as_str().expect("one"));
    assert_eq!(failure.drone_id.as_deref(), Some("d"));

    let alone = on_with(&town(), settings());
    alone.answer(report("r", false)).await;
    alone.deliver(order()).await.expect("a plan");
    assert_eq!(news(&alone), [], "there is nobody to tell");
}

#[tokio::test]
async fn a_drone_does_not_say_for_which_delivery_it_flies() {
    let mut stage = on_with(&town(), following());
    stage.caller = Caller::local(Role::Drone, "d");
    let refusal = stage.deliver(order()).await.expect_err("refused");
    assert_eq!(refusal.code, Code::Forbidden);
    let mut own = order();
    own.as_object_mut().expect("a body").remove("delivery_id");
    stage.deliver(own).await.expect("a plan of its own");
    assert_eq!(news(&stage), [], "it is for no delivery");
}

/// A zone closes the only way out for a while, before the drone has left.
#[tokio::test]
async fn who_holds_is_told_to_hold_until_it_takes_off() {
    for is_acknowledged in [true, false] {
        holds(is_acknowledged).await;
    }
}

async fn holds(is_acknowledged: bool) {
    let stage = on_with(&town(), following());
    stage.deliver(order()).await.expect("a plan");
    let opens = stage.edge.clock().now() + SignedDuration::from_mins(10);
    let mut crane = circle("crane", 500.0, 0.0, 50.0);
    crane["properties"]["windows"] = json!([{"until": opens.to_string()}]);
    stage.zone(crane).await;
    stage.settle().await;
    if is_acknowledged {
        let ack = wire::Ack {
            version: 2,
            ..wire::Ack::default()
        };
        let taken = stage.edge.acknowledge_plan(&stage.caller, "p", ack).await;
        taken.expect("taken over");
    }
    let plan = stage.plan("p");
    let version = plan.wanted.unwrap_or(plan.reported);
    let last_told = || flights(&stage).pop().map(|it| (it.outcome, it.holds));
    let hold = version.flight.as_ref().and_then(|it| it.hold.as_ref());
    let until = instant(&hold.expect("it holds").until);
    assert!(until >= opens, "{until}");
    let second = SignedDuration::from_secs(1);
    let now = stage.edge.clock().now();
    stage.pass(until.duration_since(now) - second).await;
    assert_eq!(last_told(), Some(("hold".to_owned(), true)));
    stage.pass(second).await;
    assert_eq!(last_told(), Some(("hold".to_owned(), false)));
}
