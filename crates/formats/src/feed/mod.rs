//! Zones as the field publishes them: ED-269, ED-318, fences of QGroundControl, and GeoJSON as it
//! is read here.
//!
//! A reader of feeds is tolerant where real feeds differ and only one meaning is left; each such
//! repair is listed. A zone is imported as written or refused, with its identifier, the place and
//! the remedy; one that is refused keeps no other from being imported.

mod collected;
mod ed269;
mod ed318;
mod ed318_write;
mod fence;
mod layer;
mod native;
mod record;
mod sheet;
mod times;

use crate::foreign::ForeignFormat;
use crate::geo::Frame;
use crate::mark::without_mark;
use crate::zones::{ZoneCode, ZoneProblem};
use collected::{Collected, Reader};
pub use collected::{FeedNote, FeedTerms, FeedZone, MAX_FEED_ZONES};
pub use ed318_write::write_ed318;
use serde_json::Value;

/// At most this many bytes in a feed.
pub const MAX_FEED_BYTES: usize = 64 << 20;
/// At most this many notes are kept of one feed.
const MAX_NOTES: usize = 1_000;

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

/// Reads a feed, whose format is recognised by what is in it.
///
/// # Errors
/// When it is too large, is none of the formats, or as a whole says nothing that could be
/// understood.
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
