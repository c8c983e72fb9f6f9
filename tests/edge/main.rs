//! The use cases of the edge, played as stories on a clock that is moved by hand.

mod clock_steps;
mod idempotency;
mod plans;
mod publication;
mod stage;
mod topology;
mod topology_property;
mod windows;
