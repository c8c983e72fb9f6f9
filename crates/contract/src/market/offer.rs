//! What a customer looks for, and what is offered.

use super::money::Money;
use crate::id::Id;
use serde::{Deserialize, Serialize};

/// By what offers are put in order; the best first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OfferRank {
    /// The cheapest.
    #[default]
    Price,
    /// The earliest arrival.
    Arrival,
    /// The largest share of deliveries in time, as measured; as promised where nothing is measured yet.
    Reliability,
}

/// What is looked for: the body of `POST /v1/services:search`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ServiceSearch {
    /// The network.
    pub network: String,
    /// The node of the pickup.
    pub source: Id<'static>,
    /// The node of the drop.
    pub destination: Id<'static>,
    /// Payload in kilograms.
    #[serde(default)]
    #[schema(minimum = 0, maximum = 100)]
    pub payload_kg: f64,
    /// When it may be picked up, RFC 3339, at most 7 days ahead; now where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub start_time: Option<String>,
    /// The latest arrival, RFC 3339, at most 7 days after the earliest pickup.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub arrive_by: Option<String>,
    /// The dearest price.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub price_max: Option<Money>,
    /// The least share of deliveries in time that is promised, from 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 1)]
    pub on_time_min_fraction: Option<f64>,
    /// In which order.
    #[serde(default)]
    pub rank_by: OfferRank,
}

/// A service that fits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ServiceOffer {
    /// The service.
    pub service_id: String,
    /// Its name.
    pub name: String,
    /// Who flies.
    pub provider: String,
    /// What it would cost, by the shortest way over the network; a quote is exact.
    pub price: Money,
    /// When it would be picked up at the earliest, RFC 3339.
    #[schema(format = DateTime)]
    pub pickup_at: String,
    /// When it would arrive, RFC 3339.
    #[schema(format = DateTime)]
    pub arrives_at: String,
    /// How far it is from pickup to drop, in metres.
    pub length_m: f64,
    /// How many of its drones could be sent now.
    pub drones: u32,
    /// The share of deliveries in time that is promised.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub promised_on_time_fraction: Option<f64>,
    /// The share of its deliveries in time, as measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured_on_time: Option<super::Share>,
    /// Why it fits, in words.
    pub reasons: Vec<String>,
}

/// A service that does not fit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct PassedOver {
    /// The service.
    pub service_id: String,
    /// Why not: `area`, `payload`, `hours`, `validity`, `suspended`, `price`, `currency`, `arrival`, `quality`, `no_drone`, `no_way`.
    pub code: String,
    /// The same in words.
    pub text: String,
}

/// What is offered: the answer of `POST /v1/services:search`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ServiceOffers {
    /// What fits, the best first; at most 100.
    pub offers: Vec<ServiceOffer>,
    /// What does not, by id; at most 100.
    pub passed_over: Vec<PassedOver>,
}

/// What a price is asked for: the body of `POST /v1/quotes`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct QuoteRequest {
    /// The service.
    pub service_id: String,
    /// The node of the pickup.
    pub source: Id<'static>,
    /// The node of the drop.
    pub destination: Id<'static>,
    /// Payload in kilograms.
    #[serde(default)]
    #[schema(minimum = 0, maximum = 100)]
    pub payload_kg: f64,
    /// When it may be picked up, RFC 3339, at most 7 days ahead; now where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub start_time: Option<String>,
    /// The latest arrival, RFC 3339, at most 7 days after the earliest pickup.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub arrive_by: Option<String>,
    /// Who may accept it; the caller's own tenant where none is named, and only operators name another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 64)]
    pub customer: Option<String>,
}

/// An offer that holds: composed at an edge, with the wind, the pads and the traffic there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Quote {
    /// Its id.
    pub id: String,
    /// What was asked.
    pub request: QuoteRequest,
    /// Who asked.
    pub customer: String,
    /// Who flies.
    pub provider: String,
    /// The network.
    pub network: String,
    /// What it costs.
    pub price: Money,
    /// When it is picked up, RFC 3339.
    #[schema(format = DateTime)]
    pub pickup_at: String,
    /// When it arrives, RFC 3339.
    #[schema(format = DateTime)]
    pub arrives_at: String,
    /// How far it is from pickup to drop, in metres.
    pub length_m: f64,
    /// The edge that composed it.
    pub edge: String,
    /// Until when it can be accepted, RFC 3339.
    #[schema(format = DateTime)]
    pub expires_at: String,
}
