//! The table of operations itself.

use super::{Access, Class, Daemon, Listener, Row};
use crate::access::Role;
use http::Method;

const DRONES: Access = Access::Roles(&[Role::Drone, Role::Operator]);
const READERS: Access = Access::Roles(&[Role::Drone, Role::Operator, Role::Edge]);
const FOLLOWERS: Access = Access::Roles(&[Role::Operator, Role::Edge]);
const OPERATORS: Access = Access::Roles(&[Role::Operator]);
const PROVIDERS: Access = Access::Roles(&[Role::Provider]);
const CUSTOMERS: Access = Access::Roles(&[Role::Customer]);
const TENANTS: Access = Access::Roles(&[Role::Provider, Role::Customer]);
const PARTIES: Access = Access::Roles(&[Role::Provider, Role::Customer, Role::Operator]);
const ENROLLERS: Access = Access::Roles(&[Role::Provider, Role::Operator]);
const MAP_READERS: Access =
    Access::Roles(&[Role::Operator, Role::Edge, Role::Provider, Role::Customer]);
const STATISTICIANS: Access = Access::Roles(&[Role::Operator, Role::Edge, Role::Provider]);
const FLEETS: Access = Access::Roles(&[Role::Drone, Role::Operator, Role::Provider]);
const NEIGHBOURS: Access =
    Access::Roles(&[Role::Drone, Role::Operator, Role::Edge, Role::Provider]);
const COLLECTORS: Access = Access::Roles(&[Role::Operator, Role::Metrics]);

// Edges forward what was posted at them and what drones reported, so they write zones and closures as operators do.
const EDGES: Access = Access::Roles(&[Role::Edge]);
const OPEN: Access = Access::Open;

const EDGE: Option<Daemon> = Some(Daemon::Edge);
const REGISTRY: Option<Daemon> = Some(Daemon::Registry);
const EVERY: Option<Daemon> = None;

const MAIN: Option<Listener> = Some(Listener::Main);
const ADMIN: Option<Listener> = Some(Listener::Admin);
const BOTH: Option<Listener> = None;

// Rows and variants come from one list, so that neither can lack what the other has.
macro_rules! operations {
    ($($daemon:ident { $($(#[$doc:meta])* $operation:ident $name:literal $rest:tt $grpc:expr, $class:ident, $access:ident, $listener:ident;)* })*) => {
        /// Something that can be asked of a daemon.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Operation {
            $($($(#[$doc])* $operation,)*)*
        }

        /// The table, in the order of `Operation`.
        pub static TABLE: &[Row] = &[
            $($(Row {
                operation: Operation::$operation,
                daemon: $daemon,
                name: $name,
                rest: &$rest,
                grpc: $grpc,
                class: Class::$class,
                access: $access,
                listener: $listener,
            },)*)*
        ];
    };
}

operations! {
    EDGE {
        /// A failure report, answered by a recomposition.
        ReportFailure "report_failure" [(Method::POST, "/v1/failures")]
            Some("/skyway.v1.Recomposition/ReportFailure"), Failure, DRONES, MAIN;
        /// Many failure reports at once.
        ReportFailures "report_failures" [(Method::POST, "/v1/failures:batch")]
            Some("/skyway.v1.Recomposition/ReportFailures"), Failure, DRONES, MAIN;
        /// What was answered lately.
        ListRecompositions "list_recompositions" [(Method::GET, "/v1/recompositions")] None, Read, FLEETS, MAIN;
        /// One answer, with the world it was computed on.
        GetRecomposition "get_recomposition" [(Method::GET, "/v1/recompositions/{id}")] None, Read, FLEETS, MAIN;
        /// A delivery request, composed into a plan.
        CreatePlan "create_plan" [(Method::POST, "/v1/plans")]
            Some("/skyway.v1.Plans/CreatePlan"), Other, DRONES, MAIN;
        /// The plans.
        ListPlans "list_plans" [(Method::GET, "/v1/plans")]
            Some("/skyway.v1.Plans/ListPlans"), Read, FLEETS, MAIN;
        /// One plan.
        GetPlan "get_plan" [(Method::GET, "/v1/plans/{id}")]
            Some("/skyway.v1.Plans/GetPlan"), Read, FLEETS, MAIN;
        /// What the drone of a plan does when the line is gone.
        GetPack "get_pack" [(Method::GET, "/v1/plans/{id}/pack")] None, Read, DRONES, MAIN;
        /// The keys that packs are signed with.
        ListKeys "list_keys" [(Method::GET, "/v1/keys")] None, Read, READERS, MAIN;
        /// A plan is given up.
        CancelPlan "cancel_plan" [(Method::DELETE, "/v1/plans/{id}")] None, Other, DRONES, MAIN;
        /// A drone takes over a recomposed plan.
        AcknowledgePlan "acknowledge_plan" [(Method::POST, "/v1/plans/{id}/ack")]
            Some("/skyway.v1.Plans/AcknowledgePlan"), Other, DRONES, MAIN;
        /// A drone does not take a recomposed plan over.
        DeclinePlan "decline_plan" [(Method::POST, "/v1/plans/{id}/decline")]
            Some("/skyway.v1.Plans/DeclinePlan"), Other, DRONES, MAIN;
        /// A drone has landed.
        CompletePlan "complete_plan" [(Method::POST, "/v1/plans/{id}/complete")]
            Some("/skyway.v1.Plans/CompletePlan"), Other, DRONES, MAIN;
        /// An operator says what became of a plan.
        ReleasePlan "release_plan" [(Method::POST, "/v1/plans/{id}/release")] None, Other, OPERATORS, MAIN;
        /// A new zone.
        CreateZone "create_zone" [(Method::POST, "/v1/zones")] None, ZoneWrite, OPERATORS, MAIN;
        /// A zone under a chosen id, new or changed.
        PutZone "put_zone" [(Method::PUT, "/v1/zones/{id}")] None, ZoneWrite, OPERATORS, MAIN;
        /// One zone.
        GetZone "get_zone" [(Method::GET, "/v1/zones/{id}")] None, Read, NEIGHBOURS, MAIN;
        /// A zone is lifted.
        DeleteZone "delete_zone" [(Method::DELETE, "/v1/zones/{id}")] None, ZoneWrite, OPERATORS, MAIN;
        /// The zones.
        ListZones "list_zones" [(Method::GET, "/v1/zones")] None, Read, NEIGHBOURS, MAIN;
        /// What a zone would close; nothing changes.
        PreviewZone "preview_zone" [(Method::POST, "/v1/zones:preview")] None, Read, OPERATORS, MAIN;
        /// A feed of zones is imported.
        ImportZones "import_zones" [(Method::POST, "/v1/zones:import")] None, ZoneWrite, OPERATORS, MAIN;
        /// The closures.
        ListClosures "list_closures" [(Method::GET, "/v1/closures")] None, Read, NEIGHBOURS, MAIN;
        /// One closure.
        GetClosure "get_closure" [(Method::GET, "/v1/closures/{id}")] None, Read, NEIGHBOURS, MAIN;
        /// An operator closes segments or nodes.
        CreateClosure "create_closure" [(Method::POST, "/v1/closures")] None, ZoneWrite, OPERATORS, MAIN;
        /// A closure is confirmed or extended.
        ChangeClosure "change_closure" [(Method::PATCH, "/v1/closures/{id}")] None, ZoneWrite, OPERATORS, MAIN;
        /// A closure is lifted.
        DeleteClosure "delete_closure" [(Method::DELETE, "/v1/closures/{id}")] None, ZoneWrite, OPERATORS, MAIN;
        /// What reports and feeds of zones proposed.
        ListProposals "list_proposals" [(Method::GET, "/v1/proposals")] None, Read, OPERATORS, MAIN;
        /// A proposal is accepted or rejected.
        DecideProposal "decide_proposal" [
                (Method::POST, "/v1/proposals/{id}/accept"),
                (Method::POST, "/v1/proposals/{id}/reject"),
            ] None, ZoneWrite, OPERATORS, MAIN;
        /// Removals that wait for an operator.
        ListHolds "list_holds" [(Method::GET, "/v1/holds")] None, Read, OPERATORS, MAIN;
        /// A hold is released or rejected.
        DecideHold "decide_hold" [
                (Method::POST, "/v1/holds/{id}/release"),
                (Method::POST, "/v1/holds/{id}/reject"),
            ] None, ZoneWrite, OPERATORS, MAIN;
        /// What operators have to look at.
        ListAlarms "list_alarms" [(Method::GET, "/v1/alarms")] None, Read, OPERATORS, MAIN;
        /// An operator has seen an alarm.
        AcknowledgeAlarm "acknowledge_alarm" [(Method::POST, "/v1/alarms/{id}/acknowledge")] None, ZoneWrite, OPERATORS, MAIN;
        /// The time that the edge goes by.
        GetClock "get_clock" [(Method::GET, "/v1/clock")]
            Some("/skyway.v1.Clock/GetClock"), Read, NEIGHBOURS, MAIN;
        /// A client moves the clock.
        AdvanceClock "advance_clock" [(Method::POST, "/v1/clock:advance")]
            Some("/skyway.v1.Clock/AdvanceTo"), Other, OPERATORS, MAIN;
        /// A wall clock that has stepped is believed again.
        ConfirmClock "confirm_clock" [(Method::POST, "/v1/clock:confirm")] None, ZoneWrite, OPERATORS, MAIN;
        /// The weather over the network.
        GetWeather "get_weather" [(Method::GET, "/v1/weather")] None, Read, NEIGHBOURS, MAIN;
        /// How often what fails where, as the registry told it.
        ListFailureRates "list_failure_rates" [(Method::GET, "/v1/failure-rates")] None, Read, NEIGHBOURS, MAIN;
        /// The weather over the network, as a whole.
        PutWeather "put_weather" [(Method::PUT, "/v1/weather")] None, ZoneWrite, OPERATORS, MAIN;
        /// The network.
        GetNetwork "get_network" [(Method::GET, "/v1/network")]
            Some("/skyway.v1.Network/GetNetwork"), Read, NEIGHBOURS, MAIN;
        /// One node and its segments.
        GetNode "get_node" [(Method::GET, "/v1/nodes/{id}")] None, Read, NEIGHBOURS, MAIN;
        /// The nodes nearest to a place.
        Nearest "nearest" [(Method::GET, "/v1/nearest")]
            Some("/skyway.v1.Network/Nearest"), Read, NEIGHBOURS, MAIN;
        /// Positions and battery levels.
        PostTelemetry "post_telemetry" [(Method::POST, "/v1/telemetry")]
            Some("/skyway.v1.Drones/ReportTelemetry"), Other, DRONES, MAIN;
        /// The last known of each drone.
        ListDrones "list_drones" [(Method::GET, "/v1/drones")] None, Read, OPERATORS, MAIN;
        /// Drones on the line.
        DroneSession "drone_session" [] Some("/skyway.v1.Drones/Session"), Session, DRONES, MAIN;
        /// What a drone is told, as it comes into its mailbox.
        WatchMail "watch_mail" [(Method::GET, "/v1/drones/{id}/events")] None, Session, DRONES, MAIN;
        /// A drone has received messages.
        ReceiveMail "receive_mail" [(Method::POST, "/v1/drones/{id}/received")] None, Other, DRONES, MAIN;
        /// Changes as they happen.
        WatchEvents "watch_events" [(Method::GET, "/v1/events")]
            Some("/skyway.v1.Airspace/WatchEvents"), Stream, FOLLOWERS, MAIN;
        /// The same over gRPC.
        HealthCheck "health_check" [] Some("/grpc.health.v1.Health/Check"), Health, OPEN, MAIN;
        /// The same over gRPC, as it changes.
        HealthWatch "health_watch" [] Some("/grpc.health.v1.Health/Watch"), Watch, OPEN, MAIN;
        /// The description of the gRPC services.
        Reflection "reflection" [] Some("/grpc.reflection.v1.ServerReflection/ServerReflectionInfo"), Other, OPEN, MAIN;
        /// The same for older clients.
        ReflectionAlpha "reflection_alpha" [] Some("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"), Other, OPEN, MAIN;
    }
    REGISTRY {
        /// The networks.
        RegistryListNetworks "registry_list_networks" [(Method::GET, "/v1/networks")] None, Read, MAP_READERS, MAIN;
        /// One network, whole.
        RegistryGetNetwork "registry_get_network" [(Method::GET, "/v1/networks/{network}")] None, Read, MAP_READERS, MAIN;
        /// A network is new or replaced.
        RegistryPutNetwork "registry_put_network" [(Method::PUT, "/v1/networks/{network}")] None, Other, OPERATORS, MAIN;
        /// Nodes and segments of a network are added, changed and removed.
        RegistryPatchNetwork "registry_patch_network" [(Method::PATCH, "/v1/networks/{network}")] None, Other, OPERATORS, MAIN;
        /// What has changed after a revision, now or as soon as something does.
        RegistryFollow "registry_follow" [(Method::GET, "/v1/networks/{network}/changes")] None, Follow, FOLLOWERS, MAIN;
        /// Everything that holds, at one revision.
        RegistrySnapshot "registry_snapshot" [(Method::GET, "/v1/networks/{network}/snapshot")] None, Read, FOLLOWERS, MAIN;
        /// The zones of a network.
        RegistryListZones "registry_list_zones" [(Method::GET, "/v1/networks/{network}/zones")] None, Read, FOLLOWERS, MAIN;
        /// A new zone.
        RegistryCreateZone "registry_create_zone" [(Method::POST, "/v1/networks/{network}/zones")] None, ZoneWrite, FOLLOWERS, MAIN;
        /// One zone.
        RegistryGetZone "registry_get_zone" [(Method::GET, "/v1/networks/{network}/zones/{id}")] None, Read, FOLLOWERS, MAIN;
        /// A zone under a chosen id, new or changed.
        RegistryPutZone "registry_put_zone" [(Method::PUT, "/v1/networks/{network}/zones/{id}")] None, ZoneWrite, FOLLOWERS, MAIN;
        /// A zone is lifted.
        RegistryDeleteZone "registry_delete_zone" [(Method::DELETE, "/v1/networks/{network}/zones/{id}")] None, ZoneWrite, FOLLOWERS, MAIN;
        /// The closures of a network.
        RegistryListClosures "registry_list_closures" [(Method::GET, "/v1/networks/{network}/closures")] None, Read, FOLLOWERS, MAIN;
        /// A new closure.
        RegistryCreateClosure "registry_create_closure" [(Method::POST, "/v1/networks/{network}/closures")] None, ZoneWrite, FOLLOWERS, MAIN;
        /// One closure.
        RegistryGetClosure "registry_get_closure" [(Method::GET, "/v1/networks/{network}/closures/{id}")] None, Read, FOLLOWERS, MAIN;
        /// A closure under a chosen id, new or changed.
        RegistryPutClosure "registry_put_closure" [(Method::PUT, "/v1/networks/{network}/closures/{id}")] None, ZoneWrite, FOLLOWERS, MAIN;
        /// A closure is lifted.
        RegistryDeleteClosure "registry_delete_closure" [(Method::DELETE, "/v1/networks/{network}/closures/{id}")] None, ZoneWrite, FOLLOWERS, MAIN;
        /// The weather over a network.
        RegistryGetWeather "registry_get_weather" [(Method::GET, "/v1/networks/{network}/weather")] None, Read, FOLLOWERS, MAIN;
        /// The weather over a network, as a whole.
        RegistryPutWeather "registry_put_weather" [(Method::PUT, "/v1/networks/{network}/weather")] None, ZoneWrite, OPERATORS, MAIN;
        /// An edge tells where it is, and what it could not take.
        RegistryReportEdge "registry_report_edge" [(Method::PUT, "/v1/networks/{network}/edges/{id}")] None, Other, EDGES, MAIN;
        /// The time that the registry goes by.
        RegistryGetClock "registry_get_clock" [(Method::GET, "/v1/clock")] None, Read, MAP_READERS, MAIN;
        /// Who follows, and how far they are.
        RegistryListEdges "registry_list_edges" [(Method::GET, "/v1/edges")] None, Read, OPERATORS, MAIN;
        /// The keys of packs that were revoked.
        ListRevokedKeys "list_revoked_keys" [(Method::GET, "/v1/revoked-keys")] None, Read, READERS, MAIN;
        /// A key of packs is revoked.
        RevokeKey "revoke_key" [(Method::PUT, "/v1/revoked-keys/{id}")] None, Other, OPERATORS, MAIN;
        /// Who runs drones.
        ListProviders "list_providers" [(Method::GET, "/v1/providers")] None, Read, PARTIES, MAIN;
        /// One provider.
        GetProvider "get_provider" [(Method::GET, "/v1/providers/{id}")] None, Read, PARTIES, MAIN;
        /// A provider, new or changed.
        PutProvider "put_provider" [(Method::PUT, "/v1/providers/{id}")] None, Other, ENROLLERS, MAIN;
        /// A provider gives up.
        DeleteProvider "delete_provider" [(Method::DELETE, "/v1/providers/{id}")] None, Other, ENROLLERS, MAIN;
        /// The drones of providers.
        ListFleetDrones "list_fleet_drones" [(Method::GET, "/v1/drones")] None, Read, ENROLLERS, MAIN;
        /// One drone of a provider.
        GetFleetDrone "get_fleet_drone" [(Method::GET, "/v1/drones/{id}")] None, Read, ENROLLERS, MAIN;
        /// A drone of a provider, new or changed.
        PutFleetDrone "put_fleet_drone" [(Method::PUT, "/v1/drones/{id}")] None, Other, PROVIDERS, MAIN;
        /// A provider gives a drone up.
        DeleteFleetDrone "delete_fleet_drone" [(Method::DELETE, "/v1/drones/{id}")] None, Other, PROVIDERS, MAIN;
        /// Where a drone was.
        ListPositions "list_positions" [(Method::GET, "/v1/drones/{id}/positions")] None, Read, ENROLLERS, MAIN;
        /// What providers offer.
        ListServices "list_services" [(Method::GET, "/v1/services")] None, Read, TENANTS, MAIN;
        /// One service.
        GetService "get_service" [(Method::GET, "/v1/services/{id}")] None, Read, TENANTS, MAIN;
        /// A service is published, new or changed.
        PutService "put_service" [(Method::PUT, "/v1/services/{id}")] None, Other, PROVIDERS, MAIN;
        /// A service is offered no more.
        DeleteService "delete_service" [(Method::DELETE, "/v1/services/{id}")] None, Other, PROVIDERS, MAIN;
        /// Which services fit what a customer looks for.
        SearchServices "search_services" [(Method::POST, "/v1/services:search")] None, Read, CUSTOMERS, MAIN;
        /// A price that holds for a while.
        CreateQuote "create_quote" [(Method::POST, "/v1/quotes")] None, Other, CUSTOMERS, MAIN;
        /// One quote.
        GetQuote "get_quote" [(Method::GET, "/v1/quotes/{id}")] None, Read, TENANTS, MAIN;
        /// An order.
        CreateDelivery "create_delivery" [(Method::POST, "/v1/deliveries")] None, Other, CUSTOMERS, MAIN;
        /// What was ordered.
        ListDeliveries "list_deliveries" [(Method::GET, "/v1/deliveries")] None, Read, PARTIES, MAIN;
        /// One delivery.
        GetDelivery "get_delivery" [(Method::GET, "/v1/deliveries/{id}")] None, Read, PARTIES, MAIN;
        /// A delivery is called off.
        CancelDelivery "cancel_delivery" [(Method::POST, "/v1/deliveries/{id}/cancel")] None, Other, CUSTOMERS, MAIN;
        /// Where a parcel is, as it flies.
        TrackDelivery "track_delivery" [(Method::GET, "/v1/deliveries/{id}/track")] None, Stream, PARTIES, MAIN;
        /// A provider adds a photo or a code to the proof.
        ProveDelivery "prove_delivery" [(Method::POST, "/v1/deliveries/{id}/proof")] None, Other, PROVIDERS, MAIN;
        /// Who is told.
        ListWebhooks "list_webhooks" [(Method::GET, "/v1/webhooks")] None, Read, TENANTS, MAIN;
        /// One webhook.
        GetWebhook "get_webhook" [(Method::GET, "/v1/webhooks/{id}")] None, Read, TENANTS, MAIN;
        /// A webhook, new or changed.
        PutWebhook "put_webhook" [(Method::PUT, "/v1/webhooks/{id}")] None, Other, TENANTS, MAIN;
        /// A webhook is called no more.
        DeleteWebhook "delete_webhook" [(Method::DELETE, "/v1/webhooks/{id}")] None, Other, TENANTS, MAIN;
        /// A webhook gets a new secret.
        RotateWebhook "rotate_webhook" [(Method::POST, "/v1/webhooks/{id}/rotate")] None, Other, TENANTS, MAIN;
        /// What a webhook was told.
        ListMessages "list_messages" [(Method::GET, "/v1/webhooks/{id}/messages")] None, Read, TENANTS, MAIN;
        /// A message is sent again.
        ResendMessage "resend_message" [(Method::POST, "/v1/webhooks/{id}/messages/{message}/resend")] None, Other, TENANTS, MAIN;
        /// One customer.
        GetCustomer "get_customer" [(Method::GET, "/v1/customers/{id}")] None, Read, CUSTOMERS, MAIN;
        /// A customer, new or changed.
        PutCustomer "put_customer" [(Method::PUT, "/v1/customers/{id}")] None, Other, CUSTOMERS, MAIN;
        /// All that is kept of a customer.
        GetCustomerData "get_customer_data" [(Method::GET, "/v1/customers/{id}/data")] None, Read, CUSTOMERS, MAIN;
        /// What is kept of a customer is deleted.
        DeleteCustomerData "delete_customer_data" [(Method::DELETE, "/v1/customers/{id}/data")] None, Other, CUSTOMERS, MAIN;
        /// An edge tells what became of flights.
        TakeNews "take_news" [(Method::POST, "/v1/networks/{network}/edges/{id}/news")] None, Other, EDGES, MAIN;
        /// An edge tells where drones were.
        TakePositions "take_positions" [(Method::POST, "/v1/networks/{network}/edges/{id}/positions")] None, Other, EDGES, MAIN;
        /// What is worked out of all that edges have told.
        GetStatistics "get_statistics" [(Method::GET, "/v1/networks/{network}/statistics")] None, Read, STATISTICIANS, MAIN;
    }
    EVERY {
        /// Whether the process lives.
        Live "live" [(Method::GET, "/livez")] None, Health, OPEN, BOTH;
        /// Whether it may be sent requests.
        Ready "ready" [(Method::GET, "/readyz")] None, Health, OPEN, BOTH;
        /// The description of the REST API.
        OpenApi "openapi" [(Method::GET, "/openapi.json")] None, Other, OPEN, MAIN;
        /// Its page, and that of the problems.
        Docs "docs" [(Method::GET, "/docs"), (Method::GET, "/docs/"), (Method::GET, "/docs/{*file}")] None, Other, OPEN, MAIN;
        /// The page of the daemon: the live picture of an edge, the shop window of a registry.
        Page "page" [(Method::GET, "/"), (Method::GET, "/page/{*file}")] None, Other, OPEN, MAIN;
        /// Metrics in Prometheus' text format.
        Metrics "metrics" [(Method::GET, "/metrics")] None, Health, COLLECTORS, ADMIN;
        /// The state of the daemon.
        Status "status" [(Method::GET, "/status")] None, Health, COLLECTORS, ADMIN;
    }
}
