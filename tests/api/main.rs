//! The REST API of an edge over Sydney, asked over a real socket at a time that stands still.

mod alarms;
mod bad_input;
mod clock;
mod conformance;
mod demo;
mod description;
mod doubtful_places;
mod events;
mod flights;
mod flights_told;
mod harness;
mod idempotency;
mod ids;
mod messages;
mod one_contract;
mod packs;
mod plan_keys;
mod plan_stories;
mod plan_words;
mod quotes;
mod situations;
mod stories;
mod town;
mod versions;
mod zone_feeds;
