//! A plan that names no drone is a quote: it takes nothing, and ends by itself.

use crate::situations::open;
use crate::town::{DIALECTS, Town};
use serde_json::json;
use skyway::wire::{EndedAs, PlanFlag, PlanState};

#[tokio::test]
async fn a_quote_takes_no_air_and_ends_when_it_expires() {
    let mut told = Vec::new();
    for dialect in DIALECTS {
        let town = open(dialect, &[]).await;
        let quote = json!({"id": "q", "source": "a", "destination": "d"});
        let quote = town.ask_for(quote).await.expect("a quote");
        assert_eq!(
            (quote.drone_id.as_deref(), quote.state),
            (None, PlanState::Accepted)
        );
        assert_eq!(quote.expires_at.as_deref(), Some("2026-11-27T10:05:00Z"));
        assert_eq!(quote.reported.legs.len(), 3);
        // Head on at the same time.
        let plan = json!({"id": "p", "source": "d", "destination": "a"});
        let plan = town.deliver(plan).await.expect("a plan");
        assert!(plan.conflicts.is_empty(), "{:?}", plan.conflicts);
        assert_eq!(plan.expires_at, None);
        // What is offered knows of what is flown.
        let met = town.plan("q").await.conflicts;
        assert!(met.iter().all(|conflict| conflict.plan_id == "p") && !met.is_empty());
        town.wait_until("10:05").await;
        assert_eq!(town.plan("q").await.ended_as, None);
        town.wait_until("10:05:01").await;
        let over = town.plan("q").await;
        assert_eq!(
            (over.state, over.ended_as),
            (PlanState::Ended, Some(EndedAs::Cancelled))
        );
        told.push((quote, over));
    }
    assert_eq!(told[0], told[1]);
}

#[tokio::test]
async fn a_quote_takes_no_pad() {
    for dialect in DIALECTS {
        let town = Town::open(dialect, "10:00").await;
        let low = |id: &str| json!({"id": id, "source": "a", "destination": "d", "battery_fraction": 0.4});
        let first = town.ask_for(low("q")).await.expect("a quote");
        let second = town.deliver(low("p")).await.expect("a plan");
        let stops = |plan: &skyway::wire::Plan<'_>| {
            let flight = plan.reported.flight.clone().expect("a flight");
            let stops = flight.stops.into_iter();
            let stops = stops.map(|stop| {
                (
                    stop.node.text().to_owned(),
                    stop.pad,
                    stop.lands_at.into_owned(),
                )
            });
            stops.collect::<Vec<_>>()
        };
        assert!(!stops(&first).is_empty());
        assert_eq!(stops(&first), stops(&second), "nothing is in its way");
    }
}

#[tokio::test]
async fn nothing_is_said_of_a_quote_and_it_is_led_around_nothing() {
    for dialect in DIALECTS {
        let town = open(dialect, &[]).await;
        let quote = json!({"id": "q", "source": "a", "destination": "d"});
        town.ask_for(quote).await.expect("a quote");
        for said in [
            town.acknowledge("q", json!({"version": 1})).await,
            town.decline("q", json!({"version": 1})).await,
            town.complete("q", json!({})).await,
        ] {
            assert_eq!(
                said.expect_err("no drone flies it").0,
                "plan_state_conflict"
            );
        }
        town.close("ahead", [1_500.0, 0.0], 40.0).await;
        let shut = town.plan("q").await;
        assert_eq!((shut.wanted, shut.versions.len()), (None, 1));
        assert_eq!(
            shut.flags,
            [PlanFlag::Affected],
            "it would be flown into the zone"
        );
        assert_eq!(shut.affected_by, ["ahead"]);
        assert!(town.alarmed("no_route").await.is_empty());
    }
}
