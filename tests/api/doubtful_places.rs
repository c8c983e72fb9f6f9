//! Telemetry with a place that is none: it moves nothing, its drone has its orders all the same,
//! and three in a row that agree are believed.

use crate::situations::open;
use crate::town::{DIALECTS, Dialect, Town};
use serde_json::{Value, json};
use skyway::wire::Position;

/// A drone 500 m on its way from a to d, which is asked to fly around a zone.
async fn warned(dialect: Dialect) -> Town {
    let town = open(dialect, &[]).await;
    let request = json!({"id": "p", "drone_id": "d1", "source": "a", "destination": "d"});
    town.deliver(request).await.expect("a plan");
    assert!(told(&town, "10:00:31", 500.0, 0.0).await.accepted);
    town.close("ahead", [1_500.0, 0.0], 40.0).await;
    town
}

async fn told(town: &Town, time: &str, x: f64, y: f64) -> Position<'static> {
    town.wait_until(time).await;
    let place = json!({"x": x, "y": y});
    town.see(json!({"drone_id": "d1", "location": place, "airborne": true}))
        .await
}

fn codes(position: &Position<'_>) -> Vec<String> {
    let warnings = position.warnings.iter();
    warnings.map(|warning| warning.code.to_string()).collect()
}

/// It is refused for this, and has its orders.
#[track_caller]
fn is_refused(position: &Position<'_>, code: &str) {
    assert!(!position.accepted, "{position:?}");
    assert_eq!(codes(position), [code]);
    let wanted = position.wanted.as_ref().map(|wanted| wanted.version);
    assert_eq!((position.affected, wanted), (true, Some(2)));
    assert_eq!(position.plan_id.as_deref(), Some("p"));
}

async fn place_of(town: &Town, drone: usize) -> Value {
    let drones = town.api.get("/v1/drones").await.is(200).json();
    drones["drones"][drone]["location"].clone()
}

#[tokio::test]
async fn a_place_that_is_none_moves_nothing_and_is_answered_with_orders() {
    for dialect in DIALECTS {
        let town = warned(dialect).await;
        // In a second a drone comes 40 m far, and 200 m are for errors.
        is_refused(
            &told(&town, "10:00:32", 250_000.0, 250_000.0).await,
            "location_doubtful",
        );
        is_refused(
            &told(&town, "10:00:33", 781.0, 0.0).await,
            "location_doubtful",
        );
        assert_eq!(place_of(&town, 0).await, json!([500.0, 0.0]));
        assert!(told(&town, "10:00:34", 819.0, 0.0).await.accepted);
        let late = json!({"drone_id": "d1", "location": {"x": 500.0, "y": 0.0}, "timestamp": "2026-11-27T10:00:30Z"});
        is_refused(&town.see(late).await, "position_outdated");
        let plan = town.plan("p").await;
        assert_eq!(plan.wanted.map(|wanted| wanted.version), Some(2));
    }
}

#[tokio::test]
async fn three_places_in_a_row_that_agree_are_believed() {
    for dialect in DIALECTS {
        let town = warned(dialect).await;
        for (time, x, accepted) in [
            ("10:00:32", 2_500.0, false),
            ("10:00:33", 2_510.0, false),
            // A true one between them begins anew.
            ("10:00:34", 540.0, true),
            ("10:00:35", 2_500.0, false),
            // One that does not agree, too.
            ("10:00:36", 1_500.0, false),
            ("10:00:37", 1_520.0, false),
            ("10:00:37", 1_520.0, false),
            ("10:00:38", 1_540.0, true),
            ("10:00:39", 1_560.0, true),
        ] {
            let position = told(&town, time, x, 0.0).await;
            assert_eq!(position.accepted, accepted, "{time} {x} {dialect:?}");
        }
        assert_eq!(place_of(&town, 0).await, json!([1_560.0, 0.0]));
    }
}

#[tokio::test]
async fn a_first_place_is_judged_by_the_leg_and_the_network() {
    for dialect in DIALECTS {
        let town = open(dialect, &[]).await;
        let request = json!({"id": "p", "drone_id": "d1", "source": "a", "destination": "d"});
        town.deliver(request).await.expect("a plan");
        let far = told(&town, "10:00:10", -2_200.0, 0.0).await;
        assert_eq!(
            (far.accepted, codes(&far)),
            (false, vec!["location_doubtful".to_owned()])
        );
        // Beyond the widened box, but within 2 km of its leg.
        assert!(told(&town, "10:00:11", -1_900.0, 0.0).await.accepted);
        let stranger = json!({"drone_id": "d2", "location": {"x": 0.0, "y": 9_000.0}});
        assert!(!town.see(stranger).await.accepted);
    }
}

/// A place beyond the network that is believed at last makes no way of 350 km.
#[tokio::test]
async fn a_believed_place_beyond_the_network_begins_no_way() {
    for dialect in DIALECTS {
        let town = warned(dialect).await;
        for (time, accepted) in [("10:00:32", false), ("10:00:33", false), ("10:00:34", true)] {
            let position = told(&town, time, 250_000.0, 250_000.0).await;
            assert_eq!(position.accepted, accepted, "{time}");
        }
        town.close("next", [2_000.0, 300.0], 40.0).await;
        let wanted = town.plan("p").await.wanted.expect("a version");
        let stretch = wanted.first_stretch.map_or(0.0, |stretch| stretch.length_m);
        assert!(stretch <= 1_000.0, "{stretch}");
    }
}

#[tokio::test]
async fn an_acknowledgement_from_no_place_is_true_and_moves_nothing() {
    for dialect in DIALECTS {
        let town = warned(dialect).await;
        town.wait_until("10:00:32").await;
        let ack = json!({"version": 2, "location": {"x": 250_000.0, "y": 0.0}});
        let taken = town.acknowledge("p", ack).await.expect("it is true");
        assert_eq!(taken.reported.version, 2);
        assert_eq!(place_of(&town, 0).await, json!([500.0, 0.0]));
    }
}

/// What cannot be read is refused as well, and its drone is known all the same.
#[tokio::test]
async fn a_position_that_cannot_be_read_is_answered_with_orders() {
    let town = warned(Dialect::Rest).await;
    let told = town
        .see(json!({"drone_id": "d1", "location": "nowhere"}))
        .await;
    is_refused(&told, "position_unreadable");
}
