//! A storm of zones in which the edge is killed again and again, and starts again on its store.
//!
//! Operator and drones go on until the next kill: what was not taken is posted once more, and each
//! drone takes over what it is told. After a kill both do what clients do that have missed events:
//! they listen on from the last one that they have, and read the lists where those after it are
//! gone.

use super::Zones;
use super::bystander::Edge;
use super::edges::Started;
use super::filling::Accepted;
use super::goals::{Figures, Measure};
use super::listener::Heard;
use super::record::Record;
use super::storm::Storm;
use crate::Result;
use crate::arrivals::Chance;
use crate::fleet::asked;
use crate::requests::{self, get};
use crate::transport::Connections;
use http::Method;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;
use tokio::time::sleep;

/// How long an edge lives before it is killed: at least, at most.
const LIFE_S: [f64; 2] = [0.02, 1.0];
/// After the last kill zones that were not taken are posted so often, and drones look so often for what they are told.
const PASSES: usize = 20;
const LOOK_AGAIN: Duration = Duration::from_millis(10);
const PAGE: usize = 100;

/// A list of the edge, page by page.
pub(super) struct Pages {
    path: &'static str,
    /// Where the entries stand in a page.
    member: &'static str,
    /// What names the next page; none after the last.
    token: Option<String>,
}

impl Pages {
    pub(super) fn of(path: &'static str, member: &'static str) -> Self {
        Self {
            path,
            member,
            token: Some(String::new()),
        }
    }

    /// The entries of the next page; nothing after the last.
    pub(super) async fn next(&mut self, connections: &Connections) -> Result<Option<Vec<Value>>> {
        let Some(token) = self.token.take() else {
            return Ok(None);
        };
        let path = format!("{}?page_size={PAGE}{token}", self.path);
        let told = asked(connections, &get(path)).await?;
        let mut page: Value = serde_json::from_slice(&told.body)?;
        let next = page["next_page_token"].as_str();
        self.token = next.map(|next| format!("&page_token={next}"));
        match page[self.member].take() {
            Value::Array(entries) => Ok(Some(entries)),
            _ => Err(format!("{} has no {}", self.path, self.member).into()),
        }
    }
}

/// The drones of a fleet: each takes over what it is told.
pub(super) struct Drones<'a> {
    record: &'a mut Record,
    /// The plans of those that are told something and have not looked yet.
    told: BTreeSet<String>,
    /// The plans that anything was ever heard of: a kill may undo it.
    touched: BTreeSet<String>,
    /// The version that the edge has confirmed for each that took over one.
    confirmed: BTreeMap<String, u64>,
}

impl<'a> Drones<'a> {
    pub(super) fn of(record: &'a mut Record) -> Self {
        Self {
            record,
            told: BTreeSet::new(),
            touched: BTreeSet::new(),
            confirmed: BTreeMap::new(),
        }
    }

    fn hear(&mut self, heard: &[Heard]) -> Result<()> {
        for outcome in heard.iter().filter_map(Heard::outcome) {
            self.touched.insert(outcome.plan.id.clone());
            self.told.insert(outcome.plan.id);
        }
        self.record.heard(heard)
    }

    /// What is told now is taken over; tells whether anything was.
    async fn look(&mut self, edge: &Edge) -> Result<bool> {
        self.hear(&edge.listener.take())?;
        let is_any = !self.told.is_empty();
        while let Some(plan) = self.told.pop_first() {
            self.take_over(edge, &plan).await?;
        }
        Ok(is_any)
    }

    async fn take_over(&mut self, edge: &Edge, id: &str) -> Result<()> {
        let path = format!("/v1/plans/{id}");
        let told = asked(&edge.operator, &get(path.as_str())).await?;
        let plan: Value = serde_json::from_slice(&told.body)?;
        let Some(version) = plan["wanted"]["version"].as_u64() else {
            return Ok(());
        };
        self.record.read(&plan)?;
        let body = json!({ "version": version }).to_string();
        let ack = requests::send(Method::POST, format!("{path}/ack"), body);
        // Where it is too late the drone flies on.
        if edge.operator.ask(&ack).await?.status.is_success() {
            self.confirmed.insert(id.to_owned(), version);
        }
        Ok(())
    }

    /// Until this is dropped.
    async fn go_on(&mut self, edge: &Edge) -> Result<()> {
        loop {
            self.look(edge).await?;
            sleep(LOOK_AGAIN).await;
        }
    }
}

/// A storm with kills while it goes on.
pub(super) struct Killed<'a> {
    pub(super) started: &'a mut Started,
    pub(super) storm: Storm,
    pub(super) zones: Zones,
    pub(super) plans: &'a [Accepted],
    pub(super) drones: Drones<'a>,
    pub(super) chance: &'a mut Chance,
}

/// What kills came to.
#[derive(Default)]
struct Came {
    lost: BTreeSet<String>,
    gone: usize,
    slowest: Duration,
}

impl Killed<'_> {
    pub(super) async fn play(mut self, figures: &mut Figures) -> Result<()> {
        let mut came = Came::default();
        for kill in 1..=self.zones.kills {
            let until = self.zones.storm * kill / (self.zones.kills + 1);
            self.live(until).await?;
            let restarted = self.started.kill().await?;
            self.drones.hear(&restarted.heard)?;
            self.drones.record.restarted()?;
            came.slowest = came.slowest.max(restarted.took);
            if restarted.is_gone {
                came.gone += 1;
                self.read(&mut came).await?;
            }
        }
        self.calm().await?;
        self.read(&mut came).await?;
        for lost in &came.lost {
            crate::run::eprintln_line(&format!("lost: {lost}"));
        }
        let missing = self.zones.storm - self.storm.taken().len();
        figures.put(Measure::Kills, self.zones.kills as f64);
        figures.put(Measure::EventsGone, came.gone as f64);
        figures.put(Measure::RestartMs, came.slowest.as_secs_f64() * 1e3);
        figures.put(Measure::Lost, came.lost.len() as f64);
        figures.put(Measure::ZonesMissing, missing as f64);
        Ok(())
    }

    /// The storm goes on for as long as the edge lives.
    async fn live(&mut self, until: usize) -> Result<()> {
        let [least_s, most_s] = LIFE_S;
        let life_s = least_s + (most_s - least_s) * self.chance.unit();
        let edge = &self.started.edge;
        let posting = self.storm.post(edge.address, until);
        let working = async { tokio::try_join!(posting, self.drones.go_on(edge)) };
        tokio::select! {
            failed = working => failed.map(|_| ()),
            () = sleep(Duration::from_secs_f64(life_s)) => Ok(()),
        }
    }

    /// All that is left of the storm, and until there is nothing more to tell.
    async fn calm(&mut self) -> Result<()> {
        for _ in 0..PASSES {
            let edge = &self.started.edge;
            self.storm.post(edge.address, self.zones.storm).await?;
            edge.settled().await?;
            let is_any = self.drones.look(edge).await?;
            if !is_any && self.storm.taken().len() == self.zones.storm {
                break;
            }
        }
        Ok(())
    }

    /// The lists of an edge whose events are gone: what was acknowledged has to be in them, and they
    /// tell what no event did.
    async fn read(&mut self, came: &mut Came) -> Result<()> {
        let operator = &self.started.edge.operator;
        let mut missing: BTreeSet<String> = self.storm.taken().into_iter().collect();
        let mut zones = Pages::of("/v1/zones", "features");
        while let Some(page) = zones.next(operator).await? {
            for zone in &page {
                let id = zone["id"].as_str().unwrap_or_default();
                missing.remove(id);
                if let Some(sent_at) = self.storm.found(id) {
                    self.drones.record.found(zone, &sent_at.to_string())?;
                }
            }
        }
        came.lost
            .extend(missing.iter().map(|id| format!("zone {id}")));
        let plans = self.plans.iter().map(|plan| plan.id.as_str());
        let mut missing: BTreeSet<&str> = plans.collect();
        let mut plans = Pages::of("/v1/plans", "plans");
        while let Some(page) = plans.next(operator).await? {
            for plan in &page {
                let id = plan["id"].as_str().unwrap_or_default();
                missing.remove(id);
                let confirmed = self.drones.confirmed.get(id).copied();
                let reported = plan["reported"]["version"].as_u64();
                if confirmed > reported {
                    came.lost
                        .insert(format!("version {confirmed:?} of plan {id}"));
                }
                self.drones.read_of_list(id, plan)?;
            }
        }
        came.lost
            .extend(missing.iter().map(|id| format!("plan {id}")));
        Ok(())
    }
}

impl Drones<'_> {
    /// A plan that is no more as it was composed.
    fn read_of_list(&mut self, id: &str, plan: &Value) -> Result<()> {
        if !plan["wanted"].is_null() {
            self.told.insert(id.to_owned());
        }
        let has_changed = plan["reported"]["version"] != 1 || plan["state"] == "ended";
        let is_met = plan["affected_by"]
            .as_array()
            .is_some_and(|by| !by.is_empty());
        if has_changed || is_met || self.touched.contains(id) {
            self.record.listed(plan)?;
        }
        Ok(())
    }
}
