//! Drones that are really flown: what they are told beside their path, and drones that have to land.

use crate::flights::{flying, nodes, report};
use crate::town::DIALECTS;
use serde_json::json;
use skyway::wire::{self, Outcome};

#[tokio::test]
async fn legs_say_where_how_high_and_how_fast_they_are_flown() {
    for dialect in DIALECTS {
        let town = flying(dialect).await;
        let plan = town.plan("p").await;
        let legs = &plan.reported.legs;
        let place = |corner: &wire::Waypoint| (corner.x, corner.y);
        let corners = legs.iter().map(|leg| {
            let (first, last) = (leg.geometry.first(), leg.geometry.last());
            [first, last].map(|corner| place(corner.expect("a corner")))
        });
        let along = [(0.0, 0.0), (1_500.0, 0.0), (3_000.0, 0.0), (4_500.0, 0.0)];
        let expected = along.windows(2).map(|ends| [ends[0], ends[1]]);
        assert!(corners.eq(expected), "{legs:?}");
        for leg in legs {
            let flight = leg.flight.as_ref().expect("how it is flown");
            assert!((leg.speed_mps - flight.ground_speed_mps).abs() < 1e-6);
            assert!(leg.length_air_m >= leg.length_m);
            assert_eq!(
                leg.height_reference.is_some(),
                leg.geometry[0].height_m.is_some()
            );
        }
    }
}

#[tokio::test]
async fn what_failed_is_what_the_plan_believed() {
    let mut told = Vec::new();
    for dialect in DIALECTS {
        let town = flying(dialect).await;
        let seen = json!({"drone_id": "drone-1", "location": {"x": 2100, "y": 0}, "battery_fraction": 0.75});
        town.see(seen).await;
        let more = json!({"drone": {"id": "drone-1"}, "location": {"x": 2100, "y": 0}});
        let answer = town.report(report("operational", more)).await;
        town.check(&answer).await;
        assert_eq!(answer.answer.outcome, Outcome::Diverted);
        assert_eq!(nodes(&answer.answer.path), ["b"]);
        assert_eq!(&*answer.answer.energy, "unchecked");
        assert!(answer.flight.is_none() && answer.legs.is_empty());
        let plan = town.plan("p").await;
        assert_eq!(&*plan.energy, "unchecked");
        told.push(answer);
    }
    assert_eq!(told[0], told[1]);
}

#[tokio::test]
async fn a_place_that_nobody_knows_costs_the_leg_once() {
    let mut told = Vec::new();
    for dialect in DIALECTS {
        let town = flying(dialect).await;
        let planned = town.plan("p").await;
        let leg = planned.reported.legs[1]
            .flight
            .as_ref()
            .expect("how it is flown");
        let mut lost = report("service_level", json!({"drone": {"id": "drone-1"}}));
        let fields = lost.as_object_mut().expect("an object");
        fields.remove("location");
        fields.insert("location_unknown".to_owned(), json!(true));
        let answer = town.report(lost).await;
        town.check(&answer).await;
        assert_eq!(nodes(&answer.answer.path), ["c", "d"]);
        let flight = answer.flight.as_ref().expect("a flight");
        let left = flight.battery_at_departure_fraction;
        assert!((left - leg.battery_after_fraction).abs() < 1e-9, "{left}");
        told.push(answer);
    }
    assert_eq!(told[0], told[1]);
}

#[tokio::test]
async fn a_detail_says_which_figure_counts() {
    for (detail, flies_on) in [
        ("battery", true),
        ("payload", false),
        ("propulsion", false),
        ("land_now", false),
    ] {
        let mut told = Vec::new();
        for dialect in DIALECTS {
            let town = flying(dialect).await;
            let more = json!({"detail": detail, "location": {"x": 2100, "y": 0}});
            let answer = town.report(report("operational", more)).await;
            town.check(&answer).await;
            let is_diverted = answer.answer.outcome == Outcome::Diverted;
            assert_ne!(is_diverted, flies_on, "{detail}: {answer:?}");
            assert_eq!(&*answer.answer.energy, "checked", "{detail}");
            if is_diverted {
                assert_eq!(nodes(&answer.answer.path), ["b"], "{detail}");
            }
            told.push(answer);
        }
        assert_eq!(told[0], told[1], "{detail}");
    }
}
