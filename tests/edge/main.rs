//! The use cases of the edge, played as stories on a clock that is moved by hand.

#![expect(
    clippy::print_stdout,
    reason = "what it took is told beside what came of it"
)]

mod authors;
mod clock_moved;
mod clock_steps;
mod closed_between;
mod deliveries;
mod delivery_restarts;
mod earlier_store;
mod enforcing;
mod failing_disk;
mod first_stretches;
mod flights;
mod flights_change;
mod flights_kept;
mod flying;
mod grounded;
mod idempotency;
mod imports;
mod journal;
mod ladder;
mod mailboxes;
mod memory_disk;
mod network_in_flight;
mod no_way;
mod offers;
mod older_rows;
mod packs;
mod pads;
mod plan_ends;
mod plan_versions;
mod plans;
mod publication;
mod restart;
mod served_stops;
mod sharing;
mod silence;
mod stage;
mod stops;
mod store_file;
mod topology;
mod topology_property;
mod unseparated;
mod windows;
