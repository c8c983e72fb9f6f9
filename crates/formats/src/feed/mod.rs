//! Zones as the field publishes them: ED-269, ED-318, fences of QGroundControl, and GeoJSON as it is read here.
//!
//! A reader of feeds is tolerant where real feeds differ and only one meaning is left; each such repair is
//! listed. A zone is imported as written or refused, with its identifier, the place and the remedy; one that is
//! refused keeps no other from being imported.

mod ed269;
mod ed318;
mod ed318_write;
mod fence;
mod layer;
mod native;
mod record;
mod sheet;
mod times;

use crate::airspace::Zone;
use crate::foreign::ForeignFormat;
use crate::geo::Frame;
use crate::mark::without_mark;
use crate::place::Place;
use crate::twice::members_twice;
use crate::zones::{ZoneCode, ZoneProblem};
pub use ed318_write::write_ed318;
use rustc_hash::FxHashMap;
use serde_json::Value;

/// At most this many bytes in a feed.
pub const MAX_FEED_BYTES: usize = 64 << 20;
/// At most this many zones in a feed; a zone with several volumes counts once.
pub const MAX_FEED_ZONES: usize = 20_000;
/// At most this many notes are kept of one feed.
const MAX_NOTES: usize = 1_000;
/// A feed with so many members that are there twice is refused as a whole.
const MEMBERS_TWICE_MAX: usize = 8;

/// The format of a feed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedFormat {
    /// EUROCAE ED-269.
    Ed269,
    /// EUROCAE ED-318.
    Ed318,
    /// GeoJSON with the properties of zones here.
    GeoJson,
    /// The fence of a plan of QGroundControl.
    QgcPlan,
}

impl FeedFormat {
    /// The name on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ed269 => "ed269",
            Self::Ed318 => "ed318",
            Self::GeoJson => "geojson",
            Self::QgcPlan => "qgc_plan",
        }
    }
}

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
    /// JSON Pointer (RFC 6901) of the place.
    pub pointer: String,
    /// What was done.
    pub message: String,
}

/// A zone of a feed.
#[derive(Clone, Debug)]
pub struct FeedZone {
    /// Its identifier, where it can be read.
    pub identifier: Option<String>,
    /// JSON Pointer of the zone.
    pub pointer: String,
    /// The zones that it is here, one for each of its volumes, or why it is refused.
    pub outcome: Result<Vec<Zone>, Vec<ZoneProblem>>,
}

/// What is in a feed.
#[derive(Clone, Debug)]
pub struct ZoneFeed {
    /// Its format.
    pub format: FeedFormat,
    /// Its zones, in their order.
    pub zones: Vec<FeedZone>,
    /// Repairs, and what is not acted on.
    pub notes: Vec<FeedNote>,
    /// How many notes there were beyond those kept.
    pub further_notes: usize,
}

/// What readers collect.
struct Collected {
    zones: Vec<FeedZone>,
    notes: Vec<FeedNote>,
}

/// Reads a feed, whose format is recognised by what is in it.
///
/// # Errors
/// When it is too large, is none of the formats, or as a whole says nothing that could be understood.
pub fn read_feed(
    text: &str,
    terms: &FeedTerms<'_>,
    frame: &Frame,
) -> Result<ZoneFeed, ZoneProblem> {
    let root_problem = |code, message: String| ZoneProblem::new(code, String::new(), message);
    if text.len() > MAX_FEED_BYTES {
        let message = format!("the feed has more than {} MiB", MAX_FEED_BYTES >> 20);
        let problem = root_problem(ZoneCode::TextTooLong, message);
        return Err(problem.hint("divide it into feeds by region"));
    }
    let bytes = without_mark(text.as_bytes());
    let document: Value =
        serde_json::from_slice(bytes).map_err(|error| match ForeignFormat::of_text(text) {
            Some(foreign) => root_problem(ZoneCode::FormatForeign, foreign.instead_of_zones()),
            None => root_problem(ZoneCode::NotJson, error.to_string()),
        })?;
    let format = format_of(&document);
    if format != FeedFormat::GeoJson && !frame.is_geographic() {
        let message = "the network is planar, and the feed has longitudes and latitudes";
        return Err(root_problem(ZoneCode::FormatForeign, message.to_owned()));
    }
    let mut collected = Collected {
        zones: Vec::new(),
        notes: Vec::new(),
    };
    if bytes.len() < text.len() {
        collected.note("", "the byte order mark was left out");
    }
    let reader = Reader { terms, frame };
    match format {
        FeedFormat::Ed269 => ed269::read(&document, &reader, &mut collected)?,
        FeedFormat::Ed318 => ed318::read(&document, &reader, &mut collected)?,
        FeedFormat::GeoJson => native::read(&document, &reader, &mut collected)?,
        FeedFormat::QgcPlan => fence::read(&document, &reader, &mut collected)?,
    }
    collected.refuse_members_twice(bytes)?;
    collected.refuse_namesakes();
    let mut notes = collected.notes;
    let further_notes = notes.len().saturating_sub(MAX_NOTES);
    notes.truncate(MAX_NOTES);
    Ok(ZoneFeed {
        format,
        zones: collected.zones,
        notes,
        further_notes,
    })
}

fn format_of(document: &Value) -> FeedFormat {
    match ForeignFormat::of_json(document) {
        Some(ForeignFormat::Ed269) => FeedFormat::Ed269,
        Some(ForeignFormat::Ed318) => FeedFormat::Ed318,
        Some(ForeignFormat::QgcPlan) => FeedFormat::QgcPlan,
        _ => FeedFormat::GeoJson,
    }
}

/// What readers of all formats are given.
struct Reader<'a> {
    terms: &'a FeedTerms<'a>,
    frame: &'a Frame,
}

impl Collected {
    fn note(&mut self, pointer: &str, message: &str) {
        self.notes.push(FeedNote {
            identifier: None,
            pointer: pointer.to_owned(),
            message: message.to_owned(),
        });
    }

    /// A member that is there twice: readers differ in which one they take, so that its zone is refused.
    fn refuse_members_twice(&mut self, bytes: &[u8]) -> Result<(), ZoneProblem> {
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
                Some(zone) => zone.outcome = Err(vec![problem]),
                None => return Err(problem),
            }
        }
        Ok(())
    }

    /// Two zones of one id: nobody knows which is meant, so that both are refused.
    fn refuse_namesakes(&mut self) {
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

/// The zones of a list, no more than a feed may have.
fn bounded<'v>(list: &'v [Value], place: &Place<'_>) -> Result<&'v [Value], ZoneProblem> {
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
