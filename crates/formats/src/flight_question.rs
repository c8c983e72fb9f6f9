//! What an answer in flight was computed from beside its report and the closures in force, as a document: with it the answer can
//! be computed again.

use crate::airspace::{Airspace, Change};
use crate::delivery::{
    BatteryNow, DeliveryScratch, DeliveryWorld, FlightEnvironment, FlightFailure,
    FlightRecomposition, FlightTables, Landing, Stand, answer_failure,
};
use crate::flight::{Airframe, ServiceStop, Situation, Tariff, Wind};
use crate::flight_document::{
    FlightDocumentFault, Reader, Writer, WrittenClosure, WrittenReservation, WrittenRules,
    WrittenTraffic, write_flight_document,
};
use crate::itinerary::{FlightSetting, Limits, Objective};
use crate::network::NodeIx;
use crate::recompose::{Request, Severance};
use crate::weather::wind_field;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// What the document says that it is.
const FORMAT: &str = "skyway-flight-question-1";
/// Where more closures, pads and legs than these are in the way, they are not written down: many answers are kept.
const ENTRIES_MAX: usize = 2_000;
/// Bytes that the tables of destinations may take where an answer is computed again.
const TABLE_BYTES: usize = 32 << 20;

/// What an answer in flight is computed from.
#[derive(Clone, Copy, Debug)]
pub struct FlightQuestion<'a> {
    /// The state of the world.
    pub skies: &'a FlightEnvironment,
    /// The drone.
    pub setting: &'a FlightSetting,
    /// The weather as it is stated, as text.
    pub weather: Option<&'a str>,
    /// The report with what it takes to answer it by a flight.
    pub failure: &'a FlightFailure<'a>,
    /// Where the drone stands, if it does.
    pub stand: Option<Stand>,
    /// How long an alternate's pad has to be free, in seconds.
    pub refuge_stay_s: f64,
    /// What bounded each search.
    pub limits: Limits<'a>,
}

/// A question that has been read.
#[derive(Debug)]
pub struct ReadQuestion {
    skies: FlightEnvironment,
    setting: FlightSetting,
    at_s: f64,
    battery: BatteryNow,
    objective: Objective,
    deadline_s: Option<f64>,
    planned_stops: Option<Vec<NodeIx>>,
    onward: Vec<ServiceStop>,
    stand: Option<Stand>,
    landing: Option<Landing>,
    refuge_stay_s: f64,
    limits: Limits<'static>,
}

impl ReadQuestion {
    /// The state of the world.
    pub fn skies(&self) -> &FlightEnvironment {
        &self.skies
    }

    /// Answers a report again.
    pub fn answer(&self, request: &Request) -> FlightRecomposition {
        let tables = FlightTables::new(TABLE_BYTES);
        let world = DeliveryWorld {
            skies: &self.skies,
            setting: &self.setting,
            tables: &tables,
            // What it costs changes no answer.
            tariff: Tariff::default(),
            refuge_stay_s: self.refuge_stay_s,
            limits: self.limits,
            with_contingencies: false,
        };
        let mut scratch = DeliveryScratch::new(self.skies.topology());
        let mut request = request.clone();
        request.lead_by(self.onward.clone());
        let failure = FlightFailure {
            request: &request,
            at_s: self.at_s,
            battery: self.battery,
            objective: self.objective,
            deadline_s: self.deadline_s,
            planned_stops: self.planned_stops.as_deref(),
            landing: self.landing,
        };
        match self.stand {
            Some(stand) => stand.answer(&world, &failure, &mut scratch),
            None => answer_failure(&world, &failure, &mut scratch),
        }
    }

    /// The plan of an answer with everything that it was made for, as [`write_flight_document`] has it; `None` without a plan.
    ///
    /// # Errors
    /// [`FlightDocumentFault::WindArea`] where the wind is stated for an area.
    pub fn certificate(
        &self,
        answer: &FlightRecomposition,
    ) -> Result<Option<String>, FlightDocumentFault> {
        let plan = answer.composition.as_ref();
        let document = plan.map(|plan| write_flight_document(&self.skies, &self.setting, plan));
        document.transpose()
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    format: String,
    /// False where too much was in the way to be written down.
    complete: bool,
    /// Second 0.
    zero: String,
    at_s: f64,
    airframe: Value,
    payload_kg: f64,
    battery: WrittenBattery,
    objective: String,
    /// Null where none was stated.
    deadline_s: Option<f64>,
    /// Null where there was no plan.
    planned_stops: Option<Vec<Value>>,
    /// Where the delivery goes by its stops, the next first and its end last; absent without stops.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    onward: Vec<WrittenStop>,
    /// Null for a drone in the air.
    stand: Option<WrittenStand>,
    /// Where a drone had to land of which nothing showed that it could fly on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    landing: Option<String>,
    /// What blows where the weather states nothing.
    base_wind: WrittenWind,
    /// As it was stated; null where it never was.
    weather: Option<Value>,
    rules: WrittenRules,
    refuge_stay_s: f64,
    /// Labels and checks; absent in questions of before searches were bounded in time.
    #[serde(default)]
    limits: Option<[usize; 2]>,
    closures: Vec<WrittenClosure>,
    /// Closures that counted already and had not begun.
    not_begun: Vec<String>,
    reservations: Vec<WrittenReservation>,
    traffic: Vec<WrittenTraffic>,
    swap_stations: Vec<Value>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenWind {
    east_mps: f64,
    north_mps: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenStop {
    node: Value,
    service_s: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenStand {
    node: Value,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pad: Option<u16>,
    at_s: f64,
    battery_fraction: f64,
}

/// The battery as a fraction.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum WrittenBattery {
    /// As the drone said.
    Given(f64),
    /// Of a drone of which it is not known.
    Assumed(f64),
    /// At the start and at the end of the leg, by its plan.
    ByPlan([f64; 2]),
}

/// Writes a question.
pub fn write_flight_question(question: &FlightQuestion<'_>) -> Value {
    let FlightQuestion {
        skies,
        setting,
        failure,
        ..
    } = *question;
    let situation = skies.situation();
    let entries = situation.closures.len() + situation.reservations.len() + situation.traffic.len();
    let complete = entries <= ENTRIES_MAX;
    let nothing = Situation::default();
    let told = match complete {
        true => &situation,
        false => &nothing,
    };
    let writer = Writer {
        topology: skies.topology(),
    };
    let base = setting.wind().base;
    let written = Written {
        format: FORMAT.to_owned(),
        complete,
        zero: skies.zero().to_string(),
        at_s: failure.at_s,
        // Numbers and names always have a JSON form.
        airframe: serde_json::to_value(setting.airframe()).unwrap_or_default(),
        payload_kg: setting.payload_kg(),
        battery: match failure.battery {
            BatteryNow::Given(battery) => WrittenBattery::Given(battery),
            BatteryNow::Assumed(battery) => WrittenBattery::Assumed(battery),
            BatteryNow::ByPlan { before, after } => WrittenBattery::ByPlan([before, after]),
        },
        objective: failure.objective.name().to_owned(),
        deadline_s: failure.deadline_s,
        planned_stops: failure.planned_stops.map(|stops| writer.ids(stops)),
        onward: failure
            .request
            .onward
            .iter()
            .map(|stop| WrittenStop {
                node: writer.id(stop.node),
                service_s: stop.service_s,
            })
            .collect(),
        stand: question.stand.map(|stand| WrittenStand {
            node: writer.id(stand.node),
            pad: stand.pad,
            at_s: stand.at_s,
            battery_fraction: stand.battery,
        }),
        landing: failure.landing.map(|landing| landing.name().to_owned()),
        base_wind: WrittenWind {
            east_mps: base.east_mps,
            north_mps: base.north_mps,
        },
        weather: question
            .weather
            .and_then(|text| serde_json::from_str(text).ok()),
        rules: WrittenRules::of(setting.rules()),
        refuge_stay_s: question.refuge_stay_s,
        limits: Some([question.limits.labels, question.limits.checks]),
        closures: writer.closures(told, &skies.causes()),
        not_begun: not_begun(skies),
        reservations: writer.reservations(told),
        traffic: writer.traffic(told),
        swap_stations: writer.ids(&situation.swap_stations),
    };
    serde_json::to_value(&written).unwrap_or_default()
}

/// Closures that count by the look ahead of the airspace alone.
fn not_begun(skies: &FlightEnvironment) -> Vec<String> {
    let counting = skies.airspace().in_force();
    let later = counting.filter(|closure| !skies.now().is_in_force(&closure.id));
    later.map(|closure| closure.id.clone()).collect()
}

/// Reads a question; `airspace` has the closures that were in force.
///
/// # Errors
/// The first thing that cannot be read, or that too much was in the way to be written down.
pub fn read_flight_question(
    document: &Value,
    airspace: &Airspace,
) -> Result<ReadQuestion, FlightDocumentFault> {
    let written = Written::deserialize(document).map_err(|error| unreadable(error.to_string()))?;
    if written.format != FORMAT {
        let reason = format!("it is of the form '{}'", written.format);
        return Err(unreadable(reason));
    }
    match written.complete {
        true => written.read(airspace),
        false => Err(FlightDocumentFault::NotRecorded),
    }
}

fn unreadable(reason: String) -> FlightDocumentFault {
    FlightDocumentFault::Unreadable { reason }
}

impl Written {
    fn read(&self, airspace: &Airspace) -> Result<ReadQuestion, FlightDocumentFault> {
        let zero = self.zero.parse::<Timestamp>();
        let zero = zero.map_err(|error| unreadable(error.to_string()))?;
        let reader = Reader {
            topology: airspace.topology(),
        };
        let situation = reader.situation(
            &self.closures,
            &self.reservations,
            &self.traffic,
            &self.swap_stations,
        )?;
        let objective = Objective::ALL
            .into_iter()
            .find(|objective| objective.name() == self.objective)
            .ok_or_else(|| unreadable(format!("the objective '{}'", self.objective)))?;
        let stops = self.planned_stops.as_ref();
        let planned_stops = stops.map(|stops| reader.nodes("planned_stops", stops));
        let onward = self.onward.iter().map(|stop| {
            Ok(ServiceStop {
                node: reader.node("onward", &stop.node)?,
                service_s: stop.service_s,
            })
        });
        let stand = self.stand.as_ref().map(|stand| {
            Ok(Stand {
                node: reader.node("stand", &stand.node)?,
                pad: stand.pad,
                at_s: stand.at_s,
                battery: stand.battery_fraction,
            })
        });
        let landing = self.landing.as_deref().map(|name| {
            let mut all = [Landing::FreePad, Landing::AnyNode].into_iter();
            let found = all.find(|landing| landing.name() == name);
            found.ok_or_else(|| unreadable(format!("the landing '{name}'")))
        });
        Ok(ReadQuestion {
            landing: landing.transpose()?,
            setting: self.setting(airspace, &situation, zero)?,
            skies: self.skies(airspace, situation, zero),
            at_s: self.at_s,
            battery: match self.battery {
                WrittenBattery::Given(battery) => BatteryNow::Given(battery),
                WrittenBattery::Assumed(battery) => BatteryNow::Assumed(battery),
                WrittenBattery::ByPlan([before, after]) => BatteryNow::ByPlan { before, after },
            },
            objective,
            deadline_s: self.deadline_s,
            planned_stops: planned_stops.transpose()?,
            onward: onward.collect::<Result<_, FlightDocumentFault>>()?,
            stand: stand.transpose()?,
            refuge_stay_s: self.refuge_stay_s,
            limits: self
                .limits
                .map_or(Limits::THOROUGH, |[labels, checks]| Limits {
                    labels,
                    checks,
                    is_over: None,
                }),
        })
    }

    fn setting(
        &self,
        airspace: &Airspace,
        situation: &Situation,
        zero: Timestamp,
    ) -> Result<FlightSetting, FlightDocumentFault> {
        let airframe = Airframe::from_json(&self.airframe.to_string());
        let airframe = airframe.map_err(|fault| FlightDocumentFault::Airframe {
            reason: fault.to_string(),
        })?;
        let base = Wind {
            east_mps: self.base_wind.east_mps,
            north_mps: self.base_wind.north_mps,
        };
        let weather = self.weather.as_ref().map(Value::to_string);
        let topology = airspace.topology();
        Ok(FlightSetting::new(
            topology.clone(),
            airframe,
            self.payload_kg,
            wind_field(weather.as_deref(), base, topology.frame(), zero),
            self.rules.read(),
            situation,
        ))
    }

    fn skies(
        &self,
        airspace: &Airspace,
        situation: Situation,
        zero: Timestamp,
    ) -> FlightEnvironment {
        let causes = self.closures.iter();
        let causes = causes.map(|closure| Severance::Closure(closure.id.clone()));
        let late = self.not_begun.iter();
        let lifted: Vec<Change> = late.map(|id| Change::Lift(id.clone())).collect();
        let begun = airspace.apply(&lifted, airspace.as_of());
        let rules = self.rules.read();
        FlightEnvironment::recorded(zero, airspace, &begun, situation, causes.collect(), &rules)
    }
}
