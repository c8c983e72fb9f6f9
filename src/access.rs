//! Who calls: a role, which decides what may be done, and a subject, which decides to whose things.

use std::sync::Arc;

/// What a caller may do; `api::operations` has the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Role {
    /// A drone or its fleet: its own reports, telemetry and plans.
    Drone,
    /// An operator of airspace: zones, closures, and all that drones may.
    Operator,
    /// Another edge, or the registry.
    Edge,
    /// A collector of metrics.
    Metrics,
    /// Anyone on loopback where no tokens are configured.
    Anyone,
}

impl Role {
    /// The roles that a token can have.
    pub const OF_TOKENS: [Self; 4] = [Self::Drone, Self::Operator, Self::Edge, Self::Metrics];

    /// The name in a token file and in logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Drone => "drone",
            Self::Operator => "operator",
            Self::Edge => "edge",
            Self::Metrics => "metrics",
            Self::Anyone => "anyone",
        }
    }
}

/// Who calls.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Caller {
    /// What it may do.
    pub role: Role,
    /// A drone's id, a fleet (`fleet/` before every drone id of it), or `*`. Quotas and idempotency count per subject.
    pub subject: Arc<str>,
}

impl Caller {
    /// The caller on loopback where no tokens are configured.
    pub fn anyone() -> Self {
        Self {
            role: Role::Anyone,
            subject: Arc::from("*"),
        }
    }

    /// Whether this caller may speak for a drone: operators for all, a drone for itself, a fleet `f` for `f:...`; also for
    /// `f/...`, as drones of a fleet were called before.
    pub fn speaks_for(&self, drone_id: &str) -> bool {
        match self.role {
            Role::Operator | Role::Anyone => true,
            Role::Edge | Role::Metrics => false,
            Role::Drone => {
                let subject = &*self.subject;
                let of_fleet = drone_id
                    .strip_prefix(subject)
                    .is_some_and(|rest| rest.starts_with([':', '/']));
                subject == "*" || subject == drone_id || of_fleet
            }
        }
    }
}
