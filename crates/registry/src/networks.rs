//! Networks: put as a whole, patched, told. What stands on a network stays valid whatever it becomes.

use super::Registry;
use super::store::{Expectation, NewChange, ObjectsQuery, Version};
use super::topologies::{Composed, Made, aside};
use super::writes::{Decision, Intent, Reply, WriteOptions};
use serde_json::Value;
use skyway_contract::{
    ChangeOperation, LoggedChange, NetworkPatch, NetworkSummaries, NetworkSummary, ObjectKind,
    PublishedClosure,
};
use skyway_engine::network::{NetworkDraft, Topology};
use skyway_formats::{
    LoadError, ZoneId, fingerprint, patch_network, read_network, write_network, zone_from_feature,
};
use skyway_service::intake::{Expected, Faults, network_refusal, network_rejected, read_weather};
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

/// How many objects are looked at between two questions to the store.
const OBJECTS_AT_ONCE: u64 = 1_000;

impl Registry {
    /// All networks, by id.
    ///
    /// # Errors
    /// When the store does not answer.
    pub async fn networks(&self) -> Result<NetworkSummaries, Refusal> {
        let identity = self.store.identity().await?;
        let networks = self.store.networks().await?.into_iter();
        let networks = networks.map(|state| NetworkSummary {
            id: state.id,
            etag: state.topology.etag(),
            head: state.head,
            oldest: state.oldest,
            zones: state.zones,
            closures: state.closures,
        });
        Ok(NetworkSummaries {
            registry_id: identity.registry_id,
            epoch: identity.epoch,
            networks: networks.collect(),
        })
    }

    /// A network in the native format, and its entity tag.
    ///
    /// # Errors
    /// When there is none.
    pub async fn network(&self, id: &str) -> Result<(Arc<str>, String), Refusal> {
        let (state, composed) = self.composed(id).await?;
        Ok((composed.text.clone(), state.topology.etag()))
    }

    /// Puts a network as a whole, new or in place of the version that `If-Match` names.
    ///
    /// # Errors
    /// When it is not valid, another version is current, or something that stands would lose its ground.
    pub async fn put_network(
        self: &Arc<Self>,
        id: &str,
        text: &str,
        manner: &WriteOptions,
    ) -> Result<Reply, Refusal> {
        check_network_id(id)?;
        let intent = Intent::PutNetwork { text: text.into() };
        self.write(id, intent, manner).await
    }

    /// Adds, changes and removes nodes and segments.
    ///
    /// # Errors
    /// As with [`Registry::put_network`]; when there is no such network.
    pub async fn patch_network(
        self: &Arc<Self>,
        id: &str,
        patch: NetworkPatch,
        manner: &WriteOptions,
    ) -> Result<Reply, Refusal> {
        self.write(id, Intent::PatchNetwork { patch }, manner).await
    }

    pub(super) async fn decide_network(
        self: &Arc<Self>,
        id: &str,
        text: &Arc<str>,
        manner: &WriteOptions,
    ) -> Result<Decision, Refusal> {
        let state = self.store.network(id).await?;
        let version = state.as_ref().map(|state| state.topology);
        let etag = version.map(Version::etag);
        Expected::of(manner.if_match.clone()).check(etag.as_deref(), "network", id)?;
        let text = text.clone();
        let made = aside(move || read(&text)).await??;
        if let Some(state) = &state {
            self.check_fit(id, state.head, &made.topology).await?;
        }
        Ok(Decision {
            creates: state.is_none(),
            created: state.is_none(),
            head: state.map(|state| state.head),
            expects: vec![expectation(version)],
            change: change(ChangeOperation::Put, made.text.to_string()),
            lifts: None,
            object: None,
            network: Some(made),
        })
    }

    pub(super) async fn decide_patch(
        self: &Arc<Self>,
        id: &str,
        patch: &NetworkPatch,
        manner: &WriteOptions,
    ) -> Result<Decision, Refusal> {
        let (state, composed) = self.composed(id).await?;
        let etag = state.topology.etag();
        Expected::of(manner.if_match.clone()).check(Some(&etag), "network", id)?;
        let owned = patch.clone();
        let made = aside(move || patched(&composed, &owned)).await??;
        self.check_fit(id, state.head, &made.topology).await?;
        let body = serde_json::to_string(patch).map_err(|error| {
            Refusal::new(
                Code::Internal,
                format!("the patch has no JSON form: {error}"),
            )
        })?;
        Ok(Decision {
            creates: false,
            created: false,
            head: Some(state.head),
            expects: vec![expectation(Some(state.topology))],
            change: change(ChangeOperation::Patch, body),
            lifts: None,
            object: None,
            network: Some(made),
        })
    }

    /// Checks that all that stands at a revision is valid on another topology, too.
    async fn check_fit(
        &self,
        network: &str,
        at: u64,
        topology: &Arc<Topology>,
    ) -> Result<(), Refusal> {
        let mut faults = Faults::default();
        let mut after = None;
        loop {
            let query = ObjectsQuery {
                network: network.to_owned(),
                at: Some(at),
                kind: None,
                after: after.take(),
                limit: OBJECTS_AT_ONCE,
                bytes: self.settings.page_bytes,
            };
            let Some(read) = self.store.objects(&query).await? else {
                break;
            };
            let (objects, ground) = (read.objects, topology.clone());
            after = objects.last().map(|last| (last.kind, last.id.clone()));
            let misfits = aside(move || misfits(&objects, &ground)).await?;
            for (pointer, message) in misfits {
                faults.add("in_use", &pointer, message, None);
            }
            if !read.has_more {
                break;
            }
        }
        faults.check(Code::NetworkInUse, "change of the network")
    }
}

fn check_network_id(id: &str) -> Result<(), Refusal> {
    let mut faults = Faults::default();
    faults.id("{network}", Some(id));
    faults.check(Code::ParameterInvalid, "path")
}

fn expectation(version: Option<Version>) -> Expectation {
    Expectation {
        kind: ObjectKind::Network,
        id: String::new(),
        version,
    }
}

fn change(operation: ChangeOperation, body: String) -> NewChange {
    NewChange {
        kind: ObjectKind::Network,
        id: String::new(),
        operation,
        body: Some(body),
    }
}

/// A network as it is kept, and what stands on it is checked against.
fn read(text: &str) -> Result<Made, Refusal> {
    let draft = read_network(text).map_err(|errors| network_refusal(LoadError::Format(errors)))?;
    made(draft)
}

fn patched(composed: &Composed, patch: &NetworkPatch) -> Result<Made, Refusal> {
    let draft = patch_network(&composed.draft, patch)
        .map_err(|errors| network_refusal(LoadError::Format(errors)))?;
    made(draft)
}

fn made(draft: NetworkDraft) -> Result<Made, Refusal> {
    let text = write_network(&draft);
    let topology = Topology::build(draft.clone(), fingerprint(&[&text]));
    Ok(Made {
        draft,
        topology: Arc::new(topology.map_err(network_rejected)?),
        text: text.into(),
    })
}

/// What of these objects a topology has no ground for: the place of each, and why.
fn misfits(objects: &[LoggedChange], topology: &Topology) -> Vec<(String, String)> {
    let misfits = objects.iter().filter_map(|object| {
        let why = misfit(object, topology)?;
        let list = match object.kind {
            ObjectKind::Zone => "zones/",
            ObjectKind::Closure => "closures/",
            ObjectKind::Weather | ObjectKind::Network => "weather",
        };
        Some((format!("/{list}{}", object.id), why))
    });
    misfits.collect()
}

fn misfit(object: &LoggedChange, topology: &Topology) -> Option<String> {
    let body = object.body.as_deref().unwrap_or_default();
    let frame = topology.frame();
    let id = &object.id;
    match object.kind {
        ObjectKind::Network => None,
        ObjectKind::Weather => {
            let weather = serde_json::from_str(body).ok()?;
            let refusal = read_weather(&weather, frame).err()?;
            Some(format!("the weather would not be valid: {refusal}"))
        }
        ObjectKind::Zone => {
            let feature: Value = serde_json::from_str(body).ok()?;
            let problems = zone_from_feature(&feature, ZoneId::Fixed(id), frame).err()?;
            let first = problems.into_iter().next()?;
            Some(format!("zone '{id}' would not be valid: {first}"))
        }
        ObjectKind::Closure => {
            let closure: PublishedClosure = serde_json::from_str(body).ok()?;
            let mut segments = closure.segments.iter();
            if let Some(lost) = segments.find(|name| topology.find_segment(name).is_none()) {
                return Some(format!("closure '{id}' names the segment '{lost}'"));
            }
            let mut nodes = closure.nodes.iter().chain(&closure.pads);
            let lost = nodes.find(|node| topology.node(node.text()).is_none())?;
            Some(format!("closure '{id}' names the node '{lost}'"))
        }
    }
}
