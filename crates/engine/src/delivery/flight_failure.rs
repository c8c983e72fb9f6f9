//! A failure in flight as it is asked, and its answer.

use super::composition::{FlightComposition, Proof};
use super::landing::Landing;
use crate::flight::FlightRules;
use crate::itinerary::{FlightCause, FlightOpening, FlightRequest, Objective};
use crate::network::NodeIx;
use crate::recompose::{
    Fallback, Flag, Near, Outcome, Request, Stage, Strategy, UnsafeWay, Warning,
};

/// What is known of the battery of a drone in flight, as fractions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BatteryNow {
    /// It says so.
    Given(f64),
    /// Nothing says so: a drone that has to land is taken to have this much.
    Assumed(f64),
    /// By its plan: at the start and at the end of the leg.
    ByPlan {
        /// At the start.
        before: f64,
        /// At the end.
        after: f64,
    },
}

/// A failure report with what it takes to answer it by a flight.
#[derive(Clone, Copy, Debug)]
pub struct FlightFailure<'a> {
    /// The report, what it brings, and the strategy to answer it with.
    pub request: &'a Request,
    /// When it is, in seconds.
    pub at_s: f64,
    /// The battery.
    pub battery: BatteryNow,
    /// What is made least.
    pub objective: Objective,
    /// The latest landing, in seconds; [`DEFAULT_DEADLINE_S`](super::DEFAULT_DEADLINE_S) from now where there is none.
    pub deadline_s: Option<f64>,
    /// Where the old plan was going to stop, if anybody knows; else where it would have.
    pub planned_stops: Option<&'a [NodeIx]>,
    /// Where the drone has to land, of which nothing that it reports shows that it can fly on.
    pub landing: Option<Landing>,
}

impl FlightFailure<'_> {
    /// Whether the battery of an answer is known: what a plan has is what a drone that has to land does not have.
    pub(super) fn is_energy_known(&self) -> bool {
        self.landing.is_none() || matches!(self.battery, BatteryNow::Given(_))
    }

    /// The least battery to land with: the floor, but for who has to come down, or whose battery is unknown.
    pub(super) fn least_at_landing(&self, rules: &FlightRules) -> f64 {
        match (self.landing, self.is_energy_known()) {
            (Some(Landing::FreePad), true) => rules.floor,
            _ => FlightRequest::NO_RESERVE,
        }
    }
}

/// A wait on a pad, where the way is not open yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// Where.
    pub node: NodeIx,
    /// On which pad, counted from 0.
    pub pad: u16,
    /// Until when, in seconds.
    pub until_s: f64,
}

/// What a drone in flight is told, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightRecomposition {
    /// What it is to do.
    pub outcome: Outcome,
    /// The plan, to the destination or to an alternate; `None` for [`Outcome::NoRoute`].
    pub composition: Option<FlightComposition>,
    /// For [`Outcome::Hold`], where it waits.
    pub hold: Option<Hold>,
    /// True where the plan draws on the reserve, to reach an alternate.
    pub reserve_used: bool,
    /// Where the destination cannot be reached, what cuts the drone off; [`severance`](super::severance) names closures.
    pub causes: Vec<FlightCause>,
    /// The plan that there would be but for the deadline.
    pub opens: Option<FlightOpening>,
    /// The deadline that was kept, in seconds.
    pub deadline_s: f64,
    /// The battery when it reported, as a fraction.
    pub battery: f64,
    /// From where the drone is to the first node of the plan, in metres.
    pub first_stretch_m: f64,
    /// What holds of the way told; rising.
    pub flags: Vec<Flag>,
    /// False where it is unknown whether the battery suffices.
    pub is_energy_checked: bool,
    /// Without a plan: the least bad way.
    pub unsafe_way: Option<UnsafeWay>,
    /// Without a plan: what is near, the nearest first.
    pub near: Vec<Near>,
    /// Where it is unknown whether the drone is in the air: what one is told that is.
    pub if_airborne: Option<Box<FlightRecomposition>>,
    /// How certain it is that no plan is better, or that there is none.
    pub proof: Proof,
    /// The strategy asked for.
    pub strategy: Strategy,
    /// The strategy that answered.
    pub strategy_used: Strategy,
    /// Why they differ.
    pub fallback: Option<Fallback>,
    /// Where the search that answered looked.
    pub stage: Stage,
    /// The stages of a local strategy whose answers this drone cannot fly.
    pub unflyable_stages: Vec<Stage>,
    /// What the receiver should know.
    pub warnings: Vec<Warning>,
}
