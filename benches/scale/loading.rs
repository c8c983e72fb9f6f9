//! Loading a network from a file, in a process of its own: how long it takes, and what stays in memory.

use serde_json::{Value, json};
use skyway::formats::{load_csv_network, load_network, write_network};
use skyway::network::NetworkDraft;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// What loading one form of a network came to.
pub(crate) struct Loading {
    pub(crate) file_bytes: u64,
    pub(crate) seconds: f64,
    /// Bytes that the process holds more than before, once the text is dropped.
    pub(crate) resident_bytes: f64,
    /// The most it ever held.
    pub(crate) peak_bytes: f64,
}

/// Writes a draft as GeoJSON, has another process load it, and removes it.
pub(crate) fn from_geojson(draft: &NetworkDraft, folder: &Path) -> io::Result<Loading> {
    let file = folder.join("network.geojson");
    std::fs::write(&file, write_network(draft))?;
    measured(&[file])
}

/// The same as two tables in CSV.
pub(crate) fn from_csv(draft: &NetworkDraft, folder: &Path) -> io::Result<Loading> {
    let [nodes, edges] = ["network_nodes.csv", "network_edges.csv"].map(|name| folder.join(name));
    let mut text = String::from("id,x,y,pads\n");
    for node in &draft.nodes {
        let [x, y] = node.position;
        let _ = writeln!(text, "{},{x},{y},{}", node.id, node.pads);
    }
    std::fs::write(&nodes, text)?;
    let mut text = String::from("u,v\n");
    for segment in &draft.segments {
        let _ = writeln!(text, "{},{}", segment.from, segment.to);
    }
    std::fs::write(&edges, text)?;
    measured(&[nodes, edges])
}

fn measured(files: &[PathBuf]) -> io::Result<Loading> {
    let mut file_bytes = 0;
    for file in files {
        file_bytes += std::fs::metadata(file)?.len();
    }
    let itself = std::env::current_exe()?;
    let told = Command::new(itself).arg("--load").args(files).output()?;
    for file in files {
        std::fs::remove_file(file)?;
    }
    if !told.status.success() {
        let words = String::from_utf8_lossy(&told.stderr).into_owned();
        return Err(io::Error::other(words));
    }
    let told: Value = serde_json::from_slice(&told.stdout)?;
    let figure = |name: &str| told[name].as_f64().unwrap_or(f64::NAN);
    Ok(Loading {
        file_bytes,
        seconds: figure("seconds"),
        resident_bytes: figure("resident_bytes"),
        peak_bytes: figure("peak_bytes"),
    })
}

/// The other process: loads the network, and prints what it took.
pub(crate) fn load_and_tell(files: &[String]) -> io::Result<()> {
    let before = memory_bytes("VmRSS")?;
    let begun = Instant::now();
    let texts: Vec<String> = files
        .iter()
        .map(std::fs::read_to_string)
        .collect::<io::Result<_>>()?;
    let loaded = match texts.as_slice() {
        [nodes, edges] => load_csv_network(nodes, edges),
        _ => load_network(&texts.concat()),
    };
    let loaded = loaded.map_err(|error| io::Error::other(error.lines().join("\n")))?;
    let seconds = begun.elapsed().as_secs_f64();
    drop(texts);
    let told = json!({
        "segments": loaded.topology.segment_count(),
        "seconds": seconds,
        "resident_bytes": memory_bytes("VmRSS")? - before,
        "peak_bytes": memory_bytes("VmHWM")?,
    });
    println!("{told}");
    Ok(())
}

/// A figure of the kernel about this process; Linux only.
fn memory_bytes(name: &str) -> io::Result<f64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find(|line| line.starts_with(name));
    let kibibytes = line
        .and_then(|line| line.split_whitespace().nth(1))
        .and_then(|number| number.parse::<f64>().ok());
    kibibytes
        .map(|number| number * 1024.0)
        .ok_or_else(|| io::Error::other(format!("/proc/self/status has no {name}")))
}
