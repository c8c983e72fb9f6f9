//! Checks the proof of an exact answer without trusting the search that made it, and a plan with times and battery
//! against its world ([`verify_flight`]).
//!
//! Nothing here comes from `routing` or `recompose`, so that a mistake there cannot hide here: the
//! certificate is read as text, and the network is taken from its loader as ids, ends and lengths.
//!
//! With `h` the bounds, `d` the labels of the settled nodes `S` and `D` the length claimed, the
//! conditions checked make `y(v) = min(d(v), D - h(v))` a feasible dual of the shortest path problem:
//! along every open segment `y` rises by no more than the segment's length, it is at most the first
//! stretch at every start and at least `D` at the destination. So every open way is at least `D` long,
//! and the path shows that one is no longer. Every comparison allows 1e-9 of `max(1 m, D)`: what is
//! proved is `D` up to that much for each segment of a way.
//!
//! What is *not* proved: a certificate itself says where the drone could start, where it had to go and
//! what was closed, and a proof is as good as these premises. Therefore the [`Verdict`] repeats them
//! for a person to compare with the report and the zones of the day.

mod check;
mod claim;
mod document;
mod facts;
mod fault;
mod flight;
mod flight_fault;
mod premises;
mod separation;
mod verdict;

pub use facts::NetworkFacts;
pub use fault::{CertificateFault, Step};
pub use flight::{FlightPremises, verify_flight};
pub use flight_fault::{FlightFault, LegAt, StayAt};
pub use verdict::{Premises, Verdict};

/// Checks a certificate, as the text that `skyway reroute --certificate` writes, against a network.
///
/// # Errors
/// The first thing found that keeps the text from being a proof: it cannot be read, belongs to another
/// network or names what that does not have, or a condition of the proof does not hold somewhere.
pub fn verify(certificate_text: &str, network: &NetworkFacts) -> Result<Verdict, CertificateFault> {
    let document = document::read(certificate_text)?;
    let claim = claim::resolve(document, network)?;
    check::check(&claim, network)?;
    Ok(Verdict::of(&claim, network))
}
