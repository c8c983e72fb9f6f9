//! The stories of plans in docs/safe-answers.md, told over REST and over gRPC, which have to answer
//! the same.

use crate::situations::open;
use crate::town::{DIALECTS, Town};
use serde_json::{Value, json};
use skyway::wire::{EndedAs, Flag, Plan, PlanFlag, PlanState};

/// What was answered on the way, for comparison with the other dialect.
type Transcript = Vec<Value>;

/// The quarter of the page at ten, with a drone on its way from a to d along the lower row.
async fn begun(dialect: crate::town::Dialect) -> Town {
    let town = open(dialect, &[]).await;
    let request = json!({"id": "p", "drone_id": "d1", "source": "a", "destination": "d"});
    town.deliver(request).await.expect("a plan");
    town
}

/// It is so far on the lower row at a time.
async fn flies(town: &Town, time: &str, x: f64) {
    town.wait_until(time).await;
    let position = json!({"drone_id": "d1", "location": {"x": x, "y": 0.0}, "airborne": true});
    assert!(town.see(position).await.accepted);
}

fn note(transcript: &mut Transcript, plan: &Plan<'_>) {
    transcript.push(serde_json::to_value(plan).expect("JSON"));
}

fn nodes(version: &Option<skyway::wire::PlanVersion<'_>>) -> Vec<String> {
    let version = version.as_ref().expect("a version");
    version
        .path
        .nodes
        .iter()
        .map(|id| id.text().to_owned())
        .collect()
}

fn numbers(plan: &Plan<'_>) -> Vec<u32> {
    plan.versions.iter().map(|sent| sent.version).collect()
}

/// Both dialects have answered the same.
fn compare([rest, grpc]: [Transcript; 2]) {
    assert!(!rest.is_empty());
    for (step, (rest, grpc)) in rest.iter().zip(&grpc).enumerate() {
        assert_eq!(rest, grpc, "step {step}");
    }
    assert_eq!(rest.len(), grpc.len());
}

#[tokio::test]
async fn a_zone_on_its_first_stretch() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let town = begun(dialect).await;
        flies(&town, "10:01:27", 1_400.0).await;
        let report = json!({
            "type": "navigational", "service": {"plan_id": "p"}, "drone": {"id": "d1"},
            "location": {"x": 1400, "y": 0}, "cause_location": {"x": 1700, "y": 0}, "airborne": true,
        });
        town.report(report).await;
        let plan = town.plan("p").await;
        assert_eq!(nodes(&plan.wanted), ["b", "f", "g", "c", "d"]);
        note(told, &plan);
        let taken = town
            .acknowledge(
                "p",
                json!({"version": 2, "location": {"x": 1400.0, "y": 0.0}}),
            )
            .await
            .expect("it is true");
        assert_eq!((taken.reported.version, taken.flags.len()), (2, 0));
        flies(&town, "10:01:34", 1_300.0).await;
        town.close("behind", [1_150.0, 0.0], 40.0).await;
        let plan = town.plan("p").await;
        assert_eq!(plan.flags, [PlanFlag::Affected]);
        assert_eq!((plan.reported.version, plan.wanted.is_some()), (2, false));
        assert_eq!(plan.state, PlanState::Contingent);
        assert_eq!(town.alarmed("no_route").await, ["p"]);
        note(told, &plan);
    }
    compare(told);
}

#[tokio::test]
async fn an_acknowledgement_of_version_2_while_version_3_is_wanted() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let town = begun(dialect).await;
        flies(&town, "10:00:31", 500.0).await;
        town.close("first", [1_500.0, 0.0], 40.0).await;
        let second = town.plan("p").await;
        assert_eq!(nodes(&second.wanted), ["b", "f", "g", "c", "d"]);
        note(told, &second);
        town.close("second", [2_000.0, 300.0], 40.0).await;
        let third = town.plan("p").await;
        assert_eq!(numbers(&third), [1, 2, 3]);
        assert_eq!(nodes(&third.wanted), ["b", "f", "g", "h", "d"]);
        note(told, &third);
        let ack = json!({"version": 2, "location": {"x": 520.0, "y": 0.0}});
        let taken = town
            .acknowledge("p", ack.clone())
            .await
            .expect("it is true");
        assert_eq!(
            numbers(&taken),
            [2, 3, 4],
            "3 was sent, and may be flown yet"
        );
        assert_eq!((taken.reported.version, taken.reported.token), (2, 0));
        assert_eq!(nodes(&taken.wanted), ["b", "f", "g", "h", "d"]);
        let stretch = taken
            .wanted
            .as_ref()
            .and_then(|it| it.first_stretch.as_ref());
        assert_eq!(
            stretch.map(|it| it.length_m),
            Some(480.0),
            "from where it is"
        );
        note(told, &taken);
        let again = town.acknowledge("p", ack).await.expect("said again");
        assert_eq!(again.reported.version, 2);
        let unknown = town.acknowledge("p", json!({"version": 9})).await;
        assert_eq!(unknown.expect_err("never sent").0, "plan_state_conflict");
    }
    compare(told);
}

#[tokio::test]
async fn a_decline_and_two_more() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let town = begun(dialect).await;
        flies(&town, "10:00:31", 500.0).await;
        town.close("ahead", [2_500.0, 0.0], 40.0).await;
        assert_eq!(
            nodes(&town.plan("p").await.wanted),
            ["b", "f", "g", "h", "d"]
        );
        let decline = |version: u32| json!({"version": version, "reason": "obstacle"});
        let first = town.decline("p", decline(2)).await.expect("answered");
        assert_eq!(first.reported.version, 1);
        assert_eq!(nodes(&first.wanted), ["b", "c", "g", "h", "d"]);
        assert!(town.alarmed("declined").await.is_empty());
        note(told, &first);
        let again = town.decline("p", decline(2)).await.expect("said again");
        assert_eq!(again.wanted, first.wanted);
        let second = town.decline("p", decline(3)).await.expect("answered");
        assert_eq!(second.wanted.as_ref().map(|wanted| wanted.version), Some(4));
        // Not the way again that it declined first.
        assert_eq!(nodes(&second.wanted), ["a", "e", "f", "g", "h", "d"]);
        assert_eq!(town.alarmed("declined").await, ["p"]);
        note(told, &second);
        let third = town.decline("p", decline(4)).await.expect("answered");
        assert_eq!(third.wanted, None, "no version 5");
        assert_eq!(
            (third.reported.version, third.state),
            (1, PlanState::Contingent)
        );
        note(told, &third);
    }
    compare(told);
}

#[tokio::test]
async fn silence_after_a_new_version() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let town = begun(dialect).await;
        flies(&town, "10:00:31", 500.0).await;
        town.close("ahead", [2_500.0, 0.0], 40.0).await;
        let plan = town.plan("p").await;
        let wanted = plan.wanted.as_ref().expect("a version");
        assert_eq!(
            wanted.acknowledge_by.as_deref(),
            Some("2026-11-27T10:01:31Z")
        );
        town.wait_until("10:01:32").await;
        let silent = town.plan("p").await;
        assert_eq!(silent.flags, [PlanFlag::Affected, PlanFlag::Unacknowledged]);
        assert_eq!(numbers(&silent), [1, 2]);
        assert_eq!(town.alarmed("unacknowledged").await, ["p"]);
        note(told, &silent);
        // Version 1 is on b to c by now, version 2 on f to g.
        for (id, from, to) in [("q1", "c", "b"), ("q2", "g", "f")] {
            let other = json!({"id": id, "drone_id": id, "source": from, "destination": to});
            let other = town.deliver(other).await.expect("a plan");
            let is_met = other.conflicts.iter().all(|it| it.plan_id == "p");
            assert!(is_met && !other.conflicts.is_empty(), "{id}");
            note(told, &other);
        }
    }
    compare(told);
}

#[tokio::test]
async fn a_silent_drone_may_fly_its_contingencies() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let town = begun(dialect).await;
        flies(&town, "10:00:31", 500.0).await;
        town.close("ahead", [2_500.0, 0.0], 40.0).await;
        town.wait_until("10:01:30").await;
        // Neither version leads over c to g, the detour of both last legs of the first one does.
        let other = json!({"id": "q", "drone_id": "d2", "source": "g", "destination": "c"});
        let other = town.deliver(other).await.expect("a plan");
        assert!(other.conflicts.is_empty(), "{:?}", other.conflicts);
        town.wait_until("10:01:32").await;
        assert!(
            town.plan("p")
                .await
                .flags
                .contains(&PlanFlag::Unacknowledged)
        );
        let met = town.plan("q").await;
        let is_met = met.conflicts.iter().all(|it| it.plan_id == "p");
        assert!(is_met && !met.conflicts.is_empty(), "{:?}", met.conflicts);
        note(told, &met);
        let taken = town.acknowledge("p", json!({"version": 2})).await;
        assert!(taken.expect("taken over").flags.is_empty());
        assert!(town.plan("q").await.conflicts.is_empty());
    }
    compare(told);
}

#[tokio::test]
async fn a_version_has_the_flags_of_its_answer() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let town = begun(dialect).await;
        flies(&town, "10:01:33", 1_500.0).await;
        town.close("around", [1_480.0, 0.0], 90.0).await;
        let plan = town.plan("p").await;
        let wanted = plan.wanted.as_ref().expect("a way out");
        assert_eq!(wanted.flags, [Flag::LeavingZone]);
        assert!(plan.reported.flags.is_empty());
        note(told, &plan);
        let taken = town.acknowledge("p", json!({"version": 2})).await;
        assert_eq!(
            taken.expect("taken over").reported.flags,
            [Flag::LeavingZone]
        );
    }
    compare(told);
}

#[tokio::test]
async fn a_plan_without_a_sign_is_overdue_and_then_lost() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let town = begun(dialect).await;
        // It was to arrive at 10:03:07.5.
        town.wait_until("10:04:07").await;
        assert!(town.plan("p").await.flags.is_empty());
        for time in ["10:04:08", "11:03:07"] {
            town.wait_until(time).await;
            let overdue = town.plan("p").await;
            assert_eq!(overdue.flags, [PlanFlag::Overdue], "{time}");
            assert_eq!(overdue.state, PlanState::Activated);
            note(told, &overdue);
        }
        town.wait_until("11:03:08").await;
        let lost = town.plan("p").await;
        assert_eq!(
            (lost.state, lost.ended_as),
            (PlanState::Ended, Some(EndedAs::Lost))
        );
        assert_eq!(town.alarmed("lost").await, ["p"]);
        note(told, &lost);
        let found = town.complete("p", json!({})).await.expect("it is found");
        assert_eq!(found.ended_as, Some(EndedAs::Delivered));
        note(told, &found);
    }
    compare(told);
}

#[tokio::test]
async fn a_drone_that_has_landed_completes_its_plan() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        for (place, expected) in [
            (json!({"location": {"node": "d"}}), EndedAs::Delivered),
            (
                json!({"location": {"x": 2_000.0, "y": 0.0}}),
                EndedAs::Diverted,
            ),
            (json!({}), EndedAs::Delivered),
            // A place that is none says nothing of where it has landed.
            (
                json!({"location": {"x": 250_000.0, "y": 0.0}}),
                EndedAs::Delivered,
            ),
        ] {
            let town = begun(dialect).await;
            flies(&town, "10:02:05", 2_000.0).await;
            town.wait_until("10:03:07").await;
            let ended = town.complete("p", place.clone()).await.expect("ended");
            assert_eq!(ended.ended_as, Some(expected), "{place}");
            assert!(ended.versions.is_empty());
            note(told, &ended);
            let again = town.complete("p", place).await.expect("said again");
            assert_eq!(again, ended);
        }
    }
    compare(told);
}

#[tokio::test]
async fn an_operator_releases_a_plan() {
    let mut told = [Vec::new(), Vec::new()];
    for (dialect, told) in DIALECTS.into_iter().zip(&mut told) {
        let town = begun(dialect).await;
        town.wait_until("10:30").await;
        let released = town.release("p", "diverted").await.expect("released");
        assert_eq!(released.ended_as, Some(EndedAs::Diverted));
        note(told, &released);
        let again = town.release("p", "diverted").await.expect("said again");
        assert_eq!(again, released);
        let otherwise = town.release("p", "delivered").await;
        assert_eq!(otherwise.expect_err("it is over").0, "plan_state_conflict");
        let request = json!({"drone_id": "d1", "source": "d", "destination": "a"});
        town.deliver(request).await.expect("its drone is free");
    }
    compare(told);
}
