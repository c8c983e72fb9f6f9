//! Answers on their way out: each is shown to the [`checker`](crate::checker), and what it refuses is not sent.
//!
//! Instead goes the first that passes: the answer of Dijkstra's algorithm, the plan that is flown, what that plan has for the
//! case that its leg closes, and at last no route.

mod convert;
mod fallback;
mod flight;

pub use convert::{Known, check_answer, told};
pub use fallback::{Alternatives, Case, Checked, FallenBackTo, pass, settle};
pub use flight::{FlightWorld, claim_of_flight};
