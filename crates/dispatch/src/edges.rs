//! What is asked of edges: a flight composed, taken on, called off.
//!
//! An edge decides; the registry never guesses. What it has refused is told apart from what it has not answered: then
//! it is unknown whether it was done, and it is asked again under the same id.

use jiff::Timestamp;
use skyway_contract::{DeliveryRequest, EndedAs, Id, Plan, PlanState, ServiceStop};
use std::fmt::Debug;
use std::pin::Pin;
use thiserror::Error;

/// What an edge answers, once it does.
pub type EdgeAnswer<'a, T> = Pin<Box<dyn Future<Output = Result<T, EdgeError>> + Send + 'a>>;

/// Why an edge did not do what it was asked to.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum EdgeError {
    /// It refuses, and would again.
    #[error("{detail}")]
    Refused {
        /// The code of its problem.
        code: String,
        /// What it says.
        detail: String,
    },
    /// It has not answered, or cannot just now: whether it has done it is not known.
    #[error("{detail}")]
    NotAnswered {
        /// Why not.
        detail: String,
    },
}

/// An edge, and where it is reached.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EdgeAddress {
    /// Its id.
    pub id: String,
    /// Its URL.
    pub url: String,
}

/// A flight that is asked for: from a drone's home by way of pickup and drop back home.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightRequest {
    /// The id of its plan; the edge makes one where none is given.
    pub plan_id: Option<String>,
    /// The drone; without one it is a quote.
    pub drone_id: Option<String>,
    /// The delivery that it is flown for.
    pub delivery_id: Option<String>,
    /// Where it begins and ends.
    pub home: String,
    /// The node of the pickup.
    pub pickup: String,
    /// The node of the drop.
    pub drop: String,
    /// Payload in kilograms.
    pub payload_kg: f64,
    /// When it begins.
    pub start_time: Timestamp,
    /// Name of the airframe; the edge's default where none is given.
    pub airframe: Option<String>,
}

impl FlightRequest {
    /// The same as an edge reads it. A stop at home is left out: a flight begins and ends there anyway.
    pub fn body(&self) -> DeliveryRequest {
        let stops = [&self.pickup, &self.drop].into_iter();
        let stops = stops.filter(|node| **node != self.home);
        let stops = stops.map(|node| ServiceStop {
            node: Id::new(node.clone()),
            service_s: 0.0,
        });
        DeliveryRequest {
            id: self.plan_id.clone(),
            source: Id::new(self.home.clone()),
            destination: Some(Id::new(self.home.clone())),
            stops: Some(stops.collect()),
            start_time: Some(self.start_time.to_string()),
            payload_kg: Some(self.payload_kg),
            drone_id: self.drone_id.clone(),
            airspeed_mps: None,
            airframe: self.airframe.clone(),
            battery_fraction: None,
            objective: None,
            deadline: None,
            priority: None,
            delivery_id: self.delivery_id.clone(),
        }
    }
}

/// A flight that an edge has composed.
#[derive(Clone, Debug, PartialEq)]
pub struct ComposedFlight {
    /// How its plan stands.
    pub state: PlanState,
    /// What became of it.
    pub ended_as: Option<EndedAs>,
    /// The newest version of its plan.
    pub version: u32,
    /// When the parcel is picked up.
    pub pickup_at: Timestamp,
    /// When it is dropped.
    pub drop_at: Timestamp,
    /// When the drone is where the flight ends.
    pub ends_at: Timestamp,
    /// From pickup to drop, in metres.
    pub carried_m: f64,
    /// From the departure at the pickup to the drop, in seconds.
    pub carried_s: f64,
}

impl ComposedFlight {
    /// Reads the plan of a flight.
    ///
    /// # Errors
    /// When it does not serve the stops that were asked for.
    pub fn read(request: &FlightRequest, plan: &Plan<'_>) -> Result<Self, EdgeError> {
        let newest = plan.wanted.as_ref().unwrap_or(&plan.reported);
        let unfit = || EdgeError::Refused {
            code: "plan_unfit".to_owned(),
            detail: format!("the plan '{}' does not serve pickup and drop", plan.id),
        };
        let instant = |text: &str| text.parse::<Timestamp>().map_err(|_| unfit());
        let stops = newest.flight.iter().flat_map(|flight| &flight.stops);
        let mut served = stops.filter(|stop| stop.service_s.is_some());
        let (pickup_at, departs_at, first_leg) = if request.pickup == request.home {
            let departs_at = instant(&newest.departs_at)?;
            (departs_at, departs_at, 0)
        } else {
            let stop = served.next().ok_or_else(unfit)?;
            let (lands_at, departs_at) = (instant(&stop.lands_at)?, instant(&stop.takes_off_at)?);
            (lands_at, departs_at, stop.before_leg as usize)
        };
        let ends_at = instant(&newest.arrives_at)?;
        let (drop_at, end_leg) = if request.drop == request.home {
            (ends_at, newest.legs.len())
        } else {
            let stop = served.next().ok_or_else(unfit)?;
            (instant(&stop.lands_at)?, stop.before_leg as usize)
        };
        let legs = newest.legs.get(first_leg..end_leg).ok_or_else(unfit)?;
        Ok(Self {
            state: plan.state,
            ended_as: plan.ended_as,
            version: newest.version,
            pickup_at,
            drop_at,
            ends_at,
            carried_m: legs.iter().map(|leg| leg.length_m).sum(),
            carried_s: drop_at.duration_since(departs_at).as_secs_f64(),
        })
    }
}

/// What became of a flight that was to be called off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CalledOff {
    /// It will not be flown: its plan is cancelled.
    Cancelled,
    /// Its drone has departed: it goes on.
    Departed,
    /// It was over before.
    Over,
    /// The edge has no such plan: it never had it, or knows no more what became of it.
    Unknown,
}

/// A client of edges.
pub trait EdgeClient: Debug + Send + Sync {
    /// Whether an edge is asked anything at all.
    fn may_ask(&self, _edge: &EdgeAddress) -> bool {
        true
    }

    /// Composes a flight; with a drone the edge takes it on. One with an id is taken on once, however often it is asked for.
    fn compose<'a>(
        &'a self,
        edge: &'a EdgeAddress,
        request: &'a FlightRequest,
    ) -> EdgeAnswer<'a, ComposedFlight>;

    /// Calls off a flight whose drone has not departed.
    fn call_off<'a>(&'a self, edge: &'a EdgeAddress, plan_id: &'a str)
    -> EdgeAnswer<'a, CalledOff>;
}
