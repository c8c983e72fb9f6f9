//! What a planner is asked.

use super::Traffic;
use super::flown::FlightTerms;
use crate::drones::{Drones, Sighting};
use crate::plans::entry::PlanEntry;
use jiff::Timestamp;
use skyway_contract as wire;
use skyway_engine::airspace::Airspace;
use skyway_engine::flight::ServiceStop;
use skyway_engine::network::{NodeIx, Topology};
use skyway_engine::recompose::Request;
use std::sync::Arc;

/// A drone that is so near to a node, in metres, may stand on a pad there.
pub(crate) const AT_NODE_M: f64 = 50.0;
/// One that says whether it is in the air stands, or lands, only so near to it.
pub(crate) const ON_PAD_M: f64 = 15.0;

/// Where, when and among whom a drone flies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scene<'a> {
    /// The airspace, which may be an imagined one.
    pub(crate) airspace: &'a Arc<Airspace>,
    /// Whether it is imagined: tables know worlds by their numbers, and that of an imagined one may come again for another.
    pub(crate) is_imagined: bool,
    /// The revision that refusals name.
    pub(crate) revision: &'a str,
    pub(crate) weather: Option<&'a Arc<str>>,
    pub(crate) traffic: Traffic<'a>,
    pub(crate) now: Timestamp,
}

impl<'a> Scene<'a> {
    /// The network.
    pub(crate) fn topology(&self) -> &'a Arc<Topology> {
        self.airspace.topology()
    }
}

/// A report that has been settled, and who sent it.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    pub(crate) report: &'a wire::FailureReport,
    pub(crate) request: &'a Request,
    /// The plan that it is about.
    pub(crate) plan: Option<&'a PlanEntry>,
    /// The drone, where the caller may speak for it.
    pub(crate) drone_id: Option<&'a str>,
    pub(crate) drones: &'a Drones,
}

/// A drone whose leg is gone with the network that it was on.
#[derive(Clone, Debug)]
pub(crate) struct Displaced<'a> {
    /// The network before.
    pub(crate) before: &'a Topology,
    pub(crate) destination: NodeIx,
    /// Where its delivery goes by its stops.
    pub(crate) onward: Vec<ServiceStop>,
    /// A request from its place, where that is known.
    pub(crate) request: Option<Request>,
    /// The leg that it was on.
    pub(crate) leg: usize,
    pub(crate) sighting: Option<Sighting>,
}

/// What a delivery request states, read already.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stated {
    pub(crate) start: Timestamp,
    pub(crate) now: Timestamp,
    pub(crate) payload_kg: f64,
    pub(crate) airspeed_mps: Option<f64>,
    /// What the telemetry of its drone said of the battery last, and when.
    pub(crate) seen_battery: Option<(f64, Timestamp)>,
}

/// How a delivery is to be flown.
#[derive(Clone, Debug)]
pub(crate) struct Terms {
    pub(crate) departs_at: Timestamp,
    pub(crate) airspeed_mps: f64,
    /// With battery and clock, where those are reckoned with.
    pub(crate) flight: Option<FlightTerms>,
}

/// A delivery that is wanted: from where a drone stands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted<'a> {
    pub(crate) source: NodeIx,
    /// `None` ends it on the nearest free pad.
    pub(crate) destination: Option<NodeIx>,
    /// Where it is served on its way, in order.
    pub(crate) stops: &'a [ServiceStop],
    pub(crate) terms: &'a Terms,
    pub(crate) drone_id: Option<&'a str>,
    /// Whether nothing that was worked out before counts.
    pub(crate) plainly: bool,
}

/// Something that may make a difference to what is flown, beside what closes now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Concern {
    /// What closes later, or would have.
    Announced,
    /// The wind.
    Wind,
    /// Other plans in the air and on the pads.
    Traffic,
    /// Where its drone is when, and with how much battery.
    Telemetry,
    /// That there may be a better way.
    Improvement,
}

/// Why a drone is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Occasion {
    /// It has reported a failure.
    Report,
    /// Something has changed.
    Change,
}
