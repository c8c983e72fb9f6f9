//! What flies, and what is asked for of a flight.

use super::assumed::Assumed;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use skyway_engine::flight::Airframe;
use skyway_engine::itinerary::Objective;
use std::sync::Arc;

/// Grams in a kilogram.
const GRAMS: f64 = 1e3;

/// What flies.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::planner) struct DroneKind {
    pub(in crate::planner) airframe: Arc<Airframe>,
    pub(in crate::planner) payload_kg: f64,
}

impl DroneKind {
    /// An airframe with a payload, which is reckoned with in whole grams, rounded up.
    pub(in crate::planner) fn new(airframe: Arc<Airframe>, payload_kg: f64) -> Self {
        // What a decimal fraction is off in binary is no gram.
        // Of two zeros the larger may be the negative one, and adding one makes it positive.
        let grams = (payload_kg * GRAMS - 1e-6).ceil().max(0.0) + 0.0;
        Self {
            airframe,
            payload_kg: grams / GRAMS,
        }
    }
}

/// What was asked for of a plan's flight, in memory and in the plan's row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FlightOrder {
    /// The airframe's name.
    pub(crate) airframe: Arc<str>,
    /// Whether the client named it. Absent in rows of before as well, where it is not known.
    #[serde(
        rename = "airframe_named",
        default,
        skip_serializing_if = "std::ops::Not::not"
    )]
    pub(crate) is_airframe_named: bool,
    /// What is made least.
    pub(crate) objective: Objective,
    /// The latest landing, where one was stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) deadline: Option<Timestamp>,
}

/// How a delivery is to be flown, with battery and clock.
#[derive(Clone, Debug)]
pub(crate) struct FlightTerms {
    pub(crate) order: FlightOrder,
    pub(in crate::planner) kind: DroneKind,
    /// As the request or the drone's telemetry says; full where that is unknown.
    pub(super) battery: Option<f64>,
    pub(super) assumed: Assumed,
}
