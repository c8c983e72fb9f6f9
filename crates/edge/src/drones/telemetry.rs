//! Telemetry: where drones are, and what they are told in return.

use super::places::Untaken;
use super::{BatterySeen, DRONE_ID_BYTES_MAX, Sighting};
use crate::failures::records::AnswerRecord;
use crate::plans::entry::PlanEntry;
use crate::snapshot::Snapshot;
use crate::{Edge, views, words};
use jiff::{SignedDuration, Timestamp};
use serde_json::Value;
use skyway_contract as wire;
use skyway_engine::geo::AltitudeReference;
use skyway_engine::recompose::Outcome;
use skyway_formats::ParsedReport;
use skyway_service::access::Caller;
use skyway_service::intake::{PageRequest, token};
use skyway_service::refusal::Refusal;
use std::borrow::Cow;
use std::sync::Arc;

/// So many positions are taken where they come in, which is a matter of microseconds; more of them aside.
const AT_ONCE: usize = 32;
/// Drones of one batch that are answered for being off their plans; the others with their next positions.
const OFF_PLAN_PER_BATCH: usize = 4;
/// How far a drone's clock may be ahead.
const AHEAD_MAX: SignedDuration = SignedDuration::from_secs(5);

impl Edge {
    /// Takes positions; each drone is told what it is asked to fly instead of its plan, if anything.
    ///
    /// # Errors
    /// When there are more positions than a batch may have. A position that cannot be read spoils no other.
    pub async fn telemetry(
        self: &Arc<Self>,
        caller: &Caller,
        batch: wire::Telemetry,
    ) -> Result<wire::TelemetryAnswer<'static>, Refusal> {
        self.check_batch("positions", batch.positions.len())?;
        let (mut answer, off_plan) = if batch.positions.len() <= AT_ONCE {
            self.take_positions(caller, batch)?
        } else {
            let (edge, caller) = (self.clone(), caller.clone());
            self.aside(move || edge.take_positions(&caller, batch))
                .await??
        };
        if off_plan.is_empty() {
            return Ok(answer);
        }
        let (edge, caller) = (self.clone(), caller.clone());
        let answering = self.aside(move || {
            let answers = off_plan.into_iter().map(|(place, report)| {
                let answered = edge.answer_off_plan(&caller, report);
                answered.map(|record| (place, record))
            });
            answers.flatten().collect::<Vec<_>>()
        });
        for (place, record) in answering.await? {
            tell_answer(&mut answer.positions[place], &record);
        }
        Ok(answer)
    }

    /// Takes positions, and gives the reports of those drones that are off their plans, each with its place.
    fn take_positions(
        &self,
        caller: &Caller,
        batch: wire::Telemetry,
    ) -> Result<(wire::TelemetryAnswer<'static>, Vec<(usize, ParsedReport)>), Refusal> {
        let snapshot = self.on_network()?;
        let now = self.clock.now();
        let mut off_plan = Vec::new();
        let mut positions = Vec::with_capacity(batch.positions.len());
        for (place, entry) in batch.positions.into_iter().enumerate() {
            let may_be_answered = off_plan.len() < OFF_PLAN_PER_BATCH;
            let (position, report) =
                self.take_position(caller, entry, (&snapshot, now), may_be_answered);
            positions.push(position);
            off_plan.extend(report.map(|report| (place, report)));
        }
        let stamp = self.stamp_of(&snapshot);
        Ok((wire::TelemetryAnswer { positions, stamp }, off_plan))
    }

    /// What is last known of each drone that the caller may see, by id.
    ///
    /// # Errors
    /// When the page is not one.
    pub fn drones(
        &self,
        caller: &Caller,
        page: &PageRequest,
    ) -> Result<wire::Drones<'static>, Refusal> {
        let page = page.check()?;
        let snapshot = self.snapshot();
        let may_see = |id: &str| caller.speaks_for(id);
        let (found, has_more) = self.drones.page(page.after.as_deref(), page.size, may_see);
        let next = found.last().filter(|_| has_more).map(|(id, _)| token(id));
        let drones = found.into_iter().map(|(id, sighting)| wire::DroneState {
            plan_id: snapshot
                .plan_of_drone(&id)
                .map(|plan| words::text(&plan.id)),
            stands_at: snapshot
                .landed_plan(&id)
                .map(|(_, landed)| words::node_id(snapshot.topology(), landed.node)),
            session_id: self.claims.session_of(&id).map(|id| words::text(&id)),
            unreceived: u32::try_from(snapshot.mail_of(&id, 0).count()).unwrap_or(u32::MAX),
            id: words::text(&id),
            location: sighting.coordinates,
            seen_at: words::instant(sighting.seen_at),
            altitude_m: sighting.altitude_m,
            altitude_reference: sighting.altitude_reference.map(reference_name),
            airborne: sighting.airborne,
            battery_fraction: sighting.battery.map(|battery| battery.fraction),
            ground_speed_mps: sighting.ground_speed_mps,
            heading_deg: sighting.heading_deg,
        });
        Ok(wire::Drones {
            drones: drones.collect(),
            next_page_token: next,
            stamp: self.stamp_of(&snapshot),
        })
    }

    fn take_position(
        &self,
        caller: &Caller,
        entry: Value,
        (snapshot, now): (&Snapshot, Timestamp),
        may_be_answered: bool,
    ) -> (wire::Position<'static>, Option<ParsedReport>) {
        let mut warnings = Vec::new();
        let drone_id = entry
            .get("drone_id")
            .and_then(Value::as_str)
            .map(str::to_owned);
        let read = read_entry(entry, &mut warnings);
        let accepted = match &read {
            None => false,
            Some(entry) if !caller.speaks_for(&entry.drone_id) => {
                let message = format!(
                    "'{}' may not speak for drone '{}'",
                    caller.subject, entry.drone_id
                );
                warnings.push(words::warning("drone_not_yours", &message));
                false
            }
            Some(entry) => self.see(entry, snapshot, now, &mut warnings),
        };
        // A drone whose position is refused, or cannot be read, has orders all the same.
        let own = drone_id.as_deref().filter(|drone| caller.speaks_for(drone));
        let plan = own.and_then(|drone| snapshot.plan_of_drone(drone));
        let wanted = plan.and_then(|plan| plan.wanted.as_deref());
        let off_plan = match (plan, &read) {
            (Some(plan), Some(entry)) if accepted && may_be_answered => {
                self.off_plan_report(snapshot, plan, entry, now)
            }
            _ => None,
        };
        let position = wire::Position {
            drone_id: drone_id.map(Cow::Owned),
            accepted,
            plan_id: plan.map(|plan| words::text(&plan.id)),
            affected: plan.is_some_and(|plan| snapshot.is_affected(plan)),
            wanted: wanted.map(|wanted| views::version(snapshot.topology(), wanted)),
            recomposition_id: None,
            warnings,
        };
        (position, off_plan)
    }

    /// Takes in where a drone says it is, unless it cannot be there or a later place is known; whether it was.
    fn see(
        &self,
        entry: &wire::TelemetryEntry,
        snapshot: &Snapshot,
        now: Timestamp,
        warnings: &mut Vec<wire::Warning<'static>>,
    ) -> bool {
        let Some(sighting) = read_sighting(entry, snapshot, now, warnings) else {
            return false;
        };
        let plan = snapshot.plan_of_drone(&entry.drone_id);
        let taken = self
            .judge_place(snapshot, plan, &entry.drone_id, &sighting)
            .and_then(|()| self.take_in(snapshot, plan, (&entry.drone_id, sighting), now));
        if let Err(why) = &taken {
            warnings.push(words::warning(why.code(), &why.to_string()));
        }
        taken.is_ok()
    }

    /// Keeps a sighting, and tells those whom it concerns.
    fn take_in(
        &self,
        snapshot: &Snapshot,
        plan: Option<&Arc<PlanEntry>>,
        (drone, sighting): (&str, Sighting),
        now: Timestamp,
    ) -> Result<(), Untaken> {
        let before = self.drones.last(drone);
        // Who says where it is and no more has not taken back what it said of its battery.
        let said = before.as_ref().and_then(|before| before.battery);
        let sighting = Sighting {
            battery: sighting.battery.or(said),
            ..sighting
        };
        let sighting = match plan {
            Some(plan) => self.held_against(snapshot, plan, sighting, before.as_ref()),
            None => sighting,
        };
        let flies = |drone: &str| snapshot.plan_of_drone(drone).is_some();
        if !self.drones.see(drone, sighting.clone(), flies) {
            return Err(Untaken::Outdated);
        }
        self.note_position(snapshot, drone, &sighting);
        self.tell_left(snapshot, drone, &sighting);
        if let Some(plan) = plan {
            self.tell_seen(snapshot, plan, (&sighting, before.as_ref()), now);
        }
        Ok(())
    }

    /// Keeps where a drone is for the registry, where one is followed and the network lies on earth.
    fn note_position(&self, snapshot: &Snapshot, drone: &str, sighting: &Sighting) {
        let is_on_earth = snapshot.topology().frame().is_geographic();
        if !is_on_earth || !self.settings.follows_registry {
            return;
        }
        let [lon, lat] = sighting.coordinates;
        let entry = wire::PositionEntry {
            drone_id: drone.to_owned(),
            at_ms: sighting.seen_at.as_millisecond(),
            lon,
            lat,
            altitude_m: sighting.altitude_m,
            battery_fraction: sighting.battery_here(),
            speed_mps: sighting.ground_speed_mps,
        };
        self.positions.add(entry);
    }
}

/// What an entry says of its drone; `None` where it names no place of this network. What cannot be used is left out with a
/// warning.
fn read_sighting(
    entry: &wire::TelemetryEntry,
    snapshot: &Snapshot,
    now: Timestamp,
    warnings: &mut Vec<wire::Warning<'static>>,
) -> Option<Sighting> {
    let Some(coordinates) = place_of(&entry.location, snapshot) else {
        let message = "'location' is not a place of this network; longitude comes first";
        warnings.push(words::warning("location_ignored", message));
        return None;
    };
    let seen_at = read_instant(entry.timestamp.as_deref(), now, warnings);
    let battery = fraction(entry.battery_fraction, warnings);
    Some(Sighting {
        coordinates,
        seen_at,
        altitude_m: entry.altitude_m.filter(|value| value.is_finite()),
        battery: battery.map(|fraction| BatterySeen {
            fraction,
            at: seen_at,
        }),
        ground_speed_mps: entry.ground_speed_mps.filter(|value| value.is_finite()),
        heading_deg: entry.heading_deg.filter(|value| value.is_finite()),
        altitude_reference: reference(entry, warnings),
        airborne: entry.airborne,
        flown: None,
        rests: None,
        at_stop: None,
        agreement: None,
    })
}

/// When a drone was where it says; now, with a warning, where that cannot be read or is still to come.
fn read_instant(
    stated: Option<&str>,
    now: Timestamp,
    warnings: &mut Vec<wire::Warning<'static>>,
) -> Timestamp {
    let Some(text) = stated else {
        return now;
    };
    match text.parse::<Timestamp>() {
        Ok(seen_at) if seen_at.duration_since(now) <= AHEAD_MAX => return seen_at,
        Ok(seen_at) => {
            let message = format!("{seen_at} is ahead of {now}; now is taken");
            warnings.push(words::warning("timestamp_ahead", &message));
        }
        Err(_) => {
            let message = format!("'{text}' is not an instant in RFC 3339; now is taken");
            warnings.push(words::warning("timestamp_ignored", &message));
        }
    }
    now
}

/// Tells a drone that was off its plan what it was answered.
fn tell_answer(position: &mut wire::Position<'static>, record: &AnswerRecord) {
    let topology = record.airspace.topology();
    let version = record.plan.as_ref().and_then(|plan| plan.version.as_ref());
    // Where it changes nothing, what the drone was to fly before stands.
    if let Some(version) = version {
        position.affected |= version.outcome != Some(Outcome::Unaffected);
        position.wanted = Some(views::version(topology, version));
    }
    position.recomposition_id = Some(Cow::Owned(record.id()));
}

/// Reads one entry; unknown fields are passed over with a warning, what is wrong otherwise is told.
fn read_entry(
    mut entry: Value,
    warnings: &mut Vec<wire::Warning<'static>>,
) -> Option<wire::TelemetryEntry> {
    const FIELDS: [&str; 11] = [
        "drone_id",
        "location",
        "timestamp",
        "altitude_m",
        "altitude_reference",
        "airborne",
        "leg",
        "fraction",
        "battery_fraction",
        "ground_speed_mps",
        "heading_deg",
    ];
    if let Some(fields) = entry.as_object_mut() {
        fields.retain(|name, _| {
            let is_known = FIELDS.contains(&name.as_str());
            if !is_known {
                let message = format!("the field '{name}' is not known and ignored");
                warnings.push(words::warning("unknown_field", &message));
            }
            is_known
        });
    }
    match serde_json::from_value::<wire::TelemetryEntry>(entry) {
        Ok(entry) if entry.drone_id.is_empty() || entry.drone_id.len() > DRONE_ID_BYTES_MAX => {
            let message = format!("'drone_id' has to have 1 to {DRONE_ID_BYTES_MAX} bytes");
            warnings.push(words::warning("drone_id_invalid", &message));
            None
        }
        Ok(entry) => Some(entry),
        Err(error) => {
            warnings.push(words::warning("position_unreadable", &error.to_string()));
            None
        }
    }
}

pub(crate) fn place_of(place: &wire::Place, snapshot: &Snapshot) -> Option<[f64; 2]> {
    let topology = snapshot.topology();
    let frame = topology.frame();
    let coordinates = match place {
        wire::Place::Pair(pair) => *pair,
        wire::Place::Planar { x, y } => [*x, *y],
        wire::Place::Node(node) => {
            let position = topology.position(topology.node(node.text())?);
            return Some(frame.from_plane(position));
        }
    };
    let [first, second] = coordinates;
    let is_on_earth = !frame.is_geographic() || (first.abs() <= 180.0 && second.abs() <= 90.0);
    (is_on_earth && frame.to_plane(coordinates).is_finite()).then_some(coordinates)
}

/// What a height is measured from, where that is said.
fn reference(
    entry: &wire::TelemetryEntry,
    warnings: &mut Vec<wire::Warning<'static>>,
) -> Option<AltitudeReference> {
    entry.altitude_m?;
    match entry.altitude_reference.as_deref() {
        None => None,
        Some("amsl") => Some(AltitudeReference::Amsl),
        Some("agl") => Some(AltitudeReference::Agl),
        Some("wgs84") => Some(AltitudeReference::Wgs84),
        Some(other) => {
            let message =
                format!("'altitude_reference' is 'amsl', 'agl' or 'wgs84', not '{other}'");
            warnings.push(words::warning("altitude_reference_ignored", &message));
            None
        }
    }
}

fn reference_name(reference: AltitudeReference) -> Cow<'static, str> {
    Cow::Borrowed(match reference {
        AltitudeReference::Agl => "agl",
        AltitudeReference::Amsl => "amsl",
        AltitudeReference::Wgs84 => "wgs84",
    })
}

fn fraction(value: Option<f64>, warnings: &mut Vec<wire::Warning<'static>>) -> Option<f64> {
    let value = value?;
    if (0.0..=1.0).contains(&value) {
        return Some(value);
    }
    let hint = match (0.0..=100.0).contains(&value) {
        true => format!("; did you mean {}?", value / 100.0),
        false => String::new(),
    };
    let message = format!("'battery_fraction' {value} is not between 0 and 1{hint}");
    warnings.push(words::warning("battery_ignored", &message));
    None
}
