//! What a drone can do and what it says: airframes, energy, wind, batteries, legs, plans, failure reports.
//!
//! Energy is told as a fraction of the battery, times in seconds on one clock that everything of a request
//! shares. `docs/flight-model.md` has the formulas and where they are off.

mod airframe;
mod battery;
mod course;
mod crossings;
mod figure;
mod first_stretch;
mod legs;
mod place;
mod plan;
mod report;
mod rules;
mod situation;
mod tariff;
mod vertical;
mod wind;

pub use airframe::{Airframe, AirframeFault, LegCost, PowerModel, Unflyable};
pub use battery::Charging;
pub use course::{Corner, LegCourse, crossing_height};
pub use crossings::{Crossing, Crossings, SharedCrossings, Stretch, keeps_clear_of_crossings};
pub use figure::{Figure, FigureRange};
pub use first_stretch::{FirstStretch, Reentry, StretchKind, StretchLeg};
pub use legs::{FlightLeg, FlightLegs};
pub use place::{FASTEST_MPS, ImpossiblePlace, LastPlace, check_place};
pub use plan::{FlightPlan, FlightStart, FlownLeg, ServiceStop, Stop, StopKind};
pub use report::{
    Aloft, Circumstances, DEFAULT_AIRSPEED_MPS, DEFAULT_BRAKING_MPS2, DEFAULT_REACTION_S,
    FailedPads, FailureReport, FailureType, Location, OperationalDetail,
};
pub use rules::FlightRules;
pub use situation::{Reservation, Situation, TimedClosure, TrafficLeg};
pub use tariff::Tariff;
pub use vertical::{Climbs, Vertical};
pub use wind::{Wind, WindField, WindPatch};
