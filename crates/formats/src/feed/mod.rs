//! Zones as the field publishes them: ED-269, ED-318, fences of QGroundControl, KML, and GeoJSON as
//! it is read here.
//!
//! A reader of feeds is tolerant where real feeds differ and only one meaning is left; each such
//! repair is listed. A zone is imported as written or refused, with its identifier, the place and
//! the remedy; one that is refused keeps no other from being imported.

mod authorized;
mod collected;
mod ed269;
mod ed318;
mod ed318_write;
mod extended;
mod fence;
mod kml;
mod layer;
mod native;
mod record;
mod sheet;
#[cfg(test)]
mod tests;
mod times;

use crate::geo::Frame;
use crate::mark::BYTE_ORDER_MARK;
use crate::networks::foreign::ForeignFormat;
use crate::zones::{ZoneCode, ZoneProblem};
use collected::{Collected, Reader};
pub use collected::{FeedNote, FeedTerms, FeedZone, MAX_FEED_ZONES};
pub use ed318_write::write_ed318;
use serde_json::Value;

/// The media type of ED-318; it is not registered.
pub const ED318_MEDIA_TYPE: &str = "application/vnd.eurocae.ed318+json";
/// The media type of KML.
pub const KML_MEDIA_TYPE: &str = "application/vnd.google-earth.kml+xml";
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
    /// Keyhole Markup Language.
    Kml,
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
            Self::Kml => "kml",
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
    if text.len() > MAX_FEED_BYTES {
        let message = format!("the feed has more than {} MiB", MAX_FEED_BYTES >> 20);
        let problem = ZoneProblem::new(ZoneCode::TextTooLong, String::new(), message);
        return Err(problem.hint("divide it into feeds by region"));
    }
    let mut collected = Collected {
        zones: Vec::new(),
        notes: Vec::new(),
    };
    let unmarked = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
    if unmarked.len() < text.len() {
        collected.note("", "the byte order mark was left out");
    }
    let reader = Reader { terms, frame };
    let format = match ForeignFormat::of_markup(unmarked) {
        Some(ForeignFormat::Kml) => {
            check_frame(FeedFormat::Kml, frame)?;
            kml::read(unmarked, &reader, &mut collected)?;
            FeedFormat::Kml
        }
        _ => read_json(unmarked, &reader, &mut collected)?,
    };
    collected.refuse_unfit_ids(terms.feed);
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

fn read_json(
    text: &str,
    reader: &Reader<'_>,
    collected: &mut Collected,
) -> Result<FeedFormat, ZoneProblem> {
    let document: Value = serde_json::from_str(text).map_err(|error| {
        let (code, message) = match ForeignFormat::of_text(text) {
            Some(foreign) => (ZoneCode::FormatForeign, foreign.instead_of_zones()),
            None => (ZoneCode::NotJson, error.to_string()),
        };
        ZoneProblem::new(code, String::new(), message)
    })?;
    let format = format_of(&document);
    check_frame(format, reader.frame)?;
    match format {
        FeedFormat::Ed269 => ed269::read(&document, reader, collected)?,
        FeedFormat::Ed318 => ed318::read(&document, reader, collected)?,
        FeedFormat::QgcPlan => fence::read(&document, reader, collected)?,
        _ => native::read(&document, reader, collected)?,
    }
    collected.refuse_members_twice(text.as_bytes())?;
    Ok(format)
}

/// Only zones as they are read here may be in metres of a plane.
fn check_frame(format: FeedFormat, frame: &Frame) -> Result<(), ZoneProblem> {
    if format == FeedFormat::GeoJson || frame.is_geographic() {
        return Ok(());
    }
    let message = "the network is planar, and the format has longitudes and latitudes";
    let problem = ZoneProblem::new(ZoneCode::FormatForeign, String::new(), message);
    Err(problem.hint("use GeoJSON, which has the metres of the network"))
}

fn format_of(document: &Value) -> FeedFormat {
    match ForeignFormat::of_json(document) {
        Some(ForeignFormat::Ed269) => FeedFormat::Ed269,
        Some(ForeignFormat::Ed318) => FeedFormat::Ed318,
        Some(ForeignFormat::QgcPlan) => FeedFormat::QgcPlan,
        _ => FeedFormat::GeoJson,
    }
}
