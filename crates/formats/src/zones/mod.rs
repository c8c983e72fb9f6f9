//! Zones as GeoJSON (RFC 7946): a `Feature` each, or a `FeatureCollection` of them.
//!
//! ```json
//! {
//!   "type": "Feature",
//!   "id": "harbour-concert",
//!   "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [90, 0], [90, 90], [0, 0]]]},
//!   "properties": {
//!     "name": "Concert", "reason": "crowd", "authority": "police",
//!     "lower_m": 0, "lower_reference": "agl", "upper_m": 120, "upper_reference": "amsl",
//!     "windows": [{"from": "2026-11-27T18:00:00Z", "until": "2026-11-27T23:00:00Z"}],
//!     "margin_m": 10
//!   }
//! }
//! ```
//!
//! `kind` is `prohibited` where it is not given, or `req_authorization`, `conditional`, `uspace`,
//! `no_restriction`; the last two close nothing. With `authorized` the drones of the network are
//! authorized for a zone of the second or third kind, or meet its conditions: it closes nothing
//! either. A window may have a `schedule`, see [`windows`].
//! `source` and `record` say what a zone was imported from and what its feed says of it.
//!
//! Geometry is a `Polygon`, a `MultiPolygon`, or a `Point` with the property `radius_m`, in the
//! coordinates of the network: longitude first, or metres where it is planar. A missing limit is
//! unlimited; no windows means always; `margin_m` is 10 where it is not given; references are `agl`
//! (also where none is given), `amsl` and `wgs84`. A member that is `null` counts as absent.
//!
//! Everything else is refused, with a code, its exact place and often a hint: nothing is guessed. Two
//! things are read and not kept: `bbox`, which the geometry says better, and the `name` of a collection.

mod geometry;
mod member;
mod miss;
mod problem;
mod read;
mod terms;
mod windows;
mod write;

pub(crate) use geometry::code_and_hint;
pub use miss::miss_hint;
pub(crate) use problem::Problems;
pub use problem::{MAX_ZONE_PROBLEMS, ZoneCode, ZoneProblem};
pub use read::{ZoneId, is_path_step, read_zones, zone_from_feature};
pub(crate) use terms::record_of;
pub(crate) use windows::{DAYS, clock_text, clock_time};
pub use write::{write_zones, zone_to_feature};
