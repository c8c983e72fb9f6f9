//! The engine's tests: one binary, so that everything is linked once.

#![expect(
    clippy::disallowed_methods,
    reason = "tests read the bundled files and how many cases to draw"
)]

mod airspace;
mod bundled;
mod certificates;
mod composition;
mod criticality;
mod drawing;
#[cfg(feature = "cli")]
mod evaluate;
mod kept_between;
mod numbered_nodes;
mod oracle;
mod projection;
mod report_properties;
mod reports;
mod shape_cases;
mod shape_queries;
mod shapes;
mod start_oracle;
mod start_rules;
mod starts;
mod strategies;
mod table_cache;
mod zone_feeds;
mod zone_format;
mod zone_hits;
mod zone_problems;
