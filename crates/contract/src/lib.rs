//! What goes over the wire: the shapes of requests and answers, as plain data.
//!
//! JSON is written and read from these types directly; gRPC messages are converted to and from them. They
//! know nothing of the engine or the server, so that a client can be built on them alone. Units are in the
//! names; times are RFC 3339 in UTC; positions are `[longitude, latitude]`.

mod alarm;
mod author;
mod closure;
mod drone;
mod event;
mod failure;
mod first_stretch;
mod flight;
mod id;
mod mail;
mod market;
mod network;
mod numbers;
mod outcome;
mod pack;
mod plan;
mod plan_report;
mod problem;
mod recomposition;
mod registry;
mod registry_checksum;
mod status;
mod weather;
mod weight;
mod zone;
mod zone_import;

pub use alarm::{Alarm, AlarmKind, Alarms};
pub use author::{Author, ON_BEHALF_OF, TENANT};
pub use closure::{
    Closure, ClosureCause, ClosureChange, ClosureDraft, Closures, Hold, Holds, Proposal,
    ProposalSubject, Proposals,
};
pub use drone::{DroneState, Drones, Position, Telemetry, TelemetryAnswer, TelemetryEntry};
pub use event::{Event, EventKind};
pub use failure::{
    DroneFacts, FailureReport, FailureType, Failures, OperationalDetail, Parameters, Scope,
    Service, Strategy,
};
pub use first_stretch::{FirstStretch, Flag, IfAirborne, Near, StretchKind, UnsafeWay, Waypoint};
pub use flight::{
    DetourFlight, Flight, FlightCause, LegFlight, Opening, PadHold, PadReservation, ServiceStop,
    Stop, StopKind,
};
pub use id::{Id, Place, with_ids_as_text};
pub use mail::{
    DroneMessage, EndedSession, HelloDrone, MailLeft, MessageKind, Received, RefusedDrone, Welcome,
};
pub use market::{
    AllocatedDrone, Customer, CustomerData, Deliveries, Delivery, DeliveryChange, DeliveryOrder,
    DeliveryStatus, DeliveryTrack, EdgeNews, FailureNews, FailureRate, FailureRates, FleetDrone,
    FleetDroneState, FleetDrones, FleetPosition, FlightNews, Lateness, Money, NetworkStatistics,
    NewsEntry, NewsTaken, OfferRank, OpeningHours, PassedOver, PositionBatch, PositionEntry,
    PositionHistory, PositionsTaken, ProofOfDelivery, Provider, ProviderState, Providers,
    PublishedService, PublishedServices, Quote, QuoteRequest, Recipient, RecomposedFlight,
    ServiceOffer, ServiceOffers, ServiceQuality, ServiceSearch, ServiceTariff, Share, Webhook,
    WebhookDraft, WebhookMessage, WebhookMessageState, WebhookMessages, WebhookState, Webhooks,
};
pub use network::{CompactNetwork, NearNode, Nearest, Node, NodeSegment};
pub use outcome::{Outcome, Path, Warning};
pub use pack::{PackKey, PackKeyState, PackKeys};
pub use plan::{
    Alternate, Conflict, Contingency, DeliveryRequest, EndedAs, Leg, Plan, PlanCounts, PlanFlag,
    PlanState, PlanVersion, Plans, SentVersion,
};
pub use plan_report::{Ack, Cancellation, Completion, Decline, Release};
pub use problem::{Fault, Problem};
pub use recomposition::{
    Answer, AreaStage, BatchAnswer, BatchEntry, CheckerCase, PlanReference, Publication,
    PublicationState, Recomposition, Recompositions, Record, RecordSummary, RecordedWorld, Repair,
    Severance, Stage,
};
pub use registry::{
    ChangeOperation, ChangesPage, EdgeNoted, EdgeReport, EdgeStatus, EdgeStatuses, KeyRevocation,
    LoggedChange, Nack, NetworkPatch, NetworkSummaries, NetworkSummary, ObjectKind, PublishedCause,
    PublishedClosure, PublishedObjects, RegistrySnapshot, RevokedKey, RevokedKeys, SnapshotObject,
    Written,
};
pub use status::{
    ClockAdvance, ClockAdvanced, ClockKind, ClockReading, ClockState, Freshness, NetworkName,
    RegistryRevision, Stamp,
};
pub use weather::{Weather, WeatherAnswer, Wind};
pub use weight::{text_bytes, value_bytes};
pub use zone::{AffectedPlan, RecordedClosure, ZoneAck, ZoneEffect, ZoneList};
pub use zone_import::{
    ImportAction, ImportCounts, ImportNote, ImportedZone, RefusedZone, ZoneImport,
};
