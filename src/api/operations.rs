//! What can be asked of an edge: one table of operations, with their REST and gRPC names, class and roles.
//!
//! The gate looks a request up here before anything else is done with it: what is not in the table is
//! not served, and who may call it stands beside it, for both dialects at once.

use crate::access::Role;
use http::Method;
use rustc_hash::FxHashMap;
use std::sync::LazyLock;

/// What competes with what under load. Each class has slots of its own, so that none can starve another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Class {
    /// Failure reports: shed last.
    Failure,
    /// Writes of airspace, which a flood of reports must not keep out.
    ZoneWrite,
    /// Reads.
    Read,
    /// The rest: plans, telemetry, pages.
    Other,
    /// Answers without an end, counted until they end.
    Stream,
    /// Probes, metrics and status: never shed.
    Health,
}

impl Class {
    /// Every class, in the order of `index`.
    pub const ALL: [Self; 6] = [
        Self::Failure,
        Self::ZoneWrite,
        Self::Read,
        Self::Other,
        Self::Stream,
        Self::Health,
    ];

    /// The name in metrics and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Failure => "failure",
            Self::ZoneWrite => "zone_write",
            Self::Read => "read",
            Self::Other => "other",
            Self::Stream => "stream",
            Self::Health => "health",
        }
    }

    pub(crate) fn index(self) -> usize {
        self as usize
    }
}

/// Where an operation is served.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Listener {
    /// The public one: REST and gRPC.
    Main,
    /// The one for metrics and status.
    Admin,
}

/// Which roles may do an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// No token is needed.
    Open,
    /// These roles; `Role::Anyone`, which exists only where there are no tokens, may do everything.
    Roles(&'static [Role]),
}

/// One row of the table.
#[derive(Debug)]
pub struct Row {
    /// Which operation.
    pub operation: Operation,
    /// The name in metrics and logs.
    pub name: &'static str,
    /// REST methods and paths, as axum writes them.
    pub rest: &'static [(Method, &'static str)],
    /// The gRPC path.
    pub grpc: Option<&'static str>,
    /// What it competes with under load.
    pub class: Class,
    /// Who may.
    pub access: Access,
    /// The only listener that serves it; none: both do.
    pub listener: Option<Listener>,
}

const DRONES: Access = Access::Roles(&[Role::Drone, Role::Operator]);
const READERS: Access = Access::Roles(&[Role::Drone, Role::Operator, Role::Edge]);
const FOLLOWERS: Access = Access::Roles(&[Role::Operator, Role::Edge]);
const OPERATORS: Access = Access::Roles(&[Role::Operator]);
const COLLECTORS: Access = Access::Roles(&[Role::Operator, Role::Metrics]);

const MAIN: Option<Listener> = Some(Listener::Main);
const ADMIN: Option<Listener> = Some(Listener::Admin);
const BOTH: Option<Listener> = None;

// Rows and variants come from one list, so that neither can lack what the other has.
macro_rules! operations {
    ($($(#[$doc:meta])* $operation:ident $name:literal $rest:tt $grpc:expr, $class:ident, $access:ident, $listener:ident;)*) => {
        /// Something that can be asked of an edge.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Operation {
            $($(#[$doc])* $operation,)*
        }

        /// The table, in the order of `Operation`.
        pub static TABLE: &[Row] = &[
            $(Row {
                operation: Operation::$operation,
                name: $name,
                rest: &$rest,
                grpc: $grpc,
                class: Class::$class,
                access: $access,
                listener: $listener,
            },)*
        ];
    };
}

operations! {
    /// A failure report, answered by a recomposition.
    ReportFailure "report_failure" [(Method::POST, "/v1/failures")]
        Some("/skyway.v1.Recomposition/ReportFailure"), Failure, DRONES, MAIN;
    /// Many failure reports at once.
    ReportFailures "report_failures" [(Method::POST, "/v1/failures:batch")]
        Some("/skyway.v1.Recomposition/ReportFailures"), Failure, DRONES, MAIN;
    /// What was answered lately.
    ListRecompositions "list_recompositions" [(Method::GET, "/v1/recompositions")]
        Some("/skyway.v1.Recomposition/ListRecompositions"), Read, DRONES, MAIN;
    /// One answer, with the world it was computed on.
    GetRecomposition "get_recomposition" [(Method::GET, "/v1/recompositions/{id}")]
        Some("/skyway.v1.Recomposition/GetRecomposition"), Read, DRONES, MAIN;
    /// A delivery request, composed into a plan.
    CreatePlan "create_plan" [(Method::POST, "/v1/plans")]
        Some("/skyway.v1.Plans/CreatePlan"), Other, DRONES, MAIN;
    /// The plans.
    ListPlans "list_plans" [(Method::GET, "/v1/plans")]
        Some("/skyway.v1.Plans/ListPlans"), Read, DRONES, MAIN;
    /// One plan.
    GetPlan "get_plan" [(Method::GET, "/v1/plans/{id}")]
        Some("/skyway.v1.Plans/GetPlan"), Read, DRONES, MAIN;
    /// A plan is given up.
    CancelPlan "cancel_plan" [(Method::DELETE, "/v1/plans/{id}")]
        Some("/skyway.v1.Plans/CancelPlan"), Other, DRONES, MAIN;
    /// A drone takes over a recomposed plan.
    AcknowledgePlan "acknowledge_plan" [(Method::POST, "/v1/plans/{id}/ack")]
        Some("/skyway.v1.Plans/AcknowledgePlan"), Other, DRONES, MAIN;
    /// A new zone.
    CreateZone "create_zone" [(Method::POST, "/v1/zones")]
        Some("/skyway.v1.Airspace/CreateZone"), ZoneWrite, OPERATORS, MAIN;
    /// A zone under a chosen id, new or changed.
    PutZone "put_zone" [(Method::PUT, "/v1/zones/{id}")]
        Some("/skyway.v1.Airspace/PutZone"), ZoneWrite, OPERATORS, MAIN;
    /// One zone.
    GetZone "get_zone" [(Method::GET, "/v1/zones/{id}")]
        Some("/skyway.v1.Airspace/GetZone"), Read, READERS, MAIN;
    /// A zone is lifted.
    DeleteZone "delete_zone" [(Method::DELETE, "/v1/zones/{id}")]
        Some("/skyway.v1.Airspace/DeleteZone"), ZoneWrite, OPERATORS, MAIN;
    /// The zones.
    ListZones "list_zones" [(Method::GET, "/v1/zones")]
        Some("/skyway.v1.Airspace/ListZones"), Read, READERS, MAIN;
    /// What a zone would close; nothing changes.
    PreviewZone "preview_zone" [(Method::POST, "/v1/zones:preview")]
        Some("/skyway.v1.Airspace/PreviewZone"), Read, OPERATORS, MAIN;
    /// The closures.
    ListClosures "list_closures" [(Method::GET, "/v1/closures")]
        Some("/skyway.v1.Airspace/ListClosures"), Read, READERS, MAIN;
    /// One closure.
    GetClosure "get_closure" [(Method::GET, "/v1/closures/{id}")]
        Some("/skyway.v1.Airspace/GetClosure"), Read, READERS, MAIN;
    /// An operator closes segments or nodes.
    CreateClosure "create_closure" [(Method::POST, "/v1/closures")]
        Some("/skyway.v1.Airspace/CreateClosure"), ZoneWrite, OPERATORS, MAIN;
    /// A closure is confirmed or extended.
    ChangeClosure "change_closure" [(Method::PATCH, "/v1/closures/{id}")]
        Some("/skyway.v1.Airspace/ChangeClosure"), ZoneWrite, OPERATORS, MAIN;
    /// A closure is lifted.
    DeleteClosure "delete_closure" [(Method::DELETE, "/v1/closures/{id}")]
        Some("/skyway.v1.Airspace/DeleteClosure"), ZoneWrite, OPERATORS, MAIN;
    /// What reports proposed and was not published.
    ListProposals "list_proposals" [(Method::GET, "/v1/proposals")]
        Some("/skyway.v1.Airspace/ListProposals"), Read, OPERATORS, MAIN;
    /// A proposal is accepted or rejected.
    DecideProposal "decide_proposal" [
            (Method::POST, "/v1/proposals/{id}/accept"),
            (Method::POST, "/v1/proposals/{id}/reject"),
        ]
        Some("/skyway.v1.Airspace/DecideProposal"), ZoneWrite, OPERATORS, MAIN;
    /// Removals that wait for an operator.
    ListHolds "list_holds" [(Method::GET, "/v1/holds")]
        Some("/skyway.v1.Airspace/ListHolds"), Read, OPERATORS, MAIN;
    /// A hold is released or rejected.
    DecideHold "decide_hold" [
            (Method::POST, "/v1/holds/{id}/release"),
            (Method::POST, "/v1/holds/{id}/reject"),
        ]
        Some("/skyway.v1.Airspace/DecideHold"), ZoneWrite, OPERATORS, MAIN;
    /// The network.
    GetNetwork "get_network" [(Method::GET, "/v1/network")]
        Some("/skyway.v1.Network/GetNetwork"), Read, READERS, MAIN;
    /// One node and its segments.
    GetNode "get_node" [(Method::GET, "/v1/nodes/{id}")]
        Some("/skyway.v1.Network/GetNode"), Read, READERS, MAIN;
    /// The nodes nearest to a place.
    Nearest "nearest" [(Method::GET, "/v1/nearest")]
        Some("/skyway.v1.Network/Nearest"), Read, READERS, MAIN;
    /// Positions and battery levels.
    PostTelemetry "post_telemetry" [(Method::POST, "/v1/telemetry")]
        Some("/skyway.v1.Drones/ReportTelemetry"), Other, DRONES, MAIN;
    /// The last known of each drone.
    ListDrones "list_drones" [(Method::GET, "/v1/drones")]
        Some("/skyway.v1.Drones/ListDrones"), Read, OPERATORS, MAIN;
    /// Changes as they happen.
    WatchEvents "watch_events" [(Method::GET, "/v1/events")]
        Some("/skyway.v1.Airspace/WatchEvents"), Stream, FOLLOWERS, MAIN;
    /// Whether the process lives.
    Live "live" [(Method::GET, "/livez")] None, Health, OPEN, BOTH;
    /// Whether it may be sent requests.
    Ready "ready" [(Method::GET, "/readyz")] None, Health, OPEN, BOTH;
    /// The same over gRPC.
    HealthCheck "health_check" [] Some("/grpc.health.v1.Health/Check"), Health, OPEN, MAIN;
    /// The same over gRPC, as it changes.
    HealthWatch "health_watch" [] Some("/grpc.health.v1.Health/Watch"), Stream, OPEN, MAIN;
    /// The description of the gRPC services.
    Reflection "reflection" [] Some("/grpc.reflection.v1.ServerReflection/ServerReflectionInfo"), Other, OPEN, MAIN;
    /// The same for older clients.
    ReflectionAlpha "reflection_alpha" [] Some("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"), Other, OPEN, MAIN;
    /// The description of the REST API.
    OpenApi "openapi" [(Method::GET, "/openapi.json")] None, Other, OPEN, MAIN;
    /// Its page, and that of the problems.
    Docs "docs" [(Method::GET, "/docs"), (Method::GET, "/docs/"), (Method::GET, "/docs/{*file}")] None, Other, OPEN, MAIN;
    /// The live picture.
    Page "page" [(Method::GET, "/"), (Method::GET, "/page/{*file}")] None, Other, OPEN, MAIN;
    /// Metrics in Prometheus' text format.
    Metrics "metrics" [(Method::GET, "/metrics")] None, Health, COLLECTORS, ADMIN;
    /// The state of the edge.
    Status "status" [(Method::GET, "/status")] None, Health, COLLECTORS, ADMIN;
}

const OPEN: Access = Access::Open;

/// Why a request leads to no operation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unresolved {
    /// Nothing is at this path.
    Path,
    /// The path is known, with other methods, as an `Allow` header lists them.
    Method {
        /// The methods it has.
        allowed: String,
    },
}

impl Operation {
    /// Its row of the table.
    pub fn row(self) -> &'static Row {
        &TABLE[self as usize]
    }

    /// Whether a role may do it.
    pub fn allows(self, role: Role) -> bool {
        match self.row().access {
            Access::Open => true,
            Access::Roles(roles) => role == Role::Anyone || roles.contains(&role),
        }
    }

    /// The operation behind a method and a path, of either dialect.
    pub fn of(method: &Method, path: &str) -> Option<Self> {
        Self::of_grpc(path)
            .filter(|_| method == Method::POST)
            .or_else(|| Self::of_rest(method, path).ok())
    }

    /// The operation behind a gRPC path.
    pub fn of_grpc(path: &str) -> Option<Self> {
        INDEX.grpc.get(path).copied()
    }

    /// The operation behind a REST method and path. `HEAD` counts as `GET`.
    ///
    /// # Errors
    ///
    /// Nothing is at the path, or it has other methods.
    pub fn of_rest(method: &Method, path: &str) -> Result<Self, Unresolved> {
        let routes = INDEX.routes(path).ok_or(Unresolved::Path)?;
        let wanted = if method == Method::HEAD {
            &Method::GET
        } else {
            method
        };
        let found = routes.iter().find(|(offered, _)| *offered == wanted);
        let Some((_, operation)) = found else {
            let methods: Vec<&str> = routes.iter().map(|(offered, _)| offered.as_str()).collect();
            return Err(Unresolved::Method {
                allowed: methods.join(", "),
            });
        };
        Ok(*operation)
    }
}

/// What a path offers.
type Routes = Vec<(&'static Method, Operation)>;

/// A path with an id in the middle: what stands before the id, and after it.
struct Template {
    before: &'static str,
    after: &'static str,
    /// Whether the id may contain further slashes.
    deep: bool,
    routes: Routes,
}

/// The table turned round: from paths to operations.
struct Index {
    grpc: FxHashMap<&'static str, Operation>,
    exact: FxHashMap<&'static str, Routes>,
    templates: Vec<Template>,
}

static INDEX: LazyLock<Index> = LazyLock::new(Index::build);

impl Index {
    fn build() -> Self {
        let mut index = Self {
            grpc: FxHashMap::default(),
            exact: FxHashMap::default(),
            templates: Vec::new(),
        };
        for row in TABLE {
            if let Some(path) = row.grpc {
                index.grpc.insert(path, row.operation);
            }
            for (method, path) in row.rest {
                index.routes_to_add(path).push((method, row.operation));
            }
        }
        index
    }

    fn routes_to_add(&mut self, path: &'static str) -> &mut Routes {
        let parts = path
            .split_once('{')
            .and_then(|(before, rest)| Some((before, rest.split_once('}')?)));
        let Some((before, (name, after))) = parts else {
            return self.exact.entry(path).or_default();
        };
        let same = |template: &Template| template.before == before && template.after == after;
        let place = self.templates.iter().position(same).unwrap_or_else(|| {
            self.templates.push(Template {
                before,
                after,
                deep: name.starts_with('*'),
                routes: Routes::new(),
            });
            self.templates.len() - 1
        });
        &mut self.templates[place].routes
    }

    /// What a path offers: one look for a path without an id, else a walk along the few templates.
    fn routes(&self, path: &str) -> Option<&Routes> {
        self.exact.get(path).or_else(|| {
            let template = self.templates.iter().find(|template| template.fits(path))?;
            Some(&template.routes)
        })
    }
}

impl Template {
    fn fits(&self, path: &str) -> bool {
        path.strip_prefix(self.before)
            .and_then(|rest| rest.strip_suffix(self.after))
            .is_some_and(|id| !id.is_empty() && (self.deep || !id.contains('/')))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_its_operations() {
        for (place, row) in TABLE.iter().enumerate() {
            assert_eq!(row.operation as usize, place, "{}", row.name);
            assert_eq!(row.operation.row().name, row.name);
        }
    }

    #[test]
    fn every_row_resolves_to_itself() {
        for row in TABLE {
            for (method, path) in row.rest {
                let filled = path.replace("{id}", "a.b-1").replace("{*file}", "a/b.js");
                assert_eq!(
                    Operation::of(method, &filled),
                    Some(row.operation),
                    "{method} {filled}"
                );
            }
            if let Some(path) = row.grpc {
                assert_eq!(
                    Operation::of(&Method::POST, path),
                    Some(row.operation),
                    "{path}"
                );
                assert_eq!(Operation::of(&Method::GET, path), None, "{path}");
            }
        }
    }

    #[test]
    fn what_is_not_in_the_table_is_not_found() {
        let paths = [
            "",
            "*",
            "//",
            "/v1",
            "/v1/",
            "/v2/failures",
            "/v1/failures/",
            "/v1/failures/7",
            "/v1/failures:batch/",
            "/v1/zones/",
            "/v1/zones:previews",
            "/v1/zones/a/b",
            "/v1/plans//ack",
            "/v1/plans/a/b/ack",
            "/v1/plans/7/acks",
            "/skyway.v1.Plans/",
            "/skyway.v1.Plans/CreatePlan/",
            "/docsx",
            "/page/",
            "/v1/failures%3Abatch",
        ];
        for path in paths {
            for method in [Method::GET, Method::POST, Method::DELETE] {
                assert_eq!(Operation::of(&method, path), None, "{method} {path}");
            }
        }
    }

    #[test]
    fn actions_of_a_collection_are_not_ids() {
        let of = |path| Operation::of(&Method::POST, path);
        assert_eq!(of("/v1/failures:batch"), Some(Operation::ReportFailures));
        assert_eq!(of("/v1/zones:preview"), Some(Operation::PreviewZone));
        let get = |path| Operation::of(&Method::GET, path);
        assert_eq!(get("/v1/zones:preview"), None);
        assert_eq!(get("/v1/zones/:preview"), Some(Operation::GetZone));
        assert_eq!(get("/v1/plans/ack"), Some(Operation::GetPlan));
    }

    #[test]
    fn a_known_path_tells_its_methods() {
        let method = |allowed: &str| {
            Err(Unresolved::Method {
                allowed: allowed.to_owned(),
            })
        };
        assert_eq!(
            Operation::of_rest(&Method::GET, "/v1/failures"),
            method("POST")
        );
        assert_eq!(
            Operation::of_rest(&Method::PATCH, "/v1/zones/a"),
            method("PUT, GET, DELETE")
        );
        assert_eq!(
            Operation::of_rest(&Method::HEAD, "/v1/zones/a"),
            Ok(Operation::GetZone)
        );
    }

    #[test]
    fn anyone_may_do_everything_and_drones_write_no_airspace() {
        for row in TABLE {
            assert!(row.operation.allows(Role::Anyone), "{}", row.name);
            if row.class == Class::ZoneWrite {
                let writers = [Role::Drone, Role::Edge, Role::Metrics];
                assert!(
                    !writers.iter().any(|role| row.operation.allows(*role)),
                    "{}",
                    row.name
                );
                assert!(row.operation.allows(Role::Operator), "{}", row.name);
            }
        }
    }
}
