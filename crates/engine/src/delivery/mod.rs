//! Deliveries that a drone can really fly: composed with times, battery and pads, and answered when they fail.
//!
//! [`FlightEnvironment`] compiles one state of the world, a [`FlightSetting`](crate::itinerary::FlightSetting) what a drone makes of it;
//! both are immutable and serve any number of requests. [`compose`] makes the plan of a delivery, each leg with what to do when it
//! closes; [`answer_failure`] answers a drone in flight. Nothing here asks the time: instants are seconds from [`FlightEnvironment::zero`].

mod brought;
mod case;
mod composition;
mod contingency;
mod failure;
mod flight_failure;
mod grounded;
mod in_flight;
mod landing;
mod local;
mod nearby;
mod skies;
mod standing;
mod stops;
mod tables;
mod unaffected;
mod world;

pub use brought::with_airframe;
pub use composition::{
    DeliveryRequest, DroneDeliveryService, FlightComposition, NoDelivery, Proof, QualityOfService,
    compose,
};
pub use contingency::{Alternate, FlownDetour, LegContingency, contingencies_of};
pub use failure::{answer_failure, severance};
pub use flight_failure::{BatteryNow, FlightFailure, FlightRecomposition, Hold};
pub use landing::{Landing, ReportedFigures, Trouble};
pub use skies::{FlightEnvironment, OtherPlans};
pub use standing::{Stand, answer_standing};
pub use stops::{Lands, compose_with_stops};
pub use tables::FlightTables;
pub use world::{DEFAULT_DEADLINE_S, DEFAULT_REFUGE_STAY_S, DeliveryScratch, DeliveryWorld};
