//! The pack of a plan: what its drone does when the line is gone, signed, as `crates/pack` lays it out.

mod ways;

use super::entry::PlanEntry;
use super::own_plan;
use crate::Edge;
use crate::planner::Version;
use crate::snapshot::Snapshot;
use crate::words::instant;
use bytes::Bytes;
use jiff::SignedDuration;
use sha2::{Digest, Sha256};
use skyway_contract::{self as wire, ClockKind, PackKeyState};
use skyway_engine::geo::AltitudeReference;
use skyway_engine::network::NodeIx;
use skyway_pack::write::{Draft, DraftLeg};
use skyway_pack::{Clock, HeightReference};
use skyway_service::access::Caller;
use skyway_service::config::{PackKey, PackKeys};
use skyway_service::refusal::{Code, Refusal};
use std::borrow::Cow;
use std::sync::Arc;
use ways::{Closing, PackedVersion};

/// So long after the arrival of its plan a pack still lets a drone depart: it only stops those who come much too late.
const DEPARTURES_AFTER_ARRIVAL: SignedDuration = SignedDuration::from_mins(10);
/// Bytes of a pack's digest that are its entity tag.
const ETAG_BYTES: usize = 16;
/// Tenths in a second.
const TENTHS: f64 = 10.0;

impl Edge {
    /// The pack of a version of a plan, and its entity tag: of the one that its drone says it flies, where none is named.
    ///
    /// # Errors
    /// When there is no plan that the caller may see, it is over, or has no such version.
    pub fn pack(
        &self,
        caller: &Caller,
        id: &str,
        version: Option<u32>,
    ) -> Result<(Bytes, String), Refusal> {
        let snapshot = self.snapshot();
        let plan = own_plan(&snapshot, caller, id)?;
        if !plan.is_active() {
            let detail = format!("plan '{id}' is over, and nobody flies by its pack any more");
            return Err(Refusal::new(Code::PlanStateConflict, detail));
        }
        let number = version.unwrap_or(plan.reported.number);
        let version = plan.versions().find(|version| version.number == number);
        let version = version.ok_or_else(|| {
            let detail = format!("plan '{id}' has no version {number} that its drone may fly");
            Refusal::new(Code::PlanStateConflict, detail)
        })?;
        let draft = self.draft(&snapshot, &plan, version);
        let written = draft.write(self.pack_keys.load().signing());
        let bytes = written.map_err(|why| Refusal::new(Code::PlanInvalid, why.to_string()))?;
        let etag = format!("\"{}\"", hex::encode(&Sha256::digest(&bytes)[..ETAG_BYTES]));
        Ok((Bytes::from(bytes), etag))
    }

    fn draft(&self, snapshot: &Snapshot, plan: &PlanEntry, version: &Version) -> Draft {
        let topology = snapshot.topology();
        let floor = self
            .settings
            .flight
            .as_ref()
            .map(|flight| flight.rules.floor);
        let not_after = version
            .arrives_at()
            .saturating_add(DEPARTURES_AFTER_ARRIVAL);
        let packed = PackedVersion {
            topology,
            version,
            floor: floor.unwrap_or_default(),
            reference: reference(snapshot, version),
            closing: Closing::of(snapshot, version),
        };
        let legs = 0..version.composition.legs.len();
        Draft {
            plan: plan.id.to_string(),
            network: topology.name().to_owned(),
            network_sha256: *topology.fingerprint(),
            // No edge takes a plan over yet.
            order: (0, version.epoch, version.number),
            not_after_ms: not_after.map_or(i64::MAX, |at| at.as_millisecond()),
            departs_ms: version.departs_at.as_millisecond(),
            clock: match self.clock.kind() {
                ClockKind::Real => Clock::Real,
                ClockKind::Simulated => Clock::Simulated,
                ClockKind::External => Clock::External,
            },
            heights: match packed.reference {
                None => HeightReference::Unknown,
                Some(AltitudeReference::Agl) => HeightReference::Agl,
                Some(AltitudeReference::Amsl) => HeightReference::Amsl,
                Some(AltitudeReference::Wgs84) => HeightReference::Wgs84,
            },
            is_planar: !topology.frame().is_geographic(),
            is_timed: version.flight.is_some(),
            has_first_stretch: version.stretch.is_some(),
            legs: legs.map(|number| drafted(&packed, number)).collect(),
        }
    }

    /// Packs are signed with these keys from now on.
    pub fn use_pack_keys(&self, keys: PackKeys) {
        self.pack_keys.store(Arc::new(keys));
    }

    /// Of its own keys, those with these ids are not to be believed any more; where one of them signs, a new one does from now on.
    pub(crate) fn revoke_pack_keys(&self, ids: &[String]) {
        let keys = self.pack_keys.load_full();
        let is_new =
            |key: &&PackKey| key.revoked_at.is_none() && ids.contains(&key.id().to_string());
        let revoked: Vec<_> = keys.keys().iter().filter(is_new).map(PackKey::id).collect();
        if revoked.is_empty() {
            return;
        }
        let mut seed = [0; 32];
        if let Err(error) = getrandom::fill(&mut seed) {
            tracing::error!(%error, "a revoked key goes on signing, as no new one can be made");
            return;
        }
        let now = self.clock.now();
        let mut kept = PackKeys::clone(&keys);
        for id in revoked {
            tracing::warn!(key = %id, "the registry has revoked a key of this edge");
            if kept.signing().id() == id {
                kept = kept.rotated(seed, now);
            }
            kept = kept.with_revoked(id, now);
        }
        self.use_pack_keys(kept);
    }

    /// The keys that it signs with, as they are now.
    pub fn pack_keys(&self) -> Arc<PackKeys> {
        self.pack_keys.load_full()
    }

    /// The keys that packs are, or were, signed with.
    pub fn list_pack_keys(&self) -> wire::PackKeys<'static> {
        let keys = self.pack_keys.load();
        wire::PackKeys {
            keys: keys.keys().iter().map(told).collect(),
            stamp: self.stamp(),
        }
    }
}

fn drafted(packed: &PackedVersion<'_>, number: usize) -> DraftLeg {
    let leg = &packed.version.composition.legs[number];
    let is_timed = packed.version.flight.is_some();
    let dips_half_m = packed.dips_half_m(leg.from, leg.to, leg.segment);
    DraftLeg {
        from: packed.node(leg.from),
        to: packed.node(leg.to),
        dips_half_m: dips_half_m.unwrap_or([u8::MAX; 2]),
        battery_e4: packed.battery_e4(number),
        departs_ds: is_timed.then(|| (leg.departure_s * TENTHS).max(0.0) as u32),
        lands_before: packed.lands_before(number),
        detour: packed.detour(number),
        alternate: packed.alternate(number),
    }
}

/// What the heights of a version are measured from: as that of its first node.
fn reference(snapshot: &Snapshot, version: &Version) -> Option<AltitudeReference> {
    let first: NodeIx = *version.composition.way.nodes.first()?;
    let altitude = snapshot.topology().node_altitude(first)?;
    Some(altitude.reference)
}

fn told(key: &PackKey) -> wire::PackKey<'static> {
    wire::PackKey {
        id: Cow::Owned(key.id().to_string()),
        algorithm: Cow::Borrowed("ed25519"),
        public_key: Cow::Owned(key.public_text()),
        valid_from: instant(key.made_at),
        valid_until: key.retired_at.map(instant),
        state: match (key.revoked_at, key.retired_at) {
            (Some(_), _) => PackKeyState::Revoked,
            (None, Some(_)) => PackKeyState::Retired,
            (None, None) => PackKeyState::Active,
        },
    }
}
