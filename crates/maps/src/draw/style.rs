//! Colours, strokes and letters: the Okabe-Ito colours, on quiet greys.
//!
//! What matters differs in pattern or shape too, for readers who see colours otherwise and for printers that see none.

/// Okabe-Ito blue: the new path.
pub(super) const BLUE: &str = "#0072b2";
/// Okabe-Ito orange: search areas.
pub(super) const ORANGE: &str = "#e69f00";
/// Okabe-Ito vermillion: what failed or is closed.
pub(super) const VERMILLION: &str = "#d55e00";
/// Okabe-Ito bluish green: the alternate of a diversion.
pub(super) const GREEN: &str = "#009e73";
/// Words and marks.
pub(super) const INK: &str = "#222222";
/// Words that matter less.
pub(super) const QUIET_INK: &str = "#5f6368";
/// Frames and ticks.
pub(super) const FRAME: &str = "#8a8f94";
/// The rings of nodes.
pub(super) const NODE: &str = "#5b6b7c";

/// Buildings: upper height in metres, and fill.
pub(super) const HEIGHT_CLASSES: [(f64, &str); 4] = [
    (30.0, "#f3f3f1"),
    (60.0, "#e9e9e6"),
    (120.0, "#dddddb"),
    (f64::INFINITY, "#cfcfcb"),
];

/// Height of letters in pixels.
pub(super) const LETTER_PX: f64 = 11.0;
/// Height of letters in small print, in pixels.
pub(super) const SMALL_LETTER_PX: f64 = 9.0;
/// Letters, by what most readers have.
pub(super) const FONTS: &str = "Helvetica, Arial, 'Liberation Sans', sans-serif";

/// The outline of buildings.
pub(super) const BUILDING_EDGE: &str = r##"stroke="#c4c4c0" stroke-width="0.4""##;
/// Buildings of unknown height.
pub(super) const BUILDING_UNKNOWN: &str =
    r##"fill="none" stroke="#c4c4c0" stroke-width="0.6" stroke-dasharray="2 1.5""##;
/// The colour of segments.
pub(super) const SEGMENT: &str = r##"fill="none" stroke="#b4c1cd""##;
/// Closed segments, but for their width.
pub(super) const CLOSED_SEGMENT: &str =
    r##"fill="none" stroke="#d55e00" stroke-opacity="0.6" stroke-dasharray="3 2.5""##;
/// The outline of a no-fly zone.
pub(super) const ZONE: &str =
    r##"fill="url(#no-fly)" stroke="#a8487c" stroke-width="1.4" stroke-linejoin="round""##;
/// A search area that was searched last or found the path.
pub(super) const AREA: &str =
    r##"fill="#e69f00" fill-opacity="0.16" stroke="#c78500" stroke-width="1.3""##;
/// A search area of an earlier stage.
pub(super) const EARLIER_AREA: &str =
    r##"fill="none" stroke="#c78500" stroke-width="1" stroke-dasharray="6 3""##;
/// A search area that was skipped.
pub(super) const SKIPPED_AREA: &str =
    r##"fill="none" stroke="#c78500" stroke-width="1" stroke-dasharray="1.5 3""##;
/// The plan before the failure.
pub(super) const OLD_PATH: &str = r##"fill="none" stroke="#8a8a8a" stroke-width="6.4" stroke-dasharray="7 4" stroke-linejoin="round""##;
/// What keeps the new path apart from what it crosses.
pub(super) const NEW_PATH_EDGE: &str = r##"fill="none" stroke="#ffffff" stroke-width="4" stroke-linejoin="round" stroke-linecap="round""##;
/// The new path.
pub(super) const NEW_PATH: &str = r##"fill="none" stroke="#0072b2" stroke-width="2.4" stroke-linejoin="round" stroke-linecap="round""##;
/// From where the drone was to the first node of the new path.
pub(super) const FIRST_STRETCH: &str =
    r##"fill="none" stroke="#0072b2" stroke-width="2" stroke-dasharray="2 2.5""##;
/// The failed leg.
pub(super) const FAILED_LEG: &str = r##"fill="none" stroke="#d55e00" stroke-width="3""##;
