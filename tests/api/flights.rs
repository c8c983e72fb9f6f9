//! Drones that are really flown: each failure type and each outcome in both dialects, checked by the independent checker and
//! computed again from what is kept.

use crate::town::{DIALECTS, Dialect, Town, at, text};
use serde_json::{Value, json};
use skyway::edge::FlightSettings;
use skyway::flight::Airframe;
use skyway::wire::{self, Outcome};

/// A drone that flies from a to d since six in the evening; it is over the second leg at two and a half minutes past.
pub(crate) async fn flying(dialect: Dialect) -> Town {
    let town = Town::open(dialect, "18:00").await;
    let request = json!({
        "id": "p", "source": "a", "destination": "d", "drone_id": "drone-1", "payload_kg": 0.25,
        "battery_fraction": 0.9, "airframe": "phantom3",
    });
    let plan = town.deliver(request).await.expect("a plan");
    assert_eq!((&*plan.energy, &*plan.times), ("checked", "computed"));
    town.wait_until("18:02:30").await;
    town
}

/// A report from the middle of the second leg.
pub(crate) fn report(failure: &str, more: Value) -> Value {
    let mut report = json!({
        "type": failure, "service": {"plan_id": "p", "leg": 1}, "location": {"x": 2250, "y": 0},
        "timestamp": "2026-11-27T18:02:30Z", "drone": {"id": "drone-1", "battery_fraction": 0.75},
    });
    let fields = report.as_object_mut().expect("an object");
    fields.extend(more.as_object().expect("an object").clone());
    report
}

fn drone(battery: f64) -> Value {
    json!({"drone": {"id": "drone-1", "battery_fraction": battery}})
}

pub(crate) fn nodes(path: &wire::Path<'_>) -> Vec<String> {
    path.nodes.iter().map(|id| id.text().to_owned()).collect()
}

fn causes(answer: &wire::Recomposition<'_>) -> Vec<(String, Option<String>)> {
    let causes = answer.causes.iter();
    let told = causes.map(|cause| {
        let id = cause.id.as_deref().map(str::to_owned);
        (cause.code.clone().into_owned(), id)
    });
    told.collect()
}

/// Legs as an answer has them: contingencies come after it.
fn before_contingencies(legs: &[wire::Leg<'static>]) -> Vec<wire::Leg<'static>> {
    let legs = legs.iter().cloned();
    legs.map(|leg| wire::Leg {
        if_closed: None,
        alternate: None,
        ..leg
    })
    .collect()
}

fn before_contingencies_of(plan: wire::Plan<'static>) -> wire::Plan<'static> {
    let version = |version: wire::PlanVersion<'static>| wire::PlanVersion {
        legs: before_contingencies(&version.legs),
        ..version
    };
    wire::Plan {
        reported: version(plan.reported),
        wanted: plan.wanted.map(version),
        ..plan
    }
}

/// Tells a story in both dialects: they have to say the same. What was answered is checked.
async fn both(failure: &str, more: Value) -> wire::Recomposition<'static> {
    let mut answers = Vec::new();
    for dialect in DIALECTS {
        let town = flying(dialect).await;
        let answer = town.report(report(failure, more.clone())).await;
        assert_eq!(
            (&*answer.answer.energy, &*answer.times),
            ("checked", "computed")
        );
        town.check(&answer).await;
        let plan = town.plan("p").await;
        let change = answer.plan.as_ref().expect("its plan");
        let proposed = plan.wanted.as_ref().map(|proposed| proposed.version);
        assert_eq!(change.version, proposed, "{failure}");
        if let Some(proposed) = &plan.wanted {
            assert_eq!(proposed.flight, answer.flight);
            assert_eq!(before_contingencies(&proposed.legs), answer.legs);
            assert_eq!(proposed.path, answer.answer.path);
        }
        answers.push((answer, before_contingencies_of(plan)));
    }
    let [rest, grpc] = [answers.remove(0), answers.remove(0)];
    assert_eq!(rest, grpc, "{failure}: the dialects differ");
    rest.0
}

#[tokio::test]
async fn weather_on_the_leg_is_flown_around() {
    let answer = both("environmental", json!({})).await;
    assert_eq!(answer.answer.outcome, Outcome::Rerouted);
    assert_eq!(nodes(&answer.answer.path), ["b", "n", "c", "d"]);
    assert_eq!(answer.answer.first_stretch_m, 750.0);
    let flight = answer.flight.expect("a flight");
    assert!(flight.stops.is_empty() && !flight.reserve_used && flight.proved);
    // The battery where the plan begins is that at the first node.
    assert!(flight.battery_at_departure_fraction < 0.75);
    let last = answer.legs.last().and_then(|leg| leg.flight.as_ref());
    let last = last.expect("how the last leg is flown");
    assert!(last.battery_after_fraction >= flight.battery_at_arrival_fraction);
    assert!((15.0..17.0).contains(&last.ground_speed_mps), "{last:?}");
}

#[tokio::test]
async fn an_obstacle_behind_the_drone_leaves_it_unaffected() {
    let answer = both(
        "navigational",
        json!({"cause_location": {"x": 1800, "y": 0}}),
    )
    .await;
    assert_eq!(answer.answer.outcome, Outcome::Unaffected);
    assert_eq!(nodes(&answer.answer.path), ["c", "d"]);
    // What the report closes for everyone finds the plan with a way that is open.
    assert_eq!(answer.plan.expect("its plan").version, Some(2));
    assert_eq!(answer.publication.state, wire::PublicationState::Published);
}

#[tokio::test]
async fn a_zone_that_a_report_brings_is_waited_out_on_a_pad() {
    let zone = json!({
        "type": "Feature", "id": "parade", "geometry": {"type": "Point", "coordinates": [2250, 1200]},
        "properties": {"radius_m": 200, "windows": [{"from": text("18:00"), "until": text("18:30")}]},
    });
    let answer = both("regulatory", json!({"zone": zone})).await;
    assert_eq!(answer.answer.outcome, Outcome::Hold);
    assert_eq!(nodes(&answer.answer.path), ["b", "n", "c", "d"]);
    let flight = answer.flight.expect("a flight");
    let hold = flight.hold.expect("where it waits");
    assert_eq!((hold.node.text(), hold.pad), ("b", 0));
    // The window, and by how much it is widened.
    let until: jiff::Timestamp = hold.until.parse().expect("an instant");
    assert!(at("18:29") < until && until < at("18:35"), "{until}");
    assert_eq!(flight.stops[0].takes_off_at, hold.until);
    assert!(flight.stops[0].waits_s > 600.0, "{:?}", flight.stops[0]);
}

#[tokio::test]
async fn without_the_pads_ahead_the_drone_charges_elsewhere() {
    let more = json!({
        "service": {"plan_id": "p", "leg": 0}, "location": {"x": 750, "y": 0},
        "drone": {"id": "drone-1", "battery_fraction": 0.4},
    });
    let answer = both("infrastructure", more).await;
    assert_eq!(answer.answer.outcome, Outcome::Rerouted);
    let flight = answer.flight.expect("a flight");
    let stops = flight.stops.iter().map(|stop| stop.node.text());
    assert_eq!(stops.collect::<Vec<_>>(), ["c"]);
    let stop = &flight.stops[0];
    assert!(stop.battery_after_fraction > stop.battery_before_fraction);
    assert!(stop.battery_before_fraction >= flight.reserve_fraction);
    assert_eq!(stop.reservation, wire::PadReservation::Confirmed);
}

#[tokio::test]
async fn a_low_battery_is_charged_where_the_deadline_allows_it() {
    let answer = both("operational", drone(0.3)).await;
    assert_eq!(answer.answer.outcome, Outcome::Rerouted);
    let flight = answer.flight.expect("a flight");
    assert_eq!(flight.stops.len(), 1, "{:?}", flight.stops);
    assert_eq!(flight.stops[0].node.text(), "c");
}

#[tokio::test]
async fn where_it_does_not_the_drone_diverts_to_a_pad() {
    let mut more = drone(0.3);
    more["location"] = json!({"x": 2400, "y": 0});
    more["deadline"] = json!(text("18:06"));
    let answer = both("operational", more).await;
    assert_eq!(answer.answer.outcome, Outcome::Diverted);
    assert_eq!(nodes(&answer.answer.path), ["c"]);
    let codes: Vec<String> = causes(&answer).into_iter().map(|(code, _)| code).collect();
    assert!(
        codes
            .iter()
            .any(|code| code == "deadline" || code == "battery"),
        "{codes:?}"
    );
    let opens = answer.opens.expect("it opens after the deadline");
    let arrives_at: jiff::Timestamp = opens.arrives_at.parse().expect("an instant");
    assert!(at("18:06") < arrives_at, "{arrives_at}");
}

#[tokio::test]
async fn an_empty_battery_reaches_nothing_and_says_so() {
    let answer = both("operational", drone(0.05)).await;
    assert_eq!(answer.answer.outcome, Outcome::NoRoute);
    assert!(answer.answer.path.nodes.is_empty() && answer.flight.is_none());
    assert_eq!(causes(&answer), [("below_reserve".to_owned(), None)]);
    // It is told what is near, and the least bad way, which is no path.
    let near: Vec<String> = answer
        .answer
        .near
        .iter()
        .map(|near| near.node.to_string())
        .collect();
    assert_eq!(near[..2], ["b", "c"]);
    assert!(
        answer
            .answer
            .near
            .iter()
            .all(|near| near.why_not == "below_floor")
    );
    let least_bad = answer.answer.unsafe_way.expect("the least bad way");
    assert_eq!(
        (&*least_bad.code, least_bad.length_m),
        ("below_reserve", 750.0)
    );
    assert!(least_bad.battery_fraction.expect("it is reckoned") < 0.08);
}

#[tokio::test]
async fn a_late_drone_goes_on_and_its_pads_and_legs_follow() {
    let answer = both("service_level", json!({})).await;
    assert_eq!(answer.answer.outcome, Outcome::Unaffected);
    assert_eq!(nodes(&answer.answer.path), ["c", "d"]);
    assert_eq!(answer.plan.expect("its plan").version, Some(2));
}

#[tokio::test]
async fn a_drone_that_is_cut_off_is_told_every_cause() {
    let mut answers = Vec::new();
    for dialect in DIALECTS {
        let town = flying(dialect).await;
        let works = json!({
            "id": "works", "reason": "crane", "nodes": ["b", "c"], "segments": ["a-b", "b-n"], "pads": ["b"],
        });
        town.api.post("/v1/closures", &works).await.is(201);
        let answer = town.report(report("environmental", json!({}))).await;
        town.check(&answer).await;
        answers.push(answer);
    }
    assert_eq!(answers[0], answers[1]);
    let answer = &answers[0];
    assert_eq!(answer.answer.outcome, Outcome::NoRoute, "{answer:?}");
    let told = causes(answer);
    assert!(
        told.contains(&("closure".to_owned(), Some("works".to_owned()))),
        "{told:?}"
    );
    assert!(!answer.answer.severed_by.is_empty());
}

#[tokio::test]
async fn a_zone_of_half_an_hour_is_flown_through_before_it_and_waited_out_in_it() {
    let mut told = Vec::new();
    for dialect in DIALECTS {
        let town = Town::open(dialect, "11:50").await;
        let parade = json!({
            "type": "Feature", "id": "parade",
            "geometry": {"type": "Polygon", "coordinates": [
                [[2000, -500], [2500, -500], [2500, 1500], [2000, 1500], [2000, -500]],
            ]},
            "properties": {"windows": [{"from": text("12:00"), "until": text("12:30")}]},
        });
        town.api.post("/v1/zones", &parade).await.is(201);
        let request = |id: &str| json!({"id": id, "source": "a", "destination": "d"});
        let before = town.deliver(request("before")).await.expect("a plan");
        let flight = before.reported.flight.as_ref().expect("a flight");
        assert!(flight.stops.is_empty(), "{flight:?}");
        assert_eq!(nodes(&before.reported.path), ["a", "b", "c", "d"]);
        assert!(before.flags.is_empty());
        town.wait_until("12:10").await;
        let within = town.deliver(request("within")).await.expect("a plan");
        let flight = within.reported.flight.as_ref().expect("a flight");
        assert_eq!(flight.stops.len(), 1, "{flight:?}");
        let enters: jiff::Timestamp = within.reported.legs[1]
            .departs_at
            .parse()
            .expect("an instant");
        assert!(at("12:30") < enters, "{enters}");
        told.push((before, within));
    }
    assert_eq!(told[0], told[1]);
}

#[tokio::test]
async fn wind_that_is_put_is_flown_in() {
    for dialect in DIALECTS {
        let town = Town::open(dialect, "18:00").await;
        let request = |id: &str| json!({"id": id, "source": "a", "destination": "d"});
        let calm = town.deliver(request("calm")).await.expect("a plan");
        let wind = |speed_mps: f64| {
            json!({"wind": [
                {"from": text("17:00"), "until": text("23:00"), "speed_mps": speed_mps, "from_deg": 90},
            ]})
        };
        let put = town.put_weather(wind(6.0), None).await.expect("weather");
        assert_ne!(put.stamp.revision, calm.stamp.revision);
        let headwind = town.deliver(request("headwind")).await.expect("a plan");
        let energy_wh =
            |plan: &wire::Plan<'_>| plan.reported.flight.as_ref().map(|flight| flight.energy_wh);
        assert!(energy_wh(&headwind) > energy_wh(&calm));
        let ground_mps = |plan: &wire::Plan<'_>| {
            let flight = plan.reported.legs[0].flight.as_ref();
            flight.map(|flight| flight.ground_speed_mps.round())
        };
        assert_eq!(
            (ground_mps(&calm), ground_mps(&headwind)),
            (Some(16.0), Some(10.0))
        );
        // A storm grounds everybody, and says why.
        let stale = town.put_weather(wind(12.0), None).await;
        assert_eq!(stale.expect_err("a version").0, "precondition_required");
        let etag = put.etag.as_deref();
        town.put_weather(wind(12.0), etag).await.expect("weather");
        let (code, errors) = town.deliver(request("storm")).await.expect_err("no plan");
        assert_eq!(code, "no_route");
        assert!(!errors.is_empty());
        let wrong = town.put_weather(wind(-1.0), etag).await.expect_err("wrong");
        assert_eq!(wrong.0, "weather_invalid");
        assert_eq!(wrong.1[0].0, "/wind/0/speed_mps");
    }
}

#[tokio::test]
async fn what_no_plan_can_be_is_refused_with_its_place_and_a_hint() {
    let mut told = Vec::new();
    for dialect in DIALECTS {
        let town = Town::open(dialect, "18:00").await;
        let request = json!({
            "source": "a", "destination": "d", "airframe": "phantom4", "battery_fraction": 87,
            "objective": "speed", "start_time": text("18:10"), "deadline": text("18:05"),
        });
        told.push(town.deliver(request).await.expect_err("no plan"));
    }
    assert_eq!(told[0], told[1]);
    let (code, errors) = &told[0];
    assert_eq!(code, "plan_invalid");
    let hint = |pointer: &str| {
        let found = errors.iter().find(|(at, _)| at == pointer);
        let (_, hint) = found.unwrap_or_else(|| panic!("{pointer} is not in {errors:?}"));
        hint.clone().unwrap_or_default()
    };
    assert!(hint("/airframe").contains("DJI Phantom 3"), "{errors:?}");
    assert!(hint("/battery_fraction").contains("0.87"), "{errors:?}");
    assert!(hint("/objective").contains("distance"), "{errors:?}");
    hint("/deadline");
}

#[tokio::test]
async fn what_no_report_can_be_is_passed_over_with_a_warning() {
    let mut told = Vec::new();
    for dialect in DIALECTS {
        let town = flying(dialect).await;
        let answer = town
            .report(report(
                "environmental",
                json!({
                    "objective": "speed", "deadline": text("18:00"),
                    "drone": {
                        "id": "drone-1", "airframe": "phantom4", "battery_fraction": 87,
                        "payload_kg": -1.0,
                    },
                }),
            ))
            .await;
        town.check(&answer).await;
        told.push(answer);
    }
    assert_eq!(told[0], told[1]);
    let answer = &told[0];
    // By its plan: it took off with nine tenths.
    assert_eq!(answer.answer.outcome, Outcome::Rerouted);
    let warnings = answer.answer.warnings.iter();
    let codes: Vec<&str> = warnings.map(|warning| &*warning.code).collect();
    for code in [
        "battery_ignored",
        "objective_unsupported",
        "unknown_airframe",
        "payload_ignored",
        "deadline_ignored",
    ] {
        assert!(codes.contains(&code), "{code} is not in {codes:?}");
    }
}

#[tokio::test]
async fn a_battery_that_nobody_knows_is_answered_by_distance() {
    let mut told = Vec::new();
    for dialect in DIALECTS {
        let town = Town::open(dialect, "18:00").await;
        let answer = town
            .report(json!({
                "type": "environmental", "service": {"from": "b", "to": "c"}, "destination": "d",
                "location": {"x": 2250, "y": 0},
            }))
            .await;
        assert_eq!(&*answer.answer.energy, "unchecked");
        assert_eq!(&*answer.times, "nominal");
        assert!(answer.flight.is_none());
        let warnings = answer.answer.warnings.iter();
        assert!(
            warnings
                .clone()
                .any(|warning| warning.code == "battery_unknown")
        );
        told.push(answer);
    }
    assert_eq!(told[0], told[1]);
}

#[tokio::test]
async fn telemetry_tells_of_a_battery_that_a_report_does_not_name() {
    for dialect in DIALECTS {
        let town = flying(dialect).await;
        let seen = town
            .see(json!({"drone_id": "drone-1", "location": {"x": 2250, "y": 0}, "battery_fraction": 0.7}))
            .await;
        assert_eq!(seen.recomposition_id, None, "{seen:?}");
        let more = json!({"drone": {"id": "drone-1"}});
        let answer = town.report(report("environmental", more)).await;
        let record = town.record(&answer.id).await;
        assert_eq!(record["world"]["flight"]["battery"], json!({"given": 0.7}));
    }
}

#[tokio::test]
async fn telemetry_off_the_plan_is_answered_by_itself_once_a_minute() {
    let mut told = Vec::new();
    for dialect in DIALECTS {
        let town = flying(dialect).await;
        let here = |battery: f64| json!({"drone_id": "drone-1", "location": {"x": 2250, "y": 0}, "battery_fraction": battery});
        let on_time = town.see(here(0.75)).await;
        assert_eq!(on_time.recomposition_id, None, "{on_time:?}");
        // At three minutes and a half it would be well on the next leg.
        town.wait_until("18:04").await;
        let late = town.see(here(0.75)).await;
        let id = late.recomposition_id.clone().expect("it is late");
        let proposed = late.wanted.clone().expect("a version");
        assert!(!late.affected, "it flies on as it was");
        let record = town.record(&id).await;
        assert_eq!(record["report"]["type"], "service_level");
        let plan = before_contingencies_of(town.plan("p").await);
        let proposed = wire::PlanVersion {
            legs: before_contingencies(&proposed.legs),
            ..proposed
        };
        assert_eq!(plan.wanted, Some(proposed.clone()));
        assert_eq!(
            plan.wanted.map(|proposed| proposed.outcome),
            Some("unaffected".into())
        );
        // While that waits for the drone nothing more is said of it.
        town.wait_until("18:04:30").await;
        let again = town.see(here(0.75)).await;
        assert_eq!(again.recomposition_id, None);
        assert!(again.wanted.is_some());
        told.push((late.recomposition_id, proposed));
    }
    assert_eq!(told[0], told[1]);
}

#[tokio::test]
async fn a_battery_lower_than_planned_is_a_failure_by_itself() {
    for dialect in DIALECTS {
        let town = flying(dialect).await;
        let low = town
            .see(json!({"drone_id": "drone-1", "location": {"x": 2250, "y": 0}, "battery_fraction": 0.3}))
            .await;
        assert!(low.recomposition_id.is_some(), "{low:?}");
        let flight = low.wanted.expect("a version").flight.expect("a flight");
        assert_eq!(flight.stops.len(), 1, "it has to charge: {flight:?}");
    }
}

#[tokio::test]
async fn a_heavier_airframe_is_named_and_draws_more() {
    for dialect in DIALECTS {
        let mut flight = FlightSettings::of(Airframe::phantom3());
        flight.airframes = vec![Airframe::m100().into()];
        let town = Town::with(dialect, "18:00", flight).await;
        let request = |id: &str, airframe: &str| json!({"id": id, "source": "a", "destination": "d", "airframe": airframe, "objective": "energy"});
        let light = town.deliver(request("light", "phantom3")).await;
        let heavy = town.deliver(request("heavy", "m100")).await;
        let flight = |plan: wire::Plan<'static>| plan.reported.flight.expect("a flight");
        let [light, heavy] = [light, heavy].map(|plan| flight(plan.expect("a plan")));
        assert_eq!(&*heavy.airframe, "DJI Matrice 100");
        assert!(heavy.energy_wh > 1.5 * light.energy_wh);
        assert_eq!(&*light.objective, "energy");
        assert!((light.value - light.energy_wh).abs() < 1e-9, "{light:?}");
    }
}
