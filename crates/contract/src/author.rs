//! Who made a change.

use serde::{Deserialize, Serialize};

/// The header that tells a registry who made a change at an edge: `ROLE:SUBJECT`.
pub const ON_BEHALF_OF: &str = "skyway-on-behalf-of";

/// The tenant by default.
pub const TENANT: &str = "local";

/// Who made a change: on every event, on every row, and told to the registry with what is forwarded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Author {
    /// Whose airspace it is; `local` where there is one alone.
    pub tenant: String,
    /// The subject of the token: a drone, a fleet, an operator; `*` where everyone may call. Of what the edge does by
    /// itself the edge's, of what it follows the registry's.
    pub subject: String,
    /// The role: `drone`, `operator`, `anyone`, `edge` or `registry`.
    pub role: String,
}

impl Author {
    /// An author of the only tenant there is.
    pub fn new(role: &str, subject: &str) -> Self {
        Self {
            tenant: TENANT.to_owned(),
            subject: subject.to_owned(),
            role: role.to_owned(),
        }
    }
}
