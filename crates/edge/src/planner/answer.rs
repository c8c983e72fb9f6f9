//! What a planner answers.

use super::flown::{Flight, FlownVersion};
use super::{Version, later};
use crate::plans::stretches::Stretch;
use jiff::Timestamp;
use skyway_contract as wire;
use skyway_engine::compose::{Composition, flight_time_s};
use skyway_engine::flight::ServiceStop;
use skyway_engine::network::Topology;
use skyway_engine::recompose::{Fallback, Outcome, Recomposition, Strategy};
use skyway_formats::{IntoTerm, ReadWarning, warning_text};
use std::sync::Arc;

/// What is flown: legs with their contingencies, and with times, battery and pads where those are computed.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    pub(crate) composition: Composition,
    /// How it is flown; the composition is derived from that.
    pub(crate) flight: Option<Arc<FlownVersion>>,
    pub(crate) departs_at: Timestamp,
    /// How its drone comes to its first node, where it is not there.
    pub(crate) stretch: Option<Stretch>,
    /// Where its delivery is served on its way, in order.
    pub(crate) stops: Vec<ServiceStop>,
}

/// What a drone is told. Planners alone make one: outcome, path and flight belong together.
#[derive(Clone, Debug)]
pub(crate) struct Answer {
    pub(super) told: Recomposition,
    pub(super) flight: Option<Flight>,
}

impl Answer {
    /// An answer with nominal times.
    pub(super) fn by_distance(told: Recomposition) -> Self {
        Self { told, flight: None }
    }

    /// What the drone is to do, and how that came about.
    pub(crate) fn told(&self) -> &Recomposition {
        &self.told
    }

    /// How it is flown; `None` where its times are nominal.
    pub(crate) fn flight(&self) -> Option<&Flight> {
        self.flight.as_ref()
    }

    /// Nothing that was planned is touched where the plan was only assumed: it is another way for who flies it.
    pub(crate) fn is_another_way(&mut self) {
        if self.told.outcome == Outcome::Unaffected {
            self.told.outcome = Outcome::Rerouted;
        }
    }

    /// It goes instead of the answer of a strategy that did not pass.
    pub(crate) fn stands_in(&mut self, strategy: Strategy) {
        self.told.strategy = strategy;
        self.told.fallback = Some(Fallback::Checker);
    }

    /// How long it takes from now on to the end of the path, in seconds; at an airspeed from when it departs, where its times
    /// are nominal. `None` without a path.
    pub(crate) fn remaining_time_s(
        &self,
        topology: &Topology,
        airspeed_mps: f64,
        (now, departs_at): (Timestamp, Timestamp),
    ) -> Option<f64> {
        if let Some(flight) = &self.flight {
            let (_, way) = flight.version.as_ref()?;
            let until_departure = flight.departs_at.duration_since(now);
            return Some(until_departure.as_secs_f64() + way.flight_time_s);
        }
        let told = &self.told;
        let has_path = !told.path.nodes.is_empty();
        let waits_s = departs_at.duration_since(now).as_secs_f64().max(0.0);
        has_path.then(|| {
            waits_s + flight_time_s(topology, &told.path, told.first_stretch_m, airspeed_mps)
        })
    }

    /// Warns of what its drone has to know: that it draws on the reserve, or comes too late by nominal times.
    pub(crate) fn warn(
        &self,
        report: &wire::FailureReport,
        remaining_time_s: Option<f64>,
        now: Timestamp,
        read: &mut Vec<ReadWarning>,
    ) {
        if let Some(flight) = &self.flight {
            let version = flight.version.as_ref();
            if version.is_some_and(|(version, _)| version.reserve_used) {
                let message = "the plan draws on the reserve of the battery, to reach a safe node";
                read.push(ReadWarning::new("reserve_used", message));
            }
            return;
        }
        let deadline = report
            .deadline
            .as_deref()
            .and_then(|text| text.parse::<Timestamp>().ok());
        if let (Some(deadline), Some(time_s)) = (deadline, remaining_time_s)
            && later(now, time_s) > deadline
        {
            read.push(ReadWarning {
                code: "deadline_missed",
                message: format!(
                    "at nominal speed the path takes {time_s:.0} s and ends after {deadline}"
                ),
            });
        }
    }

    /// Whether other plans and the wind made a difference to it.
    pub(crate) fn depends_on_traffic(&self) -> bool {
        self.flight.is_some()
    }

    /// How many legs it has with all that is computed of them.
    pub(crate) fn flown_legs(&self) -> usize {
        let flight = self.flight.as_ref();
        let version = flight.and_then(|flight| flight.version.as_ref());
        version.map_or(0, |(_, way)| way.legs.len())
    }
}

/// As what a version is sent, and when.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sent {
    pub(crate) number: u32,
    pub(crate) epoch: u64,
    pub(crate) at: Timestamp,
    pub(crate) acknowledge_by: Option<Timestamp>,
}

impl Version {
    /// The version that an answer makes: the course to fly, with what is told of it.
    pub(crate) fn of(
        course: Course,
        told: &Recomposition,
        topology: &Topology,
        sent: Sent,
    ) -> Self {
        let warnings = told.warnings.iter().map(|warning| {
            let (code, message) = warning_text(topology, warning);
            (code.into(), message)
        });
        Self {
            number: sent.number,
            epoch: sent.epoch,
            sent_at: sent.at,
            outcome: Some(told.outcome),
            composition: course.composition,
            flight: course.flight,
            stretch: course.stretch,
            first_stretch_m: told.first_stretch_m,
            departs_at: course.departs_at,
            stops: course.stops.into(),
            recomposition_id: None,
            acknowledge_by: sent.acknowledge_by,
            flags: told.flags.iter().map(|&flag| flag.into_term()).collect(),
            warnings: warnings.collect(),
        }
    }
}
