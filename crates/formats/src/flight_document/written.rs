//! The shape of the document, field by field.

use crate::flight::FlightRules;
use serde::{Deserialize, Serialize};
use serde_json::Value;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Written {
    pub(super) format: String,
    pub(super) network_sha256: String,
    /// Second 0.
    pub(super) zero: String,
    pub(super) airframe: Value,
    pub(super) payload_kg: f64,
    pub(super) wind: Vec<WrittenWind>,
    pub(super) rules: WrittenRules,
    pub(super) closures: Vec<WrittenClosure>,
    pub(super) reservations: Vec<WrittenReservation>,
    pub(super) traffic: Vec<WrittenTraffic>,
    pub(super) swap_stations: Vec<Value>,
    pub(super) start: WrittenStart,
    pub(super) destination: Value,
    pub(super) began_s: f64,
    /// Null where there is none.
    pub(super) deadline_s: Option<f64>,
    pub(super) reserve_fraction: f64,
    pub(super) closed_segments: Vec<String>,
    pub(super) plan: WrittenPlan,
}

/// The first statement has no times: it is what blows where nothing else is stated.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenWind {
    pub(super) from_s: Option<f64>,
    pub(super) until_s: Option<f64>,
    pub(super) east_mps: f64,
    pub(super) north_mps: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenRules {
    pub(super) reserve_fraction: f64,
    pub(super) floor_fraction: f64,
    pub(super) stop_s: f64,
    pub(super) swap_s: f64,
    pub(super) time_margin_s: f64,
    pub(super) time_margin_growth: f64,
    pub(super) headway_s: f64,
    // Documents of before plans were kept apart at nodes and crossings have neither.
    #[serde(default)]
    pub(super) node_headway_s: f64,
    #[serde(default)]
    pub(super) crossing_m: f64,
    pub(super) unknown_climb_m: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenClosure {
    pub(crate) id: String,
    pub(super) from_s: Option<f64>,
    pub(super) until_s: Option<f64>,
    pub(super) segments: Vec<String>,
    pub(super) nodes: Vec<Value>,
    pub(super) pads: Vec<Value>,
    pub(super) widened: bool,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenReservation {
    pub(super) node: Value,
    pub(super) pad: u16,
    pub(super) from_s: f64,
    /// Null where it has no end.
    pub(super) until_s: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WrittenTraffic {
    pub(super) segment: String,
    pub(super) from: Value,
    pub(super) enters_s: f64,
    pub(super) leaves_s: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenStart {
    pub(super) node: Value,
    pub(super) at_s: f64,
    pub(super) battery_fraction: f64,
    pub(super) on_ground: bool,
    pub(super) flown_m: f64,
    pub(super) drawn_fraction: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenPlan {
    pub(super) legs: Vec<WrittenLeg>,
    pub(super) stops: Vec<WrittenStop>,
    pub(super) arrives_s: f64,
    pub(super) battery_at_arrival_fraction: f64,
    pub(super) distance_m: f64,
    pub(super) energy_fraction: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenLeg {
    pub(super) from: Value,
    pub(super) to: Value,
    pub(super) segment: String,
    pub(super) enters_s: f64,
    pub(super) leaves_s: f64,
    pub(super) battery_before_fraction: f64,
    pub(super) battery_after_fraction: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenStop {
    pub(super) kind: WrittenKind,
    pub(super) before_leg: usize,
    pub(super) node: Value,
    pub(super) pad: u16,
    pub(super) lands_s: f64,
    pub(super) takes_off_s: f64,
    pub(super) battery_before_fraction: f64,
    pub(super) battery_after_fraction: f64,
    /// Of a stop at which the delivery is served.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) service_s: Option<f64>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum WrittenKind {
    Start,
    Charge,
    Swap,
}

impl WrittenRules {
    pub(crate) fn of(rules: &FlightRules) -> Self {
        Self {
            reserve_fraction: rules.reserve,
            floor_fraction: rules.floor,
            stop_s: rules.stop_s,
            swap_s: rules.swap_s,
            time_margin_s: rules.time_margin_s,
            time_margin_growth: rules.time_margin_growth,
            headway_s: rules.headway_s,
            node_headway_s: rules.node_headway_s,
            crossing_m: rules.crossing_m,
            unknown_climb_m: rules.unknown_climb_m,
        }
    }

    pub(crate) fn read(&self) -> FlightRules {
        FlightRules {
            reserve: self.reserve_fraction,
            floor: self.floor_fraction,
            stop_s: self.stop_s,
            swap_s: self.swap_s,
            time_margin_s: self.time_margin_s,
            time_margin_growth: self.time_margin_growth,
            headway_s: self.headway_s,
            node_headway_s: self.node_headway_s,
            crossing_m: self.crossing_m,
            unknown_climb_m: self.unknown_climb_m,
        }
    }
}
