//! The record of a run: one line of JSON for each thing that happened, for judges to read.
//!
//! `run` and `network` come first, then in the order in which they were known: `version` (a plan's
//! version as it is to be flown), `pack` (what its drone does when the line is gone), `refused` (a request without a plan), `event` (as the edge told
//! it), and at the end `plan` (how each plan stands). Where the edge is killed: `restarted`, then
//! what its lists say that events may not have told, `found` (a zone) and `listed` (a plan).

use super::Workload;
use super::listener::Heard;
use crate::Result;
use crate::transport::Told;
use bytes::Bytes;
use serde_json::{Value, json};
use skyway::wire::DeliveryRequest;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// What judges need of a leg, of a stay, and of a version.
const OF_LEG: [&str; 6] = [
    "from",
    "to",
    "segment",
    "departs_at",
    "arrives_at",
    "geometry",
];
const OF_STOP: [&str; 7] = [
    "node",
    "pad",
    "kind",
    "before_leg",
    "lands_at",
    "takes_off_at",
    "battery_after_fraction",
];
const OF_FLIGHT: [&str; 1] = ["battery_before_fraction"];
const OF_VERSION: [&str; 7] = [
    "version",
    "outcome",
    "sent_at",
    "departs_at",
    "arrives_at",
    "first_stretch",
    "flags",
];
/// What is told of a plan at the end.
const OF_PLAN: [&str; 6] = [
    "id",
    "drone_id",
    "state",
    "ended_as",
    "flags",
    "affected_by",
];

/// Where lines go, if anywhere.
pub(crate) struct Record(Option<BufWriter<File>>);

impl Record {
    pub(crate) fn at(path: Option<&Path>) -> Result<Self> {
        let file = path.map(File::create).transpose()?;
        Ok(Self(file.map(BufWriter::new)))
    }

    pub(crate) fn is_kept(&self) -> bool {
        self.0.is_some()
    }

    fn line(&mut self, line: &Value) -> Result<()> {
        if let Some(file) = &mut self.0 {
            serde_json::to_writer(&mut *file, line)?;
            file.write_all(b"\n")?;
        }
        Ok(())
    }

    /// What is flown, and over which network.
    pub(crate) fn begin(
        &mut self,
        workload: &Workload,
        commit: &str,
        network: &Bytes,
    ) -> Result<()> {
        self.line(&json!({
            "kind": "run",
            "workload": workload.name,
            "seed": workload.seed,
            "commit": commit,
            "airframe": workload.airframe,
            "begun_at": jiff::Timestamp::now().to_string(),
        }))?;
        let network: Value = serde_json::from_slice(network)?;
        self.line(&json!({"kind": "network", "network": network}))
    }

    /// A request that there is no plan for.
    pub(crate) fn refused(&mut self, request: &DeliveryRequest, told: &Told) -> Result<()> {
        if !self.is_kept() {
            return Ok(());
        }
        let answer: Value = serde_json::from_slice(&told.body).unwrap_or_default();
        let at = jiff::Timestamp::now().to_string();
        self.line(&json!({"kind": "refused", "at": at, "request": request, "answer": answer}))
    }

    /// The plan of an answer: its first version.
    pub(crate) fn composed(&mut self, told: &Told) -> Result<()> {
        if !self.is_kept() {
            return Ok(());
        }
        let plan: Value = serde_json::from_slice(&told.body)?;
        self.version(&plan, &plan["reported"])
    }

    /// The pack of a plan, in hexadecimal digits.
    pub(crate) fn pack(&mut self, plan: &str, bytes: &[u8]) -> Result<()> {
        let at = jiff::Timestamp::now().to_string();
        self.line(&json!({"kind": "pack", "plan_id": plan, "at": at, "bytes": hex::encode(bytes)}))
    }

    /// How a plan stands at the end, and the version that its drone flies where that is not the
    /// first.
    pub(crate) fn stands(&mut self, plan: &Value) -> Result<()> {
        for (version, is_new) in [(&plan["reported"], false), (&plan["wanted"], true)] {
            if is_new && version.is_null() {
                continue;
            }
            if is_new || version["version"] != 1 {
                self.version(plan, version)?;
            }
        }
        let mut line = json!({"kind": "plan"});
        pick(&mut line, plan, &OF_PLAN);
        line["reported"] = plan["reported"]["version"].clone();
        line["wanted"] = plan["wanted"]["version"].clone();
        self.line(&line)
    }

    /// The edge was killed and is there again.
    pub(crate) fn restarted(&mut self) -> Result<()> {
        let at = jiff::Timestamp::now().to_string();
        self.line(&json!({"kind": "restarted", "at": at}))
    }

    /// A zone in the list of an edge that was killed before it answered: it came after it was sent, and is there now.
    pub(crate) fn found(&mut self, zone: &Value, sent_at: &str) -> Result<()> {
        let at = jiff::Timestamp::now().to_string();
        self.line(&json!({"kind": "found", "at": at, "sent_at": sent_at, "zone": zone}))
    }

    /// How a plan stands in the list of an edge that was killed: what events may not have told.
    pub(crate) fn listed(&mut self, plan: &Value) -> Result<()> {
        let mut line = json!({"kind": "listed", "at": jiff::Timestamp::now().to_string()});
        pick(&mut line, plan, &OF_PLAN);
        line["reported"] = plan["reported"]["version"].clone();
        for (name, of) in [
            ("wanted", "version"),
            ("outcome", "outcome"),
            ("sent_at", "sent_at"),
        ] {
            line[name] = plan["wanted"][of].clone();
        }
        self.line(&line)
    }

    /// The version that a drone is about to take over.
    pub(crate) fn read(&mut self, plan: &Value) -> Result<()> {
        self.version(plan, &plan["wanted"])
    }

    fn version(&mut self, plan: &Value, version: &Value) -> Result<()> {
        let mut line =
            json!({"kind": "version", "plan_id": plan["id"], "drone_id": plan["drone_id"]});
        pick(&mut line, version, &OF_VERSION);
        line["legs"] = all(&version["legs"], &OF_LEG);
        let flown = version["legs"].as_array().into_iter().flatten();
        for (leg, flown) in line["legs"].as_array_mut().into_iter().flatten().zip(flown) {
            pick(leg, &flown["flight"], &OF_FLIGHT);
        }
        line["stops"] = all(&version["flight"]["stops"], &OF_STOP);
        self.line(&line)
    }

    /// What was heard; plans as they were composed are there already.
    pub(crate) fn heard(&mut self, events: &[Heard]) -> Result<()> {
        let Some(file) = &mut self.0 else {
            return Ok(());
        };
        for heard in events.iter().filter(|heard| heard.kind != "plan_composed") {
            // It is JSON on one line already.
            file.write_all(br#"{"kind":"event","event":"#)?;
            file.write_all(&heard.data)?;
            file.write_all(b"}\n")?;
        }
        Ok(())
    }

    pub(crate) fn end(mut self) -> Result<()> {
        if let Some(file) = &mut self.0 {
            file.flush()?;
        }
        Ok(())
    }
}

fn pick(into: &mut Value, from: &Value, names: &[&str]) {
    for name in names {
        if let Some(value) = from.get(name) {
            into[*name] = value.clone();
        }
    }
}

fn all(list: &Value, names: &[&str]) -> Value {
    let picked = |entry: &Value| {
        let mut value = json!({});
        pick(&mut value, entry, names);
        value
    };
    let entries = list.as_array().map(Vec::as_slice).unwrap_or_default();
    entries.iter().map(picked).collect()
}
