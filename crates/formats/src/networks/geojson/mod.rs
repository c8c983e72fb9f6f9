//! The native format of a skyway network: GeoJSON, as `docs/network.md` and
//! `docs/network.schema.json` describe it.
//!
//! Reading is strict, for what is misread here is flown; writing is to the byte: one feature a
//! line.

mod feature;
mod patch;
mod read;
mod write;

#[cfg(test)]
mod tests;

pub use patch::patch_network;
pub(crate) use read::check_ends;
pub use read::read_network;
pub use write::write_network;

/// The version of the format that is read and written.
const FORMAT: u64 = 1;
/// Largest distance between the end of a segment's line and its node, in metres, in longitude and
/// latitude.
///
/// A file rounds degrees; a metre is far more than any rounding and far less than any mistake.
const END_TOLERANCE_GEOGRAPHIC_M: f64 = 1.0;
/// The same for planar coordinates, which are written exactly.
const END_TOLERANCE_PLANAR_M: f64 = 1e-6;
