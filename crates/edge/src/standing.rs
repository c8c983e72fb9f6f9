//! How current an edge is.

use skyway_contract as wire;

/// How current the edge was when it answered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Staleness {
    pub(super) registry_revision: Option<wire::RegistryRevision>,
    pub(super) registry_age_s: Option<f64>,
    pub(super) freshness: wire::Freshness,
    pub(super) clock: wire::ClockKind,
}

impl Staleness {
    /// Says in an earlier answer how current the edge is now.
    pub(super) fn put_into(self, stamp: &mut wire::Stamp<'static>) {
        stamp.registry_revision = self.registry_revision;
        stamp.registry_age_s = self.registry_age_s;
        stamp.freshness = self.freshness;
        stamp.clock = self.clock;
    }
}
