//! The edge of a repetition with what is around it: its registry, which goes away, comes back, and brings zones.

use crate::Result;
use crate::arrivals::Chance;
use crate::fleet::asked;
use crate::requests::{self, get};
use crate::scenario::{Event, Servers};
use crate::servers::{Installed, Niceness, Server};
use crate::transport::{Connections, Status, Wanted};
use http::Method;
use skyway::wire::{NetworkSummaries, RegistryRevision, Stamp};
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::{Duration, Instant};
use tokio::task::JoinSet;
use tokio::time::sleep;

/// The network at the registry, which is the one that an edge follows by default.
const NETWORK: &str = "sydney";
/// Writes of zones at once; the registry takes 64.
const WRITERS: usize = 32;
/// How often, and after how long, a zone is written again to a registry that is busy.
const WRITE_ATTEMPTS: u32 = 60;
const WRITE_AGAIN: Duration = Duration::from_millis(500);
/// Zones of a storm lie over this many times the network's width and height.
const STORM_SPREAD: f64 = 5.0;
/// When those begin that are not in force yet.
const TOMORROW: Duration = Duration::from_secs(86_400);
const LOOK_AGAIN: Duration = Duration::from_millis(20);
/// How long an edge may take to follow its registry.
const FOLLOWS_WITHIN: Duration = Duration::from_secs(120);

/// The servers of a repetition.
pub(crate) struct Stage {
    installed: Installed,
    pub(crate) edge: Server,
    registry: Option<Server>,
    registry_port: u16,
}

impl Stage {
    pub(crate) async fn set(installed: Installed, servers: &Servers) -> Result<Self> {
        let registry = match servers.registry {
            false => None,
            true => Some(registry_with_network(&installed, servers).await?),
        };
        let address = registry.as_ref().map(|registry| registry.address);
        let edge = installed.edge(servers, address).await?;
        Ok(Self {
            installed,
            edge,
            registry,
            registry_port: address.map_or(0, |address| address.port()),
        })
    }

    pub(crate) fn installed(&self) -> &Installed {
        &self.installed
    }

    /// Has happen what comes with a phase; tells, for a storm, what the edge is to have followed by its end.
    pub(crate) async fn happen(
        &mut self,
        event: Option<Event>,
        bounds: [f64; 4],
        seed: u64,
    ) -> Result<Option<RegistryRevision>> {
        match event {
            None => Ok(None),
            Some(Event::RegistryOutage) => {
                self.registry = None;
                Ok(None)
            }
            Some(Event::RegistryBack) => {
                self.registry = Some(self.installed.registry_again(self.registry_port)?);
                Ok(None)
            }
            Some(Event::ZoneStorm {
                zones,
                in_force_one_of,
            }) => {
                self.registry = None;
                // Where the edge does not look for it.
                let elsewhere = self.installed.registry(Niceness::Ordinary).await?;
                let address = elsewhere.address;
                write_zones(address, zones, in_force_one_of, bounds, seed).await?;
                let head = head(address).await?;
                drop(elsewhere);
                self.registry = Some(self.installed.registry_again(self.registry_port)?);
                Ok(Some(head))
            }
        }
    }
}

/// How long it took until the edge followed its registry up to a revision, once it has.
pub(crate) async fn followed(edge: SocketAddr, until: RegistryRevision) -> Result<Duration> {
    let connections = Connections::new(edge, 1, 1);
    let begun = Instant::now();
    while begun.elapsed() < FOLLOWS_WITHIN {
        let told = asked(&connections, &get("/v1/closures?page_size=1")).await?;
        let stamp: Stamp<'_> = serde_json::from_slice(&told.body)?;
        let reached = stamp.registry_revision;
        if reached.is_some_and(|at| (at.epoch, at.revision) >= (until.epoch, until.revision)) {
            return Ok(begun.elapsed());
        }
        sleep(LOOK_AGAIN).await;
    }
    Err(
        format!("the edge has not followed its registry to {until} within {FOLLOWS_WITHIN:?}")
            .into(),
    )
}

async fn registry_with_network(installed: &Installed, servers: &Servers) -> Result<Server> {
    // An edge without anything has the network as the registry takes it.
    let bare = Servers {
        store: false,
        registry: false,
        settings: Vec::new(),
        network: servers.network.clone(),
    };
    let edge = installed.edge(&bare, None).await?;
    let connections = Connections::new(edge.address, 1, 1);
    let network = asked(&connections, &get("/v1/network")).await?.body;
    drop(edge);
    let registry = installed.registry(Niceness::GivesWay).await?;
    let connections = Connections::new(registry.address, 1, 1);
    let path = format!("/v1/networks/{NETWORK}");
    asked(&connections, &requests::send(Method::PUT, path, network)).await?;
    Ok(registry)
}

/// The last revision of the network.
async fn head(registry: SocketAddr) -> Result<RegistryRevision> {
    let connections = Connections::new(registry, 1, 1);
    let told = asked(&connections, &get("/v1/networks")).await?;
    let summaries: NetworkSummaries = serde_json::from_slice(&told.body)?;
    let mut networks = summaries.networks.iter();
    let network = networks.find(|network| network.id == NETWORK);
    Ok(RegistryRevision {
        epoch: summaries.epoch,
        revision: network.ok_or("the registry has lost its network")?.head,
    })
}

async fn write_zones(
    registry: SocketAddr,
    zones: usize,
    in_force_one_of: usize,
    [west, south, east, north]: [f64; 4],
    seed: u64,
) -> Result<()> {
    let connections = Rc::new(Connections::new(registry, WRITERS, 1));
    let tomorrow = jiff::Timestamp::now() + TOMORROW;
    let tomorrow = tomorrow.to_string();
    let mut chance = Chance::of(seed);
    let mut around = |from: f64, to: f64| {
        let middle = (from + to) / 2.0;
        middle + (chance.unit() - 0.5) * STORM_SPREAD * (to - from)
    };
    let mut writing = JoinSet::new();
    for number in 0..zones {
        if writing.len() >= WRITERS {
            joined(writing.join_next().await)?;
        }
        let is_in_force = number.is_multiple_of(in_force_one_of.max(1));
        let from = (!is_in_force).then_some(tomorrow.as_str());
        let centre = [around(west, east), around(south, north)];
        let id = format!("storm-{number}");
        let body = requests::zone_feature(&id, centre, from).to_string();
        let path = format!("/v1/networks/{NETWORK}/zones");
        let wanted = requests::send(Method::POST, path, body);
        let connections = connections.clone();
        writing.spawn_local(async move {
            let told = written_at_last(&connections, &wanted).await;
            told.map_err(|error| error.to_string())
        });
    }
    while !writing.is_empty() {
        joined(writing.join_next().await)?;
    }
    Ok(())
}

/// A registry that is busy says so, and is asked again.
async fn written_at_last(connections: &Connections, wanted: &Wanted) -> Result<()> {
    for attempt in 1..=WRITE_ATTEMPTS {
        let told = connections.ask(wanted).await?;
        // What came about and was not acknowledged is there when it is asked for again.
        let is_there = attempt > 1 && told.status == Status::Rest(409);
        if told.status.is_success() || is_there {
            return Ok(());
        }
        if !told.status.is_shed() {
            let body = String::from_utf8_lossy(&told.body);
            return Err(format!("{wanted}: {}: {body}", told.status.text()).into());
        }
        sleep(WRITE_AGAIN).await;
    }
    Err(format!("{wanted}: the registry is too busy").into())
}

type Joined = std::result::Result<std::result::Result<(), String>, tokio::task::JoinError>;

fn joined(writing: Option<Joined>) -> Result<()> {
    match writing {
        None | Some(Ok(Ok(()))) => Ok(()),
        Some(Ok(Err(error))) => Err(error.into()),
        Some(Err(error)) => Err(error.into()),
    }
}
