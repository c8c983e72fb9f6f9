//! The networks that come with Skyway, as the text of their files in the native format.
//!
//! `data/README.md` says where they come from; a test builds both again and compares them to the
//! byte.

/// Sydney CBD: rooftops of real buildings, joined by clear lines of sight. ODbL, © OpenStreetMap
/// contributors.
pub const SYDNEY_CBD: &str = include_str!("../../../../data/sydney-cbd.geojson");

/// Name of [`SYDNEY_CBD`].
pub const SYDNEY_CBD_NAME: &str = "Sydney CBD";

/// Who has to be named beside every copy of [`SYDNEY_CBD`] and of whatever is made from it.
pub const SYDNEY_CBD_ATTRIBUTION: &str = "© OpenStreetMap contributors, Open Database License (ODbL) 1.0; https://www.openstreetmap.org/copyright";

/// The extract that [`SYDNEY_CBD`] takes its nodes from: south of it there is a strip without data.
pub const SYDNEY_CBD_EXTRACT: &str = "north2023";

/// The paper's motivating scenario, San Marcos to San Antonio: synthetic, see
/// [`san_marcos_san_antonio`](super::san_marcos_san_antonio).
pub const CORRIDOR: &str = include_str!("../../../../data/corridor-san-marcos-san-antonio.geojson");
