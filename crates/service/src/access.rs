//! Who calls: a role, which decides what may be done, and a subject and a tenant, which decide with whose things.

use std::sync::Arc;

/// The tenant of callers and things for whom none is named.
pub const LOCAL_TENANT: &str = "local";

/// The longest name of a tenant, in bytes.
pub const TENANT_BYTES_MAX: usize = 64;

/// Whether a name is one of a tenant. It stands before the colon in ids of drones, and in paths.
pub fn is_tenant(name: &str) -> bool {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_.".contains(letter);
    (1..=TENANT_BYTES_MAX).contains(&name.len()) && name.chars().all(is_plain)
}

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
    /// Who runs drones and sells deliveries: its own drones, services and flights.
    Provider,
    /// Who orders deliveries: its own orders.
    Customer,
    /// Anyone on loopback where no tokens are configured.
    Anyone,
}

impl Role {
    /// The roles that a token can have.
    pub const OF_TOKENS: [Self; 6] = [
        Self::Drone,
        Self::Operator,
        Self::Edge,
        Self::Metrics,
        Self::Provider,
        Self::Customer,
    ];

    /// The name in a token file and in logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Drone => "drone",
            Self::Operator => "operator",
            Self::Edge => "edge",
            Self::Metrics => "metrics",
            Self::Provider => "provider",
            Self::Customer => "customer",
            Self::Anyone => "anyone",
        }
    }

    /// Whether it is that of a tenant, which sees only its own things.
    pub fn is_of_tenant(self) -> bool {
        matches!(self, Self::Provider | Self::Customer)
    }
}

/// Whose a thing is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Owners<'a> {
    /// The tenant that it belongs to.
    pub tenant: &'a str,
    /// The tenant that is party to it; empty where there is none.
    pub party: &'a str,
}

/// Who calls.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Caller {
    /// What it may do.
    pub role: Role,
    /// A drone's id, a fleet (`fleet:` before every drone id of it), or `*`; that of a provider or customer begins with its
    /// tenant. Quotas and idempotency count per subject.
    pub subject: Arc<str>,
    /// To which provider or customer it belongs.
    pub tenant: Arc<str>,
    /// The only network that an edge may speak of; every one where none is named.
    pub network: Option<Arc<str>>,
}

impl Caller {
    /// The caller on loopback where no tokens are configured.
    pub fn anyone() -> Self {
        Self::local(Role::Anyone, "*")
    }

    /// A caller of no provider or customer.
    pub fn local(role: Role, subject: &str) -> Self {
        Self {
            role,
            subject: Arc::from(subject),
            tenant: Arc::from(LOCAL_TENANT),
            network: None,
        }
    }

    /// Whether this caller may speak of a network.
    pub fn is_of_network(&self, network: &str) -> bool {
        self.network.as_deref().is_none_or(|own| own == network)
    }

    /// Whether this caller may speak for a drone: operators for all, a drone for itself, a fleet `f` for `f:...`; also for
    /// `f/...`, as drones of a fleet were called before. A provider speaks for its fleet.
    pub fn speaks_for(&self, drone_id: &str) -> bool {
        let is_of = |fleet: &str| {
            drone_id
                .strip_prefix(fleet)
                .is_some_and(|rest| rest.starts_with([':', '/']))
        };
        match self.role {
            Role::Operator | Role::Anyone => true,
            Role::Edge | Role::Metrics | Role::Customer => false,
            Role::Provider => is_of(&self.tenant),
            Role::Drone => {
                let subject = &*self.subject;
                subject == "*" || subject == drone_id || is_of(subject)
            }
        }
    }

    /// Whether this caller may know of a thing at all: a provider or customer of what is its own or what it is party to.
    /// To who may not, the thing is not there.
    pub fn sees(&self, owners: &Owners<'_>) -> bool {
        match self.role {
            Role::Operator | Role::Anyone => true,
            Role::Drone | Role::Edge | Role::Metrics => false,
            Role::Provider | Role::Customer => {
                [owners.tenant, owners.party].contains(&&*self.tenant)
            }
        }
    }

    /// For which tenant this caller acts where its request states one: a provider or customer for itself alone, others for
    /// the one that is stated, or the local one. None where it may not.
    pub fn acts_for<'a>(&'a self, stated: Option<&'a str>) -> Option<&'a str> {
        if self.role.is_of_tenant() {
            return stated
                .is_none_or(|stated| *stated == *self.tenant)
                .then_some(&*self.tenant);
        }
        Some(stated.unwrap_or(LOCAL_TENANT))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(role: Role, subject: &str, tenant: &str) -> Caller {
        Caller {
            tenant: Arc::from(tenant),
            ..Caller::local(role, subject)
        }
    }

    #[test]
    fn a_provider_speaks_for_its_fleet_and_a_customer_for_no_drone() {
        let provider = of(Role::Provider, "acme/desk", "acme");
        assert!(provider.speaks_for("acme:7"));
        for other in ["acme", "acmes:7", "other:7", ""] {
            assert!(!provider.speaks_for(other), "{other}");
        }
        assert!(!of(Role::Customer, "acme/desk", "acme").speaks_for("acme:7"));
        assert!(of(Role::Drone, "acme", LOCAL_TENANT).speaks_for("acme:7"));
    }

    #[test]
    fn tenants_see_what_is_theirs_or_what_they_are_party_to() {
        let order = Owners {
            tenant: "shop",
            party: "acme",
        };
        let unassigned = Owners {
            tenant: "shop",
            party: "",
        };
        for role in [Role::Provider, Role::Customer] {
            assert!(of(role, "shop/a", "shop").sees(&order));
            assert!(of(role, "acme/a", "acme").sees(&order));
            assert!(!of(role, "acme/a", "acme").sees(&unassigned));
            assert!(!of(role, "shop/a", "other").sees(&order));
        }
        for role in [Role::Drone, Role::Edge, Role::Metrics] {
            assert!(!of(role, "shop", "shop").sees(&order));
        }
        assert!(of(Role::Operator, "*", LOCAL_TENANT).sees(&order));
    }

    #[test]
    fn a_tenant_acts_for_itself_alone() {
        let shop = of(Role::Customer, "shop/a", "shop");
        assert_eq!(shop.acts_for(None), Some("shop"));
        assert_eq!(shop.acts_for(Some("shop")), Some("shop"));
        assert_eq!(shop.acts_for(Some("other")), None);
        let anyone = Caller::anyone();
        assert_eq!(anyone.acts_for(None), Some(LOCAL_TENANT));
        assert_eq!(anyone.acts_for(Some("shop")), Some("shop"));
    }
}
