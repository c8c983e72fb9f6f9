//! The flight model, and the search over position, time and battery against brute force.

#![expect(
    clippy::disallowed_methods,
    clippy::print_stderr,
    reason = "tests read how many cases to draw, and say how many they were"
)]

mod alternates;
mod checker;
mod course;
mod crossings;
mod decisions;
mod events;
mod forbidden;
mod grid;
mod kept;
mod margins;
mod model;
mod optimality;
mod sending;
mod stories;
mod world;
