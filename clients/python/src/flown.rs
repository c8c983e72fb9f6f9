//! Plans with battery, wind and times, and answers in flight.

use crate::document::to_python;
use crate::ground::Ground;
use crate::picture::{Drawing, draw};
use crate::question::named;
use crate::refusal::{Kind, Refusal, without_lock};
use crate::world::World;
use jiff::Timestamp;
use pyo3::prelude::*;
use serde_json::{Map, Value, json};
use skyway_engine::airspace::Airspace;
use skyway_engine::delivery::{
    BatteryNow, DEFAULT_DEADLINE_S, DEFAULT_REFUGE_STAY_S, DeliveryRequest, DeliveryScratch,
    DeliveryWorld, FlightComposition, FlightEnvironment, FlightFailure, FlightTables, Landing,
    Lands, OtherPlans, ReportedFigures, Trouble, answer_failure, compose_with_stops,
};
use skyway_engine::flight::{
    Airframe, FailureReport, FlightRules, Location, ServiceStop, Tariff, Wind, WindField,
};
use skyway_engine::itinerary::{FlightSetting, Limits, Objective};
use skyway_engine::network::NodeIx;
use skyway_engine::recompose::Request;
use skyway_formats::{FlightWriter, node_id_json, write_flight_document};
use skyway_maps::draw::DrawnFlight;
use std::sync::Arc;

/// Bytes that the tables of destinations may take.
const TABLE_BYTES: usize = 64 << 20;

/// What `skyway.Flight` says of a drone; its constructor has checked the numbers.
#[derive(FromPyObject)]
pub(crate) struct Drone<'py> {
    /// `phantom3`, `m100`, or the JSON of another.
    airframe: String,
    payload_kg: Option<f64>,
    battery_fraction: Option<f64>,
    wind: Option<(f64, f64)>,
    objective: String,
    start_time: Option<String>,
    deadline_s: Option<f64>,
    reserve_fraction: Option<f64>,
    swap_stations: Vec<Bound<'py, PyAny>>,
}

/// A drone in an airspace, with everything that it flies in.
struct Flight {
    skies: FlightEnvironment,
    setting: FlightSetting,
    tables: FlightTables,
    objective: Objective,
    battery: f64,
    reported: ReportedFigures,
    start_s: f64,
    deadline_s: f64,
}

fn wrong(place: &str, message: impl Into<String>) -> Refusal {
    Refusal::new(
        Kind::Flight,
        "flight_invalid",
        format!("flight.{place}"),
        message,
    )
}

impl<'py> Drone<'py> {
    /// Reads a `skyway.Flight`.
    pub(crate) fn of(given: &Bound<'py, PyAny>) -> PyResult<Self> {
        given.extract().map_err(|_| {
            let message = match given.repr() {
                Ok(shown) => format!("{shown} is no flight"),
                Err(_) => "it is no flight".to_owned(),
            };
            let refusal = Refusal::new(Kind::Flight, "not_a_flight", "flight", message);
            refusal.hint("give skyway.Flight(...)").into()
        })
    }

    fn airframe(&self) -> Result<Airframe, Refusal> {
        match self.airframe.as_str() {
            "phantom3" => Ok(Airframe::phantom3()),
            "m100" => Ok(Airframe::m100()),
            text => Airframe::from_json(text).map_err(|fault| {
                wrong("airframe", fault.to_string())
                    .hint("give phantom3, m100 or an airframe as in data/airframes")
            }),
        }
    }

    fn start_time(&self) -> Result<Option<Timestamp>, Refusal> {
        let given = self
            .start_time
            .as_deref()
            .map(str::parse::<Timestamp>)
            .transpose();
        given.map_err(|error| {
            wrong("start_time", error.to_string())
                .hint("give RFC 3339, such as 2026-11-27T18:00:00Z")
        })
    }

    fn rules(&self) -> Result<FlightRules, Refusal> {
        let defaults = FlightRules::default();
        let reserve = self.reserve_fraction.unwrap_or(defaults.reserve);
        if !FlightRules::RESERVE.contains(reserve) {
            let refusal = wrong("reserve_fraction", format!("it is {reserve}"));
            return Err(refusal.hint(format!("give {}", FlightRules::RESERVE)));
        }
        Ok(FlightRules {
            reserve,
            floor: defaults.floor.min(reserve),
            ..defaults
        })
    }

    fn fly_in(&self, ground: &Ground, airspace: &Airspace) -> PyResult<Flight> {
        let rules = self.rules()?;
        let stations = self.swap_stations.iter().enumerate();
        let stations = stations
            .map(|(number, id)| ground.node(id, &format!("flight.swap_stations[{number}]")));
        let others = OtherPlans {
            swap_stations: stations.collect::<PyResult<_>>()?,
            ..OtherPlans::default()
        };
        // A network without zones has no time of its own: then the drone starts when it says, or now.
        let own_time = Some(airspace.as_of()).filter(|&as_of| as_of != Timestamp::UNIX_EPOCH);
        let stated = self.start_time()?;
        let zero = own_time.or(stated).unwrap_or_else(now);
        let skies = FlightEnvironment::since(zero, airspace, others, &rules);
        let airframe = self.airframe()?;
        let start_s = stated.map_or(0.0, |start| skies.seconds(start));
        if start_s < 0.0 {
            let refusal = wrong(
                "start_time",
                "it is before the time for which zones are looked at",
            );
            return Err(refusal
                .hint("state that time with network.with_closures(at=...)")
                .into());
        }
        let wind = self.wind.map_or(Wind::CALM, |(from_deg, speed_mps)| {
            Wind::coming_from(from_deg, speed_mps)
        });
        let objectives = Objective::ALL.into_iter().map(|one| (one, one.name()));
        let situation = skies.situation();
        Ok(Flight {
            objective: named("flight.objective", &self.objective, objectives)?,
            battery: self.battery_fraction.unwrap_or(airframe.full_charge),
            reported: ReportedFigures {
                battery: self.battery_fraction.is_some(),
                payload: self.payload_kg.is_some() && self.battery_fraction.is_some(),
            },
            start_s,
            deadline_s: start_s + self.deadline_s.unwrap_or(DEFAULT_DEADLINE_S),
            setting: FlightSetting::new(
                ground.topology.clone(),
                airframe,
                self.payload_kg.unwrap_or(0.0),
                WindField::uniform(wind),
                rules,
                &situation,
            ),
            tables: FlightTables::new(TABLE_BYTES),
            skies,
        })
    }
}

impl Flight {
    fn world(&self) -> DeliveryWorld<'_> {
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
}

#[expect(
    clippy::disallowed_methods,
    reason = "a drone that says nothing of its start starts now"
)]
fn now() -> Timestamp {
    Timestamp::now()
}

/// A plan that is flown, with everything that it was made for.
#[pyclass(frozen, module = "skyway._skyway")]
pub(crate) struct Plan {
    flight: Flight,
    composition: Option<FlightComposition>,
    report: Option<FailureReport>,
    fields: Map<String, Value>,
}

#[pymethods]
impl Plan {
    /// The plan or the answer under the names of the API.
    fn document<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.fields)
    }

    /// The plan with all that it was made for, as text for `skyway verify`.
    fn certificate(&self, py: Python<'_>) -> PyResult<String> {
        let composition = self.composition()?;
        let text = without_lock(py, || {
            write_flight_document(&self.flight.skies, &self.flight.setting, composition)
        })?;
        Ok(text.map_err(|fault| wrong("", fault.to_string()))?)
    }

    /// The picture of the plan, as the text of an SVG.
    #[pyo3(signature = (width_px, title, labels, whole, buildings))]
    fn svg(
        &self,
        py: Python<'_>,
        width_px: u32,
        title: Option<String>,
        labels: &str,
        whole: bool,
        buildings: Option<&str>,
    ) -> PyResult<String> {
        let airspace = self.flight.skies.airspace();
        let drawing = Drawing::of(width_px, title, labels, whole, buildings, airspace)?;
        let composition = self.composition()?;
        let nodes = composition.nodes();
        Ok(without_lock(py, || {
            draw(
                airspace,
                None,
                Some(self.drawn(composition, &nodes)),
                drawing,
            )
        })?)
    }
}

impl Plan {
    fn composition(&self) -> Result<&FlightComposition, Refusal> {
        let none = || {
            Refusal::new(Kind::Flight, "no_plan", "", "there is no plan")
                .hint("look at the causes of the answer")
        };
        self.composition.as_ref().ok_or_else(none)
    }

    fn drawn<'a>(
        &'a self,
        composition: &'a FlightComposition,
        nodes: &'a [NodeIx],
    ) -> DrawnFlight<'a> {
        let plan = &composition.plan;
        DrawnFlight {
            plan,
            nodes,
            wind: self.flight.setting.wind().base,
            summary: format!(
                "{:.0} m in {:.0} s, lands with {:.0} % of the battery",
                composition.figures.distance_m,
                composition.figures.time_s,
                100.0 * plan.battery_at_arrival,
            ),
            failed_leg: self.report.as_ref().map(|report| report.leg),
            drone: self
                .report
                .as_ref()
                .and_then(|report| match report.location {
                    Location::At(place) => Some(place),
                    Location::LegStart | Location::Unknown => None,
                }),
        }
    }
}

/// Composes a delivery that a drone can fly.
pub(crate) fn compose(
    py: Python<'_>,
    world: &World,
    airspace: &Arc<Airspace>,
    (source, destination): (NodeIx, NodeIx),
    stops: &[ServiceStop],
    drone: &Drone<'_>,
) -> PyResult<Plan> {
    let flight = drone.fly_in(&world.ground, airspace)?;
    let request = DeliveryRequest {
        pad: None,
        source,
        destination,
        start_s: flight.start_s,
        began_s: flight.start_s,
        battery: flight.battery,
        objective: flight.objective,
        deadline_s: Some(flight.deadline_s),
    };
    let topology = &world.ground.topology;
    let composed = without_lock(py, || {
        let mut scratch = DeliveryScratch::new(topology);
        compose_with_stops(
            &flight.world(),
            &request,
            (stops, Lands::AtDestination),
            &mut scratch,
        )
    })?;
    let writer = flight.writer();
    let mut fields = match &composed {
        Ok(composition) => {
            let mut fields = writer.composition(composition);
            fields.insert("outcome".to_owned(), json!("composed"));
            fields
        }
        Err(refused) => writer.no_delivery(refused),
    };
    for (name, node) in [("source", source), ("destination", destination)] {
        fields.insert(name.to_owned(), node_id_json(topology, node));
    }
    Ok(Plan {
        flight,
        composition: composed.ok(),
        report: None,
        fields,
    })
}

/// Answers a drone in flight, with the battery that it has.
pub(crate) fn recompose(
    py: Python<'_>,
    world: &World,
    airspace: &Arc<Airspace>,
    request: &Request,
    drone: &Drone<'_>,
) -> PyResult<Plan> {
    let flight = drone.fly_in(&world.ground, airspace)?;
    let failure = FlightFailure {
        request,
        at_s: flight.start_s,
        battery: BatteryNow::Given(flight.battery),
        objective: flight.objective,
        deadline_s: Some(flight.deadline_s),
        planned_stops: None,
        landing: Landing::of(
            request.report.failure,
            Trouble::of(request.circumstances.detail),
            flight.reported,
        ),
    };
    let answer = without_lock(py, || {
        let mut scratch = DeliveryScratch::new(&world.ground.topology);
        answer_failure(&flight.world(), &failure, &mut scratch)
    })?;
    let fields = flight.writer().recomposition(&answer);
    Ok(Plan {
        composition: answer.composition,
        report: Some(request.report.clone()),
        fields,
        flight,
    })
}
