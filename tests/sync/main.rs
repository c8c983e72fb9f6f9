//! Edges that follow a registry: the code that ships, over a line that tests cut and bend.

#![expect(clippy::print_stdout, reason = "what the damage came to is told")]

mod changes;
mod conflicts;
mod damage;
mod epochs;
#[path = "../edge/ladder.rs"]
mod ladder;
mod late_log;
mod line;
mod loopback;
#[expect(dead_code, reason = "no disk hangs by itself here")]
#[path = "../edge/memory_disk.rs"]
mod memory_disk;
mod networks;
mod news;
mod refused;
mod renewed;
mod repeated;
mod restart;
#[cfg(feature = "planted")]
mod silence;
mod stage;
mod standing;
