//! An order and what becomes of it.

use super::money::Money;
use crate::id::Id;
use serde::{Deserialize, Serialize};

/// How a delivery stands. `delivered`, `diverted`, `returned`, `failed` and `cancelled` are final.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Serialize,
    Deserialize,
    utoipa::ToSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum DeliveryStatus {
    /// Ordered; no drone is assigned yet.
    Created,
    /// Its flight is planned, and its drone is not named yet.
    Scheduled,
    /// A drone is assigned, and its plan accepted by an edge.
    Assigned,
    /// The drone flies to the pickup.
    PickingUp,
    /// The drone flies with the parcel.
    InFlight,
    /// The drone waits on a pad until its way opens.
    Holding,
    /// The drone flies back with the parcel.
    Returning,
    /// The parcel is at its destination.
    Delivered,
    /// The drone has landed elsewhere, with the parcel.
    Diverted,
    /// The parcel is back where it came from.
    Returned,
    /// It could not be done; `reason` says why.
    Failed,
    /// It was called off.
    Cancelled,
}

impl DeliveryStatus {
    /// Every status.
    pub const ALL: [Self; 12] = [
        Self::Created,
        Self::Scheduled,
        Self::Assigned,
        Self::PickingUp,
        Self::InFlight,
        Self::Holding,
        Self::Returning,
        Self::Delivered,
        Self::Diverted,
        Self::Returned,
        Self::Failed,
        Self::Cancelled,
    ];

    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Created => "created",
            Self::Scheduled => "scheduled",
            Self::Assigned => "assigned",
            Self::PickingUp => "picking_up",
            Self::InFlight => "in_flight",
            Self::Holding => "holding",
            Self::Returning => "returning",
            Self::Delivered => "delivered",
            Self::Diverted => "diverted",
            Self::Returned => "returned",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }

    /// Whether nothing follows it.
    pub fn is_final(self) -> bool {
        matches!(
            self,
            Self::Delivered | Self::Diverted | Self::Returned | Self::Failed | Self::Cancelled
        )
    }
}

/// Who receives a parcel. Kept apart from the delivery, told to the customer alone, and gone when the customer's data are
/// deleted.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Recipient {
    /// Name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 200)]
    pub name: Option<String>,
    /// Telephone number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 64)]
    pub phone: Option<String>,
    /// What the person who hands the parcel out should know.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 500)]
    pub note: Option<String>,
}

/// An order: the body of `POST /v1/deliveries`. Either a quote that is accepted, or a request that the registry fills.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct DeliveryOrder {
    /// The quote that is accepted. With it nothing else is stated of the flight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quote_id: Option<String>,
    /// The service; the cheapest that fits where none is named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub service_id: Option<String>,
    /// The network.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub network: Option<String>,
    /// The node of the pickup.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<Id<'static>>,
    /// The node of the drop.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub destination: Option<Id<'static>>,
    /// Payload in kilograms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 100)]
    pub payload_kg: Option<f64>,
    /// When it may be picked up, RFC 3339, at most 7 days ahead; now where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub start_time: Option<String>,
    /// The latest arrival, RFC 3339, at most 7 days after the earliest pickup. A delivery that no drone can be assigned
    /// to by then has failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub arrive_by: Option<String>,
    /// The dearest price.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub price_max: Option<Money>,
    /// The customer's own number for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 128)]
    pub reference: Option<String>,
    /// Who receives it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recipient: Option<Recipient>,
    /// For whom it is ordered; the caller's own tenant where none is named, and only operators name another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 64)]
    pub customer: Option<String>,
}

/// A change of status.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct DeliveryChange {
    /// The status from then on.
    pub status: DeliveryStatus,
    /// When, RFC 3339.
    #[schema(format = DateTime)]
    pub at: String,
    /// Why, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The version of the plan that was flown then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan_version: Option<u32>,
}

/// A recomposition of its flight.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct RecomposedFlight {
    /// When, RFC 3339.
    #[schema(format = DateTime)]
    pub at: String,
    /// The version of the plan that came of it.
    pub plan_version: u32,
    /// What the drone was told to do: `rerouted`, `hold`, `diverted`, `no_route`.
    pub outcome: String,
    /// Ids of the zones and closures that it was for; none where it was the wind, or the drone itself.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub causes: Vec<String>,
    /// When the parcel is expected since, RFC 3339.
    #[schema(format = DateTime)]
    pub expected_at: String,
}

/// Which drone flies a delivery, and where its plan is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct AllocatedDrone {
    /// The drone.
    pub drone_id: String,
    /// The edge that has its plan.
    pub edge: String,
    /// The plan there.
    pub plan_id: String,
    /// What fetching, flying and returning cost, in metres of flight, by which it was chosen.
    pub cost_m: f64,
    /// Why this drone, in words.
    pub explanation: String,
}

/// That a parcel has arrived.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ProofOfDelivery {
    /// When, RFC 3339.
    #[schema(format = DateTime)]
    pub at: String,
    /// Longitude in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lon: Option<f64>,
    /// Latitude in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lat: Option<f64>,
    /// Where a photo is kept.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 500)]
    pub photo: Option<String>,
    /// The code that the recipient gave.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 64)]
    pub code: Option<String>,
}

/// A delivery. Who is no party to it does not see it; operators see it without price and recipient.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Delivery {
    /// Its id.
    pub id: String,
    /// Who ordered.
    pub customer: String,
    /// Who flies; absent until a service is chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provider: Option<String>,
    /// The service; absent until one is chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub service_id: Option<String>,
    /// The quote that was accepted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quote_id: Option<String>,
    /// The customer's own number for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<String>,
    /// The network.
    pub network: String,
    /// The node of the pickup.
    pub source: Id<'static>,
    /// The node of the drop.
    pub destination: Id<'static>,
    /// Payload in kilograms.
    pub payload_kg: f64,
    /// How it stands.
    pub status: DeliveryStatus,
    /// Why it stands so, or what it waits for, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// When it was ordered, RFC 3339.
    #[schema(format = DateTime)]
    pub created_at: String,
    /// When it may be picked up, RFC 3339.
    #[schema(format = DateTime)]
    pub start_time: String,
    /// The latest arrival that was asked for, RFC 3339.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub arrive_by: Option<String>,
    /// When its arrival was promised for, RFC 3339.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub promised_at: Option<String>,
    /// When it is expected now, RFC 3339; absent before it has a drone and once it is over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub expected_at: Option<String>,
    /// The dearest price that was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub price_max: Option<Money>,
    /// What it costs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub price: Option<Money>,
    /// Which drone flies it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub allocation: Option<AllocatedDrone>,
    /// Every status that it has had, the first first.
    pub history: Vec<DeliveryChange>,
    /// Every recomposition of its flight; at most the last 100.
    pub recompositions: Vec<RecomposedFlight>,
    /// That it has arrived.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub proof: Option<ProofOfDelivery>,
    /// Who receives it; told to the customer alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recipient: Option<Recipient>,
}

/// A page of deliveries, by id.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Deliveries {
    /// The deliveries.
    pub deliveries: Vec<Delivery>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
}

/// What a customer sees of a flight: an event of `GET /v1/deliveries/{id}/track`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct DeliveryTrack {
    /// The delivery.
    pub id: String,
    /// How it stands.
    pub status: DeliveryStatus,
    /// Why, or what it waits for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// When it is expected, RFC 3339.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub expected_at: Option<String>,
    /// Where its drone was last, while it flies for this delivery.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<super::FleetPosition>,
}
