//! The airframes that a configuration names: bundled ones by their short names, others by their files.

use crate::flight::{Airframe, AirframeFault};
use std::path::Path;
use thiserror::Error;

/// Why a name stands for no airframe.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AirframeError {
    /// It is neither bundled nor a file that can be read.
    #[error(
        "cannot read the airframe {path}: {message}; name phantom3, m100, a file as in data/airframes, or none"
    )]
    Unreadable {
        /// The name.
        path: String,
        /// What the system says.
        message: String,
    },
    /// The file has no airframe that makes sense.
    #[error("{path}: {fault}")]
    Malformed {
        /// The file.
        path: String,
        /// What is wrong.
        fault: AirframeFault,
    },
    /// It climbs too slowly for the times at which drones are near a crossing of segments.
    #[error(
        "{name}: its airspeed and the wind that it flies in are more than 8 times 'vertical_speed_mps', so that nothing \
         keeps it apart from others where segments cross; set plans.crossing_m to 0, or name another"
    )]
    ClimbsTooSlowly {
        /// The airframe.
        name: String,
    },
}

/// The airframe of a name: `phantom3`, `m100`, or the path of a JSON file.
///
/// # Errors
/// When there is none of that name, or it makes no sense.
pub fn read_airframe(name: &str) -> Result<Airframe, AirframeError> {
    match name {
        "phantom3" => return Ok(Airframe::phantom3()),
        "m100" => return Ok(Airframe::m100()),
        _ => {}
    }
    let path = || name.to_owned();
    let text = read(Path::new(name)).map_err(|error| AirframeError::Unreadable {
        path: path(),
        message: error.to_string(),
    })?;
    Airframe::from_json(&text).map_err(|fault| AirframeError::Malformed {
        path: path(),
        fault,
    })
}

#[expect(
    clippy::disallowed_methods,
    reason = "the door to the files of airframes"
)]
fn read(path: &Path) -> std::io::Result<String> {
    std::fs::read_to_string(path)
}
