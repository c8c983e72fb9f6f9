//! What readers of feeds are given, and what they collect.

use crate::airspace::Zone;
use crate::geo::Frame;
use crate::place::Place;
use crate::twice::members_twice;
use crate::zones::{ZoneCode, ZoneProblem};
use rustc_hash::FxHashMap;
use serde_json::Value;

/// At most this many zones in a feed; a zone with several volumes counts once.
pub const MAX_FEED_ZONES: usize = 20_000;
/// A feed with this many members that are there twice is refused as a whole.
const MEMBERS_TWICE_MAX: usize = 8;

/// How the zones of a feed are named and widened here.
#[derive(Clone, Copy, Debug)]
pub struct FeedTerms<'a> {
    /// The name of the feed, which each zone keeps.
    pub feed: &'a str,
    /// What is put before each identifier to make the id of a zone.
    pub prefix: &'a str,
    /// By how much zones are widened where they do not say, in metres.
    pub margin_m: f64,
}

/// Something that was read otherwise than it is written, or is not acted on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeedNote {
    /// The zone, where it is one of a zone that has an identifier.
    pub identifier: Option<String>,
    /// JSON Pointer (RFC 6901) of the place; in KML as if elements were members.
    pub pointer: String,
    /// What was done.
    pub message: String,
}

/// A zone of a feed.
#[derive(Clone, Debug)]
pub struct FeedZone {
    /// Its identifier, where it can be read.
    pub identifier: Option<String>,
    /// JSON Pointer of the zone; in KML as if elements were members.
    pub pointer: String,
    /// The zones that it is here, one for each of its volumes, or why it is refused.
    pub outcome: Result<Vec<Zone>, Vec<ZoneProblem>>,
    /// Where it is refused and has shapes that can be read: those, closed at all heights and always.
    pub outlines: Vec<Zone>,
}

/// What readers collect.
pub(super) struct Collected {
    pub(super) zones: Vec<FeedZone>,
    pub(super) notes: Vec<FeedNote>,
}

/// What readers of all formats are given.
pub(super) struct Reader<'a> {
    pub(super) terms: &'a FeedTerms<'a>,
    pub(super) frame: &'a Frame,
}

impl Collected {
    pub(super) fn note(&mut self, pointer: &str, message: &str) {
        self.notes.push(FeedNote {
            identifier: None,
            pointer: pointer.to_owned(),
            message: message.to_owned(),
        });
    }

    /// A member that is there twice: readers differ in which one they take, so that its zone is
    /// refused.
    pub(super) fn refuse_members_twice(&mut self, bytes: &[u8]) -> Result<(), ZoneProblem> {
        let twice = members_twice(bytes);
        let is_more = twice.len() >= MEMBERS_TWICE_MAX;
        for pointer in twice {
            let message = "the member is there more than once";
            let problem = ZoneProblem::new(ZoneCode::UnknownField, pointer, message);
            let problem = problem.hint("leave one of them");
            let mut zones = self.zones.iter_mut();
            let zone = zones.find(|zone| {
                let within = problem.pointer.strip_prefix(zone.pointer.as_str());
                within.is_some_and(|within| within.starts_with('/'))
            });
            match zone.filter(|_| !is_more) {
                Some(zone) => {
                    zone.outcome = Err(vec![problem]);
                    zone.outlines.clear();
                }
                None => return Err(problem),
            }
        }
        Ok(())
    }

    /// A zone whose id cannot stand in an address: no registry takes it.
    pub(super) fn refuse_unfit_ids(&mut self, feed: &str) {
        for feed_zone in &mut self.zones {
            let zones = feed_zone.outcome.iter().flatten();
            let mut ids = zones.chain(&feed_zone.outlines).map(Zone::id);
            let Some(id) = ids.find(|id| is_unfit(id)) else {
                continue;
            };
            let message = format!(
                "the feed '{feed}' makes of it the id {id:?}, which cannot stand in an address"
            );
            let hint = "import the feed with a prefix, and write identifiers of letters and digits";
            let problem = ZoneProblem::new(ZoneCode::IdInvalid, feed_zone.pointer.clone(), message);
            feed_zone.outlines.clear();
            if feed_zone.outcome.is_ok() {
                feed_zone.outcome = Err(vec![problem.hint(hint)]);
            }
        }
    }

    /// Two zones of one id: it is unclear which is meant, so that both are refused.
    pub(super) fn refuse_namesakes(&mut self) {
        let mut seen: FxHashMap<String, Vec<usize>> = FxHashMap::default();
        for (place, feed_zone) in self.zones.iter().enumerate() {
            for zone in feed_zone.outcome.iter().flatten() {
                seen.entry(zone.id().to_owned()).or_default().push(place);
            }
        }
        let twice = seen.into_iter().filter(|(_, places)| places.len() > 1);
        let mut refused: Vec<(usize, String)> = twice
            .flat_map(|(id, places)| places.into_iter().map(move |place| (place, id.clone())))
            .collect();
        refused.sort_unstable();
        for (place, id) in refused {
            let zone = &mut self.zones[place];
            let message = format!("several zones of the feed have the id '{id}'");
            let problem = ZoneProblem::new(ZoneCode::IdDuplicate, zone.pointer.clone(), message);
            zone.outcome = Err(vec![
                problem.hint("give each zone an identifier of its own"),
            ]);
        }
    }
}

/// Whether an id is a step of a path, or has characters that no address has.
fn is_unfit(id: &str) -> bool {
    matches!(id, "." | "..") || id.chars().any(char::is_control)
}

/// The zones of a list, no more than a feed may have.
pub(super) fn bounded<'v>(
    list: &'v [Value],
    place: &Place<'_>,
) -> Result<&'v [Value], ZoneProblem> {
    if list.len() <= MAX_FEED_ZONES {
        return Ok(list);
    }
    let message = format!(
        "the feed has {} zones, more than the {MAX_FEED_ZONES} allowed",
        list.len()
    );
    let problem = ZoneProblem::new(ZoneCode::TextTooLong, place.pointer(), message);
    Err(problem.hint("divide it into feeds by region"))
}
