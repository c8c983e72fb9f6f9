//! What deliveries are computed in, and what is scribbled on.

use super::skies::FlightEnvironment;
use super::tables::FlightTables;
use crate::flight::{FlightStart, Tariff};
use crate::itinerary::{
    FlightDecision, FlightOrder, FlightSetting, ItineraryScratch, Limits, Objective, Potentials,
    decide,
};
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::recompose::Scratch;
use std::sync::Arc;

/// A plan without a deadline of its own has to land within this many seconds of its start.
pub const DEFAULT_DEADLINE_S: f64 = 9_000.0;
/// An alternate's pad has to be free for this many seconds from the landing on.
pub const DEFAULT_REFUGE_STAY_S: f64 = 1_800.0;

/// What a delivery is computed in. All of it is of one topology.
#[derive(Clone, Copy, Debug)]
pub struct DeliveryWorld<'a> {
    /// The state of the world.
    pub skies: &'a FlightEnvironment,
    /// The drone with its payload in the wind; its situation is that of the skies.
    pub setting: &'a FlightSetting,
    /// The tables of its destinations.
    pub tables: &'a FlightTables,
    /// What a delivery costs.
    pub tariff: Tariff,
    /// How long an alternate's pad has to be free, in seconds.
    pub refuge_stay_s: f64,
    /// What bounds each search.
    pub limits: Limits<'a>,
    /// Whether a plan comes with its contingencies: two searches for each leg. Else
    /// [`contingencies_of`](super::contingencies_of) works them out later.
    pub with_contingencies: bool,
}

/// The memory of compositions and answers on one topology. One thread uses it at a time.
#[derive(Debug)]
pub struct DeliveryScratch {
    pub(super) itinerary: ItineraryScratch,
    pub(super) recompose: Scratch,
}

impl DeliveryScratch {
    /// Room for deliveries on a topology.
    pub fn new(topology: &Topology) -> Self {
        Self {
            itinerary: ItineraryScratch::new(topology),
            recompose: Scratch::new(topology),
        }
    }
}

/// A question to the search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Question<'a> {
    pub(super) starts: &'a [FlightStart],
    pub(super) destination: NodeIx,
    pub(super) objective: Objective,
    pub(super) began_s: f64,
    pub(super) deadline_s: f64,
    /// The least battery at a node of the plan.
    pub(super) reserve: f64,
    pub(super) closed_segments: &'a [SegmentIx],
    pub(super) in_flight: bool,
    /// Whether somebody reads why there is no plan.
    pub(super) explain: bool,
}

impl DeliveryWorld<'_> {
    pub(super) fn decide(
        &self,
        question: &Question<'_>,
        scratch: &mut DeliveryScratch,
    ) -> FlightDecision {
        let order = FlightOrder {
            starts: question.starts,
            destination: question.destination,
            objective: question.objective,
            began_s: question.began_s,
            deadline_s: question.deadline_s,
            closed_segments: question.closed_segments,
            in_flight: question.in_flight,
            explain: question.explain,
            refuge_stay_s: self.refuge_stay_s,
            limits: self.limits,
        };
        let table = self.table(question);
        decide(self.setting, &order, &table, &mut scratch.itinerary)
    }

    /// What is left at least of any way to the destination of a question.
    pub(super) fn table(&self, question: &Question<'_>) -> Arc<Potentials> {
        self.tables
            .get(self.setting, question.destination, question.objective)
    }
}
