//! The power model beside measured flights: mean power of a DJI Matrice 100 by speed.

use super::airframe::Airframe;
use thiserror::Error;

/// Mean power of 57 flights of a Matrice 100 by speed; `data/README.md` has source and licence.
pub const M100_MEASURED_CSV: &str = include_str!("../../../../data/energy/m100_measured.csv");

/// Measured mean power at a speed.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredPower {
    /// The condition flown, `hover` or a commanded speed.
    pub condition: String,
    /// Mean speed over ground, in metres per second.
    pub speed_mps: f64,
    /// Mean power, in watts.
    pub power_w: f64,
    /// Payload, in kilograms.
    pub payload_kg: f64,
    /// Mass in all, in kilograms.
    pub mass_kg: f64,
}

/// A measured power beside the model's.
#[derive(Clone, Debug, PartialEq)]
pub struct PowerComparison {
    /// What was measured.
    pub measured: MeasuredPower,
    /// What the model says at the same mass, with the speed as airspeed, in watts.
    pub model_w: f64,
}

impl PowerComparison {
    /// The model's power less the measured one, as a share of the measured one.
    pub fn relative_error(&self) -> f64 {
        self.model_w / self.measured.power_w - 1.0
    }
}

/// A line of measurements that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line} of the measurements has no {column} that is a number")]
pub struct MeasuredFault {
    /// The line, from 1.
    pub line: usize,
    /// The column that is missing or not a number.
    pub column: &'static str,
}

/// Reads measurements: condition, speed, power, samples, flights, payload, mass in all.
///
/// # Errors
/// The first line that lacks a number.
pub fn read_measured(csv: &str) -> Result<Vec<MeasuredPower>, MeasuredFault> {
    let mut measured = Vec::new();
    for (line, text) in (1..).zip(csv.lines()).skip(1) {
        let cells: Vec<&str> = text.split(',').map(str::trim).collect();
        let number = |place: usize, column: &'static str| {
            let cell = cells.get(place).and_then(|cell| cell.parse::<f64>().ok());
            cell.ok_or(MeasuredFault { line, column })
        };
        measured.push(MeasuredPower {
            condition: cells.first().copied().unwrap_or_default().to_owned(),
            speed_mps: number(1, "ground_speed_mps")?,
            power_w: number(2, "mean_power_w")?,
            payload_kg: number(5, "payload_kg")?,
            mass_kg: number(6, "allup_mass_kg")?,
        });
    }
    Ok(measured)
}

/// Holds an airframe's power model against measurements, as if it weighed what was measured.
///
/// # Errors
/// The first line that cannot be read.
pub fn compare(airframe: &Airframe, csv: &str) -> Result<Vec<PowerComparison>, MeasuredFault> {
    let measured = read_measured(csv)?.into_iter();
    let comparisons = measured.map(|measured| PowerComparison {
        model_w: airframe.cruise_w(measured.mass_kg - airframe.mass_kg, measured.speed_mps),
        measured,
    });
    Ok(comparisons.collect())
}
