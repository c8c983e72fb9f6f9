//! The flight model against the published figures: reference values, limits, charging, wind, measurements.

use skyway::flight::{
    Airframe, AirframeFault, Charging, FlightLegs, FlightRules, Tariff, Unflyable, Wind, WindField,
    WindPatch,
};
use skyway::geo::{Point, PreparedShape, Shape};
use skyway::network::sketch;
use std::sync::Arc;

const EAST: Point = Point::new(1.0, 0.0);

fn energy_of(payload_kg: f64, length_m: f64, wind: Wind) -> f64 {
    let leg = Airframe::phantom3().level_leg(payload_kg, length_m, EAST, wind, None);
    leg.expect("it can be flown").energy
}

fn along(mps: f64) -> Wind {
    Wind {
        east_mps: mps,
        north_mps: 0.0,
    }
}

#[track_caller]
fn assert_near(found: f64, published: f64, tolerance: f64) {
    let off = (found - published).abs();
    assert!(off <= tolerance, "{found} is not {published}");
}

#[test]
fn energy_per_kilometre_is_the_published_one() {
    for (payload_kg, published_wh) in [(0.0, 3.95), (0.5, 4.85), (1.0, 5.76)] {
        let wh = energy_of(payload_kg, 1_000.0, Wind::CALM) * 68.1;
        assert_near(wh, published_wh, 0.005);
    }
}

#[test]
fn wind_ahead_behind_and_across_gives_the_published_shares_of_a_battery() {
    let across = Wind {
        east_mps: 0.0,
        north_mps: 8.0,
    };
    let cases = [
        (Wind::CALM, 0.036),
        (along(-8.0), 0.071),
        (along(8.0), 0.024),
        (across, 0.041),
    ];
    for (wind, published) in cases {
        assert_near(energy_of(0.5, 500.0, wind), published, 0.0005);
    }
}

#[test]
fn a_leg_is_unflyable_across_too_strong_a_wind_and_where_no_headway_is_left() {
    let frame = Airframe::phantom3();
    let speed = |east_mps, north_mps| {
        let wind = Wind {
            east_mps,
            north_mps,
        };
        frame.ground_speed_mps(EAST, wind)
    };
    assert!(matches!(speed(0.0, 16.0), Err(Unflyable::CrossWind { .. })));
    assert!(matches!(
        speed(-15.5, 0.0),
        Err(Unflyable::NoHeadway { .. })
    ));
    assert_near(speed(-15.4, 0.0).expect("just enough"), 0.6, 1e-9);
    // 1.4 times 7 is below 10, 1.4 times 7.2 above.
    assert_eq!(frame.within_limits(0.5, along(7.0)), Ok(()));
    let gusty = frame.within_limits(0.5, along(7.2));
    assert!(matches!(gusty, Err(Unflyable::Gusts { .. })));
    let heavy = frame.within_limits(1.2, Wind::CALM);
    assert!(matches!(heavy, Err(Unflyable::Payload { .. })));
}

#[test]
fn climbing_costs_its_potential_energy_over_the_efficiency() {
    let frame = Airframe::phantom3();
    let wh = frame.climb_energy(0.5, 100.0) * 68.1;
    assert_near(wh, 1.716 * 9.81 * 100.0 / 1800.0, 1e-9);
    assert_near(frame.climb_energy(0.5, -100.0), 0.0, 0.0);
}

#[test]
fn recharging_follows_the_curve_and_its_inverse() {
    let charging = Airframe::phantom3().charging();
    let time_s = charging.time_s(0.2, 0.9).expect("below full");
    assert_near(time_s, 960.0 * 8.0_f64.ln(), 1e-9);
    assert_near(charging.level_after(0.2, time_s), 0.9, 1e-12);
    assert_near(charging.level_after(0.2, 1e6), 0.98, 0.0);
    assert_near(charging.level_after(1.0, 60.0), 1.0, 0.0);
    assert_eq!(charging.time_s(0.2, 0.99), None);
    assert_eq!(charging.time_s(0.5, 0.4), Some(0.0));
    assert!(
        charging
            .time_s(0.0, 0.98)
            .is_some_and(|s| (s - 3755.0).abs() < 1.0)
    );
    let other = Charging {
        tau_s: 480.0,
        ..charging
    };
    assert_near(
        other.time_s(0.2, 0.9).expect("below full"),
        time_s / 2.0,
        1e-9,
    );
}

#[test]
fn the_bundled_files_are_the_bundled_airframes() {
    let phantom = include_str!("../../data/airframes/phantom3.json");
    let m100 = include_str!("../../data/airframes/m100.json");
    assert_eq!(Airframe::from_json(phantom), Ok(Airframe::phantom3()));
    assert_eq!(Airframe::from_json(m100), Ok(Airframe::m100()));
    let weightless = phantom.replace("1.216", "0");
    let refused = Airframe::from_json(&weightless).expect_err("a drone has a mass");
    assert_eq!(
        refused.to_string(),
        "mass_kg of airframe \"DJI Phantom 3\" is 0; give a number above 0 and up to 10000"
    );
    let cut = Airframe::from_json("{");
    assert!(matches!(cut, Err(AirframeFault::Unreadable { .. })));
}

#[test]
fn wind_is_told_by_where_it_comes_from() {
    let from_the_west = Wind::coming_from(270.0, 5.0);
    assert_near(from_the_west.east_mps, 5.0, 1e-12);
    assert_near(from_the_west.north_mps, 0.0, 1e-12);
    assert_near(Wind::coming_from(0.0, 5.0).north_mps, -5.0, 1e-12);
}

#[test]
fn areas_go_before_the_network_and_windows_are_kept() {
    let square = [
        (0.0, 0.0),
        (50.0, 0.0),
        (50.0, 50.0),
        (0.0, 50.0),
        (0.0, 0.0),
    ];
    let ring = square.map(|(x, y)| Point::new(x, y)).to_vec();
    let shape = Shape::polygon(&[ring]).expect("a square");
    let patch = |area, from_s, until_s, mps| WindPatch {
        area,
        from_s,
        until_s,
        wind: along(mps),
    };
    let area = Some(Arc::new(PreparedShape::new(shape)));
    let field = WindField {
        base: along(1.0),
        patches: vec![
            patch(None, 100.0, 200.0, 2.0),
            patch(area, 150.0, f64::INFINITY, 3.0),
        ],
    };
    let on = |from_x, at_s| {
        let (from, to) = (Point::new(from_x, 0.0), Point::new(from_x + 10.0, 0.0));
        let winds = field.on_leg(from, to, at_s);
        winds.iter().map(|wind| wind.east_mps).collect::<Vec<f64>>()
    };
    assert_eq!(on(0.0, 99.0), [1.0]);
    assert_eq!(on(0.0, 100.0), [2.0]);
    assert_eq!(on(0.0, 150.0), [3.0]);
    assert_eq!(on(80.0, 150.0), [2.0]);
    assert_eq!(on(80.0, 200.0), [1.0]);
    assert_eq!(field.changes_s(), [100.0, 150.0, 200.0]);
}

#[test]
fn the_table_has_what_the_formulas_say_in_every_period() {
    let topology = sketch("a    b    c", &[("a", "b"), ("b", "c")]);
    let [a, b] = ["a", "b"].map(|id| topology.node(id).expect("drawn"));
    let headwind = WindPatch {
        area: None,
        from_s: 600.0,
        until_s: 900.0,
        wind: along(-5.0),
    };
    let field = WindField {
        base: Wind::CALM,
        patches: vec![headwind],
    };
    let rules = FlightRules::default();
    let legs = FlightLegs::of(&topology, &Airframe::phantom3(), 0.5, &field, &rules);
    let there = legs
        .from(a)
        .find(|&leg| legs.leg(leg).to == b)
        .expect("drawn");
    assert_near(legs.cost(there, 0).time_s, 500.0 / 16.0, 1e-9);
    assert_near(legs.cost(there, 1).time_s, 500.0 / 11.0, 1e-9);
    assert_eq!(legs.cost(there, 2), legs.cost(there, 0));
    let back = legs.leg(there).twin;
    assert_eq!(legs.leg(back).to, a);
    assert_eq!(legs.leg(back).twin, there);
    assert_near(legs.cost(back, 1).time_s, 500.0 / 21.0, 1e-9);
    assert_near(legs.leg(back).least.time_s, 500.0 / 21.0, 1e-9);
    assert_near(legs.vertical_s(a), 10.0, 1e-9);
    let energy = energy_of(0.5, 500.0, Wind::CALM);
    assert_near(legs.cost(there, 0).energy, energy, 1e-12);
}

#[test]
fn the_tariff_is_the_papers() {
    assert_near(Tariff::default().cost_usd(2.0, 10_000.0), 0.1, 1e-15);
    assert_near(Tariff::default().cost_usd(0.5, 5_000.0), 0.0125, 1e-15);
}

/// Mean power of 57 flights of a Matrice 100 by speed; `data/README.md` has source and licence.
const M100_MEASURED_CSV: &str = include_str!("../../data/energy/m100_measured.csv");

/// By how much a model is off at each measured speed, as a share of the power measured, if it weighed what was flown.
fn errors(frame: &Airframe) -> Vec<f64> {
    let error = |line: &str| {
        let cells = line.split(',').map(|cell| cell.trim().parse::<f64>());
        let cells: Vec<f64> = cells.map(|cell| cell.unwrap_or(f64::NAN)).collect();
        let (speed_mps, measured_w, mass_kg) = (cells[1], cells[2], cells[6]);
        frame.cruise_w(mass_kg - frame.mass_kg, speed_mps) / measured_w - 1.0
    };
    M100_MEASURED_CSV.lines().skip(1).map(error).collect()
}

/// What docs/flight-model.md says of the models beside the measurements.
#[test]
fn the_models_are_off_by_what_the_page_says() {
    let heavier = errors(&Airframe::m100());
    assert_eq!(heavier.len(), 6);
    assert!(
        heavier.iter().all(|error| (-0.05..0.16).contains(error)),
        "{heavier:?}"
    );
    let default = errors(&Airframe::phantom3());
    assert_near(default[0], -0.79, 0.005);
    assert!(default.iter().all(|&error| error < -0.05), "{default:?}");
    assert!(
        default.is_sorted(),
        "it grows with speed, which measured power does not"
    );
}
