//! What a planner is asked.

use super::Traffic;
use super::flown::FlightTerms;
use crate::airspace::Airspace;
use crate::edge::drones::{Drones, Sighting};
use crate::edge::plan_entry::PlanEntry;
use crate::flight::ServiceStop;
use crate::network::{NodeIx, Topology};
use crate::recompose::Request;
use crate::wire;
use jiff::Timestamp;
use std::sync::Arc;

/// Where, when and among whom a drone flies.
#[derive(Clone, Copy, Debug)]
pub(in crate::edge) struct Scene<'a> {
    /// The airspace, which may be an imagined one.
    pub(in crate::edge) airspace: &'a Arc<Airspace>,
    /// Whether it is imagined: tables know worlds by their numbers, and that of an imagined one may come again for another.
    pub(in crate::edge) is_imagined: bool,
    /// The revision that refusals name.
    pub(in crate::edge) revision: &'a str,
    pub(in crate::edge) weather: Option<&'a Arc<str>>,
    pub(in crate::edge) traffic: Traffic<'a>,
    pub(in crate::edge) now: Timestamp,
}

impl<'a> Scene<'a> {
    /// The network.
    pub(in crate::edge) fn topology(&self) -> &'a Arc<Topology> {
        self.airspace.topology()
    }
}

/// A report that has been settled, and who sent it.
#[derive(Clone, Copy)]
pub(in crate::edge) struct Asked<'a> {
    pub(in crate::edge) report: &'a wire::FailureReport,
    pub(in crate::edge) request: &'a Request,
    /// The plan that it is about.
    pub(in crate::edge) plan: Option<&'a PlanEntry>,
    /// The drone, where the caller may speak for it.
    pub(in crate::edge) drone_id: Option<&'a str>,
    pub(in crate::edge) drones: &'a Drones,
}

/// A drone whose leg is gone with the network that it was on.
#[derive(Clone, Debug)]
pub(in crate::edge) struct Displaced<'a> {
    /// The network before.
    pub(in crate::edge) before: &'a Topology,
    pub(in crate::edge) destination: NodeIx,
    /// Where its delivery goes by its stops.
    pub(in crate::edge) onward: Vec<ServiceStop>,
    /// A request from its place, where that is known.
    pub(in crate::edge) request: Option<Request>,
    /// The leg that it was on.
    pub(in crate::edge) leg: usize,
    pub(in crate::edge) sighting: Option<Sighting>,
}

/// What a delivery request states, read already.
#[derive(Clone, Copy, Debug)]
pub(in crate::edge) struct Stated {
    pub(in crate::edge) start: Timestamp,
    pub(in crate::edge) now: Timestamp,
    pub(in crate::edge) payload_kg: f64,
    pub(in crate::edge) airspeed_mps: Option<f64>,
    /// What the telemetry of its drone said of the battery last, and when.
    pub(in crate::edge) seen_battery: Option<(f64, Timestamp)>,
}

/// How a delivery is to be flown.
#[derive(Clone, Debug)]
pub(in crate::edge) struct Terms {
    pub(in crate::edge) departs_at: Timestamp,
    pub(in crate::edge) airspeed_mps: f64,
    /// With battery and clock, where those are reckoned with.
    pub(in crate::edge) flight: Option<FlightTerms>,
}

/// A delivery that is wanted: from where a drone stands.
#[derive(Clone, Copy, Debug)]
pub(in crate::edge) struct Wanted<'a> {
    pub(in crate::edge) source: NodeIx,
    /// `None` ends it on the nearest free pad.
    pub(in crate::edge) destination: Option<NodeIx>,
    /// Where it is served on its way, in order.
    pub(in crate::edge) stops: &'a [ServiceStop],
    pub(in crate::edge) terms: &'a Terms,
    pub(in crate::edge) drone_id: Option<&'a str>,
    /// Whether nothing that was worked out before counts.
    pub(in crate::edge) plainly: bool,
}

/// Something that may make a difference to what is flown, beside what closes now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::edge) enum Concern {
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
pub(in crate::edge) enum Occasion {
    /// It has reported a failure.
    Report,
    /// Something has changed.
    Change,
}
