//! Who delivers, with what, and for whom: providers, their drones and services, customers.

use crate::id::Id;
use rust_decimal::Decimal;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Whether a provider's services are offered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ProviderState {
    /// They are.
    #[default]
    Active,
    /// They are not; what was ordered goes on. Where an operator has suspended it, an operator alone lifts that.
    Suspended,
}

/// Who runs drones and sells deliveries: the body of `PUT /v1/providers/{id}`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Provider {
    /// Its id, which is its tenant; the path has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(min_length = 1, max_length = 64)]
    pub id: Option<String>,
    /// Its name, for people.
    #[schema(min_length = 1, max_length = 200)]
    pub name: String,
    /// How operators reach it. Told to itself and to operators alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 500)]
    pub contact: Option<String>,
    /// Whether its services are offered.
    #[serde(default)]
    pub state: ProviderState,
}

/// A page of providers, by id.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Providers {
    /// The providers.
    pub providers: Vec<Provider>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
}

/// How a drone of a fleet stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FleetDroneState {
    /// It stands at its home node and may be assigned.
    #[default]
    Available,
    /// A delivery is assigned to it.
    Assigned,
    /// It flies.
    InFlight,
    /// It charges.
    Charging,
    /// Its provider has taken it out of service.
    OutOfService,
}

/// A drone of a provider: the body of `PUT /v1/drones/{id}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FleetDrone {
    /// Its id, `PROVIDER:NAME`; the path has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 128)]
    pub id: Option<String>,
    /// The network that it flies over.
    pub network: String,
    /// The node where it is based.
    pub home: Id<'static>,
    /// Name of its airframe, as the edges of the network know it; their default where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 64)]
    pub airframe: Option<String>,
    /// The heaviest payload in kilograms.
    #[schema(exclusive_minimum = 0, maximum = 100)]
    pub payload_max_kg: f64,
    /// What its battery holds of what it held when new, from 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 1)]
    pub battery_health_fraction: Option<f64>,
    /// Until when it is in maintenance, RFC 3339: not assigned before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub maintenance_until: Option<String>,
    /// How it stands. A provider states `available`, `charging` or `out_of_service`; the rest follows from its flights.
    #[serde(default)]
    pub state: FleetDroneState,
    /// The delivery that is assigned to it. Read-only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delivery_id: Option<String>,
    /// When it is back from that delivery, RFC 3339, as its edge expected when it took the flight on. Read-only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub free_at: Option<String>,
    /// Where it was last, by telemetry. Read-only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last: Option<FleetPosition>,
}

/// Where a drone was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FleetPosition {
    /// When, RFC 3339.
    #[schema(format = DateTime)]
    pub at: String,
    /// Longitude in degrees.
    pub lon: f64,
    /// Latitude in degrees.
    pub lat: f64,
    /// What was in its battery, from 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub battery_fraction: Option<f64>,
}

/// A page of drones, by id.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct FleetDrones {
    /// The drones.
    pub drones: Vec<FleetDrone>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
}

/// When a service is open, in its own time zone.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct OpeningHours {
    /// On which days: `MON` to `SUN`; on all where none is named.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(max_items = 7)]
    pub days: Vec<String>,
    /// From when, `HH:MM`.
    pub from: String,
    /// Until when, `HH:MM`; before `from`: until the next day. `24:00` is the end of the day.
    pub until: String,
}

/// What a delivery costs: the sum of its parts, rounded half up to the currency's minor unit, and `minimum` at least.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ServiceTariff {
    /// The currency: three letters of ISO 4217.
    #[schema(min_length = 3, max_length = 3)]
    pub currency: String,
    /// Of every delivery.
    #[serde(with = "rust_decimal::serde::str")]
    #[schema(value_type = String)]
    pub base: Decimal,
    /// Of each kilometre from pickup to drop.
    #[serde(default, with = "rust_decimal::serde::str")]
    #[schema(value_type = String)]
    pub per_km: Decimal,
    /// Of each kilogram and kilometre.
    #[serde(default, with = "rust_decimal::serde::str")]
    #[schema(value_type = String)]
    pub per_kg_km: Decimal,
    /// Of each minute from pickup to drop.
    #[serde(default, with = "rust_decimal::serde::str")]
    #[schema(value_type = String)]
    pub per_minute: Decimal,
    /// The least that a delivery costs.
    #[serde(default, with = "rust_decimal::serde::str")]
    #[schema(value_type = String)]
    pub minimum: Decimal,
}

/// What a provider promises of a service.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ServiceQuality {
    /// The share of its deliveries that come in time, from 0 to 1.
    #[schema(minimum = 0, maximum = 1)]
    pub on_time_fraction: f64,
    /// How late one still counts as in time, in seconds.
    #[serde(default)]
    #[schema(minimum = 0, maximum = 86400)]
    pub tolerance_s: f64,
}

/// A service that a provider publishes: the body of `PUT /v1/services/{id}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PublishedService {
    /// Its id; the path has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 128)]
    pub id: Option<String>,
    /// Whose it is; that of the caller where a provider publishes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 64)]
    pub provider: Option<String>,
    /// Its name, for people.
    #[schema(min_length = 1, max_length = 200)]
    pub name: String,
    /// The network that it flies over.
    pub network: String,
    /// Where it picks up and drops: a GeoJSON `Polygon` or `MultiPolygon`; anywhere on the network where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Object>)]
    pub area: Option<Value>,
    /// Name of the airframe that flies it; any where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 64)]
    pub airframe: Option<String>,
    /// The heaviest payload in kilograms.
    #[schema(exclusive_minimum = 0, maximum = 100)]
    pub payload_max_kg: f64,
    /// The time zone of its hours, by its IANA name.
    #[schema(max_length = 64)]
    pub time_zone: String,
    /// When it picks up; always where none are given.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(max_items = 28)]
    pub hours: Vec<OpeningHours>,
    /// What it costs.
    pub tariff: ServiceTariff,
    /// What is promised.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quality: Option<ServiceQuality>,
    /// From when it is offered, RFC 3339; at once where none is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub valid_from: Option<String>,
    /// Until when it is offered, RFC 3339.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub valid_until: Option<String>,
}

/// A page of services, by id.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct PublishedServices {
    /// The services.
    pub services: Vec<PublishedService>,
    /// Where the next page begins; absent on the last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_page_token: Option<String>,
}

/// Who orders: the body of `PUT /v1/customers/{id}`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Customer {
    /// Its id, which is its tenant; the path has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(min_length = 1, max_length = 64)]
    pub id: Option<String>,
    /// Its name, for people.
    #[schema(min_length = 1, max_length = 200)]
    pub name: String,
    /// How it is reached. Told to itself alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 500)]
    pub contact: Option<String>,
}

/// All that is kept of a customer: the answer of `GET /v1/customers/{id}/data`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct CustomerData {
    /// The customer; absent where nothing is kept of it but its orders.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub customer: Option<Customer>,
    /// Its deliveries with recipients and proofs, oldest first; at most 1,000.
    pub deliveries: Vec<super::Delivery>,
    /// Its quotes that are kept yet; at most 1,000.
    pub quotes: Vec<super::Quote>,
    /// Its webhooks.
    pub webhooks: Vec<super::Webhook>,
    /// Whether there are more deliveries or quotes than these.
    pub is_cut_off: bool,
}
