//! Whether the figures that a plan rests on can be those of any world: each in its range, every window in order.
//!
//! A plan states its own premises, so that a forged one could prove anything: with margins of minus infinity no zone is
//! ever met. What is refused here is what no edge writes; what an edge could write is told, so that a reader compares it.

use super::flight::FlightPremises;
use super::flight_fault::FlightFault;
use crate::flight::{Figure, FigureRange, FlightPlan, FlightRules};

/// Instants are within thirty thousand years of second 0, so that a sum of them is still exact to a millisecond.
const INSTANT_S: FigureRange = FigureRange::between(-1e12, 1e12);
const FRACTION: FigureRange = FigureRange::between(0.0, 1.0);
/// What has been flown or drawn before the plan, and what a plan amounts to.
const TOTAL: FigureRange = FigureRange::between(0.0, 1e9);
/// Any number: it is compared with that of the flight.
const ANY: FigureRange = FigureRange::between(f64::MIN, f64::MAX);
/// A component of a wind, in metres per second.
const WIND_MPS: FigureRange = FigureRange::between(-120.0, 120.0);

/// Checks every figure of a plan and its premises; the first that cannot be is the fault, by its place in the document.
pub(super) fn check(plan: &FlightPlan, premises: &FlightPremises<'_>) -> Result<(), FlightFault> {
    rules_and_airframe(premises)?;
    starts(premises)?;
    winds(premises)?;
    situation(premises)?;
    figures_of(plan)
}

fn is_within(path: &str, figure: &Figure) -> Result<(), FlightFault> {
    if figure.is_valid() {
        return Ok(());
    }
    Err(FlightFault::Premise {
        path: match path {
            "" => figure.name.to_owned(),
            path => format!("{path}.{}", figure.name),
        },
        value: figure.value,
        range: figure.range,
    })
}

fn all_within(path: &str, figures: &[Figure]) -> Result<(), FlightFault> {
    figures
        .iter()
        .try_for_each(|figure| is_within(path, figure))
}

fn rules_and_airframe(premises: &FlightPremises<'_>) -> Result<(), FlightFault> {
    let rules = premises.rules;
    all_within("rules", &rules.figures())?;
    let floor = FigureRange::between(0.0, rules.reserve);
    is_within("rules", &Figure::new("floor_fraction", rules.floor, floor))?;
    all_within("airframe", &premises.airframe.figures())?;
    let payload = FigureRange::between(0.0, premises.airframe.max_payload_kg);
    // Minus infinity, which no document can write: who has to land flies whatever is left.
    let reserve = if premises.reserve == f64::NEG_INFINITY {
        FigureRange::between(f64::NEG_INFINITY, FlightRules::RESERVE.most)
    } else {
        FlightRules::RESERVE
    };
    let deadline_s = FigureRange::between(INSTANT_S.least, f64::INFINITY);
    all_within(
        "",
        &[
            Figure::new("payload_kg", premises.payload_kg, payload),
            Figure::new("reserve_fraction", premises.reserve, reserve),
            Figure::new("deadline_s", premises.deadline_s, deadline_s),
        ],
    )
}

/// The margins of windows grow from the instant at which the plan began: none later than its start.
fn starts(premises: &FlightPremises<'_>) -> Result<(), FlightFault> {
    let instants = FigureRange::between(0.0, INSTANT_S.most);
    for start in premises.starts {
        all_within(
            "start",
            &[
                Figure::new("at_s", start.at_s, instants),
                Figure::new("battery_fraction", start.battery, FRACTION),
                Figure::new("flown_m", start.flown_m, TOTAL),
                Figure::new("drawn_fraction", start.drawn, TOTAL),
            ],
        )?;
        let before_start = FigureRange::between(0.0, start.at_s);
        let began = Figure::new("began_s", premises.began_s, before_start);
        is_within("", &began)?;
    }
    Ok(())
}

fn winds(premises: &FlightPremises<'_>) -> Result<(), FlightFault> {
    let base = (&premises.wind.base, f64::NEG_INFINITY, f64::INFINITY);
    let patches = premises.wind.patches.iter();
    let patches = patches.map(|patch| (&patch.wind, patch.from_s, patch.until_s));
    for (number, (wind, from_s, until_s)) in std::iter::once(base).chain(patches).enumerate() {
        let path = format!("wind[{number}]");
        all_within(
            &path,
            &[
                Figure::new("east_mps", wind.east_mps, WIND_MPS),
                Figure::new("north_mps", wind.north_mps, WIND_MPS),
            ],
        )?;
        window(&path, ("from_s", from_s), ("until_s", until_s))?;
    }
    Ok(())
}

fn situation(premises: &FlightPremises<'_>) -> Result<(), FlightFault> {
    for (number, closure) in premises.situation.closures.iter().enumerate() {
        let path = format!("closures[{number}]");
        window(
            &path,
            ("from_s", closure.from_s),
            ("until_s", closure.until_s),
        )?;
    }
    for (number, stay) in premises.situation.reservations.iter().enumerate() {
        let path = format!("reservations[{number}]");
        let pads = premises.topology.pads(stay.node);
        let last_pad = FigureRange::between(0.0, f64::from(pads) - 1.0);
        let pad = Figure::new("pad", f64::from(stay.pad), last_pad);
        is_within(&path, &pad)?;
        window(&path, ("from_s", stay.from_s), ("until_s", stay.until_s))?;
    }
    for (number, leg) in premises.situation.traffic.iter().enumerate() {
        let path = format!("traffic[{number}]");
        window(
            &path,
            ("enters_s", leg.enters_s),
            ("leaves_s", leg.leaves_s),
        )?;
    }
    Ok(())
}

/// A window in order; either end may be open.
fn window(
    path: &str,
    (from, from_s): (&'static str, f64),
    (until, until_s): (&'static str, f64),
) -> Result<(), FlightFault> {
    let begins = FigureRange::between(f64::NEG_INFINITY, INSTANT_S.most);
    let ends = FigureRange::between(INSTANT_S.least, f64::INFINITY);
    if from_s.is_finite() {
        is_within(path, &Figure::new(from, from_s, INSTANT_S))?;
    }
    if until_s.is_finite() {
        is_within(path, &Figure::new(until, until_s, INSTANT_S))?;
    }
    is_within(path, &Figure::new(from, from_s, begins))?;
    is_within(path, &Figure::new(until, until_s, ends))?;
    let after_begin = FigureRange::between(from_s, f64::INFINITY);
    is_within(path, &Figure::new(until, until_s, after_begin))
}

/// The plan's own figures are compared with those of the flight: what is no number compares with nothing.
fn figures_of(plan: &FlightPlan) -> Result<(), FlightFault> {
    for (number, leg) in plan.legs.iter().enumerate() {
        let figures = [
            Figure::new("enters_s", leg.enters_s, INSTANT_S),
            Figure::new("leaves_s", leg.leaves_s, INSTANT_S),
            Figure::new("battery_before_fraction", leg.battery_before, ANY),
            Figure::new("battery_after_fraction", leg.battery_after, ANY),
        ];
        all_within(&format!("plan.legs[{number}]"), &figures)?;
    }
    for (number, stop) in plan.stops.iter().enumerate() {
        let figures = [
            Figure::new("lands_s", stop.lands_s, INSTANT_S),
            Figure::new("takes_off_s", stop.takes_off_s, INSTANT_S),
            Figure::new("battery_before_fraction", stop.battery_before, ANY),
            Figure::new("battery_after_fraction", stop.battery_after, ANY),
        ];
        all_within(&format!("plan.stops[{number}]"), &figures)?;
    }
    Ok(())
}
