//! What can be asked of an edge and of a registry: one table of operations, with their names, class and roles.
//!
//! The gate looks a request up here before anything else is done with it: what is not in the table is
//! not served, and who may call it stands beside it, for both dialects at once.

mod index;
mod table;

#[cfg(test)]
mod tests;

pub use table::{Operation, TABLE};

use crate::access::Role;
use http::Method;

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
    /// Long polls, which wait for news longer than the deadline of the others.
    Follow,
    /// Streams of events, counted until they end.
    Stream,
    /// Sessions of drones and streams of their mail, counted until they end.
    Session,
    /// Streams of health, which need no token, counted until they end.
    Watch,
    /// Probes, metrics and status: never shed.
    Health,
}

impl Class {
    /// Every class, in the order of `index`.
    pub const ALL: [Self; 9] = [
        Self::Failure,
        Self::ZoneWrite,
        Self::Read,
        Self::Other,
        Self::Follow,
        Self::Stream,
        Self::Session,
        Self::Watch,
        Self::Health,
    ];

    /// The name in metrics and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Failure => "failure",
            Self::ZoneWrite => "zone_write",
            Self::Read => "read",
            Self::Other => "other",
            Self::Follow => "follow",
            Self::Stream => "stream",
            Self::Session => "session",
            Self::Watch => "watch",
            Self::Health => "health",
        }
    }

    /// Whether its answers have no end.
    pub(crate) fn is_stream(self) -> bool {
        matches!(self, Self::Stream | Self::Session | Self::Watch)
    }

    pub(crate) fn index(self) -> usize {
        self as usize
    }
}

/// Which process serves an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Daemon {
    /// The one near the drones.
    Edge,
    /// The central one that edges follow.
    Registry,
}

impl Daemon {
    /// The name in texts for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Edge => "edge",
            Self::Registry => "registry",
        }
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
    /// The only daemon that serves it; none: both do.
    pub daemon: Option<Daemon>,
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

    /// Whether a daemon serves it at all.
    pub fn is_of(self, daemon: Daemon) -> bool {
        self.row().daemon.is_none_or(|only| only == daemon)
    }

    /// Whether its body may be a whole network, or all zones of a country, which are larger than
    /// all else that is sent.
    pub fn takes_file(self) -> bool {
        matches!(
            self,
            Self::RegistryPutNetwork | Self::RegistryPatchNetwork | Self::ImportZones
        )
    }

    /// Whether its body may be compressed with gzip. Who handles it bounds what comes of it.
    pub fn takes_gzip(self) -> bool {
        self == Self::TakePositions
    }

    /// The operation of a daemon behind a method and a path, of either dialect.
    pub fn of(daemon: Daemon, method: &Method, path: &str) -> Option<Self> {
        Self::of_grpc(daemon, path)
            .filter(|_| method == Method::POST)
            .or_else(|| Self::of_rest(daemon, method, path).ok())
    }

    /// The operation of a daemon behind a gRPC path.
    pub fn of_grpc(daemon: Daemon, path: &str) -> Option<Self> {
        index::of(daemon).grpc(path)
    }

    /// The operation of a daemon behind a REST method and path. `HEAD` counts as `GET`.
    ///
    /// # Errors
    ///
    /// Nothing is at the path, or it has other methods.
    pub fn of_rest(daemon: Daemon, method: &Method, path: &str) -> Result<Self, Unresolved> {
        let routes = index::of(daemon).routes(path).ok_or(Unresolved::Path)?;
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
