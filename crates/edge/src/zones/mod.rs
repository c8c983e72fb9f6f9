//! No-fly zones: put, changed, deleted, listed, and previewed; in this folder also closures, feeds, and what waits for an
//! operator.
//!
//! What a zone closes is worked out beside the writer; the writer checks versions, puts it into force and
//! tells which plans it meets.

mod closures;
mod decisions;
mod effects;
pub(crate) mod import;

use crate::drones::progress;
use crate::entries::ZoneEntry;
use crate::plans::fleet::{self, Detour, DetourMeans};
use crate::replies::Idempotency;
use crate::snapshot::Snapshot;
use crate::state::{check_expected, check_new_zone};
use crate::writer::commands::{Command, Done, Outcome, unexpected};
use crate::{Edge, views};
use serde_json::Value;
use skyway_contract as wire;
use skyway_engine::airspace::{Change, Closure, Hits, Zone};
use skyway_formats::{ZoneId, write_ed318, zone_to_feature};
use skyway_service::access::Caller;
use skyway_service::intake::{Expected, PageRequest, filtered, read_zone, token};
use skyway_service::refusal::{Code, Refusal};
use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// The longest reason, in characters.
const REASON_MAX: usize = 256;

/// How a zone is to be written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ZoneWrite {
    /// The zone, where the request names it.
    pub id: Option<String>,
    /// Entity tags of the version it replaces, as in `If-Match`.
    pub if_match: Option<String>,
    /// The same checks and the same answer, without effect.
    pub validate_only: bool,
}

/// Why something is lifted, for events and the log.
pub(crate) fn checked_reason(reason: Option<String>) -> Result<Option<Arc<str>>, Refusal> {
    let count = reason.as_deref().map_or(0, |text| text.chars().count());
    if count > REASON_MAX {
        let message = format!("the reason has {count} characters, at most {REASON_MAX} are kept");
        let fault = wire::Fault {
            code: "too_long".to_owned(),
            pointer: "?reason".to_owned(),
            message,
            hint: None,
        };
        return Err(Refusal::at(Code::ParameterInvalid, fault));
    }
    Ok(reason.filter(|text| !text.is_empty()).map(Arc::from))
}

/// A zone that has been read, and the state that it was worked out on.
struct ReadZone {
    closure: Arc<Closure>,
    on: Arc<Snapshot>,
}

impl Edge {
    /// Puts a new zone.
    ///
    /// # Errors
    /// When it is not valid, or its id is taken.
    pub async fn create_zone(
        self: &Arc<Self>,
        caller: &Caller,
        feature: Value,
        write: ZoneWrite,
        idempotency: Idempotency,
    ) -> Result<wire::ZoneAck<'static>, Refusal> {
        let (edge, author) = (self.clone(), caller.clone());
        let put = async move {
            let number = edge.next_number.fetch_add(1, Ordering::Relaxed);
            let made = format!("zone-{}-{number}", edge.epoch);
            let read = edge.read_zone(feature, None, made).await?;
            let put = edge.put(&author, read, Expected::Absent, write.validate_only);
            put.await.map(|(ack, _)| ack)
        };
        let now = self.clock.now();
        // A check without effect is not a write that a key could stand for.
        let idempotency = match write.validate_only {
            true => Idempotency::default(),
            false => idempotency,
        };
        self.write_replies
            .once(&caller.subject, "create_zone", idempotency, now, put)
            .await
    }

    /// Puts a zone under an id; also tells whether it is new.
    ///
    /// # Errors
    /// When it is not valid, or `If-Match` is missing or stale where there is one already.
    pub async fn put_zone(
        self: &Arc<Self>,
        caller: &Caller,
        feature: Value,
        write: ZoneWrite,
    ) -> Result<(wire::ZoneAck<'static>, bool), Refusal> {
        let id = write.id.unwrap_or_default();
        let read = self.read_zone(feature, Some(id.clone()), id).await?;
        self.put(
            caller,
            read,
            Expected::of(write.if_match),
            write.validate_only,
        )
        .await
    }

    /// Deletes a zone; what it closed alone opens again.
    ///
    /// # Errors
    /// When there is none, or `If-Match` is missing or stale.
    pub async fn delete_zone(
        self: &Arc<Self>,
        caller: &Caller,
        write: ZoneWrite,
        reason: Option<String>,
    ) -> Result<wire::ZoneAck<'static>, Refusal> {
        let reason = checked_reason(reason)?;
        let id = write.id.unwrap_or_default();
        let expected = Expected::of(write.if_match);
        let before = self.snapshot();
        let closure = before.airspace.closure(&id).cloned();
        let (entry, after, durable) = if write.validate_only {
            let entry = before.zones.get(id.as_str()).cloned();
            let entry = entry.ok_or_else(|| Refusal::not_found("zone", &id))?;
            check_expected(&expected, Some(entry.version), self.lineage, "zone", &id)?;
            (entry, before.clone(), false)
        } else {
            let command = Command::DeleteZone {
                id: id.clone(),
                expected,
            };
            let (outcome, after) = self.command(command.because(caller, reason)).await?;
            let Done::ZoneDeleted(entry) = outcome.done else {
                return Err(unexpected());
            };
            (entry, after, outcome.durable)
        };
        let Some(closure) = closure else {
            return Err(Refusal::not_found("zone", &id));
        };
        // In the words of the network that its closure is on.
        let mut effect = effects::effect(&before.airspace, &closure, &[]);
        // Where it is gone nothing of it is to come.
        if after.airspace.closure(&id).is_none() {
            effect.in_force = false;
            effect.closes_from = None;
        }
        Ok(wire::ZoneAck {
            zone: zone_to_feature(&entry.zone),
            etag: Some(Cow::Owned(after.etag(entry.version))),
            enforced: false,
            durable,
            effect,
            stamp: self.stamp_of(&after),
        })
    }

    /// What a zone would close and which plans it would meet; nothing changes.
    ///
    /// # Errors
    /// When it is not valid.
    pub async fn preview_zone(
        self: &Arc<Self>,
        _caller: &Caller,
        feature: Value,
    ) -> Result<wire::ZoneAck<'static>, Refusal> {
        let read = self.read_zone(feature, None, "preview".to_owned()).await?;
        self.preview(read, None).await
    }

    /// A zone as a GeoJSON feature, and its entity tag.
    ///
    /// # Errors
    /// When there is none.
    pub fn zone(&self, _caller: &Caller, id: &str) -> Result<(Value, String), Refusal> {
        let snapshot = self.snapshot();
        let entry = snapshot
            .zones
            .get(id)
            .ok_or_else(|| Refusal::not_found("zone", id))?;
        Ok((zone_to_feature(&entry.zone), snapshot.etag(entry.version)))
    }

    /// A page of zones, by id.
    ///
    /// # Errors
    /// When the page is not one.
    pub fn zones(
        &self,
        _caller: &Caller,
        page: &PageRequest,
    ) -> Result<wire::ZoneList<'static>, Refusal> {
        let page = page.check()?;
        let snapshot = self.snapshot();
        let after = page.after.as_deref().map(Arc::from);
        let (told, next) = filtered(&snapshot.zones, after, page.size, |_| true);
        Ok(wire::ZoneList {
            kind: Cow::Borrowed("FeatureCollection"),
            features: told
                .iter()
                .map(|entry| views::zone_feature(entry))
                .collect(),
            etags: told
                .iter()
                .map(|entry| Cow::Owned(snapshot.etag(entry.version)))
                .collect(),
            next_page_token: next.map(|id| token(&id)),
            stamp: self.stamp_of(&snapshot),
        })
    }

    /// All zones as the text of an ED-318 collection, and the world of that answer.
    ///
    /// # Errors
    /// While there is no network, and where it is planar.
    pub fn zones_as_ed318(
        &self,
        _caller: &Caller,
    ) -> Result<(String, wire::Stamp<'static>), Refusal> {
        let snapshot = self.on_network()?;
        let zones = snapshot.zones.values().map(|entry| &*entry.zone);
        let text = write_ed318(zones, snapshot.topology().frame()).map_err(|problem| {
            let fault = wire::Fault {
                code: problem.code.to_owned(),
                pointer: "accept".to_owned(),
                message: problem.message,
                hint: problem.hint,
            };
            Refusal::at(Code::ParameterInvalid, fault)
        })?;
        Ok((text, self.stamp_of(&snapshot)))
    }

    /// Reads a zone and works out what it closes; `id` fixes its id, else `made` is the id of one that states none.
    async fn read_zone(
        self: &Arc<Self>,
        feature: Value,
        id: Option<String>,
        made: String,
    ) -> Result<ReadZone, Refusal> {
        let on = self.on_network()?;
        let margin_m = self.settings.margin_m;
        self.aside(move || {
            let id = match &id {
                Some(id) => ZoneId::Fixed(id),
                None => ZoneId::StatedOr(&made),
            };
            let topology = on.topology();
            let zone = read_zone(feature, id, topology.frame(), margin_m)?;
            let closure = Arc::new(Closure::of_zone(topology, Arc::new(zone)));
            Ok(ReadZone { closure, on })
        })
        .await?
    }

    async fn put(
        self: &Arc<Self>,
        caller: &Caller,
        read: ReadZone,
        expected: Expected,
        validate_only: bool,
    ) -> Result<(wire::ZoneAck<'static>, bool), Refusal> {
        let closure = read.closure.clone();
        if validate_only {
            let zones = &read.on.zones;
            let current = zones.get(closure.id.as_str()).map(|entry| entry.version);
            check_expected(&expected, current, self.lineage, "zone", &closure.id)?;
            let ack = self.preview(read, current).await?;
            return Ok((ack, current.is_none()));
        }
        let command = Command::PutZone {
            closure: closure.clone(),
            expected,
        };
        let command = command.made_on(read.on.topology());
        let (outcome, snapshot) = self.command(command.by(caller)).await?;
        let Outcome {
            done: Done::Zone { entry, created },
            durable,
            detours,
            pending,
        } = outcome
        else {
            return Err(unexpected());
        };
        // As it was put, on the network there is now; one that went in the same moment closes nothing.
        let held = snapshot.airspace.closure(&closure.id).cloned();
        let held = held.unwrap_or_else(|| {
            let hits = Hits::default();
            Arc::new(Closure {
                hits,
                ..(*closure).clone()
            })
        });
        let ack = self.ack(&entry, &held, &snapshot, durable, (&detours, pending));
        Ok((ack, created))
    }

    fn ack(
        &self,
        entry: &ZoneEntry,
        closure: &Closure,
        snapshot: &Snapshot,
        durable: bool,
        (detours, pending): (&[Detour], usize),
    ) -> wire::ZoneAck<'static> {
        let met: Vec<&Detour> = detours
            .iter()
            .filter(|detour| detour.plan.affected_by.contains(&closure.id))
            .collect();
        wire::ZoneAck {
            zone: zone_to_feature(&entry.zone),
            etag: Some(Cow::Owned(snapshot.etag(entry.version))),
            enforced: true,
            durable,
            effect: effects::effect_with_pending(&snapshot.airspace, closure, (&met, pending)),
            stamp: self.stamp_of(snapshot),
        }
    }

    /// What a zone would do, in a world that is thrown away afterwards.
    async fn preview(
        self: &Arc<Self>,
        read: ReadZone,
        version: Option<u64>,
    ) -> Result<wire::ZoneAck<'static>, Refusal> {
        let (id, zones) = (&*read.closure.id, &read.on.zones);
        if !zones.contains_key(id) {
            check_new_zone(&read.on, self.settings.zones_max, id)?;
        }
        let edge = self.clone();
        self.aside(move || {
            let ReadZone {
                closure,
                on: snapshot,
            } = read;
            let zone: Option<Arc<Zone>> = closure.zone().cloned();
            let zone = zone.ok_or_else(unexpected)?;
            let now = edge.clock.now();
            let put = [Change::Put(closure.clone())];
            let closures = std::slice::from_ref(&closure);
            let (airspace, detours) = edge.imagine(&snapshot, &put, closures, now);
            let met: Vec<&Detour> = detours.iter().collect();
            // With the windows that its schedules have now.
            let closure = airspace.closure(&closure.id).unwrap_or(&closure);
            Ok(wire::ZoneAck {
                zone: zone_to_feature(&zone),
                etag: version.map(|version| Cow::Owned(snapshot.etag(version))),
                enforced: false,
                durable: false,
                effect: effects::effect(&airspace, closure, &met),
                stamp: edge.stamp_of(&snapshot),
            })
        })
        .await?
    }

    /// The airspace after some changes, and what the drones of the plans would be told that any of these closures meets.
    pub(crate) fn imagine(
        &self,
        snapshot: &Snapshot,
        changes: &[Change],
        closures: &[Arc<Closure>],
        now: jiff::Timestamp,
    ) -> (Arc<skyway_engine::airspace::Airspace>, Vec<Detour>) {
        let airspace = Arc::new(snapshot.airspace.apply(changes, now));
        let closures: Vec<Arc<Closure>> = closures
            .iter()
            .filter_map(|closure| airspace.closure(&closure.id).cloned())
            .collect();
        let means = DetourMeans {
            scene: snapshot.scene_in(&airspace, now),
            planner: &*self.planner,
            drones: &self.drones,
        };
        let topology = airspace.topology();
        let mut detours = Vec::new();
        for plan in snapshot.plans.values().filter(|plan| plan.is_active()) {
            let progress = progress::progress_or_wait(topology, plan, &self.drones, now);
            let Some(progress) = progress else {
                continue;
            };
            let ahead = progress::ahead(plan, &progress);
            let is_met =
                |closure: &Arc<Closure>| self.planner.is_met(means.scene, plan, ahead, closure);
            if closures.iter().any(is_met) {
                detours.push(fleet::detour(plan, &progress, &means));
            }
        }
        (airspace, detours)
    }
}
