//! Deliveries from the order to the door, over a store in a file, with an edge that is made up.

mod assigning;
mod cancelling;
mod edge;
mod flying;
mod giving_up;
mod holding;
mod lateness;
mod meddling;
mod ordering;
mod personal_data;
mod quoting;
mod racing;
mod world;
