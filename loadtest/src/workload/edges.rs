//! The edges of a workload, and the network that they fly over.

use super::bystander::Edge;
use super::play::PlayOptions;
use super::{Ground, Workload};
use crate::Result;
use crate::scenario::Servers;
use crate::servers::{Installed, Server};
use std::path::Path;
use std::process::Command;

/// The airframe of an edge without the flight model.
const BY_DISTANCE: &str = "none";

/// An edge, and the folder of its files.
pub(super) struct Started {
    pub(super) edge: Edge,
    _server: Server,
    _folder: tempfile::TempDir,
}

/// The network's name, or its file, which is made here.
pub(super) fn ground(workload: &Workload, options: &PlayOptions, folder: &Path) -> Result<String> {
    let (nodes, map_size_m, seed) = match &workload.network {
        Ground::Bundled(name) => return Ok(name.clone()),
        Ground::Generated {
            nodes,
            map_size_m,
            seed,
        } => (nodes, map_size_m, seed),
    };
    let file = folder.join("network.geojson");
    let status = Command::new(&options.program)
        .args([
            "network",
            "generate",
            "--quiet",
            "--nodes",
            &nodes.to_string(),
        ])
        .args([
            "--map-size",
            &map_size_m.to_string(),
            "--seed",
            &seed.to_string(),
            "--output",
        ])
        .arg(&file)
        .status()?;
    match status.success() {
        true => Ok(file.to_string_lossy().into_owned()),
        false => Err(format!("the network was not generated: {status}").into()),
    }
}

pub(super) async fn start(
    workload: &Workload,
    options: &PlayOptions,
    network: &str,
    store: bool,
) -> Result<Started> {
    let folder = tempfile::tempdir()?;
    let installed = Installed {
        program: options.program.clone(),
        folder: folder.path().to_owned(),
    };
    let airframe = workload.airframe.as_deref().unwrap_or(BY_DISTANCE);
    let servers = Servers {
        network: network.to_owned(),
        store,
        registry: false,
        settings: vec![
            format!("flight.airframe={airframe}"),
            format!("clock.rate={}", workload.clock_rate),
        ],
    };
    let server = installed.edge(&servers, None).await?;
    Ok(Started {
        edge: Edge::of(&server).await?,
        _server: server,
        _folder: folder,
    })
}
