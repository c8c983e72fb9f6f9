//! Flying on the command line: the drone, its battery, the wind, the times; without any of these, paths are the shortest open ones.

mod answer;
mod composition;
mod table;

pub(super) use answer::answer;
pub(super) use composition::{Wanted, compose};

use super::airspace_source::{AirspaceArguments, duration};
use super::failure::one_of;
use super::files;
use super::output::{Output, metres};
use super::picture::Scene;
use super::stop::Stop;
use crate::airspace::Airspace;
use crate::delivery::{
    DEFAULT_DEADLINE_S, DEFAULT_REFUGE_STAY_S, DeliveryWorld, FlightComposition, FlightEnvironment,
    FlightTables, OtherPlans, ReportedFigures,
};
use crate::draw::DrawnFlight;
use crate::flight::{Airframe, FailureReport, FlightRules, Location, Tariff, Wind, WindField};
use crate::formats::{FlightWriter, write_flight_document};
use crate::itinerary::{FlightSetting, Limits, Objective};
use crate::network::Topology;
use clap::Args;
use clap::builder::TypedValueParser;
use jiff::{SignedDuration, Timestamp};
use std::path::Path;
use std::sync::Arc;

/// The bundled airframes.
const PHANTOM3: &str = "phantom3";
const M100: &str = "m100";
/// Bytes that the tables of destinations may take.
const TABLE_BYTES: usize = 64 << 20;

/// What is flown, and in what.
#[derive(Debug, Args)]
#[command(next_help_heading = "Flight (any of these computes times, battery and recharging)")]
pub(super) struct FlightArguments {
    /// The airframe: phantom3, m100, or a JSON file as in data/airframes [default: phantom3]
    #[arg(long, value_name = "NAME|FILE")]
    airframe: Option<String>,
    /// The payload, in kilograms [default: 0]
    #[arg(long, value_name = "KG", value_parser = not_negative)]
    payload_kg: Option<f64>,
    /// The battery at the start, or now in flight, as a fraction [default: 0.98]
    #[arg(long, value_name = "FRACTION", value_parser = fraction)]
    battery: Option<f64>,
    /// The wind over the network: where it comes from, in degrees from north, and metres per second, such as 225/7 [default: calm]
    #[arg(long, value_name = "FROM_DEG/MPS", value_parser = wind)]
    wind: Option<Wind>,
    /// What is made least: distance, time or energy [default: distance]
    #[arg(long, value_name = "OBJECTIVE", value_parser = objective())]
    objective: Option<Objective>,
    /// When the plan starts, or the drone reports, in RFC 3339 [default: --at]
    #[arg(long, value_name = "TIME")]
    start_time: Option<Timestamp>,
    /// The latest landing: a time in RFC 3339, or a duration after the start: seconds, or such as 6h [default: 2h30m]
    #[arg(long, value_name = "TIME|DURATION", value_parser = deadline)]
    deadline: Option<Deadline>,
    /// No node is reached with less than this fraction of the battery [default: 0.2]
    #[arg(long, value_name = "FRACTION", value_parser = reserve)]
    reserve: Option<f64>,
    /// Nodes that swap batteries instead of charging them; can be given more than once
    #[arg(long, value_name = "NODE")]
    swap_station: Vec<String>,
}

/// The latest landing.
#[derive(Clone, Copy, Debug)]
enum Deadline {
    At(Timestamp),
    After(SignedDuration),
}

fn number(text: &str) -> Option<f64> {
    text.trim()
        .parse::<f64>()
        .ok()
        .filter(|number| number.is_finite())
}

fn not_negative(text: &str) -> Result<f64, String> {
    let kilograms = number(text).filter(|&number| number >= 0.0);
    kilograms.ok_or_else(|| "give a number of 0 or more".to_owned())
}

fn fraction(text: &str) -> Result<f64, String> {
    match number(text) {
        Some(number) if (0.0..=1.0).contains(&number) => Ok(number),
        Some(percent) if (1.0..=100.0).contains(&percent) => Err(format!(
            "a fraction is between 0 and 1; did you mean {}?",
            percent / 100.0
        )),
        _ => Err("give a fraction between 0 and 1".to_owned()),
    }
}

/// A fraction that the rules allow, so that a check of the plan allows it too.
fn reserve(text: &str) -> Result<f64, String> {
    let reserve = fraction(text)?;
    if FlightRules::RESERVE.contains(reserve) {
        Ok(reserve)
    } else {
        Err(format!("give {}", FlightRules::RESERVE))
    }
}

fn wind(text: &str) -> Result<Wind, String> {
    let parts = text.split_once('/');
    let stated = parts.and_then(|(from, speed)| Some((number(from)?, number(speed)?)));
    match stated {
        Some((from_deg, speed_mps)) if (0.0..=360.0).contains(&from_deg) && speed_mps >= 0.0 => {
            Ok(Wind::coming_from(from_deg, speed_mps))
        }
        _ => Err(
            "give degrees from north, 0 to 360, and metres per second, such as 225/7".to_owned(),
        ),
    }
}

fn objective() -> impl TypedValueParser<Value = Objective> {
    one_of(&Objective::ALL, Objective::name)
}

fn deadline(text: &str) -> Result<Deadline, String> {
    if let Ok(instant) = text.parse::<Timestamp>() {
        return Ok(Deadline::At(instant));
    }
    let after = duration(text).ok().filter(SignedDuration::is_positive);
    after.map(Deadline::After).ok_or_else(|| {
        "give a time such as 2026-11-27T18:00:00Z, or a duration after the start: seconds, or such as 6h".to_owned()
    })
}

/// A drone with everything that it flies in.
pub(super) struct Flight {
    pub(super) skies: FlightEnvironment,
    pub(super) setting: FlightSetting,
    tables: FlightTables,
    pub(super) objective: Objective,
    pub(super) battery: f64,
    /// Which figures were named, and are not defaults.
    pub(super) reported: ReportedFigures,
    pub(super) start_s: f64,
    pub(super) deadline_s: f64,
}

impl FlightArguments {
    /// True where anything of a flight is named.
    pub(super) fn is_given(&self) -> bool {
        self.airframe.is_some()
            || self.payload_kg.is_some()
            || self.battery.is_some()
            || self.wind.is_some()
            || self.objective.is_some()
            || self.start_time.is_some()
            || self.deadline.is_some()
            || self.reserve.is_some()
            || !self.swap_station.is_empty()
    }

    /// The airspace at its own time, or else at that of the flight.
    pub(super) fn airspace(
        &self,
        airspace: &AirspaceArguments,
        topology: &Arc<Topology>,
        output: &Output,
    ) -> Result<Airspace, Stop> {
        airspace.open_at(topology, self.start_time, output)
    }

    /// The drone in an airspace.
    pub(super) fn flight(&self, airspace: &Airspace, output: &Output) -> Result<Flight, Stop> {
        let topology = airspace.topology();
        let defaults = FlightRules::default();
        let rules = FlightRules {
            reserve: self.reserve.unwrap_or(defaults.reserve),
            floor: defaults.floor.min(self.reserve.unwrap_or(defaults.floor)),
            ..defaults
        };
        let stations = self.swap_station.iter();
        let swap_stations: Result<Vec<_>, Stop> = stations
            .map(|id| super::names::node(topology, id))
            .collect();
        let others = OtherPlans {
            swap_stations: swap_stations?,
            ..OtherPlans::default()
        };
        let skies = FlightEnvironment::of(airspace, others, &rules);
        let airframe = self.airframe()?;
        let battery = match self.battery {
            Some(battery) => battery,
            None => airframe.full_charge,
        };
        let start_s = self.start_time.map_or(0.0, |start| skies.seconds(start));
        if start_s < 0.0 {
            return Err(Stop::Usage(
                "--start-time is before --at, the time for which zones are looked at".to_owned(),
            ));
        }
        let deadline_s = match self.deadline {
            Some(Deadline::At(instant)) => skies.seconds(instant),
            Some(Deadline::After(duration)) => start_s + duration.as_secs_f64(),
            None => start_s + DEFAULT_DEADLINE_S,
        };
        let wind = WindField::uniform(self.wind.unwrap_or(Wind::CALM));
        let payload_kg = self.payload_kg.unwrap_or(0.0);
        output.note(&format!(
            "{} with {payload_kg} kg, battery {:.0} %, {}",
            airframe.name,
            100.0 * battery,
            table::wind_text(wind.base)
        ));
        let situation = skies.situation();
        Ok(Flight {
            setting: FlightSetting::new(
                topology.clone(),
                airframe,
                payload_kg,
                wind,
                rules,
                &situation,
            ),
            skies,
            tables: FlightTables::new(TABLE_BYTES),
            objective: self.objective.unwrap_or(Objective::Distance),
            battery,
            reported: ReportedFigures {
                battery: self.battery.is_some(),
                payload: self.payload_kg.is_some() && self.battery.is_some(),
            },
            start_s,
            deadline_s,
        })
    }

    fn airframe(&self) -> Result<Airframe, Stop> {
        match self.airframe.as_deref() {
            None | Some(PHANTOM3) => Ok(Airframe::phantom3()),
            Some(M100) => Ok(Airframe::m100()),
            Some(file) => {
                let path = Path::new(file);
                if !files::exists(path) && path.extension().is_none() && file != "-" {
                    return Err(Stop::failed(format!(
                        "there is no file {file}; the bundled airframes are {PHANTOM3} and {M100}"
                    )));
                }
                let text = files::read_text(path)?;
                Airframe::from_json(&text).map_err(|fault| Stop::failed(format!("{file}: {fault}")))
            }
        }
    }
}

impl Flight {
    /// What deliveries are computed in.
    pub(super) fn world(&self) -> DeliveryWorld<'_> {
        DeliveryWorld {
            skies: &self.skies,
            setting: &self.setting,
            tables: &self.tables,
            tariff: Tariff::default(),
            refuge_stay_s: DEFAULT_REFUGE_STAY_S,
            limits: Limits::THOROUGH,
            with_contingencies: true,
        }
    }

    fn writer(&self) -> FlightWriter<'_> {
        FlightWriter {
            skies: &self.skies,
            setting: &self.setting,
        }
    }

    /// Draws a plan; for an answer in flight with the leg that failed and the drone.
    fn draw(
        &self,
        file: &Path,
        composition: &FlightComposition,
        failed: Option<(&FailureReport, &str)>,
        output: &Output,
    ) -> Result<(), Stop> {
        let report = failed.map(|(report, _)| report);
        let what = match failed {
            Some((_, outcome)) => format!("Outcome {outcome}"),
            None => "Composition".to_owned(),
        };
        let plan = &composition.plan;
        let nodes = composition.nodes();
        let scene = Scene::of(self.skies.airspace()).with_flight(DrawnFlight {
            plan,
            nodes: &nodes,
            wind: self.setting.wind().base,
            summary: format!(
                "{what}: {}, lands {} with {:.0} % of the battery, {}",
                metres(composition.figures.distance_m),
                table::time_of_day(&self.skies, plan.arrives_s),
                100.0 * plan.battery_at_arrival,
                table::stops_text(composition)
            ),
            failed_leg: report.map(|report| report.leg),
            drone: report.and_then(|report| match report.location {
                Location::At(place) => Some(place),
                Location::LegStart | Location::Unknown => None,
            }),
        });
        files::write_text(file, &scene.svg(), output)?;
        output.note(&format!("drew the plan in {}", file.display()));
        Ok(())
    }

    /// Writes a plan with all that it was made for.
    fn write_certificate(
        &self,
        file: &Path,
        composition: &FlightComposition,
        output: &Output,
    ) -> Result<(), Stop> {
        let text = write_flight_document(&self.skies, &self.setting, composition);
        files::write_text(file, &text.map_err(Stop::failed)?, output)?;
        output.note(&format!("wrote the plan to {}", file.display()));
        Ok(())
    }
}
