//! The edges of a workload, and the network that they fly over.

use super::bystander::Edge;
use super::listener::{Heard, Listener};
use super::play::PlayOptions;
use super::{Ground, Workload};
use crate::Result;
use crate::scenario::Servers;
use crate::servers::{Installed, Server};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// The airframe of an edge without the flight model.
const BY_DISTANCE: &str = "none";
/// How long the last words of an edge may take that was killed.
const PATIENCE: Duration = Duration::from_secs(5);

/// An edge, and the folder of its files.
pub(super) struct Started {
    pub(super) edge: Edge,
    server: Server,
    installed: Installed,
    servers: Servers,
    _folder: tempfile::TempDir,
}

/// What a killed edge has told, and how it came back.
pub(super) struct Restarted {
    /// Told before it was killed, and not taken yet.
    pub(super) heard: Vec<Heard>,
    /// Until it was ready again.
    pub(super) took: Duration,
    /// What it told to the end cannot be had any more, so that its lists are to be read.
    pub(super) is_gone: bool,
}

impl Started {
    /// Kills the edge and starts it again on its store; its subscriber listens on from the last event that it has.
    pub(super) async fn kill(&mut self) -> Result<Restarted> {
        self.server.kill();
        let before = &self.edge.listener;
        before.heard_out(PATIENCE).await?;
        let (heard, latest) = (before.take(), before.latest());
        let begun = Instant::now();
        self.server = self.installed.edge(&self.servers, None).await?;
        let took = begun.elapsed();
        let address = self.server.address;
        let resumed = match latest {
            Some(latest) => Listener::resumed(address, &latest).await?,
            None => None,
        };
        let is_gone = resumed.is_none();
        let listener = match resumed {
            Some(listener) => listener,
            None => Listener::of(address).await?,
        };
        self.edge = Edge::heard_by(listener, &self.server);
        Ok(Restarted {
            heard,
            took,
            is_gone,
        })
    }
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
        server,
        installed,
        servers,
        _folder: folder,
    })
}
