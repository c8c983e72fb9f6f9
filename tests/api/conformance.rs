//! Conformance by telemetry alone, told over REST and over gRPC, which have to answer the same.

use crate::town::{DIALECTS, Dialect, Town, at};
use jiff::{SignedDuration, Timestamp};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde_json::{Value, json};
use skyway::edge::{Caller, EventRecord, FlightSettings, Mail, Refusal};
use skyway::flight::Airframe;
use skyway::geo::{Altitude, AltitudeReference};
use skyway::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};
use skyway::wire::{AlarmKind, EndedAs, EventKind, MessageKind, Plan, PlanFlag, PlanState};
use std::sync::Arc;
use std::task::{Context, Poll, Waker};
use tokio_stream::Stream;

/// A street of four rooftops 1.5 km apart, 40 m above ground and one of 70 m, each with two pads; and one beside it.
///
/// ```text
///        e
///      /   \
/// a - b --- c - d
/// ```
fn street() -> NetworkDraft {
    let node = |id: &str, x: f64, y: f64, height_m: f64| NodeDraft {
        id: id.to_owned(),
        position: [x, y],
        altitude: Some(Altitude {
            value_m: height_m,
            reference: AltitudeReference::Agl,
        }),
        pads: 2,
        ..NodeDraft::default()
    };
    let joined = [("a", "b"), ("b", "c"), ("c", "d"), ("b", "e"), ("e", "c")];
    NetworkDraft {
        nodes: vec![
            node("a", 0.0, 0.0, 40.0),
            node("b", 1_500.0, 0.0, 40.0),
            node("c", 3_000.0, 0.0, 70.0),
            node("d", 4_500.0, 0.0, 40.0),
            node("e", 2_250.0, 1_000.0, 40.0),
        ],
        segments: joined
            .map(|(from, to)| SegmentDraft {
                from: from.to_owned(),
                to: to.to_owned(),
                ..SegmentDraft::default()
            })
            .into(),
        coordinates: Coordinates::Planar,
        name: "street".to_owned(),
        ..NetworkDraft::default()
    }
}

/// The street at ten, with a drone on its way from a to d.
async fn begun(dialect: Dialect) -> (Town, Plan<'static>) {
    let flight = FlightSettings::of(Airframe::phantom3());
    let town = Town::listening(&street(), dialect, "10:00", Some(flight)).await;
    let asked =
        json!({"id": "p", "drone_id": "d1", "source": "a", "destination": "d", "payload_kg": 0.1});
    let plan = town.deliver(asked).await.expect("a plan");
    (town, plan)
}

/// Where a plan has its drone at an instant: `[x, y, height]`, on a pad or in flight.
fn planned(plan: &Plan<'_>, now: Timestamp) -> [f64; 3] {
    let time = |text: &str| text.parse::<Timestamp>().expect("an instant");
    let legs = &plan.reported.legs;
    for leg in legs {
        let (from, until) = (time(&leg.departs_at), time(&leg.arrives_at));
        let corners: Vec<[f64; 3]> = leg
            .geometry
            .iter()
            .map(|it| [it.x, it.y, it.height_m.expect("a height")])
            .collect();
        if now <= from {
            return corners[0];
        }
        if now >= until {
            continue;
        }
        let share =
            now.duration_since(from).as_secs_f64() / until.duration_since(from).as_secs_f64();
        let [first, last] = [corners[0], corners[corners.len() - 1]];
        return std::array::from_fn(|axis| first[axis] + share * (last[axis] - first[axis]));
    }
    let last = legs
        .last()
        .and_then(|leg| leg.geometry.last())
        .expect("a leg");
    [last.x, last.y, last.height_m.expect("a height")]
}

fn entry([x, y, height_m]: [f64; 3]) -> Value {
    json!({"drone_id": "d1", "location": {"x": x, "y": y}, "altitude_m": height_m, "altitude_reference": "agl",
        "airborne": true})
}

/// The drone flies as planned from one time to another, telling where it is every second, but for what is changed of that.
async fn flies(
    town: &Town,
    plan: &Plan<'_>,
    (from, until): (&str, &str),
    change: impl Fn([f64; 3]) -> [f64; 3],
) {
    let mut now = at(from);
    while now <= at(until) {
        town.hand.set(now);
        town.see(entry(change(planned(plan, now)))).await;
        now += SignedDuration::from_secs(1);
    }
}

fn as_planned(place: [f64; 3]) -> [f64; 3] {
    place
}

/// All that is there of a stream.
fn there<T>(stream: impl Stream<Item = T>) -> Vec<T> {
    let mut stream = std::pin::pin!(stream);
    let mut context = Context::from_waker(Waker::noop());
    std::iter::from_fn(|| match stream.as_mut().poll_next(&mut context) {
        Poll::Ready(next) => next,
        Poll::Pending => None,
    })
    .collect()
}

fn events(town: &Town) -> Vec<EventKind> {
    let all = town.api.edge.events(Some("7-0")).expect("events");
    let kind = |event: Result<Arc<EventRecord>, Refusal>| event.expect("none is gone").kind;
    there(all).into_iter().map(kind).collect()
}

fn mail(town: &Town) -> Vec<MessageKind> {
    let mail = town.api.edge.mail(&Caller::anyone(), "d1", None);
    let kind = |mail| match mail {
        Mail::Message(message) => message.kind,
        Mail::Ended(ended) => panic!("{ended:?}"),
    };
    there(mail.expect("mail")).into_iter().map(kind).collect()
}

/// Both dialects have answered the same.
fn compare(told: &[Vec<Value>]) {
    assert_eq!(told[0], told[1]);
    assert!(!told[0].is_empty());
}

fn note(told: &mut Vec<Value>, plan: &Plan<'_>) {
    // A version is sent when a worker has found it, which may be a second of this clock later.
    let versions = plan.versions.iter();
    let versions = versions.map(|sent| json!({"version": sent.version, "outcome": sent.outcome}));
    let versions: Vec<Value> = versions.collect();
    told.push(json!({"state": plan.state, "flags": plan.flags, "versions": versions}));
}

#[tokio::test]
async fn a_drone_forty_metres_beside_its_leg_does_not_conform_and_is_told_a_way_from_there() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let (town, plan) = begun(dialect).await;
        flies(&town, &plan, ("10:00:05", "10:01:00"), as_planned).await;
        assert_eq!(town.plan("p").await.state, PlanState::Activated);
        let beside = |[x, y, height_m]: [f64; 3]| [x, y + 40.0, height_m];
        flies(&town, &plan, ("10:01:01", "10:01:02"), beside).await;
        assert_eq!(
            town.plan("p").await.state,
            PlanState::Activated,
            "two of five"
        );
        flies(&town, &plan, ("10:01:03", "10:01:04"), beside).await;
        let off = town.plan("p").await;
        assert_eq!(off.state, PlanState::Nonconforming);
        let wanted = off.wanted.as_ref().expect("a way from where it is");
        let stretch = wanted.first_stretch.as_ref().expect("it is beside the leg");
        // So near to its leg it counts as on it.
        let begins_m = planned(&plan, at("10:01:03"))[0];
        assert!(
            (stretch.geometry[0].x - begins_m).abs() < 1.0,
            "{stretch:?}"
        );
        note(told, &off);

        // From where it is then, but not with every position.
        flies(&town, &plan, ("10:01:05", "10:01:12"), beside).await;
        let versions = town.plan("p").await.versions.len();
        flies(&town, &plan, ("10:01:13", "10:01:15"), beside).await;
        assert_eq!(town.plan("p").await.versions.len(), versions + 1);
        flies(&town, &plan, ("10:01:16", "10:01:18"), as_planned).await;
        let back = town.plan("p").await;
        assert_eq!(back.state, PlanState::Activated);
        note(told, &back);
        let kinds = events(&town);
        assert!(kinds.contains(&EventKind::PlanNonconforming), "{kinds:?}");
        assert!(kinds.contains(&EventKind::PlanConforming), "{kinds:?}");
    }
    compare(&told);
}

#[tokio::test]
async fn a_drone_fifteen_metres_below_its_leg_does_not_conform() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let (town, plan) = begun(dialect).await;
        let below = |[x, y, height_m]: [f64; 3]| [x, y, height_m - 15.0];
        let near = |[x, y, height_m]: [f64; 3]| [x, y, height_m - 8.0];
        flies(&town, &plan, ("10:00:30", "10:00:50"), near).await;
        assert_eq!(town.plan("p").await.state, PlanState::Activated);
        flies(&town, &plan, ("10:00:51", "10:00:56"), below).await;
        let low = town.plan("p").await;
        assert_eq!(low.state, PlanState::Nonconforming);
        note(told, &low);
    }
    compare(&told);
}

#[tokio::test]
async fn without_a_reference_the_height_is_unknown() {
    let (town, plan) = begun(Dialect::Rest).await;
    for second in 51..57 {
        let now = at(&format!("10:00:{second}"));
        town.hand.set(now);
        let [x, y, _] = planned(&plan, now);
        town.see(json!({"drone_id": "d1", "location": {"x": x, "y": y}, "altitude_m": 3.0}))
            .await;
    }
    assert_eq!(town.plan("p").await.state, PlanState::Activated);
}

#[tokio::test]
async fn a_drone_that_falls_silent_is_asked_and_an_operator_is_alarmed() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let (town, plan) = begun(dialect).await;
        flies(&town, &plan, ("10:00:05", "10:01:00"), as_planned).await;
        town.wait_until("10:01:14").await;
        assert_eq!(town.plan("p").await.state, PlanState::Activated);
        town.wait_until("10:01:15").await;
        let silent = town.plan("p").await;
        assert_eq!(silent.state, PlanState::Contingent);
        assert_eq!(silent.flags, [PlanFlag::Silent]);
        assert_eq!(town.alarmed(AlarmKind::Contingent.name()).await, ["p"]);
        assert!(mail(&town).contains(&MessageKind::WhereAreYou));
        note(told, &silent);

        flies(&town, &plan, ("10:01:20", "10:01:21"), as_planned).await;
        let heard = town.plan("p").await;
        assert_eq!(
            (heard.state, &heard.flags[..]),
            (PlanState::Activated, &[][..])
        );
        assert!(town.alarmed(AlarmKind::Contingent.name()).await.is_empty());
        assert!(!mail(&town).contains(&MessageKind::WhereAreYou));
        // Silent once more.
        town.wait_until("10:01:37").await;
        assert_eq!(town.plan("p").await.state, PlanState::Contingent);
        note(told, &heard);
    }
    compare(&told);
}

/// The street at ten, with a drone on its way from a to d and back.
async fn there_and_back(dialect: Dialect) -> (Town, Plan<'static>) {
    let flight = FlightSettings::of(Airframe::phantom3());
    let town = Town::listening(&street(), dialect, "10:00", Some(flight)).await;
    let asked = json!({"id": "p", "drone_id": "d1", "source": "a", "destination": "a", "payload_kg": 0.1,
        "stops": [{"node": "d", "service_s": 30}]});
    let plan = town.deliver(asked).await.expect("a plan");
    (town, plan)
}

#[tokio::test]
async fn a_drone_that_comes_back_the_way_it_went_conforms() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let (town, plan) = there_and_back(dialect).await;
        let arrives_at: Timestamp = plan.reported.arrives_at.parse().expect("an instant");
        let mut now = at("10:00:05");
        while now < arrives_at {
            town.hand.set(now);
            let [x, y, height_m] = planned(&plan, now);
            let errs_m = f64::from(now.as_second() as i32 % 3 - 1) * 3.0;
            town.see(entry([x + errs_m, y + errs_m, height_m])).await;
            let state = town.plan("p").await.state;
            assert_eq!(state, PlanState::Activated, "at {now}");
            now += SignedDuration::from_secs(1);
        }
        note(told, &town.plan("p").await);
    }
    compare(&told);
}

#[tokio::test]
async fn a_drone_that_hovers_over_its_home_instead_of_leaving_is_late() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let (town, plan) = there_and_back(dialect).await;
        let home = planned(&plan, at("10:00"));
        flies(&town, &plan, ("10:00:05", "10:01:00"), |_| home).await;
        let plan = town.plan("p").await;
        assert_eq!(plan.state, PlanState::Nonconforming);
        note(told, &plan);
    }
    compare(&told);
}

#[tokio::test]
async fn a_drone_that_sends_no_telemetry_is_not_silent() {
    let (town, _) = begun(Dialect::Rest).await;
    town.wait_until("10:03").await;
    assert_eq!(town.plan("p").await.state, PlanState::Activated);
}

#[tokio::test]
async fn a_drone_that_lands_early_does_not_conform() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let (town, plan) = begun(dialect).await;
        flies(&town, &plan, ("10:00:05", "10:01:00"), as_planned).await;
        let [x, y, _] = planned(&plan, at("10:01:00"));
        for second in 1..=5 {
            town.hand.set(at(&format!("10:01:0{second}")));
            let mut landed = entry([x, y, 0.0]);
            landed["airborne"] = json!(false);
            town.see(landed).await;
        }
        let plan = town.plan("p").await;
        assert_eq!(
            (plan.state, plan.ended_as),
            (PlanState::Nonconforming, None)
        );
        note(told, &plan);
    }
    compare(&told);
}

#[tokio::test]
async fn a_drone_that_hovers_over_its_destination_is_late_and_then_overdue() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let (town, plan) = begun(dialect).await;
        let arrives_at: Timestamp = plan.reported.arrives_at.parse().expect("an instant");
        let over_it = |[x, y, height_m]: [f64; 3]| [x, y, height_m + 6.0];
        let from = arrives_at - SignedDuration::from_secs(5);
        let mut states = Vec::new();
        for second in 0..70 {
            let now = from + SignedDuration::from_secs(second);
            town.hand.set(now);
            town.see(entry(over_it(planned(&plan, now)))).await;
            let plan = town.plan("p").await;
            if states.last() != Some(&plan.state) {
                states.push(plan.state);
            }
            assert_eq!(plan.ended_as, None, "it has not landed");
        }
        assert_eq!(states, [PlanState::Activated, PlanState::Nonconforming]);
        let over = town.plan("p").await;
        assert!(over.flags.contains(&PlanFlag::Overdue), "{:?}", over.flags);
        note(told, &over);
    }
    compare(&told);
}

/// Normally distributed numbers (Box and Muller).
struct Noise(ChaCha8Rng);

impl Noise {
    fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn next(&mut self, sigma: f64) -> f64 {
        let [one, other] = [1.0 - self.uniform(), self.uniform()];
        sigma * (-2.0 * one.ln()).sqrt() * (std::f64::consts::TAU * other).cos()
    }
}

#[tokio::test]
async fn a_receiver_that_errs_makes_nobody_nonconforming_in_an_hour() {
    let (town, _) = begun(Dialect::Rest).await;
    let mut noise = Noise(ChaCha8Rng::seed_from_u64(1));
    let mut number = 0;
    let mut now = at("10:10");
    let end = at("11:10");
    while now < end {
        number += 1;
        let (id, drone) = (format!("n{number}"), format!("noisy{number}"));
        town.hand.set(now);
        let asked = json!({"id": id, "drone_id": drone, "source": "a", "destination": "d", "payload_kg": 0.1});
        let plan = town.deliver(asked).await.expect("a plan");
        let arrives_at: Timestamp = plan.reported.arrives_at.parse().expect("an instant");
        while now < arrives_at {
            town.hand.set(now);
            let place = planned(&plan, now);
            let mut noisy = entry([
                place[0] + noise.next(5.0),
                place[1] + noise.next(5.0),
                place[2] + noise.next(3.0),
            ]);
            noisy["drone_id"] = json!(drone);
            town.see(noisy).await;
            let state = town.plan(&id).await.state;
            assert_eq!(state, PlanState::Activated, "{id} at {now}, {place:?}");
            now += SignedDuration::from_secs(1);
        }
        town.hand.set(now);
        let done = town
            .api
            .post(&format!("/v1/plans/{id}/complete"), &json!({}))
            .await;
        let done: Plan<'_> = serde_json::from_str(&done.is(200).body).expect("a plan");
        assert_eq!(done.ended_as, Some(EndedAs::Delivered));
    }
    assert!(number > 5, "{number} flights");
}
