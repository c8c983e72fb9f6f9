//! Taking over what was judged good: handed to the writer. What is refused is told, and what is stricter of it taken over.

use super::client::RegistryClient;
use super::followed::{BACKWARDS, Extent, FOREIGN_REGISTRY, RegistryDelta, Rejected, Tombstone};
use super::follower::bounded;
use super::task::{Mode, Step, Sync};
use crate::snapshot::Snapshot;
use crate::upstream::{RegistryCursor, Upstream, is_after};
use crate::writer::commands::Command;
use skyway_contract::{EventKind, Nack, ObjectKind};
use skyway_planted::{self as planted, Bug};
use skyway_service::refusal::{Code, Refusal};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

impl<C: RegistryClient> Sync<C> {
    /// Takes over what is stricter, from where the edge is.
    pub(super) async fn take_strict(&self, followed: RegistryDelta, cursor: &Arc<RegistryCursor>) {
        let strict = RegistryDelta {
            extent: Extent::Restrictions,
            after: Some(cursor.clone()),
            ..followed
        };
        if let Err(refusal) = self.edge.command(Command::Follow(Box::new(strict))).await {
            tracing::warn!(%refusal, "restrictions of the registry could not be taken over");
        }
    }

    /// Hands a batch to the writer. Where its network cannot take the place of the one in service, what is stricter of it
    /// is taken over, and the registry is read on in another way.
    pub(super) async fn take_over(
        &self,
        followed: RegistryDelta,
        head: u64,
        (mode, otherwise): (&mut Mode, Mode),
    ) -> Step {
        let (epoch, revision) = (followed.cursor.epoch, followed.cursor.revision);
        let puts = followed.puts.len();
        let with_network = followed.network.is_some().then(|| followed.clone());
        match self.command(followed).await {
            Ok(_) => {
                tracing::debug!(epoch, revision, puts, "the registry was followed");
                self.read_up_to(revision, head);
                Step::On
            }
            // It is read again for what the edge has become.
            Err(refusal) if refusal.code == Code::PreconditionFailed => Step::On,
            Err(refusal) => match with_network {
                Some(followed) if refusal.code == Code::NetworkInvalid => {
                    *mode = otherwise;
                    self.reject_network(followed, refusal).await
                }
                _ => {
                    // Nothing is wrong with what the registry said: it is read again.
                    self.contact().failed("writer");
                    tracing::warn!(%refusal, "what the registry said could not be taken over");
                    Step::Later
                }
            },
        }
    }

    async fn reject_network(&self, followed: RegistryDelta, refusal: Refusal) -> Step {
        let nack = Nack {
            revision: followed.cursor.revision,
            code: "network_change".to_owned(),
            object: None,
            reason: bounded(refusal.detail),
        };
        match self.without_network(followed).await {
            Ok(restrictions) => {
                self.reject(Rejected { nack, restrictions }).await;
                Step::Later
            }
            Err(refusal) => self.defect(&refusal),
        }
    }

    async fn command(&self, mut followed: RegistryDelta) -> Result<(), Refusal> {
        if let Some(network) = followed.network.take() {
            if let Some(absent) = absent(&self.edge.snapshot(), &followed) {
                self.edge.command(Command::Follow(Box::new(absent))).await?;
            }
            // What takes long of it is not the writer's to do.
            let snapshot = self.edge.snapshot();
            let prepared = self.edge.aside(move || network.prepared_for(&snapshot));
            followed.network = Some(prepared.await??);
        }
        if planted::is(Bug::CursorFirst) && followed.extent == Extent::Changes {
            self.move_cursor_first(&mut followed).await?;
        }
        let command = Command::Follow(Box::new(followed));
        self.edge.command(command).await.map(drop)
    }

    /// The bug [`Bug::CursorFirst`].
    async fn move_cursor_first(&self, followed: &mut RegistryDelta) -> Result<(), Refusal> {
        let bare = RegistryDelta {
            puts: Vec::new(),
            lifts: Vec::new(),
            ..followed.clone()
        };
        self.edge.command(Command::Follow(Box::new(bare))).await?;
        self.pause(Duration::from_millis(20)).await;
        followed.after = Some(Arc::new(followed.cursor.clone()));
        Ok(())
    }

    /// Reports what is not taken over, and takes over what may be of it.
    pub(super) async fn reject(&self, rejected: Rejected) {
        let Rejected { nack, restrictions } = rejected;
        let contact = self.contact();
        // A registry that is behind what was followed would lose again what it is told.
        if [FOREIGN_REGISTRY, BACKWARDS].contains(&&*nack.code) {
            contact.estrange();
        }
        if contact.refused(&nack) {
            tracing::error!(
                revision = nack.revision,
                code = nack.code,
                object = nack.object,
                reason = nack.reason,
                "the registry said something that is not taken over"
            );
            let data = serde_json::to_value(&nack).unwrap_or_default();
            self.tell(EventKind::RegistryRefused, data);
        }
        let Some(strict) = restrictions else {
            return;
        };
        if let Err(refusal) = self.edge.command(Command::Follow(strict)).await {
            tracing::warn!(%refusal, "restrictions of the registry could not be taken over");
        }
    }
}

/// What stands here and is not in the list of all that a registry has, lifted before the network of the list comes, as the
/// log does it: it may have no place there. None where there is nothing of that, or it is no list.
fn absent(here: &Snapshot, followed: &RegistryDelta) -> Option<RegistryDelta> {
    let after = followed.after.clone()?;
    if followed.extent != Extent::Everything {
        return None;
    }
    let cursor = &followed.cursor;
    let listed: BTreeSet<&str> = followed.puts.iter().map(|put| &*put.id).collect();
    let zones = here.zones.iter();
    let zones = zones.map(|(id, entry)| (ObjectKind::Zone, id, entry.upstream));
    let closures = here.closures.iter();
    let closures = closures.map(|(id, entry)| (ObjectKind::Closure, id, entry.upstream));
    let upstream = Upstream {
        epoch: cursor.epoch,
        revision: cursor.revision,
    };
    let absent = zones.chain(closures).filter(|(_, id, known)| {
        known.is_some_and(|known| !is_after(known, cursor)) && !listed.contains(&***id)
    });
    let lifts = absent.map(|(kind, id, _)| Tombstone {
        kind,
        id: id.clone(),
        upstream,
    });
    let lifts: Vec<Tombstone> = lifts.collect();
    (!lifts.is_empty()).then(|| RegistryDelta {
        extent: Extent::Changes,
        cursor: (*after).clone(),
        after: Some(after),
        topology: here.topology().clone(),
        network: None,
        superseded: Vec::new(),
        puts: Vec::new(),
        lifts,
        weather: None,
    })
}
