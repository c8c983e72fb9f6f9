//! A registry with its edges, a provider whose drones stand on their networks, a service, and a customer with a webhook.

use super::receiver::Receiver;
use crate::arrivals::Chance;
use crate::line::client::Connection;
use crate::servers::{Installed, Server, ready};
use crate::workload::World;
use crate::{Result, Unsuitable};
use http::{Method, StatusCode};
use serde_json::{Value, json};
use skyway::wire::CompactNetwork;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::rc::Rc;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tokio::time::sleep;

/// Longer than anything takes, so that what hangs is told.
const PATIENCE: Duration = Duration::from_secs(120);
/// How often the ends of an order are drawn anew.
const PLACES_TRIED: usize = 1_000;
const LOOK_AGAIN: Duration = Duration::from_millis(50);
const JSON: &str = "application/json";
const WEBHOOK: &str = "/v1/webhooks/shop:main";

/// A daemon that is killed and started again on the same port and store.
pub(super) struct Daemon {
    role: &'static str,
    port: u16,
    arguments: Vec<String>,
    installed: Installed,
    server: Server,
    _folder: TempDir,
}

impl Daemon {
    fn start(program: &Path, role: &'static str, settings: &[String]) -> Result<Self> {
        let folder = tempfile::tempdir()?;
        let installed = Installed {
            program: program.to_owned(),
            folder: folder.path().to_owned(),
        };
        let port = free_port()?;
        let mut arguments = vec![];
        if !settings.iter().any(|setting| setting.starts_with("store=")) {
            let store = folder.path().join("store.db");
            arguments.push(format!("--store={}", store.display()));
        }
        let settings = settings.iter().map(|setting| format!("--set={setting}"));
        arguments.extend(settings);
        if role == "edge" {
            arguments.push(format!("--set=registry.advertise=http://127.0.0.1:{port}"));
        }
        let server = installed.daemon(role, port, &arguments)?;
        Ok(Self {
            role,
            port,
            arguments,
            installed,
            server,
            _folder: folder,
        })
    }

    pub(super) fn address(&self) -> SocketAddr {
        SocketAddr::from((Ipv4Addr::LOCALHOST, self.port))
    }

    /// Ends it as a crash does.
    pub(super) fn kill(&mut self) {
        self.server.kill();
    }

    /// Starts it again on its store.
    pub(super) fn start_again(&mut self) -> Result<()> {
        self.server = self
            .installed
            .daemon(self.role, self.port, &self.arguments)?;
        Ok(())
    }
}

/// A port that is free now.
fn free_port() -> Result<u16> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
    Ok(listener.local_addr()?.port())
}

/// A client of a registry that may be away for a moment.
#[derive(Clone)]
pub(super) struct Client {
    address: SocketAddr,
    open: Rc<RefCell<Option<Connection>>>,
}

impl Client {
    pub(super) fn of(address: SocketAddr) -> Self {
        Self {
            address,
            open: Rc::default(),
        }
    }

    /// A connection: the one that there is, or a new one.
    pub(super) async fn connection(&self) -> Result<Connection> {
        let open = self.open.borrow().clone();
        if let Some(open) = open {
            return Ok(open);
        }
        let open = Connection::open(self.address, "").await?;
        *self.open.borrow_mut() = Some(open.clone());
        Ok(open)
    }

    /// Asks once.
    async fn once(&self, request: &Request<'_>) -> Result<(StatusCode, Value)> {
        let connection = self.connection().await?;
        let mut headers = connection.request(request.method.clone(), request.path, request.media);
        if let Some(key) = request.key {
            headers = headers.header("idempotency-key", key);
        }
        let answered = connection.send(headers, request.body.clone()).await;
        let Ok((status, body)) = answered else {
            self.open.borrow_mut().take();
            return Err("the registry has not answered".into());
        };
        let body = match body.is_empty() {
            true => Value::Null,
            false => serde_json::from_slice(&body)?,
        };
        Ok((status, body))
    }

    /// Asks until there is an answer that another attempt would not change.
    pub(super) async fn ask(&self, request: &Request<'_>) -> Result<Value> {
        let begun = Instant::now();
        loop {
            let told = match self.once(request).await {
                Ok((status, body)) if status.is_success() => return Ok(body),
                Ok((status, body)) => {
                    let told = format!("{}: {status}: {body}", request.path);
                    let may_pass = status.is_server_error()
                        || matches!(status, StatusCode::CONFLICT | StatusCode::TOO_MANY_REQUESTS);
                    if !may_pass {
                        return Err(told.into());
                    }
                    told
                }
                Err(error) => error.to_string(),
            };
            if begun.elapsed() > PATIENCE {
                return Err(told.into());
            }
            sleep(LOOK_AGAIN).await;
        }
    }

    pub(super) async fn get(&self, path: &str) -> Result<Value> {
        self.ask(&Request::new(Method::GET, path, &Value::Null))
            .await
    }

    pub(super) async fn put(&self, path: &str, body: &Value) -> Result<Value> {
        self.ask(&Request::new(Method::PUT, path, body)).await
    }

    /// Orders a delivery, once however often it is asked for; its id.
    pub(super) async fn order(&self, order: &Value, key: &str) -> Result<String> {
        let mut request = Request::new(Method::POST, "/v1/deliveries", order);
        request.key = Some(key);
        let ordered = self.ask(&request).await?;
        let id = ordered["id"].as_str();
        id.map(str::to_owned)
            .ok_or_else(|| format!("an order has no id: {ordered}").into())
    }
}

/// A request over REST.
pub(super) struct Request<'a> {
    method: Method,
    path: &'a str,
    media: &'static str,
    body: Vec<u8>,
    key: Option<&'a str>,
}

impl<'a> Request<'a> {
    pub(super) fn new(method: Method, path: &'a str, body: &Value) -> Self {
        let body = match body {
            Value::Null => Vec::new(),
            body => body.to_string().into_bytes(),
        };
        Self {
            method,
            path,
            media: JSON,
            body,
            key: None,
        }
    }
}

/// What a town is made of.
pub(super) struct Plan<'a> {
    pub(super) program: PathBuf,
    /// The registry's own settings.
    pub(super) registry: Vec<String>,
    /// A network's file, under each of these names, with an edge each.
    pub(super) network: Option<&'a Path>,
    pub(super) names: &'a [&'a str],
    pub(super) airframe: &'a str,
    /// Drones on each network.
    pub(super) drones: usize,
    pub(super) seed: u64,
}

/// All of it.
pub(super) struct Town {
    pub(super) registry: Daemon,
    pub(super) edges: Vec<Daemon>,
    pub(super) world: World,
    /// Of the drones on each network.
    homes: BTreeMap<String, Vec<usize>>,
    pub(super) client: Client,
    pub(super) receiver: Receiver,
}

impl Town {
    pub(super) async fn open(plan: &Plan<'_>) -> Result<Self> {
        let mut settings = plan.registry.clone();
        settings.push("deliveries.webhooks_anywhere=true".to_owned());
        let registry = Daemon::start(&plan.program, "registry", &settings)?;
        ready(registry.address()).await?;
        let client = Client::of(registry.address());
        let network = geojson(&plan.program, plan.network)?;
        let mut edges = Vec::new();
        for name in plan.names {
            client
                .ask(&Request {
                    method: Method::PUT,
                    path: &format!("/v1/networks/{name}"),
                    media: "application/geo+json",
                    body: network.clone(),
                    key: None,
                })
                .await?;
            let settings = [
                format!("registry.url=http://{}", registry.address()),
                format!("registry.network={name}"),
                format!("registry.edge_id=edge-{name}"),
                format!("flight.airframe={}", plan.airframe),
                "limits.sessions=20000".to_owned(),
            ];
            let edge = Daemon::start(&plan.program, "edge", &settings)?;
            ready(edge.address()).await?;
            edges.push(edge);
        }
        let first = edges.first().ok_or(Unsuitable("no network".into()))?;
        let world = world(first.address()).await?;
        let mut chance = Chance::of(plan.seed);
        let mut homes = BTreeMap::new();
        for &name in plan.names {
            let own = (0..plan.drones).map(|_| world.home(&mut chance));
            homes.insert(name.to_owned(), own.collect());
        }
        let town = Self {
            homes,
            world,
            registry,
            edges,
            receiver: Receiver::open(plan.seed).await?,
            client,
        };
        town.enrol(plan).await?;
        Ok(town)
    }

    /// The provider, its drones and its services, and the customer with its webhook.
    async fn enrol(&self, plan: &Plan<'_>) -> Result<()> {
        let client = &self.client;
        for &name in plan.names {
            // One for each network: a provider may have 5,000 drones.
            let path = format!("/v1/providers/{}", provider_id(name));
            client.put(&path, &json!({"name": "Acme"})).await?;
            for (number, &home) in self.homes[name].iter().enumerate() {
                let home = &self.world.ids[home];
                let drone = json!({"network": name, "home": home, "payload_max_kg": 2.0});
                let path = format!("/v1/drones/{}", drone_id(name, number));
                client.put(&path, &drone).await?;
            }
            let service = json!({
                "name": "Parcels", "network": name, "payload_max_kg": 2.0, "time_zone": "Australia/Sydney",
                "tariff": {"currency": "AUD", "base": "4.00", "per_km": "1.20"},
            });
            client
                .put(&format!("/v1/services/{}", service_id(name)), &service)
                .await?;
        }
        client
            .put("/v1/customers/shop", &json!({"name": "Shop"}))
            .await?;
        let url = format!("http://{}/hooks", self.receiver.address);
        client.put(WEBHOOK, &json!({"url": url})).await?;
        self.is_advertised(plan.names.len()).await
    }

    /// Waits until the registry knows where its edges are.
    async fn is_advertised(&self, edges: usize) -> Result<()> {
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            let known = self.client.get("/v1/edges").await?;
            let known = known["edges"].as_array().into_iter().flatten();
            if known.filter(|edge| edge["url"].is_string()).count() == edges {
                return Ok(());
            }
            sleep(LOOK_AGAIN).await;
        }
        Err("the registry does not know where its edges are".into())
    }

    /// An order of a flight of some segments. Where a drone is at home its pad is taken while it waits: nothing is ordered there,
    /// as long as there are other places.
    pub(super) fn order(&self, network: &str, steps: usize, chance: &mut Chance) -> Value {
        let homes = self.homes.get(network);
        let is_taken = |node: &usize| homes.is_some_and(|homes| homes.contains(node));
        let mut ends = self.world.walk(steps, chance);
        for _ in 0..PLACES_TRIED {
            if !is_taken(&ends.0) && !is_taken(&ends.1) {
                break;
            }
            ends = self.world.walk(steps, chance);
        }
        let (source, destination) = ends;
        json!({
            "network": network, "source": self.world.ids[source], "destination": self.world.ids[destination],
            "payload_kg": 0.5, "customer": "shop", "service_id": service_id(network),
        })
    }
}

pub(super) fn drone_id(network: &str, number: usize) -> String {
    format!("{}:{number}", provider_id(network))
}

fn service_id(network: &str) -> String {
    format!("{}:parcels", provider_id(network))
}

fn provider_id(network: &str) -> String {
    format!("acme-{network}")
}

/// A network in a folder: 5,000 nodes over a square of 40 km, or few of them over a small one.
pub(super) fn generated(
    program: &Path,
    folder: &Path,
    (seed, is_small): (u64, bool),
) -> Result<PathBuf> {
    let file = folder.join("network.geojson");
    let [nodes, map_size_m] = if is_small {
        ["400", "6000"]
    } else {
        ["5000", "40000"]
    };
    let status = Command::new(program)
        .args(["network", "generate", "--quiet", "--nodes", nodes])
        .args(["--map-size", map_size_m, "--seed", &seed.to_string()])
        .arg("--output")
        .arg(&file)
        .status()?;
    match status.success() {
        true => Ok(file),
        false => Err(format!("the network was not generated: {status}").into()),
    }
}

/// The network as the registry reads it; the bundled one where no file is given.
fn geojson(program: &Path, file: Option<&Path>) -> Result<Vec<u8>> {
    let mut command = Command::new(program);
    command.args(["network", "convert", "--to", "geojson", "--quiet"]);
    if let Some(file) = file {
        command.arg("--network").arg(file);
    }
    let made = command.stderr(Stdio::inherit()).output()?;
    match made.status.success() {
        true => Ok(made.stdout),
        false => Err(format!("the network was not written: {}", made.status).into()),
    }
}

async fn world(edge: SocketAddr) -> Result<World> {
    let connection = Connection::open(edge, "").await?;
    let network = connection
        .ask(Method::GET, "/v1/network?format=compact", Vec::new())
        .await?;
    let compact: CompactNetwork<'static> = serde_json::from_slice(&network)?;
    Ok(World::of(compact))
}
