//! Where drones were: taken from edges, read by those whose drones they are, and dropped after a month.

use super::Dispatch;
use super::statistics::SPAN_MAX;
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{
    FleetPosition, PositionBatch, PositionEntry, PositionHistory, PositionsTaken,
};
use skyway_registry::documents::PositionRow;
use skyway_service::access::Caller;
use skyway_service::intake::Faults;
use skyway_service::refusal::{Code, Refusal};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// The most positions of a batch.
const BATCH_MAX: usize = 10_000;
/// The most positions that are read at once: one day of a drone that tells its place each second.
const READ_MAX: u64 = 100_000;
/// Positions that are read where nothing is said.
const READ_DEFAULT: u64 = 1_000;
/// How long what edges and senders told is kept.
const KEPT_FOR: SignedDuration = SignedDuration::from_hours(30 * 24);
/// How far ahead of the clock a position may be: clocks of edges differ.
const AHEAD_MAX: SignedDuration = SignedDuration::from_mins(5);
/// How far back a drone's last position is looked for.
const LAST_WITHIN: SignedDuration = SignedDuration::from_hours(7 * 24);
/// The longest id of a drone, in bytes.
const ID_BYTES_MAX: usize = 128;
/// The largest coordinate; on a planar network it is in metres.
const COORDINATE_MAX: f64 = 1e7;
/// How often what is old is dropped.
const DROP_EVERY: Duration = Duration::from_mins(10);

/// Which positions of a drone are asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PositionsAsked {
    /// From when on, RFC 3339; an hour before `until` where nothing is said.
    pub from: Option<String>,
    /// Until before when, RFC 3339; now where nothing is said.
    pub until: Option<String>,
    /// The most of them.
    pub limit: Option<u64>,
}

impl Dispatch {
    /// Keeps the positions that an edge tells. Those that cannot be are passed over: a drone with a wrong clock is not to
    /// hold up the others. So are drones of other networks where the caller is kept to one.
    ///
    /// # Errors
    /// When there is no such network, there are too many at once, or the store does not answer.
    pub async fn take_positions(
        &self,
        caller: &Caller,
        network: &str,
        edge: &str,
        batch: &PositionBatch,
    ) -> Result<PositionsTaken, Refusal> {
        let count = batch.positions.len();
        if count > BATCH_MAX {
            let mut faults = Faults::default();
            let message = format!("{count} positions are more than {BATCH_MAX}");
            let hint = "send them in several batches".to_owned();
            faults.add("too_many", "/positions", message, Some(hint));
            return Err(faults.refusal(Code::BodyInvalid, "batch"));
        }
        self.registry.topology(network).await?;
        let now = self.clock.now();
        let from_ms = shifted(now, -KEPT_FOR).as_millisecond();
        let until_ms = shifted(now, AHEAD_MAX).as_millisecond();
        let usable = batch.positions.iter();
        let usable =
            usable.filter(|entry| (from_ms..until_ms).contains(&entry.at_ms) && can_be(entry));
        let mut rows: Vec<PositionRow> = usable.map(row).collect();
        if caller.network.is_some() {
            let drones: BTreeSet<String> = rows.iter().map(|row| row.drone.clone()).collect();
            let mut strangers = BTreeSet::new();
            for drone in drones {
                let asked = (&*self.documents, self.clock.now());
                if self.enrolled.is_elsewhere(&drone, network, asked).await? {
                    strangers.insert(drone);
                }
            }
            rows.retain(|row| !strangers.contains(&row.drone));
        }
        let (passed_over, left_out) = (count - rows.len(), batch.left_out);
        if passed_over > 0 || left_out > 0 {
            tracing::warn!(
                network,
                edge,
                passed_over,
                left_out,
                "positions are not kept"
            );
        }
        let stored = self.documents.keep_positions(&rows).await?;
        Ok(PositionsTaken { stored })
    }

    /// Where a drone was, oldest first.
    ///
    /// # Errors
    /// When the caller does not speak for the drone, a parameter is none, or the store does not answer.
    pub async fn positions(
        &self,
        caller: &Caller,
        drone: &str,
        asked: &PositionsAsked,
    ) -> Result<PositionHistory, Refusal> {
        if !caller.speaks_for(drone) {
            return Err(Refusal::not_found("drone", drone));
        }
        let mut faults = Faults::default();
        let until = faults.instant("?until", asked.until.as_deref());
        let until = until.unwrap_or_else(|| self.clock.now());
        let from = faults.instant("?from", asked.from.as_deref());
        let from = from.unwrap_or_else(|| shifted(until, SignedDuration::from_hours(-1)));
        let limit = asked.limit.unwrap_or(READ_DEFAULT);
        if limit == 0 || limit > READ_MAX {
            let message = format!("{limit} is not between 1 and {READ_MAX}");
            faults.add("out_of_range", "?limit", message, None);
        }
        faults.check(Code::ParameterInvalid, "query")?;
        let (from_ms, until_ms) = (from.as_millisecond(), until.as_millisecond());
        let rows = self
            .documents
            .positions(drone, from_ms, until_ms, limit + 1);
        let mut positions: Vec<PositionEntry> = rows.await?.into_iter().map(entry).collect();
        let is_whole = positions.len() as u64 <= limit;
        let next_from = if is_whole {
            None
        } else {
            let next = positions.pop();
            next.map(|next| instant(next.at_ms).to_string())
        };
        Ok(PositionHistory {
            positions,
            next_from,
        })
    }

    /// Where each of some drones was last, by id.
    pub(super) async fn last_positions(
        &self,
        drones: &[String],
    ) -> Result<BTreeMap<String, FleetPosition>, Refusal> {
        let from_ms = shifted(self.clock.now(), -LAST_WITHIN).as_millisecond();
        let rows = self.documents.last_positions(drones, from_ms).await?;
        let places = rows.into_iter().map(|row| {
            let place = FleetPosition {
                at: instant(row.at_ms).to_string(),
                lon: row.lon,
                lat: row.lat,
                battery_fraction: row.battery_fraction,
            };
            (row.drone, place)
        });
        Ok(places.collect())
    }

    /// Drops what is no longer kept, for ever.
    pub(super) async fn drop_what_is_old(&self) {
        loop {
            tokio::time::sleep(DROP_EVERY).await;
            let now = self.clock.now();
            let [before_ms, failures_before_ms] =
                [KEPT_FOR, SPAN_MAX].map(|span| shifted(now, -span).as_millisecond());
            let dropped = self.documents.drop_before(before_ms, failures_before_ms);
            if let Err(error) = dropped.await {
                tracing::warn!(%error, "positions, messages and failures of long ago are not dropped");
            }
        }
    }
}

/// An instant so much later; at the ends of the calendar, the same.
pub(super) fn shifted(at: Timestamp, by: SignedDuration) -> Timestamp {
    at.saturating_add(by).unwrap_or(at)
}

fn instant(at_ms: i64) -> Timestamp {
    Timestamp::from_millisecond(at_ms).unwrap_or_default()
}

/// Whether a position is one: a named drone, numbers that are some.
fn can_be(entry: &PositionEntry) -> bool {
    let id = &entry.drone_id;
    let is_named = (1..=ID_BYTES_MAX).contains(&id.len()) && !id.chars().any(char::is_control);
    let is_place = [entry.lon, entry.lat]
        .iter()
        .all(|coordinate| coordinate.abs() <= COORDINATE_MAX);
    let optional = [entry.altitude_m, entry.speed_mps];
    let are_finite = optional.iter().flatten().all(|number| number.is_finite());
    let has_battery = entry
        .battery_fraction
        .is_none_or(|fraction| (0.0..=1.0).contains(&fraction));
    is_named && is_place && are_finite && has_battery
}

fn row(entry: &PositionEntry) -> PositionRow {
    PositionRow {
        drone: entry.drone_id.clone(),
        at_ms: entry.at_ms,
        lon: entry.lon,
        lat: entry.lat,
        altitude_m: entry.altitude_m,
        battery_fraction: entry.battery_fraction,
        speed_mps: entry.speed_mps,
    }
}

fn entry(row: PositionRow) -> PositionEntry {
    PositionEntry {
        drone_id: row.drone,
        at_ms: row.at_ms,
        lon: row.lon,
        lat: row.lat,
        altitude_m: row.altitude_m,
        battery_fraction: row.battery_fraction,
        speed_mps: row.speed_mps,
    }
}
