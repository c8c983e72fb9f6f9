//! Plans with times and battery as tables for people.

use super::Flight;
use crate::cli::answer_table::node_text;
use crate::cli::output::{Align, Output, metres, titled_table};
use crate::cli::stop::Stop;
use crate::delivery::{Alternate, FlightComposition, FlightEnvironment, FlownDetour, Proof};
use crate::flight::{Stop as Stay, StopKind, Wind};
use crate::formats::flight_cause_text;
use crate::itinerary::{FlightCause, FlightOpening, StopFigures};
use crate::network::Topology;
use crate::recompose::Outcome;

/// Cells of a battery bar.
const BAR_CELLS: f64 = 10.0;
/// Parts of a cell, from empty to full.
const CELL_PARTS: [&str; 9] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉", "█"];

/// A battery as a bar of ten cells, and in per cent.
pub(super) fn battery_text(fraction: f64) -> String {
    let parts = (fraction.clamp(0.0, 1.0) * BAR_CELLS * 8.0).round() as usize;
    let (full, rest) = (parts / 8, parts % 8);
    let bar = format!("{}{}", "█".repeat(full), CELL_PARTS[rest]);
    format!("{bar:░<10} {:3.0} %", 100.0 * fraction)
}

/// A wind in words.
pub(super) fn wind_text(wind: Wind) -> String {
    let speed_mps = wind.speed_mps();
    if speed_mps < 1e-9 {
        return "calm".to_owned();
    }
    let towards_deg = wind.east_mps.atan2(wind.north_mps).to_degrees();
    let from_deg = (towards_deg + 180.0).rem_euclid(360.0);
    format!("wind {speed_mps:.1} m/s from {from_deg:.0}°")
}

/// The time of day of an instant, in UTC, for the rows of a table that has the day elsewhere.
pub(super) fn time_of_day(skies: &FlightEnvironment, seconds: f64) -> String {
    let whole = seconds.round();
    let written = skies.instant(whole).map(|instant| instant.to_string());
    // RFC 3339 has the time between T and the zone.
    let time = written.as_deref().and_then(|text| text.get(11..19));
    time.unwrap_or("-").to_owned()
}

/// An instant with its day, in RFC 3339 to the second: in a sentence nothing else says which day is meant.
pub(super) fn instant_text(skies: &FlightEnvironment, seconds: f64) -> String {
    let instant = skies.instant(seconds.round());
    instant.map_or_else(|| "-".to_owned(), |instant| instant.to_string())
}

/// A duration as minutes and seconds, with hours where there are any.
pub(super) fn duration_text(seconds: f64) -> String {
    let whole = seconds.round().max(0.0) as u64;
    let (hours, minutes, seconds) = (whole / 3600, whole / 60 % 60, whole % 60);
    match hours {
        0 => format!("{minutes} min {seconds:02} s"),
        _ => format!("{hours} h {minutes:02} min"),
    }
}

/// Prints the legs and stops of a plan, in their order.
pub(super) fn print_plan(
    flight: &Flight,
    composition: &FlightComposition,
    output: &Output,
) -> Result<(), Stop> {
    let topology: &Topology = flight.skies.topology();
    let columns = [
        ("leg", Align::Right),
        ("from", Align::Left),
        ("to", Align::Left),
        ("length", Align::Right),
        ("ground", Align::Right),
        ("begins", Align::Left),
        ("ends", Align::Left),
        ("battery", Align::Left),
    ];
    let mut table = titled_table(&columns);
    let plan = &composition.plan;
    for (number, leg) in plan.legs.iter().enumerate() {
        let stops = plan.stops.iter().zip(&composition.figures.stops);
        for (stop, figures) in stops.filter(|(stop, _)| stop.before_leg == number) {
            table.add_row(stop_row(flight, stop, figures));
        }
        let figures = &composition.figures.legs[number];
        table.add_row([
            (number + 1).to_string(),
            node_text(topology, leg.from),
            node_text(topology, leg.to),
            metres(figures.length_m),
            format!("{:.1} m/s", figures.ground_speed_mps),
            time_of_day(&flight.skies, leg.enters_s),
            time_of_day(&flight.skies, leg.leaves_s),
            battery_text(leg.battery_after),
        ]);
    }
    match plan.legs.is_empty() {
        true => Ok(()),
        false => output.table(&table),
    }
}

fn stop_row(flight: &Flight, stop: &Stay, figures: &StopFigures) -> [String; 8] {
    let verb = match stop.kind {
        StopKind::Start if figures.charged < 1e-6 => "waits at",
        StopKind::Start | StopKind::Charge => "charges at",
        StopKind::Swap => "swaps at",
    };
    // Who does nothing but wait need not be told twice how long.
    let waits = match figures.waits_s {
        waits_s if waits_s >= 1.0 && waits_s < figures.stay_s - 1.0 => {
            format!(", {} of it waiting", duration_text(waits_s))
        }
        _ => String::new(),
    };
    let node = node_text(flight.skies.topology(), stop.node);
    [
        "▪".to_owned(),
        format!("{verb} {node}"),
        format!("pad {}, {}{waits}", stop.pad, duration_text(figures.stay_s)),
        String::new(),
        String::new(),
        time_of_day(&flight.skies, stop.lands_s),
        time_of_day(&flight.skies, stop.takes_off_s),
        battery_text(stop.battery_after),
    ]
}

/// Prints what to do on each leg where the drone is told nothing.
pub(super) fn print_contingencies(
    flight: &Flight,
    composition: &FlightComposition,
    output: &Output,
) -> Result<(), Stop> {
    let columns = [
        ("leg", Align::Right),
        ("if it closes", Align::Left),
        ("alternate", Align::Left),
    ];
    let mut table = titled_table(&columns);
    for (number, contingency) in (1..).zip(&composition.contingencies) {
        let safe = contingency.safe.as_ref();
        table.add_row([
            number.to_string(),
            detour_text(flight, &contingency.if_closed),
            safe.map_or_else(|| "none".to_owned(), |safe| safe_text(flight, safe)),
        ]);
    }
    match composition.contingencies.is_empty() {
        true => Ok(()),
        false => output.table(&table),
    }
}

fn detour_text(flight: &Flight, detour: &FlownDetour) -> String {
    let topology: &Topology = flight.skies.topology();
    let told = &detour.contingency;
    let arrives = detour.flight.as_ref().map_or_else(String::new, |flown| {
        format!(", lands {}", time_of_day(&flight.skies, flown.arrives_s))
    });
    let reserve = if detour.reserve_used {
        ", on the reserve"
    } else {
        ""
    };
    match (told.outcome, told.extra_m, told.nodes.get(1)) {
        (Outcome::Rerouted, Some(extra_m), Some(&via)) => {
            format!("{extra_m:+.1} m by {}{arrives}", topology.node_id(via))
        }
        (Outcome::Diverted, ..) => match told.nodes.last() {
            Some(&node) => format!("divert to {}{reserve}", node_text(topology, node)),
            None => told.outcome.name().to_owned(),
        },
        (outcome, ..) => format!("{}{arrives}", outcome.name()),
    }
}

fn safe_text(flight: &Flight, alternate: &Alternate) -> String {
    let node = node_text(flight.skies.topology(), alternate.safe.node);
    let left = 100.0 * alternate.flight.battery_at_arrival;
    let reserve = if alternate.reserve_used {
        ", on the reserve"
    } else {
        ""
    };
    format!(
        "{node}, {}, {left:.0} % left{reserve}",
        metres(alternate.safe.length_m)
    )
}

/// The figures of a plan, by name.
pub(super) fn facts(
    flight: &Flight,
    composition: &FlightComposition,
) -> Vec<(&'static str, String)> {
    let plan = &composition.plan;
    let figures = &composition.figures;
    vec![
        ("distance", metres(figures.distance_m)),
        (
            "time",
            format!(
                "{}, lands {}",
                duration_text(figures.time_s),
                instant_text(&flight.skies, plan.arrives_s)
            ),
        ),
        (
            "energy",
            format!("{:.1} Wh, {:.2} batteries", figures.energy_wh, plan.energy),
        ),
        ("battery", battery_text(plan.battery_at_arrival)),
        ("stops", stops_text(composition)),
        ("delivery cost", format!("{:.3} USD", figures.cost_usd)),
        (
            "least",
            least_text(flight, composition.objective.name(), &composition.proof),
        ),
    ]
}

/// How often a plan stops, and what for.
pub(super) fn stops_text(composition: &FlightComposition) -> String {
    let stops = &composition.plan.stops;
    let figures = &composition.figures.stops;
    let landings = stops.iter().filter(|stop| stop.kind != StopKind::Start);
    let charged: f64 = figures.iter().map(|stop| stop.charged).sum();
    let on_pads_s: f64 = figures.iter().map(|stop| stop.stay_s).sum();
    let on_the_way = match landings.count() {
        0 => "no stops".to_owned(),
        1 => "1 stop".to_owned(),
        several => format!("{several} stops"),
    };
    match stops.is_empty() {
        true => on_the_way,
        false => format!(
            "{on_the_way}, {} on pads, {charged:.2} batteries charged",
            duration_text(on_pads_s)
        ),
    }
}

/// What was made least, and whether it is proved.
fn least_text(flight: &Flight, objective: &str, proof: &Proof) -> String {
    match (proof.proved, proof.reason) {
        (true, _) => format!("{objective}, proved"),
        (false, Some(reason)) => format!(
            "{objective}, not proved ({}); none lands before {}",
            reason.name(),
            instant_text(&flight.skies, proof.lower_bound.arrives_s)
        ),
        (false, None) => format!("{objective} on this path alone, not of all"),
    }
}

/// What keeps a drone from its destination, and from when on the way would be open.
pub(super) fn causes_text(
    flight: &Flight,
    causes: &[FlightCause],
    opens: Option<FlightOpening>,
) -> String {
    let skies = &flight.skies;
    let mut words: Vec<String> = causes
        .iter()
        .map(|cause| flight_cause_text(skies, cause).1)
        .collect();
    words.dedup();
    if let Some(opens) = opens {
        words.push(format!(
            "without the deadline a plan would leave at {} and land at {}",
            instant_text(skies, opens.leaves_s),
            instant_text(skies, opens.arrives_s)
        ));
    }
    words.join("; ")
}
