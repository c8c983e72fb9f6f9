//! The flight model, and the search over position, time and battery against brute force.

mod model;
