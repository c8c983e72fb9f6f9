//! An edge in a story: its process, its line to the registry, and what it shows and answers.

use crate::daemon::Plan;
use crate::history::edges::Route;
use crate::history::{Holding, Recorder, Version};
use crate::lives::{Shown, Statement};
use crate::proxy::{End, Proxy};
use crate::registry_client::{Answer, Client, NETWORK};
use crate::rounds::seed;
use crate::square::{place_m, tag_in};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// An edge that follows a registry over a line of its own.
#[derive(Debug)]
pub(crate) struct Edge {
    pub(crate) name: String,
    pub(crate) plan: Plan,
    pub(crate) line: Proxy,
    pub(crate) client: Client,
    admin: Client,
    /// Where its file is.
    pub(crate) store: PathBuf,
}

/// How an edge reaches its registry.
#[derive(Clone, Debug)]
pub(crate) struct Way<'a> {
    /// Where the registry is.
    pub(crate) end: End,
    /// The file with the token of the edge.
    pub(crate) token: &'a str,
    /// Settings of the edge, in place of the usual ones.
    pub(crate) settings: &'a [&'a str],
}

impl Edge {
    pub(crate) async fn of(name: &str, folder: &Path, way: Way<'_>) -> Self {
        let line = Proxy::to(way.end, seed()).await;
        let store = folder.join(format!("{name}.db"));
        let settings = [
            format!("registry.url=http://{}", line.socket()),
            format!("registry.network={NETWORK}"),
            format!("registry.edge_id={name}"),
            format!("registry.token_file={}", way.token),
            "registry.retry_within=200ms".to_owned(),
            "registry.poll_wait=1s".to_owned(),
            "flight.airframe=none".to_owned(),
        ];
        let file = store.display().to_string();
        let mut what = vec!["edge", "--store", &file];
        let name_of = |setting: &str| setting.split('=').next().map(str::to_owned);
        let own = |usual: &&str| way.settings.iter().any(|it| name_of(it) == name_of(usual));
        let settings = settings.iter().map(String::as_str);
        let settings = settings.filter(|usual| !own(usual));
        for setting in settings.chain(way.settings.iter().copied()) {
            what.extend(["--set", setting]);
        }
        let plan = Plan::new(name, folder, &what);
        Self {
            name: name.to_owned(),
            client: Client::of_edge(&plan.address),
            admin: Client::new(&plan.admin),
            plan,
            line,
            store,
        }
    }

    /// What it shows now; none where it does not answer, or follows nothing yet.
    pub(crate) async fn shown(&self, recorder: &Recorder) -> Option<Shown> {
        let began = recorder.moment();
        let page = read(&self.client, "GET /v1/zones?page_size=1000", &Value::Null).await?;
        assert!(page["next_page_token"].is_null(), "more than one page");
        let statement = self.statement(&page, began, recorder)?;
        // What is held stays so while faults go on: what was held then is held now.
        let held = read(&self.client, "GET /v1/holds?page_size=1000", &Value::Null).await?;
        let held = held["holds"].as_array().into_iter().flatten();
        let held = held
            .filter_map(|hold| hold["closures"].as_array())
            .flatten();
        let held = held.filter_map(|id| id.as_str().map(str::to_owned));
        Some(Shown {
            statement,
            zones: listed(&page["features"], |_| true),
            held: held.collect(),
        })
    }

    fn statement(&self, answer: &Value, began: u64, recorder: &Recorder) -> Option<Statement> {
        Some(Statement {
            edge: self.name.clone(),
            began,
            ended: recorder.moment(),
            own: Version::read(answer["revision"].as_str()?)?,
            at: Version::read(answer["registry_revision"].as_str()?)?,
        })
    }

    /// A way across the square that it answers now, with what it states.
    pub(crate) async fn route(
        &self,
        recorder: &Recorder,
        (from, to): (&str, &str),
    ) -> Option<(Statement, Route)> {
        let began = recorder.moment();
        let service = json!({"from": "n22", "to": from});
        let report = json!({"service": service, "destination": to, "dry_run": true});
        let answer = read(&self.client, "POST /v1/failures", &report).await?;
        let statement = self.statement(&answer, began, recorder)?;
        let nodes = answer["path"]["nodes"].as_array()?.iter();
        let line_m: Option<Vec<[f64; 2]>> = nodes.map(|node| place_m(node.as_str()?)).collect();
        let route = Route {
            edge: statement.life(),
            moment: began,
            at: statement.at,
            line_m: line_m?,
            lifted: Vec::new(),
        };
        Some((statement, route))
    }

    /// How it stands.
    pub(crate) async fn status(&self) -> Option<Value> {
        match self.admin.ask("GET /status", &[], &Value::Null).await {
            Answer::Came { body, .. } => serde_json::from_str(&body).ok(),
            Answer::Nothing { .. } => None,
        }
    }

    /// Decides what waits for an operator: all of it is let go. Gives what was contested.
    pub(crate) async fn release_holds(&self) -> Vec<String> {
        let Some(page) = read(&self.client, "GET /v1/holds", &Value::Null).await else {
            return Vec::new();
        };
        let mut contested = Vec::new();
        for hold in page["holds"].as_array().into_iter().flatten() {
            let id = hold["id"].as_str().unwrap_or_default();
            let line = format!("POST /v1/holds/{id}/release");
            self.client.ask(&line, &[], &Value::Null).await;
            if !hold["ours"].is_null() || !hold["kept_as"].is_null() {
                contested.push(hold.to_string());
            }
        }
        contested
    }
}

async fn read(client: &Client, line: &str, body: &Value) -> Option<Value> {
    match client.ask(line, &[], body).await {
        Answer::Came {
            status: 200, body, ..
        } => serde_json::from_str(&body).ok(),
        _ => None,
    }
}

/// Everything that an edge has: zones, closures of operators, and plans that were not cancelled.
pub(crate) async fn holding_of(client: &Client) -> Option<Holding> {
    let list = async |name: &str| {
        let line = format!("GET /v1/{name}?page_size=1000");
        read(client, &line, &Value::Null).await
    };
    let (zones, closures, plans) = (
        list("zones").await?,
        list("closures").await?,
        list("plans").await?,
    );
    let mut holding = listed(&zones["features"], |_| true);
    holding.extend(listed(&closures["closures"], |it| {
        it["cause"] == "operator"
    }));
    holding.extend(listed(&plans["plans"], |it| it["ended_as"] != "cancelled"));
    Some(holding)
}

/// The tag of each thing in a list by its id.
fn listed(things: &Value, counts: impl Fn(&Value) -> bool) -> Holding {
    let things = things.as_array().into_iter().flatten();
    let things = things.filter(|thing| counts(thing));
    let text = |thing: &Value| thing["id"].as_str().unwrap_or_default().to_owned();
    things.map(|it| (text(it), tag_in(it))).collect()
}
