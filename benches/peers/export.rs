//! Networks, queries and times as files: what the other half reads.

use crate::networks::{SEED, Subject};
use crate::queries::{Passage, Queries};
use crate::times::Times;
use serde_json::json;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

/// Writes everything about one network into its folder.
pub(crate) fn write(
    subject: &Subject,
    queries: &Queries,
    times: &Times,
    folder: &Path,
) -> io::Result<()> {
    let topology = &queries.topology;
    let about = json!({
        "name": subject.name(),
        "nodes": topology.node_count(),
        "segments": topology.segment_count(),
        "seed": SEED,
        "straight_line_scale": topology.straight_line_scale(),
        "destinations": queries.destinations,
        "failures": queries.failures.len(),
        "zones": queries.passages.len(),
        "without_detour": queries.without_detour,
        "debug_assertions": cfg!(debug_assertions),
    });
    std::fs::write(folder.join("about.json"), format!("{about:#}\n"))?;
    std::fs::write(folder.join("nodes.csv"), nodes(queries))?;
    std::fs::write(folder.join("edges.csv"), edges(queries))?;
    std::fs::write(folder.join("failures.csv"), failures(queries))?;
    std::fs::write(folder.join("zones.csv"), zones(queries))?;
    std::fs::write(folder.join("times-rust.csv"), rows(times))?;
    std::fs::write(folder.join("preparations-rust.csv"), preparations(times))
}

fn text(head: &str, lines: impl Iterator<Item = String>) -> String {
    let mut text = format!("{head}\n");
    for line in lines {
        let _ = writeln!(text, "{line}");
    }
    text
}

fn nodes(queries: &Queries) -> String {
    let positions = queries.topology.positions().iter();
    text("x_m,y_m", positions.map(|at| format!("{},{}", at.x, at.y)))
}

fn edges(queries: &Queries) -> String {
    let topology = &queries.topology;
    let lines = topology.segments().map(|segment| {
        let ends = topology.segment(segment);
        format!("{},{},{}", ends.from.at(), ends.to.at(), ends.length_m)
    });
    text("u,v,length_m", lines)
}

fn failures(queries: &Queries) -> String {
    let lines = queries.failures.iter().map(|failure| {
        format!(
            "{},{},{},{},{},{},{},{},{}",
            failure.leg.0.at(),
            failure.leg.1.at(),
            failure.destination.at(),
            failure.local.length_m,
            failure.local.hops,
            failure.global.length_m,
            failure.global.hops,
            failure.open_m,
            failure.plan.len() - 1
        )
    });
    text(
        "from,to,destination,local_m,local_hops,global_m,global_hops,open_m,open_hops",
        lines,
    )
}

fn zones(queries: &Queries) -> String {
    let lines = queries.passages.iter().map(|passage| {
        let (source, destination) = passage.ends();
        format!(
            "{},{},{},{},{},{}",
            source.at(),
            destination.at(),
            passage.around.length_m,
            passage.around.hops,
            passage.closed_nodes,
            ring(passage)
        )
    });
    text(
        "source,destination,zone_m,zone_hops,closed_nodes,ring",
        lines,
    )
}

/// Corners in metres, `x y` each, with semicolons between them.
fn ring(passage: &Passage) -> String {
    let corners = passage.ring.iter();
    let corners: Vec<String> = corners.map(|at| format!("{} {}", at.x, at.y)).collect();
    corners.join(";")
}

fn rows(times: &Times) -> String {
    let lines = times.rows.iter().flat_map(|row| {
        let queries = row.times_ns.iter().enumerate();
        queries.map(|(query, time_ns)| {
            format!(
                "{},\"{}\",{query},{time_ns},{}",
                row.kind, row.engine, row.mean_excess
            )
        })
    });
    text("kind,engine,query,ns,mean_excess", lines)
}

fn preparations(times: &Times) -> String {
    let lines = times.preparations.iter();
    text(
        "engine,what,seconds",
        lines.map(|(engine, what, seconds)| format!("{engine},\"{what}\",{seconds}")),
    )
}
