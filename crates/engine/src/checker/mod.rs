//! The second pair of eyes: looks at every answer before it is sent.
//!
//! The searches are the doers; what stands here is small, and shares nothing with them. It may trust what a snapshot says is
//! closed (bits, hits, pads), and the table of what a leg takes; it works out for itself where the drone is, what lies on the
//! way to the first node, and whether the figures add up. By distance it allocates nothing for an answer that holds.
//! An answer is handed in as plain references ([`Claim`]), so that nothing here depends on how it came about.

mod begin;
mod claim;
mod fault;
mod flags;
mod flown;
mod lines;
mod outcome;
mod path;
mod timed;

#[cfg(test)]
mod tests;

pub use claim::{
    Claim, Drone, Flag, Flags, FlightClaim, FlightSky, Need, OwnClosures, Sky, Stretch,
    StretchKind, Told, Whereabouts,
};
pub use fault::{Fault, Place, Rule};
pub use timed::ClosedTimes;

/// Checks an answer against a world.
///
/// # Errors
/// The first rule that it breaks, with the place and the figures.
pub fn check(claim: &Claim<'_>, drone: &Drone<'_>, sky: &Sky<'_>) -> Result<(), Fault> {
    outcome::on_the_ground(claim, drone, sky)?;
    if claim.told == Told::NoRoute {
        return outcome::without_path(claim);
    }
    path::joins(claim, sky)?;
    let begun = begin::check(claim, drone, sky)?;
    match claim.flight {
        Some(flight) => flown::check(claim, flight, drone, sky)?,
        None => path::is_open(claim, sky)?,
    }
    path::lengths(claim, sky)?;
    outcome::with_path(claim, drone, sky)?;
    flags::check(claim, drone, sky, &begun)
}

/// Checks times, battery and pads of a flight, and that nothing is closed when it is there; not where it begins.
///
/// # Errors
/// The first rule that it breaks.
pub fn check_flight(claim: &Claim<'_>, drone: &Drone<'_>, sky: &Sky<'_>) -> Result<(), Fault> {
    path::joins(claim, sky)?;
    match claim.flight {
        Some(flight) => flown::check(claim, flight, drone, sky),
        None => path::is_open(claim, sky),
    }
}
