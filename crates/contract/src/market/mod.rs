//! The market: who delivers, what is offered, what was ordered, and what became of it.
//!
//! The roles are the paper's: providers list services in the registry, customers search it and order. The words of
//! an order are those of last-mile interfaces: quote, delivery, status, proof of delivery.

mod delivery;
mod directory;
mod money;
mod news;
mod offer;
mod statistics;
mod webhook;

pub use delivery::{
    AllocatedDrone, Deliveries, Delivery, DeliveryChange, DeliveryOrder, DeliveryStatus,
    DeliveryTrack, ProofOfDelivery, Recipient, RecomposedFlight,
};
pub use directory::{
    Customer, CustomerData, FleetDrone, FleetDroneState, FleetDrones, FleetPosition, OpeningHours,
    Provider, ProviderState, Providers, PublishedService, PublishedServices, ServiceQuality,
    ServiceTariff,
};
pub use money::Money;
pub use news::{
    EdgeNews, FailureNews, FlightNews, NewsEntry, NewsTaken, PositionBatch, PositionEntry,
    PositionHistory, PositionsTaken,
};
pub use offer::{
    OfferRank, PassedOver, Quote, QuoteRequest, ServiceOffer, ServiceOffers, ServiceSearch,
};
pub use statistics::{FailureRate, FailureRates, Lateness, NetworkStatistics, Share};
pub use webhook::{
    Webhook, WebhookDraft, WebhookMessage, WebhookMessageState, WebhookMessages, WebhookState,
    Webhooks,
};
