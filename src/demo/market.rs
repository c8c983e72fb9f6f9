//! What the demo's provider and customers tell the registry: who they are, and what is offered.

use super::client::{Client, ClientError};
use super::drone::AIRFRAME;
use super::map::Map;
use super::script::PlannedOrder;
use crate::wire;
use serde_json::{Value, json};
use std::net::SocketAddr;

/// Who runs the drones.
const PROVIDER: &str = "harbour";
const SERVICE: &str = "harbour:express";
/// Who orders by the script.
pub(super) const SHOP: &str = "corner-shop";
/// Who orders on the page.
pub(super) const READER: &str = "local";
/// What a drone carries at most.
const PAYLOAD_MAX_KG: f64 = 1.0;

/// The registry of the demo, as those see it who deal there.
#[derive(Debug)]
pub(super) struct Market {
    registry: Client,
    network: String,
}

impl Market {
    /// The market over a network of the registry at a base URL.
    pub(super) fn at(base_url: &str, network: &str) -> Result<Self, ClientError> {
        Ok(Self {
            registry: Client::new(base_url)?,
            network: network.to_owned(),
        })
    }

    /// Says who there is, as often as needed: a provider with drones and a service, two customers, and where these are told.
    pub(super) async fn open(
        &self,
        map: &Map,
        fleet: &[(String, usize)],
        receiver: SocketAddr,
    ) -> Result<(), ClientError> {
        let registry = &self.registry;
        let provider = wire::Provider {
            id: None,
            name: "Harbour Air".to_owned(),
            contact: None,
            state: wire::ProviderState::Active,
        };
        let path = format!("/v1/providers/{PROVIDER}");
        registry.put(&path, &provider).await?;
        let path = format!("/v1/services/{SERVICE}");
        registry.put(&path, &self.service()).await?;
        for (drone_id, home) in fleet {
            self.put_drone(drone_id, map.id(*home)).await?;
        }
        for (id, name) in [(SHOP, "The corner shop"), (READER, "You")] {
            let customer = wire::Customer {
                id: None,
                name: name.to_owned(),
                contact: None,
            };
            registry
                .put(&format!("/v1/customers/{id}"), &customer)
                .await?;
            let webhook = wire::WebhookDraft {
                url: format!("http://{receiver}/{id}"),
                events: vec!["delivery.delivered".to_owned()],
            };
            let path = format!("/v1/webhooks/{id}:demo");
            registry.put(&path, &webhook).await?;
        }
        Ok(())
    }

    /// Says that a drone stands at home and may be assigned.
    pub(super) async fn put_drone(
        &self,
        drone_id: &str,
        home: &wire::Id<'static>,
    ) -> Result<(), ClientError> {
        let drone = wire::FleetDrone {
            id: None,
            network: self.network.clone(),
            home: home.clone(),
            airframe: Some(AIRFRAME.to_owned()),
            payload_max_kg: PAYLOAD_MAX_KG,
            battery_health_fraction: None,
            maintenance_until: None,
            state: wire::FleetDroneState::Available,
            delivery_id: None,
            free_at: None,
            last: None,
        };
        let path = format!("/v1/drones/{drone_id}");
        self.registry.put(&path, &drone).await
    }

    /// The id of a drone of the provider.
    pub(super) fn drone_id(number: usize) -> String {
        format!("{PROVIDER}:{number}")
    }

    /// Orders for the shop what an edge can compose; none where nothing is offered.
    pub(super) async fn order(
        &self,
        map: &Map,
        planned: &PlannedOrder,
        reference: &str,
    ) -> Result<Option<wire::Delivery>, ClientError> {
        let [source, destination] = planned.ends.map(|node| map.id(node).clone());
        let search = wire::ServiceSearch {
            network: self.network.clone(),
            source: source.clone(),
            destination: destination.clone(),
            payload_kg: planned.payload_kg,
            start_time: None,
            arrive_by: None,
            price_max: None,
            on_time_min_fraction: None,
            rank_by: wire::OfferRank::Price,
        };
        let found: wire::ServiceOffers = self.registry.post("/v1/services:search", &search).await?;
        let Some(offer) = found.offers.into_iter().next() else {
            return Ok(None);
        };
        let order = wire::DeliveryOrder {
            service_id: Some(offer.service_id),
            network: Some(self.network.clone()),
            source: Some(source),
            destination: Some(destination),
            payload_kg: Some(planned.payload_kg),
            reference: Some(reference.to_owned()),
            customer: Some(SHOP.to_owned()),
            ..wire::DeliveryOrder::default()
        };
        self.registry.post("/v1/deliveries", &order).await.map(Some)
    }

    fn service(&self) -> Value {
        json!({
            "provider": PROVIDER,
            "name": "Harbour express",
            "network": self.network,
            "airframe": AIRFRAME,
            "payload_max_kg": PAYLOAD_MAX_KG,
            "time_zone": "Australia/Sydney",
            "tariff": {
                "currency": "AUD", "base": "4.50", "per_km": "1.80", "per_kg_km": "0.60", "minimum": "6.00",
            },
            "quality": {"on_time_fraction": 0.95, "tolerance_s": 120.0},
        })
    }
}
