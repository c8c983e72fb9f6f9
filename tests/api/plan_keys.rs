//! What is said of a plan under an idempotency key is done once; and a plan that is cancelled in
//! flight tells where.

use crate::situations::open;
use crate::town::{DIALECTS, Dialect, Town};
use serde_json::json;
use skyway::wire::EndedAs;

/// A drone 500 m on its way from a to d, which is asked to fly around a zone, and another one that
/// comes its way.
async fn warned(dialect: Dialect) -> Town {
    let town = open(dialect, &[]).await;
    let request = json!({"id": "p", "drone_id": "d1", "source": "a", "destination": "d"});
    town.deliver(request).await.expect("a plan");
    town.wait_until("10:00:31").await;
    let place = json!({"drone_id": "d1", "location": {"x": 500.0, "y": 0.0}, "airborne": true});
    assert!(town.see(place).await.accepted);
    town.close("ahead", [2_500.0, 0.0], 40.0).await;
    let request = json!({"id": "other", "drone_id": "d2", "source": "c", "destination": "b"});
    let other = town.deliver(request).await.expect("a plan");
    assert_eq!(other.conflicts.len(), 1, "{:?}", other.conflicts);
    town
}

#[tokio::test]
async fn what_is_said_again_under_a_key_is_answered_the_same() {
    for dialect in DIALECTS {
        let town = warned(dialect).await;
        let decline = json!({"version": 2, "reason": "obstacle", "idempotency_key": "k1"});
        let declined = town.decline("p", decline.clone()).await.expect("answered");
        assert_eq!(declined.wanted.as_ref().map(|it| it.version), Some(3));
        let ack = json!({"version": 3, "idempotency_key": "k1"});
        let taken = town
            .acknowledge("p", ack.clone())
            .await
            .expect("taken over");
        assert_eq!(
            taken.reported.version, 3,
            "a key counts for what is done with it"
        );
        // As it was answered then, whatever has come since.
        assert_eq!(town.decline("p", decline).await, Ok(declined));
        let landed = json!({"location": {"x": 500.0, "y": 0.0}, "idempotency_key": "k2"});
        let ended = town.complete("p", landed.clone()).await.expect("ended");
        assert_eq!(ended.ended_as, Some(EndedAs::Diverted));
        assert_eq!(town.acknowledge("p", ack).await, Ok(taken));
        assert_eq!(town.complete("p", landed).await, Ok(ended));
        let another = json!({"idempotency_key": "k2"});
        let refused = town.complete("p", another).await.expect_err("another body");
        assert_eq!(refused.0, "idempotency_mismatch");
        // Of another plan it is another word.
        let other = json!({"idempotency_key": "k2"});
        town.complete("other", other).await.expect("ended");
    }
}

#[tokio::test]
async fn a_plan_that_is_cancelled_in_flight_keeps_its_air_unless_its_place_is_told() {
    for dialect in DIALECTS {
        for (place, is_free) in [
            (json!({}), false),
            (json!({"x": 1_300.0, "y": 0.0}), true),
            (json!({"leg": 1, "fraction": 0.3}), true),
            // A place at which it cannot be is none.
            (json!({"x": 250_000.0, "y": 0.0}), false),
        ] {
            let town = warned(dialect).await;
            // It was seen too long ago.
            town.wait_until("10:01:21").await;
            let ended = town.cancel("p", place.clone()).await.expect("cancelled");
            assert_eq!(ended.ended_as, Some(EndedAs::Cancelled));
            let conflicts = town.plan("other").await.conflicts;
            assert_eq!(conflicts.is_empty(), is_free, "{place} {conflicts:?}");
            let again = town.cancel("p", place).await.expect("said again");
            assert_eq!(again.ended_as, Some(EndedAs::Cancelled));
        }
        // Seen just now is told.
        let town = warned(dialect).await;
        town.cancel("p", json!({})).await.expect("cancelled");
        assert!(town.plan("other").await.conflicts.is_empty());
    }
}

#[tokio::test]
async fn a_place_of_a_cancelled_plan_is_read_strictly() {
    let town = warned(Dialect::Rest).await;
    for query in ["x=1", "lon=1&lat=1&node=a", "fraction=2", "colour=red"] {
        let told = town
            .api
            .ask(&format!("DELETE /v1/plans/p?{query}"), &[], "")
            .await;
        assert_eq!(
            (told.status, told.code().as_str()),
            (400, "parameter_invalid"),
            "{query}"
        );
    }
}
