//! Airframes as data, and the energy that a leg takes.
//!
//! The wind triangle at constant airspeed gives the ground speed, a power model the watts in cruise; climbing
//! costs its potential energy over the efficiency, descending nothing.

use super::figure::{Figure, FigureRange};
use super::wind::Wind;
use crate::geo::Point;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Standard gravity as the published model takes it, in metres per second squared.
const GRAVITY_MPS2: f64 = 9.81;
/// A leg flown slower than this over ground, in metres per second, is unflyable.
const MIN_GROUND_SPEED_MPS: f64 = 0.5;

/// How hard a drone brakes of which nothing else is stated, in metres per second squared.
const DEFAULT_ACCELERATION_MPS2: f64 = 3.5;
/// How long such a drone takes until it brakes, in seconds.
const DEFAULT_REACTION_S: f64 = 2.0;

/// How many watts an airframe takes in cruise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case", deny_unknown_fields)]
pub enum PowerModel {
    /// `P[kW] = (m_v + m_p) v[km/h] / ((3600 / g) eta r) + p`, after D'Andrea (IEEE T-ASE 11(3), 2014) as Rizvi's
    /// notebooks use it for the Phantom 3.
    #[serde(rename = "dandrea2014")]
    Dandrea2014 {
        /// Lift over drag `r`.
        lift_to_drag: f64,
        /// Power transfer `eta`, 0 to 1.
        efficiency: f64,
        /// Avionics `p`, in watts.
        avionics_w: f64,
    },
    /// `P[W] = b1 m^1.5 / sqrt(rho) + b0`, whatever the speed: the cruise regression of Rodrigues et al. (Patterns
    /// 3(8), 2022) for the Matrice 100.
    #[serde(rename = "rodrigues2022")]
    Rodrigues2022 {
        /// `b1`.
        slope: f64,
        /// `b0`, in watts.
        intercept_w: f64,
        /// `rho`, in kilograms per cubic metre.
        air_density_kg_m3: f64,
    },
}

/// A type of drone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Airframe {
    /// A name for people.
    pub name: String,
    /// Watts in cruise.
    pub power: PowerModel,
    /// Mass without payload, battery included, in kilograms.
    pub mass_kg: f64,
    /// Heaviest payload, in kilograms.
    pub max_payload_kg: f64,
    /// Energy of a full battery, in watt hours.
    pub battery_wh: f64,
    /// The airspeed it cruises at, in metres per second.
    pub airspeed_mps: f64,
    /// Climbing and descending on the spot, in metres per second: at take-off, landing and between bands.
    pub vertical_speed_mps: f64,
    /// Climbing under way, in metres per second; [`vertical_speed_mps`](Self::vertical_speed_mps) where none is stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub climb_mps: Option<f64>,
    /// Descending under way, likewise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub descent_mps: Option<f64>,
    /// How hard it brakes, in metres per second squared; 3.5 where nothing is stated.
    #[serde(default = "default_acceleration_mps2")]
    pub acceleration_mps2: f64,
    /// How long it takes until it brakes, in seconds; 2 where nothing is stated.
    #[serde(default = "default_reaction_s")]
    pub reaction_s: f64,
    /// Share of the battery's energy that becomes height, 0 to 1.
    pub climb_efficiency: f64,
    /// The strongest gust it flies in, in metres per second.
    pub max_wind_mps: f64,
    /// Gusts over mean wind; for the limit alone, not for the energy.
    pub gust_factor: f64,
    /// Time constant of recharging, in seconds.
    pub charge_tau_s: f64,
    /// What counts as full when recharging, as a fraction.
    pub full_charge: f64,
}

fn default_acceleration_mps2() -> f64 {
    DEFAULT_ACCELERATION_MPS2
}

fn default_reaction_s() -> f64 {
    DEFAULT_REACTION_S
}

/// Why an airframe is refused.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AirframeFault {
    /// It is not JSON of this shape.
    #[error("the airframe cannot be read: {reason}; see data/airframes for examples")]
    Unreadable {
        /// What the reader says.
        reason: String,
    },
    /// A number is out of range.
    #[error("{}; give {}", Figure::said(&format!("{} of airframe {airframe:?}", figure.name), figure.value), figure.range)]
    OutOfRange {
        /// The airframe's name.
        airframe: String,
        /// The figure.
        figure: Figure,
    },
}

/// Why a leg cannot be flown.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum Unflyable {
    /// The payload is heavier than the airframe carries.
    #[error("a payload of {payload_kg} kg is more than the {limit_kg} kg it carries")]
    Payload {
        /// The payload, in kilograms.
        payload_kg: f64,
        /// The limit, in kilograms.
        limit_kg: f64,
    },
    /// Gusts are above the airframe's limit.
    #[error("gusts of {gust_mps:.1} m/s are above the limit of {limit_mps} m/s")]
    Gusts {
        /// Mean wind times gust factor, in metres per second.
        gust_mps: f64,
        /// The limit, in metres per second.
        limit_mps: f64,
    },
    /// The wind across is as fast as the drone.
    #[error("a cross wind of {cross_mps:.1} m/s is not below the airspeed of {airspeed_mps} m/s")]
    CrossWind {
        /// Wind across the leg, in metres per second.
        cross_mps: f64,
        /// The airspeed, in metres per second.
        airspeed_mps: f64,
    },
    /// The wind ahead leaves no speed over ground.
    #[error(
        "the wind leaves {ground_speed_mps:.2} m/s over ground, not above {MIN_GROUND_SPEED_MPS}"
    )]
    NoHeadway {
        /// Ground speed, in metres per second.
        ground_speed_mps: f64,
    },
}

/// What a leg takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LegCost {
    /// Seconds.
    pub time_s: f64,
    /// Fraction of the battery.
    pub energy: f64,
}

impl LegCost {
    /// Of a leg that cannot be flown.
    pub const UNFLYABLE: Self = Self {
        time_s: f64::INFINITY,
        energy: f64::INFINITY,
    };

    /// True when the leg can be flown.
    #[inline]
    pub fn is_flyable(self) -> bool {
        self.time_s.is_finite()
    }
}

impl Airframe {
    /// The default: a DJI Phantom 3 with the published constants.
    pub fn phantom3() -> Self {
        Self {
            name: "DJI Phantom 3".to_owned(),
            power: PowerModel::Dandrea2014 {
                lift_to_drag: 3.0,
                efficiency: 0.5,
                avionics_w: 100.0,
            },
            mass_kg: 1.216,
            max_payload_kg: 1.1,
            battery_wh: 68.1,
            airspeed_mps: 16.0,
            vertical_speed_mps: 3.0,
            climb_mps: Some(3.0),
            descent_mps: Some(3.0),
            acceleration_mps2: DEFAULT_ACCELERATION_MPS2,
            reaction_s: DEFAULT_REACTION_S,
            climb_efficiency: 0.5,
            max_wind_mps: 10.0,
            gust_factor: 1.4,
            charge_tau_s: 960.0,
            full_charge: 0.98,
        }
    }

    /// The heavier one: a DJI Matrice 100, by the regression on its measured flights.
    pub fn m100() -> Self {
        Self {
            name: "DJI Matrice 100".to_owned(),
            power: PowerModel::Rodrigues2022 {
                slope: 68.9,
                intercept_w: 16.8,
                air_density_kg_m3: 1.204,
            },
            mass_kg: 3.68,
            max_payload_kg: 0.75,
            battery_wh: 129.96,
            airspeed_mps: 12.0,
            ..Self::phantom3()
        }
    }

    /// Reads an airframe from JSON and checks it.
    ///
    /// # Errors
    /// [`AirframeFault`] where it is not of this shape or a number makes no sense.
    pub fn from_json(text: &str) -> Result<Self, AirframeFault> {
        let airframe: Self =
            serde_json::from_str(text).map_err(|error| AirframeFault::Unreadable {
                reason: error.to_string(),
            })?;
        airframe.check()?;
        Ok(airframe)
    }

    fn check(&self) -> Result<(), AirframeFault> {
        let mut figures = self.figures().into_iter();
        match figures.find(|figure| !figure.is_valid()) {
            Some(figure) => Err(AirframeFault::OutOfRange {
                airframe: self.name.clone(),
                figure,
            }),
            None => Ok(()),
        }
    }

    /// Every figure with what it may be, by the names that documents have; those of its power first.
    pub fn figures(&self) -> Vec<Figure> {
        const FRACTION: FigureRange = FigureRange::above(0.0, 1.0);
        const WATTS: FigureRange = FigureRange::between(0.0, 1e5);
        let mut figures = match &self.power {
            PowerModel::Dandrea2014 {
                lift_to_drag,
                efficiency,
                avionics_w,
            } => vec![
                Figure::new("power.lift_to_drag", *lift_to_drag, above_0(100.0)),
                Figure::new("power.efficiency", *efficiency, FRACTION),
                Figure::new("power.avionics_w", *avionics_w, WATTS),
            ],
            PowerModel::Rodrigues2022 {
                slope,
                intercept_w,
                air_density_kg_m3,
            } => vec![
                Figure::new("power.slope", *slope, above_0(1e4)),
                Figure::new("power.intercept_w", *intercept_w, WATTS),
                Figure::new("power.air_density_kg_m3", *air_density_kg_m3, above_0(10.0)),
            ],
        };
        let airspeed = FigureRange::above(MIN_GROUND_SPEED_MPS, 300.0);
        let payload = FigureRange::between(0.0, 1e4);
        let wind = FigureRange::between(0.0, 120.0);
        let reaction = FigureRange::between(0.0, 60.0);
        // Gusts are never weaker than the mean that they are taken from.
        let gusts = FigureRange::between(1.0, 10.0);
        figures.extend([
            Figure::new("mass_kg", self.mass_kg, above_0(1e4)),
            Figure::new("max_payload_kg", self.max_payload_kg, payload),
            Figure::new("battery_wh", self.battery_wh, above_0(1e7)),
            Figure::new("airspeed_mps", self.airspeed_mps, airspeed),
            Figure::new(
                "vertical_speed_mps",
                self.vertical_speed_mps,
                above_0(100.0),
            ),
            Figure::new("climb_mps", self.climb_speed_mps(), above_0(100.0)),
            Figure::new("descent_mps", self.descent_speed_mps(), above_0(100.0)),
            Figure::new("acceleration_mps2", self.acceleration_mps2, above_0(100.0)),
            Figure::new("reaction_s", self.reaction_s, reaction),
            Figure::new("climb_efficiency", self.climb_efficiency, FRACTION),
            Figure::new("max_wind_mps", self.max_wind_mps, wind),
            Figure::new("gust_factor", self.gust_factor, gusts),
            Figure::new("charge_tau_s", self.charge_tau_s, above_0(1e6)),
            Figure::new("full_charge", self.full_charge, above_0(0.999)),
        ]);
        figures
    }

    /// Power in cruise at an airspeed, in watts.
    pub fn cruise_w(&self, payload_kg: f64, airspeed_mps: f64) -> f64 {
        let mass_kg = self.mass_kg + payload_kg;
        match self.power {
            PowerModel::Dandrea2014 {
                lift_to_drag,
                efficiency,
                avionics_w,
            } => {
                let airspeed_kmh = airspeed_mps * 3.6;
                let lift_kw =
                    mass_kg * airspeed_kmh / ((3600.0 / GRAVITY_MPS2) * efficiency * lift_to_drag);
                1000.0 * lift_kw + avionics_w
            }
            PowerModel::Rodrigues2022 {
                slope,
                intercept_w,
                air_density_kg_m3,
            } => slope * mass_kg.powf(1.5) / air_density_kg_m3.sqrt() + intercept_w,
        }
    }

    /// Energy of climbing, as a fraction of the battery; descending takes none.
    pub fn climb_energy(&self, payload_kg: f64, climb_m: f64) -> f64 {
        let mass_kg = self.mass_kg + payload_kg;
        let climb_wh = mass_kg * GRAVITY_MPS2 * climb_m.max(0.0) / (3600.0 * self.climb_efficiency);
        climb_wh / self.battery_wh
    }

    /// Speed over ground on a course, by the wind triangle, in metres per second.
    ///
    /// # Errors
    /// [`Unflyable`] where the wind across is not below the airspeed, or too little speed is left. The limit on gusts
    /// is not part of the triangle.
    pub fn ground_speed_mps(&self, course: Point, wind: Wind) -> Result<f64, Unflyable> {
        let along_mps = wind.east_mps * course.x + wind.north_mps * course.y;
        let cross_mps = (wind.east_mps * course.y - wind.north_mps * course.x).abs();
        let airspeed_mps = self.airspeed_mps;
        if cross_mps >= airspeed_mps {
            return Err(Unflyable::CrossWind {
                cross_mps,
                airspeed_mps,
            });
        }
        let ground_speed_mps =
            along_mps + (airspeed_mps * airspeed_mps - cross_mps * cross_mps).sqrt();
        if ground_speed_mps <= MIN_GROUND_SPEED_MPS {
            return Err(Unflyable::NoHeadway { ground_speed_mps });
        }
        Ok(ground_speed_mps)
    }

    /// Time and energy of a level leg by the formulas alone: neither gusts nor payload are held against a limit.
    ///
    /// `course` is the unit vector of the flight. Where a limit on the ground speed binds, the leg takes longer at the
    /// power of the airspeed: a bound, as the drone would fly slower and draw no more.
    ///
    /// # Errors
    /// [`Unflyable`] by the wind triangle.
    pub fn level_leg(
        &self,
        payload_kg: f64,
        length_m: f64,
        course: Point,
        wind: Wind,
        speed_limit_mps: Option<f64>,
    ) -> Result<LegCost, Unflyable> {
        let by_wind_mps = self.ground_speed_mps(course, wind)?;
        let ground_speed_mps = by_wind_mps.min(speed_limit_mps.unwrap_or(f64::INFINITY));
        let time_s = length_m / ground_speed_mps;
        let energy_wh = self.cruise_w(payload_kg, self.airspeed_mps) * time_s / 3600.0;
        Ok(LegCost {
            time_s,
            energy: energy_wh / self.battery_wh,
        })
    }

    /// Checks payload and wind against the airframe's limits.
    ///
    /// # Errors
    /// [`Unflyable`] where one is exceeded.
    pub fn within_limits(&self, payload_kg: f64, wind: Wind) -> Result<(), Unflyable> {
        if payload_kg > self.max_payload_kg {
            return Err(Unflyable::Payload {
                payload_kg,
                limit_kg: self.max_payload_kg,
            });
        }
        let gust_mps = wind.speed_mps() * self.gust_factor;
        if gust_mps > self.max_wind_mps {
            return Err(Unflyable::Gusts {
                gust_mps,
                limit_mps: self.max_wind_mps,
            });
        }
        Ok(())
    }

    /// How fast it climbs under way, in metres per second.
    pub fn climb_speed_mps(&self) -> f64 {
        self.climb_mps.unwrap_or(self.vertical_speed_mps)
    }

    /// How fast it descends under way, in metres per second.
    pub fn descent_speed_mps(&self) -> f64 {
        self.descent_mps.unwrap_or(self.vertical_speed_mps)
    }

    /// The least time for a climb in metres, or down where they are below 0, in seconds.
    pub fn slope_s(&self, up_m: f64) -> f64 {
        match up_m > 0.0 {
            true => up_m / self.climb_speed_mps(),
            false => -up_m / self.descent_speed_mps(),
        }
    }

    /// How far it flies on at a speed before it can turn, in metres: `v t + v² / (2 a)`.
    pub fn stopping_m(&self, speed_mps: f64) -> f64 {
        speed_mps * self.reaction_s + speed_mps * speed_mps / (2.0 * self.acceleration_mps2)
    }

    /// How the battery of this airframe charges.
    pub fn charging(&self) -> super::Charging {
        super::Charging {
            tau_s: self.charge_tau_s,
            full: self.full_charge,
        }
    }
}

const fn above_0(most: f64) -> FigureRange {
    FigureRange::above(0.0, most)
}
