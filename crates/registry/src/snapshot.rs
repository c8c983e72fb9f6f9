//! Everything that holds, in pages at one revision, however the log grows meanwhile.

use super::Registry;
use super::store::{ObjectsQuery, Version};
use super::topologies::Composed;
use skyway_contract::{Fault, LoggedChange, ObjectKind, RegistrySnapshot, SnapshotObject};
use skyway_service::intake::{read_token, token};
use skyway_service::refusal::{Code, Refusal};

/// The most objects in a page.
const OBJECTS_MAX: u64 = 2_000;

/// Which page of a snapshot is asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SnapshotRequest {
    /// The most objects besides the network.
    pub size: Option<u64>,
    /// Where the page begins: the `next_page_token` of the page before.
    pub token: Option<String>,
}

/// Where a page begins, and at which revision all pages are.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Cursor {
    epoch: u64,
    revision: u64,
    /// After this object; none after the network alone.
    after: Option<(ObjectKind, String)>,
}

impl Cursor {
    fn token(&self) -> String {
        let (kind, id) = match &self.after {
            Some((kind, id)) => (kind.name(), id.as_str()),
            None => ("", ""),
        };
        token(&format!("{} {} {kind} {id}", self.epoch, self.revision))
    }

    fn read(text: &str) -> Option<Self> {
        let text = read_token(text)?;
        let mut parts = text.splitn(4, ' ');
        let (epoch, revision) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
        let (kind, id) = (parts.next()?, parts.next()?);
        let after = match kind {
            "" => None,
            name => {
                let kind = ObjectKind::ALL
                    .into_iter()
                    .find(|kind| kind.name() == name)?;
                Some((kind, id.to_owned()))
            }
        };
        Some(Self {
            epoch,
            revision,
            after,
        })
    }
}

impl Registry {
    /// A page of everything that holds at one revision; the first one begins with the network.
    ///
    /// # Errors
    /// When there is no such network, the token is none, or its revision is no longer kept: then begin anew.
    pub async fn snapshot(
        &self,
        network: &str,
        request: &SnapshotRequest,
    ) -> Result<RegistrySnapshot, Refusal> {
        let cursor = match request.token.as_deref() {
            None | Some("") => None,
            Some(text) => Some(Cursor::read(text).ok_or_else(no_token)?),
        };
        let query = ObjectsQuery {
            network: network.to_owned(),
            at: cursor.as_ref().map(|cursor| cursor.revision),
            kind: None,
            after: cursor.as_ref().and_then(|cursor| cursor.after.clone()),
            limit: request.size.unwrap_or(OBJECTS_MAX).clamp(1, OBJECTS_MAX),
            bytes: self.settings.page_bytes,
        };
        let read = self.store.objects(&query).await?;
        let read = read.ok_or_else(|| Refusal::not_found("network", network))?;
        let is_kept = (read.state.oldest..=read.state.head).contains(&read.at);
        let epoch = read.identity.epoch;
        if !is_kept || cursor.as_ref().is_some_and(|cursor| cursor.epoch != epoch) {
            let detail = "the revision of this snapshot is no longer kept; begin anew";
            let gone = Refusal::new(Code::ChangesGone, detail);
            return Err(gone.with_oldest_revision(read.state.oldest));
        }
        let shown = Version {
            epoch,
            revision: read.at,
        };
        self.remember(network, shown).await;
        let mut objects = Vec::with_capacity(read.objects.len() + 1);
        if cursor.is_none() {
            let composed = self.composed_at(network, read.at).await?;
            objects.push(network_object(network, &composed));
        }
        let last = read.objects.last();
        let after = last.map(|last| (last.kind, last.id.clone()));
        let next = read.has_more.then_some(Cursor {
            epoch,
            revision: read.at,
            after,
        });
        objects.extend(
            read.objects
                .into_iter()
                .map(|change| object(network, change)),
        );
        let mut page = RegistrySnapshot {
            registry_id: read.identity.registry_id,
            epoch,
            network: network.to_owned(),
            revision: read.at,
            object_count: read.count + 1,
            authoritative_empty: read.restrictions == 0,
            objects,
            next_page_token: next.map(|next| next.token()),
            checksum: String::new(),
        };
        page.checksum = page.digest();
        Ok(page)
    }
}

fn no_token() -> Refusal {
    let fault = Fault {
        code: "page_invalid".to_owned(),
        pointer: "?page_token".to_owned(),
        message: "it is not a token that a page gave".to_owned(),
        hint: None,
    };
    Refusal::at(Code::ParameterInvalid, fault)
}

fn network_object(network: &str, composed: &Composed) -> SnapshotObject {
    let Version { epoch, revision } = composed.version;
    sealed(
        network,
        SnapshotObject {
            kind: ObjectKind::Network,
            id: String::new(),
            revision,
            epoch,
            body: composed.text.to_string(),
            sha256: String::new(),
        },
    )
}

fn object(network: &str, change: LoggedChange) -> SnapshotObject {
    sealed(
        network,
        SnapshotObject {
            kind: change.kind,
            id: change.id,
            revision: change.revision,
            epoch: change.epoch,
            body: change.body.unwrap_or_default(),
            sha256: String::new(),
        },
    )
}

fn sealed(network: &str, mut object: SnapshotObject) -> SnapshotObject {
    object.sha256 = object.digest(network);
    object
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_gives_its_cursor_back_and_nothing_else_is_one() {
        let afters = [
            None,
            Some((ObjectKind::Zone, "a b /ü".to_owned())),
            Some((ObjectKind::Weather, String::new())),
        ];
        for after in afters {
            let cursor = Cursor {
                epoch: 3,
                revision: 70,
                after,
            };
            assert_eq!(Cursor::read(&cursor.token()), Some(cursor));
        }
        for wrong in ["", "x", "3 70 zone", "3 x zone a", "3 70 hill a"] {
            assert_eq!(Cursor::read(&token(wrong)), None, "{wrong}");
            assert_eq!(Cursor::read(wrong), None, "{wrong}");
        }
    }
}
