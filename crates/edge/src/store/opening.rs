//! The first things read from a file and written to it: who this edge is, and what it flies over.

use super::codec::{read, write};
use super::difference::REGISTRY;
use super::file::{Row, StoreFault, Table};
use crate::network::documents::NetworkDocuments;
use bytes::Bytes;
use serde::{Deserialize, Serialize};
use skyway_contract::ClockKind;
use skyway_engine::network::Topology;
use skyway_formats::load_network;
use skyway_planted::{self as planted, Bug};
use std::sync::Arc;

const EDGE: &str = "edge";
const NETWORK: &str = "network";
/// The fact of a clock that clients move; no other one is noted.
const CLOCK: &str = "clock";
const AIRFRAME: &str = "airframe";

/// Numbers given in one start are fewer than this. Those of the next one begin after as many more, so that a
/// number that was given and could not be stored is never given again.
const NUMBERS_OF_A_START: u64 = 1_000_000_000;
/// Fewer than these are given in a millisecond: those of a start also begin after all that were given by its epoch, so
/// that an edge that was put back to a backup repeats none that others have from it.
const NUMBERS_OF_A_MILLISECOND: u64 = 1_000;
/// How much later the epoch of a start is, in milliseconds, where the clock was set back: the numbers of one start have
/// room in between.
const STARTS_APART_MS: u64 = NUMBERS_OF_A_START / NUMBERS_OF_A_MILLISECOND;

/// Who this edge is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Identity {
    /// Random, made once.
    pub(crate) id: String,
    /// The epoch of the first start: it is in the entity tags of all starts.
    pub(crate) lineage: u64,
    /// The epoch of this start: its instant in milliseconds since 1970, or later than that.
    pub(crate) epoch: u64,
    /// How many starts there were before.
    pub(crate) starts: u64,
}

impl Identity {
    /// That of an edge that forgets everything when it ends.
    pub(crate) fn of_one_start(id: String, epoch: u64) -> Self {
        Self {
            id,
            lineage: epoch,
            epoch,
            starts: 0,
        }
    }

    /// After this number come those of this start.
    pub(crate) fn first_number(&self) -> u64 {
        let by_starts = self.starts.saturating_mul(NUMBERS_OF_A_START);
        let by_clock = match self.starts {
            0 => 0,
            _ => self.epoch.saturating_mul(NUMBERS_OF_A_MILLISECOND),
        };
        by_starts.max(by_clock)
    }
}

/// The identity for this start, and the row that remembers it: the epoch is greater than every one before,
/// whatever the clock says.
pub(crate) fn open_identity(
    facts: &[(String, String)],
    fresh_id: String,
    epoch: u64,
) -> Result<(Identity, Row), StoreFault> {
    let identity = match fact(facts, EDGE) {
        None => Identity::of_one_start(fresh_id, epoch),
        Some(body) => {
            let before: Identity = read("fact", EDGE, body)?;
            let next = match planted::is(Bug::KeepEpoch) {
                true => before.epoch,
                false if epoch > before.epoch => epoch,
                false => before.epoch + STARTS_APART_MS,
            };
            Identity {
                epoch: next,
                starts: before.starts + 1,
                ..before
            }
        }
    };
    let row = Row::put(Table::Facts, EDGE, write(&identity));
    Ok((identity, row))
}

/// Checks that what is stored was written by a clock of this kind, as far as that matters: what a client's clock has
/// written is no world that another one may go on with, nor the other way round. Gives the row that remembers it.
///
/// # Errors
/// When another clock has written it.
pub(crate) fn check_clock(
    facts: &[(String, String)],
    kind: ClockKind,
) -> Result<Option<Row>, StoreFault> {
    let is_external = kind == ClockKind::External;
    if fact(facts, EDGE).is_some() && fact(facts, CLOCK).is_some() != is_external {
        return Err(match is_external {
            true => StoreFault::NotOfExternalClock,
            false => StoreFault::OfExternalClock,
        });
    }
    Ok(is_external.then(|| Row::put(Table::Facts, CLOCK, write(&kind))))
}

/// The row of a store over which an edge has an airframe by default; `None` for a store that was written before there was
/// a default, over which an edge has none until its settings name one.
pub(crate) fn airframe_row(facts: &[(String, String)], is_named: bool) -> Option<Row> {
    let is_of_before = fact(facts, EDGE).is_some() && fact(facts, AIRFRAME).is_none();
    (is_named || !is_of_before).then(|| Row::put(Table::Facts, AIRFRAME, write(&true)))
}

pub(super) fn fact<'a>(facts: &'a [(String, String)], name: &str) -> Option<&'a str> {
    let found = facts.iter().find(|(key, _)| key == name);
    found.map(|(_, body)| body.as_str())
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredNetwork {
    name: String,
    sha256: String,
    geojson: String,
}

pub(crate) fn network_row(documents: &NetworkDocuments, topology: &Topology) -> Row {
    let stored = StoredNetwork {
        name: topology.name().to_owned(),
        sha256: topology.fingerprint_text().to_owned(),
        geojson: String::from_utf8_lossy(documents.geojson()).into_owned(),
    };
    Row::put(Table::Facts, NETWORK, write(&stored))
}

/// The text of the network of a store; none in a new one.
pub(super) fn network_text(facts: &[(String, String)]) -> Result<Option<String>, StoreFault> {
    let Some(body) = fact(facts, NETWORK) else {
        return Ok(None);
    };
    let stored: StoredNetwork = read("fact", NETWORK, body)?;
    Ok(Some(stored.geojson))
}

/// A network, and the text that it was read from.
type NetworkWithText = (Arc<Topology>, Bytes);

/// The network of a store where it is another one than was given; none where it has none, or the same.
///
/// # Errors
/// When it has another name, or cannot be read.
pub(crate) fn stored_network(
    facts: &[(String, String)],
    given: &Topology,
) -> Result<Option<NetworkWithText>, StoreFault> {
    let Some(body) = fact(facts, NETWORK) else {
        return Ok(None);
    };
    let stored: StoredNetwork = read("fact", NETWORK, body)?;
    if stored.sha256 == given.fingerprint_text() {
        return Ok(None);
    }
    // An edge that follows a registry has the network from there, whatever it was first started with.
    let is_given = given.node_count() > 0 && fact(facts, REGISTRY).is_none();
    if is_given && stored.name != given.name() {
        return Err(StoreFault::OtherNetwork {
            stored: stored.name,
            given: given.name().to_owned(),
        });
    }
    let loaded = load_network(&stored.geojson)
        .map_err(|error| StoreFault::damaged(format!("its network cannot be read: {error}")))?;
    Ok(Some((
        Arc::new(loaded.topology),
        Bytes::from(stored.geojson),
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A start over some facts, and the facts that it leaves.
    fn start(facts: &[(String, String)], epoch: u64) -> (Identity, Vec<(String, String)>) {
        let opened = open_identity(facts, "edge".to_owned(), epoch);
        let (identity, row) = opened.expect("facts of an edge");
        let body = row.body.expect("a row that is put");
        (identity, vec![(EDGE.to_owned(), body)])
    }

    #[test]
    fn an_edge_that_is_put_back_repeats_no_number() {
        const DAY_MS: u64 = 86_400_000;
        let first_ms = 1_795_000_000_000;
        let (first, backup) = start(&[], first_ms);
        assert_eq!(first.first_number(), 0);
        let (lost, _) = start(&backup, first_ms + DAY_MS);
        let (put_back, _) = start(&backup, first_ms + 2 * DAY_MS);
        let given = put_back.first_number() - lost.first_number();
        assert_eq!(given, DAY_MS * NUMBERS_OF_A_MILLISECOND);
    }

    #[test]
    fn a_clock_that_was_set_back_leaves_room_for_the_numbers_of_a_start() {
        let (_, mut facts) = start(&[], 1_795_000_000_000);
        let mut last = 0;
        for epoch in [1_795_000_000_001, 1_795_000_000_001, 7, 8] {
            let (identity, left) = start(&facts, epoch);
            assert!(identity.first_number() >= last + NUMBERS_OF_A_START);
            (facts, last) = (left, identity.first_number());
        }
    }
}
