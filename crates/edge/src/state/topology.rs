//! Another network takes the place of the one in service, while everything goes on.
//!
//! What stands is carried over by its ids: zones close what they cover on the new network, closures and proposals
//! what is left of what they name, plans are flown on where their ways are as they were. Requests under way keep the
//! snapshot that they began with; what they order afterwards is carried over as it comes in.

use super::State;
use crate::entries::{ClosureEntry, ProposalEntry, Reported, ZoneEntry};
use crate::network::replacement::{NewNetwork, Relay, Succession, not_laid};
use crate::snapshot::revision_text;
use crate::writer::commands::{Command, Done, Publication};
use jiff::Timestamp;
use serde_json::json;
use skyway_contract::EventKind;
use skyway_engine::airspace::Closure;
use skyway_engine::compose;
use skyway_engine::network::{Correspondence, Topology};
use skyway_service::refusal::{Code, Refusal};
use std::sync::Arc;

impl State {
    /// Puts another network in the place of the one in service. To be called before anything else of a batch.
    ///
    /// # Errors
    /// When it cannot take the place of the one in service; nothing has changed then.
    pub(super) fn replace_network(
        &mut self,
        network: &NewNetwork,
        now: Timestamp,
    ) -> Result<Done, Refusal> {
        network.check(&self.next)?;
        let topology = &network.topology;
        let is_same =
            self.next.has_network() && self.next.topology().fingerprint() == topology.fingerprint();
        if is_same {
            return Ok(Done::Nothing);
        }
        self.apply_changes(now);
        let relay = network.relay(&self.next)?;
        let before = self.next.clone();
        let closures = relay.closures.iter().map(|relaid| relaid.after.clone());
        let airspace = Arc::new(before.airspace.over(topology.clone(), closures));
        self.next.revision = revision_text(self.next.epoch, airspace.revision());
        self.next.airspace = airspace;
        self.next.network = relay.documents.clone();
        self.tell_network_changed();
        self.relay_airspace(&relay);
        let change = compose::Change {
            from: before.topology(),
            to: topology,
            correspondence: &relay.correspondence,
        };
        self.carry_plans_over(&before, &change, now);
        self.succession = Some(Succession {
            before: Arc::downgrade(before.topology()),
            correspondence: relay.correspondence.clone(),
        });
        Ok(Done::Nothing)
    }

    /// Applies what the commands before have changed of the airspace, while its indices mean something.
    fn apply_changes(&mut self, now: Timestamp) {
        let changes = std::mem::take(&mut self.changes);
        if !changes.is_empty() {
            self.next.airspace = Arc::new(self.next.airspace.apply(&changes, now));
        }
    }

    fn tell_network_changed(&mut self) {
        let topology = self.next.topology();
        let data = json!({
            "topology_revision": self.next.airspace.topology_revision(),
            "name": topology.name(),
            "nodes": topology.node_count(),
            "segments": topology.segment_count(),
            "sha256": topology.fingerprint_text(),
        });
        self.happen(EventKind::NetworkChanged, data);
    }

    /// Zones, closures and proposals as they are on the new network.
    fn relay_airspace(&mut self, relay: &Relay) {
        for relaid in &relay.closures {
            let id = relaid.after.id.as_str();
            if let Some(entry) = self.next.closures.get(id).cloned() {
                let closure = relaid.after.clone();
                let entry = Arc::new(ClosureEntry {
                    closure,
                    ..(*entry).clone()
                });
                self.next.closures.insert(Arc::from(id), entry);
            } else if let Some(entry) = self.next.zones.get(id).filter(|_| !relay.same_plane)
                && let Some(zone) = relaid.after.zone().cloned()
            {
                let entry = ZoneEntry {
                    zone,
                    ..(**entry).clone()
                };
                self.next.zones.insert(Arc::from(id), Arc::new(entry));
            }
        }
        let proposals: Vec<_> = self.next.proposals.values().cloned().collect();
        for entry in proposals {
            let number = entry.number;
            let Some(relaid) = relay.proposals.get(&number) else {
                self.drop_proposal(number, "network_changed");
                continue;
            };
            let entry = ProposalEntry {
                closure: relaid.after.clone(),
                ..(*entry).clone()
            };
            self.next.proposals.insert(number, Arc::new(entry));
        }
        let reported = self.next.closures.values().map(|entry| entry.reported());
        self.next.reported = reported.fold(Reported::default(), Reported::plus);
        let airspace = &self.next.airspace;
        let other = relay.closures.iter().filter(|relaid| relaid.closes_other);
        let other = other.filter(|relaid| airspace.is_in_force(&relaid.after.id));
        self.relaid = other.map(|relaid| relaid.after.clone()).collect();
    }

    /// Carries out a command made on a network, which may not be the one in service any more.
    pub(super) fn carry_out_made_on(
        &mut self,
        topology: &Arc<Topology>,
        order: Command,
        now: Timestamp,
    ) -> Result<Done, Refusal> {
        if Arc::ptr_eq(topology, self.next.topology()) {
            return self.carry_out(order, now);
        }
        let correspondence = self.correspondence_from(topology);
        match self.order_over(topology, order, &correspondence)? {
            Some(order) => self.carry_out(order, now),
            None => Ok(Done::Outdated),
        }
    }

    fn correspondence_from(&self, topology: &Arc<Topology>) -> Arc<Correspondence> {
        let known = self.succession.as_ref();
        let known = known.filter(|known| known.before.as_ptr() == Arc::as_ptr(topology));
        match known {
            Some(known) => known.correspondence.clone(),
            None => Arc::new(Correspondence::between(topology, self.next.topology())),
        }
    }

    /// A command on the network in service; `None` where nothing is left of it, or it has to be worked out anew.
    fn order_over(
        &mut self,
        made_on: &Arc<Topology>,
        order: Command,
        correspondence: &Correspondence,
    ) -> Result<Option<Command>, Refusal> {
        let over = |closure: &Arc<Closure>| self.closure_over(made_on, closure, correspondence);
        Ok(match order {
            Command::PutZone { closure, expected } => Some(Command::PutZone {
                closure: over(&closure)?,
                expected,
            }),
            Command::PutClosure(entry) => {
                let closure = over(&entry.closure)?;
                if closes_nothing(&closure) {
                    let detail = format!(
                        "the network has changed and has nothing any more of what '{}' closes",
                        closure.id
                    );
                    return Err(Refusal::new(Code::ClosureInvalid, detail));
                }
                Some(Command::PutClosure(ClosureEntry { closure, ..entry }))
            }
            Command::Publish(publication) => {
                let Publication { entry, otherwise } = *publication;
                let closure = over(&entry.closure)?;
                let is_left = !closes_nothing(&closure);
                is_left.then(|| {
                    let otherwise = ProposalEntry {
                        closure: closure.clone(),
                        ..otherwise
                    };
                    let entry = ClosureEntry { closure, ..entry };
                    Command::Publish(Box::new(Publication { entry, otherwise }))
                })
            }
            Command::Propose(proposal) => {
                let closure = over(&proposal.closure)?;
                let is_left = closure.zone().is_some() || !closes_nothing(&closure);
                let proposal = ProposalEntry {
                    closure,
                    ..*proposal
                };
                is_left.then(|| Command::Propose(Box::new(proposal)))
            }
            Command::ImportZones(update) => {
                let mut update = *update;
                for closure in &mut update.puts {
                    *closure = over(closure)?;
                }
                for outline in &mut update.outlines {
                    outline.closure = over(&outline.closure)?;
                }
                Some(Command::ImportZones(Box::new(update)))
            }
            Command::ProposeVersion { plan, version } => {
                self.version_over(&plan, *version, made_on, correspondence)
            }
            // A plan is composed anew: another way may be shorter now.
            Command::AddPlan(_) | Command::OfferVersion { .. } => None,
            other => Some(other),
        })
    }

    fn closure_over(
        &self,
        made_on: &Topology,
        closure: &Arc<Closure>,
        correspondence: &Correspondence,
    ) -> Result<Arc<Closure>, Refusal> {
        let topology = self.next.topology();
        let same_plane = made_on.frame() == topology.frame();
        let over = closure.over(topology, correspondence, same_plane);
        over.map(Arc::new)
            .map_err(|faults| not_laid(&closure.id, &faults))
    }
}

fn closes_nothing(closure: &Closure) -> bool {
    let hits = &closure.hits;
    hits.segments.is_empty() && hits.nodes.is_empty() && closure.pads.is_empty()
}
